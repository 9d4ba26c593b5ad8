//! L D Lᵀ x = b for eight right-hand sides at once.
//!
//! The factor is stored in groups of eight rows of a supernode: one `Row` holds eight rows' entries of one column, so
//! that every inner loop is "eight entries of L times a row of x" on whole cache lines, and the index of a row is read
//! once for eight right-hand sides.

use std::sync::Arc;

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Block, Row, SMALL_ZERO, Small, WIDTH, ZERO};
use crate::eigen::kernel::{add_scaled, prefetch};

/// Columns `begin..begin + width` of L, which share the rows below them.
pub(crate) struct Supernode {
    pub(crate) begin: usize,
    pub(crate) width: usize,
    /// Where its diagonal block starts in `values`: group g of eight rows takes 8 g columns and a triangle.
    pub(crate) diagonal: usize,
    /// Where the rows below start in `values`: `width` columns a group.
    pub(crate) below: usize,
    /// Where its row numbers start in `rows`, and how many groups of eight there are.
    pub(crate) rows: usize,
    pub(crate) groups: usize,
}

/// Where the entries of L are, the same for every factor of one pattern.
pub(crate) struct Layout {
    pub(crate) supernodes: Vec<Supernode>,
    /// Row numbers in groups of eight; the last group of a supernode is filled up with n, a row of its own in x.
    pub(crate) rows: Vec<u32>,
    /// Rows of 64 bytes, and eight at the end that the second sweep may read along with the last columns.
    pub(crate) len: usize,
}

/// L, unit lower triangular, and D⁻¹, packed for [`solve_with`].
pub(crate) struct Packed {
    pub(crate) layout: Arc<Layout>,
    pub(crate) values: Block,
    /// 1 / D.
    pub(crate) inverse: Vec<f64>,
}

impl Supernode {
    /// Where group g of eight rows of the diagonal block starts in `values`.
    #[inline(always)]
    pub(crate) fn diagonal_start(&self, group: usize) -> usize {
        self.diagonal + WIDTH * (group * group.saturating_sub(1) / 2) + group * triangle_lines(WIDTH)
    }
}

/// Rows of 64 bytes that a strict lower triangle of so many rows is packed into, row after row.
pub(crate) const fn triangle_lines(rows: usize) -> usize {
    in_triangle(rows, 0).div_ceil(WIDTH)
}

/// Where row r's entry of column j < r is in a triangle.
#[inline(always)]
pub(crate) const fn in_triangle(r: usize, j: usize) -> usize {
    r * r.saturating_sub(1) / 2 + j
}

/// X = (L D Lᵀ)⁻¹ X in place. `x` has n + 1 rows, the last of them scratch.
#[inline(always)]
pub(crate) fn solve_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    factor: &Packed,
    x: &mut [Row],
) {
    if let Some(scratch) = x.last_mut() {
        *scratch = ZERO;
    }
    for supernode in &factor.layout.supernodes {
        match supernode.width {
            1 => forward_narrow::<A, 1>(factor, supernode, x),
            2 => forward_narrow::<A, 2>(factor, supernode, x),
            _ => forward::<A, HIGH>(factor, supernode, x),
        }
    }
    if let Some(scratch) = x.last_mut() {
        *scratch = ZERO;
    }
    let mut asked = Asked { values: factor.layout.len, until: factor.layout.len, rows: factor.layout.rows.len() };
    for supernode in factor.layout.supernodes.iter().rev() {
        asked.go_on(factor, supernode, x);
        match supernode.width {
            1 => backward_narrow::<A, 1>(factor, supernode, x, &mut asked),
            2 => backward_narrow::<A, 2>(factor, supernode, x, &mut asked),
            _ => backward::<A, HIGH>(factor, supernode, x, &mut asked),
        }
    }
}

/// How far ahead of its use the factor is asked for, in rows of 64 bytes.
const AHEAD: usize = 128;

