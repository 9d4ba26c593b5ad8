//! Eigenpairs of a small symmetric matrix, and of the eigenvectors only those rows that are wanted.
//!
//! A projected problem has some hundred columns. Whether its pairs are good enough is seen from eigenvalues and eight rows
//! of the eigenvectors, and the answer is no every third time. So the matrix becomes Q T Qᵀ with T tridiagonal
//! (Householder; Golub and Van Loan 2013, section 8.3.1), T becomes diagonal by the implicit QL method (Dubrulle, Martin and
//! Wilkinson 1968), whose rotations are noted, and reflections and rotations are applied to those rows that are asked for.
//!
//! All of it is in a core's cache. A step of the reduction goes through what is left of the matrix once: it takes off what
//! the reflection before it asks for and multiplies with the next one at the same time.

use std::ops::Range;

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Block, Row, WIDTH, ZERO};
use crate::eigen::kernel::{self, Kind};

/// Eigenvalues of a symmetric matrix, and what its eigenvectors are made of.
pub(crate) struct Decomposed {
    reflected: Reflected,
    rotations: Rotations,
    /// Which diagonal entry each eigenvalue is, ascending.
    order: Vec<usize>,
    pub(crate) values: Vec<f64>,
    kind: Kind,
}

/// Some rows of all eigenvectors.
pub(crate) struct VectorRows {
    first: usize,
    side: usize,
    order: Vec<usize>,
    /// In panels of eight rows, a line for each eigenvector.
    panels: Block,
}

impl VectorRows {
    /// Entry i of eigenvector k.
    pub(crate) fn entry(&self, i: usize, k: usize) -> f64 {
        self.panels[self.side * (i / WIDTH - self.first) + self.order[k]][i % WIDTH]
    }
}

impl Decomposed {
    /// `None` if the method does not converge: the matrix is not finite.
    pub(crate) fn new(kind: Kind, side: usize, entry: impl Fn(usize, usize) -> f64) -> Option<Decomposed> {
        let mut reflected = Reflected::new(side, entry);
        kernel::reflect(kind, &mut reflected);
        let mut diagonal = reflected.diagonal.clone();
        let rotations = Rotations::find(&mut diagonal, reflected.beside.clone())?;
        let mut order: Vec<usize> = (0..side).collect();
        order.sort_by(|&a, &b| diagonal[a].total_cmp(&diagonal[b]));
        let values = order.iter().map(|&k| diagonal[k]).collect();
        Some(Decomposed { reflected, rotations, order, values, kind })
    }

    /// Those rows of the eigenvectors, a few more perhaps.
    pub(crate) fn vector_rows(&self, rows: Range<usize>) -> VectorRows {
        let side = self.values.len();
        let first = rows.start / WIDTH;
        let mut panels = Block::zeros(side * (rows.end.div_ceil(WIDTH) - first));
        for i in WIDTH * first..rows.end {
            panels[side * (i / WIDTH - first) + i][i % WIDTH] = 1.0;
        }
        kernel::turn(self.kind, &self.reflected, &self.rotations, &mut panels);
        VectorRows { first, side, order: self.order.clone(), panels }
    }
}

