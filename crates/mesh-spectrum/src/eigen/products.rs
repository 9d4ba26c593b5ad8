//! Products of tall blocks: Qᵀ W, W + Q C, and what a step of a Krylov space does of both.
//!
//! Tall blocks do not fit in any cache, so every product reads each of them once, panel by panel, for as many columns
//! as the registers hold; the lines that come next are asked for ahead of time.
//!
//! Lanes are only touched in plain loops: a closure that is not inlined is not compiled for the instructions of the
//! function that it is written in, and every operation becomes a call.

use std::ops::Range;

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH, ZERO, add, transpose};
use crate::eigen::kernel::prefetch;

/// Rows that are walked together, so that a panel of each block in use stays in the caches (16 KiB each).
pub(crate) const PANEL: usize = 256;

/// How far ahead of its use a block's row is asked for.
const AHEAD: usize = 64;

/// Blocks that a product takes at once, where there are registers for that many sums.
pub(crate) const AT_ONCE: usize = 3;

/// How many of so many blocks to take at once: P at most, and none alone that need not be. P is 1 or `AT_ONCE`.
#[inline(always)]
pub(crate) const fn at_once<const P: usize>(left: usize) -> usize {
    match left {
        _ if P == 1 => 1,
        1 => 1,
        2 | 4 => 2,
        _ => AT_ONCE,
    }
}

/// Goes through so many blocks, up to P at once: `$body` for the blocks from number `$first` on, N of them.
macro_rules! in_groups {
    ($p:ident, $count:expr, $first:ident, $n:ident => $body:block) => {
        let mut $first = 0;
        while $first < $count {
            let taken = $crate::eigen::products::at_once::<$p>($count - $first);
            match taken {
                $crate::eigen::products::AT_ONCE => {
                    const $n: usize = $crate::eigen::products::AT_ONCE;
                    $body
                }
                2 => {
                    const $n: usize = 2;
                    $body
                }
                _ => {
                    const $n: usize = 1;
                    $body
                }
            }
            $first += taken;
        }
    };
}
pub(crate) use in_groups;

/// Σ_p += Q_Cᵀ W_p for P blocks, Q_C being the C columns of Q from number `high` on: an entry of Q, once read, serves all
/// blocks. Rows of Q are asked for so many `ahead`, or not if that is 0.
#[inline(always)]
pub(crate) fn add_outer<A: Arithmetic, const C: usize, const P: usize>(
    q: &[Row],
    high: usize,
    w: [&[Row]; P],
    ahead: usize,
    sum: &mut [[A::Lanes; C]; P],
) {
    let rows = q.len();
    let mut of_block = [&q[..0]; P];
    for p in 0..P {
        of_block[p] = &w[p][..rows];
    }
    let mut of_row = [A::splat(0.0); P];
    for i in 0..rows {
        if ahead > 0 {
            prefetch(q, i + ahead);
        }
        for p in 0..P {
            of_row[p] = A::load(&of_block[p][i]);
        }
        for a in 0..C {
            let entry = A::splat(q[i][high + a]);
            for p in 0..P {
                sum[p][a] = A::multiply_add(entry, of_row[p], sum[p][a]);
            }
        }
    }
}

/// out_p += Qᵀ W_p for P blocks, HIGH columns of Q at once.
#[inline(always)]
pub(crate) fn outer<A: Arithmetic, const HIGH: usize, const P: usize>(
    q: &[Row],
    w: [&[Row]; P],
    ahead: usize,
    out: &mut [Small; P],
) {
    for high in (0..WIDTH).step_by(HIGH) {
        let mut sum = [[A::splat(0.0); HIGH]; P];
        for p in 0..P {
            for a in 0..HIGH {
                sum[p][a] = A::load(&out[p][high + a]);
            }
        }
        add_outer::<A, HIGH, P>(q, high, w, if high == 0 { ahead } else { 0 }, &mut sum);
        for p in 0..P {
            for a in 0..HIGH {
                A::store(sum[p][a], &mut out[p][high + a]);
            }
        }
    }
}

