//! One connected component as a standard eigenproblem, and all its pairs below a given value.
//!
//! The mass is scaled out: A = M^-½ L M^-½, A v = λ v, φ = M^-½ v. Then M-products are plain dot products,
//! ‖L φ − λ M φ‖ in the M⁻¹ norm is ‖A v − λ v‖, and Φᵀ M Φ = Vᵀ V. The null vector is known: M^½ 1.

use std::sync::OnceLock;

use faer::Mat;
use rayon::prelude::*;

use crate::eigen::assemble::{Joined, assemble, check_counts};
use crate::eigen::block::{Block, Pool, Row, WIDTH};
use crate::eigen::chain::{Found, Span, chain, lead, slices_expected};
use crate::eigen::dense;
use crate::eigen::factor::{Factor, Symbolic};
use crate::eigen::kernel::Kind;
use crate::eigen::order::{elimination_order, permuted};
use crate::eigen::output;
use crate::eigen::polish::Levels;
use crate::eigen::slice::{Tools, Trouble, norm};
use crate::eigen::weyl::Weyl;
use crate::eigen::{EigenError, Progress};
use crate::operator::{Csr, Operator};

/// Up to this size the dense solver is used: a slice solves a projected problem of 250 to 300 itself.
pub(crate) const DENSE_BELOW: usize = 400;

/// Where more than this share of all pairs is wanted, the dense solver finds all. The upper end of the spectrum is no
/// place for slices: there is nothing on one side, and Weyl's law does not hold.
pub(crate) const DENSE_SHARE: f64 = 0.9;

/// Pairs of a chain of slices, about. The number of chains decides how many threads can work on slices, and must not
/// depend on how many there are; each chain starts without a hand-over, which costs a tenth of a slice's time.
const PAIRS_A_CHAIN: usize = 250;

/// Pairs that neighbouring chains both find, a side, so that they check each other and the border can be put into the
/// widest gap. Doubled at each new attempt.
const OVERLAP: usize = 2;

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
    levels: OnceLock<Levels>,
}