/// A symmetric matrix on its way to tridiagonal form.
pub(crate) struct Reflected {
    side: usize,
    /// Rows of the matrix, filled up with zeros to whole lines of eight. In the end row k holds the vector v of
    /// reflection k, I − τ v vᵀ, whose first entry that is not zero has the number k + 1.
    rows: Block,
    tau: Vec<f64>,
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl Reflected {
    fn new(side: usize, entry: impl Fn(usize, usize) -> f64) -> Reflected {
        let width = side.div_ceil(WIDTH);
        let mut rows = Block::zeros(side * width);
        for (i, row) in rows.chunks_exact_mut(width.max(1)).enumerate() {
            row.as_flattened_mut()[..side].iter_mut().enumerate().for_each(|(j, to)| *to = entry(i, j));
        }
        let zeros = || vec![0.0; side];
        Reflected { side, rows, tau: zeros(), diagonal: zeros(), beside: zeros() }
    }

    fn width(&self) -> usize {
        self.side.div_ceil(WIDTH)
    }
}

/// Rows that are reduced together.
const TOGETHER: usize = 4;

/// Reduces the matrix to tridiagonal form.
#[inline(always)]
pub(crate) fn reflect_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(of: &mut Reflected) {
    let (side, width) = (of.side, of.width());
    // The reflection before: A − v wᵀ − w vᵀ; and the next one.
    let (mut v, mut w, mut next) = (vec![ZERO; width], vec![ZERO; width], vec![ZERO; width]);
    let mut product = vec![0.0; side];
    for k in 0..side {
        let first = k / WIDTH;
        let own = &mut of.rows[width * k..][..width];
        let (of_v, of_w) = (v.as_flattened()[k], w.as_flattened()[k]);
        for c in first..width {
            for lane in 0..WIDTH {
                own[c][lane] = A::fma(-of_v, w[c][lane], A::fma(-of_w, v[c][lane], own[c][lane]));
            }
        }
        let x = own.as_flattened();
        of.diagonal[k] = x[k];
        if k + 1 == side {
            break;
        }
        let rest: f64 = x[k + 2..].iter().map(|x| x * x).sum();
        next.fill(ZERO);
        let to = next.as_flattened_mut();
        to[k + 1] = 1.0;
        of.beside[k] = x[k + 1];
        if rest > 0.0 {
            let beta = -x[k + 1].signum() * x[k + 1].hypot(rest.sqrt());
            of.beside[k] = beta;
            of.tau[k] = (beta - x[k + 1]) / beta;
            let scale = 1.0 / (x[k + 1] - beta);
            to[k + 2..].iter_mut().zip(&x[k + 2..]).for_each(|(to, x)| *to = x * scale);
        }
        own.copy_from_slice(&next);
        let whole = side - (side - k - 1) % TOGETHER;
        for i in (k + 1..whole).step_by(TOGETHER) {
            reduce::<A, TOGETHER>(&mut of.rows, width, (i, first), [&v, &w, &next], &mut product);
        }
        for i in whole..side {
            reduce::<A, 1>(&mut of.rows, width, (i, first), [&v, &w, &next], &mut product);
        }
        // w = τ (A v − ½ τ (vᵀ A v) v)
        std::mem::swap(&mut v, &mut next);
        let of_v = &v.as_flattened()[..side];
        let tau = of.tau[k];
        let along: f64 = product[k + 1..].iter().zip(&of_v[k + 1..]).map(|(a, b)| a * b).sum();
        let to = w.as_flattened_mut();
        to[k] = 0.0;
        for i in k + 1..side {
            to[i] = tau * (product[i] - 0.5 * tau * along * of_v[i]);
        }
    }
}

/// Takes v wᵀ + w vᵀ off N rows from number i on, and multiplies them with the next vector.
#[inline(always)]
fn reduce<A: Arithmetic, const N: usize>(
    rows: &mut [Row],
    width: usize,
    (i, first): (usize, usize),
    [v, w, next]: [&[Row]; 3],
    product: &mut [f64],
) {
    let mut sum = [A::splat(0.0); N];
    let mut minus = [[A::splat(0.0); 2]; N];
    for (r, minus) in minus.iter_mut().enumerate() {
        *minus = [A::splat(-v.as_flattened()[i + r]), A::splat(-w.as_flattened()[i + r])];
    }
    for c in first..width {
        let (v, w, next) = (A::load(&v[c]), A::load(&w[c]), A::load(&next[c]));
        for r in 0..N {
            let place = &mut rows[width * (i + r) + c];
            let left = A::multiply_add(minus[r][0], w, A::multiply_add(minus[r][1], v, A::load(place)));
            A::store(left, place);
            sum[r] = A::multiply_add(left, next, sum[r]);
        }
    }
    for (r, sum) in sum.into_iter().enumerate() {
        let mut lanes = ZERO;
        A::store(sum, &mut lanes);
        product[i + r] = lanes.iter().sum();
    }
}

/// The rotations that make a tridiagonal matrix diagonal.
#[derive(Default)]
pub(crate) struct Rotations {
    /// Sweeps, each over the columns from the first to the second number, downwards, and where its rotations start.
    sweeps: Vec<(usize, usize, usize)>,
    /// Cosine and sine.
    turns: Vec<[f64; 2]>,
}

/// Numbers whose squares are nothing.
const SMALLEST: f64 = 1e-150;

/// Sweeps that a single eigenvalue may need.
const SWEEPS_MAX: usize = 60;

impl Rotations {
    /// Implicit QL with Wilkinson's shift: the diagonal becomes the eigenvalues.
    fn find(d: &mut [f64], mut e: Vec<f64>) -> Option<Rotations> {
        let mut all = Rotations::default();
        for l in 0..d.len() {
            for sweep in 0.. {
                let small = |k: usize| e[k].abs() <= (f64::EPSILON * (d[k].abs() + d[k + 1].abs())).max(SMALLEST);
                let end = (l..d.len() - 1).find(|&k| small(k)).unwrap_or(d.len() - 1);
                if end == l {
                    break;
                }
                if sweep == SWEEPS_MAX {
                    return None;
                }
                let half = (d[l + 1] - d[l]) / (2.0 * e[l]);
                let mut g = d[end] - d[l] + e[l] / (half + half.hypot(1.0).copysign(half));
                let (mut sine, mut cosine, mut p) = (1.0, 1.0, 0.0);
                let (start, mut low) = (all.turns.len(), l);
                for i in (l..end).rev() {
                    let (f, b) = (sine * e[i], cosine * e[i]);
                    let r = (f * f + g * g).sqrt();
                    e[i + 1] = r;
                    if r == 0.0 {
                        low = i + 1; // the matrix has fallen apart
                        break;
                    }
                    (sine, cosine) = (f / r, g / r);
                    g = d[i + 1] - p;
                    let r = (d[i] - g) * sine + 2.0 * cosine * b;
                    p = sine * r;
                    d[i + 1] = g + p;
                    g = cosine * r - b;
                    all.turns.push([cosine, sine]);
                }
                all.sweeps.push((low, end, start));
                d[low] -= p;
                if low == l {
                    e[l] = g;
                }
                e[end] = 0.0;
            }
        }
        Some(all)
    }
}

/// Panels that are turned together, for enough work that does not wait for other work.
const PANELS: usize = 4;

/// Applies reflections and rotations to panels of eight rows of the identity, which become rows of the eigenvectors.
#[inline(always)]
pub(crate) fn turn_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    reflected: &Reflected,
    rotations: &Rotations,
    panels: &mut [Row],
) {
    let side = reflected.side.max(1);
    let (several, rest) = panels.split_at_mut(panels.len() / (PANELS * side) * (PANELS * side));
    for panels in several.chunks_exact_mut(PANELS * side) {
        turn_panels::<A, PANELS>(reflected, rotations, panels);
    }
    for panel in rest.chunks_exact_mut(side) {
        turn_panels::<A, 1>(reflected, rotations, panel);
    }
}

