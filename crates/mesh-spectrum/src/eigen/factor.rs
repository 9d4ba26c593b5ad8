//! A − σI = L D Lᵀ: the factorisation behind every shift, and its inertia.
//!
//! Sylvester: the number of negative entries of D is the number of eigenvalues below σ, ν(σ) = #{λ < σ}. This is what
//! proves that no pair is missing. The factorisation does not pivot, so the entries of L can grow when σ comes close to
//! an eigenvalue of a leading block; `growth` and `pivot_min` say so, and the caller moves the shift.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use faer::Side;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{self, SymbolicCholeskyRaw, supernodal::SymbolicSupernodalCholesky};

use crate::eigen::block::{Block, WIDTH};
use crate::eigen::front::{Tree, Workspace};
use crate::eigen::gram::smaller;
use crate::eigen::kernel::Kind;
use crate::eigen::seconds::Step;
use crate::eigen::solve::{Layout, Packed, Supernode, triangle_lines};
use crate::eigen::{EigenError, Progress};
use crate::operator::Csr;

/// The pattern of L, the same for every shift, of a matrix that is already in elimination order.
pub(crate) struct Symbolic {
    tree: Tree,
    layout: Arc<Layout>,
    kind: Kind,
    /// Memory of factorisations that are no longer in use: to touch new memory is dear.
    workspaces: Mutex<Vec<Workspace>>,
    packed: Mutex<Vec<Packed>>,
}

/// L D Lᵀ of A − σI.
pub(crate) struct Factor {
    pub(crate) shift: f64,
    /// ν(σ): eigenvalues below the shift.
    pub(crate) below: usize,
    /// max |Lᵢⱼ|.
    pub(crate) growth: f64,
    /// min |Dᵢ|.
    pub(crate) pivot_min: f64,
    pub(crate) packed: Packed,
}

/// What is read off D and L while they are computed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pivots {
    /// Negative entries of D.
    pub(crate) negative: usize,
    /// min |Dᵢ|; not a number if one of them is not.
    pub(crate) least: f64,
    /// max |Lᵢⱼ|.
    pub(crate) growth: f64,
}

impl Default for Pivots {
    /// Of nothing.
    fn default() -> Pivots {
        Pivots { negative: 0, least: f64::INFINITY, growth: 0.0 }
    }
}

impl Pivots {
    /// Of two parts of a factor.
    pub(crate) fn and(self, other: Pivots) -> Pivots {
        Pivots {
            negative: self.negative + other.negative,
            least: smaller(self.least, other.least),
            growth: self.growth.max(other.growth),
        }
    }
}

impl Symbolic {
    /// # Errors
    /// [`EigenError::OutOfMemory`] if the pattern of L cannot be held.
    pub(crate) fn new(matrix: &Csr, kind: Kind) -> Result<Symbolic, EigenError> {
        let n = matrix.rows();
        // Not in 32-bit numbers, as for the order: these count the entries of L.
        let columns: Vec<usize> = matrix.columns.iter().map(|&column| column as usize).collect();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &matrix.start, None, &columns);
        let parameters = cholesky::CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let out_of_memory = || EigenError::OutOfMemory { dofs: n };
        let cholesky = cholesky::factorize_symbolic_cholesky(
            pattern,
            Side::Upper,
            cholesky::SymmetricOrdering::Identity,
            parameters,
        )
        .map_err(|_| out_of_memory())?;
        let SymbolicCholeskyRaw::Supernodal(supernodes) = cholesky.raw() else {
            unreachable!("the supernodal kind was asked for")
        };
        let layout = layout(supernodes);
        let tree = Tree::new(matrix, &layout).ok_or_else(out_of_memory)?;
        let (workspaces, packed) = (Mutex::default(), Mutex::default());
        Ok(Symbolic { tree, layout: Arc::new(layout), kind, workspaces, packed })
    }

    #[cfg(test)]
    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Takes back the memory of a factor that is no longer needed.
    pub(crate) fn recycle(&self, factor: Factor) {
        lock(&self.packed).push(factor.packed);
    }

    /// Bytes of the pattern.
    pub(crate) fn bytes(&self) -> usize {
        self.tree.bytes() + 4 * self.layout.rows.len() + 64 * self.layout.supernodes.len()
    }

    /// Bytes of one factor and of what computing it takes.
    pub(crate) fn factor_bytes(&self) -> usize {
        64 * self.layout.len + 8 * self.tree.columns() + self.tree.workspace_bytes()
    }

    /// Factors A − σI, A being the matrix whose pattern this is; `None` if a pivot is exactly zero or the result is not
    /// finite.
    pub(crate) fn factor(&self, matrix: &Csr, shift: f64, progress: &Progress) -> Option<Factor> {
        progress.clock.time(Step::Factor, || {
            let mut packed = lock(&self.packed).pop().unwrap_or_else(|| Packed {
                layout: self.layout.clone(),
                values: Block::lasting(self.layout.len),
                inverse: vec![0.0; self.tree.columns()],
            });
            let mut workspace = lock(&self.workspaces).pop().unwrap_or_else(|| self.tree.workspace());
            let pivots = self.tree.factor(self.kind, matrix, shift, &mut workspace, &mut packed);
            lock(&self.workspaces).push(workspace);
            let Pivots { negative: below, least: pivot_min, growth } = pivots;
            (growth.is_finite() && pivot_min > 0.0).then_some(Factor { shift, below, growth, pivot_min, packed })
        })
    }
}

