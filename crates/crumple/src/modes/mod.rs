//! Deformation modes: groups of runs that deformed alike, each with the run in its middle.
//!
//! The states of all runs that are looked at ([`States`]) become points. By displacement (the paper's way): 3K coefficients δ
//! divided by √area, so that the distance of two points is the M-weighted RMS distance of the two shapes in the length unit
//! (Parseval). By rotation: the rotation spectrum, which says what kind of deformation it is and which way it goes, wherever
//! on the part it happens.
//!
//! states → points → groups (for each number: silhouette, stability) → modes (medoid, spread, outliers) → the state at which
//! two of them part, the inputs that go with each, the names they had.

mod agglomerative;
mod assemble;
mod evidence;
mod file;
mod group;
mod hdbscan;
mod inputs;
mod kmeans;
mod mixture;
mod names;
mod options;
mod parting;
mod points;
mod ranks;
mod reduce;
mod stability;
mod states;

use mesh_spectrum::Watch;
use serde::{Deserialize, Serialize};

pub(crate) use assemble::medoid;
pub use evidence::adjusted_rand_index;
pub(crate) use file::columns;
pub use file::{load, save};
pub use inputs::{InputEffect, Values};
pub use names::{NONE, Named};
pub use options::{Along, By, Choose, Method, ModesOptions, SERIES_STATIONS, States};
pub use parting::{APART, Apart, Parting};
pub(crate) use points::{Distances, Points, square_distance};

use crate::Error;
use crate::basis::Basis;
use crate::study::Study;
use evidence::{mean_silhouette, silhouettes};
use group::Grouper;

/// Fewer runs than this are not grouped.
pub const RUNS_MIN: usize = 3;
/// The largest number of modes that is tried when none is given.
pub const COUNT_MAX: usize = 8;
/// Numbers of groups whose stability is within this of the best count as equally stable.
const EQUALLY_STABLE: f64 = 0.01;
/// Groups that come back worse than this are doubtful.
pub const STABLE: f64 = 0.75;

/// The modes of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Modes {
    /// What makes runs alike.
    pub by: By,
    /// The states that were looked at.
    #[serde(default)]
    pub states: States,
    /// The method.
    pub method: Method,
    /// The seed.
    pub seed: u64,
    /// Whether the number of modes was given, not chosen.
    pub given: bool,
    /// What decided between numbers of modes.
    #[serde(default)]
    pub choose: Choose,
    /// Largest modes first. None where HDBSCAN sees no two dense groups.
    pub modes: Vec<Mode>,
    /// One entry a run, by run id.
    pub runs: Vec<Membership>,
    /// The evidence for each number of modes that was tried.
    pub tried: Vec<Tried>,
    /// For each pair of modes the state from which they are apart.
    #[serde(default)]
    pub partings: Vec<Parting>,
    /// Names given by the user, those without a mode now included.
    #[serde(default)]
    pub names: Vec<Named>,
    /// What the user should know, in words.
    #[serde(default)]
    pub notes: Vec<String>,
}

/// One mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// Its name: given by the user, or `mode-1` for the largest.
    pub name: String,
    /// The run in its middle: smallest mean distance to the other members.
    pub medoid: String,
    /// Ids of its runs, sorted.
    pub members: Vec<String>,
    /// Mean silhouette of its runs, −1 to 1.
    pub silhouette: f64,
    /// Root mean square distance of its runs to their mean, in the unit of [`By`].
    pub spread: f64,
    /// The inputs of its runs against those of all others; those that go with the mode first.
    #[serde(default)]
    pub inputs: Vec<InputEffect>,
}

