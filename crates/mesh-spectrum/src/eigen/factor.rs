//! A − σI = L D Lᵀ: the factorisation behind every shift, and its inertia.
//!
//! Sylvester: the number of negative entries of D is the number of eigenvalues below σ, ν(σ) = #{λ < σ}. This is what
//! proves that no pair is missing. The factorisation does not pivot, so the entries of L can grow when σ comes close to
//! an eigenvalue of a leading block; `growth` and `pivot_min` say so, and the caller moves the shift.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{self, SymbolicCholesky, SymbolicCholeskyRaw, supernodal};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side};

use crate::eigen::block::{Block, WIDTH};
use crate::eigen::seconds::Step;
use crate::eigen::solve::{Layout, Packed, Supernode};
use crate::eigen::{EigenError, Progress};
use crate::operator::Csr;

/// The pattern of L, the same for every shift. `matrix` is already in elimination order.
pub(crate) struct Symbolic {
    start: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    /// Where each row's diagonal entry is.
    diagonal: Vec<usize>,
    cholesky: SymbolicCholesky<usize>,
    layout: Arc<Layout>,
    /// Memory of factors that are no longer in use, the library's and ours: to touch new memory is dear.
    unpacked: Mutex<Vec<Vec<f64>>>,
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

impl Symbolic {
    /// # Errors
    /// [`EigenError::OutOfMemory`] if the pattern of L cannot be held.
    pub(crate) fn new(matrix: &Csr) -> Result<Symbolic, EigenError> {
        let n = matrix.rows();
        let start = matrix.start.clone();
        let columns: Vec<usize> = matrix.columns.iter().map(|&column| column as usize).collect();
        let diagonal =
            (0..n).map(|row| start[row] + matrix.row(row).take_while(|&(column, _)| column < row).count()).collect();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &start, None, &columns);
        let parameters = cholesky::CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let cholesky = cholesky::factorize_symbolic_cholesky(
            pattern,
            Side::Upper,
            cholesky::SymmetricOrdering::Identity,
            parameters,
        )
        .map_err(|_| EigenError::OutOfMemory { dofs: n })?;
        let mut symbolic = Symbolic {
            values: matrix.values.clone(),
            start,
            columns,
            diagonal,
            cholesky,
            layout: Arc::new(Layout { supernodes: Vec::new(), rows: Vec::new(), len: 0 }),
            unpacked: Mutex::default(),
            packed: Mutex::default(),
        };
        symbolic.layout = Arc::new(layout(symbolic.supernodes()));
        Ok(symbolic)
    }

    /// Takes back the memory of a factor that is no longer needed.
    pub(crate) fn recycle(&self, factor: Factor) {
        lock(&self.packed).push(factor.packed);
    }

    fn supernodes(&self) -> &supernodal::SymbolicSupernodalCholesky<usize> {
        match self.cholesky.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodes) => supernodes,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("the supernodal kind was asked for"),
        }
    }

    /// Bytes of the pattern.
    pub(crate) fn bytes(&self) -> usize {
        24 * self.values.len() + 24 * self.start.len() + 4 * self.supernodes().len_val()
    }

    /// Bytes of a factor while it is repacked: the library's, ours (a quarter larger, as groups are filled up), and a
    /// copy of the matrix.
    pub(crate) fn factor_bytes(&self) -> usize {
        18 * self.supernodes().len_val() + 8 * self.values.len() + 32 * self.start.len()
    }

    /// Factors A − σI; `None` if a pivot is exactly zero or the result is not finite.
    pub(crate) fn factor(&self, shift: f64, progress: &Progress) -> Option<Factor> {
        progress.clock.time(Step::Factor, || self.numeric(shift))
    }

    fn numeric(&self, shift: f64) -> Option<Factor> {
        let n = self.diagonal.len();
        let mut values = self.values.clone();
        for &place in &self.diagonal {
            values[place] -= shift;
        }
        let supernodes = self.supernodes();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.start, None, &self.columns);
        let mut l = lock(&self.unpacked).pop().unwrap_or_else(|| vec![0.0; supernodes.len_val()]);
        let scratch = supernodal::factorize_supernodal_numeric_ldlt_scratch::<usize, f64>(
            supernodes,
            Par::Seq,
            Default::default(),
        );
        let mut scratch = MemBuffer::try_new(scratch).ok()?;
        let stack = MemStack::new(&mut scratch);
        let matrix = SparseColMatRef::new(pattern, &values[..]);
        supernodal::factorize_supernodal_numeric_ldlt(
            &mut l,
            matrix,
            Default::default(),
            supernodes,
            Par::Seq,
            stack,
            Default::default(),
        )
        .ok()?;
        let packed = lock(&self.packed).pop().unwrap_or_else(|| Packed {
            layout: self.layout.clone(),
            values: Block::zeros(self.layout.len),
            inverse: vec![0.0; n],
        });
        let factor = pack(supernodes, &l, shift, packed);
        lock(&self.unpacked).push(l);
        (factor.growth.is_finite() && factor.pivot_min > 0.0).then_some(factor)
    }
}

