//! What can be asked for: what makes runs alike, which states are looked at, how runs are grouped, how the number of
//! modes is chosen.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::Error;
use crate::field::Field;
use crate::study::Function;

/// How to group.
#[derive(Debug, Clone, PartialEq)]
pub struct ModesOptions {
    /// Number of modes; chosen among 2 to 8 as `choose` says when `None`. HDBSCAN finds its own.
    pub count: Option<usize>,
    /// What decides between numbers of modes.
    pub choose: Choose,
    /// Seed of random starts and resamples. The same seed gives the same modes on any number of threads.
    pub seed: u64,
    /// The method.
    pub method: Method,
    /// Fewest runs of a mode, for HDBSCAN; by the number of runs when `None`: a quarter of them, at least 2, at most 5.
    pub smallest: Option<usize>,
    /// What makes runs alike.
    pub by: By,
    /// The states that are looked at.
    pub states: States,
}

impl Default for ModesOptions {
    fn default() -> Self {
        Self {
            count: None,
            choose: Choose::Silhouette,
            seed: 1,
            method: Method::KMeans,
            smallest: None,
            by: By::Rotation,
            states: States::Last,
        }
    }
}

/// What makes runs alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// Kind and direction of the deformation: the rotation spectrum. Distances have no unit, and follow the angle between
    /// two runs' numbers: 0 alike, √2 unrelated, 2 opposite.
    #[default]
    Rotation,
    /// Where every place of the part ends up: all K coefficients of the displacement, as in the paper. Distances are in
    /// the length unit.
    Displacement,
    /// The coordinates themselves, α = α⁰ + δ. All runs share α⁰, so distances, and with them the modes, are those of the
    /// displacement.
    Coordinates,
    /// A field that the study keeps: all its K coefficients, in its own unit.
    Field(Field),
    /// The rotation spectrum and a field together, each over its spread among the runs; distances have no unit.
    #[serde(rename = "rotation_and")]
    RotationAnd(Field),
    /// The displacement and a field together, likewise.
    #[serde(rename = "displacement_and")]
    DisplacementAnd(Field),
}

impl By {
    /// What is looked at together: one, or a shape and a field.
    pub(crate) fn each(self) -> Vec<Self> {
        match self {
            Self::RotationAnd(field) => vec![Self::Rotation, Self::Field(field)],
            Self::DisplacementAnd(field) => vec![Self::Displacement, Self::Field(field)],
            one => vec![one],
        }
    }

    /// The field in it.
    pub(crate) fn field(self) -> Option<Field> {
        match self {
            Self::Field(field) | Self::RotationAnd(field) | Self::DisplacementAnd(field) => Some(field),
            Self::Rotation | Self::Displacement | Self::Coordinates => None,
        }
    }

    /// The stored function that is looked at, of one of [`By::each`].
    pub(super) fn function(self) -> Function {
        match self {
            Self::Rotation | Self::RotationAnd(_) => Function::Rotation,
            Self::Displacement | Self::Coordinates | Self::DisplacementAnd(_) => Function::Displacement,
            Self::Field(field) => Function::Field(field),
        }
    }
}

/// How runs are grouped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// k-means with k-means++ starts and restarts.
    #[default]
    KMeans,
    /// Agglomerative, smallest growth of the sum of squares (Ward).
    Ward,
    /// Agglomerative, smallest mean distance.
    Average,
    /// Mixture of Gaussians in the plane of the first principal components, each run to its likeliest Gaussian.
    Mixture,
    /// Dense regions at any density; runs in none of them have no mode (HDBSCAN).
    Hdbscan,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::KMeans, Self::Ward, Self::Average, Self::Mixture, Self::Hdbscan];

    /// Whether it can be told how many modes to find.
    pub fn takes_count(self) -> bool {
        self != Self::Hdbscan
    }
}

/// What decides between numbers of modes. Both are always computed and shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Choose {
    /// The largest mean silhouette; a tie goes to the smaller number.
    #[default]
    Silhouette,
    /// The largest number whose groups come back when runs are left out as well as those of any other number do: mean
    /// adjusted Rand index within 0.02 of the best (Ben-Hur, Elisseeff and Guyon 2002).
    Stability,
}

/// Which states of each run are looked at.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "which")]
pub enum States {
    /// The last one.
    #[default]
    Last,
    /// The states at these stations, interpolated between neighbours.
    At {
        /// What a station is.
        along: Along,
        /// Times, or shares of the intrusion that all runs reach, 0 to 1.
        stations: Vec<f64>,
    },
    /// The whole series, at [`SERIES_STATIONS`] equal steps up to what all runs reach.
    Series {
        /// What runs are aligned by.
        along: Along,
    },
}

/// Stations of a whole series.
pub const SERIES_STATIONS: usize = 10;

/// What aligns the states of different runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Along {
    /// Time, in the model's unit.
    #[default]
    Time,
    /// M-weighted RMS displacement, in the length unit; the first moment at which a run reaches it counts.
    Intrusion,
}

fn one_of<T: Copy>(name: &'static str, text: &str, words: &[(&str, T)]) -> Result<T, Error> {
    let expected = || {
        let names: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        match names.split_last() {
            Some((last, first)) if !first.is_empty() => format!("{} or {last}", first.join(", ")),
            _ => names.concat(),
        }
    };
    let found = words.iter().find(|(word, _)| *word == text);
    found.map(|(_, value)| *value).ok_or_else(|| Error::Value { name, value: text.into(), expected: expected() })
}

impl FromStr for By {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let words =
            [("rotation", Self::Rotation), ("displacement", Self::Displacement), ("coordinates", Self::Coordinates)];
        let wrong = || Error::Value {
            name: "--by",
            value: text.to_owned(),
            expected: "rotation, displacement (or paper), coordinates, a field such as plastic_strain, \
                       or shape and field as displacement,plastic_strain"
                .into(),
        };
        if let Some((_, by)) = words.iter().find(|(word, _)| *word == text) {
            return Ok(*by);
        }
        match text.split_once(',') {
            None if text == "paper" => Ok(Self::Displacement),
            None => text.parse().map(Self::Field).map_err(|_| wrong()),
            Some((shape, field)) => {
                let field = field.trim().parse().map_err(|_| wrong())?;
                match shape.trim() {
                    "rotation" => Ok(Self::RotationAnd(field)),
                    "displacement" | "paper" | "coordinates" | "shape" => Ok(Self::DisplacementAnd(field)),
                    _ => Err(wrong()),
                }
            }
        }
    }
}

impl FromStr for Method {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let words = [
            ("kmeans", Self::KMeans),
            ("ward", Self::Ward),
            ("average", Self::Average),
            ("mixture", Self::Mixture),
            ("hdbscan", Self::Hdbscan),
        ];
        one_of("--method", text, &words)
    }
}

impl FromStr for Choose {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        one_of("--choose", text, &[("silhouette", Self::Silhouette), ("stability", Self::Stability)])
    }
}

impl FromStr for Along {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        one_of("--align", text, &[("time", Self::Time), ("intrusion", Self::Intrusion)])
    }
}
