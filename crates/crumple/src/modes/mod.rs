//! Deformation modes: groups of runs that deformed alike, each with the run in its middle.
//!
//! The last states of all runs become points. By displacement (the paper's way): 3K coefficients δ divided by √area, so
//! that the distance of two points is the M-weighted RMS distance of the two shapes in the length unit (Parseval). By
//! rotation: band energies and lowest triples of the rotation field, which say what kind of deformation it is and
//! which way it goes, wherever on the part it happens.

mod agglomerative;
mod evidence;
mod file;
mod kmeans;
mod points;

use std::str::FromStr;

use mesh_spectrum::Watch;
use serde::{Deserialize, Serialize};

pub use evidence::adjusted_rand_index;
pub(crate) use evidence::silhouettes;
pub(crate) use file::columns;
pub use file::{load, save};
pub(crate) use points::{Distances, Points, square_distance};

use crate::Error;
use crate::rotation::Ruler;
use crate::study::{Function, Rows, Study};

/// How to group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModesOptions {
    /// Number of modes; chosen by the best mean silhouette of 2 to 8 when `None`.
    pub count: Option<usize>,
    /// Seed of k-means++. The same seed gives the same modes on any number of threads.
    pub seed: u64,
    /// The method.
    pub method: Method,
    /// What makes runs alike.
    pub by: By,
}

impl Default for ModesOptions {
    fn default() -> Self {
        Self { count: None, seed: 1, method: Method::KMeans, by: By::Rotation }
    }
}

/// What makes runs alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// Kind and direction of the deformation: the spectrum of the rotation field. Distances have no unit, and follow the
    /// angle between two runs' deviations from the mean of all runs: 0 alike, √2 unrelated, 2 opposite.
    #[default]
    Rotation,
    /// Where every place of the part ends up: all K coefficients of the displacement, as in the paper. Distances are in
    /// the length unit.
    Displacement,
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
}

/// Fewer runs than this are not grouped.
pub const RUNS_MIN: usize = 3;

/// The largest number of modes that is tried when none is given.
pub const COUNT_MAX: usize = 8;

/// The modes of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Modes {
    /// What makes runs alike.
    pub by: By,
    /// The method.
    pub method: Method,
    /// The seed.
    pub seed: u64,
    /// Whether the number of modes was given, not chosen.
    pub given: bool,
    /// Largest modes first.
    pub modes: Vec<Mode>,
    /// One entry a run, by run id.
    pub runs: Vec<Membership>,
    /// Mean silhouette for each number of modes that was tried.
    pub tried: Vec<Tried>,
}

/// One mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// Its name: `mode-1` is the largest.
    pub name: String,
    /// The run in its middle: smallest mean distance to the other members.
    pub medoid: String,
    /// Ids of its runs, sorted.
    pub members: Vec<String>,
    /// Mean silhouette of its runs, −1 to 1.
    pub silhouette: f64,
    /// Root mean square distance of its runs to their mean, in the unit of [`By`].
    pub spread: f64,
}

/// Where a run belongs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Membership {
    /// Run id.
    pub run: String,
    /// Name of its mode.
    pub mode: String,
    /// Distance to the medoid of its mode, in the unit of [`By`].
    pub distance: f64,
    /// Silhouette, −1 to 1: how much nearer its own mode is than the next one.
    pub silhouette: f64,
    /// Whether it lies far outside its mode: its distance to the mode's mean is more than three robust standard
    /// deviations (1.4826 × median absolute deviation) above the mode's median distance. Modes of fewer than five
    /// runs have no outliers.
    pub outlier: bool,
}

/// A number of modes and how good it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// Number of modes.
    pub count: usize,
    /// Mean silhouette.
    pub silhouette: f64,
}

