//! The descriptor: the few numbers that say how a part deformed.
//!
//! The paper's eq. (5): S = { α_j^x, α_j^y, α_j^z | |α_j^x| > t ∨ |α_j^y| > t ∨ |α_j^z| > t }, the eigenvectors whose
//! coefficients matter and the target's values on them; and beside it the target's rotation spectrum, so that one
//! descriptor can be compared either way.

mod build;
mod file;
mod subject;
mod threshold;

use serde::{Deserialize, Serialize};

pub(crate) use build::choose;
pub use build::{Described, describe, find, first_k_name};
pub use file::{forget_modes, list, load, save};
pub use subject::Set;
pub use threshold::{Selection, Threshold};

use crate::field::Field;
use crate::reconstruct::Errors;
use crate::rotation::RotationSpectrum;
use crate::select::Kind;
pub use crate::select::Select;
use crate::study::Function;

/// A descriptor, as it is stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Descriptor {
    /// Its name; also the name of its file.
    pub name: String,
    /// Which of its numbers are compared when nothing else is asked for.
    pub kind: Kind,
    /// Content name of the eigenbasis it belongs to.
    pub basis: String,
    /// Run it was made from; for a set of runs the one in its middle.
    pub run: String,
    /// State of that run, counted from 0.
    pub state: usize,
    /// Time of that state.
    pub time: f64,
    /// The mode it was asked for by, if it was.
    pub mode: Option<String>,
    /// What of a mode it describes.
    #[serde(default)]
    pub set: Set,
    /// The paper's selection: of the shape, or of the only field.
    #[serde(flatten)]
    pub selected: Selected,
    /// Selections of further functions, compared together with the first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<Selected>,
    /// The rotation spectrum.
    pub spectrum: RotationSpectrum,
    /// From which similarity on a run does what it says, if that was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
}

/// Eigenvectors that matter for one function, and the target's values on them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Selected {
    /// The field it is about; the shape when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<Field>,
    /// Which magnitudes were compared with t; a field has no baseline, so both are the same for it.
    pub select: Select,
    /// Whether α > t was asked, as the paper's equation is printed, not |α| > t, as its text says.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub signed: bool,
    /// The rule for t, as it is written on the command line.
    pub rule: String,
    /// t, in length² for a shape.
    pub threshold: f64,
    /// The eigenvectors J, counted from 1, rising.
    pub eigenvectors: Vec<usize>,
    /// The target's values on J, |J| × components, in length² for a shape.
    pub values: Vec<Vec<f64>>,
    /// For a set of runs: the standard deviation of each value over its members.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spread: Vec<Vec<f64>>,
    /// What values are multiplied by before they are compared: 1, or one over the function's spread in the study where
    /// several functions are compared together.
    #[serde(default = "one")]
    pub scale: f64,
    /// Ranges of nearly equal eigenvalues that J cuts: inside them the choice depends on the solver's basis.
    pub split_clusters: Vec<(usize, usize)>,
    /// Errors of the reconstruction.
    pub errors: Option<Errors>,
    /// The same for the first M eigenvectors, the first K, and M principal components (M numbers, where M eigenvectors
    /// are 3M).
    pub rivals: Vec<Rival>,
}

fn one() -> f64 {
    1.0
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

/// A threshold and how well it does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// What was compared.
    pub kind: Kind,
    /// The smallest similarity that passes.
    pub threshold: f64,
    /// Runs that do what the descriptor says; the one it was made from is not among them.
    pub right: usize,
    /// Runs that do not.
    pub wrong: usize,
    /// Folds of the cross-validation.
    pub folds: usize,
    /// Share of the runs that do not which would pass, on runs that the threshold was not chosen by.
    pub false_pass: f64,
    /// Share of the runs that do which would fail, likewise.
    pub false_fail: f64,
    /// The smallest similarity to its nearest neighbour in the study with which a run is like something known.
    pub known: f64,
}

/// How to describe.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribeOptions {
    /// Which numbers are compared when nothing else is asked for. Default: the rotation spectrum.
    pub kind: Kind,
    /// Which magnitudes. Default: coordinates, as in the paper.
    pub select: Select,
    /// Which threshold. Default: mean + 1 standard deviation, the paper's.
    pub threshold: Threshold,
    /// α > t as the paper's equation is printed. Default: |α| > t, as its text says.
    pub signed: bool,
    /// Adds to J what makes its clusters of nearly equal eigenvalues whole. Default: they are named.
    pub whole_clusters: bool,
    /// Which functions. Default: the shape.
    pub functions: Vec<Function>,
    /// What of a mode is described. Default: its medoid.
    pub set: Set,
}

impl Default for DescribeOptions {
    fn default() -> Self {
        Self {
            kind: Kind::default(),
            select: Select::default(),
            threshold: Threshold::default(),
            signed: false,
            whole_clusters: false,
            functions: vec![Function::Displacement],
            set: Set::default(),
        }
    }
}

/// Name of the rival that uses the M eigenvectors of lowest frequency.
pub const FIRST_M: &str = "first M";
/// Name of the rival that uses principal components.
pub const PCA: &str = "PCA";

impl Descriptor {
    /// The selections, one a function.
    pub fn blocks(&self) -> impl Iterator<Item = &Selected> {
        std::iter::once(&self.selected).chain(&self.beside)
    }

    /// Eigenvectors M, of all functions.
    pub fn size(&self) -> usize {
        self.blocks().map(|selected| selected.eigenvectors.len()).sum()
    }

    /// Numbers that the paper's kind compares.
    pub fn numbers(&self) -> usize {
        self.blocks().flat_map(|selected| &selected.values).map(Vec::len).sum()
    }
}

impl Selected {
    /// The function it is about.
    pub fn function(&self) -> Function {
        self.field.map_or(Function::Displacement, Function::Field)
    }
}
