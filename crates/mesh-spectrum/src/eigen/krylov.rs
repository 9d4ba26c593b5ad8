//! A Krylov space of the inverse around one shift, for the eigenpairs on both sides of it.
//!
//! Op = (A − σI)⁻¹ has the eigenvectors of A, with θ = 1/(λ − σ): the pairs next to the shift become the extreme ones,
//! which a Krylov space finds first. With blocks of b = 8 columns (Grimes, Lewis and Simon 1994):
//!
//! W = Op Q_j − Q_{j−1} R_jᵀ − Q_j α_j,  α_j = Q_jᵀ Op Q_j,  W = Q_{j+1} R_{j+1}.
//!
//! A space may start with Ritz vectors X that another space, at the shift σ₁, was left with (rational Krylov, Ruhe
//! 1994). There Op₁ X = X Θ + Q S; here, at σ₂ and with μ = 1/Θ + σ₁ − σ₂,
//!
//! Op₂ X = X μ⁻¹ + (Q + (σ₂ − σ₁) Op₂ Q) G,  G = S Θ⁻¹ μ⁻¹,
//!
//! so that after one solve, Op₂ Q = X C_x + Q C_q + Q₂ R, the projection of Op₂ on X, Q, Q₂ is known exactly and the
//! recurrence goes on from there.
//!
//! Orthogonality is lost along the eigenvectors next to the shift: there a solve loses most digits, and there Op
//! multiplies most what has been lost. So every block is made orthogonal to the few Ritz vectors nearest to the shift,
//! which are read anyway or cost little, and the whole basis is gone through only every second to fourth block.

use std::ops::Range;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::eigen::EigenError;
use crate::eigen::block::{
    Block, Row, SMALL_ZERO, Small, WIDTH, ZERO, add, cholesky, largest, negative, product, transpose,
};
use crate::eigen::factor::Factor;
use crate::eigen::kernel;
use crate::eigen::loss::{Loss, uniform};
use crate::eigen::parts::{self, gram_of};
use crate::eigen::projected::{Projected, Ritz};
use crate::eigen::seconds::Step;
use crate::eigen::slice::Tools;

/// The loss of orthogonality that a basis is repaired before. What is lost by then goes into the vectors' residuals.
const LOSS_MAX: f64 = 1e-9;

/// A measured loss above this says that the estimate cannot be trusted: from there on every block is orthogonalised.
const LOSS_TRUSTED: f64 = 1e-7;

/// Blocks of Ritz vectors nearest to the shift that every step is made orthogonal to.
const NEAREST: usize = 2;

/// The dimension at which the nearest Ritz vectors of a space that started with random vectors are good to a digit or
/// two, and that at which they are better.
const NEAREST_AT: [usize; 2] = [96, 192];

/// What is left of a block beside what was taken away, if one pass of Gram-Schmidt is to be enough.
const ONE_PASS: f64 = 1e-3;

/// By how much ‖Op‖ may be larger than the Ritz values that a space starts with say.
const UNKNOWN: f64 = 4.0;

/// A block no longer than this share of ‖Op‖ is rounding.
const RANK: f64 = 1e-13;

/// How ill-conditioned a block may be, and how much longer it may have been before the vectors next to it were taken off,
/// if the products known by then are to orthonormalise it: rounding is multiplied by the squares of both.
const CONDITION_MAX: f64 = 50.0;
const TAKEN_MAX: f64 = 30.0;

/// A Krylov space around one shift, growing by a block a step.
pub(crate) struct Krylov<'a> {
    tools: Tools<'a>,
    factor: &'a Factor,
    n: usize,
    /// X, then Q_1 .. Q_{m+1}; n + 1 rows each, the last one scratch.
    basis: Vec<Block>,
    /// Columns of X.
    kept: usize,
    steps: usize,
    projected: Projected,
    /// What the first solve is to be combined with, if there is an X.
    start: Vec<Start>,
    /// What X came with, to be given back should the space be of no use.
    origin: Option<Origin>,
    /// σ₂ − σ₁.
    moved: f64,
    /// R of the last step.
    coupling: Small,
    /// QᵀQ − I of the last block, as far as it is known: rounding, which a step multiplies by the square of its α / R.
    rounding: Small,
    loss: Loss,
    every_step: bool,
    /// Blocks of X nearest to the shift.
    nearest_kept: Range<usize>,
    /// The same, where there is no X: Ritz vectors of this space, and how often they have been formed.
    nearest: Vec<Block>,
    nearest_formed: usize,
    /// A copy of the last block, for the next solve to work in.
    ahead: Option<Block>,
    random: ChaCha8Rng,
    /// The largest |α| so far: an estimate of ‖Op‖ from below.
    scale: f64,
}

