//! One slice of the spectrum: the pairs next to a shift, so many on its left and so many on its right.
//!
//! A slice knows from an inertia count how many pairs it has to find on its left, and runs until it has them.

use crate::eigen::block::{Pool, Row, WIDTH, ZERO};
use crate::eigen::factor::Factor;
use crate::eigen::kernel::{self, Kind};
use crate::eigen::krylov::{Handover, Krylov};
use crate::eigen::projected::Ritz;
use crate::eigen::seconds::Step;
use crate::eigen::{EigenError, Progress};
use crate::operator::Csr;

/// Slices are cut apart only at a gap wider than this share of the largest eigenvalue: inside a cluster each would take
/// its own vectors of one eigenspace, and no count could tell.
pub(crate) const CUT_GAP: f64 = 1e-6;

/// What every slice of a component works with.
#[derive(Clone, Copy)]
pub(crate) struct Tools<'a> {
    pub(crate) matrix: &'a Csr,
    pub(crate) pool: &'a Pool,
    pub(crate) kind: Kind,
    pub(crate) progress: &'a Progress<'a>,
    /// The upper end of the whole range, λ_K or a little more: residuals are relative to it.
    pub(crate) top: f64,
    /// The residual allowed, relative to `top`.
    pub(crate) tolerance: f64,
    /// An upper bound of A's largest eigenvalue.
    pub(crate) norm: f64,
}

/// What a slice is asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demand {
    /// Pairs wanted below the shift: those closest to it.
    pub(crate) left: usize,
    /// Pairs wanted above the shift.
    pub(crate) right: usize,
    /// No slice follows: exactly `right` pairs above the shift. Otherwise about so many, up to a wide gap.
    pub(crate) last: bool,
    /// For the random start.
    pub(crate) seed: u64,
    /// Orthogonalise at every step.
    pub(crate) careful: bool,
    /// The dimension at which to look for the first time, if the slice before lets it be foreseen.
    pub(crate) dimension: Option<usize>,
}

/// A slice that has found its pairs, and how to get at their vectors.
pub(crate) struct Slice<'a> {
    space: Krylov<'a>,
    ritz: Ritz,
    chosen: Vec<usize>,
    /// Ritz values above the chosen ones, the closest first.
    beyond: Vec<usize>,
    shift: f64,
    /// Ascending.
    pub(crate) eigenvalues: Vec<f64>,
    /// The dimension at which the pairs were there, about.
    pub(crate) dimension: usize,
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

/// Finds the pairs around the factor's shift.
pub(crate) fn slice<'a>(
    tools: &Tools<'a>,
    factor: &'a Factor,
    demand: Demand,
    handover: Option<Handover>,
) -> Result<Slice<'a>, Trouble> {
    let Demand { left, right, last, seed, careful, dimension: foreseen } = demand;
    let mut space = Krylov::new(*tools, factor, seed, handover, careful);
    // Measured on sheet meshes. A space a little too large costs a step, one too small another projected problem.
    let mut next = foreseen.unwrap_or(90 + 12 * (left + right) / 5 + left.abs_diff(right));
    loop {
        tools.progress.go_on()?;
        space.step()?;
        if space.dimension() < next && space.can_grow() {
            continue;
        }
        let ritz = space.ritz().ok_or_else(|| Trouble::Again("the projected problem did not converge".into()))?;
        let (below, above, all_above) = converged(&ritz, tools);
        let eigenvalue = |&k: &usize| factor.shift + 1.0 / ritz.values[k];
        let enough = if last { above.len() >= right } else { above.len() > right };
        let cut = (below.len() >= left && enough)
            .then(|| if last { Some(right) } else { cut(&above, &eigenvalue, right, CUT_GAP * tools.top) })
            .flatten();
        if let Some(cut) = cut {
            let mut chosen: Vec<usize> = below[..left].iter().rev().copied().collect();
            chosen.extend(&above[..cut]);
            let eigenvalues = chosen.iter().map(eigenvalue).collect();
            // Pairs that have converged beyond those wanted say that a smaller space would have done.
            let surplus = (below.len() - left).min(above.len() - right);
            let (dimension, beyond) = (space.dimension().saturating_sub(2 * surplus), all_above[cut..].to_vec());
            return Ok(Slice { space, ritz, chosen, beyond, shift: factor.shift, eigenvalues, dimension });
        }
        let dimension = space.dimension();
        if !space.can_grow() || dimension > 400 + 20 * (left + right) {
            let (below, above, shift) = (below.len(), above.len(), factor.shift);
            return Err(Trouble::Again(format!(
                "{below} of {left} pairs below and {above} of {right} above the shift {shift:e} after {dimension} vectors"
            )));
        }
        let missing = left.saturating_sub(below.len()).max((right + usize::from(!last)).saturating_sub(above.len()));
        next = dimension + (2 * missing).clamp(8, 48);
    }
}

