//! One slice of the spectrum: the pairs next to a shift, so many on its left and so many on its right.
//!
//! A slice knows from an inertia count how many pairs it has to find on its left, and runs until it has them.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::eigen::block::{Block, Pool, Row, SMALL_ZERO, WIDTH, ZERO};
use crate::eigen::factor::Factor;
use crate::eigen::gram::larger;
use crate::eigen::kernel::{self, Kind};
use crate::eigen::krylov::{Handover, Krylov};
use crate::eigen::pages;
use crate::eigen::parts;
use crate::eigen::polish::{Levels, polish};
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
    /// The same for polishing, once a slice has needed it.
    pub(crate) levels: &'a OnceLock<Levels>,
    pub(crate) pool: &'a Pool,
    pub(crate) kind: Kind,
    pub(crate) progress: &'a Progress<'a>,
    /// The upper end of the whole range, λ_K or a little more.
    pub(crate) top: f64,
    /// λ_K or a little less: residuals are relative to it.
    pub(crate) aim: f64,
    /// The residual allowed, relative to `aim`.
    pub(crate) tolerance: f64,
    /// An upper bound of A's largest eigenvalue.
    pub(crate) norm: f64,
}

impl Tools<'_> {
    /// The residual that vectors are left with: a little in hand for what cleaning adds, and no less than rounding leaves.
    fn allowed(&self) -> f64 {
        (0.9 * self.tolerance * self.aim).max(ROUNDING * self.norm)
    }

    /// ‖A x − λ x‖ of the vectors of a block.
    fn residuals(&self, x: &[Row], eigenvalues: &Row) -> Row {
        let mut squares = ZERO;
        kernel::residual(self.kind, self.matrix, x, eigenvalues, &mut squares);
        squares.map(f64::sqrt)
    }

    /// x ← x − d, unless a residual is above `most` then. Result: the residuals.
    fn take_off(&self, x: &mut [Row], d: &[Row], eigenvalues: &Row, most: f64) -> Row {
        add(x, d, -1.0);
        let residuals = self.residuals(x, eigenvalues);
        if largest(&residuals) <= most {
            return residuals;
        }
        add(x, d, 1.0);
        self.residuals(x, eigenvalues)
    }
}

/// The backward error of a factor, beside the residual allowed, with which its vectors cannot be saved: polishing takes
/// away what of it lies at high frequencies, a tenth to a half stays.
const NOISE_MAX: f64 = 50.0;

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
    /// Go through the whole basis at every step.
    pub(crate) careful: bool,
    /// Whatever the factor's backward error.
    pub(crate) noise_allowed: bool,
    /// The dimension at which to look for the first time, if the slice before lets it be foreseen.
    pub(crate) dimension: Option<usize>,
}

/// A slice that has found its pairs, and how to get at their vectors.
pub(crate) struct Slice<'a> {
    factor: &'a Factor,
    space: Krylov<'a>,
    ritz: Ritz,
    chosen: Vec<usize>,
    /// Ritz values above the chosen ones, the closest first.
    beyond: Vec<usize>,
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

/// Why a slice has not found its pairs.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Solves with this factor lose too many digits; nothing has been spent but one.
    Noise,
    Trouble(Trouble),
}

impl Failure {
    pub(crate) fn into_trouble(self) -> Trouble {
        match self {
            Failure::Noise => Trouble::Again("solves lose too many digits".into()),
            Failure::Trouble(trouble) => trouble,
        }
    }
}

impl<T: Into<Trouble>> From<T> for Failure {
    fn from(trouble: T) -> Failure {
        Failure::Trouble(trouble.into())
    }
}

impl From<EigenError> for Trouble {
    fn from(error: EigenError) -> Trouble {
        Trouble::Fatal(error)
    }
}

