//! One connected component as a standard eigenproblem, and all its pairs below a given value.
//!
//! The mass is scaled out: A = M^-½ L M^-½, A v = λ v, φ = M^-½ v. Then M-products are plain dot products,
//! ‖L φ − λ M φ‖ in the M⁻¹ norm is ‖A v − λ v‖, and Φᵀ M Φ = Vᵀ V. The null vector is known: M^½ 1.

use faer::{Mat, Side};
use rayon::prelude::*;

use crate::eigen::assemble::{assemble, check_counts};
use crate::eigen::factor::{Factor, Symbolic, elimination_order, permuted};
use crate::eigen::slice::{Demand, Slice, Trouble, norm, slice};
use crate::eigen::weyl::Weyl;
use crate::eigen::{EigenError, Progress};
use crate::operator::{Csr, Operator};

/// Pairs on either side of a shift. Fewer: more factorisations; more: larger spaces. Between 25 and 40 the time is flat.
const PAIRS_A_SIDE: usize = 28;

/// Up to this size the dense solver is used: a slice solves a projected problem of 250 to 300 itself.
pub(crate) const DENSE_BELOW: usize = 400;

/// Where more than this share of all pairs is wanted, the dense solver finds all. The upper end of the spectrum is no
/// place for slices: there is nothing on one side, and Weyl's law does not hold.
pub(crate) const DENSE_SHARE: f64 = 0.9;

/// Pairs that neighbouring slices both find, a side, so that they check each other and the border can be put into the
/// widest gap. Doubled at each new attempt.
const OVERLAP: usize = 2;

/// The largest |L| and the smallest |D| (in mean spacings of eigenvalues) a shift is used with: above and below, the
/// solve loses digits (measured: 10 % of the shifts are moved).
const GROWTH_MAX: f64 = 1e4;
const PIVOT_MIN: f64 = 5e-3;

/// Factors are kept from the count to the slice up to this size (about 50 MB each at most); beyond, memory is dearer
/// than a second factorisation, a tenth of a slice's time.
const KEEP_FACTORS_UP_TO: usize = 100_000;

/// A connected component of the operator.
pub(crate) struct Component {
    /// A / `unit`, in elimination order when the component is solved in slices.
    pub(crate) matrix: Csr,
    /// A power of two near ‖A‖, 1/ℓ²: a model in metres or micrometres is solved with the same bits.
    pub(crate) unit: f64,
    /// Degree of freedom (of the operator) of each row.
    pub(crate) dofs: Vec<u32>,
    /// M^½ of each row, ℓ.
    pub(crate) root_mass: Vec<f64>,
    /// Sum of the mass, ℓ².
    pub(crate) area: f64,
    /// Gershgorin's bound of the largest eigenvalue, 1/ℓ².
    pub(crate) norm: f64,
    symbolic: Option<Symbolic>,
}

/// Where a slice is, and the eigenvalues below.
struct Shift {
    at: f64,
    below: usize,
    factor: Option<Factor>,
}

/// The lowest pairs of a component.
pub(crate) struct Pairs {
    /// Ascending; the first is exactly 0.
    pub(crate) eigenvalues: Vec<f64>,
    /// One vector v after another, each with as many entries as the component has rows.
    pub(crate) vectors: Vec<f64>,
    /// Shifts, 1/ℓ², with the eigenvalues found below them and those counted by inertia.
    pub(crate) counts: Vec<(f64, usize, usize)>,
    pub(crate) dense: bool,
}

impl Component {
    /// Takes the component's rows out of the operator. `dofs` ascending.
    pub(crate) fn new(operator: &Operator, dofs: Vec<u32>, place_of_dof: &[u32]) -> Result<Component, EigenError> {
        let root_mass: Vec<f64> = dofs.iter().map(|&dof| operator.mass[dof as usize].sqrt()).collect();
        let mut matrix = Csr { start: vec![0], columns: Vec::new(), values: Vec::new() };
        for (i, &dof) in dofs.iter().enumerate() {
            for (column, value) in operator.stiffness.row(dof as usize) {
                let j = place_of_dof[column];
                matrix.columns.push(j);
                matrix.values.push(value / (root_mass[i] * root_mass[j as usize]));
            }
            matrix.start.push(matrix.columns.len());
        }
        let norm = norm(&matrix);
        if !(norm.is_normal() && (1.0 / norm).is_normal()) {
            let row = (0..dofs.len()).find(|&row| !matrix.row(row).all(|(_, value)| value.is_finite())).unwrap_or(0);
            return Err(EigenError::NotFinite { dof: dofs[row] as usize });
        }
        let unit = norm.log2().round().clamp(-1000.0, 1000.0).exp2();
        matrix.values.iter_mut().for_each(|value| *value /= unit);
        let area = dofs.iter().map(|&dof| operator.mass[dof as usize]).sum();
        Ok(Component { norm, unit, matrix, dofs, root_mass, area, symbolic: None })
    }

