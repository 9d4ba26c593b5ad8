//! The descriptor: the few eigenvectors whose coefficients say how a part deformed, and the target's values on them.
//!
//! The paper's eq. (5): S = { α_j^x, α_j^y, α_j^z | |α_j^x| > t ∨ |α_j^y| > t ∨ |α_j^z| > t }.

mod file;
mod threshold;

use serde::{Deserialize, Serialize};

pub use file::{forget_modes, list, load, save};
pub use threshold::{Selection, Threshold};

use crate::Error;
use crate::basis::Basis;
use crate::reconstruct::{Errors, errors, reconstruct};
use crate::rivals::Pca;
pub use crate::select::Select;
use crate::study::Loaded;
use crate::target::{self, Named, Target};

/// A descriptor, as it is stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Descriptor {
    /// Its name; also the name of its file.
    pub name: String,
    /// The method: `paper`.
    pub kind: String,
    /// Content name of the eigenbasis it belongs to.
    pub basis: String,
    /// Run it was made from.
    pub run: String,
    /// State of that run, counted from 0.
    pub state: usize,
    /// Time of that state.
    pub time: f64,
    /// The mode whose medoid that run is, if it was asked for by mode.
    pub mode: Option<String>,
    /// Which magnitudes were compared with t.
    pub select: Select,
    /// The rule for t, as it is written on the command line.
    pub rule: String,
    /// t, in length².
    pub threshold: f64,
    /// The eigenvectors J, counted from 1, rising.
    pub eigenvectors: Vec<usize>,
    /// The target's values on J, |J| × 3, in length².
    pub values: Vec<[f64; 3]>,
    /// Ranges of nearly equal eigenvalues that J cuts: inside them the choice depends on the solver's basis.
    pub split_clusters: Vec<(usize, usize)>,
    /// Errors of the reconstruction.
    pub errors: Errors,
    /// The same for the first M eigenvectors, the first K, and M principal components (M numbers, where M eigenvectors
    /// are 3M).
    pub rivals: Vec<Rival>,
}

/// Another method's reconstruction of the same state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// Its name.
    pub method: String,
    /// Eigenvectors or components it uses.
    pub size: usize,
    /// Its errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// How to describe.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DescribeOptions {
    /// Which magnitudes. Default: coordinates, as in the paper.
    pub select: Select,
    /// Which threshold. Default: mean + 1 standard deviation, the paper's.
    pub threshold: Threshold,
}

/// A descriptor with the shapes that show it.
#[derive(Debug, Clone)]
pub struct Described {
    /// The descriptor.
    pub descriptor: Descriptor,
    /// The original, N × 3.
    pub original: Vec<[f64; 3]>,
    /// All K coefficients that were compared with t, K × 3.
    pub values: Vec<[f64; 3]>,
    /// The descriptor's reconstruction, N × 3.
    pub reconstruction: Vec<[f64; 3]>,
    /// The first M eigenvectors', N × 3.
    pub first_m: Vec<[f64; 3]>,
    /// All K eigenvectors', N × 3.
    pub first_k: Vec<[f64; 3]>,
}

/// Name of the rival that uses the M eigenvectors of lowest frequency.
pub const FIRST_M: &str = "first M";
/// Name of the rival that uses principal components.
pub const PCA: &str = "PCA";

/// Builds the descriptor of one state, reconstructs the shape from it, and does the same with the rivals. Without a
/// name it is called after the run, with the state where one was asked for.
///
/// # Errors
/// [`Error::Threshold`], and errors of reading the state.
pub fn describe(
    loaded: &Loaded,
    named: &Named,
    mode: Option<&str>,
    name: Option<&str>,
    options: &DescribeOptions,
) -> Result<Described, Error> {
    let &DescribeOptions { select, threshold } = options;
    let target = target::resolve(loaded, named)?;
    let original = target::shape(loaded, named, &target)?;
    let (reference, basis) = (&loaded.reference, &loaded.basis);
    let values = select.values(basis, &target.delta);
    let selection = choose(loaded, select, &target.delta, threshold, || Ok(original.clone()))?;
    let eigenvectors = selection.eigenvectors;
    let shape = |eigenvectors: &[usize]| reconstruct(reference, basis, select, eigenvectors, &target.delta);
    let first: Vec<usize> = (1..=basis.eigenpairs()).collect();
    let m = eigenvectors.len();
    let (reconstruction, first_m, first_k) = (shape(&eigenvectors), shape(&first[..m]), shape(&first));
    let rivals = vec![
        Rival { method: FIRST_M.into(), size: m, errors: errors(reference, basis, &original, &first_m) },
        Rival { method: first_k_name(basis), size: first.len(), errors: errors(reference, basis, &original, &first_k) },
        pca_rival(loaded, &target, &original, m)?,
    ];
    let descriptor = Descriptor {
        name: name.map_or_else(|| default_name(&target, named), str::to_owned),
        kind: "paper".into(),
        basis: basis.id.clone(),
        run: target.run,
        state: target.state,
        time: target.time,
        mode: mode.map(str::to_owned),
        select,
        rule: threshold.to_string(),
        threshold: selection.threshold,
        values: eigenvectors.iter().map(|&j| values[j - 1]).collect(),
        split_clusters: split_clusters(basis, &eigenvectors),
        errors: errors(reference, basis, &original, &reconstruction),
        rivals,
        eigenvectors,
    };
    Ok(Described { descriptor, original, values, reconstruction, first_m, first_k })
}

fn default_name(target: &Target, named: &Named) -> String {
    let run = target.run.replace(['/', '\\'], "_");
    named.state.map_or(run.clone(), |state| format!("{run}@{state}"))
}

/// Name of the rival that uses all eigenvectors of the study.
pub fn first_k_name(basis: &Basis) -> String {
    format!("first {}", basis.eigenpairs())
}

/// Applies a threshold to a state's coefficients; `original` reads its shape, which only `error:` needs.
///
/// The RMS error of a reconstruction follows from Parseval: what lies beyond K, and the coefficients among the K that
/// are left out. Sums of squares, so nothing cancels.
pub(crate) fn choose(
    loaded: &Loaded,
    select: Select,
    delta: &[[f64; 3]],
    threshold: Threshold,
    original: impl FnOnce() -> Result<Vec<[f64; 3]>, Error>,
) -> Result<Selection, Error> {
    let (reference, basis) = (&loaded.reference, &loaded.basis);
    let values = select.values(basis, delta);
    let beyond = if let Threshold::Error(_) = threshold {
        let all: Vec<usize> = (1..=basis.eigenpairs()).collect();
        errors(reference, basis, &original()?, &reconstruct(reference, basis, select, &all, delta)).rms
    } else {
        0.0
    };
    let always = basis.always_in_reconstruction();
    threshold.select(&values, |order, m| {
        let left_out = order[m..].iter().filter(|j| !always.contains(j));
        let rest: f64 = left_out.map(|&j| values[j - 1].iter().map(|x| x * x).sum::<f64>()).sum();
        (beyond * beyond + rest / basis.facts.area).sqrt()
    })
}

fn pca_rival(loaded: &Loaded, target: &Target, original: &[[f64; 3]], components: usize) -> Result<Rival, Error> {
    let rows = loaded.last_states()?;
    let pca = Pca::of(&rows, components);
    let shape = pca.shape(loaded, &target.delta);
    Ok(Rival {
        method: PCA.into(),
        size: pca.components(),
        errors: errors(&loaded.reference, &loaded.basis, original, &shape),
    })
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