/// out[i·blocks + k] += Q_kᵀ W_i; the first block decides how many rows there are.
#[inline(always)]
pub(crate) fn gram_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    blocks: &[&[Row]],
    ws: &[&[Row]],
    out: &mut [Small],
) {
    let rows = blocks.first().map_or(0, |block| block.len());
    for first in (0..rows).step_by(PANEL) {
        let panel = first..(first + PANEL).min(rows);
        in_groups!(P, ws.len(), i, N => {
            let w: [&[Row]; N] = std::array::from_fn(|p| &ws[i + p][panel.clone()]);
            for (k, block) in blocks.iter().enumerate() {
                let mut part = [SMALL_ZERO; N];
                outer::<A, HIGH, N>(&block[panel.clone()], w, AHEAD, &mut part);
                part.iter().enumerate().for_each(|(p, part)| add(&mut out[(i + p) * blocks.len() + k], part));
            }
        });
    }
}

/// Σ_p += Σ_k Q_k C_kp for rows `at..at + R`.
#[inline(always)]
fn add_products<A: Arithmetic, const R: usize, const P: usize>(
    blocks: &[&[Row]],
    c: [&[Small]; P],
    at: usize,
    sum: &mut [[A::Lanes; R]; P],
) {
    let mut of_row = [A::splat(0.0); P];
    for (k, block) in blocks.iter().enumerate() {
        for r in 0..R {
            prefetch(block, at + AHEAD + r);
        }
        let q = &block[at..at + R];
        for a in 0..WIDTH {
            for p in 0..P {
                of_row[p] = A::load(&c[p][k][a]);
            }
            for r in 0..R {
                let entry = A::splat(q[r][a]);
                for p in 0..P {
                    sum[p][r] = A::multiply_add(entry, of_row[p], sum[p][r]);
                }
            }
        }
    }
}

/// Rows `at..at + R` of P blocks W_p (+)= Σ_k Q_k C_kp.
#[inline(always)]
fn tile<A: Arithmetic, const R: usize, const P: usize>(
    blocks: &[&[Row]],
    c: [&[Small]; P],
    w: &mut [&mut [Row]; P],
    at: usize,
    add: bool,
) {
    let mut sum = [[A::splat(0.0); R]; P];
    if add {
        for p in 0..P {
            for r in 0..R {
                sum[p][r] = A::load(&w[p][at + r]);
            }
        }
    }
    add_products::<A, R, P>(blocks, c, at, &mut sum);
    for p in 0..P {
        for r in 0..R {
            A::store(sum[p][r], &mut w[p][at + r]);
        }
    }
}

/// The same for a range of rows.
#[inline(always)]
fn tiles<A: Arithmetic, const R: usize, const P: usize>(
    blocks: &[&[Row]],
    c: [&[Small]; P],
    w: &mut [&mut [Row]; P],
    rows: Range<usize>,
    add: bool,
) {
    let whole = rows.end - rows.len() % R;
    for at in (rows.start..whole).step_by(R) {
        tile::<A, R, P>(blocks, c, w, at, add);
    }
    for at in whole..rows.end {
        tile::<A, 1, P>(blocks, c, w, at, add);
    }
}

/// W_i (+)= Σ_k Q_k C_ki with C_ki = c[i·blocks + k], the layout of `gram`.
#[inline(always)]
pub(crate) fn update_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    blocks: &[&[Row]],
    c: &[Small],
    ws: &mut [&mut [Row]],
    add: bool,
) {
    let rows = blocks.first().map_or(0, |block| block.len());
    let panel = PANEL / 4; // a multiple of R
    for first in (0..rows).step_by(panel) {
        let panel = first..(first + panel).min(rows);
        in_groups!(P, ws.len(), i, N => {
            let c: [&[Small]; N] = std::array::from_fn(|p| &c[(i + p) * blocks.len()..][..blocks.len()]);
            if let Some(ws) = ws[i..].first_chunk_mut::<N>() {
                tiles::<A, R, N>(blocks, c, ws, panel.clone(), add);
            }
        });
    }
}

