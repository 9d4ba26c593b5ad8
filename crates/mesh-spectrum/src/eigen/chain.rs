//! A chain of slices, from one known count of eigenvalues to another, each slice starting with what the one before it
//! was left with.
//!
//! The first shift comes from Weyl's law, each later one from the Ritz values that the slice before has not used. A
//! shift lies in the widest gap near its place, so that it does not cut a cluster.

use crate::eigen::block::{Row, WIDTH};
use crate::eigen::component::mix;
use crate::eigen::factor::{Factor, Symbolic};
use crate::eigen::krylov::Handover;
use crate::eigen::slice::{CUT_GAP, Demand, Failure, Slice, Tools, Trouble, slice};
use crate::eigen::weyl::Weyl;

/// Pairs of a slice. Fewer: more factorisations; more: a longer way from shift to shift, by the square of which errors of
/// the vectors handed over are multiplied, and with a million vertices every vector then needs more than polishing.
fn pairs_a_slice(rows: usize) -> usize {
    match rows {
        ..30_000 => 32,
        30_000..300_000 => 46,
        _ => 40,
    }
}

/// By how many pairs the first chain is longer than the others, which start in the middle of the spectrum, where the first
/// slice takes longer. (Measured: 20 to 40 pairs.)
pub(crate) fn lead(rows: usize) -> f64 {
    0.75 * pairs_a_slice(rows) as f64
}

/// Ritz vectors handed over, for each pair of a slice.
const HAND_OVER: usize = 2;

/// The share of a slice's pairs that lie below its shift, if there was a hand-over. Those are all but found already, so
/// that the shift belongs where the others are. (With one half, a slice takes a third more solves.)
const SHARE_BELOW: f64 = 0.9;

/// The largest |L| and the smallest |D| (in mean spacings of eigenvalues) a shift is used with: above and below, the
/// solve loses digits (measured: 10 % of the shifts are moved).
pub(crate) const GROWTH_MAX: f64 = 1e4;
pub(crate) const PIVOT_MIN: f64 = 5e-3;

/// How often a slice is tried again before the whole is.
const AGAIN_MAX: usize = 3;

/// What a chain has to find.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// The number of the first pair, from 0.
    pub(crate) first: usize,
    /// One more than the number of the last.
    pub(crate) end: usize,
    /// A value below which there are no more than `first` eigenvalues, and one below which there are at least `end`.
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Where it meets the chain before, and the eigenvalues below that.
    pub(crate) border: f64,
    pub(crate) border_count: usize,
    pub(crate) seed: u64,
    /// 0, or how often it has gone wrong: shifts are moved, and from then on nothing is left to an estimate.
    pub(crate) attempt: usize,
}

/// What a chain has found.
#[derive(Debug, Default)]
pub(crate) struct Found {
    /// The number of the first pair.
    pub(crate) first: usize,
    /// Ascending. The vector of number k is column k mod 8 of block k / 8.
    pub(crate) eigenvalues: Vec<f64>,
    /// ‖A x − λ x‖ of each.
    pub(crate) residuals: Vec<f64>,
    /// Shifts, and the eigenvalues below each by inertia.
    pub(crate) counts: Vec<(f64, usize)>,
}

/// About so many slices find so many pairs.
pub(crate) fn slices_expected(rows: usize, pairs: usize) -> usize {
    ((pairs as f64 / pairs_a_slice(rows) as f64).round() as usize).max(1)
}

fn slices_max(rows: usize, pairs: usize) -> usize {
    2 * pairs / pairs_a_slice(rows) + 4
}