/// Groups the last states of all runs of a study.
///
/// # Errors
/// [`Error::TooFewRuns`], [`Error::Value`] for a count that makes no sense, [`Error::Stopped`], reading errors.
pub fn modes(study: &Study, options: &ModesOptions, watch: &dyn Watch) -> Result<Modes, Error> {
    let &ModesOptions { count, seed, method, by } = options;
    let function = match by {
        By::Rotation => Function::Rotation,
        By::Displacement => Function::Displacement,
    };
    let rows = study.coefficients_of(function, None, Rows::Last)?;
    let runs = rows.rows();
    if runs < RUNS_MIN {
        return Err(Error::TooFewRuns { what: "grouping into modes", needed: RUNS_MIN, have: runs });
    }
    if let Some(count) = count.filter(|&count| count == 0 || count > runs) {
        return Err(Error::Value {
            name: "--count",
            value: count.to_string(),
            expected: format!("1 to the number of runs, {runs}"),
        });
    }
    let points = match by {
        By::Rotation => Points::by_rotation(&rows, &Ruler::of(&study.basis()?)),
        By::Displacement => Points::by_displacement(&rows, study.basis()?.facts.area),
    };
    let distances = points.distances();
    let counts: Vec<usize> = count.map_or_else(|| (2..=COUNT_MAX.min(runs - 1)).collect(), |count| vec![count]);
    let mut best: Option<(f64, Vec<usize>)> = None;
    let mut tried = Vec::new();
    for (done, &count) in counts.iter().enumerate() {
        if watch.stopped() {
            return Err(Error::Stopped);
        }
        watch.step("trying numbers of modes", done, counts.len());
        let groups = match method {
            Method::KMeans => kmeans::kmeans(&points, count, seed),
            Method::Ward => agglomerative::agglomerate(&distances, count, agglomerative::Linkage::Ward),
            Method::Average => agglomerative::agglomerate(&distances, count, agglomerative::Linkage::Average),
        };
        let values = silhouettes(&distances, &groups);
        let mean = values.iter().sum::<f64>() / runs as f64;
        tried.push(Tried { count, silhouette: mean });
        // A tie goes to the smaller number of modes, which came first.
        if best.as_ref().is_none_or(|(most, _)| mean > *most) {
            best = Some((mean, groups));
        }
    }
    watch.step("trying numbers of modes", counts.len(), counts.len());
    let groups = best.map(|(_, groups)| groups).unwrap_or_default();
    Ok(assemble(&rows.runs, &points, &distances, &groups, tried, options))
}

fn assemble(
    runs: &[String],
    points: &Points,
    distances: &Distances,
    groups: &[usize],
    tried: Vec<Tried>,
    options: &ModesOptions,
) -> Modes {
    let values = silhouettes(distances, groups);
    let count = groups.iter().max().map_or(0, |most| most + 1);
    let members_of = |group: usize| -> Vec<usize> { (0..runs.len()).filter(|&run| groups[run] == group).collect() };
    let mut found: Vec<(Vec<usize>, usize)> = (0..count)
        .map(members_of)
        .filter(|members| !members.is_empty())
        .map(|members| (medoid(distances, &members), members))
        .map(|(medoid, members)| (members, medoid))
        .collect();
    found.sort_by(|(a, ma), (b, mb)| b.len().cmp(&a.len()).then(runs[*ma].cmp(&runs[*mb])));
    let mut modes = Vec::new();
    let mut memberships = Vec::new();
    for (index, (members, medoid)) in found.iter().enumerate() {
        let name = format!("mode-{}", index + 1);
        let from_mean = points.distances_to_mean(members);
        let limit = outlier_limit(&from_mean);
        for (&run, from_mean) in members.iter().zip(&from_mean) {
            memberships.push(Membership {
                run: runs[run].clone(),
                mode: name.clone(),
                distance: distances.between(run, *medoid),
                silhouette: values[run],
                outlier: limit.is_some_and(|limit| *from_mean > limit),
            });
        }
        let mean_square = from_mean.iter().map(|d| d * d).sum::<f64>() / members.len() as f64;
        modes.push(Mode {
            name,
            medoid: runs[*medoid].clone(),
            members: members.iter().map(|&run| runs[run].clone()).collect(),
            silhouette: members.iter().map(|&run| values[run]).sum::<f64>() / members.len() as f64,
            spread: mean_square.sqrt(),
        });
    }
    memberships.sort_by(|a, b| a.run.cmp(&b.run));
    Modes {
        by: options.by,
        method: options.method,
        seed: options.seed,
        given: options.count.is_some(),
        modes,
        runs: memberships,
        tried,
    }
}