/// How far ahead of their use rows of x are asked for, in row numbers.
const ROWS_AHEAD: usize = 48;

/// Σ_j l_j xⱼᵀ over the columns of a group of eight rows of L, HIGH rows at once.
#[inline(always)]
fn group<A: Arithmetic, const HIGH: usize>(values: &[Row], first: usize, x: &[Row]) -> Small {
    let mut out = SMALL_ZERO;
    let l = &values[first..first + x.len()];
    for high in (0..WIDTH).step_by(HIGH) {
        let mut sum = [ZERO; HIGH];
        for (j, (l, x)) in l.iter().zip(x).enumerate() {
            if high == 0 {
                prefetch(values, first + j + AHEAD);
            }
            for r in 0..HIGH {
                add_scaled::<A>(&mut sum[r], l[high + r], x);
            }
        }
        out[high..high + HIGH].copy_from_slice(&sum);
    }
    out
}

/// Calls a function for a triangle of so many rows, at most eight: a number that the compiler knows, so that all of them
/// stay in registers.
macro_rules! for_length {
    ($length:expr, $name:ident::<$a:ident $(, $more:ident)*>($($arg:expr),*)) => {
        match $length {
            1 => $name::<$a, 1 $(, $more)*>($($arg),*),
            2 => $name::<$a, 2 $(, $more)*>($($arg),*),
            3 => $name::<$a, 3 $(, $more)*>($($arg),*),
            4 => $name::<$a, 4 $(, $more)*>($($arg),*),
            5 => $name::<$a, 5 $(, $more)*>($($arg),*),
            6 => $name::<$a, 6 $(, $more)*>($($arg),*),
            7 => $name::<$a, 7 $(, $more)*>($($arg),*),
            _ => $name::<$a, 8 $(, $more)*>($($arg),*),
        }
    };
}
pub(crate) use for_length;

/// x ← T⁻¹ (x − known), T a packed unit lower triangle.
#[inline(always)]
fn below_diagonal<A: Arithmetic, const N: usize>(triangle: &[Row], known: &Small, own: &mut [Row]) {
    let triangle = &triangle[..triangle_lines(N)].as_flattened();
    let mut x: [Row; N] = std::array::from_fn(|r| std::array::from_fn(|k| own[r][k] - known[r][k]));
    for j in 0..N {
        let solved = x[j];
        for r in 0..N {
            if r > j {
                add_scaled::<A>(&mut x[r], -triangle[in_triangle(r, j)], &solved);
            }
        }
    }
    own.copy_from_slice(&x);
}

/// x ← T⁻ᵀ (x − known).
#[inline(always)]
fn above_diagonal<A: Arithmetic, const N: usize>(triangle: &[Row], known: &Small, own: &mut [Row]) {
    let triangle = &triangle[..triangle_lines(N)].as_flattened();
    let mut x: [Row; N] = std::array::from_fn(|r| std::array::from_fn(|k| own[r][k] - known[r][k]));
    for r in (0..N).rev() {
        let solved = x[r];
        for j in 0..N {
            if j < r {
                add_scaled::<A>(&mut x[j], -triangle[in_triangle(r, j)], &solved);
            }
        }
    }
    own.copy_from_slice(&x);
}

/// L y = x for the columns of one supernode.
#[inline(always)]
fn forward<A: Arithmetic, const HIGH: usize>(factor: &Packed, s: &Supernode, x: &mut [Row]) {
    let (head, tail) = x.split_at_mut(s.begin + s.width);
    let own = &mut head[s.begin..];
    for g in 0..s.width.div_ceil(WIDTH) {
        let start = s.diagonal_start(g);
        let known = group::<A, HIGH>(&factor.values, start, &own[..WIDTH * g]);
        let rows = (s.width - WIDTH * g).min(WIDTH);
        let triangle = &factor.values[start + WIDTH * g..];
        let own = &mut own[WIDTH * g..][..rows];
        for_length!(rows, below_diagonal::<A>(triangle, &known, own));
    }
    let first = s.begin + s.width;
    for g in 0..s.groups {
        let rows = &factor.layout.rows[s.rows + WIDTH * g..][..WIDTH];
        prefetch_forward(factor, s.rows + WIDTH * g, tail, first);
        let known = group::<A, HIGH>(&factor.values, s.below + g * s.width, own);
        for r in 0..WIDTH {
            let row = &mut tail[rows[r] as usize - first];
            for k in 0..WIDTH {
                row[k] -= known[r][k];
            }
        }
    }
}

