//! One slice of the spectrum: the pairs next to a shift, so many on its left and so many on its right.
//!
//! A slice knows from inertia counts how many pairs it has to find, and runs until it has them. It does not depend on
//! any other slice, so slices are computed in parallel and the result is the same on any number of threads.

use crate::eigen::block::{Block, ZERO, dispatch};
use crate::eigen::factor::Factor;
use crate::eigen::lanczos::{Lanczos, Ritz};
use crate::eigen::{EigenError, Progress};
use crate::operator::Csr;

/// What a slice is asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demand {
    /// Pairs wanted below the shift: those closest to it.
    pub(crate) left: usize,
    /// Pairs wanted above the shift.
    pub(crate) right: usize,
    /// The upper end of the whole range, λ_K or a little more: residuals are relative to it.
    pub(crate) top: f64,
    /// The residual allowed, relative to `top`.
    pub(crate) tolerance: f64,
    /// For the random start.
    pub(crate) seed: u64,
}

/// The pairs of a slice, ascending.
pub(crate) struct Slice {
    /// Number of the lowest pair in the component's spectrum, from 0.
    pub(crate) first: usize,
    pub(crate) eigenvalues: Vec<f64>,
    /// Blocks of eight normalised vectors, ascending from the first; the last block is filled up with zeros.
    pub(crate) vectors: Vec<Block>,
}

/// Why a computation has to be tried again, or given up.
#[derive(Debug, Clone)]
pub(crate) enum Trouble {
    /// The caller must stop.
    Fatal(EigenError),
    /// Another shift or start may do better; what was seen.
    Again(String),
}

impl From<EigenError> for Trouble {
    fn from(error: EigenError) -> Trouble {
        Trouble::Fatal(error)
    }
}

/// Finds `demand.left` + `demand.right` pairs around the factor's shift.
pub(crate) fn slice(matrix: &Csr, factor: &Factor, demand: Demand, progress: &Progress) -> Result<Slice, Trouble> {
    let Demand { left, right, seed, .. } = demand;
    let mut found = Slice { first: factor.below - left, eigenvalues: Vec::new(), vectors: Vec::new() };
    if left + right == 0 {
        return Ok(found);
    }
    let n = matrix.rows();
    let mut lanczos = Lanczos::new(factor, n, seed);
    // Measured on sheet meshes. A space a little too large costs a step, one too small another projected problem.
    let mut next = 90 + 5 * (left + right) / 2 + left.max(right);
    let (ritz, chosen) = loop {
        if progress.stopped() {
            return Err(EigenError::Stopped.into());
        }
        lanczos.step();
        if lanczos.dimension() < next && lanczos.can_grow() {
            continue;
        }
        let ritz = lanczos.ritz().ok_or_else(|| Trouble::Again("the projected problem did not converge".into()))?;
        let (below, above) = converged(&ritz, demand);
        if below.len() >= left && above.len() >= right {
            let mut chosen: Vec<usize> = below[..left].iter().rev().copied().collect();
            chosen.extend(&above[..right]);
            break (ritz, chosen);
        }
        let dimension = lanczos.dimension();
        if !lanczos.can_grow() || dimension > 400 + 20 * (left + right) {
            let (below, above, shift) = (below.len(), above.len(), factor.shift);
            return Err(Trouble::Again(format!(
                "{below} of {left} pairs below and {above} of {right} above the shift {shift:e} after {dimension} vectors"
            )));
        }
        let missing = left.saturating_sub(below.len()).max(right.saturating_sub(above.len()));
        next = dimension + (8 + 3 * missing).clamp(16, 64);
    };
    found.eigenvalues = chosen.iter().map(|&k| factor.shift + 1.0 / ritz.values[k]).collect();
    found.vectors = lanczos.vectors(&ritz, &chosen);
    drop(lanczos);
    normalise(&mut found.vectors);
    // A tenth in hand, because λ_K lies a little below the top; and no less than rounding leaves.
    let allowed = (0.9 * demand.tolerance * demand.top).max(ROUNDING * norm(matrix));
    if residual(matrix, &found) > 0.5 * allowed {
        polish(matrix, &mut found);
        normalise(&mut found.vectors);
        let left = residual(matrix, &found);
        if left > allowed {
            return Err(Trouble::Again(format!("residual {left:e}, {allowed:e} allowed")));
        }
    }
    progress.add(chosen.len());
    Ok(found)
}

