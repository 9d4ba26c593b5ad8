//! From functions on the surface to coefficients and back.
//!
//! α = Φᵀ M f (the paper's eq. 3, with M because our Φ is orthonormal in M), and f = Φ α.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::Basis;

/// Vertices a block: the block of Φ in f64 (K × 512 × 8 = 2 MB at K = 500) stays in the second-level cache.
const BLOCK: usize = 512;

/// Spectral coefficients Φᵀ M f of one vector function on the vertices (a shape, a displacement).
///
/// `values`: N × 3. Result: K × 3, in length² when the values are lengths.
pub fn coefficients(basis: &Basis, values: &[[f64; 3]]) -> Vec<[f64; 3]> {
    coefficients_of(basis, std::slice::from_ref(&values)).pop().unwrap_or_default()
}

/// Φᵀ M f of several functions at once: the block of Φ that is being widened to f64 serves all of them.
pub(crate) fn coefficients_of<F: AsRef<[[f64; 3]]>>(basis: &Basis, functions: &[F]) -> Vec<Vec<[f64; 3]>> {
    let (k, n, columns) = (basis.eigenpairs(), basis.vertices(), 3 * functions.len());
    let mut result = Mat::<f64>::zeros(columns, k);
    let mut weighted = vec![0.0; BLOCK * columns];
    let mut widened = vec![0.0; BLOCK * k];
    // A mass that is not diagonal reaches beyond the block.
    let whole: Vec<Vec<[f64; 3]>> = match &basis.mass_matrix {
        Some(_) => functions.iter().map(|values| basis.weigh(values.as_ref())).collect(),
        None => Vec::new(),
    };
    for first in (0..n).step_by(BLOCK) {
        let rows = BLOCK.min(n - first);
        for (function, values) in functions.iter().enumerate() {
            let weighed = whole.get(function);
            for (row, point) in values.as_ref()[first..first + rows].iter().enumerate() {
                for (component, x) in point.iter().enumerate() {
                    weighted[row * columns + 3 * function + component] = match weighed {
                        Some(weighed) => weighed[first + row][component],
                        None => x * basis.mass[first + row],
                    };
                }
            }
        }
        for (column, eigenvector) in widened.chunks_exact_mut(BLOCK).zip(basis.eigenvectors.chunks_exact(n)) {
            column.iter_mut().zip(&eigenvector[first..first + rows]).for_each(|(wide, &x)| *wide = f64::from(x));
        }
        let weighted = MatRef::from_column_major_slice(&weighted[..rows * columns], columns, rows);
        let widened = MatRef::from_column_major_slice(&widened, BLOCK, k).subrows(0, rows);
        matmul(result.as_mut(), Accum::Add, weighted, widened, 1.0, Par::Seq);
    }
    let entry = |function: usize, k: usize, c: usize| result[(3 * function + c, k)];
    (0..functions.len())
        .map(|function| (0..k).map(|k| std::array::from_fn(|c| entry(function, k, c))).collect())
        .collect()
}

/// Σ_j Φ_j c_j: the function on the vertices that has the coefficients `values` on `eigenvectors` (counted from 1)
/// and none elsewhere. Result: N × 3.
pub fn synthesize(basis: &Basis, eigenvectors: &[usize], values: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut result = vec![[0.0; 3]; basis.vertices()];
    for (&eigenvector, value) in eigenvectors.iter().zip(values) {
        for (point, &phi) in result.iter_mut().zip(basis.eigenvector(eigenvector)) {
            for c in 0..3 {
                point[c] += f64::from(phi) * value[c];
            }
        }
    }
    result
}
