//! One state of one run, named by the user: `run_007`, `run_007@3`, `run_007@last`, or the path of a file that is
//! not in the study.

use std::path::Path;

use crate::Error;
use crate::basis::coefficients;
use crate::bundle;
use crate::project::project;
use crate::run::Run;
use crate::study::{Loaded, Rows, Study, triples};

/// A run and a state as they were written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// Run id or path.
    pub run: String,
    /// State counted from 0; `None` is the last one.
    pub state: Option<usize>,
}

/// A state with its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Run id.
    pub run: String,
    /// State, counted from 0.
    pub state: usize,
    /// Time.
    pub time: f64,
    /// δ, K × 3.
    pub delta: Vec<[f64; 3]>,
    /// What was noticed about the run: a cut file, a displacement that is mostly rigid.
    pub warnings: Vec<String>,
}

impl Target {
    /// What makes this state hard to compare with a descriptor's: warnings about its run, and another time.
    pub fn caveats(&self, descriptor_time: f64) -> Vec<String> {
        let mut caveats = self.warnings.clone();
        if (self.time - descriptor_time).abs() > 0.05 * descriptor_time.abs() {
            caveats.push(format!(
                "its state is at time {}, the descriptor's at {}",
                self.time as f32, descriptor_time as f32
            ));
        }
        caveats
    }

    /// δ on the named eigenvectors (counted from 1), 3 numbers each.
    pub fn on(&self, eigenvectors: &[usize]) -> Vec<f32> {
        eigenvectors.iter().flat_map(|&j| self.delta[j - 1]).map(|x| x as f32).collect()
    }
}

impl Named {
    /// What the user means in a study: a run whose id is the whole text, @ and all, or `RUN@STATE`.
    pub fn in_study(study: &Study, text: &str) -> Self {
        if study.manifest().runs.contains_key(text) {
            Self { run: text.to_owned(), state: None }
        } else {
            Self::parse(text)
        }
    }

    /// Reads `RUN` or `RUN@STATE`. A name with an @ that is followed by something else is a name.
    pub fn parse(text: &str) -> Self {
        let whole = || Self { run: text.to_owned(), state: None };
        match text.rsplit_once('@') {
            Some((run, "last")) if !run.is_empty() => Self { run: run.to_owned(), state: None },
            Some((run, state)) if !run.is_empty() => {
                state.parse().map_or_else(|_| whole(), |state| Self { run: run.to_owned(), state: Some(state) })
            }
            _ => whole(),
        }
    }
}

/// Finds a state: in the study by run id, else by projecting the file at that path (nothing is added to the study).
///
/// # Errors
/// [`Error::UnknownRun`], [`Error::UnknownState`], and what projecting a file returns.
pub fn resolve(loaded: &Loaded, named: &Named) -> Result<Target, Error> {
    let study = &loaded.study;
    if study.manifest().runs.contains_key(&named.run) {
        let rows = study.coefficients(None, Rows::Run(&named.run))?;
        let state = state_of(named, rows.rows())?;
        let delta = rows.triples(state);
        let warnings = study.record(&named.run)?.warnings.clone();
        return Ok(Target { run: named.run.clone(), state, time: rows.times[state], delta, warnings });
    }
    let run = open_outside(study, &named.run)?;
    let projected = project(&run, &loaded.reference, &loaded.basis, &())?;
    let state = state_of(named, projected.states.len())?;
    let found = &projected.states[state];
    let delta = triples(&found.delta);
    Ok(Target { run: projected.run, state, time: found.time, delta, warnings: projected.warnings })
}

/// Positions of a target on the mesh, N × 3, read from its result file.
///
/// # Errors
/// [`Error::UnknownRun`]; [`Error::RunChanged`] if the file holds another shape than the coefficients say, so that old
/// and new are never mixed; reading errors.
pub fn shape(loaded: &Loaded, named: &Named, target: &Target) -> Result<Vec<[f64; 3]>, Error> {
    let Loaded { study, reference, basis, .. } = loaded;
    let run = match study.manifest().runs.get(&named.run) {
        Some(record) => Run::open(&named.run, &record.path)?,
        None => open_outside(study, &named.run)?,
    };
    if target.state >= run.times().len() {
        return Err(Error::RunChanged { run: target.run.clone() });
    }
    let shape = reference.shape(&run, &reference.place(&run)?, target.state)?;
    let displacement: Vec<[f64; 3]> =
        shape.iter().zip(reference.mesh.vertices()).map(|(p, q)| std::array::from_fn(|c| p[c] - q[c])).collect();
    let now = coefficients(basis, &displacement);
    let square = |values: &[[f64; 3]]| values.as_flattened().iter().map(|x| x * x).sum::<f64>();
    let change: f64 = now.as_flattened().iter().zip(target.delta.as_flattened()).map(|(a, b)| (a - b).powi(2)).sum();
    // Stored coefficients are f32: each is off by at most 6e-8 of itself.
    if change > 1e-12 * square(&now).max(square(&target.delta)) {
        return Err(Error::RunChanged { run: target.run.clone() });
    }
    Ok(shape)
}

fn state_of(named: &Named, states: usize) -> Result<usize, Error> {
    let unknown = |state: String| Error::UnknownState { run: named.run.clone(), state, states };
    match named.state {
        Some(state) if state >= states => Err(unknown(state.to_string())),
        Some(state) => Ok(state),
        None => states.checked_sub(1).ok_or_else(|| unknown("last".into())),
    }
}

fn open_outside(study: &Study, path: &str) -> Result<Run, Error> {
    if !Path::new(path).exists() {
        study.record(path)?;
    }
    let found = bundle::find(&[path.into()])?;
    match &found[..] {
        [only] => Run::open(&only.id, &only.path),
        several => Err(Error::Value {
            name: "RUN",
            value: path.to_owned(),
            expected: format!("one run; this folder holds {}", several.len()),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_named_after_the_last_at_sign() {
        let named = |run: &str, state| Named { run: run.into(), state };
        assert_eq!(Named::parse("run_007"), named("run_007", None));
        assert_eq!(Named::parse("run_007@3"), named("run_007", Some(3)));
        assert_eq!(Named::parse("run_007@last"), named("run_007", None));
        assert_eq!(Named::parse("a@b/run"), named("a@b/run", None));
        assert_eq!(Named::parse("a@b@2"), named("a@b", Some(2)));
        assert_eq!(Named::parse("@2"), named("@2", None));
    }
}
