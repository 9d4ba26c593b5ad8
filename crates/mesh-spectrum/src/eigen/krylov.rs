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
//! which are read anyway or cost little. What it has in common with the rest of the basis, K_j = Bᵀ Q_j, is measured in
//! about every second step, in a pass that takes off at the same time what the block before is known to have left:
//!
//! Bᵀ W = H K_j − K_{j−1} R_jᵀ − K_j α_j.
//!
//! So a loss is not taken off a block when it is found, which would read the basis twice; the next block is freed of what
//! comes of it. And the vectors N_j = Q_j − B K_j are orthonormal to the square of the loss, and obey the recurrence, so
//! that whatever is made of a basis has the coefficients (I − K) s in the place of s. What a pass finds along X beyond
//! that is no loss but what couples X to the block, because what is known of Op X is known only so well: it belongs into
//! the projected operator.

mod combine;
mod normalise;
mod take;

use std::ops::Range;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use self::take::{Product, Whole};
use crate::eigen::EigenError;
use crate::eigen::block::{Block, Row, SMALL_ZERO, Small, WIDTH, ZERO, add, largest, transpose};
use crate::eigen::factor::Factor;
use crate::eigen::kernel;
use crate::eigen::loss::{Loss, times, uniform};
use crate::eigen::parts::{self, gram_of};
use crate::eigen::projected::{Projected, Ritz};
use crate::eigen::seconds::Step;
use crate::eigen::slice::Tools;

/// What the next block may have in common with the basis, if the next step is not to go through it: of what is known,
/// which counts by its square, and of what is not.
const LOSS_MAX: [f64; 2] = [1e-7, 1e-9];

/// Blocks of Ritz vectors nearest to the shift that every block is made orthogonal to.
const NEAREST: usize = 2;

/// The dimension at which the nearest Ritz vectors of a space that started with random vectors are good to a digit or
/// two, and that at which they are better.
const NEAREST_AT: [usize; 2] = [96, 192];

/// By how much ‖Op‖ may be larger than the Ritz values that a space starts with say.
const UNKNOWN: f64 = 4.0;

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
    backward_error: f64,
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
    /// What the last block has in common with all before it is measured, not foreseen.
    measured: bool,
    /// The next step is to go through the whole basis.
    due: bool,
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
}

