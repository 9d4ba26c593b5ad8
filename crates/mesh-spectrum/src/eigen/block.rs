//! Blocks of eight vectors, and the products that the block Lanczos method spends its time in.
//!
//! A block is n × 8, row-major: the eight vectors' values at one degree of freedom are one row of 64 bytes, a cache
//! line. So a sparse solve loads its indices and its matrix once for eight right-hand sides.
//!
//! Each product is written once, for any processor, and compiled three times (plain, AVX2 and AVX-512 with fused
//! multiply-add); which one runs is decided at run time in [`dispatch`]. Results are the same bytes on every run on
//! one kind of processor, and may differ in the last digits between kinds.

use std::ops::{Index, IndexMut};

use crate::operator::Csr;

/// Vectors in a block. A wider block solves faster per vector and converges slower; 8 and 4 tie, 16 loses.
pub(crate) const WIDTH: usize = 8;

/// The values of a block's vectors at one degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Row(pub(crate) [f64; WIDTH]);

/// n rows.
pub(crate) type Block = Vec<Row>;

/// An 8 × 8 matrix, row-major.
pub(crate) type Small = [[f64; WIDTH]; WIDTH];

pub(crate) const ZERO: Row = Row([0.0; WIDTH]);
pub(crate) const SMALL_ZERO: Small = [[0.0; WIDTH]; WIDTH];

impl Index<usize> for Row {
    type Output = f64;
    #[inline(always)]
    fn index(&self, column: usize) -> &f64 {
        &self.0[column]
    }
}

impl IndexMut<usize> for Row {
    #[inline(always)]
    fn index_mut(&mut self, column: usize) -> &mut f64 {
        &mut self.0[column]
    }
}

/// How a product and a sum are rounded, and how many rows of a small matrix fit in the processor's registers.
pub(crate) trait Arithmetic {
    /// a·b + c.
    fn fma(a: f64, b: f64, c: f64) -> f64;
}

/// Two roundings: any processor.
pub(crate) struct Plain;

/// One rounding: processors with a fused instruction.
pub(crate) struct Fused;

impl Arithmetic for Plain {
    #[inline(always)]
    fn fma(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
}

impl Arithmetic for Fused {
    #[inline(always)]
    fn fma(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
}

/// c += a·b for a row.
#[inline(always)]
pub(crate) fn add_scaled<A: Arithmetic>(c: &mut [f64; WIDTH], a: f64, b: &[f64; WIDTH]) {
    for k in 0..WIDTH {
        c[k] = A::fma(a, b[k], c[k]);
    }
}

/// Σᵢ qᵢᵀ wᵢ over rows: Qᵀ W. The shorter of the two decides how many rows there are.
#[inline(always)]
pub(crate) fn outer<A: Arithmetic>(q: &[Row], w: &[Row]) -> Small {
    let mut sum = SMALL_ZERO;
    for (q, w) in q.iter().zip(w) {
        for a in 0..WIDTH {
            add_scaled::<A>(&mut sum[a], q[a], &w.0);
        }
    }
    sum
}

/// Rows that are walked together, so that a panel of each block in use stays in the first-level cache (8 KiB each).
const PANEL: usize = 128;

/// Q_kᵀ W_i for every block k and every i, the latter running faster.
#[inline(always)]
pub(crate) fn gram_with<A: Arithmetic>(blocks: &[&[Row]], ws: &[&[Row]], out: &mut [Small]) {
    out.fill(SMALL_ZERO);
    let rows = ws.first().map_or(0, |w| w.len());
    for first in (0..rows).step_by(PANEL) {
        let panel = first..(first + PANEL).min(rows);
        for (block, out) in blocks.iter().zip(out.chunks_exact_mut(ws.len())) {
            for (w, out) in ws.iter().zip(out) {
                let part = outer::<A>(&block[panel.clone()], &w[panel.clone()]);
                for a in 0..WIDTH {
                    for k in 0..WIDTH {
                        out[a][k] += part[a][k];
                    }
                }
            }
        }
    }
}

/// W_i += Σ_k Q_k C_ki, the C as `gram_with` returns them.
#[inline(always)]
pub(crate) fn update_with<A: Arithmetic>(blocks: &[&[Row]], c: &[Small], ws: &mut [&mut [Row]]) {
    let rows = ws.first().map_or(0, |w| w.len());
    let each = ws.len();
    for first in (0..rows).step_by(PANEL) {
        let panel = first..(first + PANEL).min(rows);
        for (block, c) in blocks.iter().zip(c.chunks_exact(each)) {
            for (w, c) in ws.iter_mut().zip(c) {
                update_panel::<A>(&block[panel.clone()], c, &mut w[panel.clone()]);
            }
        }
    }
}

/// W += Q C.
#[inline(always)]
fn update_panel<A: Arithmetic>(q: &[Row], c: &Small, w: &mut [Row]) {
    let (tiles, rest) = w.as_chunks_mut::<8>();
    let (q_tiles, q_rest) = q.as_chunks::<8>();
    for (w, q) in tiles.iter_mut().zip(q_tiles) {
        let mut sum = w.map(|row| row.0);
        for a in 0..WIDTH {
            for r in 0..8 {
                add_scaled::<A>(&mut sum[r], q[r][a], &c[a]);
            }
        }
        *w = sum.map(Row);
    }
    for (w, q) in rest.iter_mut().zip(q_rest) {
        for a in 0..WIDTH {
            add_scaled::<A>(&mut w.0, q[a], &c[a]);
        }
    }
}

/// W = W C in place.
#[inline(always)]
pub(crate) fn scale_with<A: Arithmetic>(c: &Small, w: &mut [Row]) {
    let (tiles, rest) = w.as_chunks_mut::<8>();
    for w in tiles {
        let mut sum = SMALL_ZERO;
        for a in 0..WIDTH {
            for r in 0..8 {
                add_scaled::<A>(&mut sum[r], w[r][a], &c[a]);
            }
        }
        *w = sum.map(Row);
    }
    for w in rest {
        let mut sum = [0.0; WIDTH];
        for a in 0..WIDTH {
            add_scaled::<A>(&mut sum, w[a], &c[a]);
        }
        w.0 = sum;
    }
}

/// Y = a·A X + b·X + c·Y for a sparse symmetric A: the product itself, a residual, or a step of a Chebyshev recurrence.
#[inline(always)]
pub(crate) fn sparse_with<A: Arithmetic>(matrix: &Csr, x: &[Row], y: &mut [Row], [a, b, c]: [f64; 3]) {
    for (i, y) in y.iter_mut().enumerate().take(matrix.rows()) {
        let mut sum = [0.0; WIDTH];
        for (column, value) in matrix.row(i) {
            add_scaled::<A>(&mut sum, value, &x[column].0);
        }
        for k in 0..WIDTH {
            y[k] = a * sum[k] + b * x[i][k] + c * y[k];
        }
    }
}

/// Which instructions this processor has.
pub(crate) mod dispatch {
    use super::*;
    use crate::eigen::solve::{Packed, solve_with};