/// Where a run belongs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Membership {
    /// Run id.
    pub run: String,
    /// Name of its mode; none for a run that HDBSCAN leaves out, or that does not reach the states looked at.
    pub mode: Option<String>,
    /// Distance to the medoid of its mode, in the unit of [`By`].
    pub distance: Option<f64>,
    /// Silhouette, −1 to 1: how much nearer its own mode is than the next one.
    pub silhouette: Option<f64>,
    /// How firmly it belongs, 0 to 1: of a mixture the share of its Gaussian in the run's density, of HDBSCAN the density at
    /// which the run leaves its group over the group's highest. Other methods do not say.
    #[serde(default)]
    pub strength: Option<f64>,
    /// How far outside its mode it lies: its distance to the mode's mean less the median of the mode's, in robust standard
    /// deviations (1.4826 × median absolute deviation). For a run without a mode, the least over all modes. None where modes
    /// have fewer than five runs.
    #[serde(default)]
    pub score: Option<f64>,
    /// Whether it is an outlier of its mode: a score above 3.
    pub outlier: bool,
}

/// A number of modes and how good it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// Number of modes.
    pub count: usize,
    /// Mean silhouette.
    pub silhouette: f64,
    /// Mean adjusted Rand index between groupings of samples of four fifths of the runs; none for fewer than ten runs.
    #[serde(default)]
    pub stability: Option<f64>,
    /// Bayesian information criterion of a mixture: less is better.
    #[serde(default)]
    pub bic: Option<f64>,
}

/// Groups the runs of a study. Names that modes had are kept where they still fit.
///
/// # Errors
/// [`Error::TooFewRuns`], [`Error::Value`] for a count, a size or a state that makes no sense, [`Error::Stopped`], reading
/// errors.
pub fn modes(study: &Study, options: &ModesOptions, watch: &dyn Watch) -> Result<Modes, Error> {
    let basis = study.basis()?;
    let mut found = groups(study, &basis, options, watch)?;
    inputs::inputs(study.manifest(), &mut found.modes, options.seed);
    match parting::partings(study, options.by, &basis, &found.modes)? {
        Ok(partings) => found.partings = partings,
        Err(why) => found.notes.push(why),
    }
    match load(study) {
        Ok(before) => found.keep(before.names),
        Err(Error::NoModes) => {}
        Err(error) => found.notes.push(format!("names that modes had are lost: {error}")),
    }
    Ok(found)
}

/// The modes alone, numbered: without the inputs that go with them, the states at which they part and names of before.
///
/// # Errors
/// As [`modes`].
pub(crate) fn groups(study: &Study, basis: &Basis, options: &ModesOptions, watch: &dyn Watch) -> Result<Modes, Error> {
    if study.manifest().runs.len() < RUNS_MIN {
        let have = study.manifest().runs.len();
        return Err(Error::TooFewRuns { what: "grouping into modes", needed: RUNS_MIN, have });
    }
    if let Some(field) = options.by.field()
        && !study.settings().fields.contains(&field)
    {
        return Err(crate::target::unknown_field(field, study.settings().fields.iter().copied()));
    }
    let sampled = states::sample(study, options.by, &options.states, basis.total_mass())?;
    // A field beside a shape: the same states of the same runs.
    let beside = options.by.each().into_iter().skip(1);
    let beside = beside.map(|by| Ok((by, states::sample(study, by, &options.states, basis.total_mass())?)));
    let beside: Vec<(By, states::Sampled)> = beside.collect::<Result<_, Error>>()?;
    let runs = sampled.runs.len();
    if runs < RUNS_MIN {
        let what = "grouping into modes by states that all runs reach";
        return Err(Error::TooFewRuns { what, needed: RUNS_MIN, have: runs });
    }
    check(options, runs)?;
    let each = options.by.each().into_iter().take(1).map(|by| (by, &sampled));
    let each = each.chain(beside.iter().map(|(by, sampled)| (*by, sampled)));
    let points =
        Points::together(each.map(|(by, sampled)| Points::of(by, &sampled.rows, sampled.per_run, basis)).collect());
    let distances = points.distances();
    let smallest = options.smallest.unwrap_or((runs / 4).clamp(2, 5));
    let grouper = Grouper::new(&points, &distances, options.method, options.seed, smallest);
    let counts: Vec<usize> = match (options.method.takes_count(), options.count) {
        (false, _) => vec![1],
        (true, Some(count)) => vec![count],
        (true, None) => (2..=COUNT_MAX.min(runs - 1)).collect(),
    };
    let mut tried = Vec::new();
    let mut groupings = Vec::new();
    for (done, &count) in counts.iter().enumerate() {
        if watch.stopped() {
            return Err(Error::Stopped);
        }
        watch.step("trying numbers of modes", done, counts.len());
        let grouping = grouper.group(count);
        let silhouette = mean_silhouette(&silhouettes(&distances, &grouping.groups));
        let count = if options.method.takes_count() { count } else { grouping.count() };
        tried.push(Tried { count, silhouette, stability: None, bic: grouping.bic });
        groupings.push(grouping);
    }
    let stability = stability::stability(&grouper, &points, &distances, &counts, options.seed);
    for ((tried, stability), grouping) in tried.iter_mut().zip(stability).zip(&groupings) {
        // Fewer groups than asked for, where points coincide or a Gaussian has lost its points: another number's stability.
        tried.stability = stability.filter(|_| grouping.count() == tried.count);
    }
    watch.step("trying numbers of modes", counts.len(), counts.len());
    let best = best(&tried, options.choose);
    let grouping = groupings.swap_remove(best);
    let mut found = assemble::assemble(&sampled, &points, &distances, &grouping, options);
    found.notes.extend(doubts(&tried[best], &found, runs));
    found.tried = tried;
    Ok(found)
}

