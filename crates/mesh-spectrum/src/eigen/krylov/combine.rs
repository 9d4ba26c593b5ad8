//! What is made of a basis: Ritz vectors, and what is left to the next space.

use super::{Handover, Krylov, Origin};
use crate::eigen::EigenError;
use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH};
use crate::eigen::parts;
use crate::eigen::projected::Ritz;
use crate::eigen::seconds::Step;
use crate::eigen::slice::Tools;

impl Krylov<'_> {
    /// Ritz vectors of the chosen columns into blocks of eight, from column `skip` of the first one on (the others are
    /// zero), with one step of inverse iteration that costs no solve: x = B s + Q_{m+1} R s_last / θ is Op B s / θ, so that
    /// the residual (A − λ) x is β (λ − σ)², free of the factor ‖A‖.
    pub(crate) fn vectors(
        &self,
        ritz: &Ritz,
        chosen: &[usize],
        skip: usize,
        into: &mut [&mut [Row]],
    ) -> Result<(), EigenError> {
        self.combine(ritz, chosen, skip, true, into)
    }

    /// Takes off coefficients along so many blocks what the blocks have in common.
    pub(super) fn clear(&self, c: &mut [Small], used: usize) {
        for c in c.chunks_exact_mut(used) {
            for (number, lost) in self.loss.known().iter().enumerate() {
                let Some(own) = c.get(self.kept / WIDTH + number).copied() else { continue };
                for (at, lost) in lost.iter().enumerate() {
                    let row = &mut c[at / WIDTH][at % WIDTH];
                    for a in 0..WIDTH {
                        (0..WIDTH).for_each(|k| row[k] -= lost[a] * own[a][k]);
                    }
                }
            }
        }
    }

    pub(super) fn combine(
        &self,
        ritz: &Ritz,
        chosen: &[usize],
        skip: usize,
        inverse_step: bool,
        into: &mut [&mut [Row]],
    ) -> Result<(), EigenError> {
        let used = self.dimension() / WIDTH + usize::from(inverse_step);
        let mut c = coefficients(ritz, chosen, skip, used);
        if inverse_step {
            for (place, &column) in (skip..).zip(chosen) {
                for (a, x) in ritz.couplings[column].iter().enumerate() {
                    c[place / WIDTH * used + used - 1][a][place % WIDTH] = x / ritz.values[column];
                }
            }
        }
        self.clear(&mut c, used);
        let blocks: Vec<&[Row]> = self.basis[..used].iter().map(|block| &block[..self.n]).collect();
        let Tools { kind, progress, .. } = self.tools;
        parts::combine(kind, &blocks, &c, into, progress)
    }

    /// Ends the space and leaves the chosen Ritz vectors, a multiple of eight, to the next one.
    pub(crate) fn hand_over(mut self, ritz: &Ritz, chosen: &[usize]) -> Result<Handover, EigenError> {
        let Tools { kind, progress, pool, .. } = self.tools;
        let used = self.basis.len();
        let mut c = coefficients(ritz, chosen, 0, used);
        // And the block that comes next, as it is.
        c.resize(c.len() + used - 1, SMALL_ZERO);
        c.push(std::array::from_fn(|a| std::array::from_fn(|k| f64::from(a == k))));
        self.clear(&mut c, used);
        let mut blocks: Vec<&mut [Row]> = self.basis.iter_mut().map(|block| &mut block[..self.n]).collect();
        progress.clock.time(Step::Vectors, || parts::combine_in_place(kind, &mut blocks, &c, progress))?;
        pool.give(self.basis.drain(chosen.len() / WIDTH + 1..));
        let q = self.basis.pop().unwrap_or_else(|| unreachable!("a basis has a block"));
        Ok(Handover {
            x: std::mem::take(&mut self.basis),
            q,
            origin: Origin {
                theta: chosen.iter().map(|&k| ritz.values[k]).collect(),
                s: chosen.iter().map(|&k| ritz.couplings[k]).collect(),
                shift: self.factor.shift,
            },
        })
    }
}

/// The coefficients of Ritz vectors, after `skip` columns of zeros, along so many blocks of a basis, a block's after
/// another's.
fn coefficients(ritz: &Ritz, chosen: &[usize], skip: usize, blocks: usize) -> Vec<Small> {
    let mut c = vec![SMALL_ZERO; blocks * (skip + chosen.len()).div_ceil(WIDTH)];
    for (place, &column) in (skip..).zip(chosen) {
        let (c, to) = (&mut c[place / WIDTH * blocks..][..blocks], place % WIDTH);
        for (from, value) in ritz.vector(column).enumerate() {
            c[from / WIDTH][from % WIDTH][to] = value;
        }
    }
    c
}