/// Finds the pairs around the factor's shift. What was handed over is used up, unless the slice goes wrong.
pub(crate) fn slice<'a>(
    tools: &Tools<'a>,
    factor: &'a Factor,
    demand: Demand,
    handover: &mut Option<Handover>,
) -> Result<Slice<'a>, Failure> {
    let mut space = Krylov::new(*tools, factor, demand.seed, handover.take(), demand.careful);
    match grow(tools, factor, demand, &mut space) {
        Ok(Chosen { ritz, chosen, beyond, dimension }) => {
            let eigenvalues = chosen.iter().map(|&k| factor.shift + 1.0 / ritz.values[k]).collect();
            Ok(Slice { factor, space, ritz, chosen, beyond, eigenvalues, dimension })
        }
        Err(trouble) => {
            *handover = space.give_back();
            Err(trouble)
        }
    }
}

/// What a space has come to: as in [`Slice`].
struct Chosen {
    ritz: Ritz,
    chosen: Vec<usize>,
    beyond: Vec<usize>,
    dimension: usize,
}

/// Grows the space until the pairs demanded are in it.
fn grow(tools: &Tools, factor: &Factor, demand: Demand, space: &mut Krylov) -> Result<Chosen, Failure> {
    let Demand { left, right, last, noise_allowed, dimension: foreseen, .. } = demand;
    // Measured on sheet meshes.
    let mut next = foreseen.unwrap_or(90 + 2 * (left + right) + left.abs_diff(right));
    let (mut rate, mut before) = (RATE, None);
    loop {
        tools.progress.go_on()?;
        space.step(space.dimension() + WIDTH >= next)?;
        if !noise_allowed && space.backward_error() > NOISE_MAX * tools.allowed() {
            return Err(Failure::Noise);
        }
        if space.dimension() < next && space.can_grow() {
            continue;
        }
        let ritz = space.ritz().ok_or_else(|| Trouble::Again("the projected problem did not converge".into()))?;
        let [all_below, all_above] = sides(&ritz);
        let excess_of = |k: &usize| excess(&ritz, tools, *k);
        let [below, above] = [&all_below, &all_above]
            .map(|side| side.iter().copied().take_while(|k| excess_of(k) <= 1.0).collect::<Vec<usize>>());
        let wanted = all_below.iter().take(left).chain(all_above.iter().take(right + usize::from(!last)));
        let excess = wanted.map(excess_of).fold(0.0, f64::max);
        let dimension = space.dimension();
        if let Some((at, before)) = before.replace((dimension, excess)) {
            let steps = (dimension - at) as f64 / WIDTH as f64;
            rate = (before / excess).powf(1.0 / steps).clamp(RATES[0], RATES[1]);
        }
        let eigenvalue = |&k: &usize| factor.shift + 1.0 / ritz.values[k];
        let enough = if last { above.len() >= right } else { above.len() > right };
        let cut = (below.len() >= left && enough)
            .then(|| if last { Some(right) } else { cut(&above, &eigenvalue, right, CUT_GAP * tools.top) })
            .flatten();
        if let Some(cut) = cut {
            let mut chosen: Vec<usize> = below[..left].iter().rev().copied().collect();
            chosen.extend(&above[..cut]);
            // Steps that could have been saved.
            let surplus = (-excess.ln() / rate.ln()).clamp(0.0, STEPS as f64) as usize;
            let (dimension, beyond) = (dimension - WIDTH * surplus, all_above[cut..].to_vec());
            return Ok(Chosen { ritz, chosen, beyond, dimension });
        }
        if !space.can_grow() || dimension > 400 + 20 * (left + right) {
            let (below, above, shift) = (below.len(), above.len(), factor.shift);
            return Err(Failure::Trouble(Trouble::Again(format!(
                "{below} of {left} pairs below and {above} of {right} above the shift {shift:e} after {dimension} vectors"
            ))));
        }
        // A look costs half of what a step does, so rather one step too few. Not a number: 0.
        let steps = (excess.ln() / rate.ln()).floor() as usize;
        next = dimension + WIDTH * steps.clamp(1, STEPS);
    }
}

