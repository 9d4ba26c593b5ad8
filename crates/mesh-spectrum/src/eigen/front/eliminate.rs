//! The dense part of a front: its columns are eliminated, and what that leaves of the rest is made.

use std::ops::Range;

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Row, WIDTH, ZERO};
use crate::eigen::factor::Pivots;
use crate::eigen::gram::smaller;
use crate::eigen::products::{add_outer, in_groups};
use crate::eigen::solve::{Supernode, for_length, in_triangle, triangle_lines};

/// Blocks of eight columns that what was eliminated before them is taken off together, and blocks of an update that are
/// made together: the rows that all of them take stay in a core's cache meanwhile.
const TOGETHER: usize = 4;

/// Where the rows of a group start among a supernode's columns: those of its diagonal block first, then those below.
#[inline(always)]
fn start(s: &Supernode, group: usize) -> usize {
    match group.checked_sub(s.width.div_ceil(WIDTH)) {
        Some(group) => s.below - s.diagonal + group * s.width,
        None => s.diagonal_start(group) - s.diagonal,
    }
}

/// Eliminates a supernode's columns: L into `columns`, −L D into `minus`.
#[inline(always)]
pub(super) fn eliminate<A: Arithmetic, const HIGH: usize, const P: usize>(
    s: &Supernode,
    panel: &mut [f64],
    columns: &mut [Row],
    minus: &mut [Row],
    inverse: &mut [f64],
    pivots: &mut Pivots,
) {
    let blocks = s.width.div_ceil(WIDTH);
    for first in (0..blocks).step_by(TOGETHER) {
        let end = (first + TOGETHER).min(blocks);
        if first > 0 {
            for g in first..end {
                take_before::<A, HIGH, 1>(s, (first, g + 1), g, panel, columns, minus);
            }
            in_groups!(P, blocks + s.groups - end, g, N => {
                take_before::<A, HIGH, N>(s, (first, end), end + g, panel, columns, minus);
            });
        }
        for b in first..end {
            let count = (s.width - WIDTH * b).min(WIDTH);
            let at = (WIDTH * first, b);
            for_length!(count, eliminate_block::<A, P>(s, at, panel, columns, minus, inverse, pivots));
        }
    }
}

/// Takes off N groups of rows from number `g` on, in the blocks of columns `first..end`, what the columns before those
/// owe.
#[inline(always)]
fn take_before<A: Arithmetic, const HIGH: usize, const N: usize>(
    s: &Supernode,
    (first, end): (usize, usize),
    g: usize,
    panel: &mut [f64],
    columns: &[Row],
    minus: &[Row],
) {
    let side = s.side();
    let before = WIDTH * first;
    let mut rows = [&columns[..0]; N];
    for p in 0..N {
        rows[p] = &columns[start(s, g + p)..][..before];
    }
    for b in first..end {
        let of_block = &minus[start(s, b)..][..before];
        let count = (s.width - WIDTH * b).min(WIDTH);
        for high in (0..count).step_by(HIGH) {
            let (at, count) = ((WIDTH * g, WIDTH * b + high), count - high);
            let mut sum = load::<A, HIGH, N>(panel, side, at, count);
            add_outer::<A, HIGH, N>(of_block, high, rows, 0, &mut sum);
            store::<A, HIGH, N>(&sum, panel, side, at, count);
        }
    }
}

/// Eight entries of a column.
#[inline(always)]
pub(super) fn row(column: &[f64], at: usize) -> &Row {
    &column[at..at + WIDTH].as_chunks().0[0]
}

#[inline(always)]
pub(super) fn row_mut(column: &mut [f64], at: usize) -> &mut Row {
    &mut column[at..at + WIDTH].as_chunks_mut().0[0]
}

/// N tiles of eight rows, one below the other, of columns that have `side` rows: `count` of them, or all C.
#[inline(always)]
fn load<A: Arithmetic, const C: usize, const N: usize>(
    from: &[f64],
    side: usize,
    (first, column): (usize, usize),
    count: usize,
) -> [[A::Lanes; C]; N] {
    let mut tiles = [[A::splat(0.0); C]; N];
    for (p, tile) in tiles.iter_mut().enumerate() {
        for (a, lanes) in tile.iter_mut().enumerate().take(count) {
            *lanes = A::load(row(from, (column + a) * side + first + WIDTH * p));
        }
    }
    tiles
}

/// Writes tiles to where [`load`] reads them.
#[inline(always)]
fn store<A: Arithmetic, const C: usize, const N: usize>(
    tiles: &[[A::Lanes; C]; N],
    to: &mut [f64],
    side: usize,
    (first, column): (usize, usize),
    count: usize,
) {
    for (p, tile) in tiles.iter().enumerate() {
        for (a, lanes) in tile.iter().enumerate().take(count) {
            A::store(*lanes, row_mut(to, (column + a) * side + first + WIDTH * p));
        }
    }
}