fn lock<T>(list: &Mutex<T>) -> MutexGuard<'_, T> {
    list.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where the entries of the supernodes go.
fn layout(symbolic: &SymbolicSupernodalCholesky<usize>) -> Layout {
    let n = symbolic.nrows();
    let mut supernodes = Vec::with_capacity(symbolic.n_supernodes());
    let (mut len, mut rows) = (0, Vec::new());
    for number in 0..symbolic.n_supernodes() {
        let begin = symbolic.supernode_begin()[number];
        let width = symbolic.supernode_end()[number] - begin;
        let pattern = symbolic.supernode(number).pattern();
        let groups = pattern.len().div_ceil(WIDTH);
        let mut supernode = Supernode { begin, width, diagonal: len, below: len, rows: rows.len(), groups };
        let last = (width - 1) / WIDTH;
        supernode.below = supernode.diagonal_start(last) + WIDTH * last + triangle_lines(width - WIDTH * last);
        len = supernode.below + groups * width;
        supernodes.push(supernode);
        rows.extend(pattern.iter().map(|&row| row as u32));
        rows.resize(supernodes[number].rows + WIDTH * groups, n as u32);
    }
    Layout { supernodes, rows, len: len + WIDTH }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::eigen::block::{Row, ZERO};
    use crate::eigen::kernel;
    use crate::eigen::order::{elimination_order, permuted};

    /// 2 + a diagonal, −1 to the four neighbours on a grid.
    pub(crate) fn grid(side: usize) -> Csr {
        let mut entries = Vec::new();
        for i in 0..side * side {
            entries.push((i as u32, i as u32, 4.0 + i as f64 / 7.0));
            for j in [i + 1, i + side] {
                if j < side * side && (j != i + 1 || j % side != 0) {
                    entries.extend([(i as u32, j as u32, -1.0), (j as u32, i as u32, -1.0)]);
                }
            }
        }
        Csr::from_entries(side * side, entries)
    }

    #[test]
    fn solve_inverts_and_inertia_counts() {
        for side in [1, 2, 3, 5, 12, 23] {
            let matrix = grid(side);
            let order = elimination_order(&matrix).unwrap();
            let matrix = permuted(&matrix, &order);
            let n = matrix.rows();
            let dense = faer::Mat::from_fn(n, n, |i, j| matrix.row(i).find(|e| e.0 == j).map_or(0.0, |e| e.1));
            let eigenvalues = dense.self_adjoint_eigenvalues(Side::Lower).unwrap();
            let symbolic = Symbolic::new(&matrix, Kind::best()).unwrap();
            for k in [0, n / 3, n - 1] {
                let shift = if k == 0 { eigenvalues[0] - 0.1 } else { 0.5 * (eigenvalues[k - 1] + eigenvalues[k]) };
                let factor = symbolic.factor(&matrix, shift, &Progress::new(&(), 0)).unwrap();
                assert_eq!(factor.below, k);
                let x: Vec<Row> = (0..=n)
                    .map(|i| std::array::from_fn(|c| if i < n { ((i * 31 + c * 7) % 17) as f64 - 8.0 } else { 0.0 }))
                    .collect();
                let mut b = vec![ZERO; n + 1];
                kernel::sparse(Kind::best(), &matrix, &x, &mut b);
                for (b, x) in b.iter_mut().zip(&x[..n]) {
                    (0..WIDTH).for_each(|c| b[c] -= shift * x[c]);
                }
                kernel::solve(Kind::best(), &factor.packed, &mut b);
                let distance = eigenvalues.iter().map(|l| (l - shift).abs()).fold(f64::INFINITY, f64::min);
                for i in 0..n {
                    for c in 0..WIDTH {
                        // Rounding of 1e-16, times growth, times the condition ‖A‖/distance.
                        let tolerance = 1e-14 * factor.growth.max(1.0) * eigenvalues[n - 1] / distance;
                        assert!(
                            (b[i][c] - x[i][c]).abs() < tolerance,
                            "side {side}, row {i}: {} is not {}",
                            b[i][c],
                            x[i][c]
                        );
                    }
                }
            }
        }
    }

    /// A dense matrix is one supernode of as many columns, more than are eliminated together.
    #[test]
    fn wide_supernodes_are_factored_the_same_by_every_kind() {
        for n in [8, 33, 70, 101] {
            let value = |i: usize, j: usize| (((i.min(j) * 37 + i.max(j) * 11) % 29) as f64 - 14.0) / 29.0;
            let entries = (0..n as u32).flat_map(|i| (0..n as u32).map(move |j| (i, j)));
            let diagonal = |i: u32, j: u32| if i == j { 3.0 + i as f64 } else { 0.0 };
            let entries: Vec<(u32, u32, f64)> =
                entries.map(|(i, j)| (i, j, value(i as usize, j as usize) + diagonal(i, j))).collect();
            let matrix = Csr::from_entries(n, entries);
            let dense = faer::Mat::from_fn(n, n, |i, j| matrix.row(i).find(|e| e.0 == j).map_or(0.0, |e| e.1));
            let eigenvalues = dense.self_adjoint_eigenvalues(Side::Lower).unwrap();
            let shift = 0.5 * (eigenvalues[n / 2] + eigenvalues[n / 2 - 1]);
            let solved = |kind: Kind| {
                let symbolic = Symbolic::new(&matrix, kind).unwrap();
                // Twice, because memory is used again.
                let first = symbolic.factor(&matrix, shift + 0.1, &Progress::new(&(), 0)).unwrap();
                symbolic.recycle(first);
                let factor = symbolic.factor(&matrix, shift, &Progress::new(&(), 0)).unwrap();
                assert_eq!(factor.below, n / 2);
                let mut x: Vec<Row> = (0..=n).map(|i| std::array::from_fn(|k| ((i * 7 + k) % 5) as f64)).collect();
                let b = x.clone();
                kernel::solve(kind, &factor.packed, &mut x);
                for (i, b) in b[..n].iter().enumerate() {
                    for k in 0..WIDTH {
                        let product: f64 = matrix.row(i).map(|(j, a)| a * x[j][k]).sum();
                        // Rounding of 1e-16, times growth, times ‖A‖ ‖x‖, below 1e3.
                        assert!((product - shift * x[i][k] - b[k]).abs() < 1e-12 * factor.growth.max(1.0), "{n}: {i}");
                    }
                }
                x
            };
            let portable = solved(Kind::Portable);
            for kind in [Kind::Avx2, Kind::Avx512].into_iter().filter(|kind| kind.is_available()) {
                let fused = solved(kind);
                assert_eq!(fused, solved(Kind::best()), "the fused kinds add in the same order");
                for (a, b) in portable[..n].as_flattened().iter().zip(fused.as_flattened()) {
                    assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} is not {b}");
                }
            }
        }
    }
}