/// Lᵀ y = D⁻¹ x for the columns of one supernode.
#[inline(always)]
fn backward<A: Arithmetic, const HIGH: usize>(factor: &Packed, s: &Supernode, x: &mut [Row], asked: &mut Asked) {
    for (row, inverse) in x[s.begin..s.begin + s.width].iter_mut().zip(&factor.inverse[s.begin..]) {
        row.iter_mut().for_each(|x| *x *= inverse);
    }
    for g in (0..s.width.div_ceil(WIDTH)).rev() {
        let columns = (s.width - WIDTH * g).min(WIDTH);
        let mut known = SMALL_ZERO;
        if HIGH == WIDTH && columns > WIDTH / 2 {
            known = above::<A, 8>(factor, s, g, 0, x, asked);
        } else {
            for high in (0..columns).step_by(4) {
                known[high..high + 4].copy_from_slice(&above::<A, 4>(factor, s, g, high, x, asked)[..4]);
            }
        }
        let triangle = &factor.values[s.diagonal_start(g) + WIDTH * g..];
        let own = &mut x[s.begin + WIDTH * g..][..columns];
        for_length!(columns, above_diagonal::<A>(triangle, &known, own));
    }
}

/// Lᵀ x over all rows below a group of columns: `COLUMNS` of them, from number `high` of the group. Where the supernode
/// has fewer, what follows them is read in their place, and nobody uses those sums.
#[inline(always)]
fn above<A: Arithmetic, const COLUMNS: usize>(
    factor: &Packed,
    s: &Supernode,
    group: usize,
    high: usize,
    x: &[Row],
    asked: &mut Asked,
) -> [Row; COLUMNS] {
    let mut sum = [ZERO; COLUMNS];
    let column = WIDTH * group + high;
    for g in 0..s.groups {
        let start = s.below + g * s.width + column;
        let l = &factor.values[start..start + COLUMNS];
        let rows = &factor.layout.rows[s.rows + WIDTH * g..][..WIDTH];
        let later = &factor.layout.rows[s.rows + WIDTH * (g + 4).min(s.groups - 1)..][..WIDTH];
        for r in 0..WIDTH {
            if r < COLUMNS {
                prefetch(&factor.values, start + 4 * s.width + r);
            }
            prefetch(x, later[r] as usize);
            let x = &x[rows[r] as usize];
            for q in 0..COLUMNS {
                add_scaled::<A>(&mut sum[q], l[q][r], x);
            }
        }
        asked.some(factor, COLUMNS);
    }
    asked.some(factor, 2 * COLUMNS); // as many again for the diagonal block
    for g in group + 1..s.width.div_ceil(WIDTH) {
        let l = &factor.values[s.diagonal_start(g) + column..][..COLUMNS];
        let rows = (s.width - WIDTH * g).min(WIDTH);
        for (r, x) in x[s.begin + WIDTH * g..][..rows].iter().enumerate() {
            for q in 0..COLUMNS {
                add_scaled::<A>(&mut sum[q], l[q][r], x);
            }
        }
    }
    sum
}

