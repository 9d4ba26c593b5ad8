//! One connected component as a pencil (A, B), its factorisations and its dense solution.
//!
//! With D the diagonal of M's row sums, A = D^-½ L D^-½ and B = D^-½ M D^-½: A v = λ B v, φ = D^-½ v. For the consistent
//! mass of linear triangles B's eigenvalues lie between ¼ and 1, so B-products are as good as plain ones.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    self, CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Mat, MatMut, Par, Side};

use super::Pairs;
use crate::eigen::EigenError;
use crate::eigen::chain::{GROWTH_MAX, PIVOT_MIN};
use crate::eigen::dense;
use crate::eigen::seconds::{Clock, Step};
use crate::eigen::weyl::Weyl;
use crate::operator::{Csr, Operator};

/// A connected component.
pub(super) struct Pencil {
    pub(super) a: Csr,
    pub(super) b: Csr,
    /// Degree of freedom (of the operator) of each row.
    pub(super) dofs: Vec<u32>,
    /// D^½, ℓ.
    pub(super) root_mass: Vec<f64>,
    /// Sum of the mass, ℓ².
    pub(super) area: f64,
    symbolic: Option<Symbolic>,
}

/// The upper triangle of A and of B on one pattern, by columns, and the pattern of the factor.
struct Symbolic {
    start: Vec<usize>,
    rows: Vec<usize>,
    a: Vec<f64>,
    b: Vec<f64>,
    cholesky: SymbolicCholesky<usize>,
}

/// L D Lᵀ of A − σB.
pub(super) struct Factor<'a> {
    symbolic: &'a Symbolic,
    values: Vec<f64>,
    pub(super) shift: f64,
    /// Eigenvalues below the shift: negative entries of D (Sylvester).
    pub(super) below: usize,
    /// max |Lᵢⱼ|.
    pub(super) growth: f64,
    /// min |Dᵢ|.
    pub(super) pivot_min: f64,
}

impl Pencil {
    /// The operator's connected components.
    pub(super) fn split(operator: &Operator, mass: &Csr) -> Result<Vec<Pencil>, EigenError> {
        let mut dofs: Vec<Vec<u32>> = vec![Vec::new(); operator.components];
        let mut place = vec![0u32; operator.mass.len()];
        for (dof, &component) in operator.component_of_dof.iter().enumerate() {
            place[dof] = dofs[component as usize].len() as u32;
            dofs[component as usize].push(dof as u32);
        }
        let pencil = |dofs: Vec<u32>| {
            let root_mass: Vec<f64> = dofs.iter().map(|&dof| operator.mass[dof as usize].sqrt()).collect();
            let scaled = |matrix: &Csr| {
                let mut scaled = Csr { start: vec![0], columns: Vec::new(), values: Vec::new() };
                for (i, &dof) in dofs.iter().enumerate() {
                    for (column, value) in matrix.row(dof as usize) {
                        let j = place[column];
                        scaled.columns.push(j);
                        scaled.values.push(value / (root_mass[i] * root_mass[j as usize]));
                    }
                    scaled.start.push(scaled.columns.len());
                }
                scaled
            };
            let (a, b) = (scaled(&operator.stiffness), scaled(mass));
            if let Some(row) = (0..dofs.len()).find(|&row| !a.row(row).chain(b.row(row)).all(|(_, x)| x.is_finite())) {
                return Err(EigenError::NotFinite { dof: dofs[row] as usize });
            }
            let area = dofs.iter().map(|&dof| operator.mass[dof as usize]).sum();
            Ok(Pencil { a, b, dofs, root_mass, area, symbolic: None })
        };
        dofs.into_iter().map(pencil).collect()
    }

    pub(super) fn rows(&self) -> usize {
        self.dofs.len()
    }

    /// An upper bound of the largest eigenvalue: Gershgorin's of A, over the smallest of B, ¼. Where vertices follow several,
    /// B may have smaller ones; no search comes that far up, because a component of which nearly all pairs are wanted is
    /// solved dense.
    pub(super) fn norm(&self) -> f64 {
        4.0 * crate::eigen::slice::norm(&self.a)
    }

    /// The null vector D^½ 1, B-normalised.
    pub(super) fn null_vector(&self) -> Vec<f64> {
        let product = self.b.times(&self.root_mass);
        let square: f64 = self.root_mass.iter().zip(&product).map(|(x, y)| x * y).sum();
        self.root_mass.iter().map(|root| root / square.sqrt()).collect()
    }

