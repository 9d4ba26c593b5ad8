//! The rotation spectrum: what kind of deformation it is, wherever on the part it happens, and which way it goes.
//!
//! Only universal constants: no number depends on the other runs of a bundle, and the kind can be compared between
//! meshes, parts and units. With ρ = Φᵀ M r, A the area, and E = ‖r‖²_M of the whole field, so that what lies beyond the
//! K eigenvectors counts too, s_j = |ρ_j|² / E is the share of eigenvector j. Frequency is counted as by Weyl's law,
//! ν_j = λ_j A / 4π: about the number of eigenvalues below λ_j of a surface of this area, whatever its mesh. With the
//! identity as mass λ_j is a pure number, and λ_j N / A for N vertices takes its place: the same on a mesh of equal cells.
//!
//! **Kind.** For each octave of ν from 1 to 512 the mean, over the octave in log ν, of the share below ν,
//! F(ν) = Σ_{ν_j ≤ ν} s_j, against that of a field with as much energy in every octave: where along the frequencies the
//! turning happens. What the K eigenvectors do not catch is taken to lie evenly between the last of them and 512, so that
//! their number hardly matters. **Direction.** ρ_j / √E, with sign, for waves as long as the part and fading out to half of that:
//! which way it turned as a whole. docs/rotation-spectrum.md derives and ablates every choice.

use serde::{Deserialize, Serialize};

use crate::basis::Basis;
use crate::vector::{Vector, square};

/// Octaves of frequency, from Weyl's count 1 to 512: about the paper's 500 eigenvectors.
pub const OCTAVES: usize = 9;

/// A root mean square of sin θ below this is rounding of single-precision files, not a turn: positions 3 m from the
/// origin are rounded to 5e-5 of a shell of 5 mm.
pub(crate) const TURN_MIN: f64 = 1e-4;

/// Kind and direction of a deformation in a few numbers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RotationSpectrum {
    /// Root mean square of sin θ over the surface: how much it turned. Not compared.
    pub turn: f64,
    /// Share of the squared turning in each octave of frequency; what is missing to 1 lies beyond. Not compared as it is.
    pub octaves: Vec<f64>,
    /// What is compared of the kind: for each octave the mean share below, against that of equal octaves, over √9.
    pub kind: Vec<f64>,
    /// What is compared of the direction: w_j ρ_j / √E for the longest waves.
    pub direction: Vec<Vector>,
}

impl RotationSpectrum {
    /// What is compared: kind, then direction.
    pub fn numbers(&self) -> Vec<f64> {
        self.kind.iter().chain(self.direction.iter().flatten()).copied().collect()
    }

    /// Mean of several spectra of one basis, number by number.
    pub(crate) fn mean(each: &[Self]) -> Self {
        let Some(first) = each.first() else { return Self::default() };
        let mean = |of: &dyn Fn(&Self) -> f64| each.iter().map(of).sum::<f64>() / each.len() as f64;
        let direction = |j: usize| std::array::from_fn(|c| mean(&|one| one.direction[j][c]));
        Self {
            turn: mean(&|one| one.turn),
            octaves: (0..first.octaves.len()).map(|at| mean(&|one| one.octaves[at])).collect(),
            kind: (0..first.kind.len()).map(|at| mean(&|one| one.kind[at])).collect(),
            direction: (0..first.direction.len()).map(direction).collect(),
        }
    }
}

/// Measures rotation fields in one basis.
#[derive(Debug, Clone)]
pub struct Ruler {
    area: f64,
    /// ‖1‖²_M, which times the square of `turn` is E.
    total_mass: f64,
    /// For each eigenvector how much of each octave lies above its frequency, 0 to 1; K.
    above: Vec<[f64; OCTAVES]>,
    /// For each eigenvector the octave that its frequency lies in; K.
    octave: Vec<Option<usize>>,
    /// How much of what the eigenvectors do not catch lies below, as mean over each octave.
    rest: [f64; OCTAVES],
    /// Weights w_j of the direction, falling; those above zero, at least one.
    weights: Vec<f64>,
}

impl Ruler {
    /// For the coefficients in a basis.
    pub fn of(basis: &Basis) -> Self {
        let (area, total_mass) = (basis.facts.area, basis.total_mass());
        let unit = basis.per_square_length();
        // log₂ of Weyl's count; the null space has none and lies below every octave.
        let log = |eigenvalue: &f64| (unit * eigenvalue * area / (4.0 * std::f64::consts::PI)).log2();
        let null_space = basis.facts.null_space;
        let logs: Vec<f64> = (0..)
            .zip(&basis.eigenvalues)
            .map(
                |(j, eigenvalue)| {
                    if j < null_space || *eigenvalue <= 0.0 { f64::NEG_INFINITY } else { log(eigenvalue) }
                },
            )
            .collect();
        let above = |log: &f64| std::array::from_fn(|octave| (octave as f64 + 1.0 - log).clamp(0.0, 1.0));
        // The longest half wave that fits into the part: λ = (π / ℓ)².
        let longest = (std::f64::consts::PI / basis.facts.length).powi(2);
        let weight = |(j, eigenvalue): (usize, &f64)| {
            if logs[j] == f64::NEG_INFINITY {
                1.0
            } else {
                (1.0 - (unit * eigenvalue / longest).log2() / 2.0).clamp(0.0, 1.0)
            }
        };
        let weights = basis.eigenvalues.iter().enumerate().map(weight).take_while(|weight| *weight > 0.0).collect();
        let octave = |log: &f64| (*log < OCTAVES as f64).then(|| log.max(0.0) as usize);
        let rest = rest_below(logs.last().copied().unwrap_or(0.0).max(0.0));
        let (above, octave) = (logs.iter().map(above).collect(), logs.iter().map(octave).collect());
        Self { area, total_mass, above, octave, rest, weights }
    }