impl<'a> Krylov<'a> {
    /// Starts from what another space left, or from eight random vectors. `careful`: go through the whole basis at
    /// every step.
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
            backward_error: 0.0,
            projected: Projected::new(kept),
            start: Vec::new(),
            origin: None,
            moved: 0.0,
            coupling: SMALL_ZERO,
            rounding: SMALL_ZERO,
            loss: Loss::new(0, 0..0),
            measured: false,
            due: false,
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
            space.loss = Loss::new(kept, WIDTH * space.nearest_kept.start..WIDTH * space.nearest_kept.end);
            (0..kept).for_each(|k| space.projected.set(k, k, space.start[k].value));
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
        space
    }

    /// m: the dimension of the projected problem.
    pub(crate) fn dimension(&self) -> usize {
        if self.steps == 0 { 0 } else { self.kept + WIDTH * self.steps }
    }

    /// The space can grow by another block.
    pub(crate) fn can_grow(&self) -> bool {
        WIDTH * (self.basis.len() + 1) <= self.n
    }

    /// Grows the space by one block. `last`: what is known of its orthogonality is to be measured, because it may be left
    /// as it is.
    ///
    /// # Errors
    /// [`EigenError::Stopped`].
    pub(crate) fn step(&mut self, last: bool) -> Result<(), EigenError> {
        self.due |= last;
        let (n, kind, last) = (self.n, self.tools.kind, self.basis.len() - 1);
        let clock = &self.tools.progress.clock;
        let mut w = self.ahead.take().unwrap_or_else(|| {
            let mut w = self.tools.pool.take(n + 1);
            w.copy_from_slice(&self.basis[last]);
            w
        });
        clock.time(Step::Solve, || kernel::solve(kind, &self.factor.packed, &mut w));
        if self.steps == 0 {
            self.backward_error = clock.time(Step::Orthogonalise, || self.measure(&w));
        }
        let whole = clock.time(Step::Orthogonalise, || self.recur(w));
        if whole { self.form_nearest() } else { Ok(()) }
    }

    /// max ‖(A − σ) w − q‖ / ‖w‖ for the columns of W = Op Q: the norm of the matrix by which the one that was factored
    /// differs from A.
    fn measure(&self, w: &[Row]) -> f64 {
        let n = self.n;
        let mut product = self.tools.pool.take(n + 1);
        kernel::sparse(self.tools.kind, self.tools.matrix, &w[..n], &mut product[..n]);
        let (mut errors, mut squares) = (ZERO, ZERO);
        for ((product, w), q) in product[..n].iter().zip(w).zip(&self.basis[self.basis.len() - 1][..]) {
            for k in 0..WIDTH {
                let error = product[k] - self.factor.shift * w[k] - q[k];
                errors[k] += error * error;
                squares[k] += w[k] * w[k];
            }
        }
        self.tools.pool.give([product]);
        (0..WIDTH).map(|k| (errors[k] / squares[k]).sqrt()).fold(0.0, f64::max)
    }

    /// What the first solve has shown of the factor: by how much, in norm, it is one of another matrix.
    pub(crate) fn backward_error(&self) -> f64 {
        self.backward_error
    }

    /// Orthogonalises Op Q_j and takes it into the basis. Result: whether the whole basis was gone through.
    fn recur(&mut self, mut w: Block) -> bool {
        let n = self.n;
        let all = (self.kept > 0 && self.steps < 2) || self.every_step || self.due;
        let mut product = if all { self.take_all(&mut w) } else { self.take_near(&mut w) };
        if let (Some(whole), Some(known)) = (&product.whole, self.loss.known().last()) {
            // What the last block has in common with X comes back through what couples it to X.
            for (along, known) in whole.along.as_flattened().iter().zip(known) {
                for (alpha, along) in product.alpha.iter_mut().zip(along) {
                    (0..WIDTH).for_each(|c| alpha[c] -= along * known[c]);
                }
            }
        }
        self.loss.measure(&product.alpha);
        // Symmetric but for rounding.
        let turned = transpose(&product.alpha);
        add(&mut product.alpha, &turned);
        product.alpha.as_flattened_mut().iter_mut().for_each(|x| *x *= 0.5);
        self.scale = self.scale.max(largest(&[product.alpha]));
        let known = self.normaliser(&product.square, product.taken);
        let (r, inverse) = known.unwrap_or_else(|| self.normalise(&mut w, &mut product));
        self.follow(&product, &r, &inverse);

        if known.is_some() {
            let mut ahead = self.tools.pool.take(n + 1);
            let copy = Some(&mut ahead[..n]);
            self.rounding = parts::scale(self.tools.kind, &self.next_to(), &product.off, &inverse, &mut w[..n], copy);
            (0..WIDTH).for_each(|a| self.rounding[a][a] -= 1.0);
            self.ahead = Some(ahead);
        }
        if self.kept > 0 && self.steps < 2 {
            // An eigenvalue much closer to the shift than any known: what is lost along its vector cannot be foreseen.
            let value = self.start.iter().fold(0.0f64, |most, start| most.max(start.value.abs()));
            self.every_step |= self.scale > UNKNOWN * value;
        }
        self.basis.push(w);
        self.steps += 1;
        all
    }

    /// Notes what a step has found, in the projected operator and about the loss of orthogonality.
    fn follow(&mut self, Product { alpha, off, whole, .. }: &Product, r: &Small, inverse: &Small) {
        let before = std::mem::replace(&mut self.coupling, *r);
        let at = self.kept + WIDTH * self.steps;
        // What W has in common with X beyond what was foreseen: a part of Op.
        let mut found = vec![ZERO; if self.kept > 0 { at } else { 0 }];
        match whole {
            Some(Whole { along, found: measured, left, of_last }) => {
                if let Some(of_last) = of_last {
                    let correction = self.loss.correct(of_last);
                    // It was Op that did it, in the step before.
                    for (k, row) in correction.iter().enumerate().take(if self.steps > 0 { self.kept } else { 0 }) {
                        let coupled = times(row, &before);
                        (0..WIDTH).for_each(|a| self.projected.add(k, at - WIDTH + a, coupled[a]));
                    }
                }
                found = self.loss.settle(measured.concat(), left.concat(), &self.projected, alpha, inverse);
                if self.steps == 0 {
                    let along = along.as_flattened().iter().zip(&found);
                    let along: Vec<Row> = along.map(|(along, found)| sum(along, found)).collect();
                    self.project_kept(&along, r);
                    found.clear();
                }
            }
            None => {
                let nearest = self.nearest_kept.clone();
                let foreseen = self.loss.foreseen(nearest.clone(), &self.projected, alpha, &transpose(&before));
                for ((k, off), foreseen) in nearest.zip(&off[1..]).zip(foreseen) {
                    for a in 0..WIDTH {
                        (0..WIDTH).for_each(|c| found[WIDTH * k + a][c] = off[a][c] - foreseen[a][c]);
                    }
                }
                self.loss.step(&self.projected, alpha, &before, inverse, &mut self.random);
            }
        }
        for (k, row) in found.iter().enumerate().take(self.kept) {
            (0..WIDTH).for_each(|a| self.projected.add(k, at + a, row[a]));
        }
        for a in 0..WIDTH {
            for c in 0..WIDTH {
                self.projected.set(at + a, at + c, alpha[a][c]);
                self.projected.set(at + WIDTH + a, at + c, r[a][c]);
            }
        }
        if self.every_step && r.iter().enumerate().any(|(a, row)| row[a] == 0.0) {
            self.loss.clean(); // random vectors in the place of some
        }
        self.measured = whole.is_some();
        self.due = self.loss.is_due(LOSS_MAX, &self.projected, alpha, r, inverse);
    }

    /// The blocks that every step is made orthogonal to, beside the one before the last: the last, and those nearest to
    /// the shift.
    fn next_to(&self) -> Vec<&[Row]> {
        let mut blocks: Vec<&Block> = self.basis.last().into_iter().collect();
        blocks.extend(self.basis[self.nearest_kept.clone()].iter().chain(&self.nearest));
        blocks.into_iter().map(|block| &block[..self.n]).collect()
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
        let clock = &self.tools.progress.clock;
        let combined = clock.time(Step::Vectors, || self.combine(&ritz, chosen, 0, false, &mut into));
        self.nearest = nearest;
        let column = |&k: &usize| ritz.vector(k).collect();
        self.loss.deflate(chosen.iter().map(column).collect());
        combined
    }

    /// The part of the projected operator that X and the first two blocks share, once Xᵀ Op Q is known.
    fn project_kept(&mut self, along: &[Row], r: &Small) {
        let at = self.kept;
        for (i, start) in self.start.iter().enumerate() {
            for j in 0..=i {
                let both = dot(&along[i], &self.start[j].g) + dot(&along[j], &start.g); // symmetric but for rounding
                self.projected.set(i, j, 0.5 * self.moved * both + if i == j { start.value } else { 0.0 });
            }
            for (a, r) in r.iter().enumerate() {
                self.projected.set(at + a, i, along[i][a]);
                self.projected.set(at + WIDTH + a, i, self.moved * dot(r, &start.g));
            }
        }
    }

    /// Eigenpairs of the projected operator; `None` if they cannot be computed (not finite).
    pub(crate) fn ritz(&self) -> Option<Ritz> {
        self.tools.progress.clock.time(Step::Project, || self.projected.ritz(self.tools.kind, self.dimension()))
    }

    /// What the space started with, for another try: no step has changed it.
    pub(crate) fn give_back(mut self) -> Option<Handover> {
        let origin = self.origin.take()?;
        let mut x: Vec<Block> = self.basis.drain(..=self.kept / WIDTH).collect();
        let q = x.pop()?;
        Some(Handover { x, q, origin })
    }
}