fn check(options: &ModesOptions, runs: usize) -> Result<(), Error> {
    let wrong = |name, value: usize, expected| Err(Error::Value { name, value: value.to_string(), expected });
    match (options.count, options.smallest) {
        (Some(count), _) if !options.method.takes_count() => {
            wrong("--count", count, "no count with --method hdbscan, which finds its own; --smallest steers it".into())
        }
        (Some(count), _) if count == 0 || count > runs => {
            wrong("--count", count, format!("1 to the number of runs, {runs}"))
        }
        (_, Some(smallest)) if options.method.takes_count() => {
            wrong("--smallest", smallest, "--method hdbscan beside it; other methods have no smallest mode".into())
        }
        (_, Some(smallest)) if smallest < 2 || smallest > runs => {
            wrong("--smallest", smallest, format!("2 to the number of runs, {runs}"))
        }
        _ => Ok(()),
    }
}

/// The number that is taken, by its place in the list.
fn best(tried: &[Tried], choose: Choose) -> usize {
    let by_silhouette = || {
        // A tie goes to the smaller number of modes, which comes first.
        (0..tried.len()).reduce(|best, at| if tried[at].silhouette > tried[best].silhouette { at } else { best })
    };
    let by_stability = || {
        let most = tried.iter().filter_map(|tried| tried.stability).reduce(f64::max)?;
        tried.iter().rposition(|tried| tried.stability.is_some_and(|stability| stability >= most - EQUALLY_STABLE))
    };
    let chosen = match choose {
        Choose::Silhouette => by_silhouette(),
        // Too few runs to resample.
        Choose::Stability => by_stability().or_else(by_silhouette),
    };
    chosen.unwrap_or(0)
}

