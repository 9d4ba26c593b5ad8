//! Building a descriptor: choose, take the values, reconstruct, and do the same with the rivals.

use std::path::Path;

use super::subject::{Subject, triples_of};
use super::{DescribeOptions, Descriptor, FIRST_M, PCA, Rival, Selected, Selection, Threshold};
use crate::Error;
use crate::basis::{Basis, synthesize};
use crate::modes;
use crate::reconstruct::{Errors, displaced, errors, field_errors, reconstruct};
use crate::rivals::Pca;
use crate::rotation::{RotationSpectrum, Ruler};
use crate::select::{Kind, Select};
use crate::study::{Coefficients, Function, Loaded, Rows};
use crate::target::{Named, Target, on_surface};
use crate::vector::{Vector, square};

/// A descriptor with the shapes that show it.
#[derive(Debug, Clone)]
pub struct Described {
    /// The descriptor.
    pub descriptor: Descriptor,
    /// The original of its first function, N × 3.
    pub original: Vec<[f64; 3]>,
    /// All K coefficients of it that were compared with t, K × 3.
    pub values: Vec<[f64; 3]>,
    /// The descriptor's reconstruction, N × 3.
    pub reconstruction: Vec<[f64; 3]>,
    /// The first M eigenvectors', N × 3.
    pub first_m: Vec<[f64; 3]>,
    /// All K eigenvectors', N × 3.
    pub first_k: Vec<[f64; 3]>,
}

/// Builds the descriptor of one state or of a mode, reconstructs from it, and does the same with the rivals. Without a
/// name it is called after the run, with the state where one was asked for.
///
/// # Errors
/// [`Error::Threshold`], [`Error::UnknownField`], and errors of reading the states.
pub fn describe(
    loaded: &Loaded,
    named: &Named,
    mode: Option<&str>,
    name: Option<&str>,
    options: &DescribeOptions,
) -> Result<Described, Error> {
    let subject = Subject::of(loaded, named, mode, options.set)?;
    let mut drawn = Vec::new();
    for &function in &options.functions {
        let original = subject.original(loaded, function)?;
        let selected = select(loaded, &subject, function, options, Some(&original))?;
        drawn.push(draw(loaded, &subject, selected, original)?);
    }
    let scales = scales(loaded, &options.functions)?;
    let mut blocks = Vec::new();
    let mut first = None;
    for (mut shown, scale) in drawn.into_iter().zip(scales) {
        shown.selected.scale = scale;
        blocks.push(shown.selected.clone());
        first = first.or(Some(shown));
    }
    let Some(Shown { values, original, reconstruction, first_m, first_k, .. }) = first else {
        return Err(Error::Internal("a descriptor of no function".into()));
    };
    let descriptor = assemble(loaded, &subject, named, mode, name, options, blocks);
    Ok(Described { descriptor, original, values, reconstruction, first_m, first_k })
}

/// The descriptor of one state without what needs its result file: for a question that is asked once. `only`:
/// eigenvectors to compare in place of those that a threshold chooses.
///
/// # Errors
/// As [`describe`], but for reading the result file.
fn wanted(
    loaded: &Loaded,
    named: &Named,
    options: &DescribeOptions,
    only: Option<&[usize]>,
) -> Result<Descriptor, Error> {
    let subject = Subject::of(loaded, named, None, options.set)?;
    let mut blocks = Vec::new();
    for (&function, scale) in options.functions.iter().zip(scales(loaded, &options.functions)?) {
        let mut selected = match only {
            Some(only) => {
                let mut eigenvectors = only.to_vec();
                eigenvectors.sort_unstable();
                eigenvectors.dedup();
                if let Some(beyond) = eigenvectors.iter().find(|j| !(1..=loaded.basis.eigenpairs()).contains(*j)) {
                    return Err(Error::Value {
                        name: "--eigenvectors",
                        value: beyond.to_string(),
                        expected: format!("numbers from 1 to {}", loaded.basis.eigenpairs()),
                    });
                }
                let selection = Selection { eigenvectors, threshold: 0.0 };
                take(loaded, &subject, function, options, selection)?
            }
            None => select(loaded, &subject, function, options, None)?,
        };
        selected.scale = scale;
        blocks.push(selected);
    }
    Ok(assemble(loaded, &subject, named, None, None, options, blocks))
}

