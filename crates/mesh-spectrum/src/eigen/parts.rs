//! Products of blocks on parts of their rows, which a thread with nothing else to do may take.
//!
//! A chain of slices is one thread's work. When another has ended, or there is but one, its products are what can be
//! shared. The parts depend on the number of rows alone and sums are added in their order, so that the result is the
//! same bytes on any number of threads.

use std::ops::Range;

use rayon::prelude::*;

use crate::eigen::block::{Row, SMALL_ZERO, Small, ZERO, add, negative};
use crate::eigen::kernel::{self, Kind};
use crate::eigen::products::PANEL;
use crate::eigen::{EigenError, Progress};

/// The most parts, and the fewest rows of one: the work on them takes longer than to wake a thread.
const PARTS_MAX: usize = 8;
const ROWS_MIN: usize = 4096;

/// Rows that are combined between two questions whether to stop.
const ROWS_AT_ONCE: usize = 1 << 15;

/// Rows of a part.
fn part(rows: usize) -> usize {
    rows.max(1).div_ceil((rows / ROWS_MIN).clamp(1, PARTS_MAX)).next_multiple_of(PANEL)
}

/// The parts of so many rows, whole panels.
pub(crate) fn parts(rows: usize) -> impl IndexedParallelIterator<Item = Range<usize>> {
    let part = part(rows);
    (0..rows.div_ceil(part)).into_par_iter().map(move |k| k * part..((k + 1) * part).min(rows))
}

fn of<'a>(blocks: &[&'a [Row]], rows: &Range<usize>) -> Vec<&'a [Row]> {
    blocks.iter().map(|block| &block[rows.clone()]).collect()
}

/// The parts of several blocks, for each part those of all blocks.
fn split<'a>(blocks: &'a mut [&mut [Row]]) -> Vec<Vec<&'a mut [Row]>> {
    let rows = blocks.first().map_or(0, |block| block.len());
    let mut all: Vec<Vec<&mut [Row]>> = (0..rows.div_ceil(part(rows))).map(|_| Vec::new()).collect();
    for block in blocks {
        block.chunks_mut(part(rows)).zip(&mut all).for_each(|(rows, of_part)| of_part.push(rows));
    }
    all
}

fn sum(parts: Vec<Vec<Small>>, out: &mut [Small]) {
    out.fill(SMALL_ZERO);
    parts.iter().for_each(|part| out.iter_mut().zip(part).for_each(|(sum, part)| add(sum, part)));
}

/// out[i·blocks + k] = Q_kᵀ W_i.
pub(crate) fn gram(kind: Kind, blocks: &[&[Row]], ws: &[&[Row]], out: &mut [Small]) {
    let rows = blocks.first().map_or(0, |block| block.len());
    let one = |rows: Range<usize>| {
        let mut out = vec![SMALL_ZERO; blocks.len() * ws.len()];
        kernel::gram(kind, &of(blocks, &rows), &of(ws, &rows), &mut out);
        out
    };
    sum(parts(rows).map(one).collect(), out);
}

/// Qᵀ W of two blocks.
pub(crate) fn gram_of(kind: Kind, q: &[Row], w: &[Row]) -> Small {
    let mut out = [SMALL_ZERO];
    gram(kind, &[q], &[w], &mut out);
    out[0]
}

/// W_i −= Σ_k Q_k C_ki with C_ki = c[i·blocks + k], the layout of [`gram`].
pub(crate) fn take_off(kind: Kind, blocks: &[&[Row]], c: &[Small], ws: &mut [&mut [Row]]) {
    let minus: Vec<Small> = c.iter().map(negative).collect();
    let part = part(ws.first().map_or(0, |w| w.len()));
    split(ws).par_iter_mut().enumerate().for_each(|(number, ws)| {
        let rows = number * part..number * part + ws[0].len();
        kernel::update(kind, &of(blocks, &rows), &minus, ws, true);
    });
}

/// W −= Σ_k Q_k C_k, then out_i = P_iᵀ W and, after them, Wᵀ W and, if there is a V, P_iᵀ V, in one pass.
pub(crate) fn recur(
    kind: Kind,
    q: &[&[Row]],
    c: &[Small],
    w: &mut [Row],
    p: &[&[Row]],
    v: Option<&[Row]>,
    out: &mut [Small],
) {
    let minus: Vec<Small> = c.iter().map(negative).collect();
    let part = part(w.len());
    let one = |(number, w): (usize, &mut [Row])| {
        let rows = number * part..number * part + w.len();
        let mut out = vec![SMALL_ZERO; out.len()];
        let v = v.map_or(&[][..], |v| &v[rows.clone()]);
        kernel::recur(kind, &of(q, &rows), &minus, w, &of(p, &rows), v, &mut out);
        out
    };
    sum(w.par_chunks_mut(part).enumerate().map(one).collect(), out);
}

/// W = (W − Σ_k Q_k C_k) S, and a copy of it, if one is wanted, in one pass. Result: Wᵀ W.
pub(crate) fn scale(
    kind: Kind,
    q: &[&[Row]],
    c: &[Small],
    s: &Small,
    w: &mut [Row],
    copy: Option<&mut [Row]>,
) -> Small {
    let minus: Vec<Small> = c.iter().map(negative).collect();
    let part = part(w.len());
    let one = |number: usize, w: &mut [Row], copy: &mut [Row]| {
        let rows = number * part..number * part + w.len();
        let mut square = SMALL_ZERO;
        kernel::scale(kind, &of(q, &rows), &minus, s, w, copy, &mut square);
        vec![square]
    };
    let ws = w.par_chunks_mut(part).enumerate();
    let mut out = [SMALL_ZERO];
    let squares = match copy {
        Some(copy) => ws.zip(copy.par_chunks_mut(part)).map(|((number, w), copy)| one(number, w, copy)).collect(),
        None => ws.map(|(number, w)| one(number, w, &mut [])).collect(),
    };
    sum(squares, &mut out);
    out[0]
}