    /// Puts the rows in elimination order and prepares the factorisation.
    pub(crate) fn prepare(&mut self) -> Result<(), EigenError> {
        let order = elimination_order(&self.matrix)?;
        self.matrix = permuted(&self.matrix, &order);
        self.dofs = order.iter().map(|&row| self.dofs[row as usize]).collect();
        self.root_mass = order.iter().map(|&row| self.root_mass[row as usize]).collect();
        self.symbolic = Some(Symbolic::new(&self.matrix)?);
        Ok(())
    }

    pub(crate) fn rows(&self) -> usize {
        self.dofs.len()
    }

    /// Eigenvalues below a shift (1/ℓ²), by inertia; `None` if the shift is on one of them, to rounding. The component
    /// must be prepared.
    pub(crate) fn count_below(&self, shift: f64) -> Option<usize> {
        let shift = shift / self.unit;
        self.factor(shift).filter(|factor| factor.pivot_min > 1e-9 * shift).map(|factor| factor.below)
    }

    /// Factors A − σI, both in `unit`.
    fn factor(&self, shift: f64) -> Option<Factor> {
        self.symbolic.as_ref().expect("prepared").factor(shift)
    }

    /// Factors at a shift near the one given: moved up by 0.37 spacings while the factor is of poor quality.
    fn factor_near(&self, shift: f64, spacing: f64) -> Option<Factor> {
        let mut best: Option<Factor> = None;
        for nudge in 0..4 {
            let Some(factor) = self.factor(shift + 0.37 * spacing * nudge as f64) else {
                continue;
            };
            let good = factor.growth < GROWTH_MAX && factor.pivot_min > PIVOT_MIN * spacing;
            if best.as_ref().is_none_or(|best| factor.growth / factor.pivot_min < best.growth / best.pivot_min) {
                best = Some(factor);
            }
            if good {
                break;
            }
        }
        best
    }

    /// The null vector v = M^½ 1, normalised.
    pub(crate) fn null_vector(&self) -> Vec<f64> {
        let scale = 1.0 / self.area.sqrt();
        self.root_mass.iter().map(|root| root * scale).collect()
    }

    /// All pairs, through the dense solver. Time O(n³), memory 24 n² bytes.
    pub(crate) fn solve_dense(&self) -> Result<Pairs, EigenError> {
        let n = self.rows();
        let mut a = Mat::<f64>::zeros(n, n);
        for i in 0..n {
            self.matrix.row(i).for_each(|(j, value)| a[(i, j)] = value);
        }
        let pairs = a.self_adjoint_eigen(Side::Lower).map_err(|_| EigenError::NotConverged {
            found: 0,
            wanted: n,
            detail: "the dense solver did not converge".into(),
        })?;
        let vectors = pairs.U();
        Ok(Pairs {
            eigenvalues: pairs.S().column_vector().iter().map(|e| e * self.unit).collect(),
            vectors: (0..n).flat_map(|k| (0..n).map(move |i| vectors[(i, k)])).collect(),
            counts: Vec::new(),
            dense: true,
        })
    }

    /// The `count` pairs below `top` (1/ℓ²), known by inertia to be so many, in slices.
    pub(crate) fn solve_sliced(
        &self,
        top: f64,
        count: usize,
        tolerance: f64,
        seed: u64,
        progress: &Progress,
    ) -> Result<Pairs, EigenError> {
        if count == 1 {
            let counts = vec![(top, 1, 1)];
            progress.add(1);
            return Ok(Pairs { eigenvalues: vec![0.0], vectors: self.null_vector(), counts, dense: false });
        }
        let mut detail = String::new();
        for attempt in 0..4 {
            match self.attempt(top / self.unit, count, tolerance, mix(seed, attempt), attempt as usize, progress) {
                Ok(mut pairs) => {
                    pairs.eigenvalues.iter_mut().for_each(|e| *e *= self.unit);
                    pairs.counts.iter_mut().for_each(|(shift, ..)| *shift *= self.unit);
                    return Ok(pairs);
                }
                Err(Trouble::Fatal(error)) => return Err(error),
                Err(Trouble::Again(seen)) => detail = seen,
            }
        }
        Err(EigenError::NotConverged { found: 0, wanted: count, detail })
    }

