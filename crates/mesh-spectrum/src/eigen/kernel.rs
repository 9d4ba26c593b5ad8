//! What the solver spends its time in, each product written once and compiled three times.
//!
//! Which kind runs is decided at run time ([`Kind::best`]): AVX-512, AVX2 (both with fused multiply-add), or portable
//! code. The two fused kinds add in the same order and give the same bytes; the portable one rounds products too.

use crate::eigen::arithmetic::Arithmetic;
#[cfg(target_arch = "aarch64")]
use crate::eigen::arithmetic::Fused;
#[cfg(not(target_arch = "aarch64"))]
use crate::eigen::arithmetic::Plain;
#[cfg(target_arch = "x86_64")]
use crate::eigen::arithmetic::{Avx2, Avx512};
use crate::eigen::block::{Row, Small, WIDTH, ZERO};
use crate::eigen::factor::Pivots;
use crate::eigen::front::{Share, Tree, factor_with};
use crate::eigen::polish::{Levels, chebyshev_with};
use crate::eigen::products::{gram_with, recur_with, scale_with, update_with};
use crate::eigen::single::{SingleRow, SingleSmall, correct_with};
use crate::eigen::solve::{Layout, Packed, solve_with};
use crate::eigen::tridiagonal::{Reflected, Rotations, reflect_with, turn_with};
use crate::operator::Csr;

/// What the processor can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// AVX-512 F, DQ and VL.
    Avx512,
    /// AVX2 and FMA.
    Avx2,
    /// Any processor.
    Portable,
}

impl Kind {
    /// The fastest that this processor has.
    pub(crate) fn best() -> Kind {
        [Kind::Avx512, Kind::Avx2].into_iter().find(|kind| kind.is_available()).unwrap_or(Kind::Portable)
    }

