//! How alike a shape and a descriptor's target are, and the ranking of runs that follows.
//!
//! The paper's measure is the cosine between the target's values on J and the shape's values on J. Options change
//! what is compared (centred by the study's mean; weighted) or how (Euclidean, Mahalanobis). Ties are broken by run
//! id and state, so a ranking is reproducible.

mod scan;

use std::str::FromStr;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;
use serde::Serialize;

use crate::Error;
use crate::descriptor::Descriptor;
use crate::features::{Features, Samples};
use crate::select::Kind;
use crate::study::{Loaded, Rows, Stored};
use crate::target::Target;
use scan::{Slice, Smallest, Sums};

/// Rows that are compared at a time: what is known of them stays in the first-level cache.
const ROWS: usize = 512;
/// Rows that one thread takes at a time.
const SHARE: usize = 32 * ROWS;
/// Relative rounding of a handful of operations, generously.
const SLACK: f64 = 1e-12;

/// What is compared, and how.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SimilarityOptions {
    /// Which numbers are compared. Default: the descriptor's own kind, or the paper's where a weight or measure is asked
    /// for that only its coefficients have.
    pub kind: Option<Kind>,
    /// Subtract the mean of the last states of all runs first. Default: no, as in the paper.
    pub centred: bool,
    /// Weights of the coefficients. Default: none, as in the paper.
    pub weight: Weight,
    /// The measure. Default: cosine, the paper's.
    pub metric: Metric,
}

impl SimilarityOptions {
    /// Which of a descriptor's numbers are compared.
    pub fn kind_for(&self, descriptor: &Descriptor) -> Kind {
        // An eigenvalue of its own, and a length.
        let only_paper = self.weight == Weight::Frequency || self.metric == Metric::Euclidean;
        self.kind.unwrap_or(if only_paper { Kind::Paper } else { descriptor.kind })
    }
}

/// Weights of the coefficients before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Weight {
    /// All alike.
    #[default]
    None,
    /// √λ: fine detail counts more (the H¹ seminorm).
    Frequency,
    /// 1 / standard deviation over the last states of all runs.
    Spread,
}

/// The measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Metric {
    /// Cosine of the angle, −1 to 1.
    #[default]
    Cosine,
    /// M-weighted RMS distance on J, in the length unit (without unit when weighted); similarity 1 / (1 + distance / the target's own RMS).
    Euclidean,
    /// Distance in units of the study's spread on J, with the covariance shrunk (Ledoit and Wolf 2004), per
    /// coefficient; similarity 1 / (1 + distance).
    Mahalanobis,
}

/// An answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// −1 to 1; 1 is the same.
    pub similarity: f64,
    /// 1 − similarity; for [`Metric::Euclidean`] the distance in the length unit.
    pub distance: f64,
}

/// A state found by a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hit {
    /// Run id.
    pub run: String,
    /// State, counted from 0.
    pub state: u32,
    /// Its time.
    pub time: f64,
    /// How alike.
    #[serde(flatten)]
    pub score: Score,
}

/// Compares states with one descriptor.
#[derive(Debug, Clone)]
pub struct Comparer {
    features: Features,
    /// What is subtracted, one a feature.
    centre: Vec<f64>,
    /// What is multiplied, one a feature.
    weights: Vec<f64>,
    /// The target after all that.
    target: Vec<f64>,
    metric: Metric,
    /// Turns features into root mean square lengths: 1 / √(total mass), which is the area but for the identity as mass, for coefficients.
    to_length: f64,
    /// Inverse of the shrunk covariance.
    precision: Option<Mat<f64>>,
    /// The same comparison as one pass over stored coefficients, where the numbers are stored ones but for scale and offset.
    scan: Option<Scan>,
}

/// A comparison that goes over stored coefficients.
#[derive(Debug, Clone)]
struct Scan {
    /// One for each of [`Features::needs`].
    slices: Vec<Slice>,
    /// Σ t².
    square: f64,
}