/// The descriptor that a word means: one that is saved in the study or at that path, a mode (its medoid), a run of the
/// study or a result file. Modes and runs are described for this question only. `only`: eigenvectors to compare in
/// place of the descriptor's own.
///
/// # Errors
/// [`Error::UnknownDescriptor`], those of [`super::load`], and errors of reading the state.
pub fn find(loaded: &Loaded, word: &str, only: Option<&[usize]>) -> Result<Descriptor, Error> {
    let study = &loaded.study;
    let options = DescribeOptions::default();
    let of_run = |named: &Named| wanted(loaded, named, &options, only);
    match super::load(study, word) {
        Ok(saved) => match only {
            None => Ok(saved),
            Some(_) => {
                let named = Named { run: saved.run.clone(), state: Some(saved.state) };
                let options = DescribeOptions {
                    kind: Kind::Paper,
                    select: saved.selected.select,
                    functions: saved.blocks().map(Selected::function).collect(),
                    ..options
                };
                Ok(Descriptor { name: saved.name, ..wanted(loaded, &named, &options, only)? })
            }
        },
        Err(unknown @ Error::UnknownDescriptor { .. }) => {
            let modes = match modes::load(study) {
                Err(Error::NoModes) => None,
                other => Some(other?),
            };
            if let Some(mode) = modes.as_ref().and_then(|modes| modes.mode(word).ok()) {
                let described = of_run(&Named { run: mode.medoid.clone(), state: None })?;
                return Ok(Descriptor { name: mode.name.clone(), mode: Some(mode.name.clone()), ..described });
            }
            let named = Named::in_study(study, word);
            if study.manifest().runs.contains_key(&named.run) || Path::new(&named.run).exists() {
                return of_run(&named);
            }
            Err(unknown)
        }
        Err(other) => Err(other),
    }
}

fn assemble(
    loaded: &Loaded,
    subject: &Subject,
    named: &Named,
    mode: Option<&str>,
    name: Option<&str>,
    options: &DescribeOptions,
    mut blocks: Vec<Selected>,
) -> Descriptor {
    let target = &subject.target;
    let selected = blocks.remove(0);
    // A field says nothing about rotations.
    let only_shape = selected.field.is_none() && blocks.is_empty();
    let kind = if only_shape { options.kind } else { Kind::Paper };
    Descriptor {
        name: name.map_or_else(|| default_name(target, named), str::to_owned),
        kind,
        basis: loaded.basis.id.clone(),
        run: target.run.clone(),
        state: target.state,
        time: target.time,
        mode: mode.map(str::to_owned),
        set: options.set,
        selected,
        beside: blocks,
        spectrum: spectrum(loaded, subject),
        calibration: None,
    }
}

/// The rotation spectrum of the run, or the mean of the members' spectra.
fn spectrum(loaded: &Loaded, subject: &Subject) -> RotationSpectrum {
    let ruler = Ruler::of(&loaded.basis);
    if !subject.is_mean() {
        return ruler.spectrum(&subject.target.rotation, subject.target.turn);
    }
    let each: Vec<RotationSpectrum> =
        subject.members.iter().map(|(_, member)| ruler.spectrum(&member.rotation, member.turn)).collect();
    RotationSpectrum::mean(&each)
}

fn default_name(target: &Target, named: &Named) -> String {
    let run = target.run.replace(['/', '\\'], "_");
    named.state.map_or(run.clone(), |state| format!("{run}@{state}"))
}

/// Name of the rival that uses all eigenvectors of the study.
pub fn first_k_name(basis: &Basis) -> String {
    format!("first {}", basis.eigenpairs())
}

/// What a threshold looks at: α for coordinates, else the coefficients as they are. K × 3.
fn looked_at(basis: &Basis, function: Function, select: Select, coefficients: &[Vector]) -> Vec<Vector> {
    match function {
        Function::Displacement => select.values(basis, coefficients),
        Function::Rotation | Function::Field(_) => coefficients.to_vec(),
    }
}

/// Chooses J for a function. `original`: the function on the mesh, where it has been read; only `error:` asks for it.
fn select(
    loaded: &Loaded,
    subject: &Subject,
    function: Function,
    options: &DescribeOptions,
    original: Option<&[Vector]>,
) -> Result<Selected, Error> {
    let selection = match subject.share() {
        None => choose(loaded, function, options, &subject.coefficients(function)?, || match original {
            Some(original) => Ok(original.to_vec()),
            None => subject.original(loaded, function),
        })?,
        Some(share) => {
            let mut passed = vec![0_usize; loaded.basis.eigenpairs()];
            let mut threshold = 0.0;
            for (named, member) in &subject.members {
                let own = || on_surface(loaded, named, member, function);
                let found = choose(loaded, function, options, &triples_of(member, function)?, own)?;
                found.eigenvectors.iter().for_each(|j| passed[j - 1] += 1);
                threshold += found.threshold / subject.members.len() as f64;
            }
            let enough = share * subject.members.len() as f64;
            let eigenvectors: Vec<usize> = (1..=passed.len()).filter(|j| passed[j - 1] as f64 >= enough).collect();
            if eigenvectors.is_empty() {
                let what = format!("no eigenvector passes in a share of {share} of the members");
                return Err(Error::Threshold { rule: options.threshold.to_string(), what });
            }
            Selection { eigenvectors, threshold }
        }
    };
    take(loaded, subject, function, options, selection)
}