/// What is known of a column of X: μ⁻¹ and its column of G.
struct Start {
    value: f64,
    g: [f64; WIDTH],
}

/// What one space leaves to the next: Op X = X Θ + Q S at the shift.
pub(crate) struct Handover {
    x: Vec<Block>,
    q: Block,
    origin: Origin,
}

/// The numbers of a hand-over.
struct Origin {
    theta: Vec<f64>,
    s: Vec<[f64; WIDTH]>,
    shift: f64,
    loss: Loss,
}

impl<'a> Krylov<'a> {
    /// Starts from what another space left, or from eight random vectors. `careful`: orthogonalise at every step.
    pub(crate) fn new(
        tools: Tools<'a>,
        factor: &'a Factor,
        seed: u64,
        handover: Option<Handover>,
        careful: bool,
    ) -> Krylov<'a> {
        let n = tools.matrix.rows();
        let kept = handover.as_ref().map_or(0, |handover| WIDTH * handover.x.len());
        let mut space = Krylov {
            tools,
            factor,
            n,
            basis: Vec::new(),
            kept,
            steps: 0,
            projected: Projected::new(kept),
            start: Vec::new(),
            origin: None,
            moved: 0.0,
            coupling: SMALL_ZERO,
            rounding: SMALL_ZERO,
            loss: Loss::default(),
            every_step: careful,
            nearest_kept: 0..0,
            nearest: Vec::new(),
            nearest_formed: 0,
            ahead: None,
            random: ChaCha8Rng::seed_from_u64(seed),
            scale: 0.0,
        };
        if let Some(Handover { x, q, origin }) = handover {
            space.moved = factor.shift - origin.shift;
            space.start = origin
                .theta
                .iter()
                .zip(&origin.s)
                .map(|(theta, s)| {
                    let value = 1.0 / (1.0 / theta - space.moved);
                    Start { value, g: s.map(|s| s / theta * value) }
                })
                .collect();
            let value = |k: usize| space.start[k].value.abs();
            let closest = (0..kept).max_by(|&a, &b| value(a).total_cmp(&value(b))).unwrap_or(0);
            // The blocks whose middle is next to it.
            let first =
                ((closest + WIDTH / 2) / WIDTH).saturating_sub(NEAREST / 2).min((kept / WIDTH).saturating_sub(NEAREST));
            space.nearest_kept = first..(first + NEAREST).min(kept / WIDTH);
            space.loss = origin.loss.next(WIDTH * space.nearest_kept.start..WIDTH * space.nearest_kept.end);
            space.basis = x;
            space.basis.push(q);
            space.origin = Some(origin);
        } else {
            let mut start = tools.pool.take(n + 1);
            start[..n].iter_mut().for_each(|row| *row = std::array::from_fn(|_| uniform(&mut space.random)));
            let square = gram_of(tools.kind, &start[..n], &start[..n]);
            space.orthonormalise(&mut start, square);
            space.basis.push(start);
        }
        space.loss.repaired(kept, 1.0, &mut space.random);
        space
    }

    /// m: the dimension of the projected problem.
    pub(crate) fn dimension(&self) -> usize {
        if self.steps == 0 { 0 } else { self.kept + WIDTH * self.steps }
    }

    /// Whether solves at this shift lose too many digits, as far as the first steps from random vectors tell.
    pub(crate) fn is_noisy(&self) -> bool {
        self.kept == 0 && self.loss.is_noisy()
    }

    /// The space can grow by another block.
    pub(crate) fn can_grow(&self) -> bool {
        WIDTH * (self.basis.len() + 1) <= self.n
    }

    /// Grows the space by one block.
    ///
    /// # Errors
    /// [`EigenError::Stopped`].
    pub(crate) fn step(&mut self) -> Result<(), EigenError> {
        let (n, kind, last) = (self.n, self.tools.kind, self.basis.len() - 1);
        let clock = &self.tools.progress.clock;
        let mut w = self.ahead.take().unwrap_or_else(|| {
            let mut w = self.tools.pool.take(n + 1);
            w.copy_from_slice(&self.basis[last]);
            w
        });
        clock.time(Step::Solve, || kernel::solve(kind, &self.factor.packed, &mut w));
        let repaired = clock.time(Step::Orthogonalise, || self.recur(w));
        if repaired { self.form_nearest() } else { Ok(()) }
    }

    /// Orthogonalises Op Q_j and takes it into the basis. Result: whether the whole basis was repaired.
    fn recur(&mut self, mut w: Block) -> bool {
        let (n, kind, last) = (self.n, self.tools.kind, self.basis.len() - 1);
        // X is coupled to the first two blocks. Later the three-term recurrence removes all but rounding.
        let coupled = self.kept > 0 && self.steps < 2;
        let (mut alpha, mut square);
        let mut along = Vec::new();
        // What is still to be taken off W, along the blocks next to it.
        let mut off = Vec::new();
        // Rounding of the projection beside that of an inner product.
        let mut rounding = 1.0;
        let mut taken = 0.0;
        if coupled {
            along = self.orthogonalise(&mut w);
            square = gram_of(kind, &w[..n], &w[..n]);
            let most = largest(&along);
            let left = (0..WIDTH).map(|a| square[a][a].sqrt()).fold(f64::INFINITY, f64::min);
            rounding = (most / left).max(1.0);
            if self.every_step || left.is_nan() || left < ONE_PASS * most {
                self.orthogonalise(&mut w).iter().zip(&mut along).for_each(|(again, along)| add(along, again));
                square = gram_of(kind, &w[..n], &w[..n]);
                rounding = 1.0;
            }
            alpha = along[last];
        } else {
            let next_to = self.next_to();
            let mut c = vec![SMALL_ZERO; next_to.len() + 1];
            let back = negative(&transpose(&self.coupling));
            let before: &[&[Row]] = if self.steps > 0 { &[&self.basis[last - 1][..n]] } else { &[] };
            parts::recur(kind, before, &[back], &mut w[..n], &next_to, &mut c);
            square = c.pop().unwrap_or(SMALL_ZERO);
            taken = (0..WIDTH).map(|a| square[a][a].sqrt()).fold(0.0, f64::max);
            alpha = c[0];
            add(&mut alpha, &negative(&product(&self.rounding, &c[0]))); // (QᵀQ)⁻¹ QᵀW
            let before = std::mem::replace(&mut c[0], alpha);
            if self.every_step {
                parts::take_off(kind, &next_to, &c, &mut [&mut w[..n]]);
                add(&mut alpha, &self.orthogonalise(&mut w)[last]);
                square = gram_of(kind, &w[..n], &w[..n]);
            } else {
                // What is left has a part of the square, as Pythagoras has it; the nearest are as good as orthonormal,
                // for there is next to nothing along them.
                add(&mut square, &negative(&product(&transpose(&before), &alpha)));
                c[1..].iter().for_each(|c| add(&mut square, &negative(&product(&transpose(c), c))));
                off = c;
            }
        }
        self.loss.measure(&alpha);
        let turned = transpose(&alpha);
        for a in 0..WIDTH {
            for c in 0..WIDTH {
                alpha[a][c] = 0.5 * (alpha[a][c] + turned[a][c]); // symmetric but for rounding
                self.scale = self.scale.max(alpha[a][c].abs());
            }
        }
        let known = self.normaliser(&square, taken);
        let r = match known {
            Some((r, _)) => r,
            None => {
                if !off.is_empty() {
                    parts::take_off(kind, &self.next_to(), &off, &mut [&mut w[..n]]);
                    square = gram_of(kind, &w[..n], &w[..n]);
                }
                self.orthonormalise(&mut w, square)
            }
        };
        self.project(&along, &alpha, &r);

        // An eigenvalue much closer to the shift than any known: what is lost along its vector cannot be foreseen.
        let value = self.start.iter().fold(0.0f64, |most, start| most.max(start.value.abs()));
        self.every_step |= coupled && self.scale > UNKNOWN * value;

        let before = std::mem::replace(&mut self.coupling, r);
        let columns = WIDTH * self.basis.len();
        let mut due = false;
        if coupled || self.every_step {
            self.loss.repaired(columns, rounding, &mut self.random);
        } else {
            due = self.loss.step(&self.projected, &alpha, &before, &r, &mut self.random) > LOSS_MAX;
        }
        if let Some((_, inverse)) = known {
            let mut ahead = (!due).then(|| self.tools.pool.take(n + 1));
            let next_to = if off.is_empty() { Vec::new() } else { self.next_to() };
            let copy = ahead.as_mut().map(|ahead| &mut ahead[..n]);
            self.rounding = parts::scale(kind, &next_to, &off, &inverse, &mut w[..n], copy);
            (0..WIDTH).for_each(|a| self.rounding[a][a] -= 1.0);
            self.ahead = ahead;
        }
        if due {
            let measured = self.repair(&mut w);
            self.every_step |= measured > LOSS_TRUSTED;
            self.loss.compare(measured);
            self.loss.repaired(columns, 1.0, &mut self.random);
        }
        self.basis.push(w);
        self.steps += 1;
        due
    }

    /// The blocks that every step is made orthogonal to, beside the one before the last: the last, and those nearest to
    /// the shift.
    fn next_to(&self) -> Vec<&[Row]> {
        let mut blocks: Vec<&Block> = self.basis.last().into_iter().collect();
        if !self.every_step {
            blocks.extend(self.basis[self.nearest_kept.clone()].iter().chain(&self.nearest));
        }
        blocks.into_iter().map(|block| &block[..self.n]).collect()
    }

    /// R and R⁻¹ for a block W with Wᵀ W = `square`, of which columns up to `taken` long were the rest, unless that is too
    /// little to orthonormalise it.
    fn normaliser(&self, square: &Small, taken: f64) -> Option<(Small, Small)> {
        let (r, inverse) = cholesky(square)?;
        let (least, most) = ends(&r);
        let good = most > RANK * self.scale && most < CONDITION_MAX * least && taken < TAKEN_MAX * least;
        good.then_some((r, inverse))
    }

    /// Forms the Ritz vectors nearest to the shift, if there is no X to take them from and they are worth it by now.
    fn form_nearest(&mut self) -> Result<(), EigenError> {
        let due = NEAREST_AT.get(self.nearest_formed).is_some_and(|&at| self.dimension() >= at);
        if self.kept > 0 || self.every_step || !due {
            return Ok(());
        }
        let Some(ritz) = self.ritz() else { return Ok(()) };
        self.nearest_formed = NEAREST_AT.iter().filter(|&&at| self.dimension() >= at).count();
        let mut order: Vec<usize> = (0..ritz.values.len()).collect();
        order.sort_by(|&a, &b| ritz.values[b].abs().total_cmp(&ritz.values[a].abs()));
        let chosen = &order[..WIDTH * NEAREST];
        let mut nearest = std::mem::take(&mut self.nearest);
        nearest.resize_with(NEAREST, || self.tools.pool.take(self.n + 1));
        let mut into: Vec<&mut [Row]> = nearest.iter_mut().map(|x| &mut x[..self.n]).collect();
        let combined = self.combine(&ritz, chosen, false, &mut into);
        self.nearest = nearest;
        let column = |&k: &usize| (0..ritz.values.len()).map(|i| ritz.vectors[(i, k)]).collect();
        self.loss.deflate(chosen.iter().map(column).collect());
        combined
    }

    /// Notes what a step has found in the projected operator.
    fn project(&mut self, along: &[Small], alpha: &Small, r: &Small) {
        let at = self.kept + WIDTH * self.steps;
        for a in 0..WIDTH {
            for c in 0..WIDTH {
                self.projected.set(at + a, at + c, alpha[a][c]);
                self.projected.set(at + WIDTH + a, at + c, r[a][c]);
            }
        }
        if self.steps > 0 {
            return;
        }
        let c_x = |i: usize| &along[i / WIDTH][i % WIDTH];
        let dot = |a: &[f64; WIDTH], b: &[f64; WIDTH]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (i, start) in self.start.iter().enumerate() {
            for j in 0..=i {
                let both = dot(c_x(i), &self.start[j].g) + dot(c_x(j), &start.g); // symmetric but for rounding
                self.projected.set(i, j, 0.5 * self.moved * both + if i == j { start.value } else { 0.0 });
            }
            // Qᵀ Op₂ X is known twice.
            let known = |a: usize| start.g[a] + self.moved * dot(&alpha[a], &start.g);
            self.loss.inherit((0..WIDTH).map(|a| (known(a) - c_x(i)[a]).abs()).fold(0.0, f64::max));
            for (a, r) in r.iter().enumerate() {
                self.projected.set(at + a, i, c_x(i)[a]);
                self.projected.set(at + WIDTH + a, i, self.moved * dot(r, &start.g));
            }
        }
    }

    /// W −= B Bᵀ W over the whole basis; returns the coefficients, a block's after another's.
    fn orthogonalise(&self, w: &mut [Row]) -> Vec<Small> {
        let blocks: Vec<&[Row]> = self.basis.iter().map(|block| &block[..self.n]).collect();
        let mut c = vec![SMALL_ZERO; blocks.len()];
        parts::gram(self.tools.kind, &blocks, &[&w[..self.n]], &mut c);
        parts::take_off(self.tools.kind, &blocks, &c, &mut [&mut w[..self.n]]);
        c
    }

    /// Makes the last block and the new one orthogonal to all before them: both, because the recurrence goes on from
    /// both, and together, because the basis is then read once. What they have in common after that is of the square of
    /// what was taken off. Result: the largest inner product there was.
    fn repair(&mut self, w: &mut [Row]) -> f64 {
        let (n, kind) = (self.n, self.tools.kind);
        let Some((last, earlier)) = self.basis.split_last_mut() else { return 0.0 };
        let blocks: Vec<&[Row]> = earlier.iter().map(|block| &block[..n]).collect();
        let mut c = vec![SMALL_ZERO; 2 * blocks.len()];
        parts::gram(kind, &blocks, &[&last[..n], &w[..n]], &mut c);
        parts::take_off(kind, &blocks, &c, &mut [&mut last[..n], &mut w[..n]]);
        largest(&c)
    }

    /// W = Q R with R upper triangular; W becomes Q. `square` is Wᵀ W. Cholesky of it, again while R is ill-conditioned
    /// (the loss of orthogonality is 1e-16 times the square of its condition); columns one by one if W has lost rank.
    fn orthonormalise(&mut self, w: &mut Block, mut square: Small) -> Small {
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

    /// Eigenpairs of the projected operator; `None` if they cannot be computed (not finite).
    pub(crate) fn ritz(&self) -> Option<Ritz> {
        self.tools.progress.clock.time(Step::Project, || self.projected.ritz(self.dimension()))
    }

    /// Ritz vectors of the chosen columns into blocks of eight (the last one filled up with zeros), with one step of
    /// inverse iteration that costs no solve: x = B s + Q_{m+1} R s_last / θ is Op B s / θ, so that the residual
    /// (A − λ) x is β (λ − σ)², free of the factor ‖A‖.
    pub(crate) fn vectors(&self, ritz: &Ritz, chosen: &[usize], into: &mut [&mut [Row]]) -> Result<(), EigenError> {
        self.combine(ritz, chosen, true, into)
    }

    fn combine(
        &self,
        ritz: &Ritz,
        chosen: &[usize],
        inverse_step: bool,
        into: &mut [&mut [Row]],
    ) -> Result<(), EigenError> {
        let used = self.dimension() / WIDTH + usize::from(inverse_step);
        let mut c = coefficients(ritz, chosen, used);
        if inverse_step {
            for (place, &column) in chosen.iter().enumerate() {
                for (a, x) in ritz.couplings[column].iter().enumerate() {
                    c[place / WIDTH * used + used - 1][a][place % WIDTH] = x / ritz.values[column];
                }
            }
        }
        let blocks: Vec<&[Row]> = self.basis[..used].iter().map(|block| &block[..self.n]).collect();
        let Tools { kind, progress, .. } = self.tools;
        progress.clock.time(Step::Vectors, || parts::combine(kind, &blocks, &c, into, progress))
    }

    /// Ends the space and leaves the chosen Ritz vectors, a multiple of eight, to the next one.
    pub(crate) fn hand_over(mut self, ritz: &Ritz, chosen: &[usize]) -> Result<Handover, EigenError> {
        let Tools { kind, progress, pool, .. } = self.tools;
        let q = self.basis.pop().unwrap_or_else(|| unreachable!("a basis has a block"));
        let c = coefficients(ritz, chosen, self.basis.len());
        let mut blocks: Vec<&mut [Row]> = self.basis.iter_mut().map(|block| &mut block[..self.n]).collect();
        progress.clock.time(Step::Vectors, || parts::combine_in_place(kind, &mut blocks, &c, progress))?;
        pool.give(self.basis.drain(chosen.len() / WIDTH..));
        Ok(Handover {
            x: std::mem::take(&mut self.basis),
            q,
            origin: Origin {
                theta: chosen.iter().map(|&k| ritz.values[k]).collect(),
                s: chosen.iter().map(|&k| ritz.couplings[k]).collect(),
                shift: self.factor.shift,
                loss: std::mem::take(&mut self.loss),
            },
        })
    }

    /// What the space started with, for another try: no step has changed it.
    pub(crate) fn give_back(mut self) -> Option<Handover> {
        let origin = self.origin.take()?;
        let mut x: Vec<Block> = self.basis.drain(..=self.kept / WIDTH).collect();
        let q = x.pop()?;
        Some(Handover { x, q, origin })
    }
}

