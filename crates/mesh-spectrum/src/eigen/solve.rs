//! L D Lᵀ x = b for eight right-hand sides at once.
//!
//! The factor is repacked from the library's column-major supernodes into groups of eight rows: one `Row` holds eight
//! rows' entries of one column, so that every inner loop is "eight entries of L times a row of x" on whole cache
//! lines, and the index of a row is read once for eight right-hand sides.

use crate::eigen::block::{Arithmetic, Row, SMALL_ZERO, Small, WIDTH, ZERO, add_scaled, outer};

/// Columns `begin..begin + width` of L, which share the rows below them.
pub(crate) struct Supernode {
    pub(crate) begin: usize,
    pub(crate) width: usize,
    /// `width`, rounded up to a multiple of 4: columns a group of rows is stored with.
    pub(crate) stride: usize,
    /// Where its diagonal block starts in `values`: group g of eight rows takes 8 (g + 1) columns.
    pub(crate) diagonal: usize,
    /// Where the rows below start in `values`: `stride` columns a group.
    pub(crate) below: usize,
    /// Where its row numbers start in `rows`, and how many groups of eight there are.
    pub(crate) rows: usize,
    pub(crate) groups: usize,
}

/// L, unit lower triangular, and D⁻¹, packed for [`solve_with`].
pub(crate) struct Packed {
    pub(crate) supernodes: Vec<Supernode>,
    pub(crate) values: Vec<Row>,
    /// Row numbers in groups of eight; the last group of a supernode is filled up with n, a row of its own in x.
    pub(crate) rows: Vec<u32>,
    /// 1 / D.
    pub(crate) inverse: Vec<f64>,
}

impl Supernode {
    /// Group g of eight rows of the diagonal block: 8 (g + 1) columns, of which the last eight are triangular.
    #[inline(always)]
    fn diagonal_group<'a>(&self, values: &'a [Row], group: usize) -> (&'a [Row], &'a [Row]) {
        let start = self.diagonal + WIDTH * (group * (group + 1) / 2);
        values[start..start + WIDTH * (group + 1)].split_at(WIDTH * group)
    }
}

/// X = (L D Lᵀ)⁻¹ X in place. `x` has n + 1 rows, the last of them scratch.
#[inline(always)]
pub(crate) fn solve_with<A: Arithmetic>(factor: &Packed, x: &mut [Row]) {
    if let Some(scratch) = x.last_mut() {
        *scratch = ZERO;
    }
    for supernode in &factor.supernodes {
        forward::<A>(factor, supernode, x);
    }
    if let Some(scratch) = x.last_mut() {
        *scratch = ZERO;
    }
    for supernode in factor.supernodes.iter().rev() {
        backward::<A>(factor, supernode, x);
    }
}

/// L y = x for the columns of one supernode.
#[inline(always)]
fn forward<A: Arithmetic>(factor: &Packed, s: &Supernode, x: &mut [Row]) {
    let (head, tail) = x.split_at_mut(s.begin + s.width);
    let own = &mut head[s.begin..];
    for group in 0..s.width.div_ceil(WIDTH) {
        let (left, triangle) = s.diagonal_group(&factor.values, group);
        let known = outer::<A>(left, &own[..WIDTH * group]);
        let rows = (s.width - WIDTH * group).min(WIDTH);
        let own = &mut own[WIDTH * group..][..rows];
        for (own, known) in own.iter_mut().zip(&known) {
            for k in 0..WIDTH {
                own[k] -= known[k];
            }
        }
        for j in 0..rows {
            let (solved, rest) = own.split_at_mut(j + 1);
            for (r, own) in rest.iter_mut().enumerate() {
                add_scaled::<A>(&mut own.0, -triangle[j][j + 1 + r], &solved[j].0);
            }
        }
    }
    let first = s.begin + s.width;
    for group in 0..s.groups {
        let known = outer::<A>(&factor.values[s.below + group * s.stride..][..s.width], own);
        let rows = &factor.rows[s.rows + WIDTH * group..][..WIDTH];
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
fn backward<A: Arithmetic>(factor: &Packed, s: &Supernode, x: &mut [Row]) {
    for (row, inverse) in x[s.begin..s.begin + s.width].iter_mut().zip(&factor.inverse[s.begin..]) {
        for k in 0..WIDTH {
            row[k] *= inverse;
        }
    }
    for group in (0..s.width.div_ceil(WIDTH)).rev() {
        let known = if s.stride - WIDTH * group >= WIDTH {
            above::<A, 8>(factor, s, group, x)
        } else {
            above::<A, 4>(factor, s, group, x)
        };
        let (_, triangle) = s.diagonal_group(&factor.values, group);
        let columns = (s.width - WIDTH * group).min(WIDTH);
        let own = &mut x[s.begin + WIDTH * group..][..columns];
        for (own, known) in own.iter_mut().zip(&known) {
            for k in 0..WIDTH {
                own[k] -= known[k];
            }
        }
        for j in (0..columns).rev() {
            let (own, solved) = own.split_at_mut(j + 1);
            for (r, solved) in solved.iter().enumerate() {
                add_scaled::<A>(&mut own[j].0, -triangle[j][j + 1 + r], &solved.0);
            }
        }
    }
}

/// Lᵀ x over all rows below a group of columns, the first `COLUMNS` of the eight.
#[inline(always)]
fn above<A: Arithmetic, const COLUMNS: usize>(factor: &Packed, s: &Supernode, group: usize, x: &[Row]) -> Small {
    let mut sum = SMALL_ZERO;
    for g in 0..s.groups {
        let l = &factor.values[s.below + g * s.stride + WIDTH * group..][..COLUMNS];
        let rows = &factor.rows[s.rows + WIDTH * g..][..WIDTH];
        for r in 0..WIDTH {
            let x = &x[rows[r] as usize].0;
            for q in 0..COLUMNS {
                add_scaled::<A>(&mut sum[q], l[q][r], x);
            }
        }
    }
    for g in group + 1..s.width.div_ceil(WIDTH) {
        let (left, _) = s.diagonal_group(&factor.values, g);
        let l = &left[WIDTH * group..][..COLUMNS];
        let rows = (s.width - WIDTH * g).min(WIDTH);
        for (r, x) in x[s.begin + WIDTH * g..][..rows].iter().enumerate() {
            for q in 0..COLUMNS {
                add_scaled::<A>(&mut sum[q], l[q][r], &x.0);
            }
        }
    }
    sum
}