/// Converged Ritz values below and above the shift, the closest first, up to the first that has not converged; and all
/// above it.
fn converged(ritz: &Ritz, tools: &Tools) -> (Vec<usize>, Vec<usize>, Vec<usize>) {
    let values = &ritz.values;
    let good = |&k: &usize| {
        let (theta, beta) = (values[k].abs(), ritz.residual(k));
        // The second is the residual in A after the inverse step; the first keeps the vectors orthogonal and the
        // order of the values right.
        beta <= 10.0 * tools.tolerance * theta && beta <= 0.3 * tools.tolerance * tools.top * theta * theta
    };
    let mut below: Vec<usize> = (0..values.len()).filter(|&k| values[k] < 0.0).collect();
    let mut above: Vec<usize> = (0..values.len()).filter(|&k| values[k] > 0.0).collect();
    below.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    above.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let converged = above.iter().copied().take_while(good).collect();
    (below.into_iter().take_while(good).collect(), converged, above)
}

/// How many of the pairs above the shift to take, about `right`: up to the widest gap there is among the converged.
fn cut(above: &[usize], eigenvalue: &dyn Fn(&usize) -> f64, right: usize, least: f64) -> Option<usize> {
    let gap = |count: usize| eigenvalue(&above[count]) - eigenvalue(&above[count - 1]);
    let from = (right - right / 6).max(1);
    let widest = (from..above.len()).max_by(|&a, &b| gap(a).total_cmp(&gap(b)))?;
    (gap(widest) > least).then_some(widest)
}

impl Slice<'_> {
    /// Eigenvalues that may lie above the slice, ascending: the nearest third have mostly converged.
    pub(crate) fn ahead(&self) -> Vec<f64> {
        self.beyond.iter().map(|&k| self.shift + 1.0 / self.ritz.values[k]).collect()
    }

    /// Writes the vectors into blocks of eight, the last one filled up with zeros, and makes their residuals small.
    /// Result: ‖A x − λ x‖ of each.
    pub(crate) fn vectors(&self, tools: &Tools, into: &mut [&mut [Row]]) -> Result<Vec<f64>, Trouble> {
        self.space.vectors(&self.ritz, &self.chosen, into)?;
        tools.progress.clock.time(Step::Vectors, || {
            let mut scratch = tools.pool.take(tools.matrix.rows() + 1);
            let blocks = into.iter_mut().zip(self.eigenvalues.chunks(WIDTH));
            let residuals = blocks.map(|(block, eigenvalues)| settle(tools, block, eigenvalues, &mut scratch));
            let residuals = residuals.collect::<Result<Vec<_>, Trouble>>();
            tools.pool.give([scratch]);
            Ok(residuals?.concat())
        })
    }

    /// Leaves the `count` vectors above the slice (a multiple of eight, or as many as there are) to the next one.
    pub(crate) fn hand_over(self, count: usize) -> Result<Handover, EigenError> {
        let count = count.min(self.beyond.len());
        self.space.hand_over(&self.ritz, &self.beyond[..count - count % 8])
    }
}

/// What rounding leaves of a residual, relative to ‖A‖: 4e-16 for a product with A, times what solves near an
/// eigenvalue lose.
pub(crate) const ROUNDING: f64 = 8.0 * 4e-16;