impl Comparer {
    /// Prepares the comparison with a descriptor.
    ///
    /// # Errors
    /// [`Error::TooFewRuns`] where the options need the study's statistics and there are fewer than two runs;
    /// [`Error::Value`] for a weight that the kind does not have.
    pub fn new(loaded: &Loaded, descriptor: &Descriptor, options: SimilarityOptions) -> Result<Self, Error> {
        let SimilarityOptions { centred, weight, metric, .. } = options;
        let basis = &loaded.basis;
        let kind = options.kind_for(descriptor);
        let features = Features::of(basis, descriptor, kind)?;
        let target = features.target(descriptor);
        let needs_study = centred || weight == Weight::Spread || metric == Metric::Mahalanobis;
        let values = if needs_study {
            let samples = features.read(&loaded.study, Rows::Last)?;
            let needed = if metric == Metric::Mahalanobis { 3 } else { 2 };
            if samples.rows() < needed {
                let have = samples.rows();
                return Err(Error::TooFewRuns { what: "centring, spread or Mahalanobis", needed, have });
            }
            (0..samples.rows()).map(|row| features.vector(&samples.stored(row))).collect()
        } else {
            Vec::new()
        };
        let mean = mean_of(&values);
        let weights = match weight {
            Weight::None => vec![1.0; target.len()],
            Weight::Frequency => features.frequencies().ok_or_else(|| Error::Value {
                name: "--weight",
                value: "frequency".into(),
                expected: "none or spread: numbers of the rotation spectrum belong to bands, not to one eigenvalue (or --kind paper)".into(),
            })?,
            // A number that never varies says nothing; dividing by its zero spread would make it say everything.
            Weight::Spread => {
                let spread = spread_of(&values, &mean);
                let most = spread.iter().copied().fold(0.0, f64::max);
                // Below a hundred thousandth of the largest it is the rounding of single-precision files that varies.
                spread.iter().map(|&s| if s > 1e-5 * most { 1.0 / s } else { 0.0 }).collect()
            }
        };
        let centre = if centred { mean } else { vec![0.0; target.len()] };
        let to_length = match kind {
            Kind::Rotation => 1.0,
            Kind::Paper => 1.0 / basis.total_mass().sqrt(),
        };
        let mut comparer =
            Self { features, centre, weights, target: Vec::new(), metric, to_length, precision: None, scan: None };
        comparer.target = comparer.transform(target);
        comparer.scan = comparer.as_scan();
        if metric == Metric::Mahalanobis {
            let values = values.into_iter().map(|row| comparer.transform(row)).collect::<Vec<_>>();
            comparer.precision = Some(shrunk_precision(&values));
        }
        Ok(comparer)
    }

    /// What has to be read for [`Comparer::score`].
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// Compares a state that was named or projected.
    ///
    /// # Errors
    /// [`Error::UnknownField`] if it lacks what is compared.
    pub fn score_target(&self, target: &Target) -> Result<Score, Error> {
        Ok(self.score(&self.features.sample(target)?.stored(0)))
    }