    pub(super) fn prepare(&mut self) -> Result<(), EigenError> {
        let n = self.rows();
        let (mut start, mut rows, mut a, mut b) = (vec![0], Vec::new(), Vec::new(), Vec::new());
        for column in 0..n {
            // Symmetric: a row is a column. Both rows ascend.
            let (mut left, mut right) = (self.a.row(column).peekable(), self.b.row(column).peekable());
            loop {
                let next = [left.peek(), right.peek()].into_iter().flatten().map(|entry| entry.0).min();
                let Some(row) = next.filter(|&row| row <= column) else { break };
                rows.push(row);
                a.push(left.next_if(|entry| entry.0 == row).map_or(0.0, |entry| entry.1));
                b.push(right.next_if(|entry| entry.0 == row).map_or(0.0, |entry| entry.1));
            }
            start.push(rows.len());
        }
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &start, None, &rows);
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let ordering = SymmetricOrdering::Amd;
        let cholesky = cholesky::factorize_symbolic_cholesky(pattern, Side::Upper, ordering, parameters)
            .map_err(|_| EigenError::OutOfMemory { dofs: n })?;
        self.symbolic = Some(Symbolic { start, rows, a, b, cholesky });
        Ok(())
    }

    /// Factors A − σB; `None` if a pivot is exactly zero or the result is not finite, or memory is short.
    pub(super) fn factor(&self, shift: f64, clock: &Clock) -> Option<Factor<'_>> {
        let symbolic = self.symbolic.as_ref()?;
        clock.time(Step::Factor, || {
            let values: Vec<f64> = symbolic.a.iter().zip(&symbolic.b).map(|(a, b)| a - shift * b).collect();
            symbolic.factor(&values, shift)
        })
    }

    /// Bytes of the matrices and of what was prepared for the factors.
    pub(super) fn bytes(&self) -> usize {
        let matrices = 12 * (self.a.columns.len() + self.b.columns.len()) + 40 * self.rows();
        matrices
            + self.symbolic.as_ref().map_or(0, |symbolic| 24 * symbolic.rows.len() + 4 * symbolic.cholesky.len_val())
    }

    /// Bytes of one factorisation.
    pub(super) fn factor_bytes(&self) -> usize {
        self.symbolic.as_ref().map_or(0, |symbolic| 8 * symbolic.cholesky.len_val() + 8 * symbolic.rows.len())
    }

    /// Factors B.
    pub(super) fn factor_mass(&self) -> Option<Factor<'_>> {
        let symbolic = self.symbolic.as_ref()?;
        symbolic.factor(&symbolic.b, 0.0)
    }

    /// Factors at a shift near the one given: moved up by 0.37 spacings while the factor is of poor quality.
    pub(super) fn factor_near(&self, shift: f64, spacing: f64, clock: &Clock) -> Option<Factor<'_>> {
        let quality = |factor: &Factor| factor.growth / factor.pivot_min;
        let mut best: Option<Factor> = None;
        for nudge in 0..4 {
            let Some(factor) = self.factor(shift + 0.37 * spacing * f64::from(nudge), clock) else { continue };
            let good = factor.growth < GROWTH_MAX && factor.pivot_min > PIVOT_MIN * spacing;
            if best.as_ref().is_none_or(|best| quality(&factor) < quality(best)) {
                best = Some(factor);
            }
            if good {
                break;
            }
        }
        best
    }

    /// All pairs: with P = G Gᵀ, the eigenvectors y of G⁻¹ Q G⁻ᵀ, v = G⁻ᵀ y. Time O(n³).
    ///
    /// P = B, Q = A gives λ, exact to rounding of the largest eigenvalue. Where that is far above the `wanted`-th, on
    /// meshes with slivers, P = A + sB, Q = B with s near that one gives 1/(λ + s), exact for the lowest.
    pub(super) fn solve_dense(&self, wanted: usize) -> Result<Pairs, EigenError> {
        let n = self.rows();
        let s = Weyl::closed(self.area, None).inverse(wanted as f64);
        let inverse = self.norm() > 1e6 * s;
        let mut c = Mat::<f64>::zeros(n, n);
        let mut p = Mat::<f64>::zeros(n, n);
        for i in 0..n {
            self.a.row(i).for_each(|(j, value)| if inverse { p[(i, j)] += value } else { c[(i, j)] += value });
            self.b.row(i).for_each(|(j, value)| {
                p[(i, j)] += if inverse { s * value } else { value };
                c[(i, j)] += if inverse { value } else { 0.0 };
            });
        }
        let failed = |detail: &str| EigenError::NotConverged { found: 0, wanted, detail: detail.into() };
        let g = p.llt(Side::Lower).map_err(|_| failed("the mass matrix is not positive definite"))?;
        let lower = |x: MatMut<'_, f64>| {
            faer::linalg::triangular_solve::solve_lower_triangular_in_place(g.L(), x, Par::Seq);
        };
        lower(c.as_mut());
        let mut c = c.transpose().to_owned();
        lower(c.as_mut());
        let symmetric = Mat::from_fn(n, n, |i, j| 0.5 * (c[(i, j)] + c[(j, i)]));
        let (theta, mut v) = dense::symmetric(&symmetric).ok_or_else(|| failed("the dense solver did not converge"))?;
        faer::linalg::triangular_solve::solve_upper_triangular_in_place(g.L().transpose(), v.as_mut(), Par::Seq);
        let order: Vec<usize> = if inverse { (0..n).rev().collect() } else { (0..n).collect() };
        let eigenvalue = |&k: &usize| if inverse { 1.0 / theta[k].max(f64::MIN_POSITIVE) - s } else { theta[k] };
        Ok(Pairs {
            eigenvalues: order.iter().map(eigenvalue).collect(),
            vectors: order.iter().flat_map(|&k| v.col(k).iter().copied().collect::<Vec<_>>()).collect(),
            counts: Vec::new(),
            dense: true,
        })
    }
}