/// By what a step divides a residual, until it is known; between what it is believed.
const RATE: f64 = 7.0;
const RATES: [f64; 2] = [2.0, 20.0];

/// The most steps that are taken, or saved the next time, on the word of such an extrapolation.
const STEPS: usize = 4;

/// The residual of a Ritz value beside the one allowed. Its square in θ is the residual in A after the inverse step; the
/// other keeps the vectors orthogonal and the order of the values right.
fn excess(ritz: &Ritz, tools: &Tools, k: usize) -> f64 {
    let (theta, beta) = (ritz.values[k].abs(), ritz.residual(k));
    (beta / (10.0 * tools.tolerance * theta)).max(beta / (0.3 * tools.tolerance * tools.top * theta * theta))
}

/// The Ritz values below the shift and above it, the closest first.
fn sides(ritz: &Ritz) -> [Vec<usize>; 2] {
    let values = &ritz.values;
    let [mut below, mut above]: [Vec<usize>; 2] = [Vec::new(), Vec::new()];
    for (k, value) in values.iter().enumerate() {
        if *value < 0.0 { below.push(k) } else { above.push(k) }
    }
    below.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    above.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    [below, above]
}

/// How many of the pairs above the shift to take, about `right`: up to the widest gap there is among the converged.
fn cut(above: &[usize], eigenvalue: &dyn Fn(&usize) -> f64, right: usize, least: f64) -> Option<usize> {
    let gap = |count: usize| eigenvalue(&above[count]) - eigenvalue(&above[count - 1]);
    let from = (right - right / 6).max(1);
    let widest = (from..above.len()).max_by(|&a, &b| gap(a).total_cmp(&gap(b)))?;
    (gap(widest) > least).then_some(widest)
}

