//! Making the columns of a new block of a Krylov space orthonormal, however little is left of them.

use super::Krylov;
use super::take::{Product, Whole};
use crate::eigen::block::{Block, Row, SMALL_ZERO, Small, WIDTH, ZERO, cholesky, inverse_of_upper, product};
use crate::eigen::loss::uniform;
use crate::eigen::parts::{self, gram_of};

/// A block no longer than this share of ‖Op‖ is rounding.
const RANK: f64 = 1e-13;

/// How ill-conditioned a block may be, and how much longer it may have been before the vectors next to it were taken off,
/// if the products known by then are to orthonormalise it: rounding is multiplied by the squares of both.
const CONDITION_MAX: f64 = 50.0;
const TAKEN_MAX: f64 = 30.0;

impl Krylov<'_> {
    /// R and R⁻¹ for a block W with Wᵀ W = `square`, of which columns up to `taken` long were the rest, unless that is too
    /// little to orthonormalise it.
    pub(super) fn normaliser(&self, square: &Small, taken: f64) -> Option<(Small, Small)> {
        let (r, inverse) = cholesky(square)?;
        let (least, most) = ends(&r);
        let good = most > RANK * self.scale && most < CONDITION_MAX * least && taken < TAKEN_MAX * least;
        good.then_some((r, inverse))
    }

    /// R and R⁻¹ of a W that its known square does not allow to normalise; W becomes Q.
    pub(super) fn normalise(&mut self, w: &mut Block, product: &mut Product) -> (Small, Small) {
        let (n, kind) = (self.n, self.tools.kind);
        parts::take_off(kind, &self.next_to(), &product.off, &mut [&mut w[..n]]);
        if let Some(Whole { left, .. }) = &mut product.whole {
            let blocks: Vec<&[Row]> = self.basis.iter().map(|block| &block[..n]).collect();
            parts::take_off(kind, &blocks, left, &mut [&mut w[..n]]);
            left.fill(SMALL_ZERO);
        }
        let square = gram_of(kind, &w[..n], &w[..n]);
        let r = self.orthonormalise(w, square);
        (r, inverse_of_upper(&r))
    }

    /// W −= B Bᵀ W over the whole basis.
    fn orthogonalise(&self, w: &mut [Row]) {
        let blocks: Vec<&[Row]> = self.basis.iter().map(|block| &block[..self.n]).collect();
        let mut c = vec![SMALL_ZERO; blocks.len()];
        parts::gram(self.tools.kind, &blocks, &[&w[..self.n]], &mut c);
        parts::take_off(self.tools.kind, &blocks, &c, &mut [&mut w[..self.n]]);
    }

    /// W = Q R with R upper triangular; W becomes Q. `square` is Wᵀ W. Cholesky of it, again while R is ill-conditioned
    /// (the loss of orthogonality is 1e-16 times the square of its condition); columns one by one if W has lost rank.
    pub(super) fn orthonormalise(&mut self, w: &mut Block, mut square: Small) -> Small {
        let n = self.n;
        let mut total: Option<Small> = None;
        self.rounding = SMALL_ZERO;
        for _ in 0..4 {
            let Some((r, inverse)) = cholesky(&square) else {
                break;
            };
            let (least, most) = ends(&r);
            if most <= RANK * self.scale {
                break; // an invariant subspace: what is left of W is rounding
            }
            parts::scale(self.tools.kind, &[], &[], &inverse, &mut w[..n], None);
            total = Some(total.map_or(r, |total| product(&r, &total)));
            if most / least < CONDITION_MAX {
                return total.unwrap_or(r);
            }
            // Scaling up by 1/R amplified what was left along the basis.
            if most / least > 1e6 {
                self.orthogonalise(w);
            }
            square = gram_of(self.tools.kind, &w[..n], &w[..n]);
        }
        let rounding = if total.is_none() { 1e-12 * self.scale } else { 0.0 };
        let r = self.fill_up(w, rounding);
        total.map_or(r, |total| product(&r, &total))
    }

    /// Gram-Schmidt column by column; a column that depends on those before it, or is no longer than `rounding`, gets a
    /// zero row in R and is replaced by a random vector orthogonal to everything. The recurrence still holds, but its
    /// loss can no longer be foreseen.
    fn fill_up(&mut self, w: &mut Block, rounding: f64) -> Small {
        self.every_step = true;
        let w = &mut w[..self.n];
        let mut r = SMALL_ZERO;
        for j in 0..WIDTH {
            let before = norm_of(w, j);
            for _ in 0..2 {
                for i in 0..j {
                    let along: f64 = w.iter().map(|row| row[i] * row[j]).sum();
                    w.iter_mut().for_each(|row| row[j] -= along * row[i]);
                    r[i][j] += along;
                }
            }
            let left = norm_of(w, j);
            if left > 1e-10 * before && left > rounding {
                r[j][j] = left;
                w.iter_mut().for_each(|row| row[j] /= left);
                continue;
            }
            let mut fresh = vec![ZERO; self.n];
            fresh.iter_mut().for_each(|row| row[j] = uniform(&mut self.random));
            for _ in 0..2 {
                self.orthogonalise(&mut fresh);
                for i in 0..j {
                    let along: f64 = w.iter().zip(&fresh).map(|(w, f)| w[i] * f[j]).sum();
                    fresh.iter_mut().zip(w.iter()).for_each(|(f, w)| f[j] -= along * w[i]);
                }
                let norm = norm_of(&fresh, j);
                fresh.iter_mut().for_each(|row| row[j] /= norm);
            }
            w.iter_mut().zip(&fresh).for_each(|(w, f)| w[j] = f[j]);
        }
        r
    }
}

/// The least and the largest diagonal entry.
fn ends(r: &Small) -> (f64, f64) {
    (0..WIDTH).fold((f64::INFINITY, 0.0f64), |(least, most), i| (least.min(r[i][i]), most.max(r[i][i])))
}

fn norm_of(block: &[Row], column: usize) -> f64 {
    block.iter().map(|row| row[column] * row[column]).sum::<f64>().sqrt()
}