    /// One attempt, everything in `unit`.
    fn attempt(
        &self,
        top: f64,
        count: usize,
        tolerance: f64,
        seed: u64,
        attempt: usize,
        progress: &Progress,
    ) -> Result<Pairs, Trouble> {
        let shifts = self.shifts(top, count, attempt, progress)?;
        let mut counts: Vec<(f64, usize)> = shifts.iter().map(|shift| (shift.at, shift.below)).collect();
        let last = shifts.len() - 1;
        let overlap = OVERLAP << attempt;
        let half = |between: usize| (between.div_ceil(2) + overlap).min(between);
        let slices: Vec<Slice> = shifts
            .into_par_iter()
            .enumerate()
            .map(|(i, shift)| {
                if progress.stopped() {
                    return Err(Trouble::Fatal(EigenError::Stopped));
                }
                let left = if i == 0 { counts[0].1 } else { half(counts[i].1 - counts[i - 1].1) };
                let right = if i == last { count - counts[last].1 } else { half(counts[i + 1].1 - counts[i].1) };
                let seed = mix(seed, 100 + i as u64);
                let out_of_memory = || Trouble::Fatal(EigenError::OutOfMemory { dofs: self.rows() }); // it could be factored before
                let factor = shift.factor.or_else(|| self.factor(shift.at)).ok_or_else(out_of_memory)?;
                slice(&self.matrix, &factor, Demand { left, right, top, tolerance, seed }, progress)
            })
            .collect::<Result<_, Trouble>>()?;
        counts.push((top, count));
        let (eigenvalues, vectors) = assemble(slices, top, tolerance)?;
        let counts = check_counts(&eigenvalues, &counts)?;
        Ok(Pairs { eigenvalues, vectors, counts, dense: false })
    }

    /// Chooses shifts so that every slice has about `PAIRS_A_SIDE` pairs on each side, and factors at them. Ascending.
    fn shifts(&self, top: f64, count: usize, attempt: usize, progress: &Progress) -> Result<Vec<Shift>, Trouble> {
        let slices = (count as f64 / (2 * PAIRS_A_SIDE) as f64).round().max(1.0);
        let weyl = Weyl::through(self.area * self.unit, top, count as f64);
        let spacing = top / count as f64;
        let place = |shift: f64| {
            if progress.stopped() {
                return Err(Trouble::Fatal(EigenError::Stopped));
            }
            let shift = (shift + 0.21 * spacing * attempt as f64).min(top);
            let factor = self
                .factor_near(shift, spacing)
                .ok_or_else(|| Trouble::Again(format!("no factorisation near the shift {shift:e}")))?;
            let (at, below) = (factor.shift, factor.below);
            Ok(Shift { at, below, factor: (self.rows() <= KEEP_FACTORS_UP_TO).then_some(factor) })
        };
        let wanted: Vec<f64> =
            (0..slices as usize).map(|i| weyl.inverse((i as f64 + 0.5) * count as f64 / slices)).collect();
        let mut shifts = wanted.into_par_iter().map(place).collect::<Result<Vec<_>, _>>()?;
        for _ in 0..6 {
            shifts.sort_by(|a, b| a.at.total_cmp(&b.at));
            // Where Weyl's law was too far off, halve the interval.
            let mut more = Vec::new();
            for i in 0..=shifts.len() {
                let (low, below) = i.checked_sub(1).map_or((0.0, 0), |i| (shifts[i].at, shifts[i].below));
                let (high, above) = shifts.get(i).map_or((top, count), |shift| (shift.at, shift.below));
                let sides = if i == 0 || i == shifts.len() { 1 } else { 2 };
                if above.saturating_sub(below) > PAIRS_A_SIDE * sides * 17 / 10 && high - low > 1e-5 * top {
                    more.push(0.5 * (low + high));
                }
            }
            if more.is_empty() {
                break;
            }
            shifts.extend(more.into_par_iter().map(place).collect::<Result<Vec<_>, _>>()?);
        }
        shifts.sort_by(|a, b| a.at.total_cmp(&b.at));
        shifts.retain(|shift| shift.at < top && shift.below <= count);
        if shifts.windows(2).any(|pair| pair[0].below > pair[1].below) || shifts.is_empty() {
            return Err(Trouble::Again("inertia counts are not monotone".into()));
        }
        Ok(shifts)
    }
}

/// A new seed for a part of the work (Steele, Lea and Flood 2014: SplitMix).
pub(crate) fn mix(seed: u64, part: u64) -> u64 {
    let mut z = seed.wrapping_add((part + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