/// Converged Ritz values below and above the shift, the closest first, up to the first that has not converged.
fn converged(ritz: &Ritz, demand: Demand) -> (Vec<usize>, Vec<usize>) {
    let Ritz { values, residuals, .. } = ritz;
    let good = |&k: &usize| {
        let (theta, beta) = (values[k].abs(), residuals[k]);
        // The second is the residual in A after the inverse step; the first keeps the vectors orthogonal and the
        // order of the values right.
        beta <= 10.0 * demand.tolerance * theta && beta <= 0.1 * demand.tolerance * demand.top * theta * theta
    };
    let mut below: Vec<usize> = (0..values.len()).filter(|&k| values[k] < 0.0).collect();
    let mut above: Vec<usize> = (0..values.len()).filter(|&k| values[k] > 0.0).collect();
    below.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    above.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    (below.into_iter().take_while(good).collect(), above.into_iter().take_while(good).collect())
}

/// Scales every vector to length 1; the zeros that fill up a block stay zeros.
fn normalise(vectors: &mut [Block]) {
    for block in vectors {
        let mut square = ZERO;
        for row in block.iter() {
            (0..8).for_each(|k| square[k] += row[k] * row[k]);
        }
        let scale = square.0.map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
        for row in block.iter_mut() {
            (0..8).for_each(|k| row[k] *= scale[k]);
        }
    }
}

/// max ‖A x − λ x‖ over the pairs of a slice.
fn residual(matrix: &Csr, found: &Slice) -> f64 {
    let mut most = 0.0f64;
    let mut y = vec![ZERO; matrix.rows()];
    for (block, eigenvalues) in found.vectors.iter().zip(found.eigenvalues.chunks(8)) {
        dispatch::sparse(matrix, block, &mut y, [1.0, 0.0, 0.0]);
        for (k, eigenvalue) in eigenvalues.iter().enumerate() {
            let square: f64 = block.iter().zip(&y).map(|(x, y)| (y[k] - eigenvalue * x[k]).powi(2)).sum();
            most = most.max(square.sqrt());
        }
    }
    most
}

/// What rounding can leave of a residual, relative to ‖A‖.
pub(crate) const ROUNDING: f64 = 8.0 * 4e-16;

/// Degree of the polishing polynomial; 3 to 5 serve.
const POLISH_DEGREE: usize = 4;

/// x ← T_d(t(A)) x / T_d(t(λ)) with the Chebyshev polynomial T_d, t mapping [‖A‖/8, ‖A‖] to [−1, 1]: damps the rounding
/// noise at the upper end of the spectrum, which the residual multiplies by ‖A‖/λ_K, and leaves the pair alone.
fn polish(matrix: &Csr, found: &mut Slice) {
    let high = norm(matrix);
    let (centre, half) = (high * (1.0 + 0.125) / 2.0, high * (1.0 - 0.125) / 2.0);
    let mut scratch = [vec![ZERO; matrix.rows()], vec![ZERO; matrix.rows()]];
    for (block, eigenvalues) in found.vectors.iter_mut().zip(found.eigenvalues.chunks(8)) {
        let [y, z] = &mut scratch;
        dispatch::sparse(matrix, block, y, [1.0 / half, -centre / half, 0.0]);
        for _ in 1..POLISH_DEGREE {
            z.copy_from_slice(block);
            dispatch::sparse(matrix, y, z, [2.0 / half, -2.0 * centre / half, -1.0]);
            std::mem::swap(block, y);
            std::mem::swap(y, z);
        }
        std::mem::swap(block, y);
        for (k, eigenvalue) in eigenvalues.iter().enumerate() {
            let t = (eigenvalue - centre) / half;
            let (mut before, mut value) = (1.0, t);
            for _ in 1..POLISH_DEGREE {
                (before, value) = (value, 2.0 * t * value - before);
            }
            block.iter_mut().for_each(|row| row[k] /= value);
        }
    }
}

/// An upper bound of A's largest eigenvalue: the largest sum of |entries| of a row (Gershgorin).
pub(crate) fn norm(matrix: &Csr) -> f64 {
    (0..matrix.rows()).map(|row| matrix.row(row).map(|(_, value)| value.abs()).sum()).fold(0.0, f64::max)
}
