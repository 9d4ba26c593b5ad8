//! How far a Krylov basis has lost its orthogonality, without measuring it.
//!
//! Exact orthogonality need not be kept: up to a loss of about 1e-8 the projected problem is exact to rounding, and
//! vectors are exact to the loss (Simon 1984). Ω_j ≈ Bᵀ Q_j obeys the recurrence of the space itself (Grimes, Lewis and
//! Simon 1994, here for a space that starts with kept vectors, so that H is no longer block tridiagonal):
//!
//! Ω_{j+1} R_{j+1} = H Ω_j − Ω_j α_j − Ω_{j−1} R_jᵀ + F.
//!
//! F is the noise of the solves. It is measured: α_j = Q_jᵀ Op Q_j is symmetric but for that noise. (With F = 1e-16
//! ‖Op‖ instead, the estimate was 25 times too low on a mesh of 9,000 vertices and 1,000 times on one of 100,000.)

use std::ops::Range;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::eigen::block::{Row, Small, WIDTH, ZERO, add, inverse_of_upper, largest, negative, transpose};
use crate::eigen::kernel::{Plain, add_scaled};
use crate::eigen::projected::Projected;

/// Rounding of an inner product of unit vectors.
const ROUNDING: f64 = 2e-16;

/// How much of the noise counts: until it has been compared with what was measured, at least, and at most.
const SHARE: [f64; 3] = [1.0, 1e-4, 100.0];

/// What a repair may multiply the share by, at least: the first one of a space says little.
const LEARNT: f64 = 0.1;

/// The share that a space starts with, at least, whatever the one before it has learnt: its noise may be of another kind.
const AGAIN: f64 = 0.3;

/// The noise of solves, relative to α, above which another shift is better: usual are 1e-12 to 1e-11.
const NOISE_MAX: f64 = 5e-11;

/// By how much the estimate is to stay above what is measured.
const IN_HAND: f64 = 2.0;

/// By how much a loss grows in a step, until it is known: a step near the shift multiplies by 3 to 50.
const GROWTH: f64 = 4.0;

/// Ω for the last two blocks of a space: a row for every column of the basis before the block, and the block itself.
#[derive(Debug, Default)]
pub(crate) struct Loss {
    now: Vec<Row>,
    before: Vec<Row>,
    noise: f64,
    /// Along which combinations of columns every block is orthogonalised: what the noise is largest in.
    deflated: Vec<Vec<f64>>,
    /// The share of the noise that is not along them, by what repairs have measured.
    share: Option<f64>,
    /// The noise of each step, relative to its α.
    relative: Vec<f64>,
    /// The estimate of the last step; none right after a repair.
    estimate: Option<f64>,
    /// For each column that the space started with, the error of what is known of its product with Op.
    inherited: Vec<f64>,
    scale: f64,
}

impl Loss {
    /// For a space that starts with vectors of this one's, and orthogonalises every block against those columns.
    pub(crate) fn next(&self, deflated: Range<usize>) -> Loss {
        let unit = |k: usize| (0..=k).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
        Loss {
            deflated: deflated.map(unit).collect(),
            share: self.share.map(|share| share.max(AGAIN)),
            ..Loss::default()
        }
    }

    /// Every block is orthogonalised along these combinations of columns from now on.
    pub(crate) fn deflate(&mut self, combinations: Vec<Vec<f64>>) {
        self.deflated = combinations;
    }

    /// Both last blocks are orthogonal to everything before them, to so many roundings. `columns`: before the last
    /// block.
    pub(crate) fn repaired(&mut self, columns: usize, roundings: f64, random: &mut ChaCha8Rng) {
        for (omega, columns) in [(&mut self.now, columns), (&mut self.before, columns.saturating_sub(WIDTH))] {
            omega.clear();
            omega.extend((0..columns).map(|_| noise(roundings * ROUNDING, random)));
            omega.extend(identity());
        }
        self.estimate = None;
    }

