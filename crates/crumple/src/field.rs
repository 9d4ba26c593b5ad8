//! A quantity of the result files as a function on the surface, beside the shape: effective plastic strain, a
//! temperature, a velocity (the paper: "some other physical quantities such as plastic strain or stress").

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::Error;

/// A quantity by its name, and which of an element's layers it is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Field {
    /// What it is.
    pub quantity: Quantity,
    /// Which layer of a shell; `Max` for quantities of nodes.
    pub layer: Layer,
}

/// What a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// Effective plastic strain of shells.
    PlasticStrain,
    /// Von Mises stress of shells.
    VonMises,
    /// Thickness of shells.
    Thickness,
    /// Internal energy density of shells.
    InternalEnergy,
    /// Temperature of nodes.
    Temperature,
    /// Velocity of nodes, a vector.
    Velocity,
    /// Acceleration of nodes, a vector.
    Acceleration,
}

/// Which of a shell's layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Layer {
    /// The largest of all layers.
    #[default]
    Max,
    /// The smallest.
    Min,
    /// Their mean.
    Mean,
    /// The inner surface.
    Inner,
    /// The outer surface.
    Outer,
}

const QUANTITIES: [(&str, Quantity); 7] = [
    ("plastic_strain", Quantity::PlasticStrain),
    ("von_mises", Quantity::VonMises),
    ("thickness", Quantity::Thickness),
    ("internal_energy", Quantity::InternalEnergy),
    ("temperature", Quantity::Temperature),
    ("velocity", Quantity::Velocity),
    ("acceleration", Quantity::Acceleration),
];

const LAYERS: [(&str, Layer); 5] =
    [("max", Layer::Max), ("min", Layer::Min), ("mean", Layer::Mean), ("inner", Layer::Inner), ("outer", Layer::Outer)];

impl Field {
    /// Numbers a vertex has: 1, or 3 for a vector.
    pub fn components(&self) -> usize {
        if matches!(self.quantity, Quantity::Velocity | Quantity::Acceleration) { 3 } else { 1 }
    }

    /// As part of a column's name: `plastic_strain`, `plastic_strain_outer`.
    pub fn column(&self) -> String {
        self.to_string().replace(':', "_")
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let quantity = QUANTITIES.iter().find(|(_, quantity)| *quantity == self.quantity).map_or("", |(name, _)| name);
        f.write_str(quantity)?;
        match LAYERS.iter().find(|(_, layer)| *layer == self.layer) {
            Some((name, layer)) if *layer != Layer::Max => write!(f, ":{name}"),
            _ => Ok(()),
        }
    }
}

impl FromStr for Field {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let (name, layer) = text.split_once(':').unwrap_or((text, "max"));
        let quantity = QUANTITIES.iter().find(|(known, _)| *known == name).map(|(_, quantity)| *quantity);
        let layer = LAYERS.iter().find(|(known, _)| *known == layer).map(|(_, layer)| *layer);
        let of_nodes = matches!(quantity, Some(Quantity::Temperature | Quantity::Velocity | Quantity::Acceleration));
        match (quantity, layer) {
            (Some(quantity), Some(layer)) if !of_nodes || layer == Layer::Max => Ok(Self { quantity, layer }),
            _ => Err(Error::Value {
                name: "field",
                value: text.to_owned(),
                expected: format!(
                    "{}; those of shells with a layer if one is meant: plastic_strain:outer ({})",
                    QUANTITIES.map(|(name, _)| name).join(", "),
                    LAYERS.map(|(name, _)| name).join(", ")
                ),
            }),
        }
    }
}

impl TryFrom<String> for Field {
    type Error = Error;

    fn try_from(text: String) -> Result<Self, Error> {
        text.parse()
    }
}

impl From<Field> for String {
    fn from(field: Field) -> Self {
        field.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_written_as_they_are_read() {
        for name in ["plastic_strain", "plastic_strain:outer", "plastic_strain:mean", "velocity", "temperature"] {
            assert_eq!(name.parse::<Field>().unwrap().to_string(), name);
        }
        for wrong in ["", "strain", "plastic_strain:", "plastic_strain:top", "velocity:outer"] {
            assert!(wrong.parse::<Field>().is_err(), "{wrong}");
        }
    }
}
