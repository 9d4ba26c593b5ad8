//! Which coefficients are looked at: the rotation field's spectrum or, as in the paper, those of the coordinates, α, or
//! of the displacement, δ.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::Error;
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

/// Which numbers say how a state deformed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The spectrum of the rotation field: what kind of deformation it is wherever it happens, and which way it goes.
    #[default]
    Rotation,
    /// The paper's: coefficients on the eigenvectors that matter most for the target.
    Paper,
}

impl Kind {
    /// As a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rotation => "rotation",
            Self::Paper => "paper",
        }
    }
}

impl FromStr for Kind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "rotation" => Ok(Self::Rotation),
            "paper" => Ok(Self::Paper),
            _ => Err(Error::Value { name: "--kind", value: text.into(), expected: "rotation or paper".into() }),
        }
    }
}
