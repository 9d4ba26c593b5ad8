//! From which similarity on a run does what a descriptor says, told by runs of which it is known.
//!
//! The threshold is the one that separates the runs that do from those that do not with the fewest errors, both kinds
//! of error counting alike; how it would do on runs it has not seen is told by cross-validation. And a limit of its own
//! says where a run is unlike anything known: less like every run of the study than nearly all of them are like their
//! nearest neighbour.

use crate::Error;
use crate::descriptor::{Calibration, Descriptor};
use crate::features::{Features, Samples};
use crate::similarity::{Comparer, Metric, SimilarityOptions};
use crate::study::{Loaded, Rows};
use crate::target::Target;
use crate::vector::{product, unit};

/// The largest number of folds.
const FOLDS: usize = 10;
/// Share of the known runs that may be called unlike anything known.
const UNKNOWN_SHARE: f64 = 0.01;

/// Calibrates a descriptor. `right`: whether a run does what the descriptor says; `None` for runs that do not count.
///
/// # Errors
/// [`Error::TooFewRuns`] with fewer than three runs of either kind; [`Error::Value`] for a measure other than the
/// cosine, whose similarities have no common scale; reading errors.
pub fn calibrate(
    loaded: &Loaded,
    descriptor: &Descriptor,
    options: SimilarityOptions,
    right: impl Fn(&str) -> Option<bool>,
) -> Result<Calibration, Error> {
    if options.metric != Metric::Cosine {
        return Err(Error::Value {
            name: "--metric",
            value: "another measure".into(),
            expected: "cosine: a calibration is for similarities of one kind".into(),
        });
    }
    let comparer = Comparer::new(loaded, descriptor, options)?;
    let samples = comparer.features().read(&loaded.study, Rows::Last)?;
    let (mut yes, mut no) = (Vec::new(), Vec::new());
    for row in (0..samples.rows()).filter(|&row| samples.run(row) != descriptor.run) {
        let similarity = comparer.score(&samples.stored(row)).similarity;
        match right(samples.run(row)) {
            Some(true) => yes.push(similarity),
            Some(false) => no.push(similarity),
            None => {}
        }
    }
    for (what, have) in [
        ("calibration with runs that do what the descriptor says", yes.len()),
        ("calibration with runs that do something else", no.len()),
    ] {
        if have < 3 {
            return Err(Error::TooFewRuns { what, needed: 3, have });
        }
    }
    let folds = FOLDS.min(yes.len()).min(no.len());
    let (mut passed, mut failed) = (0, 0);
    for fold in 0..folds {
        // Runs come in the order of their ids, which often follows the inputs: every fold gets some of each.
        let split = |values: &[f64]| -> (Vec<f64>, Vec<f64>) {
            let (held, kept): (Vec<_>, Vec<_>) = values.iter().enumerate().partition(|(at, _)| at % folds == fold);
            (kept.into_iter().map(|(_, x)| *x).collect(), held.into_iter().map(|(_, x)| *x).collect())
        };
        let ((yes, held_yes), (no, held_no)) = (split(&yes), split(&no));
        let threshold = separate(&yes, &no);
        passed += held_no.iter().filter(|&&x| x >= threshold).count();
        failed += held_yes.iter().filter(|&&x| x < threshold).count();
    }
    Ok(Calibration {
        kind: options.kind_for(descriptor),
        threshold: separate(&yes, &no),
        right: yes.len(),
        wrong: no.len(),
        folds,
        false_pass: passed as f64 / no.len() as f64,
        false_fail: failed as f64 / yes.len() as f64,
        known: Known::new(comparer.features(), &samples).limit(),
    })
}

/// The threshold with the smallest sum of the two error rates, in the middle of the gap where it lies.
fn separate(yes: &[f64], no: &[f64]) -> f64 {
    let mut all: Vec<(f64, bool)> = yes.iter().map(|&x| (x, true)).chain(no.iter().map(|&x| (x, false))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (gain, loss) = (1.0 / no.len().max(1) as f64, 1.0 / yes.len().max(1) as f64);
    // Starts below everything: all pass. Each step lets one more fail.
    let mut error = 1.0;
    let (mut best, mut threshold) = (error, all.first().map_or(0.0, |first| first.0));
    for pair in all.windows(2) {
        error += if pair[0].1 { loss } else { -gain };
        // Of equal choices the middle one of the widest gap would be as good; the first is taken.
        if error < best - 1e-12 && pair[1].0 > pair[0].0 {
            best = error;
            threshold = f64::midpoint(pair[0].0, pair[1].0);
        }
    }
    threshold
}

/// The last states of a study's runs, by what a descriptor compares: they tell whether a state is like anything known.
#[derive(Debug, Clone)]
pub struct Known {
    features: Features,
    /// Run id and numbers of length 1.
    runs: Vec<(String, Vec<f64>)>,
}

impl Known {
    /// Reads them once for any number of questions.
    ///
    /// # Errors
    /// Reading errors.
    pub fn of(loaded: &Loaded, comparer: &Comparer) -> Result<Self, Error> {
        let features = comparer.features();
        Ok(Self::new(features, &features.read(&loaded.study, Rows::Last)?))
    }

    fn new(features: &Features, samples: &Samples) -> Self {
        Self { features: features.clone(), runs: features.directions(samples) }
    }

    /// How like the most like run a state is, −1 to 1; its own run does not count.
    ///
    /// # Errors
    /// [`Error::UnknownField`] if it lacks what is compared.
    pub fn nearest(&self, target: &Target) -> Result<f64, Error> {
        let numbers = unit(self.features.vector(&self.features.sample(target)?.stored(0)));
        Ok(self.nearest_to(&numbers, &target.run))
    }

    /// The similarity to the nearest neighbour that nearly all of them reach.
    fn limit(&self) -> f64 {
        let mut nearest: Vec<f64> = self.runs.iter().map(|(run, numbers)| self.nearest_to(numbers, run)).collect();
        nearest.sort_by(f64::total_cmp);
        nearest[(UNKNOWN_SHARE * nearest.len() as f64).floor() as usize]
    }

    fn nearest_to(&self, numbers: &[f64], without: &str) -> f64 {
        let others = self.runs.iter().filter(|(run, _)| run != without);
        others.map(|(_, other)| product(numbers, other)).fold(-1.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_lies_in_the_gap() {
        assert_eq!(separate(&[0.9, 0.8], &[0.1, 0.2, 0.4]), f64::midpoint(0.4, 0.8));
        // One that does not among those that do: one error either way; of these the first.
        let threshold = separate(&[0.9, 0.8, 0.7], &[0.1, 0.2, 0.75]);
        assert!((0.2..0.7).contains(&threshold), "{threshold}");
    }

    #[test]
    fn nothing_to_separate_passes_everything() {
        assert_eq!(separate(&[0.5, 0.5], &[0.5]), 0.5);
    }
}
