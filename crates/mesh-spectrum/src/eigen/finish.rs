//! The last step of every component: the exact null vector, orthogonality across slices, and the measured evidence.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

use crate::eigen::EigenError;
use crate::eigen::component::{Component, Pairs};

/// Inner products above this are removed. Slices leave 1e-12 (inside) to 2e-10 (across a border).
const CLEAN_ABOVE: f64 = 1e-12;

/// Inner products above this are no rounding: the same eigenspace was taken twice. Below it the vectors span what they
/// should, even where slivers make rounding large, and residuals measured afterwards decide whether they are eigenvectors.
const OVERLAP_MAX: f64 = 1e-2;

/// What was measured on the vectors as they are returned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Evidence {
    /// max ‖A v − λ v‖, 1/ℓ².
    pub(crate) residual: f64,
    /// max |Vᵀ V − I|.
    pub(crate) orthogonality: f64,
}

/// Puts in the null pair in closed form, makes the vectors orthonormal to rounding, and measures both.
///
/// # Errors
/// [`EigenError::NotOrthogonal`] if two vectors share more than rounding.
pub(crate) fn finish(component: &Component, pairs: &mut Pairs) -> Result<Evidence, EigenError> {
    let n = component.rows();
    let count = pairs.eigenvalues.len();
    if count == 0 {
        return Ok(Evidence { residual: 0.0, orthogonality: 0.0 });
    }
    let null = component.null_vector();
    pairs.vectors[..n].copy_from_slice(&null);
    pairs.vectors.par_chunks_mut(n).skip(1).for_each(|v| {
        let along: f64 = v.iter().zip(&null).map(|(v, null)| v * null).sum();
        v.iter_mut().zip(&null).for_each(|(v, null)| *v -= along * null);
        normalise(v);
    });

    let mut gram = gram(&pairs.vectors, n, count);
    let orthogonality = loss(&gram);
    if orthogonality.is_nan() || orthogonality > OVERLAP_MAX {
        return Err(EigenError::NotOrthogonal { loss: orthogonality });
    }
    for _ in 0..4 {
        if loss(&gram) <= 10.0 * CLEAN_ABOVE {
            break;
        }
        clean(&mut pairs.vectors, n, &gram);
        pairs.vectors.par_chunks_mut(n).for_each(normalise);
        gram = self::gram(&pairs.vectors, n, count);
    }
    let residual = pairs
        .vectors
        .par_chunks(n)
        .zip(&pairs.eigenvalues)
        .map(|(v, eigenvalue)| {
            let square = |row| {
                let product: f64 = component.matrix.row(row).map(|(column, value)| value * v[column]).sum();
                (product - eigenvalue / component.unit * v[row]).powi(2)
            };
            (0..n).map(square).sum::<f64>().sqrt() * component.unit
        })
        .reduce(|| 0.0, f64::max); // a maximum, the same in any order
    Ok(Evidence { residual, orthogonality: loss(&gram) })
}

fn normalise(v: &mut [f64]) {
    let scale = 1.0 / v.iter().map(|v| v * v).sum::<f64>().sqrt();
    v.iter_mut().for_each(|v| *v *= scale);
}

/// The lower half of Vᵀ V.
fn gram(vectors: &[f64], n: usize, count: usize) -> Mat<f64> {
    let v = MatRef::from_column_major_slice(vectors, n, count);
    let mut gram = Mat::zeros(count, count);
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    matmul(gram.as_mut(), lower, Accum::Replace, v.transpose(), full, v, full, 1.0, Par::Seq);
    gram
}

/// max |Vᵀ V − I|.
fn loss(gram: &Mat<f64>) -> f64 {
    let mut most = 0.0;
    for j in 0..gram.ncols() {
        for i in j..gram.nrows() {
            let off = (gram[(i, j)] - if i == j { 1.0 } else { 0.0 }).abs();
            most = if off > most || off.is_nan() { off } else { most };
        }
    }
    most
}

/// V ← V (3 I − Vᵀ V) / 2, the first step of Löwdin's symmetric orthonormalisation, for the entries that are more than
/// rounding. What is left is of the square of what was there. The null vector stays as it is.
fn clean(vectors: &mut [f64], n: usize, gram: &Mat<f64>) {
    for j in 0..gram.ncols() {
        for i in j + 1..gram.nrows() {
            let along = gram[(i, j)];
            if along.abs() <= CLEAN_ABOVE {
                continue;
            }
            let (head, tail) = vectors.split_at_mut(i * n);
            let (low, high) = (&mut head[j * n..][..n], &mut tail[..n]);
            let (to_low, to_high) = if j == 0 { (0.0, along) } else { (0.5 * along, 0.5 * along) };
            for (low, high) in low.iter_mut().zip(high) {
                (*low, *high) = (*low - to_low * *high, *high - to_high * *low);
            }
        }
    }
}
