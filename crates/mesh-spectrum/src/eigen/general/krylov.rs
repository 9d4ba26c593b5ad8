//! All pairs of one interval: shift-invert block Lanczos with B-products and full reorthogonalisation.
//!
//! Op = (A − σB)⁻¹ B is self-adjoint in the B-product. Q's blocks are B-orthonormal, T = Qᵀ B Op Q, T s = θ s,
//! λ = σ + 1/θ, x = Q s + Q₊ R s_last / θ (a free inverse step). How many pairs there must be is known by inertia; the run
//! ends when that many have converged.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par, Side};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::pencil::{Factor, Pencil, times};
use crate::eigen::dense;
use crate::eigen::seconds::{Clock, Step};
use crate::eigen::slice::Trouble;
use crate::eigen::{EigenError, Progress};

/// Columns of a block.
pub(super) const WIDTH: usize = 8;

/// Where pairs are wanted, and how many there are by inertia.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    /// Eigenvalues from here on (−∞ for the first interval).
    pub(super) low: f64,
    /// And below this.
    pub(super) high: f64,
    pub(super) pairs: usize,
    /// The upper end of the whole range.
    pub(super) top: f64,
}

/// The interval's eigenvalues, ascending, and their vectors, B-normalised, one after another.
pub(super) fn solve(
    pencil: &Pencil,
    interval: Interval,
    tolerance: f64,
    seed: u64,
    progress: &Progress,
) -> Result<(Vec<f64>, Vec<f64>), Trouble> {
    let Interval { low, high, pairs, top } = interval;
    if pairs == 0 {
        return Ok((Vec::new(), Vec::new()));
    }
    let n = pencil.rows();
    // In the middle of the interval; the first begins at 0, which is one of the eigenvalues.
    let from = low.max(0.0);
    let shift = 0.5 * (from + high);
    let factor = pencil
        .factor_near(shift, (high - from) / pairs as f64, &progress.clock)
        .ok_or_else(|| Trouble::Again(format!("no factorisation near {shift:e}")))?;
    let mut krylov = Krylov::new(pencil, &factor, &progress.clock, seed);
    let mut next = 90 + 5 * pairs / 2;
    loop {
        progress.go_on()?;
        krylov.step()?;
        let dimension = krylov.dimension();
        let full = dimension + WIDTH > n;
        if dimension < next && !full {
            continue;
        }
        let (values, s) = progress
            .clock
            .time(Step::Project, || krylov.ritz())
            .ok_or_else(|| Trouble::Again("the projected problem did not converge".into()))?;
        let good = |&k: &usize| {
            let (theta, beta) = (values[k].abs(), krylov.residual(&s, k));
            let inside = (low..high).contains(&(factor.shift + 1.0 / values[k]));
            inside && beta <= 10.0 * tolerance * theta && beta <= 0.1 * tolerance * top * theta * theta
        };
        let mut chosen: Vec<usize> = (0..values.len()).filter(good).collect();
        if chosen.len() == pairs {
            chosen.sort_by(|&a, &b| (1.0 / values[a]).total_cmp(&(1.0 / values[b])));
            let eigenvalues = chosen.iter().map(|&k| factor.shift + 1.0 / values[k]).collect();
            let vectors = progress.clock.time(Step::Vectors, || krylov.vectors(&values, &s, &chosen));
            progress.slice(pairs);
            return Ok((eigenvalues, vectors));
        }
        if full || dimension > 400 + 20 * pairs || chosen.len() > pairs {
            let found = chosen.len();
            return Err(Trouble::Again(format!(
                "{found} of {pairs} pairs around the shift {:e} after {dimension} vectors",
                factor.shift
            )));
        }
        next = dimension + (8 + 3 * (pairs - chosen.len())).clamp(16, 64);
    }
}

/// The Krylov space so far.
struct Krylov<'a> {
    pencil: &'a Pencil,
    factor: &'a Factor<'a>,
    clock: &'a Clock,
    /// Q's blocks; the last is not in T yet.
    basis: Vec<Mat<f64>>,
    /// Columns of T: block j has the coefficients of Op Q_j on blocks 0 to j.
    t: Vec<Vec<Mat<f64>>>,
    /// What couples to the last block.
    coupling: Mat<f64>,
    random: ChaCha8Rng,
}

