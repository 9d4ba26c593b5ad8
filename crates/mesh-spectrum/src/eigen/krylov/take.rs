//! Taking off a block what it has in common with the basis: with the blocks next to it, or with all of them.

use super::{Krylov, LOSS_MAX, dot};
use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH, add, largest, negative, product, transpose};
use crate::eigen::parts::{self, gram_of};

/// What is foreseen of a loss, beside the length of the block, if it is not to be taken off: a step multiplies it by up to
/// 200, and it is known.
const LEAVE: f64 = 1e-9;

/// What a block may have in common with the basis beside its length, if taking it off once is to be enough.
const ONE_PASS: f64 = 1e-3;

/// Op times a block, with what was taken off it.
pub(super) struct Product {
    pub(super) alpha: Small,
    /// WᵀW.
    pub(super) square: Small,
    /// The length of its longest column before all was taken off that the square allows for.
    pub(super) taken: f64,
    /// What is still to be taken off, along the blocks next to it.
    pub(super) off: Vec<Small>,
    pub(super) whole: Option<Whole>,
}

/// What a pass through the whole basis has shown, for each block of it.
pub(super) struct Whole {
    /// What couples W to X, as far as it was foreseen: in the first two steps.
    pub(super) along: Vec<Small>,
    /// What W had in common with the basis beyond what was foreseen.
    pub(super) found: Vec<Small>,
    /// The part of it that stays.
    pub(super) left: Vec<Small>,
    /// What the block multiplied has in common with those before it, if that was measured.
    pub(super) of_last: Option<Vec<Row>>,
}

impl Krylov<'_> {
    /// Takes off W = Op Q_j what it has in common with the two blocks before it and with those nearest to the shift.
    pub(super) fn take_near(&self, w: &mut [Row]) -> Product {
        let (n, last) = (self.n, self.basis.len() - 1);
        let next_to = self.next_to();
        let mut c = vec![SMALL_ZERO; next_to.len() + 1];
        let back = transpose(&self.coupling);
        let before: &[&[Row]] = if self.steps > 0 { &[&self.basis[last - 1][..n]] } else { &[] };
        parts::recur(self.tools.kind, before, &[back], &mut w[..n], &next_to, None, &mut c);
        let mut square = c.pop().unwrap_or(SMALL_ZERO);
        let taken = (0..WIDTH).map(|a| square[a][a].sqrt()).fold(0.0, f64::max);
        let before = c[0];
        let mut alpha = before;
        add(&mut alpha, &negative(&product(&self.rounding, &before))); // (QᵀQ)⁻¹ QᵀW
        c[0] = alpha;
        // What is left has a part of the square, as Pythagoras has it; the nearest are as good as orthonormal, for there
        // is next to nothing along them.
        add(&mut square, &negative(&product(&transpose(&before), &alpha)));
        c[1..].iter().for_each(|c| add(&mut square, &negative(&product(&transpose(c), c))));
        Product { alpha, square, taken, off: c, whole: None }
    }

    /// Takes off W = Op Q_j what is known to be in it along the whole basis, and measures what is left, in one pass.
    pub(super) fn take_all(&self, w: &mut [Row]) -> Product {
        let (n, kind, last) = (self.n, self.tools.kind, self.basis.len() - 1);
        let blocks: Vec<&[Row]> = self.basis.iter().map(|block| &block[..n]).collect();
        let w = &mut w[..n];
        let mut alpha = gram_of(kind, blocks[last], w);
        let rounding = negative(&product(&self.rounding, &alpha));
        add(&mut alpha, &rounding);
        let mut c = self.loss.foreseen(0..last, &self.projected, &alpha, &transpose(&self.coupling));
        let along = self.kept_along(&alpha);
        c.iter_mut().zip(&along).for_each(|(c, along)| add(c, along));
        if self.steps > 0 {
            add(&mut c[last - 1], &transpose(&self.coupling));
        }
        c.push(alpha);
        // What is foreseen to be next to nothing may stay: it is measured with the rest.
        let bound = LEAVE * (0..WIDTH).map(|a| self.coupling[a][a]).fold(f64::INFINITY, f64::min);
        let (taken, stays): (Vec<usize>, Vec<usize>) = (0..=last).partition(|&k| largest(&[c[k]]) > bound);
        let off: Vec<Small> = taken.iter().map(|&k| c[k]).collect();
        let order = [&taken[..], &stays].concat();
        let mut measured: Vec<&[Row]> = order.iter().map(|&k| blocks[k]).collect();
        measured.extend(self.nearest.iter().map(|block| &block[..n]));
        // What the last block has in common with the others is known only if that was measured.
        let both = !self.measured;
        let mut products = vec![SMALL_ZERO; measured.len() * if both { 2 } else { 1 } + 1];
        parts::recur(kind, &measured[..off.len()], &off, w, &measured, both.then_some(blocks[last]), &mut products);
        let of_last = products.split_off(measured.len() + 1);
        let mut square = products.pop().unwrap_or(SMALL_ZERO);
        let mut left = back_in_order(&products, &order);
        let of_last = both.then(|| back_in_order(&of_last, &order)[..last].concat());
        let mut off = vec![left[last]];
        off.extend_from_slice(&left[self.nearest_kept.clone()]);
        off.extend(left.drain(blocks.len()..));
        add(&mut alpha, &left[last]);
        let mut found = left.clone();
        stays.iter().for_each(|&k| add(&mut found[k], &negative(&c[k])));
        left[last] = SMALL_ZERO;
        let mut left = self.loss.deflated(&left);
        for _ in 0..3 {
            let length = (0..WIDTH).map(|a| square[a][a].sqrt()).fold(f64::INFINITY, f64::min);
            let most = largest(&left);
            if most <= LOSS_MAX[0] * length {
                break;
            }
            parts::take_off(kind, &self.next_to(), &off, &mut [&mut *w]);
            off.fill(SMALL_ZERO);
            parts::take_off(kind, &blocks, &left, &mut [&mut *w]);
            add(&mut alpha, &left[last]);
            if most < ONE_PASS * length {
                left.fill(SMALL_ZERO);
                break;
            }
            parts::gram(kind, &blocks, &[&*w], &mut left);
            square = gram_of(kind, w, w);
        }
        Product { alpha, square, taken: 0.0, off, whole: Some(Whole { along, found, left, of_last }) }
    }

    /// What Op Q_j has in common with X, to which the first two blocks are coupled.
    fn kept_along(&self, alpha: &Small) -> Vec<Small> {
        let row = |k: usize| -> Row {
            match self.steps {
                0 => std::array::from_fn(|a| self.start[k].g[a] + self.moved * dot(&alpha[a], &self.start[k].g)),
                _ => std::array::from_fn(|a| self.projected.row(k)[self.kept + WIDTH + a]),
            }
        };
        let blocks = if self.steps < 2 { self.kept / WIDTH } else { 0 };
        (0..blocks).map(|block| std::array::from_fn(|a| row(WIDTH * block + a))).collect()
    }
}

/// Products that were computed in another order of the blocks; those after them stay where they are.
fn back_in_order(products: &[Small], order: &[usize]) -> Vec<Small> {
    let mut ordered = products.to_vec();
    order.iter().zip(products).for_each(|(&k, product)| ordered[k] = *product);
    ordered
}