/// Finds the pairs of a span and writes their vectors into `blocks`, one after another.
pub(crate) fn chain(
    tools: &Tools,
    symbolic: &Symbolic,
    weyl: Weyl,
    span: Span,
    blocks: &mut [&mut [Row]],
) -> Result<Found, Trouble> {
    let Span { first, end, low, high, seed, attempt, border: _, border_count: _ } = span;
    let rows = tools.matrix.rows();
    let mut found = Found { first, ..Found::default() };
    let mut ahead: Vec<f64> = Vec::new();
    let mut handover: Option<Handover> = None;
    let mut dimension: Option<usize> = None;
    // How often the slice has gone wrong, beyond the attempts before, and how often its factor was too noisy to begin.
    let (mut again, mut moved) = (0, 0);
    let (mut below, mut low) = (first, low);
    for number in 0..slices_max(rows, end - first) {
        let left_over = end - below;
        let slices = slices_expected(rows, left_over);
        let pairs = left_over.div_ceil(slices).max(4);
        let alone = handover.is_none();
        let under = if alone { pairs / 2 } else { (SHARE_BELOW * pairs as f64) as usize };
        let wanted = guess(&ahead, under).unwrap_or_else(|| {
            let place = weyl.inverse((below + under) as f64) - weyl.inverse(below as f64);
            (low + place).min(0.5 * (low + high))
        });
        let seed = mix(seed, number as u64);
        let factor = place_shift(tools, symbolic, wanted, (below, under), (low, high), attempt + again + moved)?;
        let nu = factor.below;
        found.counts.push((factor.shift, nu));
        let left = nu.min(end) - below;
        let over = if alone { left.max(under) } else { pairs.saturating_sub(left).max(2) };
        let last = slices == 1 || nu + over + pairs / 6 >= end;
        let right = if last { end.saturating_sub(nu) } else { over.min(end - nu) };
        let careful = attempt + again > 0;
        let foreseen = match attempt {
            0 => dimension.filter(|_| !(careful && alone)),
            // If pairs were missing: the copies of an eigenvalue beyond a block's width come late, out of rounding.
            _ => Some(64 * attempt + 100 + 3 * (nu - below + right)),
        };
        let noise_allowed = moved >= 2 || attempt > 0;
        let demand = Demand { left: nu - below, right, last, seed, careful, noise_allowed, dimension: foreseen };
        let done = slice(tools, &factor, demand, &mut handover);
        if matches!(done, Err(Failure::Noise)) {
            moved += 1;
            drop(done);
            symbolic.recycle(factor);
            continue;
        }
        let done = done.map_err(Failure::into_trouble).and_then(|mut slice| {
            slice.truncate(left_over);
            match vectors(tools, &slice, found.eigenvalues.len(), blocks) {
                Ok(residuals) => Ok((residuals, slice)),
                Err(trouble) => {
                    handover = slice.give_back();
                    Err(trouble)
                }
            }
        });
        if matches!(done, Err(Trouble::Again(_))) && again < AGAIN_MAX {
            // Again with another shift and with nothing left to an estimate; then by itself.
            again += 1;
            handover = handover.filter(|_| again == 1);
            drop(done);
            symbolic.recycle(factor);
            continue;
        }
        let (residuals, slice) = done?;
        // What a slice needed is what the next one will need, unless it had to start from nothing.
        dimension = Some(if alone { (2 + HAND_OVER) * pairs } else { slice.dimension });
        (again, moved) = (0, 0);

        // The slice before knew which eigenvalue comes next. Another one here means that one of both missed a pair.
        let near = |a: f64, b: f64| (a - b).abs() <= 10.0 * tools.tolerance * tools.top;
        if let (Some(&expected), Some(&seen)) = (ahead.first(), slice.eigenvalues.first())
            && !near(expected, seen)
        {
            return Err(Trouble::Again(format!(
                "eigenvalue {below} is {expected:e} from one shift and {seen:e} from the next: one is missing"
            )));
        }
        let count = slice.eigenvalues.len();
        found.residuals.extend(residuals);
        found.eigenvalues.extend(&slice.eigenvalues);
        tools.progress.slice(count);
        below += count;
        if below == end {
            return Ok(found);
        }
        low = found.eigenvalues.last().copied().unwrap_or(low);
        ahead = slice.ahead();
        if attempt > 0 {
            drop(slice);
        } else {
            handover = Some(slice.hand_over(HAND_OVER * pairs_a_slice(rows))?);
        }
        symbolic.recycle(factor);
    }
    Err(Trouble::Again("more slices than foreseen".into()))
}