/// How often vectors are polished, at most: each time takes a digit of the noise away.
const POLISH_MAX: usize = 3;

/// Where the part of the spectrum begins that polishing damps, as a share of ‖A‖; the least and the largest degree of
/// its polynomial.
const POLISH_FROM: f64 = 0.125;
const POLISH_DEGREE: [usize; 2] = [4, 12];

/// Polishes a block of vectors if their residuals ask for it; returns these.
fn settle(tools: &Tools, block: &mut [Row], eigenvalues: &[f64], scratch: &mut [Row]) -> Result<Vec<f64>, Trouble> {
    let Tools { matrix, kind, norm, .. } = *tools;
    // A tenth in hand, because λ_K lies a little below the top; and no less than rounding leaves.
    let allowed = (0.9 * tools.tolerance * tools.top).max(ROUNDING * norm);
    let mut shifts = ZERO;
    shifts[..eigenvalues.len()].copy_from_slice(eigenvalues);
    let mut polished = 0;
    loop {
        tools.progress.go_on()?;
        let mut squares = ZERO;
        kernel::residual(kind, matrix, block, &shifts, &mut squares);
        let most = squares.into_iter().fold(0.0, f64::max).sqrt();
        if most <= 0.5 * allowed || (polished == POLISH_MAX && most <= allowed) {
            return Ok(squares[..eigenvalues.len()].iter().map(|square| square.sqrt()).collect());
        }
        if polished == POLISH_MAX || squares.iter().any(|square| square.is_nan()) {
            return Err(Trouble::Again(format!("residual {most:e}, {allowed:e} allowed")));
        }
        // |T_d| outside [−1, 1] is the hyperbolic cosine of d times that of T_1's inverse.
        let outside = ((1.0 + POLISH_FROM) / (1.0 - POLISH_FROM)).acosh();
        let degree = ((most / (0.3 * allowed)).acosh() / outside).ceil() as usize;
        polish(tools, block, eigenvalues, degree.clamp(POLISH_DEGREE[0], POLISH_DEGREE[1]), scratch);
        polished += 1;
    }
}

/// x ← T_d(t(A)) x / T_d(t(λ)) with the Chebyshev polynomial T_d, t mapping [‖A‖/8, ‖A‖] to [−1, 1]: damps the rounding
/// noise at the upper end of the spectrum, which the residual multiplies by ‖A‖/λ_K, and leaves the pair alone.
fn polish(tools: &Tools, block: &mut [Row], eigenvalues: &[f64], degree: usize, scratch: &mut [Row]) {
    let Tools { matrix, kind, norm, .. } = *tools;
    let (centre, half) = (norm * (1.0 + POLISH_FROM) / 2.0, norm * (1.0 - POLISH_FROM) / 2.0);
    let [mut before, mut now]: [&mut [Row]; 2] = [block, &mut scratch[..matrix.rows()]];
    kernel::sparse(kind, matrix, before, now, [1.0 / half, -centre / half, 0.0]);
    for _ in 1..degree {
        // T_{d+1} = 2 t T_d − T_{d−1}, in place of T_{d−1}.
        kernel::sparse(kind, matrix, now, before, [2.0 / half, -2.0 * centre / half, -1.0]);
        [before, now] = [now, before];
    }
    let mut scale = ZERO;
    for (k, eigenvalue) in eigenvalues.iter().enumerate() {
        let t = (eigenvalue - centre) / half;
        let (mut before, mut value) = (1.0, t);
        for _ in 1..degree {
            (before, value) = (value, 2.0 * t * value - before);
        }
        scale[k] = 1.0 / value;
    }
    for (x, y) in before.iter_mut().zip(now.iter_mut()) {
        for k in 0..WIDTH {
            let value = y[k] * scale[k];
            (x[k], y[k]) = (value, value); // one of them is the block
        }
    }
}

/// An upper bound of A's largest eigenvalue: the largest sum of |entries| of a row (Gershgorin).
pub(crate) fn norm(matrix: &Csr) -> f64 {
    (0..matrix.rows()).map(|row| matrix.row(row).map(|(_, value)| value.abs()).sum()).fold(0.0, f64::max)
}