impl Drop for Krylov<'_> {
    fn drop(&mut self) {
        self.tools.pool.give(self.basis.drain(..).chain(self.nearest.drain(..)).chain(self.ahead.take()));
    }
}

fn dot(a: &Row, b: &Row) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn sum(a: &Row, b: &Row) -> Row {
    std::array::from_fn(|k| a[k] + b[k])
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
            aim: 0.2,
            tolerance: 1e-10,
            norm: 4.0,
        };
        let mut space = Krylov::new(tools, &first, 1, None, false);
        (0..14).for_each(|_| space.step(false).unwrap());
        let ritz = space.ritz().unwrap();
        let mut chosen: Vec<usize> = (0..ritz.values.len()).filter(|&k| ritz.values[k] > 0.0).collect();
        chosen.sort_by(|&a, &b| ritz.values[b].total_cmp(&ritz.values[a]));
        let handover = space.hand_over(&ritz, &chosen[..32]).unwrap();
        let before: Vec<Vec<Row>> =
            handover.x.iter().chain([&handover.q]).map(|block| block[..1500].to_vec()).collect();
        let theta = handover.origin.theta.clone();

        let mut space = Krylov::new(tools, &second, 2, Some(handover), false);
        (0..8).for_each(|_| space.step(false).unwrap());
        // What the blocks have in common is known, and goes by the coefficients of whatever is made of them.
        let count = space.basis.len();
        let mut c = vec![SMALL_ZERO; count * count];
        (0..count).for_each(|j| (0..WIDTH).for_each(|a| c[j * count + j][a][a] = 1.0));
        space.clear(&mut c, count);
        let blocks: Vec<&[Row]> = space.basis.iter().map(|block| &block[..1500]).collect();
        let mut cleared = vec![vec![ZERO; 1500]; count];
        let mut into: Vec<&mut [Row]> = cleared.iter_mut().map(|block| &mut block[..]).collect();
        parts::combine(tools.kind, &blocks, &c, &mut into, &progress).unwrap();
        let loss = |blocks: &[&[Row]]| {
            let pairs = (0..count).flat_map(|i| (0..=i).map(move |j| (i, j)));
            pairs.fold(0.0, |most: f64, (i, j)| {
                let mut product = gram_of(tools.kind, blocks[i], blocks[j]);
                (0..WIDTH).for_each(|a| product[a][a] -= f64::from(i == j));
                most.max(largest(&[product]))
            })
        };
        assert!(loss(&blocks) < 1e-6, "what is known is kept below 1e-7, by an estimate of the step before");
        assert!(loss(&cleared.iter().map(|block| &block[..]).collect::<Vec<_>>()) < 1e-8, "the noise of a step or two");
        let back = space.give_back().unwrap();
        let after: Vec<Vec<Row>> = back.x.iter().chain([&back.q]).map(|block| block[..1500].to_vec()).collect();
        assert_eq!(before, after);
        assert_eq!(theta, back.origin.theta);
    }
}
