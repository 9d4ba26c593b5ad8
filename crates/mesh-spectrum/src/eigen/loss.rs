//! How far a Krylov basis has lost its orthogonality: what is known of it, and what is not.
//!
//! Exact orthogonality need not be kept: the projected problem is exact to the square of the loss (Simon 1984), and
//! vectors are, if what is known of it is taken into account. Ω_j = Bᵀ Q_j obeys the recurrence of the space itself
//! (Grimes, Lewis and Simon 1994, here for a space that starts with kept vectors, so that H is no longer block
//! tridiagonal):
//!
//! Ω_{j+1} R_{j+1} = H Ω_j − Ω_j α_j − Ω_{j−1} R_jᵀ + F.
//!
//! A pass through the basis measures Ω_j; the recurrence without F follows what of it is left in the blocks (`known`). F is
//! the noise of the solves, of which every pass shows how large it is along each column, and with which the recurrence
//! follows what may have come since (`unknown`). Before the first pass F is taken from α_j = Q_jᵀ Op Q_j, which is
//! symmetric but for it. (With F = 1e-16 ‖Op‖ instead, the estimate was 25 times too low on a mesh of 9,000 vertices and
//! 1,000 times on one of 100,000.)

use std::ops::Range;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::eigen::arithmetic::Plain;
use crate::eigen::block::{Row, SMALL_ZERO, Small, WIDTH, ZERO, add, largest, negative, transpose};
use crate::eigen::kernel::add_scaled;
use crate::eigen::projected::Projected;

/// Rounding of an inner product of unit vectors.
const ROUNDING: f64 = 2e-16;

/// By how much a step multiplies a loss, at most: beside the shift, by 200.
const GROWTH_MAX: f64 = 1e3;

/// The products of each block of a space with every column before it, of which a step needs the last two.
#[derive(Debug)]
struct Omega(Vec<Vec<Row>>);

impl Omega {
    /// Those of the last block.
    fn now(&self) -> &[Row] {
        self.0.last().map_or(&[], |now| now)
    }

    /// Those of the block before it.
    fn before(&self) -> &[Row] {
        self.0.iter().rev().nth(1).map_or(&[], |before| before)
    }

    /// What a step makes of row k, before R.
    fn row(&self, k: usize, projected: &Projected, alpha: &Small, back: &Small) -> Row {
        let (now, before) = (self.now(), self.before());
        let mut sum = ZERO;
        let coupled = projected.coupled_to(k);
        let coupled = coupled.start..coupled.end.min(now.len());
        for (h, omega) in projected.row(k)[coupled.clone()].iter().zip(&now[coupled]) {
            add_scaled::<Plain>(&mut sum, *h, omega);
        }
        for a in 0..WIDTH {
            add_scaled::<Plain>(&mut sum, -now[k][a], &alpha[a]);
            if let Some(before) = before.get(k) {
                add_scaled::<Plain>(&mut sum, -before[a], &back[a]);
            }
        }
        sum
    }

    /// There is nothing, and nothing comes of it.
    fn is_zero(&self) -> bool {
        self.now().iter().chain(self.before()).all(|row| *row == ZERO)
    }
}

/// What the blocks of a space have in common with all before them.
#[derive(Debug)]
pub(crate) struct Loss {
    /// What was measured and left in the blocks, and what has become of it.
    known: Omega,
    /// What may have come since.
    unknown: Omega,
    /// The noise of a solve along each column, as it was measured last.
    fresh: Vec<f64>,
    /// The same before it was measured.
    noise: f64,
    /// Along which combinations of columns every block is orthogonalised: what the noise is largest in.
    deflated: Vec<Vec<f64>>,
    /// What correction of the last block is still to be accounted for.
    correction: Vec<Row>,
    scale: f64,
}

impl Loss {
    /// For a space that starts with so many columns, if any, and a block orthogonal to them, and orthogonalises every
    /// block against some of them.
    pub(crate) fn new(columns: usize, deflated: Range<usize>) -> Loss {
        let unit = |k: usize| (0..=k).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
        let nothing = || Omega(vec![vec![ZERO; columns]]);
        Loss {
            known: nothing(),
            unknown: nothing(),
            fresh: Vec::new(),
            noise: 0.0,
            deflated: deflated.map(unit).collect(),
            correction: Vec::new(),
            scale: 0.0,
        }
    }

    /// What each block after those columns has in common with all before it, as far as known: a row for each column.
    pub(crate) fn known(&self) -> &[Vec<Row>] {
        &self.known.0
    }

    /// Every block is orthogonalised along these combinations of columns from now on.
    pub(crate) fn deflate(&mut self, combinations: Vec<Vec<f64>>) {
        self.deflated = combinations;
    }

    /// Notes the asymmetry of a computed α.
    pub(crate) fn measure(&mut self, alpha: &Small) {
        let mut asymmetry = negative(&transpose(alpha));
        add(&mut asymmetry, alpha);
        let asymmetry = largest(&[asymmetry]);
        // The first blocks are long in the directions that solves lose most in; their noise is soon gone.
        self.noise = (0.3 * self.noise).max(asymmetry);
        self.scale = (0..WIDTH).fold(self.scale, |most, i| most.max(alpha[i][i].abs()));
    }

    /// What Op times the last block has in common with some of the blocks before it, beside what the recurrence takes off.
    pub(crate) fn foreseen(
        &self,
        blocks: Range<usize>,
        projected: &Projected,
        alpha: &Small,
        back: &Small,
    ) -> Vec<Small> {
        blocks.map(|k| std::array::from_fn(|a| self.known.row(WIDTH * k + a, projected, alpha, back))).collect()
    }