    /// Defines `fn name(args)`, which calls the generic `name_with` compiled for the best instructions at hand.
    macro_rules! dispatched {
        ($($(#[$doc:meta])* $name:ident = $generic:ident($($arg:ident: $type:ty),*);)*) => {$(
            $(#[$doc])*
            pub(crate) fn $name($($arg: $type),*) {
                #[cfg(target_arch = "x86_64")]
                {
                    #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
                    fn avx512($($arg: $type),*) {
                        $generic::<Fused>($($arg),*);
                    }
                    #[target_feature(enable = "avx2,fma")]
                    fn avx2($($arg: $type),*) {
                        $generic::<Fused>($($arg),*);
                    }
                    if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") && is_x86_feature_detected!("avx512vl")
                        && is_x86_feature_detected!("fma") && is_x86_feature_detected!("avx2")
                    {
                        // SAFETY: the function is ordinary safe code; calling it is unsafe only because it uses
                        // instructions that the line above has found on this processor.
                        return unsafe { avx512($($arg),*) };
                    }
                    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                        // SAFETY: as above.
                        return unsafe { avx2($($arg),*) };
                    }
                    $generic::<Plain>($($arg),*);
                }
                #[cfg(target_arch = "aarch64")]
                $generic::<Fused>($($arg),*);
                #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
                $generic::<Plain>($($arg),*);
            }
        )*};
    }

    dispatched! {
        /// Q_kᵀ W_i for every block k and every i, the latter running faster.
        gram = gram_with(blocks: &[&[Row]], ws: &[&[Row]], out: &mut [Small]);
        /// W_i += Σ_k Q_k C_ki, the C as `gram` returns them.
        update = update_with(blocks: &[&[Row]], c: &[Small], ws: &mut [&mut [Row]]);
        /// W = W C in place.
        scale = scale_with(c: &Small, w: &mut [Row]);
        /// Y = a·A X + b·X + c·Y for a sparse symmetric A.
        sparse = sparse_with(matrix: &Csr, x: &[Row], y: &mut [Row], abc: [f64; 3]);
        /// X = (L D Lᵀ)⁻¹ X; `x` has one row more than the matrix.
        solve = solve_with(factor: &Packed, x: &mut [Row]);
    }
}

/// Qᵀ W of two blocks.
pub(crate) fn gram_of(q: &[Row], w: &[Row]) -> Small {
    let mut out = [SMALL_ZERO];
    dispatch::gram(&[q], &[w], &mut out);
    out[0]
}

pub(crate) fn transpose(a: &Small) -> Small {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

pub(crate) fn negative(a: &Small) -> Small {
    a.map(|row| row.map(|x| -x))
}

/// A B.
pub(crate) fn product(a: &Small, b: &Small) -> Small {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..WIDTH).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Upper triangular R with Rᵀ R = G, and R⁻¹; `None` if a column is dependent on those before it to 13 digits.
pub(crate) fn cholesky(g: &Small) -> Option<(Small, Small)> {
    let mut r = SMALL_ZERO;
    for i in 0..WIDTH {
        for j in i..WIDTH {
            let rest = g[i][j] - (0..i).map(|k| r[k][i] * r[k][j]).sum::<f64>();
            if i < j {
                r[i][j] = rest / r[i][i];
            } else if rest > 1e-13 * g[i][i] && rest.is_normal() {
                r[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    let mut inverse = SMALL_ZERO;
    for j in 0..WIDTH {
        inverse[j][j] = 1.0 / r[j][j];
        for i in (0..j).rev() {
            inverse[i][j] = -(i + 1..=j).map(|k| r[i][k] * inverse[k][j]).sum::<f64>() / r[i][i];
        }
    }
    Some((r, inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(rows: usize, seed: usize) -> Block {
        let value = |i: usize, k: usize| ((i * 7919 + k * 104_729 + seed * 31) % 1009) as f64 / 1009.0 - 0.5;
        (0..rows).map(|i| Row(std::array::from_fn(|k| value(i, k)))).collect()
    }

    fn close(a: &[Row], b: &[Row], rows: usize) {
        for (a, b) in a.iter().zip(b) {
            for k in 0..WIDTH {
                // Sums of up to `rows` products below ¼, rounded once or twice each.
                assert!((a[k] - b[k]).abs() <= 1e-16 * rows as f64, "{} is not {}", a[k], b[k]);
            }
        }
    }

    #[test]
    fn every_compiled_kind_computes_the_same_but_for_rounding() {
        for rows in [1, 7, 8, 9, 127, 128, 129, 1000] {
            let (q, p, w) = (block(rows, 1), block(rows, 2), block(rows, 3));
            let blocks: [&[Row]; 2] = [&q, &p];
            let (mut plain, mut fast) = ([SMALL_ZERO; 4], [SMALL_ZERO; 4]);
            gram_with::<Plain>(&blocks, &[&w, &q], &mut plain);
            dispatch::gram(&blocks, &[&w, &q], &mut fast);
            close(plain.map(|c| c.map(Row)).as_flattened(), fast.map(|c| c.map(Row)).as_flattened(), rows);
            let direct: f64 = p.iter().zip(&w).map(|(p, w)| p[3] * w[5]).sum();
            assert!((plain[2][3][5] - direct).abs() <= 1e-16 * rows as f64);

            let (mut a, mut b) = ([w.clone(), p.clone()], [w.clone(), p.clone()]);
            let c: Vec<Small> = (0..4)
                .map(|k| block(WIDTH, k).iter().map(|row| row.0).collect::<Vec<_>>().try_into().unwrap())
                .collect();
            update_with::<Plain>(&blocks, &c, &mut a.each_mut().map(|a| &mut a[..]));
            dispatch::update(&blocks, &c, &mut b.each_mut().map(|b| &mut b[..]));
            close(&a[1], &b[1], 40);
            scale_with::<Plain>(&c[0], &mut a[0]);
            dispatch::scale(&c[0], &mut b[0]);
            close(&a[0], &b[0], 100);
        }
    }

    #[test]
    fn cholesky_gives_a_factor_and_its_inverse() {
        let w = block(100, 4);
        let g = gram_of(&w, &w);
        let (r, inverse) = cholesky(&g).unwrap();
        for (i, row) in product(&transpose(&r), &r).iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                assert!((entry - g[i][j]).abs() < 1e-14, "rounding of entries below 10");
                assert!((product(&r, &inverse)[i][j] - f64::from(i == j)).abs() < 1e-13);
            }
        }
        let mut twice = w;
        twice.iter_mut().for_each(|row| row[6] = 2.0 * row[1]);
        assert!(cholesky(&gram_of(&twice, &twice)).is_none(), "a dependent column");
    }
}
