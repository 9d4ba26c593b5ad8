//! One state of one run, named by the user: `run_007`, `run_007@3`, `run_007@last`, or the path of a file that is
//! not in the study.

use std::path::Path;

use crate::Error;
use crate::basis::coefficients;
use crate::bundle;
use crate::field::Field;
use crate::project::{ProjectedState, project};
use crate::rotation;
use crate::run::Run;
use crate::study::{Coefficients, Function, Loaded, Need, Rows, Study, triples};
use crate::vector::{Vector, subtract};

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
    /// ρ of the rotation field, K × 3.
    pub rotation: Vec<[f64; 3]>,
    /// Root mean square displacement over the surface, in the length unit.
    pub rms: f64,
    /// Root mean square of sin θ of the rotation field over the surface.
    pub turn: f64,
    /// Coefficients of the fields that the study keeps, K × components each.
    pub fields: Vec<(Field, Vec<f32>)>,
    /// What was noticed about the run: a cut file, a displacement that is mostly rigid.
    pub warnings: Vec<String>,
}

impl Target {
    /// A state that was just projected.
    pub(crate) fn of_state(run: String, state: usize, found: ProjectedState, warnings: Vec<String>) -> Self {
        Self {
            run,
            state,
            time: found.time,
            delta: triples(&found.delta),
            rotation: triples(&found.rotation),
            rms: found.measures.rms,
            turn: found.measures.turn,
            fields: found.fields,
            warnings,
        }
    }

    /// A state of a run that is not in the study and was projected by itself.
    pub fn projected(run: &str, state: usize, found: ProjectedState) -> Self {
        Self::of_state(run.to_owned(), state, found, Vec::new())
    }

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

    /// What a comparison needs of it: one row, as if it stood in a study.
    ///
    /// # Errors
    /// [`Error::UnknownField`] if the study does not keep the function.
    pub fn on(&self, need: &Need) -> Result<Coefficients, Error> {
        let (function, all) = (need.function, self.values(need.function)?);
        let components = function.components();
        let eigenvectors = need.eigenvectors.clone().unwrap_or_else(|| (1..=all.len() / components).collect());
        let rms = match function {
            Function::Displacement => vec![self.rms],
            Function::Rotation => vec![self.turn],
            Function::Field(_) => Vec::new(),
        };
        Ok(Coefficients {
            function,
            runs: vec![self.run.clone()],
            states: vec![self.state as u32],
            times: vec![self.time],
            rms,
            values: eigenvectors.iter().flat_map(|j| &all[components * (j - 1)..components * j]).copied().collect(),
            eigenvectors,
        })
    }

    /// All K coefficients of a function, K × components.
    ///
    /// # Errors
    /// [`Error::UnknownField`] if the study does not keep it.
    pub fn values(&self, function: Function) -> Result<Vec<f32>, Error> {
        let narrow = |values: &[Vector]| values.iter().flatten().map(|&x| x as f32).collect();
        match function {
            Function::Displacement => Ok(narrow(&self.delta)),
            Function::Rotation => Ok(narrow(&self.rotation)),
            Function::Field(asked) => {
                let found = self.fields.iter().find(|(field, _)| *field == asked);
                found
                    .map(|(_, values)| values.clone())
                    .ok_or_else(|| unknown_field(asked, self.fields.iter().map(|(field, _)| *field)))
            }
        }
    }
}

/// A field that is not among those that the study keeps.
pub(crate) fn unknown_field(asked: Field, kept: impl Iterator<Item = Field>) -> Error {
    let names: Vec<String> = kept.map(|field| field.to_string()).collect();
    let available = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    Error::UnknownField { asked: asked.to_string(), available }
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
        let read = |function| study.coefficients_of(function, None, Rows::Run(&named.run));
        let (rows, turned) = (read(Function::Displacement)?, read(Function::Rotation)?);
        let state = state_of(named, rows.rows())?;
        let fields = study.settings().fields.iter();
        let fields = fields.map(|field| Ok((*field, read(Function::Field(*field))?.row(state).to_vec())));
        return Ok(Target {
            run: named.run.clone(),
            state,
            time: rows.times[state],
            delta: rows.triples(state),
            rotation: turned.triples(state),
            rms: rows.rms[state],
            turn: turned.rms[state],
            fields: fields.collect::<Result<_, Error>>()?,
            warnings: study.record(&named.run)?.warnings.clone(),
        });
    }
    let run = open_outside(study, &named.run)?;
    let mut projected = project(&run, &loaded.reference, &loaded.basis, &study.settings().fields, &())?;
    let state = state_of(named, projected.states.len())?;
    let found = projected.states.swap_remove(state);
    Ok(Target::of_state(projected.run, state, found, projected.warnings))
}

/// How many states a run has, of the study or at that path.
///
/// # Errors
/// [`Error::UnknownRun`] and reading errors.
pub fn states(study: &Study, named: &Named) -> Result<usize, Error> {
    match study.manifest().runs.get(&named.run) {
        Some(record) => Ok(record.times.len()),
        None => Ok(open_outside(study, &named.run)?.times().len()),
    }
}

/// Positions of a target on the mesh, N × 3, read from its result file.
///
/// # Errors
/// [`Error::UnknownRun`]; [`Error::RunChanged`] if the file holds another shape than the coefficients say, so that old
/// and new are never mixed; reading errors.
pub fn shape(loaded: &Loaded, named: &Named, target: &Target) -> Result<Vec<[f64; 3]>, Error> {
    on_surface(loaded, named, target, Function::Displacement)
}

/// A function of a target on the mesh, N × 3, read from its result file: positions for [`Function::Displacement`], else
/// the field (a scalar in the first place).
///
/// # Errors
/// As [`shape`], and [`Error::NoField`].
pub fn on_surface(loaded: &Loaded, named: &Named, target: &Target, function: Function) -> Result<Vec<[f64; 3]>, Error> {
    let Loaded { study, reference, basis, .. } = loaded;
    let run = match study.manifest().runs.get(&named.run) {
        Some(record) => Run::open(&named.run, &record.path)?,
        None => open_outside(study, &named.run)?,
    };
    if target.state >= run.times().len() {
        return Err(Error::RunChanged { run: target.run.clone() });
    }
    let placement = reference.place(&run)?;
    let shape = reference.shape(&run, &placement, target.state)?;
    let displacement: Vec<Vector> =
        shape.iter().zip(reference.mesh.vertices()).map(|(p, q)| subtract(*p, *q)).collect();
    let now = coefficients(basis, &displacement);
    let square = |values: &[[f64; 3]]| values.as_flattened().iter().map(|x| x * x).sum::<f64>();
    let change: f64 = now.as_flattened().iter().zip(target.delta.as_flattened()).map(|(a, b)| (a - b).powi(2)).sum();
    // Stored coefficients are f32: each is off by at most 6e-8 of itself.
    if change > 1e-12 * square(&now).max(square(&target.delta)) {
        return Err(Error::RunChanged { run: target.run.clone() });
    }
    match function {
        Function::Displacement => Ok(shape),
        Function::Rotation => Ok(rotation::field(reference.mesh.triangles(), reference.mesh.vertices(), &shape)),
        Function::Field(field) => reference.field(&run, &placement, field, target.state),
    }
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