#[inline(always)]
fn turn_panels<A: Arithmetic, const N: usize>(reflected: &Reflected, rotations: &Rotations, z: &mut [Row]) {
    let (side, width) = (reflected.side, reflected.width());
    for (k, tau) in reflected.tau.iter().enumerate() {
        let v = &reflected.rows[width * k..][..width].as_flattened()[..side];
        // Two sums each, because an addition waits for the one before it.
        let mut sums = [[A::splat(0.0); N]; 2];
        for i in k + 1..side {
            let entry = A::splat(v[i]);
            for p in 0..N {
                sums[i % 2][p] = A::multiply_add(entry, A::load(&z[side * p + i]), sums[i % 2][p]);
            }
        }
        let mut along = [A::splat(0.0); N];
        for p in 0..N {
            let sum = A::multiply_add(A::splat(1.0), sums[0][p], sums[1][p]);
            along[p] = A::multiply_add(A::splat(-tau), sum, along[p]);
        }
        for i in k + 1..side {
            let entry = A::splat(v[i]);
            for p in 0..N {
                let place = &mut z[side * p + i];
                A::store(A::multiply_add(entry, along[p], A::load(place)), place);
            }
        }
    }
    for &(low, high, start) in &rotations.sweeps {
        // Column i + 1, not yet stored.
        let mut held = [A::splat(0.0); N];
        for p in 0..N {
            held[p] = A::load(&z[side * p + high]);
        }
        for (i, &[cosine, sine]) in (low..high).rev().zip(&rotations.turns[start..]) {
            let (cosine, sine, minus) = (A::splat(cosine), A::splat(sine), A::splat(-sine));
            for p in 0..N {
                let own = A::load(&z[side * p + i]);
                let zero = A::splat(0.0);
                let upper = A::multiply_add(sine, own, A::multiply_add(cosine, held[p], zero));
                A::store(upper, &mut z[side * p + i + 1]);
                held[p] = A::multiply_add(minus, held[p], A::multiply_add(cosine, own, zero));
            }
        }
        for p in 0..N {
            A::store(held[p], &mut z[side * p + low]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Graded, with two clusters and entries of very different size.
    fn entry(i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        match i - j {
            0 if i % 5 < 2 => 7.0,
            0 => (i as f64 - 20.0) * 3.0,
            _ => 1.0 / (1.0 + (i - j) as f64 + (i * i) as f64),
        }
    }

    #[test]
    fn eigenvectors_are_orthonormal_and_leave_nothing() {
        for side in [1, 2, 3, 7, 8, 9, 33, 100] {
            let mut found = Vec::new();
            for kind in [Kind::Portable, Kind::Avx2, Kind::Avx512].into_iter().filter(|kind| kind.is_available()) {
                let decomposed = Decomposed::new(kind, side, entry).unwrap();
                let (values, all) = (&decomposed.values, decomposed.vector_rows(0..side));
                assert!(values.is_sorted());
                for (k, value) in values.iter().enumerate() {
                    for i in 0..side {
                        let product: f64 = (0..side).map(|j| entry(i, j) * all.entry(j, k)).sum();
                        let error = product - value * all.entry(i, k);
                        assert!(error.abs() < 1e-12, "rounding of entries up to 240: {error:e}");
                        let along: f64 = (0..side).map(|j| all.entry(j, i) * all.entry(j, k)).sum();
                        assert!((along - f64::from(i == k)).abs() < 1e-13);
                    }
                }
                let last = decomposed.vector_rows(side.saturating_sub(8)..side);
                for i in side.saturating_sub(8)..side {
                    assert!((0..side).all(|k| (last.entry(i, k) - all.entry(i, k)).abs() < 1e-13));
                }
                found.push((kind, values.clone()));
            }
            let (fused, portable) = (&found[found.len() - 1].1, &found[0].1);
            for (kind, values) in &found[1..] {
                assert_eq!(values, fused, "{kind:?}: the fused kinds add in the same order");
            }
            assert!(fused.iter().zip(portable).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }

    #[test]
    fn what_is_special_is_met() {
        // Diagonal; zeros, and next to nothing beside them; a cluster of one value; two equal parts.
        let matrices: [fn(usize, usize) -> f64; 5] = [
            |i, j| if i == j { i as f64 } else { 0.0 },
            |_, _| 0.0,
            |i, j| if i.abs_diff(j) == 1 { 1e-170 } else { 0.0 },
            |i, j| f64::from(i == j),
            |i, j| if i % 10 == j % 10 && i != j { 0.0 } else { 1.0 / (1.0 + (i % 10 + j % 10) as f64) },
        ];
        for entry in matrices {
            let decomposed = Decomposed::new(Kind::best(), 20, entry).unwrap();
            let all = decomposed.vector_rows(0..20);
            for k in 0..20 {
                for i in 0..20 {
                    let product: f64 = (0..20).map(|j| entry(i, j) * all.entry(j, k)).sum();
                    assert!((product - decomposed.values[k] * all.entry(i, k)).abs() < 1e-13);
                    let along: f64 = (0..20).map(|j| all.entry(j, i) * all.entry(j, k)).sum();
                    assert!((along - f64::from(i == k)).abs() < 1e-13);
                }
            }
        }
        assert!(Decomposed::new(Kind::best(), 20, |i, j| if i == j { f64::NAN } else { 1.0 }).is_none());
        assert!(Decomposed::new(Kind::best(), 20, |_, _| f64::INFINITY).is_none());
    }
}