    /// Triples that the direction has.
    pub(crate) fn directions(&self) -> usize {
        self.weights.len()
    }

    /// The spectrum of one state. `rho`: K × 3; `turn`: root mean square of sin θ in M, ‖r‖_M / ‖1‖_M.
    pub fn spectrum(&self, rho: &[Vector], turn: f64) -> RotationSpectrum {
        let mut octaves = vec![0.0; OCTAVES];
        if turn < TURN_MIN {
            let direction = vec![Vector::default(); self.weights.len()];
            return RotationSpectrum { turn, octaves, kind: vec![0.0; OCTAVES], direction };
        }
        let energy = turn * turn * self.total_mass;
        let (mut below, mut caught) = ([0.0; OCTAVES], 0.0);
        for ((rho, above), octave) in rho.iter().zip(&self.above).zip(&self.octave) {
            let share = square(*rho) / energy;
            caught += share;
            below.iter_mut().zip(above).for_each(|(below, above)| *below += share * above);
            if let Some(octave) = octave {
                octaves[*octave] += share;
            }
        }
        let missing = (1.0 - caught).max(0.0);
        below.iter_mut().zip(&self.rest).for_each(|(below, rest)| *below += missing * rest);
        let count = OCTAVES as f64;
        let kind = (0..).zip(below).map(|(at, below)| (below - (f64::from(at) + 0.5) / count) / count.sqrt()).collect();
        RotationSpectrum { turn, octaves, kind, direction: self.direction(rho, energy.sqrt()) }
    }

    /// w_j ρ_j / √E of the longest waves.
    pub(crate) fn direction(&self, rho: &[Vector], root_energy: f64) -> Vec<Vector> {
        let scale = if root_energy > 0.0 { 1.0 / root_energy } else { 0.0 };
        rho.iter().zip(&self.weights).map(|(rho, weight)| rho.map(|x| weight * x * scale)).collect()
    }

    /// Eigenvectors, counted from 1, whose frequency lies in an octave.
    pub(crate) fn eigenvectors_of(&self, octave: usize) -> Vec<usize> {
        (1..=self.octave.len()).filter(|j| self.octave[j - 1] == Some(octave)).collect()
    }

    /// Names of the numbers that are compared.
    pub fn names(&self) -> Vec<String> {
        let kind = (1..=OCTAVES).map(|octave| format!("kind_{octave}"));
        let turns = (1..=self.weights.len()).flat_map(|j| ["x", "y", "z"].map(|axis| format!("turn_{j}_{axis}")));
        kind.chain(turns).collect()
    }

    /// Wavelengths at both ends of each octave, the longer one first, in the length unit: 2π/√λ = √(π A / ν).
    pub fn wavelengths(&self) -> [(f64, f64); OCTAVES] {
        let wavelength = |octave: usize| (std::f64::consts::PI * self.area / f64::from(1 << octave)).sqrt();
        std::array::from_fn(|octave| (wavelength(octave), wavelength(octave + 1)))
    }
}

/// Mean over each octave of a straight line in log₂ ν from 0 at `last`, that of the last eigenvector, to 1 at the end of
/// all octaves: no jump where `last` comes to that end.
fn rest_below(last: f64) -> [f64; OCTAVES] {
    let left = OCTAVES as f64 - last;
    let integral = |to: f64| if to > last { (to - last).powi(2) / (2.0 * left) } else { 0.0 };
    std::array::from_fn(|octave| integral(octave as f64 + 1.0) - integral(octave as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_rises_from_the_last_eigenvector_to_the_end() {
        assert_eq!(rest_below(OCTAVES as f64), [0.0; OCTAVES]);
        assert_eq!(rest_below(20.0), [0.0; OCTAVES]);
        let whole = rest_below(0.0);
        assert!((0..OCTAVES).all(|o| (whole[o] - (o as f64 + 0.5) / OCTAVES as f64).abs() < 1e-15), "{whole:?}");
        let late = rest_below(7.5);
        // Over 7 … 8 half a unit of a line to 1/3; over 8 … 9 from 1/3 to 1.
        assert!(late[..7] == [0.0; 7] && (late[7] - 1.0 / 12.0).abs() < 1e-15 && (late[8] - 2.0 / 3.0).abs() < 1e-15);
    }
}