/// Asks for the rows that the first sweep comes to soon after the group whose row numbers start at `at`.
#[inline(always)]
fn prefetch_forward(factor: &Packed, at: usize, tail: &[Row], first: usize) {
    for &row in factor.layout.rows.iter().skip(at + ROWS_AHEAD).take(WIDTH) {
        prefetch(tail, row as usize - first); // a later supernode's rows are later rows
    }
}

/// Down to where the second sweep has asked for what it will read.
struct Asked {
    values: usize,
    /// How far down it may ask by now.
    until: usize,
    rows: usize,
}

impl Asked {
    /// Asks for rows of x that come soon after a supernode, and allows to ask for its values.
    #[inline(always)]
    fn go_on(&mut self, factor: &Packed, s: &Supernode, x: &[Row]) {
        self.values = self.values.min(s.diagonal);
        self.until = s.diagonal.saturating_sub(AHEAD);
        let until = s.rows.saturating_sub(ROWS_AHEAD);
        let rows = &factor.layout.rows[until..self.rows.min(s.rows).max(until)];
        rows.iter().rev().for_each(|&row| prefetch(x, row as usize));
        self.rows = until;
    }

    /// Asks for some of the values, so that products with others go on meanwhile.
    #[inline(always)]
    fn some(&mut self, factor: &Packed, lines: usize) {
        let until = self.values.saturating_sub(lines).max(self.until).min(self.values);
        (until..self.values).for_each(|line| prefetch(&factor.values, line));
        self.values = until;
    }
}

/// [`forward`] for a supernode of one or two columns: leaves of the elimination tree, of which there are many.
#[inline(always)]
fn forward_narrow<A: Arithmetic, const W: usize>(factor: &Packed, s: &Supernode, x: &mut [Row]) {
    let first = s.begin + W;
    let (head, tail) = x.split_at_mut(first);
    let own: &mut [Row; W] = (&mut head[s.begin..]).try_into().unwrap_or_else(|_| unreachable!("W rows"));
    if W == 2 {
        let solved = own[0];
        add_scaled::<A>(&mut own[1], -factor.values[s.diagonal][0], &solved);
    }
    let minus = own.map(|row| row.map(|x| -x));
    for g in 0..s.groups {
        let start = s.below + g * W;
        prefetch(&factor.values, start + AHEAD);
        prefetch_forward(factor, s.rows + WIDTH * g, tail, first);
        let l = &factor.values[start..][..W];
        let rows = &factor.layout.rows[s.rows + WIDTH * g..][..WIDTH];
        for r in 0..WIDTH {
            let row = &mut tail[rows[r] as usize - first];
            for j in 0..W {
                add_scaled::<A>(row, l[j][r], &minus[j]);
            }
        }
    }
}

/// [`backward`] for a supernode of one or two columns.
#[inline(always)]
fn backward_narrow<A: Arithmetic, const W: usize>(factor: &Packed, s: &Supernode, x: &mut [Row], asked: &mut Asked) {
    asked.some(factor, W);
    // Several sums, because each addition waits for the one before it.
    let mut sums = [[ZERO; 4]; W];
    for g in 0..s.groups {
        asked.some(factor, W);
        let l = &factor.values[s.below + g * W..][..W];
        let rows = &factor.layout.rows[s.rows + WIDTH * g..][..WIDTH];
        for r in 0..WIDTH {
            let row = x[rows[r] as usize];
            for j in 0..W {
                add_scaled::<A>(&mut sums[j][r % 4], l[j][r], &row);
            }
        }
    }
    for j in (0..W).rev() {
        let mut own = x[s.begin + j];
        let inverse = factor.inverse[s.begin + j];
        for k in 0..WIDTH {
            own[k] = own[k] * inverse - ((sums[j][0][k] + sums[j][1][k]) + (sums[j][2][k] + sums[j][3][k]));
        }
        if W == 2 && j == 0 {
            add_scaled::<A>(&mut own, -factor.values[s.diagonal][0], &x[s.begin + 1]);
        }
        x[s.begin + j] = own;
    }
}