/// Rows that `recur` and `scale` go through together: of all blocks they stay in a core's cache.
const TALL: usize = 64;

/// W += Σ_k Q_k C_k, then out_i = P_iᵀ W and, after them, Wᵀ W and, unless V is empty, P_iᵀ V, in one pass.
#[inline(always)]
pub(crate) fn recur_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    q: &[&[Row]],
    c: &[Small],
    w: &mut [Row],
    p: &[&[Row]],
    v: &[Row],
    out: &mut [Small],
) {
    out.fill(SMALL_ZERO);
    let rows = w.len();
    for first in (0..rows).step_by(TALL) {
        let panel = first..(first + TALL).min(rows);
        tiles::<A, R, 1>(q, [c], &mut [&mut *w], panel.clone(), true);
        let (with_w, with_v) = out.split_at_mut(p.len() + 1);
        let w = &w[panel.clone()];
        // Wᵀ P_i instead of P_iᵀ W, so that an entry of W, once read, serves several blocks.
        in_groups!(P, p.len() + 1, i, N => {
            let p: [&[Row]; N] = std::array::from_fn(|k| p.get(i + k).map_or(w, |p| &p[panel.clone()]));
            if let Some(out) = with_w[i..].first_chunk_mut::<N>() {
                outer::<A, HIGH, N>(w, p, 0, out);
            }
        });
        if v.is_empty() {
            continue;
        }
        let v = &v[panel.clone()];
        in_groups!(P, p.len(), i, N => {
            let p: [&[Row]; N] = std::array::from_fn(|k| &p[i + k][panel.clone()]);
            if let Some(out) = with_v[i..].first_chunk_mut::<N>() {
                outer::<A, HIGH, N>(v, p, 0, out);
            }
        });
    }
    out.iter_mut().for_each(|out| *out = transpose(out));
}

/// Rows `at..at + R` of W = (W + Σ_k Q_k C_k) S, and of a copy of it unless that is empty.
#[inline(always)]
fn scale_tile<A: Arithmetic, const R: usize>(
    q: &[&[Row]],
    c: &[Small],
    s: &Small,
    w: &mut [Row],
    copy: &mut [Row],
    at: usize,
) {
    let mut rest = [ZERO; R];
    let [mut sum, mut scaled] = [[[A::splat(0.0); R]]; 2];
    for r in 0..R {
        sum[0][r] = A::load(&w[at + r]);
    }
    add_products::<A, R, 1>(q, [c], at, &mut sum);
    for r in 0..R {
        A::store(sum[0][r], &mut rest[r]);
    }
    add_products::<A, R, 1>(&[&rest], [std::slice::from_ref(s)], 0, &mut scaled);
    for r in 0..R {
        A::store(scaled[0][r], &mut w[at + r]);
        if let Some(copy) = copy.get_mut(at + r) {
            A::store(scaled[0][r], copy);
        }
    }
}

/// W = (W + Σ_k Q_k C_k) S, a copy of it unless that is empty, and its Wᵀ W, in one pass.
#[inline(always)]
pub(crate) fn scale_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    q: &[&[Row]],
    c: &[Small],
    s: &Small,
    w: &mut [Row],
    copy: &mut [Row],
    square: &mut Small,
) {
    *square = SMALL_ZERO;
    let rows = w.len();
    for first in (0..rows).step_by(TALL) {
        let end = (first + TALL).min(rows);
        let whole = end - (end - first) % R;
        for at in (first..whole).step_by(R) {
            scale_tile::<A, R>(q, c, s, w, copy, at);
        }
        for at in whole..end {
            scale_tile::<A, 1>(q, c, s, w, copy, at);
        }
        let w = &w[first..end];
        outer::<A, HIGH, 1>(w, [w], 0, std::array::from_mut(square));
    }
}
