//! Which coefficients are looked at: those of the coordinates, α, or those of the displacement, δ.

use serde::{Deserialize, Serialize};

use crate::basis::Basis;

/// Which coefficients a method looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Select {
    /// |α|: coefficients of the coordinates.
    #[default]
    Coordinates,
    /// |δ|: difference to the undeformed baseline.
    Difference,
}

impl Select {
    /// The value of eigenvector j (counted from 1) that this choice looks at, given δ, K × 3.
    pub fn value(self, basis: &Basis, delta: &[[f64; 3]], j: usize) -> [f64; 3] {
        let (delta, baseline) = (delta[j - 1], basis.baseline[j - 1]);
        match self {
            Self::Coordinates => std::array::from_fn(|c| baseline[c] + delta[c]),
            Self::Difference => delta,
        }
    }

    /// All K values.
    pub fn values(self, basis: &Basis, delta: &[[f64; 3]]) -> Vec<[f64; 3]> {
        (1..=delta.len()).map(|j| self.value(basis, delta, j)).collect()
    }

    /// As a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Coordinates => "coordinates",
            Self::Difference => "difference",
        }
    }
}
