//! The floor of the rule from the runs that are known: how far the members of the descriptor's mode stray from its path.
//!
//! At every state of the target's path the floor is the 5 % quantile of its members' similarities there, or a twentieth of
//! the way from 1 to the other modes' where the members lie closer together than that. What that rule
//! would have done is told beside it: how many members it would stop, each judged by a floor made without it, and how
//! many of the runs of other modes.

use serde::Serialize;

use super::{Monitor, Rule, Track, Tracker, Verdict};
use crate::Error;
use crate::descriptor::Descriptor;
use crate::modes;
use crate::similarity::cosine;
use crate::study::{Loaded, Rows};

/// Share of the members that lie below the floor at any one state.
pub const QUANTILE: f64 = 0.05;

/// A run that is twenty times nearer to the target than the runs of other modes are is on its path, however close to it the
/// members that are known lie: states are interpolated, and files are rounded.
const NEAR: f64 = 0.05;

/// Fewer members than this, beside the target, tell nothing about a band.
const MEMBERS_MIN: usize = 3;

/// A rule and what it would have done to the runs of the study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// The rule.
    #[serde(flatten)]
    pub rule: Rule,
    /// The mode whose members made it.
    pub mode: String,
    /// Its members, but for the target.
    pub members: usize,
    /// Members that a rule made without them would stop.
    pub members_stopped: usize,
    /// Runs of other modes.
    pub others: usize,
    /// Of these, stopped by the rule.
    pub others_stopped: usize,
    /// Median over the others that are stopped of how far they had come, as a share of the target's path.
    pub others_stopped_at: Option<f64>,
}

/// Finds the rule. `rule`: what else it says; its floor is replaced.
///
/// # Errors
/// [`Error::Value`] naming `--tolerance` where the descriptor's run is in no mode, or in one of fewer than four runs;
/// reading errors.
pub fn calibrate(
    loaded: &Loaded,
    tracker: &Tracker<'_>,
    descriptor: &Descriptor,
    target: &Track,
    rule: &Rule,
) -> Result<Calibration, Error> {
    let explicit = |why: String| Error::Value {
        name: "--tolerance",
        value: "not given".into(),
        expected: format!("a number from 0 to 2, the largest 1 − similarity: {why}"),
    };
    let modes = match modes::load(&loaded.study) {
        Err(Error::NoModes) => return Err(explicit("the study has no modes to take it from".into())),
        other => other?,
    };
    let named = descriptor.mode.as_deref().and_then(|name| modes.mode(name).ok());
    let holds = |mode: &&modes::Mode| mode.members.contains(&descriptor.run);
    let Some(mode) = named.filter(holds).or_else(|| modes.modes.iter().find(holds)) else {
        return Err(explicit(format!("{} is in no mode of the study", descriptor.run)));
    };
    let (mut members, mut others) = (Vec::new(), Vec::new());
    for (run, track) in tracker.tracks(Rows::All)? {
        if run == descriptor.run {
            continue;
        }
        if mode.members.contains(&run) { members.push(track) } else { others.push(track) }
    }
    if members.len() < MEMBERS_MIN {
        return Err(explicit(format!(
            "{} has {} runs beside {}, too few to take it from",
            mode.name,
            members.len(),
            descriptor.run
        )));
    }
    let bands: Vec<Vec<Option<f64>>> = members.iter().map(|member| similarities(target, member)).collect();
    let far: Vec<Vec<Option<f64>>> = others.iter().map(|other| similarities(target, other)).collect();
    let far: Vec<Option<f64>> = (0..target.places().len()).map(|state| median(&far, state)).collect();
    let with = |left_out: Option<usize>| {
        let kept = bands.iter().enumerate().filter(|(at, _)| Some(*at) != left_out).map(|(_, band)| band);
        Rule { floor: floor(target, &kept.collect::<Vec<_>>(), &far), ..rule.clone() }
    };
    let stopped_at = |track: &Track, rule: Rule| {
        let mut monitor = Monitor::new(target.clone(), rule);
        let places = track.places().iter().take_while(|place| place.at <= target.reach());
        let mut steps = places.map(|place| monitor.step(place.at, &place.numbers));
        steps.find(|step| step.verdict == Verdict::Diverged).map(|step| step.at / target.end())
    };
    let rule = with(None);
    let mut caught: Vec<f64> = others.iter().filter_map(|track| stopped_at(track, rule.clone())).collect();
    caught.sort_by(f64::total_cmp);
    Ok(Calibration {
        mode: mode.name.clone(),
        members: members.len(),
        members_stopped: (0..).zip(&members).filter(|(at, track)| stopped_at(track, with(Some(*at))).is_some()).count(),
        others: others.len(),
        others_stopped: caught.len(),
        others_stopped_at: caught.get(caught.len() / 2).copied(),
        rule,
    })
}

/// A run's similarity to the target at each of the target's states that it has reached.
fn similarities(target: &Track, run: &Track) -> Vec<Option<f64>> {
    let at = |place: &super::Place| {
        let reached = place.at <= run.reach();
        run.at(place.at).filter(|_| reached).map(|own| cosine(&place.numbers, &own.numbers))
    };
    target.places().iter().map(at).collect()
}

/// Median similarity of the runs that reached a state of the target.
fn median(bands: &[Vec<Option<f64>>], state: usize) -> Option<f64> {
    let mut values: Vec<f64> = bands.iter().filter_map(|band| band[state]).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The quantile at each state of the target that any run reached. `far`: how similar runs of other modes are there.
fn floor(target: &Track, bands: &[&Vec<Option<f64>>], far: &[Option<f64>]) -> Vec<(f64, f64)> {
    let at = |(state, place): (usize, &super::Place)| {
        let mut values: Vec<f64> = bands.iter().filter_map(|band| band[state]).collect();
        values.sort_by(f64::total_cmp);
        let lowest = (QUANTILE * (values.len() as f64 - 1.0)).max(0.0);
        let (below, share) = (lowest as usize, lowest.fract());
        let value = |at: usize| values.get(at).or(values.last()).copied();
        let quantile = value(below)? * (1.0 - share) + share * value(below + 1)?;
        let near = far[state].map_or(1.0, |far| 1.0 - NEAR * (1.0 - far));
        Some((place.at, quantile.min(near)))
    };
    let floor: Vec<(f64, f64)> = target.places().iter().enumerate().filter_map(at).collect();
    if floor.is_empty() { vec![(0.0, 0.0)] } else { floor }
}