/// The target's values on a selection.
fn take(
    loaded: &Loaded,
    subject: &Subject,
    function: Function,
    options: &DescribeOptions,
    selection: Selection,
) -> Result<Selected, Error> {
    let basis = &loaded.basis;
    let mut eigenvectors = selection.eigenvectors;
    if options.whole_clusters {
        for (first, last) in split_clusters(basis, &eigenvectors) {
            eigenvectors.extend(first..=last);
        }
        eigenvectors.sort_unstable();
        eigenvectors.dedup();
    }
    let values = looked_at(basis, function, options.select, &subject.coefficients(function)?);
    let components = function.components();
    let on = |values: &[Vector]| eigenvectors.iter().map(|&j| values[j - 1][..components].to_vec()).collect();
    Ok(Selected {
        field: if let Function::Field(field) = function { Some(field) } else { None },
        select: options.select,
        signed: options.signed,
        rule: options.threshold.to_string(),
        threshold: selection.threshold,
        values: on(&values),
        spread: subject.spread(function)?.map(|spread| on(&spread)).unwrap_or_default(),
        scale: 1.0,
        split_clusters: split_clusters(basis, &eigenvectors),
        errors: None,
        rivals: Vec::new(),
        eigenvectors,
    })
}

/// A selection with what it reconstructs.
struct Shown {
    selected: Selected,
    values: Vec<Vector>,
    original: Vec<Vector>,
    reconstruction: Vec<Vector>,
    first_m: Vec<Vector>,
    first_k: Vec<Vector>,
}

fn draw(loaded: &Loaded, subject: &Subject, mut selected: Selected, original: Vec<Vector>) -> Result<Shown, Error> {
    let basis = &loaded.basis;
    let function = selected.function();
    let coefficients = subject.coefficients(function)?;
    let rebuilt = |eigenvectors: &[usize]| rebuilt(loaded, function, selected.select, eigenvectors, &coefficients);
    let errors_of = |found: &[Vector]| errors_of(loaded, function, &original, found);
    let first: Vec<usize> = (1..=basis.eigenpairs()).collect();
    let m = selected.eigenvectors.len();
    let (reconstruction, first_m, first_k) = (rebuilt(&selected.eigenvectors), rebuilt(&first[..m]), rebuilt(&first));
    let rivals = vec![
        Rival { method: FIRST_M.into(), size: m, errors: errors_of(&first_m) },
        Rival { method: first_k_name(basis), size: first.len(), errors: errors_of(&first_k) },
        pca_rival(loaded, function, &coefficients, &original, m)?,
    ];
    let found = errors_of(&reconstruction);
    let values = looked_at(basis, function, selected.select, &coefficients);
    selected.errors = Some(found);
    selected.rivals = rivals;
    Ok(Shown { selected, values, original, reconstruction, first_m, first_k })
}

/// A function on the mesh from some of its coefficients, K × 3: the shape, or the field.
fn rebuilt(
    loaded: &Loaded,
    function: Function,
    select: Select,
    eigenvectors: &[usize],
    coefficients: &[Vector],
) -> Vec<Vector> {
    let (reference, basis) = (&loaded.reference, &loaded.basis);
    match function {
        Function::Displacement => reconstruct(reference, basis, select, eigenvectors, coefficients),
        Function::Rotation | Function::Field(_) => {
            let kept: Vec<Vector> = eigenvectors.iter().map(|&j| coefficients[j - 1]).collect();
            synthesize(basis, eigenvectors, &kept)
        }
    }
}

fn errors_of(loaded: &Loaded, function: Function, original: &[Vector], found: &[Vector]) -> Errors {
    match function {
        Function::Displacement => errors(&loaded.reference, &loaded.basis, original, found),
        Function::Rotation | Function::Field(_) => field_errors(&loaded.basis, original, found),
    }
}