/// The member with the smallest mean distance to the others; ties by order, which is by run id.
pub(crate) fn medoid(distances: &Distances, members: &[usize]) -> usize {
    let total = |&run: &usize| (members.iter().map(|&other| distances.between(run, other)).sum::<f64>(), run);
    members.iter().map(total).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, run)| run)
}

fn outlier_limit(distances: &[f64]) -> Option<f64> {
    if distances.len() < 5 {
        return None;
    }
    let centre = median(distances.to_vec());
    let deviation = median(distances.iter().map(|d| (d - centre).abs()).collect());
    // 1.4826: the median absolute deviation of a normal distribution is its standard deviation over 1.4826.
    Some(centre + 3.0 * 1.4826 * deviation)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len().is_multiple_of(2) { (values[middle - 1] + values[middle]) / 2.0 } else { values[middle] }
}

impl FromStr for By {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "rotation" => Ok(Self::Rotation),
            "displacement" => Ok(Self::Displacement),
            _ => Err(Error::Value { name: "--by", value: text.into(), expected: "rotation or displacement".into() }),
        }
    }
}

impl FromStr for Method {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "kmeans" => Ok(Self::KMeans),
            "ward" => Ok(Self::Ward),
            "average" => Ok(Self::Average),
            _ => Err(Error::Value { name: "--method", value: text.into(), expected: "kmeans, ward or average".into() }),
        }
    }
}

impl Modes {
    /// The mode of this name.
    ///
    /// # Errors
    /// [`Error::UnknownMode`].
    pub fn mode(&self, name: &str) -> Result<&Mode, Error> {
        self.modes.iter().find(|mode| mode.name == name).ok_or_else(|| Error::UnknownMode {
            asked: name.to_owned(),
            available: self.modes.iter().map(|mode| mode.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    /// Unit of distances and spreads; empty where they have none.
    pub fn unit<'a>(&self, length_unit: &'a str) -> &'a str {
        match self.by {
            By::Rotation => "",
            By::Displacement => length_unit,
        }
    }

    /// Ids of the outliers.
    pub fn outliers(&self) -> Vec<&str> {
        self.runs.iter().filter(|run| run.outlier).map(|run| run.run.as_str()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three groups on a line at 0, 100 and 200, three points each, and one far from the last.
    fn line() -> Points {
        let values = [0.0, 1.0, 2.0, 100.0, 101.0, 102.0, 200.0, 201.0, 202.0];
        Points { width: 1, values: values.to_vec() }
    }

    #[test]
    fn every_method_finds_groups_that_are_apart() {
        let points = line();
        let distances = points.distances();
        let expected = [0, 0, 0, 1, 1, 1, 2, 2, 2];
        for groups in [
            kmeans::kmeans(&points, 3, 7),
            agglomerative::agglomerate(&distances, 3, agglomerative::Linkage::Ward),
            agglomerative::agglomerate(&distances, 3, agglomerative::Linkage::Average),
        ] {
            assert_eq!(adjusted_rand_index(&groups, &expected), 1.0, "{groups:?}");
            assert!(silhouettes(&distances, &groups).iter().all(|&s| s > 0.97));
        }
    }

    #[test]
    fn the_medoid_is_in_the_middle_and_outliers_are_far() {
        let points = Points { width: 1, values: vec![0.0, 1.0, 2.0, 3.0, 4.0, 60.0] };
        let distances = points.distances();
        assert_eq!(medoid(&distances, &[0, 1, 2, 3, 4, 5]), 2);
        let from_mean = points.distances_to_mean(&[0, 1, 2, 3, 4, 5]);
        let limit = outlier_limit(&from_mean).unwrap();
        assert_eq!(from_mean.iter().map(|&d| d > limit).collect::<Vec<_>>(), [false, false, false, false, false, true]);
        assert_eq!(outlier_limit(&from_mean[..4]), None);
    }

    #[test]
    fn the_same_seed_gives_the_same_groups() {
        let points = Points { width: 2, values: (0..80).map(|i| f64::from((i * 37) % 53)).collect() };
        assert_eq!(kmeans::kmeans(&points, 5, 3), kmeans::kmeans(&points, 5, 3));
    }
}
