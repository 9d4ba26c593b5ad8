//! How orthogonal the Lanczos basis still is, without measuring it: partial reorthogonalisation.
//!
//! Simon 1984, for blocks Grimes, Lewis and Simon 1994. With ω_{j,k} = Q_kᵀ Q_j, the Lanczos recurrence read from both
//! sides gives
//!
//! ω_{j+1,k} R_{j+1} = R_k ω_{j,k−1} + α_k ω_{j,k} + R_{k+1}ᵀ ω_{j,k+1} − ω_{j−1,k} R_jᵀ − ω_{j,k} α_j + F,
//!
//! where F is the rounding of one step. The blocks are only orthogonalised when this says that too much was lost, which
//! saves most of the dense products. F is random, of a size that is measured for free: α = Qᵀ Op Q is symmetric but for
//! the noise of the solve. (With F of the size 1e-16 ‖Op‖ the estimate was 25 to 1000 times too low.)

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::eigen::block::{SMALL_ZERO, Small, WIDTH, product, transpose};
use crate::eigen::lanczos::uniform;

/// A loss above this is repaired. A loss of δ goes into the residuals of the vectors as δ ‖Op‖, so √ε would not do.
const REPAIR_ABOVE: f64 = 1e-9;

/// Rounding of an inner product of unit vectors.
const ROUNDING: f64 = 2e-16;

/// The running estimate.
pub(crate) struct Omega {
    /// Q_kᵀ Q_j for k = 1 .. j; the last is I.
    now: Vec<Small>,
    /// Q_kᵀ Q_{j−1} for k = 1 .. j − 1.
    before: Vec<Small>,
    /// The largest |α − αᵀ|, and the largest |α| or |R|, so far.
    noise: f64,
    scale: f64,
    /// Noise of a step in units of `noise`; corrected by what repairs measure.
    factor: f64,
    random: ChaCha8Rng,
}

impl Omega {
    pub(crate) fn new(seed: u64) -> Omega {
        let random = ChaCha8Rng::seed_from_u64(seed);
        Omega { now: vec![identity()], before: Vec::new(), noise: 0.0, scale: 0.0, factor: 2.0, random }
    }

    /// Takes the size of a step's rounding from α as computed.
    pub(crate) fn observe(&mut self, alpha: &Small) {
        for a in 0..WIDTH {
            for c in 0..WIDTH {
                self.noise = self.noise.max((alpha[a][c] - alpha[c][a]).abs());
                self.scale = self.scale.max(alpha[a][c].abs());
            }
        }
    }

    /// Goes on by one step. `alpha` and `coupling` are α_1 .. α_j and R_2 .. R_{j+1}. Result: an estimate of the largest
    /// |Q_kᵀ Q_{j+1}| if it is too large (infinite where R_{j+1} cannot be inverted).
    pub(crate) fn step(&mut self, alpha: &[Small], coupling: &[Small]) -> Option<f64> {
        let j = alpha.len() - 1;
        let r = &coupling[j];
        let noise = 2.0 * (self.factor * self.noise + ROUNDING * self.scale);
        let mut next = Vec::with_capacity(j + 2);
        let mut most = 0.0f64;
        for k in 0..j {
            let mut sum: Small = std::array::from_fn(|_| std::array::from_fn(|_| noise * uniform(&mut self.random)));
            if k > 0 {
                add(&mut sum, 1.0, &product(&coupling[k - 1], &self.now[k - 1]));
            }
            add(&mut sum, 1.0, &product(&alpha[k], &self.now[k]));
            add(&mut sum, 1.0, &product(&transpose(&coupling[k]), &self.now[k + 1]));
            add(&mut sum, -1.0, &product(&self.now[k], &alpha[j]));
            if let Some(before) = self.before.get(k) {
                add(&mut sum, -1.0, &product(before, &transpose(&coupling[j - 1])));
            }
            let omega = divide(&sum, r);
            most = omega.iter().flatten().fold(most, |most, x| if x.is_finite() { most.max(x.abs()) } else { f64::INFINITY });
            next.push(omega);
        }
        next.push(self.rounding());
        next.push(identity());
        self.before = std::mem::replace(&mut self.now, next);
        (most > REPAIR_ABOVE).then_some(most)
    }

    /// After both of the last two blocks were orthogonalised; `estimated` is what `step` said, `measured` what was removed.
    pub(crate) fn repaired(&mut self, estimated: f64, measured: f64) {
        if estimated.is_finite() && measured > 0.0 {
            let correction = (measured / estimated).clamp(0.3, 1e4).powf(0.7);
            self.factor = (self.factor * correction).clamp(0.5, 1e3);
        }
        self.now = self.fresh(self.now.len());
        self.before = self.fresh(self.before.len());
    }

    /// The estimate for a block that has just been orthogonalised against all `len` − 1 before it.
    fn fresh(&mut self, len: usize) -> Vec<Small> {
        let mut omega: Vec<Small> = (1..len).map(|_| self.rounding()).collect();
        omega.extend((len > 0).then(identity));
        omega
    }

    fn rounding(&mut self) -> Small {
        std::array::from_fn(|_| std::array::from_fn(|_| ROUNDING * uniform(&mut self.random)))
    }
}

fn identity() -> Small {
    std::array::from_fn(|a| std::array::from_fn(|c| if a == c { 1.0 } else { 0.0 }))
}

fn add(sum: &mut Small, scale: f64, term: &Small) {
    for (sum, term) in sum.iter_mut().flatten().zip(term.iter().flatten()) {
        *sum += scale * term;
    }
}

/// A R⁻¹ for an upper triangular R.
fn divide(a: &Small, r: &Small) -> Small {
    let mut x = SMALL_ZERO;
    for i in 0..WIDTH {
        for j in 0..WIDTH {
            x[i][j] = (a[i][j] - (0..j).map(|k| x[i][k] * r[k][j]).sum::<f64>()) / r[j][j];
        }
    }
    x
}