impl Slice<'_> {
    /// Leaves the lowest pairs, so many at most.
    pub(crate) fn truncate(&mut self, count: usize) {
        self.eigenvalues.truncate(count);
        self.chosen.truncate(count);
    }

    /// Eigenvalues that may lie above the slice, ascending: the nearest third have mostly converged.
    pub(crate) fn ahead(&self) -> Vec<f64> {
        self.beyond.iter().map(|&k| self.factor.shift + 1.0 / self.ritz.values[k]).collect()
    }

    /// Writes the vectors into blocks of eight, from column `skip` of the first one on (the others are zero), and makes
    /// their residuals small. Result: ‖A x − λ x‖ of each.
    pub(crate) fn vectors(&self, tools: &Tools, skip: usize, into: &mut [&mut [Row]]) -> Result<Vec<f64>, Trouble> {
        tools.progress.clock.time(Step::Vectors, || {
            into.iter_mut().for_each(|block| pages::touch(block));
            self.space.vectors(&self.ritz, &self.chosen, skip, into)?;
            self.settle(tools, skip, into)
        })
    }

    /// Makes the residuals of vectors small, where they are not; returns them.
    fn settle(&self, tools: &Tools, skip: usize, into: &mut [&mut [Row]]) -> Result<Vec<f64>, Trouble> {
        let n = tools.matrix.rows();
        let allowed = tools.allowed();
        let shifts: Vec<Row> = columns(&self.eigenvalues, skip, 0.0);
        let mut residuals: Vec<Row> =
            into.par_iter().zip(&shifts).map(|(x, shifts)| tools.residuals(x, shifts)).collect();
        let mut remedies = REMEDIES.iter();
        let mut beyond: Vec<Block> = Vec::new();
        loop {
            tools.progress.go_on()?;
            let most = residuals.iter().map(largest).fold(0.0, larger);
            if most <= allowed {
                tools.pool.give(beyond);
                return Ok(residuals.concat()[skip..][..self.eigenvalues.len()].to_vec());
            }
            let Some(remedy) = remedies.next().filter(|_| most.is_finite()) else {
                return Err(Trouble::Again(format!("residual {most:e}, {allowed:e} allowed")));
            };
            if let Remedy::Purge = remedy {
                if beyond.is_empty() {
                    let next = &self.beyond[..self.beyond.len().min(WIDTH * BEYOND)];
                    beyond.resize_with(next.len().div_ceil(WIDTH), || tools.pool.take(n + 1));
                    let mut into: Vec<&mut [Row]> = beyond.iter_mut().map(|x| &mut x[..n]).collect();
                    self.space.vectors(&self.ritz, next, 0, &mut into)?;
                }
                // One after another, because each is purged of the others.
                for b in 0..into.len() {
                    if largest(&residuals[b]) > allowed {
                        tools.progress.go_on()?;
                        residuals[b] = self.purge(tools, (b, skip), into, &beyond, &shifts[b], &residuals[b])?;
                    }
                }
                continue;
            }
            let blocks = into.par_iter_mut().zip(&mut residuals).zip(&shifts);
            blocks.filter(|((_, residuals), _)| largest(residuals) > allowed).try_for_each(
                |((x, residuals), shifts)| {
                    tools.progress.go_on()?;
                    *residuals = self.improve(tools, *remedy, x, shifts, residuals);
                    Ok::<(), EigenError>(())
                },
            )?;
        }
    }

    /// Polishes the vectors of a block, or does a step of inverse iteration. Result: their residuals.
    fn improve(&self, tools: &Tools, remedy: Remedy, x: &mut [Row], shifts: &Row, residuals: &Row) -> Row {
        let n = tools.matrix.rows();
        let mut scratch = [tools.pool.take(n + 1), tools.pool.take(n + 1)];
        let [d, other] = &mut scratch;
        let residuals = if let Remedy::Polish = remedy {
            let levels = tools.levels.get_or_init(|| Levels::new(tools.matrix));
            let excess = largest(residuals) / (0.3 * tools.allowed());
            polish(tools.kind, levels, tools.norm, shifts, excess, x, [d, other])
        } else {
            remainder(tools, x, shifts, d);
            kernel::solve(tools.kind, &self.factor.packed, d);
            tools.take_off(x, d, shifts, WORSE_MAX * largest(residuals)) // or the factor is worse than the vectors
        };
        tools.pool.give(scratch);
        residuals
    }

    /// Takes out of the vectors of a block what they have of the others of the slice, and of those above it,
    /// ε_j = v_jᵀ (A − λ) x / (λ_j − λ). Result: their residuals.
    fn purge(
        &self,
        tools: &Tools,
        (b, skip): (usize, usize),
        into: &mut [&mut [Row]],
        beyond: &[Block],
        shifts: &Row,
        residuals: &Row,
    ) -> Result<Row, EigenError> {
        let Tools { kind, top, .. } = *tools;
        let n = tools.matrix.rows();
        let mut scratch = [tools.pool.take(n + 1), tools.pool.take(n + 1)];
        let [r, along] = scratch.each_mut().map(|block| &mut block[..n]);
        remainder(tools, into[b], shifts, r);
        let mut others: Vec<&[Row]> = into.iter().map(|block| &block[..]).collect();
        others.extend(beyond.iter().map(|block| &block[..n]));
        let mut c = vec![SMALL_ZERO; others.len()];
        parts::gram(kind, &others, &[&*r], &mut c);
        let ahead = self.ahead();
        let ahead = &ahead[..ahead.len().min(WIDTH * beyond.len())];
        let eigenvalues = [columns(&self.eigenvalues, skip, f64::NAN), columns(ahead, 0, f64::NAN)].concat();
        for (c, eigenvalues) in c.iter_mut().zip(&eigenvalues) {
            for (row, eigenvalue) in c.iter_mut().zip(eigenvalues) {
                for k in 0..WIDTH {
                    let gap = eigenvalue - shifts[k];
                    // Within a cluster any combination will do; and some columns belong to no pair.
                    row[k] = if gap.abs() > CUT_GAP * top { row[k] / gap } else { 0.0 };
                }
            }
        }
        parts::combine(kind, &others, &c, &mut [&mut *along], tools.progress)?;
        let residuals = tools.take_off(into[b], along, shifts, largest(residuals)); // or what was measured is rounding
        tools.pool.give(scratch);
        Ok(residuals)
    }

    /// What the slice started with, for another try.
    pub(crate) fn give_back(self) -> Option<Handover> {
        self.space.give_back()
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

/// What makes the residuals of vectors smaller.
#[derive(Debug, Clone, Copy)]
enum Remedy {
    /// A polynomial in A, against what lies at high frequencies: rounding.
    Polish,
    /// Pairs known already, against what a vector has of them.
    Purge,
    /// A step of inverse iteration, x − (A − σI)⁻¹ (A − λI) x, against what lies farther from the shift than λ does, be it
    /// at frequencies that polishing must leave alone.
    Step,
}

/// Blocks of the pairs above a slice that its vectors are purged of, too: farther vectors of the slice have most of what
/// lies between them and the shift.
const BEYOND: usize = 4;

/// In the order in which they are tried, on the blocks that need one.
const REMEDIES: [Remedy; 7] =
    [Remedy::Polish, Remedy::Step, Remedy::Purge, Remedy::Polish, Remedy::Step, Remedy::Purge, Remedy::Polish];

/// By how much a step may enlarge a residual, along pairs next to the shift, which a purge takes out again.
const WORSE_MAX: f64 = 10.0;

/// The eigenvalues of blocks, from column `skip` of the first one on, and something else in the columns without one.
fn columns(eigenvalues: &[f64], skip: usize, without: f64) -> Vec<Row> {
    let of_column =
        |column: usize| column.checked_sub(skip).and_then(|k| eigenvalues.get(k)).copied().unwrap_or(without);
    let blocks = (skip + eigenvalues.len()).div_ceil(WIDTH);
    (0..blocks).map(|b| std::array::from_fn(|k| of_column(WIDTH * b + k))).collect()
}

/// r = (A − λI) x.
fn remainder(tools: &Tools, x: &[Row], eigenvalues: &Row, r: &mut [Row]) {
    kernel::sparse(tools.kind, tools.matrix, x, r);
    for (r, x) in r.iter_mut().zip(x) {
        (0..WIDTH).for_each(|k| r[k] -= eigenvalues[k] * x[k]);
    }
}

/// The largest of a block's residuals; not a number, if one is not.
fn largest(residuals: &Row) -> f64 {
    residuals.iter().copied().fold(0.0, larger)
}

/// X += c Y.
fn add(x: &mut [Row], y: &[Row], c: f64) {
    for (x, y) in x.iter_mut().zip(y) {
        for k in 0..WIDTH {
            x[k] += c * y[k];
        }
    }
}

/// An upper bound of A's largest eigenvalue: the largest sum of |entries| of a row (Gershgorin).
pub(crate) fn norm(matrix: &Csr) -> f64 {
    (0..matrix.rows()).map(|row| matrix.row(row).map(|(_, value)| value.abs()).sum()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_start_where_the_slice_before_ends() {
        let eigenvalues: Vec<f64> = (1..=7).map(f64::from).collect();
        let rows = columns(&eigenvalues, 6, 0.0);
        assert_eq!(rows, [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0], [3.0, 4.0, 5.0, 6.0, 7.0, 0.0, 0.0, 0.0]]);
        assert_eq!(columns(&eigenvalues, 0, 0.0), [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 0.0]]);
        assert_eq!(columns(&eigenvalues[..2], 6, 0.0).len(), 1, "a slice may end in the block that it starts in");
    }
}