    /// Learns from what a repair has measured how much of the noise counts.
    pub(crate) fn compare(&mut self, measured: f64) {
        if let Some(estimate) = self.estimate {
            let share = self.share.unwrap_or(SHARE[0]) * (IN_HAND * measured / estimate).max(LEARNT);
            self.share = Some(share.clamp(SHARE[1], SHARE[2]));
        }
    }

    /// Notes the asymmetry of a computed α.
    pub(crate) fn measure(&mut self, alpha: &Small) {
        let mut asymmetry = negative(&transpose(alpha));
        add(&mut asymmetry, alpha);
        let asymmetry = largest(&[asymmetry]);
        // The first blocks are long in the directions that solves lose most in; their noise is soon gone.
        self.noise = (0.3 * self.noise).max(asymmetry);
        self.relative.push(asymmetry / largest(std::slice::from_ref(alpha)));
        self.scale = (0..WIDTH).fold(self.scale, |most, i| most.max(alpha[i][i].abs()));
    }

    /// Whether five steps from random vectors, the first two not counted, have shown more noise than a slice's vectors
    /// can bear: factors of equal growth differ a hundredfold in it.
    pub(crate) fn is_noisy(&self) -> bool {
        self.relative.len() == 5 && self.relative[2..].iter().sum::<f64>() > 3.0 * NOISE_MAX
    }

    /// Notes by how much the product with a column that the space started with is not what it was taken for.
    pub(crate) fn inherit(&mut self, error: f64) {
        self.inherited.push(error);
    }

    /// Follows the step that added a block: its α, the R before it and the R after it. Result: the largest entry to be
    /// expected after the next step.
    pub(crate) fn step(
        &mut self,
        projected: &Projected,
        alpha: &Small,
        r_before: &Small,
        r: &Small,
        random: &mut ChaCha8Rng,
    ) -> f64 {
        let columns = self.now.len() - WIDTH; // before the block that was multiplied
        let inverse = inverse_of_upper(r);
        let back = transpose(r_before);
        let mut next: Vec<Row> = Vec::with_capacity(columns + 2 * WIDTH);
        let share = self.share.unwrap_or(SHARE[0]);
        for k in 0..columns {
            // F, uniform in ± twice the noise.
            let inherited = self.inherited.get(k).copied().unwrap_or(0.0);
            let mut sum = noise(2.0 * share * self.noise.max(inherited) + ROUNDING * self.scale, random);
            let coupled = projected.coupled_to(k);
            let end = coupled.end.min(self.now.len());
            for (h, omega) in projected.row(k)[coupled.start..end].iter().zip(&self.now[coupled.start..end]) {
                add_scaled::<Plain>(&mut sum, *h, omega);
            }
            for a in 0..WIDTH {
                add_scaled::<Plain>(&mut sum, -self.now[k][a], &alpha[a]);
                if let Some(before) = self.before.get(k) {
                    add_scaled::<Plain>(&mut sum, -before[a], &back[a]);
                }
            }
            let mut row = ZERO;
            for a in 0..WIDTH {
                add_scaled::<Plain>(&mut row, sum[a], &inverse[a]);
            }
            next.push(row);
        }
        for direction in &self.deflated {
            let mut along = ZERO;
            direction.iter().zip(&next).for_each(|(d, row)| add_scaled::<Plain>(&mut along, *d, row));
            direction.iter().zip(&mut next).for_each(|(d, row)| add_scaled::<Plain>(row, -d, &along));
        }
        let most = next.as_flattened().iter().fold(0.0f64, |most, x| most.max(x.abs()));
        next.extend((0..WIDTH).map(|_| noise(ROUNDING, random))); // neighbours are orthogonalised explicitly
        next.extend(identity());
        self.before = std::mem::replace(&mut self.now, next);
        most * self.estimate.replace(most).map_or(GROWTH, |before| (most / before).max(1.0))
    }
}

fn noise(size: f64, random: &mut ChaCha8Rng) -> Row {
    std::array::from_fn(|_| 2.0 * size * uniform(random))
}

fn identity() -> impl Iterator<Item = Row> {
    (0..WIDTH).map(|i| std::array::from_fn(|k| if i == k { 1.0 } else { 0.0 }))
}

/// Uniform in [−½, ½).
pub(crate) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}
