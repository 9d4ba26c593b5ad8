//! What is added to vectors and is small is computed in single precision: twice as fast, and exact enough.

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Row, WIDTH};

/// A row of a block, and an 8 × 16 matrix for two blocks, in single precision.
pub(crate) type SingleRow = [f32; WIDTH];
pub(crate) type SingleSmall = [[f32; 2 * WIDTH]; WIDTH];

/// c += a·b for a row of two blocks.
#[inline(always)]
fn add_scaled_single<A: Arithmetic>(c: &mut [f32; 2 * WIDTH], a: f32, b: &[f32; 2 * WIDTH]) {
    for k in 0..2 * WIDTH {
        c[k] = A::fma_single(a, b[k], c[k]);
    }
}

/// P times R rows from `at` on of one or two blocks W += Σ_k Q_k C_k.
#[inline(always)]
fn correct_tile<A: Arithmetic, const R: usize, const P: usize>(
    q: &[&[SingleRow]],
    c: &[SingleSmall],
    w: &mut [&mut [Row]],
    at: usize,
) {
    let mut sum = [[[0.0; 2 * WIDTH]; R]; P];
    for (q, c) in q.iter().zip(c) {
        let q: [&[SingleRow]; P] = std::array::from_fn(|p| &q[at + p * R..at + (p + 1) * R]);
        for a in 0..WIDTH {
            for r in 0..R {
                for p in 0..P {
                    add_scaled_single::<A>(&mut sum[p][r], q[p][r][a], &c[a]);
                }
            }
        }
    }
    // Halves one by one, and not by a number, so that the sums stay in registers.
    let [first, second] = match w {
        [first] => [Some(first), None],
        [first, second, ..] => [Some(first), Some(second)],
        [] => [None, None],
    };
    add_half::<R, P, 0>(first, &sum, at);
    add_half::<R, P, WIDTH>(second, &sum, at);
}

/// Adds eight columns of the sums, from number OWN on, to rows of a block.
#[inline(always)]
fn add_half<const R: usize, const P: usize, const OWN: usize>(
    w: Option<&mut &mut [Row]>,
    sum: &[[[f32; 2 * WIDTH]; R]; P],
    at: usize,
) {
    let Some(w) = w else { return };
    for p in 0..P {
        let w = &mut w[at + p * R..at + (p + 1) * R];
        for r in 0..R {
            for k in 0..WIDTH {
                w[r][k] += f64::from(sum[p][r][OWN + k]);
            }
        }
    }
}

/// W_i += Σ_k Q_k C_k for one or two blocks W, in single precision: what is added is small.
#[inline(always)]
pub(crate) fn correct_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    q: &[&[SingleRow]],
    c: &[SingleSmall],
    w: &mut [&mut [Row]],
) {
    let rows = w.first().map_or(0, |w| w.len());
    // Two tiles at once, where there are registers for that many sums.
    let tall = if P > 1 { 2 * R } else { R };
    let whole = rows - rows % tall;
    for at in (0..whole).step_by(tall) {
        if P > 1 {
            correct_tile::<A, R, 2>(q, c, w, at);
        } else {
            correct_tile::<A, R, 1>(q, c, w, at);
        }
    }
    (whole..rows).for_each(|at| correct_tile::<A, 1, 1>(q, c, w, at));
}