    /// Follows a step that did not go through the basis: the α of the block multiplied, the R before it and the inverse of
    /// the one after.
    pub(crate) fn step(
        &mut self,
        projected: &Projected,
        alpha: &Small,
        r_before: &Small,
        inverse: &Small,
        random: &mut ChaCha8Rng,
    ) {
        let back = transpose(r_before);
        let columns = self.known.now().len();
        let mut known: Vec<Row> =
            (0..columns).map(|k| times(&self.known.row(k, projected, alpha, &back), inverse)).collect();
        let nothing = self.unknown.is_zero();
        let mut unknown: Vec<Row> = (0..columns)
            .map(|k| {
                let size = self.fresh.get(k).copied().unwrap_or(self.noise) + ROUNDING * self.scale;
                let mut sum = if nothing { ZERO } else { self.unknown.row(k, projected, alpha, &back) };
                add_scaled::<Plain>(&mut sum, 1.0, &noise(2.0 * size, random));
                times(&sum, inverse)
            })
            .collect();
        for rows in [&mut known, &mut unknown] {
            self.deflate_from(rows);
            rows.extend([ZERO; WIDTH]); // neighbours are orthogonalised explicitly
        }
        self.known.0.push(known);
        self.unknown.0.push(unknown);
    }

    /// What the last block has in common with those before it was measured. Result: what was not known.
    pub(crate) fn correct(&mut self, measured: &[Row]) -> &[Row] {
        let known = self.known.0.last_mut().map_or(&mut [][..], |known| known);
        let difference = |(was, is): (&mut Row, &Row)| {
            let before = std::mem::replace(was, *is);
            std::array::from_fn(|a| is[a] - before[a])
        };
        self.correction = known.iter_mut().zip(measured).map(difference).collect();
        &self.correction
    }

    /// Follows a step that took off all that was foreseen: what it found beyond, and what of that is left in the new
    /// block, before R. Result: what was found without what the correction of the last block explains.
    pub(crate) fn settle(
        &mut self,
        mut found: Vec<Row>,
        left: Vec<Row>,
        projected: &Projected,
        alpha: &Small,
        inverse: &Small,
    ) -> Vec<Row> {
        let columns = self.known.now().len();
        found.truncate(columns);
        let correction = Omega(vec![std::mem::take(&mut self.correction)]);
        if !correction.now().is_empty() {
            for (k, row) in found.iter_mut().enumerate() {
                add_scaled::<Plain>(row, -1.0, &correction.row(k, projected, alpha, &SMALL_ZERO));
            }
        }
        let mut noise = found.clone();
        self.deflate_from(&mut noise);
        self.fresh = noise.iter().map(|row| row.iter().fold(0.0, |most, x| x.abs().max(most))).collect();
        let least = self.fresh.iter().copied().fold(f64::INFINITY, f64::min);
        self.fresh.resize(left.len(), if least.is_finite() { least } else { 0.0 });
        self.unknown.0.push(vec![ZERO; left.len()]);
        self.known.0.push(left.iter().map(|row| times(row, inverse)).collect());
        found
    }

    /// The new block is orthogonal to all before it, whatever was foreseen.
    pub(crate) fn clean(&mut self) {
        for omega in [&mut self.known, &mut self.unknown] {
            omega.0.last_mut().into_iter().for_each(|now| now.fill(ZERO));
        }
    }

    /// Whether more than so much is to be expected after the next step, if that is like the last: of what is known, and of
    /// what is not, the next noise apart.
    pub(crate) fn is_due(
        &self,
        allowed: [f64; 2],
        projected: &Projected,
        alpha: &Small,
        r: &Small,
        inverse: &Small,
    ) -> bool {
        let back = transpose(r);
        [&self.known, &self.unknown].iter().zip(allowed).any(|(omega, allowed)| {
            let largest = |rows: &[Row]| rows.as_flattened().iter().fold(0.0f64, |most, x| most.max(x.abs()));
            if GROWTH_MAX * largest(omega.now()).max(largest(omega.before())) < allowed {
                return false;
            }
            let mut rows: Vec<Row> =
                (0..omega.now().len()).map(|k| times(&omega.row(k, projected, alpha, &back), inverse)).collect();
            self.deflate_from(&mut rows);
            largest(&rows) > allowed
        })
    }

    /// Coefficients along blocks, without what is along those combinations.
    pub(crate) fn deflated(&self, blocks: &[Small]) -> Vec<Small> {
        let mut rows = blocks.concat();
        self.deflate_from(&mut rows);
        rows.as_chunks().0.to_vec()
    }

    fn deflate_from(&self, rows: &mut [Row]) {
        for direction in &self.deflated {
            let mut along = ZERO;
            direction.iter().zip(&*rows).for_each(|(d, row)| add_scaled::<Plain>(&mut along, *d, row));
            direction.iter().zip(&mut *rows).for_each(|(d, row)| add_scaled::<Plain>(row, -d, &along));
        }
    }
}

/// A row times a small matrix.
pub(crate) fn times(row: &Row, small: &Small) -> Row {
    let mut product = ZERO;
    for a in 0..WIDTH {
        add_scaled::<Plain>(&mut product, row[a], &small[a]);
    }
    product
}

fn noise(size: f64, random: &mut ChaCha8Rng) -> Row {
    std::array::from_fn(|_| 2.0 * size * uniform(random))
}

/// Uniform in [−½, ½).
pub(crate) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}