impl Symbolic {
    fn factor(&self, values: &[f64], shift: f64) -> Option<Factor<'_>> {
        let n = self.start.len() - 1;
        let SymbolicCholeskyRaw::Supernodal(supernodes) = self.cholesky.raw() else { return None };
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.start, None, &self.rows);
        let mut l = vec![0.0; self.cholesky.len_val()];
        let scratch = self.cholesky.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let mut scratch = MemBuffer::try_new(scratch).ok()?;
        let matrix = SparseColMatRef::new(pattern, values);
        let stack = MemStack::new(&mut scratch);
        let parameters = Default::default();
        self.cholesky
            .factorize_numeric_ldlt(&mut l, matrix, Side::Upper, Default::default(), Par::Seq, stack, parameters)
            .ok()?;
        let (mut below, mut growth, mut pivot_min) = (0, 0.0f64, f64::INFINITY);
        for number in 0..supernodes.n_supernodes() {
            let width = supernodes.supernode_end()[number] - supernodes.supernode_begin()[number];
            let height = width + supernodes.supernode(number).pattern().len();
            let columns = &l[supernodes.col_ptr_for_val()[number]..][..width * height];
            for (j, column) in columns.chunks_exact(height).enumerate() {
                below += usize::from(column[j] < 0.0);
                pivot_min = if column[j].is_nan() { f64::NAN } else { pivot_min.min(column[j].abs()) };
                let most = |most: f64, x: &f64| if x.is_nan() { f64::INFINITY } else { most.max(x.abs()) };
                growth = column[j + 1..].iter().fold(growth, most);
            }
        }
        (growth.is_finite() && pivot_min > 0.0).then_some(Factor {
            symbolic: self,
            values: l,
            shift,
            below,
            growth,
            pivot_min,
        })
    }
}

impl Factor<'_> {
    /// X ← (A − σB)⁻¹ X. False if there is no memory for it.
    pub(super) fn solve(&self, x: MatMut<'_, f64>) -> bool {
        let cholesky = &self.symbolic.cholesky;
        let Ok(mut scratch) = MemBuffer::try_new(cholesky.solve_in_place_scratch::<f64>(x.ncols(), Par::Seq)) else {
            return false;
        };
        let factor = LdltRef::new(cholesky, &self.values[..]);
        factor.solve_in_place_with_conj(Conj::No, x, Par::Seq, MemStack::new(&mut scratch));
        true
    }
}

/// B X of a sparse matrix and columns.
pub(super) fn times(matrix: &Csr, x: &Mat<f64>) -> Mat<f64> {
    let mut y = Mat::zeros(x.nrows(), x.ncols());
    for k in 0..x.ncols() {
        let (from, to) = (x.col(k), y.col_mut(k));
        for (i, to) in to.iter_mut().enumerate() {
            *to = matrix.row(i).map(|(column, value)| value * from[column]).sum();
        }
    }
    y
}
