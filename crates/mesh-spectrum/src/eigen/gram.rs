//! Inner products of all vectors of a range, and taking away those that should be zero.

use std::ops::Range;

use rayon::prelude::*;

use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH, add, transpose};
use crate::eigen::kernel::{self, Kind};
use crate::eigen::parts::parts;
use crate::eigen::products::{AT_ONCE, PANEL};
use crate::eigen::single::{SingleRow, SingleSmall};
use crate::eigen::{EigenError, Progress};

/// Rows of all blocks that are multiplied with one another at once: with a thousand pairs they fill half of a core's cache.
const TOGETHER: usize = PANEL / 2;

/// The larger of two numbers; not a number, if one is not.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The smaller of two numbers; not a number, if one is not.
#[inline(always)]
pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if a.is_nan() || a < b { a } else { b }
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
        for first in rows.clone().step_by(TOGETHER) {
            progress.go_on()?;
            // Rows of all blocks that stay in a core's cache while every block meets every other.
            let panel: Vec<&[Row]> =
                blocks.iter().map(|block| &block[first..(first + TOGETHER).min(rows.end)]).collect();
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
        let starts: Vec<usize> = (0..count).step_by(AT_ONCE).collect();
        let mut parts = vec![SMALL_ZERO; count * (count + 1) / 2];
        // Some columns of blocks at a time, down to the diagonal.
        let group = |i: usize| (i..(i + AT_ONCE).min(count), (i + AT_ONCE).min(count));
        for (i, of_group) in starts.iter().zip(products(blocks, &starts, group, kind, progress)?) {
            let (columns, end) = group(*i);
            for (i, out) in columns.zip(of_group.chunks_exact(end)) {
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
        // Neighbours at a time, where they have changed.
        let mut runs: Vec<Range<usize>> = Vec::new();
        for &i in changed {
            match runs.last_mut() {
                Some(run) if run.end == i && run.len() < AT_ONCE => run.end += 1,
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
        let (part, row, column) = place(a, b);
        self.parts[part][row][column]
    }

    fn entry_mut(&mut self, a: usize, b: usize) -> &mut f64 {
        let (part, row, column) = place(a, b);
        &mut self.parts[part][row][column]
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

    /// The C with which V + V C is V (3 I − VᵀV) / 2 on vectors scaled to length 1, the first step of Löwdin's symmetric
    /// orthonormalisation, for the entries above a bound. What is left is of the square of what was there. The null
    /// vector, the first, stays as it is; columns that belong to no pair are left alone.
    pub(crate) fn couplings(&self, places: &[usize], above: f64) -> Vec<Couplings> {
        let side = WIDTH * self.blocks;
        let mut scales = vec![0.0; side];
        places.iter().for_each(|&place| scales[place] = 1.0 / self.entry(place, place).sqrt());
        let null = places.first().copied();
        let of_pair = |pair: usize| {
            let mut c = vec![[[0.0; 2 * WIDTH]; WIDTH]; self.blocks];
            let mut coupled = vec![false; self.blocks];
            let own = 2 * WIDTH * pair..(2 * WIDTH * (pair + 1)).min(side);
            for to in own.filter(|&to| scales[to] > 0.0 && Some(to) != null) {
                for from in (0..side).filter(|&from| from != to) {
                    let along = self.entry(from, to) * scales[to] * scales[from];
                    if along.abs() > above {
                        let share = if Some(from) == null { 1.0 } else { 0.5 };
                        // The lengths of the stored vectors come in again.
                        c[from / WIDTH][from % WIDTH][to % (2 * WIDTH)] =
                            (-share * along * scales[from] / scales[to]) as f32;
                        coupled[from / WIDTH] = true;
                    }
                }
            }
            let from: Vec<usize> = (0..self.blocks).filter(|&k| coupled[k]).collect();
            let c = from.iter().map(|&k| c[k]).collect();
            Couplings { pair, from, c }
        };
        (0..self.blocks.div_ceil(2)).into_par_iter().map(of_pair).collect()
    }

    /// (I + C)ᵀ G (I + C), what G = VᵀV becomes, from what was measured before: exact to rounding.
    pub(crate) fn follow(&mut self, couplings: &[Couplings]) {
        let side = WIDTH * self.blocks;
        // G C, of which few columns are not zero.
        let mut along: Vec<Option<Vec<f64>>> = vec![None; side];
        let entries: Vec<(usize, usize, f64)> = couplings.iter().flat_map(Couplings::entries).collect();
        for &(from, to, value) in &entries {
            let column = along[to].get_or_insert_with(|| vec![0.0; side]);
            column.iter_mut().enumerate().for_each(|(row, sum)| *sum += value * self.entry(row, from));
        }
        for (to, column) in along.iter().enumerate() {
            let Some(column) = column else { continue };
            let mut change = column.clone();
            change[to] *= 2.0; // of G C and of its mirror image
            // And Cᵀ G C, of which a half is enough.
            let halved = entries.iter().filter(|&&(_, row, _)| row <= to);
            halved.for_each(|&(from, row, value)| change[row] += value * column[from]);
            change.iter().enumerate().for_each(|(row, change)| *self.entry_mut(row, to) += change);
        }
    }
}

/// Where the entry of two columns is: part, row and column.
fn place(a: usize, b: usize) -> (usize, usize, usize) {
    let (a, b) = (a.min(b), a.max(b));
    let (k, i) = (a / WIDTH, b / WIDTH);
    (i * (i + 1) / 2 + k, a % WIDTH, b % WIDTH)
}

/// What two neighbouring blocks are to get of others: the columns of a matrix C that V is to be multiplied with.
pub(crate) struct Couplings {
    /// The number of the two blocks, in twos.
    pair: usize,
    /// The others, and for each its part of C.
    from: Vec<usize>,
    c: Vec<SingleSmall>,
}

impl Couplings {
    /// The largest entry.
    fn largest(&self) -> f64 {
        f64::from(self.c.as_flattened().as_flattened().iter().fold(0.0f32, |most, x| most.max(x.abs())))
    }

    /// From which column to which, and how much.
    fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.from.iter().zip(&self.c).flat_map(move |(&from, c)| {
            c.iter().enumerate().flat_map(move |(a, row)| {
                let nonzero = row.iter().enumerate().filter(|(_, value)| **value != 0.0);
                nonzero.map(move |(k, &value)| (WIDTH * from + a, 2 * WIDTH * self.pair + k, f64::from(value)))
            })
        })
    }

    /// The blocks that something is added to.
    fn changed(&self) -> Vec<usize> {
        let rows = self.c.as_flattened();
        let is_changed = |half: &usize| rows.iter().any(|row| row[WIDTH * half..][..WIDTH].iter().any(|x| *x != 0.0));
        (0..2).filter(is_changed).map(|half| 2 * self.pair + half).collect()
    }
}

/// Couplings below this are added in single precision: what that rounds off, 6e-8 of them, is multiplied by ‖A‖/λ_K in the
/// residual, and leaves inner products that are known to 1e-15 without being measured again.
const SMALL_MAX: f64 = 1e-8;

pub(crate) fn are_small(couplings: &[Couplings]) -> bool {
    couplings.iter().all(|couplings| couplings.largest() < SMALL_MAX)
}

/// V ← V + V C. Result: the blocks that have changed.
pub(crate) fn couple(
    blocks: &mut [&mut [Row]],
    couplings: &[Couplings],
    kind: Kind,
    progress: &Progress,
) -> Result<Vec<usize>, EigenError> {
    let small = are_small(couplings);
    let mut needed = vec![false; blocks.len()];
    couplings.iter().flat_map(|couplings| &couplings.from).for_each(|&k| needed[k] = true);
    let n = blocks[0].len();
    let mut panels: Vec<Vec<&mut [Row]>> = (0..n.div_ceil(PANEL / 4)).map(|_| Vec::new()).collect();
    for block in blocks {
        block.chunks_mut(PANEL / 4).zip(&mut panels).for_each(|(rows, panel)| panel.push(rows));
    }
    panels.par_iter_mut().try_for_each(|panel| {
        progress.go_on()?;
        if small {
            let before = copies(panel, &needed, |row| row.map(|x| x as f32));
            for (own, Couplings { from, c, .. }) in panel.chunks_mut(2).zip(couplings) {
                let from: Vec<&[SingleRow]> = from.iter().map(|&k| &before[k][..]).collect();
                kernel::correct(kind, &from, c, own);
            }
        } else {
            let before = copies(panel, &needed, |row| *row);
            for (own, Couplings { from, c, .. }) in panel.chunks_mut(2).zip(couplings) {
                let from: Vec<&[Row]> = from.iter().map(|&k| &before[k][..]).collect();
                for (own, half) in own.iter_mut().zip([0, WIDTH]) {
                    let half = |row: &[f32; 2 * WIDTH]| std::array::from_fn(|k| f64::from(row[half + k]));
                    let c: Vec<Small> = c.iter().map(|c| c.each_ref().map(half)).collect();
                    kernel::update(kind, &from, &c, &mut [own], true);
                }
            }
        }
        Ok(())
    })?;
    Ok(couplings.iter().flat_map(Couplings::changed).collect())
}

/// Copies of those blocks of a panel that are needed.
fn copies<T>(panel: &[&mut [Row]], needed: &[bool], copy: impl Fn(&Row) -> T) -> Vec<Vec<T>> {
    let of_block =
        |(rows, needed): (&&mut [Row], &bool)| if *needed { rows.iter().map(&copy).collect() } else { Vec::new() };
    panel.iter().zip(needed).map(of_block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::kernel::tests::block;

    /// Unit vectors, each with so much of something else.
    fn nearly_orthonormal(share: f64) -> Vec<Vec<Row>> {
        let mut blocks: Vec<Vec<Row>> = (0..3).map(|seed| block(1000, seed)).collect();
        for (b, block) in blocks.iter_mut().enumerate() {
            block.iter_mut().flatten().for_each(|x| *x *= share);
            (0..WIDTH).for_each(|k| block[40 * (WIDTH * b + k)][k] += 1.0);
        }
        blocks
    }

    #[test]
    fn what_is_coupled_is_orthonormal_and_known_to_be() {
        let progress = Progress::new(&(), 0);
        let kind = Kind::best();
        let places: Vec<usize> = (0..24).filter(|place| *place != 13).collect(); // a column that belongs to no pair
        // In single precision, and in double.
        for (share, left) in [(1e-9, 1e-15), (1e-5, 1e-8)] {
            let mut blocks = nearly_orthonormal(share);
            let mut blocks: Vec<&mut [Row]> = blocks.iter_mut().map(|block| &mut block[..]).collect();
            let mut gram = Gram::of(&blocks, kind, &progress).unwrap();
            assert!(gram.loss(&places) > 0.1 * share);
            let null: Vec<f64> = blocks[0].iter().map(|row| row[0]).collect();
            let couplings = gram.couplings(&places, 0.0);
            assert_eq!(are_small(&couplings), share < 1e-8);
            assert_eq!(couple(&mut blocks, &couplings, kind, &progress).unwrap(), [0, 1, 2]);
            gram.follow(&couplings);
            let measured = Gram::of(&blocks, kind, &progress).unwrap();
            assert!(measured.loss(&places) < left, "the square of what there was, or rounding");
            for a in 0..24 {
                for b in 0..=a {
                    assert!((gram.entry(a, b) - measured.entry(a, b)).abs() < 1e-14, "rounding of sums below 2");
                }
            }
            assert!(null.iter().zip(blocks[0].iter()).all(|(null, row)| *null == row[0]), "the null vector stays");
        }
    }
}