    /// Compares one state. `stored`: one entry for each of [`Features::needs`].
    pub fn score(&self, stored: &[Stored<'_>]) -> Score {
        if let Some(scan) = &self.scan {
            let mut sums = [[0.0; 2]];
            scan.slices.iter().zip(stored).for_each(|(slice, stored)| self.add(slice, stored.values, &mut sums));
            return self.of_sums(scan, sums[0]);
        }
        let value = self.transform(self.features.vector(stored));
        match self.metric {
            Metric::Cosine => of_cosine(cosine(&self.target, &value)),
            Metric::Euclidean => self.of_distance(norm(&difference(&self.target, &value)), norm(&self.target)),
            Metric::Mahalanobis => {
                let d = difference(&self.target, &value);
                let quadratic: f64 = self.precision.as_ref().map_or(0.0, |precision| {
                    (0..d.len()).map(|i| d[i] * (0..d.len()).map(|j| precision[(i, j)] * d[j]).sum::<f64>()).sum()
                });
                let similarity = 1.0 / (1.0 + (quadratic.max(0.0) / d.len() as f64).sqrt());
                Score { similarity, distance: 1.0 - similarity }
            }
        }
    }

    fn of_distance(&self, distance: f64, own: f64) -> Score {
        let (distance, own) = (self.to_length * distance, self.to_length * own);
        Score { similarity: if distance == 0.0 { 1.0 } else { own / (own + distance) }, distance }
    }

    /// The comparison as one pass: (stored · factor + offset − centre) · weight against the target.
    fn as_scan(&self) -> Option<Scan> {
        if self.metric == Metric::Mahalanobis {
            return None;
        }
        let mut first = 0;
        let mut slices = Vec::new();
        for (factor, offset) in self.features.affine()? {
            let of = first..first + offset.len();
            let (centre, weights) = (&self.centre[of.clone()], &self.weights[of.clone()]);
            let factors: Vec<f64> = weights.iter().map(|weight| factor * weight).collect();
            let shifted = offset.iter().zip(centre).zip(weights);
            let offsets: Vec<f64> =
                shifted.map(|((offset, centre), weight)| (offset * factor - centre) * weight).collect();
            slices.push(Slice::new(&factors, &offsets, &self.target[of.clone()]));
            first = of.end;
        }
        let square = slices.iter().map(Slice::target_square).sum();
        Some(Scan { slices, square })
    }

    fn add(&self, slice: &Slice, values: &[f32], sums: &mut [Sums]) {
        match self.metric {
            Metric::Cosine => slice.add::<true>(values, sums),
            Metric::Euclidean | Metric::Mahalanobis => slice.add::<false>(values, sums),
        }
    }

    fn of_sums(&self, scan: &Scan, [first, second]: Sums) -> Score {
        match self.metric {
            Metric::Cosine => of_cosine(match (scan.square == 0.0, second == 0.0) {
                (true, true) => 1.0,
                (true, false) | (false, true) => 0.0,
                // One root, so that equal vectors give exactly 1.
                (false, false) => (first / (scan.square * second).sqrt()).clamp(-1.0, 1.0),
            }),
            Metric::Euclidean | Metric::Mahalanobis => self.of_distance(first.sqrt(), scan.square.sqrt()),
        }
    }

    fn transform(&self, mut values: Vec<f64>) -> Vec<f64> {
        for ((x, centre), weight) in values.iter_mut().zip(&self.centre).zip(&self.weights) {
            *x = (*x - centre) * weight;
        }
        values
    }

    /// The rows most like the target, `count` of them or all there are, best first; ties by run and state. The rows are
    /// read as [`Comparer::features`] say.
    pub fn best(&self, samples: &Samples, count: usize) -> Vec<Hit> {
        let rows = samples.rows();
        let share = |first: usize| {
            let (mut smallest, end) = (Smallest::new(count), (first + SHARE).min(rows));
            for first in (first..end).step_by(ROWS) {
                self.offer(samples, first..(first + ROWS).min(end), &mut smallest);
            }
            smallest
        };
        let shares: Vec<usize> = (0..rows).step_by(SHARE).collect();
        let best = shares.into_par_iter().map(share).reduce(|| Smallest::new(count), Smallest::with);
        let hit = |row: usize| Hit {
            run: samples.run(row).to_owned(),
            state: samples.state(row),
            time: samples.time(row),
            score: self.score(&samples.stored(row)),
        };
        best.rows().into_iter().map(hit).collect()
    }

    /// Compares some rows and offers those that may be among the best.
    fn offer(&self, samples: &Samples, rows: std::ops::Range<usize>, smallest: &mut Smallest) {
        let Some(scan) = &self.scan else {
            return rows.for_each(|row| smallest.offer(self.key(&self.score(&samples.stored(row))), row));
        };
        let mut sums = [[0.0; 2]; ROWS];
        let sums = &mut sums[..rows.len()];
        for (slice, block) in scan.slices.iter().zip(samples.blocks()) {
            self.add(slice, &block.values[rows.start * slice.width..rows.end * slice.width], sums);
        }
        // Most rows are passed over without a root and a division. What rounding makes of the bound is less than SLACK.
        let bound = smallest.bound();
        let (square, least) = (bound * bound, -bound);
        let floor = square * scan.square * (1.0 - SLACK);
        let ceiling = square / (self.to_length * self.to_length) * (1.0 + SLACK);
        let worth = |&[first, second]: &Sums| match self.metric {
            Metric::Cosine => least <= 0.0 || (first > 0.0 && first * first >= floor * second),
            Metric::Euclidean | Metric::Mahalanobis => first <= ceiling,
        };
        for (row, sums) in rows.zip(&*sums).filter(|(_, sums)| worth(sums)) {
            smallest.offer(self.key(&self.of_sums(scan, *sums)), row);
        }
    }

    /// What is smaller the more alike a state is.
    fn key(&self, score: &Score) -> f64 {
        if self.metric == Metric::Euclidean { score.distance } else { -score.similarity }
    }

    /// Every state of these rows against the target, best first.
    pub(crate) fn rank(&self, samples: &Samples) -> Vec<Hit> {
        self.best(samples, samples.rows())
    }
}

/// Ranks states by likeness to a descriptor, best first. `rows`: the last state of every run, or every state.
///
/// # Errors
/// As [`Comparer::new`], and reading errors.
pub fn search(
    loaded: &Loaded,
    descriptor: &Descriptor,
    options: SimilarityOptions,
    rows: Rows<'_>,
) -> Result<Vec<Hit>, Error> {
    Ok(search_best(loaded, descriptor, options, rows, usize::MAX)?.hits)
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The states most like the descriptor, best first.
    pub hits: Vec<Hit>,
    /// How many states were compared.
    pub searched: usize,
}

/// The `count` states most like a descriptor: what [`search`] gives first, without sorting the others.
///
/// # Errors
/// As [`search`].
pub fn search_best(
    loaded: &Loaded,
    descriptor: &Descriptor,
    options: SimilarityOptions,
    rows: Rows<'_>,
    count: usize,
) -> Result<Found, Error> {
    let comparer = Comparer::new(loaded, descriptor, options)?;
    let samples = comparer.features.read(&loaded.study, rows)?;
    Ok(Found { hits: comparer.best(&samples, count), searched: samples.rows() })
}

fn of_cosine(similarity: f64) -> Score {
    Score { similarity, distance: 1.0 - similarity }
}

/// Cosine of the angle between two vectors; 0 where one of them is zero (it has no direction), 1 where both are.
pub fn cosine(a: &[f64], b: &[f64]) -> f64 {
    // Divided by the largest magnitude first, so that no square overflows or vanishes.
    let most = |v: &[f64]| v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (ma, mb) = (most(a), most(b));
    if ma == 0.0 && mb == 0.0 {
        return 1.0;
    }
    if ma == 0.0 || mb == 0.0 {
        return 0.0;
    }
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        let (x, y) = (x / ma, y / mb);
        ab += x * y;
        aa += x * x;
        bb += y * y;
    }
    (ab / (aa * bb).sqrt()).clamp(-1.0, 1.0)
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn norm(a: &[f64]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Mean of the rows; empty of none.
fn mean_of(rows: &[Vec<f64>]) -> Vec<f64> {
    let mut mean = vec![0.0; rows.first().map_or(0, Vec::len)];
    for row in rows {
        mean.iter_mut().zip(row).for_each(|(mean, x)| *mean += x / rows.len() as f64);
    }
    mean
}

fn spread_of(rows: &[Vec<f64>], mean: &[f64]) -> Vec<f64> {
    let variance =
        |column: usize| rows.iter().map(|row| (row[column] - mean[column]).powi(2)).sum::<f64>() / rows.len() as f64;
    (0..mean.len()).map(|column| variance(column).sqrt()).collect()
}

/// Inverse of (1 − ρ) S + ρ μ I, with ρ from Ledoit and Wolf, "A well-conditioned estimator for large-dimensional
/// covariance matrices" (2004), lemma 3.3.
fn shrunk_precision(rows: &[Vec<f64>]) -> Mat<f64> {
    let (n, p) = (rows.len(), rows[0].len());
    let mean = mean_of(rows);
    let centred = Mat::from_fn(n, p, |row, column| rows[row][column] - mean[column]);
    let sample = (centred.transpose() * &centred) * (1.0 / n as f64);
    let mu = (0..p).map(|i| sample[(i, i)]).sum::<f64>() / p as f64;
    let square = |matrix: &Mat<f64>| (0..p).map(|j| (0..p).map(|i| matrix[(i, j)].powi(2)).sum::<f64>()).sum::<f64>();
    let identity = Mat::<f64>::identity(p, p);
    let d2 = square(&(&sample - &identity * mu)) / p as f64;
    let fourth: f64 = (0..n).map(|row| (0..p).map(|c| centred[(row, c)].powi(2)).sum::<f64>().powi(2)).sum();
    let b2 = ((fourth / n as f64 - square(&sample)) / (p as f64 * n as f64)).clamp(0.0, d2);
    let rho = if d2 > 0.0 { (b2 / d2).max(1e-9) } else { 1.0 };
    // Where nothing varies at all, distances are measured as they are.
    let mu = if mu > 0.0 { mu } else { 1.0 };
    let shrunk = sample * (1.0 - rho) + &identity * (rho * mu);
    shrunk.llt(Side::Lower).map_or_else(|_| identity.clone(), |factor| factor.solve(&identity))
}

impl FromStr for Weight {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "none" => Ok(Self::None),
            "frequency" => Ok(Self::Frequency),
            "spread" => Ok(Self::Spread),
            _ => {
                Err(Error::Value { name: "--weight", value: text.into(), expected: "none, frequency or spread".into() })
            }
        }
    }
}