/// The lowest pairs of a component.
pub(crate) struct Pairs {
    /// Ascending; the first is exactly 0.
    pub(crate) eigenvalues: Vec<f64>,
    /// Blocks of as many rows as the component has, one after another.
    pub(crate) vectors: Block,
    /// Where each pair's vector is: 8 × block + column, ascending. Columns that belong to no pair hold anything finite.
    pub(crate) places: Vec<usize>,
    /// ‖A v − λ v‖ of each vector as it is stored, 1/ℓ², if it has been measured.
    pub(crate) residuals: Option<Vec<f64>>,
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
        Ok(Component { norm, unit, matrix, dofs, root_mass, area, symbolic: None, levels: OnceLock::new() })
    }

    /// Puts the rows in elimination order and prepares the factorisation.
    pub(crate) fn prepare(&mut self, kind: Kind) -> Result<(), EigenError> {
        let order = elimination_order(&self.matrix)?;
        self.matrix = permuted(&self.matrix, &order);
        self.dofs = order.iter().map(|&row| self.dofs[row as usize]).collect();
        self.root_mass = order.iter().map(|&row| self.root_mass[row as usize]).collect();
        self.symbolic = Some(Symbolic::new(&self.matrix, kind)?);
        Ok(())
    }

    pub(crate) fn rows(&self) -> usize {
        self.dofs.len()
    }

    /// Bytes of the matrix and of what was prepared for its factors.
    pub(crate) fn bytes(&self) -> usize {
        let matrix = 12 * self.matrix.columns.len() + 40 * self.rows();
        matrix + Levels::bytes(&self.matrix) + self.symbolic.as_ref().map_or(0, Symbolic::bytes)
    }

    /// Bytes of one factorisation at its largest.
    pub(crate) fn factor_bytes(&self) -> usize {
        self.symbolic.as_ref().map_or(0, Symbolic::factor_bytes)
    }

    /// Eigenvalues below a shift (1/ℓ²), by inertia; `None` if the shift is on one of them, to rounding, or the work
    /// has been stopped. The component must be prepared.
    pub(crate) fn count_below(&self, shift: f64, progress: &Progress) -> Option<usize> {
        progress.go_on().ok()?;
        let shift = shift / self.unit;
        let factor = self.factor(shift, progress)?;
        let below = (factor.pivot_min > 1e-9 * shift).then_some(factor.below);
        self.recycle(factor);
        below
    }

    /// Factors A − σI, both in `unit`.
    fn factor(&self, shift: f64, progress: &Progress) -> Option<Factor> {
        self.symbolic.as_ref().expect("prepared").factor(&self.matrix, shift, progress)
    }

    fn recycle(&self, factor: Factor) {
        self.symbolic.as_ref().expect("prepared").recycle(factor);
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
        let (values, u) = dense::symmetric(&a).ok_or_else(|| EigenError::NotConverged {
            found: 0,
            wanted: n,
            detail: "the dense solver did not converge".into(),
        })?;
        let mut vectors = output::blocks(n, n.div_ceil(WIDTH));
        for (b, block) in vectors.chunks_exact_mut(n).enumerate() {
            for c in 0..WIDTH.min(n - WIDTH * b) {
                block.iter_mut().enumerate().for_each(|(i, row)| row[c] = u[(i, WIDTH * b + c)]);
            }
        }
        Ok(Pairs {
            eigenvalues: values.iter().map(|value| value * self.unit).collect(),
            vectors,
            places: (0..n).collect(),
            residuals: None,
            counts: Vec::new(),
            dense: true,
        })
    }

    /// The `count` pairs below `top` (1/ℓ²), known by inertia to be so many, in slices, with residuals relative to `aim`.
    pub(crate) fn solve_sliced(
        &self,
        (top, aim): (f64, f64),
        count: usize,
        tolerance: f64,
        seed: u64,
        (kind, pool): (Kind, &Pool),
        progress: &Progress,
    ) -> Result<Pairs, EigenError> {
        if count == 1 {
            progress.add(1);
            let (vectors, counts) = (output::blocks(self.rows(), 1), vec![(top, 1, 1)]);
            return Ok(Pairs {
                eigenvalues: vec![0.0],
                vectors,
                places: vec![0],
                residuals: None,
                counts,
                dense: false,
            });
        }
        let mut detail = String::new();
        for attempt in 0..4 {
            let seed = mix(seed, attempt);
            match self.attempt(
                (top / self.unit, aim / self.unit),
                count,
                tolerance,
                (attempt as usize, seed),
                (kind, pool),
                progress,
            ) {
                Ok(mut pairs) => {
                    pairs.eigenvalues.iter_mut().for_each(|e| *e *= self.unit);
                    pairs.residuals.iter_mut().flatten().for_each(|residual| *residual *= self.unit);
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
        (top, aim): (f64, f64),
        count: usize,
        tolerance: f64,
        (attempt, seed): (usize, u64),
        (kind, pool): (Kind, &Pool),
        progress: &Progress,
    ) -> Result<Pairs, Trouble> {
        let symbolic = self.symbolic.as_ref().expect("prepared");
        let weyl = Weyl::closed(self.area * self.unit, Some(self.rows())).through(top, count as f64);
        let spans = self.spans(weyl, top, count, (attempt, seed), progress)?;
        let norm = self.norm / self.unit;
        let tools =
            Tools { matrix: &self.matrix, levels: &self.levels, pool, kind, progress, top, aim, tolerance, norm };

        progress.expect_slices(spans.iter().map(|span| slices_expected(self.rows(), span.end - span.first)).sum());

        let n = self.rows();
        let blocks_of = |span: &Span| (span.end - span.first).div_ceil(WIDTH);
        let mut vectors = output::blocks(n, spans.iter().map(blocks_of).sum());
        let mut blocks: Vec<&mut [Row]> = vectors.chunks_exact_mut(n).collect();
        let (mut shares, mut starts) = (Vec::new(), Vec::new());
        let (mut rest, mut start) = (&mut blocks[..], 0);
        for span in &spans {
            let (own, after) = rest.split_at_mut(blocks_of(span));
            starts.push(start);
            start += WIDTH * own.len();
            shares.push((*span, own));
            rest = after;
        }
        let chains: Vec<Found> = shares
            .into_par_iter()
            .map(|(span, blocks)| chain(&tools, symbolic, weyl, span, blocks))
            .collect::<Result<_, Trouble>>()?;
        let Joined { eigenvalues, places, residuals } = assemble(&chains, &starts, top, tolerance)?;
        let mut counts: Vec<(f64, usize)> = chains.iter().flat_map(|chain| chain.counts.iter().copied()).collect();
        counts.extend(spans.iter().skip(1).map(|span| (span.border, span.border_count)));
        counts.push((top, count));
        counts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let counts = check_counts(&eigenvalues, &counts)?;
        Ok(Pairs { eigenvalues, vectors, places, residuals: Some(residuals), counts, dense: false })
    }

    /// Chains that take about equally long. Where they meet is a value at which the eigenvalues below have been counted.
    fn spans(
        &self,
        weyl: Weyl,
        top: f64,
        count: usize,
        (attempt, seed): (usize, u64),
        progress: &Progress,
    ) -> Result<Vec<Span>, Trouble> {
        let chains = chains(count);
        let lead = lead(self.rows());
        let share = (count as f64 - lead) / chains as f64;
        let borders = (1..chains).into_par_iter().map(|i| {
            let number = lead + share * i as f64 + 0.3 * attempt as f64;
            let mut at = weyl.inverse(number);
            for _ in 0..4 {
                progress.go_on()?;
                if let Some(factor) = self.factor(at, progress) {
                    let (below, growth) = (factor.below, factor.growth);
                    self.recycle(factor);
                    if growth < 1e6 {
                        return Ok((at, below));
                    }
                }
                at += 0.37 * top / count as f64;
            }
            Err(Trouble::Again(format!("no factorisation near the shift {at:e}")))
        });
        let mut borders: Vec<(f64, usize)> = borders.collect::<Result<_, Trouble>>()?;
        // Chains of a few pairs are not worth a start.
        borders.retain(|&(_, below)| below > PAIRS_A_CHAIN / 3 && below + PAIRS_A_CHAIN / 3 < count);
        borders.dedup_by(|b, a| b.1 < a.1 + PAIRS_A_CHAIN / 3);
        let overlap = OVERLAP << attempt;
        let mut spans = Vec::new();
        for i in 0..=borders.len() {
            let (border, border_count) = i.checked_sub(1).map_or((0.0, 0), |i| borders[i]);
            let (high, end) = borders.get(i).copied().unwrap_or((top, count));
            spans.push(Span {
                first: border_count.saturating_sub(overlap),
                end: (end + if i < borders.len() { overlap } else { 0 }).min(count),
                low: border,
                high,
                border,
                border_count,
                seed: mix(seed, 100 + i as u64),
                attempt,
            });
        }
        Ok(spans)
    }
}

/// How many chains find so many pairs.
pub(crate) fn chains(pairs: usize) -> usize {
    (pairs as f64 / PAIRS_A_CHAIN as f64).round().max(1.0) as usize
}

/// A new seed for a part of the work (Steele, Lea and Flood 2014: SplitMix).
pub(crate) fn mix(seed: u64, part: u64) -> u64 {
    let mut z = seed.wrapping_add((part + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
