//! What is described: one state of one run, or a set of runs, the members of a mode.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::Error;
use crate::modes;
use crate::study::{Function, Loaded};
use crate::target::{self, Named, Target};
use crate::vector::Vector;

/// What of a mode a descriptor describes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Set {
    /// The run in its middle.
    #[default]
    Medoid,
    /// The mean of its members, with their spread.
    Mean,
    /// The eigenvectors that matter for at least this share of its members, with the medoid's values.
    Share(f64),
}

/// The states that are described: one, or the last ones of a mode's members.
pub(super) struct Subject {
    named: Named,
    /// The run, or the one in the middle.
    pub(super) target: Target,
    /// The others' states; empty for one run.
    pub(super) members: Vec<(Named, Target)>,
    set: Set,
}

impl Subject {
    pub(super) fn of(loaded: &Loaded, named: &Named, mode: Option<&str>, set: Set) -> Result<Self, Error> {
        let target = target::resolve(loaded, named)?;
        let mut members = Vec::new();
        if let (Some(mode), false) = (mode, set == Set::Medoid) {
            for run in &modes::load(&loaded.study)?.mode(mode)?.members {
                let named = Named { run: run.clone(), state: None };
                let member = target::resolve(loaded, &named)?;
                members.push((named, member));
            }
        }
        Ok(Self { named: named.clone(), target, members, set })
    }

    /// Whether several states are described as one.
    pub(super) fn is_mean(&self) -> bool {
        self.set == Set::Mean && !self.members.is_empty()
    }

    /// The smallest share of members for which an eigenvector must matter.
    pub(super) fn share(&self) -> Option<f64> {
        match self.set {
            Set::Share(share) if !self.members.is_empty() => Some(share),
            _ => None,
        }
    }

    /// All K coefficients, K × 3 (scalars in the first place): of the run, or the mean of the members.
    pub(super) fn coefficients(&self, function: Function) -> Result<Vec<Vector>, Error> {
        if !self.is_mean() {
            return triples_of(&self.target, function);
        }
        let each: Vec<Vec<Vector>> =
            self.members.iter().map(|(_, member)| triples_of(member, function)).collect::<Result<_, _>>()?;
        Ok(mean(&each))
    }

    /// Standard deviation over the members of each of the K coefficients, K × 3.
    pub(super) fn spread(&self, function: Function) -> Result<Option<Vec<Vector>>, Error> {
        if self.members.is_empty() {
            return Ok(None);
        }
        let each: Vec<Vec<Vector>> =
            self.members.iter().map(|(_, member)| triples_of(member, function)).collect::<Result<_, _>>()?;
        let mean = mean(&each);
        let variance = |j: usize, c: usize| {
            each.iter().map(|values| (values[j][c] - mean[j][c]).powi(2)).sum::<f64>() / each.len() as f64
        };
        Ok(Some((0..mean.len()).map(|j| std::array::from_fn(|c| variance(j, c).sqrt())).collect()))
    }

    /// The function on the mesh as the result files hold it, N × 3; the mean of the members for a mean.
    pub(super) fn original(&self, loaded: &Loaded, function: Function) -> Result<Vec<Vector>, Error> {
        if !self.is_mean() {
            return target::on_surface(loaded, &self.named, &self.target, function);
        }
        let read = |(named, member): &(Named, Target)| target::on_surface(loaded, named, member, function);
        Ok(mean(&self.members.iter().map(read).collect::<Result<Vec<_>, _>>()?))
    }
}

/// All K coefficients of a state, K × 3; scalars in the first place.
pub(super) fn triples_of(target: &Target, function: Function) -> Result<Vec<Vector>, Error> {
    match function {
        Function::Displacement => Ok(target.delta.clone()),
        Function::Rotation => Ok(target.rotation.clone()),
        Function::Field(_) => {
            let values = target.values(function)?;
            let of = |values: &[f32]| std::array::from_fn(|c| values.get(c).copied().map_or(0.0, f64::from));
            Ok(values.chunks(function.components()).map(of).collect())
        }
    }
}

fn mean(each: &[Vec<Vector>]) -> Vec<Vector> {
    let mut sum = vec![Vector::default(); each.first().map_or(0, Vec::len)];
    for values in each {
        for (sum, value) in sum.iter_mut().zip(values) {
            (0..3).for_each(|c| sum[c] += value[c] / each.len() as f64);
        }
    }
    sum
}

impl FromStr for Set {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let share = text.strip_prefix("share:").and_then(|share| share.parse::<f64>().ok());
        match (text, share.filter(|share| *share > 0.0 && *share <= 1.0)) {
            ("medoid", _) => Ok(Self::Medoid),
            ("mean", _) => Ok(Self::Mean),
            (_, Some(share)) => Ok(Self::Share(share)),
            _ => Err(Error::Value {
                name: "--set",
                value: text.to_owned(),
                expected: "medoid, mean or share:S with S above 0 and at most 1".into(),
            }),
        }
    }
}

impl TryFrom<String> for Set {
    type Error = Error;

    fn try_from(text: String) -> Result<Self, Error> {
        text.parse()
    }
}

impl From<Set> for String {
    fn from(set: Set) -> Self {
        match set {
            Set::Medoid => "medoid".into(),
            Set::Mean => "mean".into(),
            Set::Share(share) => format!("share:{share}"),
        }
    }
}