impl FromStr for Metric {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "cosine" => Ok(Self::Cosine),
            "euclidean" => Ok(Self::Euclidean),
            "mahalanobis" => Ok(Self::Mahalanobis),
            _ => Err(Error::Value {
                name: "--metric",
                value: text.into(),
                expected: "cosine, euclidean or mahalanobis".into(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosine_is_defined_everywhere() {
        assert_eq!(cosine(&[1.0, 0.0], &[2.0, 0.0]), 1.0);
        assert_eq!(cosine(&[1.0, 0.0], &[-3.0, 0.0]), -1.0);
        assert_eq!(cosine(&[0.0, 0.0], &[1.0, 0.0]), 0.0);
        assert_eq!(cosine(&[0.0, 0.0], &[0.0, 0.0]), 1.0);
        // The squares of these do not fit into f64.
        assert_eq!(cosine(&[1e200, 0.0], &[1e-200, 0.0]), 1.0);
    }

    #[test]
    fn shrinking_keeps_the_precision_finite_with_fewer_rows_than_columns() {
        let rows = vec![vec![1.0, 0.0, 5.0, 2.0], vec![2.0, 0.0, 4.0, 1.0], vec![0.0, 0.0, 7.0, 2.0]];
        let precision = shrunk_precision(&rows);
        assert!((0..4).all(|i| (0..4).all(|j| precision[(i, j)].is_finite())));
        assert!((0..4).all(|i| precision[(i, i)] > 0.0));
    }
}
