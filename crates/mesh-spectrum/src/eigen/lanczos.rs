//! Shift-invert block Lanczos for the pairs around one shift.
//!
//! Op = (A − σI)⁻¹ has the eigenvectors of A, with θ = 1/(λ − σ): the pairs next to the shift on both sides become the
//! extreme ones, which a Krylov space finds first. With blocks of b = 8 columns (Grimes, Lewis and Simon 1994):
//!
//! W = Op Q_j − Q_{j−1} R_jᵀ − Q_j α_j,  α_j = Q_jᵀ Op Q_j,  W = Q_{j+1} R_{j+1}.
//!
//! T is block tridiagonal with α on the diagonal and R below; T s = θ s gives the Ritz pair (θ, Q s) with the residual
//! Op Q s − θ Q s = Q_{m+1} R_{m+1} s_last. Every new block is orthogonalised against all before it, so that no pair is
//! found twice. (Doing so only where an estimate of the loss asks for it, Simon's partial reorthogonalisation, saved
//! nothing measurable at 9,000 degrees of freedom and a tenth of the time at 100,000: here the estimate asks every
//! second or third step.)

use faer::{Mat, Side};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::eigen::block::{
    Block, Row, SMALL_ZERO, Small, WIDTH, ZERO, cholesky, dispatch, gram_of, negative, product, transpose,
};
use crate::eigen::factor::Factor;

/// A Krylov space around one shift, growing by a block a step.
pub(crate) struct Lanczos<'a> {
    factor: &'a Factor,
    n: usize,
    /// Q_1 .. Q_{m+1}, orthonormal.
    basis: Vec<Block>,
    alpha: Vec<Small>,
    /// R_{j+1} at place j.
    coupling: Vec<Small>,
    random: ChaCha8Rng,
    /// The largest |α| so far: an estimate of ‖Op‖ from below.
    scale: f64,
}

/// Eigenpairs of T.
pub(crate) struct Ritz {
    /// θ.
    pub(crate) values: Vec<f64>,
    /// ‖R_{m+1} s_last‖ of each.
    pub(crate) residuals: Vec<f64>,
    vectors: Mat<f64>,
}