/// W_i = Σ_k Q_k C_ki.
///
/// # Errors
/// [`EigenError::Stopped`].
pub(crate) fn combine(
    kind: Kind,
    blocks: &[&[Row]],
    c: &[Small],
    into: &mut [&mut [Row]],
    progress: &Progress,
) -> Result<(), EigenError> {
    let part = part(into.first().map_or(0, |w| w.len()));
    split(into).par_iter_mut().enumerate().try_for_each(|(number, ws)| {
        let end = ws[0].len();
        for first in (0..end).step_by(ROWS_AT_ONCE) {
            progress.go_on()?;
            let rows = first..(first + ROWS_AT_ONCE).min(end);
            let blocks = of(blocks, &(number * part + rows.start..number * part + rows.end));
            let mut ws: Vec<&mut [Row]> = ws.iter_mut().map(|w| &mut w[rows.clone()]).collect();
            kernel::update(kind, &blocks, c, &mut ws, false);
        }
        Ok(())
    })
}

/// The same in the memory of the first blocks, as many as are made.
///
/// # Errors
/// [`EigenError::Stopped`].
pub(crate) fn combine_in_place(
    kind: Kind,
    blocks: &mut [&mut [Row]],
    c: &[Small],
    progress: &Progress,
) -> Result<(), EigenError> {
    let made = c.len() / blocks.len();
    split(blocks).par_iter_mut().try_for_each(|blocks| {
        let mut made = vec![vec![ZERO; PANEL]; made];
        let end = blocks[0].len();
        for first in (0..end).step_by(PANEL) {
            progress.go_on()?;
            let rows = first..(first + PANEL).min(end);
            let mut into: Vec<&mut [Row]> = made.iter_mut().map(|made| &mut made[..rows.len()]).collect();
            let from: Vec<&[Row]> = blocks.iter().map(|block| &block[rows.clone()]).collect();
            kernel::update(kind, &from, c, &mut into, false);
            blocks.iter_mut().zip(into).for_each(|(block, made)| block[rows.clone()].copy_from_slice(made));
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::block::ZERO;
    use crate::eigen::kernel::tests::block;

    fn smalls(count: usize) -> Vec<Small> {
        block(8 * count, 9).chunks(8).map(|rows| std::array::from_fn(|a| rows[a])).collect()
    }

    /// Everything that is computed in parts, on so many threads.
    fn all(rows: usize, threads: usize) -> Vec<Vec<Row>> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (kind, q, p, v) = (Kind::best(), block(rows, 1), block(rows, 2), block(rows, 3));
            let blocks: [&[Row]; 2] = [&q, &p];
            let mut c = vec![SMALL_ZERO; 2];
            gram(kind, &blocks, &[&v], &mut c);
            let mut seen = vec![c.concat(), gram_of(kind, &q, &p).to_vec()];
            let mut w = v.clone();
            take_off(kind, &blocks, &smalls(2), &mut [&mut w]);
            seen.push(w.clone());
            let mut out = vec![SMALL_ZERO; 2];
            recur(kind, &blocks, &smalls(2), &mut w, &[&q], None, &mut out);
            let mut copy = vec![ZERO; rows];
            let square = scale(kind, &blocks, &smalls(2), &smalls(1)[0], &mut w, Some(&mut copy));
            assert_eq!(w, copy);
            seen.extend([out.concat(), square.to_vec(), w]);
            let progress = Progress::new(&(), 0);
            let mut made = [vec![ZERO; rows], vec![ZERO; rows]];
            combine(kind, &[&q, &p, &v], &smalls(6), &mut made.each_mut().map(|w| &mut w[..]), &progress).unwrap();
            let (mut q, mut p, mut v) = (q, p, v);
            combine_in_place(kind, &mut [&mut q, &mut p, &mut v], &smalls(6), &progress).unwrap();
            assert_eq!([&q, &p], [&made[0], &made[1]], "in place, from the same values");
            seen.extend(made);
            seen
        })
    }

    #[test]
    fn parts_are_the_same_bytes_on_any_number_of_threads() {
        for rows in [1, 255, 4095, 4096, 10_000, 70_000] {
            let covered: Vec<Range<usize>> = parts(rows).collect();
            assert_eq!((covered[0].start, covered.last().unwrap().end), (0, rows));
            assert!(covered.windows(2).all(|pair| pair[0].end == pair[1].start && pair[0].end % PANEL == 0));
            assert_eq!(all(rows, 1), all(rows, 2));
        }
    }

    #[test]
    fn parts_add_up_to_the_whole() {
        let (rows, kind) = (10_000, Kind::best());
        let (q, w) = (block(rows, 1), block(rows, 2));
        let mut whole = vec![SMALL_ZERO; 1];
        kernel::gram(kind, &[&q], &[&w], &mut whole);
        for (a, b) in whole[0].as_flattened().iter().zip(gram_of(kind, &q, &w).as_flattened()) {
            assert!((a - b).abs() <= 1e-16 * rows as f64, "rounding of sums of products below ¼");
        }
    }
}
