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

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::eigen::block::{Row, Small, WIDTH, ZERO, inverse_of_upper, transpose};
use crate::eigen::kernel::{Plain, add_scaled};
use crate::eigen::projected::Projected;

/// Rounding of an inner product of unit vectors.
const ROUNDING: f64 = 2e-16;

/// Ω for the last two blocks of a space: a row for every column of the basis before the block, and the block itself.
#[derive(Debug, Default)]
pub(crate) struct Loss {
    now: Vec<Row>,
    before: Vec<Row>,
    noise: f64,
    /// For each column that the space started with, the error of what is known of its product with Op.
    inherited: Vec<f64>,
    scale: f64,
}

impl Loss {
    /// Both last blocks are orthogonal to everything before them, to rounding. `columns`: before the last block.
    pub(crate) fn repaired(&mut self, columns: usize, random: &mut ChaCha8Rng) {
        for (omega, columns) in [(&mut self.now, columns), (&mut self.before, columns.saturating_sub(WIDTH))] {
            omega.clear();
            omega.extend((0..columns).map(|_| noise(ROUNDING, random)));
            omega.extend(identity());
        }
    }

    /// Notes the asymmetry of a computed α.
    pub(crate) fn measure(&mut self, alpha: &Small) {
        // The first blocks are long in the directions that solves lose most in; their noise is soon gone.
        self.noise *= 0.3;
        for ((i, row), turned) in alpha.iter().enumerate().zip(transpose(alpha)) {
            self.noise = row.iter().zip(turned).fold(self.noise, |most, (a, b)| most.max((a - b).abs()));
            self.scale = self.scale.max(row[i].abs());
        }
    }

    /// Notes by how much the product with a column that the space started with is not what it was taken for.
    pub(crate) fn inherit(&mut self, error: f64) {
        self.inherited.push(error);
    }

    /// Follows the step that added a block: its α, the R before it and the R after it. Result: the largest entry.
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
        let mut most = 0.0f64;
        for k in 0..columns {
            // F, uniform in ± twice the noise.
            let inherited = self.inherited.get(k).copied().unwrap_or(0.0);
            let mut sum = noise(2.0 * self.noise.max(inherited) + ROUNDING * self.scale, random);
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
            most = row.iter().fold(most, |most, x| most.max(x.abs()));
            next.push(row);
        }
        next.extend((0..WIDTH).map(|_| noise(ROUNDING, random))); // neighbours are orthogonalised explicitly
        next.extend(identity());
        self.before = std::mem::replace(&mut self.now, next);
        most
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
