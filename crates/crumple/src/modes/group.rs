//! Points into groups, by the method that is asked for.

use super::agglomerative::{Linkage, Merges, agglomerate};
use super::hdbscan::hdbscan;
use super::kmeans::{self, kmeans};
use super::mixture::mixture;
use super::{Distances, Method, Points};

/// The variance that k-means may do without: principal components with all but this share stand for the points, which at
/// thousands of runs is a tenth of the work and less.
const LEFT_OUT: f64 = 1e-4;
/// Starts of k-means and of mixtures for a resample, where nobody looks at the groups themselves.
const STARTS_OF_RESAMPLES: u64 = 5;

/// A grouping.
pub(super) struct Grouping {
    /// The group of each run, numbered without gaps; `None` for a run that belongs to none.
    pub(super) groups: Vec<Option<usize>>,
    /// How firmly it belongs, 0 to 1, where the method says.
    pub(super) strength: Option<Vec<f64>>,
    /// Bayesian information criterion, of a mixture.
    pub(super) bic: Option<f64>,
}

impl Grouping {
    /// Number of groups.
    pub(super) fn count(&self) -> usize {
        self.groups.iter().flatten().max().map_or(0, |most| most + 1)
    }
}

/// Points that are ready to be grouped into any number of groups.
pub(super) struct Grouper<'a> {
    distances: &'a Distances,
    method: Method,
    seed: u64,
    starts: u64,
    smallest: usize,
    /// For k-means and mixtures.
    reduced: Option<Points>,
    /// For agglomeration.
    merges: Option<Merges>,
}

impl<'a> Grouper<'a> {
    pub(super) fn new(points: &Points, distances: &'a Distances, method: Method, seed: u64, smallest: usize) -> Self {
        let reduced = matches!(method, Method::KMeans | Method::Mixture);
        let linkage = match method {
            Method::Ward => Some(Linkage::Ward),
            Method::Average => Some(Linkage::Average),
            _ => None,
        };
        Self {
            distances,
            method,
            seed,
            starts: kmeans::STARTS,
            smallest,
            reduced: reduced.then(|| points.principal(LEFT_OUT, usize::MAX)),
            merges: linkage.map(|linkage| agglomerate(distances, linkage)),
        }
    }

    /// For some of the runs; `distances` are those between them.
    pub(super) fn resample(&self, runs: &[usize], points: &Points, distances: &'a Distances) -> Grouper<'a> {
        let linkage = if self.method == Method::Ward { Linkage::Ward } else { Linkage::Average };
        Grouper {
            distances,
            starts: STARTS_OF_RESAMPLES,
            reduced: self.reduced.as_ref().map(|_| points.some(runs)),
            merges: self.merges.as_ref().map(|_| agglomerate(distances, linkage)),
            ..*self
        }
    }

    /// The points that k-means sees.
    pub(super) fn reduced(&self) -> Option<&Points> {
        self.reduced.as_ref()
    }

    /// Groups; `count` of them or fewer where points coincide, as many as there are for HDBSCAN.
    pub(super) fn group(&self, count: usize) -> Grouping {
        let plain = |groups: Vec<usize>| Grouping { groups: gapless(&groups), strength: None, bic: None };
        match (self.method, &self.reduced, &self.merges) {
            (Method::KMeans, Some(points), _) => plain(kmeans(points, count, self.seed, self.starts)),
            (Method::Mixture, Some(points), _) => {
                let found = mixture(points, count, self.seed, self.starts);
                Grouping { strength: Some(found.strength), bic: Some(found.bic), ..plain(found.groups) }
            }
            (_, _, Some(merges)) => plain(merges.groups(count)),
            _ => {
                let found = hdbscan(self.distances, self.smallest);
                Grouping { groups: found.groups, strength: Some(found.strength), bic: None }
            }
        }
    }
}

fn gapless(groups: &[usize]) -> Vec<Option<usize>> {
    let mut used = groups.to_vec();
    used.sort_unstable();
    used.dedup();
    groups.iter().map(|group| used.binary_search(group).ok()).collect()
}
