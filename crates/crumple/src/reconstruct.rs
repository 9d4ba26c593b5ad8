//! Reconstruction: a shape from a few coefficients, and how far it is from the original.
//!
//! p̂ = Φ_J α_J for coordinates (the paper's eq. 4 with the eigenvectors of the descriptor), p⁰ + Φ_J δ_J for
//! differences. The null space is always in it.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::basis::{Basis, synthesize};
use crate::reference::Reference;
use crate::select::Select;
use crate::vector::{add, square, subtract};

/// How far a reconstruction is from the original.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// M-weighted root mean square distance, in the length unit.
    pub rms: f64,
    /// Largest distance of a vertex, in the length unit.
    pub max: f64,
    /// `rms` over the root mean square displacement, a fraction; null for a state without displacement.
    pub relative: Option<f64>,
}

/// The shape that the coefficients of `eigenvectors` (counted from 1) and of the null space make, N × 3.
///
/// `delta`: all K coefficients δ of the state, K × 3.
pub fn reconstruct(
    reference: &Reference,
    basis: &Basis,
    select: Select,
    eigenvectors: &[usize],
    delta: &[[f64; 3]],
) -> Vec<[f64; 3]> {
    let wanted: BTreeSet<usize> = eigenvectors.iter().copied().chain(basis.always_in_reconstruction()).collect();
    let wanted: Vec<usize> = wanted.into_iter().collect();
    let values: Vec<[f64; 3]> = wanted.iter().map(|&j| select.value(basis, delta, j)).collect();
    let shape = synthesize(basis, &wanted, &values);
    match select {
        Select::Coordinates => shape,
        Select::Difference => displaced(reference, &shape),
    }
}

/// p⁰ + d, N × 3.
pub fn displaced(reference: &Reference, displacement: &[[f64; 3]]) -> Vec<[f64; 3]> {
    reference.mesh.vertices().iter().zip(displacement).map(|(p, d)| add(*p, *d)).collect()
}

/// Compares a reconstruction with the original, both N × 3.
pub fn errors(reference: &Reference, basis: &Basis, original: &[[f64; 3]], reconstruction: &[[f64; 3]]) -> Errors {
    let square = |a: &[f64; 3], b: &[f64; 3]| square(subtract(*a, *b));
    let area: f64 = basis.area.iter().sum();
    let rms = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let sum: f64 = a.iter().zip(b).zip(&basis.area).map(|((a, b), share)| share * square(a, b)).sum();
        (sum / area).sqrt()
    };
    let displacement = rms(original, reference.mesh.vertices());
    let error = rms(original, reconstruction);
    let max = original.iter().zip(reconstruction).map(|(a, b)| square(a, b)).fold(0.0, f64::max).sqrt();
    Errors { rms: error, max, relative: (displacement > 0.0).then(|| error / displacement) }
}

/// The same for a field, both N × 3, in the field's unit; `relative` is over the field's own root mean square.
pub fn field_errors(basis: &Basis, original: &[[f64; 3]], reconstruction: &[[f64; 3]]) -> Errors {
    let difference: Vec<_> = original.iter().zip(reconstruction).map(|(a, b)| subtract(*a, *b)).collect();
    let area: f64 = basis.area.iter().sum();
    let rms = |values: &[[f64; 3]]| {
        (values.iter().zip(&basis.area).map(|(x, share)| share * square(*x)).sum::<f64>() / area).sqrt()
    };
    let (own, error) = (rms(original), rms(&difference));
    let max = difference.iter().map(|x| square(*x)).fold(0.0, f64::max).sqrt();
    Errors { rms: error, max, relative: (own > 0.0).then(|| error / own) }
}