fn lock<T>(list: &Mutex<T>) -> MutexGuard<'_, T> {
    list.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where our solve wants the entries of the library's supernodes.
fn layout(symbolic: &supernodal::SymbolicSupernodalCholesky<usize>) -> Layout {
    let n = symbolic.nrows();
    let mut supernodes = Vec::with_capacity(symbolic.n_supernodes());
    let (mut len, mut rows) = (0, Vec::new());
    for number in 0..symbolic.n_supernodes() {
        let begin = symbolic.supernode_begin()[number];
        let width = symbolic.supernode_end()[number] - begin;
        let pattern = symbolic.supernode(number).pattern();
        let (blocks, groups) = (width.div_ceil(WIDTH), pattern.len().div_ceil(WIDTH));
        let stride = width.next_multiple_of(4);
        let diagonal = len;
        let below = diagonal + WIDTH * (blocks * (blocks - 1) / 2) + width;
        len = below + groups * stride;
        supernodes.push(Supernode { begin, width, stride, diagonal, below, rows: rows.len(), groups });
        rows.extend(pattern.iter().map(|&row| row as u32));
        rows.resize(supernodes[number].rows + WIDTH * groups, n as u32);
    }
    Layout { supernodes, rows, len }
}

/// Repacks the library's supernodes (column-major, D on the diagonal) for the solve, and reads the inertia off D. What
/// fills up groups is zero from the start and never written to.
fn pack(symbolic: &supernodal::SymbolicSupernodalCholesky<usize>, l: &[f64], shift: f64, mut packed: Packed) -> Factor {
    let layout = packed.layout.clone();
    let (values, inverse) = (&mut packed.values[..], &mut packed.inverse);
    let (mut below, mut growth, mut pivot_min) = (0, 0.0f64, f64::INFINITY);
    for (number, s) in layout.supernodes.iter().enumerate() {
        let height = s.width + symbolic.supernode(number).pattern().len();
        let columns = &l[symbolic.col_ptr_for_val()[number]..][..s.width * height];
        for (j, column) in columns.chunks_exact(height).enumerate() {
            let pivot = column[j];
            below += usize::from(pivot < 0.0);
            pivot_min = if pivot.is_nan() { f64::NAN } else { pivot_min.min(pivot.abs()) };
            inverse[s.begin + j] = 1.0 / pivot;
            growth = column[j + 1..].iter().fold(
                growth,
                |most, x| {
                    if x.is_nan() { f64::INFINITY } else { most.max(x.abs()) }
                },
            );
            for (i, &entry) in column.iter().enumerate().take(s.width).skip(j + 1) {
                let group = i / WIDTH;
                values[s.diagonal + WIDTH * (group * (group + 1) / 2) + j][i % WIDTH] = entry;
            }
            for (i, &entry) in column[s.width..].iter().enumerate() {
                values[s.below + i / WIDTH * s.stride + j][i % WIDTH] = entry;
            }
        }
    }
    Factor { shift, below, growth, pivot_min, packed }
}