/// The coefficients of Ritz vectors along so many blocks of a basis, a block's after another's.
fn coefficients(ritz: &Ritz, chosen: &[usize], blocks: usize) -> Vec<Small> {
    let mut c = vec![SMALL_ZERO; blocks * chosen.len().div_ceil(WIDTH)];
    for (place, &column) in chosen.iter().enumerate() {
        let (c, to) = (&mut c[place / WIDTH * blocks..][..blocks], place % WIDTH);
        for (from, value) in ritz.vectors.col(column).iter().enumerate() {
            c[from / WIDTH][from % WIDTH][to] = *value;
        }
    }
    c
}

/// The least and the largest diagonal entry.
fn ends(r: &Small) -> (f64, f64) {
    (0..WIDTH).fold((f64::INFINITY, 0.0f64), |(least, most), i| (least.min(r[i][i]), most.max(r[i][i])))
}

impl Drop for Krylov<'_> {
    fn drop(&mut self) {
        self.tools.pool.give(self.basis.drain(..).chain(self.nearest.drain(..)).chain(self.ahead.take()));
    }
}

fn norm_of(block: &[Row], column: usize) -> f64 {
    block.iter().map(|row| row[column] * row[column]).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use super::*;
    use crate::eigen::Progress;
    use crate::eigen::block::Pool;
    use crate::eigen::factor::Symbolic;
    use crate::eigen::kernel::Kind;
    use crate::operator::Csr;

    /// A path of `n` vertices: eigenvalues 2 − 2 cos(π (k + ½) / n), nearly.
    fn path(n: u32) -> Csr {
        let entries = (0..n).flat_map(|i| {
            let neighbours = [i.checked_sub(1), Some(i + 1).filter(|j| *j < n)];
            let off = neighbours.into_iter().flatten().map(move |j| (i, j, -1.0));
            off.chain([(i, i, 2.0 + 1e-3 * f64::from(i % 7))])
        });
        Csr::from_entries(n as usize, entries.collect())
    }

    #[test]
    fn a_space_is_orthonormal_and_gives_back_what_it_started_with() {
        let matrix = path(1500);
        let (symbolic, pool, levels) =
            (Symbolic::new(&matrix, Kind::best()).unwrap(), Pool::default(), OnceLock::new());
        let progress = Progress::new(&(), 0);
        let factor = |shift: f64| symbolic.factor(&matrix, shift, &progress).unwrap();
        let (first, second) = (factor(0.1003), factor(0.1213));
        let tools = Tools {
            matrix: &matrix,
            levels: &levels,
            pool: &pool,
            kind: Kind::best(),
            progress: &progress,
            top: 0.2,
            tolerance: 1e-10,
            norm: 4.0,
        };
        let mut space = Krylov::new(tools, &first, 1, None, false);
        (0..14).for_each(|_| space.step().unwrap());
        let ritz = space.ritz().unwrap();
        let mut chosen: Vec<usize> = (0..ritz.values.len()).filter(|&k| ritz.values[k] > 0.0).collect();
        chosen.sort_by(|&a, &b| ritz.values[b].total_cmp(&ritz.values[a]));
        let handover = space.hand_over(&ritz, &chosen[..32]).unwrap();
        let before: Vec<Vec<Row>> =
            handover.x.iter().chain([&handover.q]).map(|block| block[..1500].to_vec()).collect();
        let theta = handover.origin.theta.clone();

        let mut space = Krylov::new(tools, &second, 2, Some(handover), false);
        (0..8).for_each(|_| space.step().unwrap());
        for (i, q) in space.basis.iter().enumerate() {
            for (j, p) in space.basis[..=i].iter().enumerate() {
                let mut product = gram_of(tools.kind, &q[..1500], &p[..1500]);
                (0..WIDTH).for_each(|a| product[a][a] -= f64::from(i == j));
                assert!(largest(&[product]) < 1e-8, "blocks {i} and {j}: what repairs keep the loss below, tenfold");
            }
        }
        let back = space.give_back().unwrap();
        let after: Vec<Vec<Row>> = back.x.iter().chain([&back.q]).map(|block| block[..1500].to_vec()).collect();
        assert_eq!(before, after);
        assert_eq!(theta, back.origin.theta);
    }
}
