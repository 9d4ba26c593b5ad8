//! The operator projected on a Krylov space: a symmetric matrix, block tridiagonal but for the vectors that the space
//! starts with, and its eigenpairs.

use std::ops::Range;
use std::sync::OnceLock;

use crate::eigen::block::WIDTH;
use crate::eigen::kernel::Kind;
use crate::eigen::tridiagonal::{Decomposed, VectorRows};

/// H, growing by a block at a time.
#[derive(Debug, Default)]
pub(crate) struct Projected {
    /// Columns kept from another space, which couple to each other and to the two blocks after them.
    kept: usize,
    rows: Vec<Vec<f64>>,
}

/// Eigenpairs of H.
pub(crate) struct Ritz {
    /// θ.
    pub(crate) values: Vec<f64>,
    /// What couples each vector to the block that is not yet in H: the residual is its norm.
    pub(crate) couplings: Vec<[f64; WIDTH]>,
    decomposed: Decomposed,
    /// Made when they are wanted.
    vectors: OnceLock<VectorRows>,
}

impl Projected {
    pub(crate) fn new(kept: usize) -> Projected {
        Projected { kept, rows: Vec::new() }
    }

    /// Sets an entry and its mirror image.
    pub(crate) fn set(&mut self, i: usize, j: usize, value: f64) {
        let size = i.max(j) + 1;
        if self.rows.len() < size {
            let size = size.next_multiple_of(WIDTH);
            self.rows.iter_mut().for_each(|row| row.resize(size, 0.0));
            self.rows.resize(size, vec![0.0; size]);
        }
        self.rows[i][j] = value;
        self.rows[j][i] = value;
    }

    /// Adds to an entry and its mirror image.
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f64) {
        self.set(i, j, self.rows[i][j] + value);
    }

    /// One row, as long as the matrix is by now.
    pub(crate) fn row(&self, k: usize) -> &[f64] {
        &self.rows[k]
    }

    /// The columns in which row k can have entries.
    pub(crate) fn coupled_to(&self, k: usize) -> Range<usize> {
        let all_kept = self.kept + 2 * WIDTH;
        let block = k - k % WIDTH;
        let start = if k < all_kept && self.kept > 0 { 0 } else { block.saturating_sub(WIDTH) };
        start..self.rows.len().min(if k < self.kept { all_kept } else { block + 2 * WIDTH })
    }

    /// Eigenpairs of the leading m × m part, the next eight rows being what it is coupled to; `None` if they cannot be
    /// computed (not finite).
    pub(crate) fn ritz(&self, kind: Kind, m: usize) -> Option<Ritz> {
        let decomposed = Decomposed::new(kind, m, |i, j| self.rows[i][j])?;
        let coupled = self.coupled_to(m).start..m;
        let last = decomposed.vector_rows(coupled.clone());
        let coupling = |k: usize, a: usize| coupled.clone().map(|i| self.rows[m + a][i] * last.entry(i, k)).sum();
        let couplings = (0..m).map(|k| std::array::from_fn(|a| coupling(k, a))).collect();
        Some(Ritz { values: decomposed.values.clone(), couplings, decomposed, vectors: OnceLock::new() })
    }
}

impl Ritz {
    /// The coordinates of Ritz vector k.
    pub(crate) fn vector(&self, k: usize) -> impl Iterator<Item = f64> {
        let m = self.values.len();
        let vectors = self.vectors.get_or_init(|| self.decomposed.vector_rows(0..m));
        (0..m).map(move |i| vectors.entry(i, k))
    }

    /// ‖Op x − θ x‖.
    pub(crate) fn residual(&self, k: usize) -> f64 {
        self.couplings[k].iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}