/// An elimination order with little fill: approximate minimum degree, then a postorder of the elimination tree, so that
/// columns of one supernode are neighbours. Result: position → row.
pub(crate) fn elimination_order(matrix: &Csr) -> Result<Vec<u32>, EigenError> {
    let n = matrix.rows();
    let columns: Vec<usize> = matrix.columns.iter().map(|&column| column as usize).collect();
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &matrix.start, None, &columns);
    let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
    let out_of_memory = || EigenError::OutOfMemory { dofs: n };
    let mut scratch = MemBuffer::try_new(amd::order_scratch::<usize>(n, columns.len())).map_err(|_| out_of_memory())?;
    amd::order(&mut order, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut scratch))
        .map_err(|_| out_of_memory())?;
    let order: Vec<u32> = order.iter().map(|&row| row as u32).collect();
    let parents = elimination_tree(&permuted(matrix, &order));
    Ok(postorder(&parents).iter().map(|&position| order[position as usize]).collect())
}

/// B[i, j] = A[order[i], order[j]].
pub(crate) fn permuted(matrix: &Csr, order: &[u32]) -> Csr {
    let mut position = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        position[old as usize] = new as u32;
    }
    let mut result = Csr {
        start: vec![0],
        columns: Vec::with_capacity(matrix.columns.len()),
        values: Vec::with_capacity(matrix.values.len()),
    };
    for &old in order {
        let mut row: Vec<(u32, f64)> =
            matrix.row(old as usize).map(|(column, value)| (position[column], value)).collect();
        row.sort_unstable_by_key(|entry| entry.0);
        result.columns.extend(row.iter().map(|entry| entry.0));
        result.values.extend(row.iter().map(|entry| entry.1));
        result.start.push(result.columns.len());
    }
    result
}

const NONE: u32 = u32::MAX;

/// Parent of every column in the elimination tree (Liu 1986, with path compression).
fn elimination_tree(matrix: &Csr) -> Vec<u32> {
    let n = matrix.rows();
    let (mut parent, mut ancestor) = (vec![NONE; n], vec![NONE; n]);
    for k in 0..n {
        for (mut i, _) in matrix.row(k).take_while(|&(column, _)| column < k) {
            while i < k {
                let next = std::mem::replace(&mut ancestor[i], k as u32);
                if next == NONE {
                    parent[i] = k as u32;
                    break;
                }
                i = next as usize;
            }
        }
    }
    parent
}

/// Children before parents, the largest subtree last, next to its parent.
fn postorder(parent: &[u32]) -> Vec<u32> {
    let n = parent.len();
    let mut size = vec![1u32; n];
    let mut children = vec![Vec::new(); n];
    let mut stack = Vec::new();
    for i in 0..n {
        match parent[i] {
            NONE => stack.push((i as u32, false)),
            p => {
                size[p as usize] += size[i]; // parents come after their children
                children[p as usize].push(i as u32);
            }
        }
    }
    let mut order = Vec::with_capacity(n);
    while let Some((node, visited)) = stack.pop() {
        if visited {
            order.push(node);
            continue;
        }
        stack.push((node, true));
        let mut below = std::mem::take(&mut children[node as usize]);
        below.sort_by_key(|&child| std::cmp::Reverse(size[child as usize]));
        stack.extend(below.into_iter().map(|child| (child, false)));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::block::{Row, ZERO};
    use crate::eigen::kernel::{self, Kind};

    /// 2 + a diagonal, −1 to the four neighbours on a grid.
    fn grid(side: usize) -> Csr {
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
            let symbolic = Symbolic::new(&matrix).unwrap();
            for k in [0, n / 3, n - 1] {
                let shift = if k == 0 { eigenvalues[0] - 0.1 } else { 0.5 * (eigenvalues[k - 1] + eigenvalues[k]) };
                let factor = symbolic.factor(shift, &Progress::new(&(), 0)).unwrap();
                assert_eq!(factor.below, k);
                let x: Vec<Row> = (0..=n)
                    .map(|i| std::array::from_fn(|c| if i < n { ((i * 31 + c * 7) % 17) as f64 - 8.0 } else { 0.0 }))
                    .collect();
                let mut b = vec![ZERO; n + 1];
                kernel::sparse(Kind::best(), &matrix, &x, &mut b, [1.0, -shift, 0.0]);
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
}
