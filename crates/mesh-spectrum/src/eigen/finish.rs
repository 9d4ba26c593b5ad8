//! The last step of every component: the exact null vector, orthogonality across slices, and the measured evidence.

use std::ops::Range;

use rayon::prelude::*;

use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH, ZERO, add, transpose};
use crate::eigen::component::{Component, Pairs};
use crate::eigen::kernel::{self, Kind};
use crate::eigen::{EigenError, Orthogonality, Progress};

/// Inner products above this share of what is allowed are removed, once one is above `CLEAN_FROM` of it. Slices leave
/// 1e-12 (inside) to 2e-10 (across a border).
const CLEAN_ABOVE: f64 = 0.8;
const CLEAN_FROM: f64 = 0.9;

/// Inner products above this are no rounding: the same eigenspace was taken twice. Below it the vectors span what they
/// should, even where slivers make rounding large, and residuals measured afterwards decide whether they are eigenvectors.
const OVERLAP_MAX: f64 = 1e-2;

/// Parts of the rows that threads work on. Fixed, so that sums are added in one order on any number of threads.
const PARTS: usize = 8;

/// Rows of all blocks together that stay in a core's cache while every block meets every other.
const PANEL: usize = 256;

/// What was measured on the vectors.
#[derive(Debug, Clone)]
pub(crate) struct Evidence {
    /// max ‖A v − λ v‖, 1/ℓ².
    pub(crate) residual: f64,
    /// max |Vᵀ V − I|.
    pub(crate) orthogonality: f64,
    /// For each pair, what its vector as stored is to be multiplied with to have length 1.
    pub(crate) scales: Vec<f64>,
}

/// Puts in the null pair in closed form, removes what vectors have in common beyond rounding, and measures.
///
/// # Errors
/// [`EigenError::NotOrthogonal`] if two vectors share more than rounding.
pub(crate) fn finish(
    component: &Component,
    pairs: &mut Pairs,
    orthogonality: Orthogonality,
    kind: Kind,
    progress: &Progress,
) -> Result<Evidence, EigenError> {
    let n = component.rows();
    let count = pairs.eigenvalues.len();
    if count == 0 {
        return Ok(Evidence { residual: 0.0, orthogonality: 0.0, scales: Vec::new() });
    }
    let null = component.null_vector();
    let first = pairs.places[0];
    let block = &mut pairs.vectors[first / WIDTH * n..][..n];
    block.iter_mut().zip(&null).for_each(|(row, null)| row[first % WIDTH] = *null);

    let used: Vec<usize> = pairs.places.chunk_by(|a, b| a / WIDTH == b / WIDTH).map(|same| same[0] / WIDTH).collect();
    // Place of each pair among the blocks in use.
    let mut places = Vec::with_capacity(count);
    for (i, same) in pairs.places.chunk_by(|a, b| a / WIDTH == b / WIDTH).enumerate() {
        places.extend(same.iter().map(|place| WIDTH * i + place % WIDTH));
    }
    let mut blocks: Vec<&mut [Row]> = pairs.vectors.chunks_exact_mut(n).collect();
    let mut number = 0;
    blocks.retain(|_| {
        number += 1;
        used.binary_search(&(number - 1)).is_ok()
    });

    let mut gram = Gram::of(&blocks, kind, progress)?;
    let mut loss = gram.loss(&places);
    if loss.is_nan() || loss > OVERLAP_MAX {
        return Err(EigenError::NotOrthogonal { loss });
    }
    let allowed = orthogonality.allowed();
    let (above, enough) = match orthogonality {
        Orthogonality::Standard => (CLEAN_ABOVE * allowed, CLEAN_FROM * allowed),
        Orthogonality::Full => (0.0, 0.0),
    };
    let mut touched = vec![false; blocks.len()];
    touched[0] = true; // it has the null vector now
    for pass in 0..4 {
        // Slivers may need several passes. Full orthogonality is one at least, and more only where it is not yet there.
        if loss <= if pass == 0 { enough } else { enough.max(0.1 * allowed) } {
            break;
        }
        let changed = gram.clean(&mut blocks, &places, above, kind, progress)?;
        changed.iter().for_each(|&i| touched[i] = true);
        gram.renew(&changed, &blocks, kind, progress)?;
        loss = gram.loss(&places);
    }
    let scales: Vec<f64> = places.iter().map(|&place| 1.0 / gram.entry(place, place).sqrt()).collect();

    // What was measured before holds where nothing has been changed since.
    let known = pairs.residuals.as_ref();
    let mut per_block = vec![Measured { known: 0.0, eigenvalues: ZERO, scales: ZERO }; blocks.len()];
    for (k, (&place, scale)) in places.iter().zip(&scales).enumerate() {
        let block = &mut per_block[place / WIDTH];
        block.eigenvalues[place % WIDTH] = pairs.eigenvalues[k] / component.unit;
        block.scales[place % WIDTH] = *scale;
        block.known = larger(known.map_or(0.0, |known| known[k] * scale), block.known);
    }
    let residual = blocks
        .par_iter()
        .zip(&per_block)
        .enumerate()
        .map(|(number, (block, Measured { known: most, eigenvalues, scales }))| {
            if !touched[number] && known.is_some() {
                return Ok(*most);
            }
            progress.go_on()?;
            let mut squares = ZERO;
            kernel::residual(kind, &component.matrix, block, eigenvalues, &mut squares);
            Ok(component.unit * (0..WIDTH).map(|k| squares[k].sqrt() * scales[k]).fold(0.0, larger))
        })
        .try_reduce(|| 0.0, |a, b| Ok(larger(a, b)))?; // a maximum, the same in any order
    Ok(Evidence { residual, orthogonality: loss, scales })
}