impl<'a> Krylov<'a> {
    fn new(pencil: &'a Pencil, factor: &'a Factor<'a>, clock: &'a Clock, seed: u64) -> Krylov<'a> {
        let coupling = Mat::zeros(WIDTH, WIDTH);
        let random = ChaCha8Rng::seed_from_u64(seed);
        let mut krylov = Krylov { pencil, factor, clock, basis: Vec::new(), t: Vec::new(), coupling, random };
        let start = krylov.noise();
        let (q, _) = krylov.orthonormal(start);
        krylov.basis.push(q);
        krylov
    }

    fn dimension(&self) -> usize {
        WIDTH * self.t.len()
    }

    fn noise(&mut self) -> Mat<f64> {
        let random = &mut self.random;
        Mat::from_fn(self.pencil.rows(), WIDTH, |_, _| (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    }

    /// One more block.
    fn step(&mut self) -> Result<(), Trouble> {
        let mut w = match self.basis.last() {
            Some(last) => times(&self.pencil.b, last),
            None => return Ok(()),
        };
        if !self.clock.time(Step::Solve, || self.factor.solve(w.as_mut())) {
            return Err(EigenError::OutOfMemory { dofs: self.pencil.rows() }.into());
        }
        let clock = self.clock;
        let (column, (q, r)) = clock.time(Step::Orthogonalise, || (self.project_out(&mut w), self.orthonormal(w)));
        self.t.push(column);
        self.basis.push(q);
        self.coupling = r;
        Ok(())
    }

    /// W −= Q Qᵀ B W, twice; returns the coefficients.
    fn project_out(&self, w: &mut Mat<f64>) -> Vec<Mat<f64>> {
        let mut column: Vec<Mat<f64>> = self.basis.iter().map(|_| Mat::zeros(WIDTH, WIDTH)).collect();
        for _ in 0..2 {
            let weighted = times(&self.pencil.b, w);
            for (q, column) in self.basis.iter().zip(&mut column) {
                let mut c = Mat::zeros(WIDTH, WIDTH);
                matmul(c.as_mut(), Accum::Replace, q.transpose(), weighted.as_ref(), 1.0, Par::Seq);
                matmul(w.as_mut(), Accum::Add, q.as_ref(), c.as_ref(), -1.0, Par::Seq);
                *column += c;
            }
        }
        column
    }

    /// W = Q R with Q B-orthonormal and orthogonal to the basis. Directions of W that are rounding are replaced by
    /// random ones, with zeros in R: the space may be exhausted, and the next vectors must come from elsewhere.
    fn orthonormal(&mut self, mut w: Mat<f64>) -> (Mat<f64>, Mat<f64>) {
        let mut r = Mat::<f64>::identity(WIDTH, WIDTH);
        for pass in 0..4 {
            let weighted = times(&self.pencil.b, &w);
            let mut g = Mat::zeros(WIDTH, WIDTH);
            matmul(g.as_mut(), Accum::Replace, w.transpose(), weighted.as_ref(), 1.0, Par::Seq);
            let Ok(eigen) = g.self_adjoint_eigen(Side::Lower) else { break };
            let (u, s) = (eigen.U(), eigen.S().column_vector());
            let most = s[WIDTH - 1];
            // W = (W U s^-½) (s^½ Uᵀ)
            let good: Vec<bool> = (0..WIDTH).map(|k| s[k] > 1e-26 * most && s[k] > f64::MIN_POSITIVE).collect();
            let scale = |k: usize| if good[k] { 1.0 / s[k].sqrt() } else { 0.0 };
            let turn = Mat::from_fn(WIDTH, WIDTH, |i, k| u[(i, k)] * scale(k));
            let back = Mat::from_fn(WIDTH, WIDTH, |k, j| if good[k] { s[k].sqrt() * u[(j, k)] } else { 0.0 });
            w = &w * &turn;
            r = &back * &r;
            if good.contains(&false) {
                let fresh = self.noise();
                for k in (0..WIDTH).filter(|&k| !good[k]) {
                    w.col_mut(k).iter_mut().zip(fresh.col(k).iter()).for_each(|(w, x)| *w = *x);
                }
            }
            let spread = s[0] / most;
            if pass > 0 && spread > 0.5 {
                break;
            }
            // Scaling up amplified what was left along the basis.
            if pass == 0 || spread < 1e-6 {
                self.project_out(&mut w);
            }
        }
        (w, r)
    }

    /// θ and s.
    fn ritz(&self) -> Option<(Vec<f64>, Mat<f64>)> {
        let m = self.dimension();
        let mut t = Mat::<f64>::zeros(m, m);
        for (j, column) in self.t.iter().enumerate() {
            for (i, block) in column.iter().enumerate() {
                for a in 0..WIDTH {
                    for b in 0..WIDTH {
                        let (row, col) = (WIDTH * i + a, WIDTH * j + b);
                        let value = if i == j { 0.5 * (block[(a, b)] + block[(b, a)]) } else { block[(a, b)] };
                        (t[(row, col)], t[(col, row)]) = (value, value);
                    }
                }
            }
        }
        dense::symmetric(&t)
    }

    /// R s_last of one Ritz vector.
    fn tail(&self, s: &Mat<f64>, k: usize) -> [f64; WIDTH] {
        let first = self.dimension() - WIDTH;
        std::array::from_fn(|a| (0..WIDTH).map(|b| self.coupling[(a, b)] * s[(first + b, k)]).sum())
    }

    fn residual(&self, s: &Mat<f64>, k: usize) -> f64 {
        self.tail(s, k).iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// x = Q s + Q₊ R s_last / θ of the pairs chosen, B-normalised.
    fn vectors(&self, values: &[f64], s: &Mat<f64>, chosen: &[usize]) -> Vec<f64> {
        let n = self.pencil.rows();
        let mut x = Mat::<f64>::zeros(n, chosen.len());
        for (block, q) in self.basis.iter().enumerate() {
            let part = Mat::from_fn(WIDTH, chosen.len(), |a, c| {
                let k = chosen[c];
                if block < self.t.len() { s[(WIDTH * block + a, k)] } else { self.tail(s, k)[a] / values[k] }
            });
            matmul(x.as_mut(), Accum::Add, q.as_ref(), part.as_ref(), 1.0, Par::Seq);
        }
        let weighted = times(&self.pencil.b, &x);
        let mut vectors = Vec::with_capacity(n * chosen.len());
        for k in 0..chosen.len() {
            let square: f64 = x.col(k).iter().zip(weighted.col(k).iter()).map(|(x, y)| x * y).sum();
            vectors.extend(x.col(k).iter().map(|x| x / square.sqrt()));
        }
        vectors
    }
}