impl<'a> Lanczos<'a> {
    /// Starts from eight random vectors.
    pub(crate) fn new(factor: &'a Factor, n: usize, seed: u64) -> Lanczos<'a> {
        let mut lanczos = Lanczos {
            factor,
            n,
            basis: Vec::new(),
            alpha: Vec::new(),
            coupling: Vec::new(),
            random: ChaCha8Rng::seed_from_u64(seed),
            scale: 0.0,
        };
        let mut start = vec![ZERO; n];
        start.iter_mut().for_each(|row| row.0 = std::array::from_fn(|_| uniform(&mut lanczos.random)));
        lanczos.orthonormalise(&mut start);
        lanczos.basis.push(start);
        lanczos
    }

    /// m: the dimension of the projected problem.
    pub(crate) fn dimension(&self) -> usize {
        WIDTH * self.alpha.len()
    }

    /// The Krylov space can grow by another block.
    pub(crate) fn can_grow(&self) -> bool {
        WIDTH * (self.basis.len() + 1) <= self.n
    }

    /// Grows the space by one block.
    pub(crate) fn step(&mut self) {
        let j = self.alpha.len();
        let mut w = Vec::with_capacity(self.n + 1); // one more: the solve's scratch row
        w.extend_from_slice(&self.basis[j]);
        w.push(ZERO);
        dispatch::solve(&self.factor.packed, &mut w);
        w.truncate(self.n);

        // The three-term recurrence first, then all blocks once: what is left to remove is then of the size of
        // rounding, and one pass is enough.
        if j > 0 {
            let back = negative(&transpose(&self.coupling[j - 1]));
            dispatch::update(&[&self.basis[j - 1]], &[back], &mut [&mut w]);
        }
        let mut alpha = gram_of(&self.basis[j], &w);
        dispatch::update(&[&self.basis[j]], &[negative(&alpha)], &mut [&mut w]);
        let correction = self.orthogonalise(&mut w);
        for a in 0..WIDTH {
            for c in 0..WIDTH {
                alpha[a][c] += correction[a][c];
            }
        }
        let turned = transpose(&alpha);
        for a in 0..WIDTH {
            for c in 0..WIDTH {
                // Symmetric but for rounding.
                alpha[a][c] = 0.5 * (alpha[a][c] + turned[a][c]);
                self.scale = self.scale.max(alpha[a][c].abs());
            }
        }
        self.alpha.push(alpha);
        let r = self.orthonormalise(&mut w);
        self.coupling.push(r);
        self.basis.push(w);
    }

    /// W −= Q Qᵀ W over the whole basis; returns the last block's coefficients.
    fn orthogonalise(&self, w: &mut [Row]) -> Small {
        let blocks: Vec<&[Row]> = self.basis.iter().map(|block| &block[..]).collect();
        let mut c = vec![SMALL_ZERO; blocks.len()];
        dispatch::gram(&blocks, &[w], &mut c);
        c.iter_mut().for_each(|c| *c = negative(c));
        dispatch::update(&blocks, &c, &mut [w]);
        c.last().map_or(SMALL_ZERO, negative)
    }

    /// W = Q R with R upper triangular; W becomes Q. Cholesky of the Gram matrix, again while R is ill-conditioned
    /// (the loss of orthogonality is 1e-16 times the square of its condition); columns one by one if W has lost rank.
    fn orthonormalise(&mut self, w: &mut Block) -> Small {
        let mut total: Option<Small> = None;
        for _ in 0..4 {
            let Some((r, inverse)) = cholesky(&gram_of(w, w)) else {
                break;
            };
            let (least, most) =
                (0..WIDTH).fold((f64::INFINITY, 0.0f64), |(least, most), i| (least.min(r[i][i]), most.max(r[i][i])));
            if most <= 1e-13 * self.scale {
                break; // an invariant subspace: what is left of W is rounding
            }
            dispatch::scale(&inverse, w);
            total = Some(total.map_or(r, |total| product(&r, &total)));
            if most / least < 50.0 {
                return total.unwrap_or(r);
            }
            // Scaling up by 1/R amplified what was left along the basis.
            if most / least > 1e6 {
                self.orthogonalise(w);
            }
        }
        let rounding = if total.is_none() { 1e-12 * self.scale } else { 0.0 };
        let r = self.fill_up(w, rounding);
        total.map_or(r, |total| product(&r, &total))
    }

    /// Gram-Schmidt column by column; a column that depends on those before it, or is no longer than `rounding`, gets a
    /// zero row in R and is replaced by a random vector orthogonal to everything. The recurrence still holds.
    fn fill_up(&mut self, w: &mut Block, rounding: f64) -> Small {
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

    /// Solves the projected problem; `None` if it does not converge (not finite).
    pub(crate) fn ritz(&self) -> Option<Ritz> {
        let m = self.dimension();
        let mut t = Mat::<f64>::zeros(m, m);
        for (j, alpha) in self.alpha.iter().enumerate() {
            for a in 0..WIDTH {
                for c in 0..WIDTH {
                    t[(j * WIDTH + a, j * WIDTH + c)] = alpha[a][c];
                    if j + 1 < self.alpha.len() {
                        t[((j + 1) * WIDTH + a, j * WIDTH + c)] = self.coupling[j][a][c];
                        t[(j * WIDTH + c, (j + 1) * WIDTH + a)] = self.coupling[j][a][c];
                    }
                }
            }
        }
        let pairs = t.self_adjoint_eigen(Side::Lower).ok()?;
        let values: Vec<f64> = pairs.S().column_vector().iter().copied().collect();
        let vectors = pairs.U().to_owned();
        let residuals = (0..m).map(|k| self.last_row(&vectors, k).iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
        values.iter().all(|value| value.is_finite()).then_some(Ritz { values, residuals, vectors })
    }

    /// R_{m+1} s_last for one column of s.
    fn last_row(&self, vectors: &Mat<f64>, column: usize) -> [f64; WIDTH] {
        let first = self.dimension() - WIDTH;
        let r = &self.coupling[self.coupling.len() - 1];
        std::array::from_fn(|a| (0..WIDTH).map(|c| r[a][c] * vectors[(first + c, column)]).sum())
    }

    /// Ritz vectors of the chosen columns in blocks of eight (the last one filled up with zeros), with one step of
    /// inverse iteration that costs no solve: x = Q s + Q_{m+1} R_{m+1} s_last / θ is Op Q s / θ, so that the residual
    /// (A − λ) x is β (λ − σ)², free of the factor ‖A‖.
    pub(crate) fn vectors(&self, ritz: &Ritz, chosen: &[usize]) -> Vec<Block> {
        let blocks: Vec<&[Row]> = self.basis.iter().map(|block| &block[..]).collect();
        let last = blocks.len() - 1;
        let each = chosen.len().div_ceil(WIDTH);
        // C_ki: block k of the basis to block i of the result, i running faster.
        let mut c = vec![SMALL_ZERO; blocks.len() * each];
        for (place, &column) in chosen.iter().enumerate() {
            let (i, to) = (place / WIDTH, place % WIDTH);
            for from in 0..self.dimension() {
                c[from / WIDTH * each + i][from % WIDTH][to] = ritz.vectors[(from, column)];
            }
            for (from, x) in self.last_row(&ritz.vectors, column).into_iter().enumerate() {
                c[last * each + i][from][to] = x / ritz.values[column];
            }
        }
        let mut vectors = vec![vec![ZERO; self.n]; each];
        let mut targets: Vec<&mut [Row]> = vectors.iter_mut().map(|x| &mut x[..]).collect();
        dispatch::update(&blocks, &c, &mut targets);
        vectors
    }
}

fn norm_of(block: &[Row], column: usize) -> f64 {
    block.iter().map(|row| row[column] * row[column]).sum::<f64>().sqrt()
}

/// Uniform in [−½, ½).
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}