/// What is known of the columns of a block, which need not all belong to a pair.
#[derive(Clone)]
struct Measured {
    /// The largest residual, 1/ℓ², if that has been measured.
    known: f64,
    eigenvalues: Row,
    scales: Row,
}

/// The larger of two numbers; not a number, if one is not.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// For each of `columns`, Q_kᵀ W_i of the blocks i in the range that `of` says, and of all blocks k before the end it
/// says. Summed in parts that do not depend on the number of threads.
fn products(
    blocks: &[&mut [Row]],
    columns: &[usize],
    of: impl Fn(usize) -> (Range<usize>, usize) + Sync,
    kind: Kind,
    progress: &Progress,
) -> Result<Vec<Vec<Small>>, EigenError> {
    let n = blocks[0].len();
    let part = n.div_ceil(PARTS).next_multiple_of(PANEL);
    let zero = || -> Vec<Vec<Small>> {
        let size = |&i: &usize| of(i).0.len() * of(i).1;
        columns.iter().map(|i| vec![SMALL_ZERO; size(i)]).collect()
    };
    let one = |first: usize| {
        let mut sums = zero();
        let mut out = Vec::new();
        for first in (first..(first + part).min(n)).step_by(PANEL) {
            progress.go_on()?;
            let panel: Vec<&[Row]> = blocks.iter().map(|block| &block[first..(first + PANEL).min(n)]).collect();
            for (&i, sum) in columns.iter().zip(&mut sums) {
                let (own, end) = of(i);
                out.resize(sum.len(), SMALL_ZERO);
                kernel::gram(kind, &panel[..end], &panel[own], &mut out);
                add_all(sum, &out);
            }
        }
        Ok(sums)
    };
    let parts = (0..n).into_par_iter().step_by(part).map(one).collect::<Result<Vec<_>, EigenError>>()?;
    let mut sums = zero();
    parts.iter().for_each(|part| sums.iter_mut().zip(part).for_each(|(sum, part)| add_all(sum, part)));
    Ok(sums)
}

fn add_all(sums: &mut [Small], parts: &[Small]) {
    sums.iter_mut().zip(parts).for_each(|(sum, part)| add(sum, part));
}

/// Vᵀ V, the blocks (k, i) with k ≤ i, one i after another.
struct Gram {
    blocks: usize,
    parts: Vec<Small>,
}

impl Gram {
    fn of(blocks: &[&mut [Row]], kind: Kind, progress: &Progress) -> Result<Gram, EigenError> {
        let count = blocks.len();
        let starts: Vec<usize> = (0..count).step_by(2).collect();
        let mut parts = vec![SMALL_ZERO; count * (count + 1) / 2];
        // Two columns of blocks at a time, down to the diagonal.
        let pair = |i: usize| (i..(i + 2).min(count), (i + 2).min(count));
        for (i, of_pair) in starts.iter().zip(products(blocks, &starts, pair, kind, progress)?) {
            let (columns, end) = pair(*i);
            for (i, out) in columns.zip(of_pair.chunks_exact(end)) {
                parts[i * (i + 1) / 2..][..i + 1].copy_from_slice(&out[..i + 1]);
            }
        }
        Ok(Gram { blocks: count, parts })
    }

