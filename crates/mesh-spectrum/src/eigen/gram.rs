//! Inner products of all vectors of a range, and taking away those that should be zero.

use std::ops::Range;

use rayon::prelude::*;

use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH, add, transpose};
use crate::eigen::kernel::{self, Kind, PANEL};
use crate::eigen::parts::parts;
use crate::eigen::{EigenError, Progress};

/// The larger of two numbers; not a number, if one is not.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
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
    let zero = || -> Vec<Vec<Small>> {
        let size = |&i: &usize| of(i).0.len() * of(i).1;
        columns.iter().map(|i| vec![SMALL_ZERO; size(i)]).collect()
    };
    let one = |rows: Range<usize>| {
        let mut sums = zero();
        for first in rows.clone().step_by(PANEL) {
            progress.go_on()?;
            // Rows of all blocks that stay in a core's cache while every block meets every other.
            let panel: Vec<&[Row]> = blocks.iter().map(|block| &block[first..(first + PANEL).min(rows.end)]).collect();
            for (&i, sum) in columns.iter().zip(&mut sums) {
                let (own, end) = of(i);
                kernel::gram(kind, &panel[..end], &panel[own], sum);
            }
        }
        Ok(sums)
    };
    let all = parts(blocks[0].len()).map(one).collect::<Result<Vec<_>, EigenError>>()?;
    let mut all = all.into_iter();
    let mut sums = all.next().unwrap_or_default();
    for part in all {
        for (sum, part) in sums.iter_mut().flatten().zip(part.iter().flatten()) {
            add(sum, part);
        }
    }
    Ok(sums)
}

/// Vᵀ V, the blocks (k, i) with k ≤ i, one i after another.
pub(crate) struct Gram {
    blocks: usize,
    parts: Vec<Small>,
}

impl Gram {
    pub(crate) fn of(blocks: &[&mut [Row]], kind: Kind, progress: &Progress) -> Result<Gram, EigenError> {
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
    pub(crate) fn renew(
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
    pub(crate) fn entry(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (a.min(b), a.max(b));
        let (k, i) = (a / WIDTH, b / WIDTH);
        self.parts[i * (i + 1) / 2 + k][a % WIDTH][b % WIDTH]
    }

    /// The largest inner product of two of the columns, each scaled to length 1.
    pub(crate) fn loss(&self, places: &[usize]) -> f64 {
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
    pub(crate) fn clean(
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