/// Applies a threshold to a state's coefficients, K × 3; `original` reads the function on the mesh, which only `error:`
/// needs.
///
/// The RMS error of a reconstruction follows from Parseval: what lies beyond K, and the coefficients among the K that
/// are left out. Sums of squares, so nothing cancels.
pub(crate) fn choose(
    loaded: &Loaded,
    function: Function,
    options: &DescribeOptions,
    coefficients: &[Vector],
    original: impl FnOnce() -> Result<Vec<Vector>, Error>,
) -> Result<Selection, Error> {
    let basis = &loaded.basis;
    let &DescribeOptions { select, threshold, signed, .. } = options;
    let values = looked_at(basis, function, select, coefficients);
    let is_shape = function == Function::Displacement;
    let beyond = if let Threshold::Error(_) = threshold {
        let all: Vec<usize> = (1..=basis.eigenpairs()).collect();
        errors_of(loaded, function, &original()?, &rebuilt(loaded, function, select, &all, coefficients)).rms
    } else {
        0.0
    };
    let total_mass = basis.total_mass();
    let always = if is_shape { basis.always_in_reconstruction() } else { 1..1 };
    threshold.select(&values, function.components(), signed, |order, m| {
        let left_out = order[m..].iter().filter(|j| !always.contains(j));
        let rest: f64 = left_out.map(|&j| square(values[j - 1])).sum();
        (beyond * beyond + rest / total_mass).sqrt()
    })
}

fn pca_rival(
    loaded: &Loaded,
    function: Function,
    coefficients: &[Vector],
    original: &[Vector],
    components: usize,
) -> Result<Rival, Error> {
    let rows = match function {
        Function::Displacement => loaded.last_states()?,
        Function::Rotation | Function::Field(_) => {
            std::sync::Arc::new(loaded.study.coefficients_of(function, None, Rows::Last)?)
        }
    };
    let pca = Pca::of(&rows, components);
    let width = function.components();
    let flat: Vec<f64> = coefficients.iter().flat_map(|triple| triple[..width].to_vec()).collect();
    let near = pca.approximate(&flat);
    let near: Vec<Vector> =
        near.chunks(width).map(|x| std::array::from_fn(|c| x.get(c).copied().unwrap_or(0.0))).collect();
    let all: Vec<usize> = (1..=loaded.basis.eigenpairs()).collect();
    let made = synthesize(&loaded.basis, &all, &near);
    let made = if function == Function::Displacement { displaced(&loaded.reference, &made) } else { made };
    Ok(Rival { method: PCA.into(), size: pca.components(), errors: errors_of(loaded, function, original, &made) })
}

/// What each function's values are multiplied by: 1 for one function; for several, one over the root mean square
/// distance of the study's last states from their mean, so that each counts alike.
fn scales(loaded: &Loaded, functions: &[Function]) -> Result<Vec<f64>, Error> {
    if functions.len() < 2 {
        return Ok(vec![1.0; functions.len()]);
    }
    let kept = &loaded.study.settings().fields;
    let scale = |&function: &Function| {
        if let Function::Field(field) = function
            && !kept.contains(&field)
        {
            return Err(crate::target::unknown_field(field, kept.iter().copied()));
        }
        let rows = loaded.study.coefficients_of(function, None, Rows::Last)?;
        if rows.rows() < 2 {
            return Err(Error::TooFewRuns { what: "several functions together", needed: 2, have: rows.rows() });
        }
        let spread = spread(&rows);
        Ok(if spread > 0.0 { 1.0 / spread } else { 0.0 })
    };
    functions.iter().map(scale).collect()
}

/// Root mean square distance of the rows from their mean.
fn spread(rows: &Coefficients) -> f64 {
    let count = rows.rows() as f64;
    let mut mean = vec![0.0; rows.width()];
    (0..rows.rows()).for_each(|row| {
        mean.iter_mut().zip(rows.row(row)).for_each(|(mean, &x)| *mean += f64::from(x) / count);
    });
    let far = |row: usize| rows.row(row).iter().zip(&mean).map(|(&x, mean)| (f64::from(x) - mean).powi(2)).sum::<f64>();
    ((0..rows.rows()).map(far).sum::<f64>() / count).sqrt()
}

/// Ranges of nearly equal eigenvalues of which J holds some but not all.
fn split_clusters(basis: &Basis, eigenvectors: &[usize]) -> Vec<(usize, usize)> {
    // The null space is one vector a piece, in closed form, and always rebuilt: nothing in it is arbitrary.
    let ranges =
        basis.facts.clusters.iter().chain(&basis.facts.close).filter(|(_, last)| *last > basis.facts.null_space);
    let mut split: Vec<(usize, usize)> = ranges
        .copied()
        .filter(|&(first, last)| {
            let held = (first..=last).filter(|j| eigenvectors.contains(j)).count();
            held > 0 && held < last + 1 - first
        })
        .collect();
    split.sort_unstable();
    split.dedup();
    split
}
