//! The last step of every component: the exact null vector, orthogonality across slices, and the measured evidence.

use rayon::prelude::*;

use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH, ZERO};
use crate::eigen::component::{Component, Pairs};
use crate::eigen::kernel::{self, Kind};
use crate::eigen::{EigenError, Orthogonality, Progress};

/// Inner products above this are removed. Slices leave 1e-12 (inside) to 2e-10 (across a border).
const CLEAN_ABOVE: f64 = 1e-11;

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
    let (above, enough) = match orthogonality {
        Orthogonality::Standard => (CLEAN_ABOVE, 5.0 * CLEAN_ABOVE),
        Orthogonality::Full => (0.0, 0.0),
    };
    for pass in 0..4 {
        // Slivers may need several passes. Full orthogonality is one at least, and more only where it is not yet there.
        if loss <= if pass == 0 { enough } else { enough.max(0.1 * orthogonality.allowed()) } {
            break;
        }
        gram.clean(&mut blocks, &places, above, kind, progress)?;
        gram = Gram::of(&blocks, kind, progress)?;
        loss = gram.loss(&places);
    }
    let scales: Vec<f64> = places.iter().map(|&place| 1.0 / gram.entry(place, place).sqrt()).collect();

    let mut per_block: Vec<(Row, Row)> = vec![(ZERO, ZERO); blocks.len()];
    for ((&place, eigenvalue), scale) in places.iter().zip(&pairs.eigenvalues).zip(&scales) {
        let (eigenvalues, block_scales) = &mut per_block[place / WIDTH];
        eigenvalues[place % WIDTH] = eigenvalue / component.unit;
        block_scales[place % WIDTH] = *scale;
    }
    let residual = blocks
        .par_iter()
        .zip(&per_block)
        .map(|(block, (eigenvalues, scales))| {
            progress.go_on()?;
            let mut squares = ZERO;
            kernel::residual(kind, &component.matrix, block, eigenvalues, &mut squares);
            Ok((0..WIDTH).map(|k| squares[k].sqrt() * scales[k]).fold(0.0, larger))
        })
        .try_reduce(|| 0.0, |a, b| Ok(larger(a, b)))?; // a maximum, the same in any order
    Ok(Evidence { residual: residual * component.unit, orthogonality: loss, scales })
}

/// The larger of two numbers; not a number, if one is not.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// Vᵀ V, the blocks (k, i) with k ≤ i, one i after another.
struct Gram {
    blocks: usize,
    parts: Vec<Small>,
}

impl Gram {
    fn of(blocks: &[&mut [Row]], kind: Kind, progress: &Progress) -> Result<Gram, EigenError> {
        let n = blocks[0].len();
        let part = n.div_ceil(PARTS).next_multiple_of(PANEL);
        let count = blocks.len();
        let size = count * (count + 1) / 2;
        let one = |first: usize| {
            let mut sum = vec![SMALL_ZERO; size];
            let mut out = vec![SMALL_ZERO; 2 * count];
            for first in (first..(first + part).min(n)).step_by(PANEL) {
                progress.go_on()?;
                let panel: Vec<&[Row]> = blocks.iter().map(|block| &block[first..(first + PANEL).min(n)]).collect();
                for i in (0..count).step_by(2) {
                    let end = (i + 2).min(count);
                    let out = &mut out[..(end - i) * end];
                    kernel::gram(kind, &panel[..end], &panel[i..end], out);
                    for (i, out) in (i..end).zip(out.chunks_exact(end)) {
                        let sum = &mut sum[i * (i + 1) / 2..][..i + 1];
                        for (sum, out) in sum.as_flattened_mut().iter_mut().zip(out.as_flattened()) {
                            (0..WIDTH).for_each(|k| sum[k] += out[k]);
                        }
                    }
                }
            }
            Ok(sum)
        };
        let sums = (0..n).into_par_iter().step_by(part).map(one).collect::<Result<Vec<_>, _>>()?;
        let mut parts = vec![SMALL_ZERO; size];
        for sum in sums {
            for (total, sum) in parts.as_flattened_mut().iter_mut().zip(sum.as_flattened()) {
                (0..WIDTH).for_each(|k| total[k] += sum[k]);
            }
        }
        Ok(Gram { blocks: count, parts })
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
    /// stays as it is.
    fn clean(
        &self,
        blocks: &mut [&mut [Row]],
        places: &[usize],
        above: f64,
        kind: Kind,
        progress: &Progress,
    ) -> Result<(), EigenError> {
        // V ← V + V C. Columns that belong to no pair are left alone.
        let count = self.blocks;
        let mut c = vec![SMALL_ZERO; count * count];
        let scales: Vec<f64> = places.iter().map(|&place| 1.0 / self.entry(place, place).sqrt()).collect();
        let mut partners: Vec<Vec<usize>> = vec![Vec::new(); count];
        let mut set = |from: usize, to: usize, value: f64| {
            let (k, i) = (from / WIDTH, to / WIDTH);
            c[i * count + k][from % WIDTH][to % WIDTH] = value;
            if !partners[i].contains(&k) {
                partners[i].push(k);
            }
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
        let n = blocks[0].len();
        let mut panels: Vec<Vec<&mut [Row]>> = (0..n.div_ceil(PANEL / 4)).map(|_| Vec::new()).collect();
        for block in blocks {
            block.chunks_mut(PANEL / 4).zip(&mut panels).for_each(|(rows, panel)| panel.push(rows));
        }
        panels.par_iter_mut().try_for_each(|panel| {
            progress.go_on()?;
            let before: Vec<Vec<Row>> = panel.iter().map(|rows| rows.to_vec()).collect();
            for (i, rows) in panel.iter_mut().enumerate() {
                if partners[i].is_empty() {
                    continue;
                }
                let from: Vec<&[Row]> = partners[i].iter().map(|&k| &before[k][..]).collect();
                let c: Vec<Small> = partners[i].iter().map(|&k| c[i * count + k]).collect();
                kernel::update(kind, &from, &c, &mut [rows], true);
            }
            Ok(())
        })
    }
}