/// What the evidence does not bear out.
fn doubts(tried: &Tried, found: &Modes, runs: usize) -> Vec<String> {
    let mut doubts = Vec::new();
    if found.modes.is_empty() {
        doubts.push(
            "HDBSCAN sees no two dense groups, so no run has a mode; other methods divide the runs all the same".into(),
        );
    } else if let Some(stability) = tried.stability.filter(|stability| *stability < STABLE && found.modes.len() > 1) {
        doubts.push(format!(
            "these {} modes are doubtful: other groups are found when a fifth of the runs is left out (stability {stability:.2})",
            found.modes.len()
        ));
    }
    if found.choose == Choose::Stability && !found.given && runs < stability::RUNS_MIN {
        doubts.push(format!("{runs} runs are too few to resample; the number of modes is chosen by silhouette"));
    }
    doubts
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
            By::Rotation | By::Field(_) | By::RotationAnd(_) | By::DisplacementAnd(_) => "",
            By::Displacement | By::Coordinates => length_unit,
        }
    }

    /// Ids of the outliers.
    pub fn outliers(&self) -> Vec<&str> {
        self.runs.iter().filter(|run| run.outlier).map(|run| run.run.as_str()).collect()
    }

    /// Ids of the runs without a mode.
    pub fn without_mode(&self) -> Vec<&str> {
        self.runs.iter().filter(|run| run.mode.is_none()).map(|run| run.run.as_str()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::group::Grouping;
    use super::*;

    /// Three groups on a line at 0, 100 and 200, three points each.
    const LINE: [f64; 9] = [0.0, 1.0, 2.0, 100.0, 101.0, 102.0, 200.0, 201.0, 202.0];

    fn groups(points: &Points, method: Method, count: usize, smallest: usize) -> Grouping {
        let distances = points.distances();
        Grouper::new(points, &distances, method, 7, smallest).group(count)
    }

    #[test]
    fn every_method_finds_groups_that_are_apart() {
        let points = Points::on_a_line(&LINE);
        let distances = points.distances();
        for method in Method::ALL {
            let found = groups(&points, method, 3, 2).groups;
            let plain: Vec<usize> = found.iter().flatten().copied().collect();
            assert_eq!(adjusted_rand_index(&plain, &[0, 0, 0, 1, 1, 1, 2, 2, 2]), 1.0, "{method:?} {found:?}");
            assert!(silhouettes(&distances, &found).iter().all(|s| s.unwrap() > 0.97));
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_groups() {
        let points = Points { count: 40, width: 2, values: (0..80).map(|i| f64::from((i * 37) % 53)).collect() };
        for method in Method::ALL {
            assert_eq!(groups(&points, method, 5, 3).groups, groups(&points, method, 5, 3).groups);
        }
    }

    #[test]
    fn the_number_is_chosen_by_what_was_asked() {
        let tried = |count: usize, silhouette, stability| Tried { count, silhouette, stability, bic: None };
        let table = [tried(2, 0.5, Some(1.0)), tried(3, 0.6, Some(0.99)), tried(4, 0.6, Some(0.7))];
        assert_eq!(best(&table, Choose::Silhouette), 1, "a tie goes to the smaller number");
        assert_eq!(best(&table, Choose::Stability), 1, "equally stable: the larger number");
        let unknown = [tried(2, 0.5, None), tried(3, 0.6, None)];
        assert_eq!(best(&unknown, Choose::Stability), 1);
    }

    #[test]
    fn stability_knows_groups_from_none() {
        let line: Vec<f64> = (0..30).map(|i| 100.0 * f64::from(i % 3) + f64::from(i / 3)).collect();
        let even: Vec<f64> = (0..30).map(f64::from).collect();
        let of = |values: &[f64], method| {
            let points = Points::on_a_line(values);
            let distances = points.distances();
            let grouper = Grouper::new(&points, &distances, method, 1, 5);
            stability::stability(&grouper, &points, &distances, &[2, 3, 4], 1)
        };
        for method in [Method::KMeans, Method::Ward, Method::Average, Method::Mixture] {
            let groups = of(&line, method);
            assert!(groups[1] > Some(0.999) && groups[0] < Some(0.95), "{method:?} {groups:?}");
            // The fourth Gaussian loses its points.
            assert!(groups[2] < Some(0.95) || method == Method::Mixture, "{method:?} {groups:?}");
            assert!(of(&even, method)[2] < Some(0.9), "{method:?} {:?}", of(&even, method));
        }
        assert_eq!(of(&even[..9], Method::Ward), [None; 3]);
    }
}
