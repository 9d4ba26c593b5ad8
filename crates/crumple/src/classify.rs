//! Which mode a run belongs to, with a margin, or none.
//!
//! Runs are compared by the angle between their numbers (rotation spectrum, or all K coefficients of the
//! displacement). A run's score for a mode is its mean similarity to the mode's [`NEIGHBOURS`] nearest members. It is
//! refused where it is less like every mode than nearly all known members are like their own, left out of it.

use rayon::prelude::*;
use serde::Serialize;

use crate::Error;
use crate::features::Features;
use crate::modes::Modes;
use crate::select::Kind;
use crate::study::{Loaded, Rows};
use crate::target::Target;
use crate::vector::{product, unit};

/// Members of a mode that a run is compared with: the nearest ones.
pub const NEIGHBOURS: usize = 5;
/// Share of known members that may be refused as unlike their own mode.
const REFUSED_SHARE: f64 = 0.02;

/// Knows the members of every mode.
#[derive(Debug, Clone)]
pub struct Classifier {
    features: Features,
    names: Vec<String>,
    /// Members of each mode: run id and numbers of length 1.
    members: Vec<Vec<(String, Vec<f64>)>>,
    /// The score below which a run is unlike the mode.
    accepted: Vec<f64>,
    /// What classifying the known members themselves would get wrong.
    pub evidence: Evidence,
}

/// How well a classifier does on the runs it knows, each left out in turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Evidence {
    /// Runs that were left out in turn.
    pub runs: usize,
    /// Those assigned to another mode than their own.
    pub wrong: usize,
    /// Those refused.
    pub refused: usize,
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// The mode; null where the run is unlike all of them.
    pub mode: Option<String>,
    /// The mode it is most like, in any case.
    pub nearest: String,
    /// Mean similarity to the nearest members of that mode, −1 to 1.
    pub score: f64,
    /// How much more it is like that mode than like the next one; null with one mode.
    pub margin: Option<f64>,
    /// The smallest score that the nearest mode takes; −∞ (null in JSON) for a mode of one run, which takes any.
    pub accepted: f64,
    /// Score for every mode, best first.
    pub scores: Vec<(String, f64)>,
    /// The known run that it is most like, with the similarity.
    pub like: (String, f64),
}

impl Classifier {
    /// Learns the members of the modes.
    ///
    /// # Errors
    /// [`Error::NoModes`] without members, reading errors.
    pub fn of(loaded: &Loaded, modes: &Modes, kind: Kind) -> Result<Self, Error> {
        let features = match kind {
            Kind::Rotation => Features::rotation(&loaded.basis),
            Kind::Paper => Features::displacement(&loaded.basis),
        };
        let samples = features.read(&loaded.study, Rows::Last)?;
        let all = features.directions(&samples);
        let of_mode = |members: &[String]| -> Vec<(String, Vec<f64>)> {
            all.iter().filter(|(run, _)| members.binary_search(run).is_ok()).cloned().collect()
        };
        let mut names = Vec::new();
        let mut members = Vec::new();
        for mode in &modes.modes {
            let found = of_mode(&mode.members);
            if !found.is_empty() {
                names.push(mode.name.clone());
                members.push(found);
            }
        }
        if names.is_empty() {
            return Err(Error::NoModes);
        }
        let evidence = Evidence { runs: 0, wrong: 0, refused: 0 };
        let accepted = vec![f64::NEG_INFINITY; names.len()];
        let mut classifier = Self { features, names, members, accepted, evidence };
        classifier.learn();
        Ok(classifier)
    }

    /// Finds the limits, and what they would do to the known members.
    fn learn(&mut self) {
        let places: Vec<(usize, usize)> =
            (0..self.members.len()).flat_map(|mode| (0..self.members[mode].len()).map(move |at| (mode, at))).collect();
        let scores: Vec<Vec<f64>> = places
            .par_iter()
            .map(|&(mode, at)| {
                let (run, numbers) = &self.members[mode][at];
                (0..self.members.len()).map(|other| self.score(other, numbers, Some(run))).collect()
            })
            .collect();
        for mode in 0..self.members.len() {
            let of_mode = places.iter().zip(&scores).filter(|((own, _), _)| *own == mode);
            let mut own: Vec<f64> = of_mode.map(|(_, scores)| scores[mode]).filter(|score| score.is_finite()).collect();
            own.sort_by(f64::total_cmp);
            let at = (REFUSED_SHARE * own.len() as f64).floor() as usize;
            // A mode of one run says nothing of how far its members lie apart: any score is taken.
            self.accepted[mode] = own.get(at).copied().unwrap_or(f64::NEG_INFINITY);
        }
        let mut evidence = Evidence { runs: 0, wrong: 0, refused: 0 };
        for ((mode, _), scores) in places.iter().zip(&scores).filter(|((mode, _), _)| self.members[*mode].len() > 1) {
            let best = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]).then(b.cmp(&a))).unwrap_or(0);
            evidence.runs += 1;
            if scores[best] < self.accepted[best] {
                evidence.refused += 1;
            } else if best != *mode {
                evidence.wrong += 1;
            }
        }
        self.evidence = evidence;
    }

    /// Mean similarity to the nearest members of a mode, without the run named; −∞ where nothing is left.
    fn score(&self, mode: usize, numbers: &[f64], without: Option<&str>) -> f64 {
        let others = self.members[mode].iter().filter(|(run, _)| without != Some(run.as_str()));
        let mut near: Vec<f64> = others.map(|(_, other)| product(numbers, other)).collect();
        near.sort_by(|a, b| b.total_cmp(a));
        near.truncate(NEIGHBOURS);
        if near.is_empty() { f64::NEG_INFINITY } else { near.iter().sum::<f64>() / near.len() as f64 }
    }

    /// Classifies a state that was named or projected; a member of a mode is compared with the others.
    ///
    /// # Errors
    /// [`Error::UnknownField`].
    pub fn classify(&self, target: &Target) -> Result<Verdict, Error> {
        let numbers = unit(self.features.vector(&self.features.sample(target)?.stored(0)));
        let without = Some(target.run.as_str());
        let mut order: Vec<(usize, f64)> =
            (0..self.names.len()).map(|mode| (mode, self.score(mode, &numbers, without))).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        order.retain(|(_, score)| score.is_finite());
        let Some(&(nearest, score)) = order.first() else {
            return Err(Error::TooFewRuns { what: "classifying a run that is the only one", needed: 2, have: 1 });
        };
        let others = self.members.iter().flatten().filter(|(run, _)| without != Some(run.as_str()));
        let like = others
            .map(|(run, other)| (run.clone(), product(&numbers, other)))
            .max_by(|a, b| a.1.total_cmp(&b.1).then_with(|| b.0.cmp(&a.0)));
        let accepted = self.accepted[nearest];
        Ok(Verdict {
            mode: (score >= accepted).then(|| self.names[nearest].clone()),
            nearest: self.names[nearest].clone(),
            score,
            margin: order.get(1).map(|(_, second)| score - second),
            accepted,
            scores: order.iter().map(|&(mode, score)| (self.names[mode].clone(), score)).collect(),
            like: like.unwrap_or_default(),
        })
    }
}