    /// Measures anew what has changed with some of the blocks.
    fn renew(
        &mut self,
        changed: &[usize],
        blocks: &[&mut [Row]],
        kind: Kind,
        progress: &Progress,
    ) -> Result<(), EigenError> {
        let count = self.blocks;
        if 2 * changed.len() > count {
            *self = Gram::of(blocks, kind, progress)?;
            return Ok(());
        }
        // Two neighbours at a time, where both have changed.
        let mut runs: Vec<Range<usize>> = Vec::new();
        for &i in changed {
            match runs.last_mut() {
                Some(run) if run.end == i && run.len() == 1 => run.end += 1,
                _ => runs.push(i..i + 1),
            }
        }
        let starts: Vec<usize> = runs.iter().map(|run| run.start).collect();
        let of = |i: usize| (i..i + runs[starts.partition_point(|&start| start < i)].len(), count);
        for (run, out) in runs.iter().zip(products(blocks, &starts, of, kind, progress)?) {
            for (i, out) in run.clone().zip(out.chunks_exact(count)) {
                for (k, out) in out.iter().enumerate() {
                    let (low, high) = (k.min(i), k.max(i));
                    self.parts[high * (high + 1) / 2 + low] = if k <= i { *out } else { transpose(out) };
                }
            }
        }
        Ok(())
    }

    /// The entry of two columns.
    fn entry(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (a.min(b), a.max(b));
        let (k, i) = (a / WIDTH, b / WIDTH);
        self.parts[i * (i + 1) / 2 + k][a % WIDTH][b % WIDTH]
    }

    /// The largest inner product of two of the columns, each scaled to length 1.
    fn loss(&self, places: &[usize]) -> f64 {
        let scales: Vec<f64> = places.iter().map(|&place| 1.0 / self.entry(place, place).sqrt()).collect();
        let mut most = 0.0;
        for (i, &b) in places.iter().enumerate() {
            for (k, &a) in places[..i].iter().enumerate() {
                most = larger((self.entry(a, b) * scales[i] * scales[k]).abs(), most);
            }
        }
        most
    }

    /// V ← V (3 I − Vᵀ V) / 2 on vectors scaled to length 1, the first step of Löwdin's symmetric orthonormalisation,
    /// for the entries above a bound. What is left is of the square of what was there. The null vector, the first,
    /// stays as it is. Result: the blocks that have changed.
    fn clean(
        &self,
        blocks: &mut [&mut [Row]],
        places: &[usize],
        above: f64,
        kind: Kind,
        progress: &Progress,
    ) -> Result<Vec<usize>, EigenError> {
        // V ← V + V C. Columns that belong to no pair are left alone.
        let count = self.blocks;
        let mut c = vec![SMALL_ZERO; count * count];
        let mut coupled = vec![false; count * count];
        let scales: Vec<f64> = places.iter().map(|&place| 1.0 / self.entry(place, place).sqrt()).collect();
        let mut set = |from: usize, to: usize, value: f64| {
            let at = to / WIDTH * count + from / WIDTH;
            c[at][from % WIDTH][to % WIDTH] = value;
            coupled[at] = true;
        };
        for (i, &b) in places.iter().enumerate() {
            for (k, &a) in places[..i].iter().enumerate() {
                let along = self.entry(a, b) * scales[i] * scales[k];
                if along.abs() > above {
                    let (to_low, to_high) = if k == 0 { (0.0, along) } else { (0.5 * along, 0.5 * along) };
                    // The lengths of the stored vectors come in again.
                    set(a, b, -to_high * scales[k] / scales[i]);
                    if to_low != 0.0 {
                        set(b, a, -to_low * scales[i] / scales[k]);
                    }
                }
            }
        }
        // Two blocks at a time, from the blocks that either is coupled to.
        let jobs: Vec<(Vec<usize>, Vec<Small>)> = coupled
            .chunks(2 * count)
            .zip(c.chunks(2 * count))
            .map(|(coupled, c)| {
                let from: Vec<usize> = (0..count).filter(|k| coupled[*k..].iter().step_by(count).any(|x| *x)).collect();
                let c = c.chunks(count).flat_map(|c| from.iter().map(|&k| c[k])).collect();
                (from, c)
            })
            .collect();
        drop(c);
        let mut needed = vec![false; count];
        jobs.iter().flat_map(|(from, _)| from).for_each(|&k| needed[k] = true);
        let n = blocks[0].len();
        let mut panels: Vec<Vec<&mut [Row]>> = (0..n.div_ceil(PANEL / 4)).map(|_| Vec::new()).collect();
        for block in blocks {
            block.chunks_mut(PANEL / 4).zip(&mut panels).for_each(|(rows, panel)| panel.push(rows));
        }
        panels.par_iter_mut().try_for_each(|panel| {
            progress.go_on()?;
            let before: Vec<Vec<Row>> = panel
                .iter()
                .zip(&needed)
                .map(|(rows, needed)| if *needed { rows.to_vec() } else { Vec::new() })
                .collect();
            for (own, (from, c)) in panel.chunks_mut(2).zip(&jobs).filter(|(_, (from, _))| !from.is_empty()) {
                let from: Vec<&[Row]> = from.iter().map(|&k| &before[k][..]).collect();
                kernel::update(kind, &from, c, own, true);
            }
            Ok(())
        })?;
        Ok((0..count).filter(|&i| !jobs[i / 2].0.is_empty()).collect())
    }
}