/// Writes a slice's vectors behind `done` others. Result: their residuals.
fn vectors(tools: &Tools, slice: &Slice, done: usize, blocks: &mut [&mut [Row]]) -> Result<Vec<f64>, Trouble> {
    let (first, skip) = (done / WIDTH, done % WIDTH);
    let end = (done + slice.eigenvalues.len()).div_ceil(WIDTH);
    let own = &mut blocks[first..end];
    let [shared, rest @ ..] = own else { return Ok(Vec::new()) };
    if skip == 0 {
        return slice.vectors(tools, skip, own);
    }
    // The slice before has columns in the first block.
    let n = shared.len();
    let mut apart = tools.pool.take(n + 1);
    let mut into: Vec<&mut [Row]> =
        [&mut apart[..n]].into_iter().chain(rest.iter_mut().map(|block| &mut **block)).collect();
    let residuals = slice.vectors(tools, skip, &mut into);
    if residuals.is_ok() {
        shared.iter_mut().zip(&apart[..n]).for_each(|(to, from)| to[skip..].copy_from_slice(&from[skip..]));
    }
    tools.pool.give([apart]);
    residuals
}

/// The middle of the widest gap near the place of number `under` among values that may be eigenvalues.
fn guess(ahead: &[f64], under: usize) -> Option<f64> {
    let reliable = &ahead[..ahead.len() * 2 / 3];
    if reliable.len() < under + 2 {
        return None;
    }
    let (from, to) = ((under - under / 6).max(1), (under + under / 6).min(reliable.len() - 1));
    let gap = |k: usize| reliable[k] - reliable[k - 1];
    let widest = (from..=to).max_by(|&a, &b| gap(a).total_cmp(&gap(b)))?;
    Some(0.5 * (reliable[widest] + reliable[widest - 1]))
}

/// Factors at a shift near the one wanted that has about `under` more eigenvalues below it than `below`, and is no
/// closer to one of them than is good for the factor.
fn place_shift(
    tools: &Tools,
    symbolic: &Symbolic,
    wanted: f64,
    (below, under): (usize, usize),
    (mut low, mut high): (f64, f64),
    attempt: usize,
) -> Result<Factor, Trouble> {
    let spacing = (wanted - low).max(1e-9 * tools.top) / under as f64;
    let mut shift = (wanted + 0.21 * spacing * attempt as f64).min(high);
    let mut best: Option<Factor> = None;
    let (mut narrow, mut usable) = (false, 0);
    for _ in 0..60 {
        tools.progress.go_on()?;
        let Some(factor) = symbolic.factor(tools.matrix, shift, tools.progress) else {
            shift += 0.013 * spacing;
            continue;
        };
        let nu = factor.below;
        let good = factor.growth < GROWTH_MAX && factor.pivot_min > PIVOT_MIN * spacing;
        if nu <= below || (nu - below > 2 * under + 8 && !narrow) {
            symbolic.recycle(factor);
            if best.is_some() {
                break;
            }
            if nu <= below {
                low = shift
            } else {
                high = shift
            }
            // Newton's method on the counting function, or halving the bracket.
            let newton = shift + ((below + under) as f64 - nu as f64) * spacing;
            shift = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if high - low < CUT_GAP * tools.top {
                (narrow, shift) = (true, high + CUT_GAP * tools.top); // a cluster larger than a slice: take it whole
            }
            continue;
        }
        if best.as_ref().is_none_or(|best| factor.growth / factor.pivot_min < best.growth / best.pivot_min) {
            best.replace(factor).into_iter().for_each(|worse| symbolic.recycle(worse));
        } else {
            symbolic.recycle(factor);
        }
        usable += 1;
        if good || usable >= 4 {
            break;
        }
        shift += 0.37 * spacing;
    }
    best.ok_or_else(|| Trouble::Again(format!("no factorisation near the shift {wanted:e}")))
}