/// Eliminates block `b` of columns, C of them, which owe something to those from `first` on.
#[inline(always)]
fn eliminate_block<A: Arithmetic, const C: usize, const P: usize>(
    s: &Supernode,
    (first, b): (usize, usize),
    panel: &[f64],
    columns: &mut [Row],
    minus: &mut [Row],
    inverse: &mut [f64],
    pivots: &mut Pivots,
) {
    let (column, own) = (WIDTH * b, start(s, b));
    let before = own + first..own + column;
    let mut block = Eliminated { column, before: before.clone(), triangle: [ZERO; C], inverses: ZERO, most: ZERO };

    let mut sum = load::<A, C, 1>(panel, s.side(), (column, column), C);
    add_outer::<A, C, 1>(&minus[before.clone()], 0, [&columns[before]], 0, &mut sum);
    let mut tile = [ZERO; C];
    for a in 0..C {
        A::store(sum[0][a], &mut tile[a]);
    }
    for j in 0..C {
        let owed = tile[j];
        let pivot = owed[j];
        pivots.negative += usize::from(pivot < 0.0);
        pivots.least = smaller(pivots.least, pivot.abs());
        let one_by = 1.0 / pivot;
        block.inverses[j] = one_by;
        inverse[column + j] = one_by;
        let mut eliminated = ZERO;
        for k in 0..WIDTH {
            eliminated[k] = if k > j { owed[k] * one_by } else { 0.0 };
            block.triangle[j][k] = -eliminated[k];
            block.most[k] = if eliminated[k].abs() > block.most[k] { eliminated[k].abs() } else { block.most[k] };
        }
        for a in j + 1..C {
            for k in 0..WIDTH {
                tile[a][k] = A::fma(-owed[a], eliminated[k], tile[a][k]);
            }
        }
    }
    let packed = columns[own + column..][..triangle_lines(C)].as_flattened_mut();
    for r in 1..C {
        for j in 0..r {
            packed[in_triangle(r, j)] = -block.triangle[j][r];
        }
    }

    in_groups!(P, s.side() / WIDTH - b - 1, g, N => {
        block.go_on::<A, N>(s, b + 1 + g, panel, columns, minus);
    });
    for k in 0..WIDTH {
        pivots.growth = if block.most[k] > pivots.growth { block.most[k] } else { pivots.growth };
    }
}

/// A block of C columns of which the triangle has been eliminated.
struct Eliminated<const C: usize> {
    /// Its first column.
    column: usize,
    /// Where its own rows of the columns that it owes something are.
    before: Range<usize>,
    /// The columns of the triangle, but for its diagonal, negative.
    triangle: [Row; C],
    /// D⁻¹.
    inverses: Row,
    /// The largest |L| so far.
    most: Row,
}

impl<const C: usize> Eliminated<C> {
    /// Eliminates the columns in N groups of rows from number `g` on.
    #[inline(always)]
    fn go_on<A: Arithmetic, const N: usize>(
        &mut self,
        s: &Supernode,
        g: usize,
        panel: &[f64],
        columns: &mut [Row],
        minus: &mut [Row],
    ) {
        let mut sum = load::<A, C, N>(panel, s.side(), (WIDTH * g, self.column), C);
        let (mut starts, mut rows) = ([0; N], [&columns[..0]; N]);
        for p in 0..N {
            starts[p] = start(s, g + p) + self.column;
            rows[p] = &columns[starts[p] - self.before.len()..starts[p]];
        }
        add_outer::<A, C, N>(&minus[self.before.clone()], 0, rows, 0, &mut sum);
        for j in 0..C {
            for a in j + 1..C {
                let entry = A::splat(self.triangle[j][a]);
                for sum in &mut sum {
                    sum[a] = A::multiply_add(entry, sum[j], sum[a]);
                }
            }
        }
        let (zero, minus_one) = (A::splat(0.0), A::splat(-1.0));
        for p in 0..N {
            let (columns, minus) = (&mut columns[starts[p]..][..C], &mut minus[starts[p]..][..C]);
            for a in 0..C {
                A::store(A::multiply_add(A::splat(self.inverses[a]), sum[p][a], zero), &mut columns[a]);
                A::store(A::multiply_add(minus_one, sum[p][a], zero), &mut minus[a]);
            }
            for column in columns {
                for (most, entry) in self.most.iter_mut().zip(column) {
                    *most = if entry.abs() > *most { entry.abs() } else { *most };
                }
            }
        }
    }
}

/// −L D Lᵀ of the rows below a supernode.
#[inline(always)]
pub(super) fn make_update<A: Arithmetic, const HIGH: usize, const P: usize>(
    s: &Supernode,
    columns: &[Row],
    minus: &[Row],
    update: &mut [f64],
) {
    let (width, side, blocks) = (s.width, s.update_side(), s.width.div_ceil(WIDTH));
    for first in (0..s.groups).step_by(TOGETHER) {
        in_groups!(P, s.groups - first, g, N => {
            let mut rows = [&columns[..0]; N];
            for p in 0..N {
                rows[p] = &columns[start(s, blocks + first + g + p)..][..width];
            }
            // Above the diagonal there may be anything.
            for h in first..(first + TOGETHER).min(first + g + N) {
                let of_block = &minus[start(s, blocks + h)..][..width];
                for high in (0..WIDTH).step_by(HIGH) {
                    let mut sum = [[A::splat(0.0); HIGH]; N];
                    add_outer::<A, HIGH, N>(of_block, high, rows, 0, &mut sum);
                    store::<A, HIGH, N>(&sum, update, side, (WIDTH * (first + g), WIDTH * h + high), HIGH);
                }
            }
        });
    }
}