    /// Whether this processor has it.
    #[cfg(target_arch = "x86_64")]
    pub(crate) fn is_available(self) -> bool {
        let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        match self {
            Kind::Portable => true,
            Kind::Avx2 => avx2,
            Kind::Avx512 => {
                avx2 && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// Whether this processor has it.
    #[cfg(not(target_arch = "x86_64"))]
    pub(crate) fn is_available(self) -> bool {
        self == Kind::Portable
    }
}

/// c += a·b for a row.
#[inline(always)]
pub(crate) fn add_scaled<A: Arithmetic>(c: &mut Row, a: f64, b: &Row) {
    for k in 0..WIDTH {
        c[k] = A::fma(a, b[k], c[k]);
    }
}

/// Asks for a row that will be read soon. A hint: the row need not exist.
#[inline(always)]
pub(crate) fn prefetch(rows: &[Row], row: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch neither faults nor changes what a program computes, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(rows.as_ptr().wrapping_add(row).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (rows, row);
}

/// Y = A X for a sparse A.
#[inline(always)]
fn sparse_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    matrix: &Csr,
    x: &[Row],
    y: &mut [Row],
) {
    for (i, y) in y.iter_mut().enumerate().take(matrix.rows()) {
        *y = sparse_row::<A>(matrix, i, x);
    }
}

/// A row of A X.
#[inline(always)]
pub(crate) fn sparse_row<A: Arithmetic>(matrix: &Csr, i: usize, x: &[Row]) -> Row {
    let mut sum = ZERO;
    for (column, value) in matrix.row(i) {
        add_scaled::<A>(&mut sum, value, &x[column]);
    }
    sum
}

/// `squares[k]` = ‖A x_k − λ_k x_k‖² for the eight columns of X.
#[inline(always)]
fn residual_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    matrix: &Csr,
    x: &[Row],
    eigenvalues: &Row,
    squares: &mut Row,
) {
    *squares = ZERO;
    (0..matrix.rows()).for_each(|i| add_residual::<A>(matrix, i, x, eigenvalues, squares));
}

/// What row i of the matrix adds to ‖A x_k − λ_k x_k‖².
#[inline(always)]
pub(crate) fn add_residual<A: Arithmetic>(matrix: &Csr, i: usize, x: &[Row], eigenvalues: &Row, squares: &mut Row) {
    let mut sum = ZERO;
    for k in 0..WIDTH {
        sum[k] = -eigenvalues[k] * x[i][k];
    }
    for (column, value) in matrix.row(i) {
        add_scaled::<A>(&mut sum, value, &x[column]);
    }
    for k in 0..WIDTH {
        squares[k] = A::fma(sum[k], sum[k], squares[k]);
    }
}

/// Defines `fn name(kind, args)`, which calls the generic `name_with` compiled for that kind.
macro_rules! dispatched {
    ($($(#[$doc:meta])* $name:ident = $generic:ident($($arg:ident: $type:ty),*);)*) => {$(
        $(#[$doc])*
        pub(crate) fn $name(kind: Kind, $($arg: $type),*) {
            // Tiles: AVX-512 has 32 registers of 8 numbers, AVX2 16 of 4, the portable kind is given 16 of 2.
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
                fn avx512($($arg: $type),*) {
                    $generic::<Avx512, 8, 8, { crate::eigen::products::AT_ONCE }>($($arg),*);
                }
                #[target_feature(enable = "avx2,fma")]
                fn avx2($($arg: $type),*) {
                    $generic::<Avx2, 4, 4, 1>($($arg),*);
                }
                match kind {
                    // SAFETY: the functions are ordinary safe code; calling them is unsafe only because they use
                    // instructions that the line before has found on this processor.
                    Kind::Avx512 if kind.is_available() => return unsafe { avx512($($arg),*) },
                    // SAFETY: as above.
                    Kind::Avx2 if kind.is_available() => return unsafe { avx2($($arg),*) },
                    _ => {}
                }
            }
            let _ = kind;
            #[cfg(target_arch = "aarch64")]
            $generic::<Fused, 4, 4, 1>($($arg),*);
            #[cfg(not(target_arch = "aarch64"))]
            $generic::<Plain, 2, 2, 1>($($arg),*);
        }
    )*};
}

dispatched! {
    /// out[i·blocks + k] += Q_kᵀ W_i; the first block decides how many rows there are.
    gram = gram_with(blocks: &[&[Row]], ws: &[&[Row]], out: &mut [Small]);
    /// W_i (+)= Σ_k Q_k C_ki with C_ki = c[i·blocks + k], the layout of `gram`.
    update = update_with(blocks: &[&[Row]], c: &[Small], ws: &mut [&mut [Row]], add: bool);
    /// W_i += Σ_k Q_k C_k for one or two blocks W, in single precision: what is added is small.
    correct = correct_with(q: &[&[SingleRow]], c: &[SingleSmall], w: &mut [&mut [Row]]);
    /// W += Σ_k Q_k C_k, then out_i = P_iᵀ W and, after them, Wᵀ W and, unless V is empty, P_iᵀ V, in one pass.
    recur = recur_with(q: &[&[Row]], c: &[Small], w: &mut [Row], p: &[&[Row]], v: &[Row], out: &mut [Small]);
    /// W = (W + Σ_k Q_k C_k) S, a copy of it unless that is empty, and its Wᵀ W, in one pass.
    scale = scale_with(
        q: &[&[Row]], c: &[Small], s: &Small, w: &mut [Row], copy: &mut [Row], square: &mut Small
    );
    /// Y = A X for a sparse A.
    sparse = sparse_with(matrix: &Csr, x: &[Row], y: &mut [Row]);
    /// A Chebyshev polynomial of A, and the residuals of what it makes.
    chebyshev = chebyshev_with(
        levels: &Levels, degree: usize, line: [f64; 2], buffers: [&mut [Row]; 2], eigenvalues: &Row, squares: &mut Row
    );
    /// `squares[k]` = ‖A x_k − λ_k x_k‖² for the eight columns of X.
    residual = residual_with(matrix: &Csr, x: &[Row], eigenvalues: &Row, squares: &mut Row);
    /// L D Lᵀ = A − σI, some supernodes of it.
    factor = factor_with(
        tree: &Tree, layout: &Layout, matrix: &Csr, shift: f64, share: Share, pivots: &mut Pivots
    );
    /// Reduces a symmetric matrix to tridiagonal form.
    reflect = reflect_with(of: &mut Reflected);
    /// Panels of eight rows of the identity become rows of eigenvectors.
    turn = turn_with(reflected: &Reflected, rotations: &Rotations, panels: &mut [Row]);
    /// X = (L D Lᵀ)⁻¹ X; `x` has one row more than the matrix.
    solve = solve_with(factor: &Packed, x: &mut [Row]);
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::eigen::block::SMALL_ZERO;

    pub(crate) fn block(rows: usize, seed: usize) -> Vec<Row> {
        let value = |i: usize, k: usize| ((i * 7919 + k * 104_729 + seed * 31) % 1009) as f64 / 1009.0 - 0.5;
        (0..rows).map(|i| std::array::from_fn(|k| value(i, k))).collect()
    }

    fn smalls(count: usize, seed: usize) -> Vec<Small> {
        block(WIDTH * count, seed).chunks(WIDTH).map(|rows| std::array::from_fn(|a| rows[a])).collect()
    }

    /// Everything that every product computes from the same blocks.
    fn all(kind: Kind, rows: usize) -> Vec<Row> {
        let (q, p, w, v) = (block(rows, 1), block(rows, 2), block(rows, 3), block(rows, 5));
        let blocks: [&[Row]; 2] = [&q, &p];
        let mut seen = Vec::new();
        let mut c = vec![SMALL_ZERO; 6];
        gram(kind, &blocks, &[&w, &q, &v], &mut c);
        let direct: f64 = p.iter().zip(&w).map(|(p, w)| p[3] * w[5]).sum();
        assert!((c[1][3][5] - direct).abs() <= 1e-16 * rows as f64, "rounding of sums of products below ¼");
        seen.extend(c.concat());
        let mut ws = [w.clone(), p.clone(), v.clone()];
        update(kind, &blocks, &smalls(6, 1), &mut ws.each_mut().map(|w| &mut w[..]), true);
        let direct: f64 = (0..WIDTH).map(|a| q[0][a] * smalls(6, 1)[2][a][4] + p[0][a] * smalls(6, 1)[3][a][4]).sum();
        assert!((ws[1][0][4] - p[0][4] - direct).abs() <= 1e-15);
        seen.extend(ws.concat());
        update(kind, &blocks, &smalls(6, 1), &mut ws.each_mut().map(|w| &mut w[..]), false);
        seen.extend(ws.concat());
        let (mut w, mut out) = (w, [SMALL_ZERO; 4]);
        recur(kind, &blocks, &smalls(2, 2), &mut w, &[&p, &v, &q], &[], &mut out);
        let direct: f64 = v.iter().zip(&w).map(|(v, w)| v[2] * w[6]).sum();
        assert!((out[1][2][6] - direct).abs() <= 1e-15 * rows as f64, "rounding of sums of products below 1");
        let direct: f64 = w.iter().map(|w| w[3] * w[7]).sum();
        assert!((out[3][3][7] - direct).abs() <= 1e-15 * rows as f64 * (1.0 + direct.abs()), "the same of more terms");
        seen.extend(out.concat());
        recur(kind, &[], &[], &mut w, &[], &[], &mut out[..1]);
        seen.extend(out[0]);
        let (s, c, before, mut copy) = (smalls(1, 3)[0], smalls(2, 7), w.clone(), vec![ZERO; rows]);
        let mut square = SMALL_ZERO;
        scale(kind, &blocks, &c, &s, &mut w, &mut copy, &mut square);
        let direct: f64 = w.iter().map(|w| w[2] * w[4]).sum();
        assert!(
            (square[2][4] - direct).abs() <= 1e-15 * rows as f64 * (1.0 + direct.abs()),
            "the same in another order"
        );
        let taken = |k: usize| (0..WIDTH).map(|a| q[0][a] * c[0][a][k] + p[0][a] * c[1][a][k]).sum::<f64>();
        let direct: f64 = (0..WIDTH).map(|k| (before[0][k] + taken(k)) * s[k][1]).sum();
        assert!((w[0][1] - direct).abs() <= 1e-14, "rounding of products of numbers of about 1");
        assert_eq!(w, copy);
        scale(kind, &[], &[], &s, &mut w, &mut [], &mut square);
        seen.extend(w.iter().copied());
        let single = |block: &[Row]| -> Vec<SingleRow> { block.iter().map(|row| row.map(|x| x as f32)).collect() };
        let (q, p) = (single(&q), single(&p));
        let c = [1, 2].map(|seed| -> SingleSmall {
            let [left, right] = [smalls(1, seed)[0], smalls(1, seed + 2)[0]];
            std::array::from_fn(|a| {
                std::array::from_fn(|k| if k < WIDTH { left[a][k] } else { right[a][k - WIDTH] } as f32)
            })
        });
        let (before, mut second) = (w.clone(), v.clone());
        correct(kind, &[&q, &p], &c, &mut [&mut w, &mut second]);
        let direct: f32 = (0..WIDTH).map(|a| q[0][a] * c[0][a][10] + p[0][a] * c[1][a][10]).sum();
        assert!((second[0][2] - v[0][2] - f64::from(direct)).abs() <= 1e-6, "single precision of numbers of about 1");
        let direct: f32 = (0..WIDTH).map(|a| q[0][a] * c[0][a][2] + p[0][a] * c[1][a][2]).sum();
        assert!((w[0][2] - before[0][2] - f64::from(direct)).abs() <= 1e-6, "single precision of numbers of about 1");
        seen.extend(second.iter().map(|row| row.map(|x| 1e-8 * x))); // beside rounding of double precision
        seen.extend(w.iter().map(|row| row.map(|x| 1e-8 * x)));
        seen.extend(square);
        seen
    }

    #[test]
    fn every_kind_computes_the_same_but_for_rounding() {
        for rows in [1, 7, 8, 9, 127, 128, 129, 1000] {
            let portable = all(Kind::Portable, rows);
            for kind in [Kind::Avx2, Kind::Avx512].into_iter().filter(|kind| kind.is_available()) {
                let fused = all(kind, rows);
                assert_eq!(fused, all(Kind::best(), rows), "the fused kinds add in the same order");
                for (a, b) in portable.as_flattened().iter().zip(fused.as_flattened()) {
                    // Sums of up to 1 000 products of numbers of about 1, rounded once or twice each.
                    assert!((a - b).abs() <= 1e-15 * rows as f64 * (1.0 + a.abs()), "{a} is not {b}");
                }
            }
        }
    }
}
