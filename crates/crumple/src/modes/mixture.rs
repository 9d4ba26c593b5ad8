//! A mixture of Gaussians, fitted by expectation and maximisation (Dempster, Laird and Rubin 1977).
//!
//! A hundred runs cannot tell a covariance of many coordinates, and a Gaussian that has shrunk onto one run has an infinite
//! likelihood. So the points come in their first few principal components, and each covariance is shrunk towards that of
//! all points by the conjugate prior of Fraley and Raftery (2007), with their constants: ν = d + 2 degrees of freedom, scale
//! S / G^(2/d), mean κ = 0.01 of a point, for G Gaussians in d dimensions and S the diagonal of the points' covariance. What
//! is maximised is the posterior; the Bayesian information criterion takes the likelihood there, as they do.
//!
//! No crate: what there is (`linfa-clustering` 0.8) has no prior, and brings a second library of matrices and of random
//! numbers, some forty crates.

use faer::{Mat, Side};
use rayon::prelude::*;

use super::{Points, kmeans};

/// Largest share of the variance that the principal components leave out.
const LEFT_OUT: f64 = 0.01;
/// Most components: ten have 66 numbers a Gaussian.
const DIMENSIONS_MAX: usize = 10;
/// Starts, each from another k-means: by turns of the points as they are, where groups are round, and of the points with
/// every component scaled to the same spread, where they are long and lie side by side.
const STARTS: u64 = 10;
/// Steps of one start.
const STEPS_MAX: usize = 200;
/// It ends when a step gains less log probability than this a point.
const GAIN_MIN: f64 = 1e-7;
/// κ of the prior.
const MEAN_WEIGHT: f64 = 0.01;

/// What came of it.
pub(super) struct Mixture {
    /// The likeliest Gaussian of each point, numbered without gaps.
    pub(super) groups: Vec<usize>,
    /// Its share of the point's density, 0 to 1.
    pub(super) strength: Vec<f64>,
    /// p ln R − 2 ln L for p free parameters and R points: less is better.
    pub(super) bic: f64,
}

/// Fits `count` Gaussians. Deterministic: every start has its own k-means, ties go to the first.
pub(super) fn mixture(points: &Points, count: usize, seed: u64, starts: u64) -> Mixture {
    let runs = points.count();
    let points = points.principal(LEFT_OUT, DIMENSIONS_MAX.min(runs / 5).max(1));
    if points.width == 0 || count < 2 {
        // All points coincide, or one Gaussian has them all.
        let fit = (points.width > 0).then(|| Fit::of(&points, count, seed, 0));
        let bic = fit.map_or(0.0, |fit| fit.bic(&points));
        return Mixture { groups: vec![0; runs], strength: vec![1.0; runs], bic };
    }
    let fits: Vec<Fit> =
        (0..starts.min(STARTS)).into_par_iter().map(|start| Fit::of(&points, count, seed, start)).collect();
    let best = fits.into_iter().reduce(|best, fit| if fit.posterior > best.posterior { fit } else { best });
    let Some(best) = best else { return Mixture { groups: vec![0; runs], strength: vec![1.0; runs], bic: 0.0 } };
    let likeliest = |shares: &Vec<f64>| {
        shares.iter().enumerate().fold((0, -1.0), |best, (at, &share)| if share > best.1 { (at, share) } else { best })
    };
    let (groups, strength): (Vec<usize>, Vec<f64>) = best.shares.iter().map(likeliest).unzip();
    let mut used = groups.clone();
    used.sort_unstable();
    used.dedup();
    let groups = groups.iter().map(|group| used.binary_search(group).unwrap_or(0)).collect();
    Mixture { groups, strength, bic: best.bic(&points) }
}

/// One Gaussian.
struct Gaussian {
    weight: f64,
    mean: Vec<f64>,
    /// Inverse covariance, d × d.
    precision: Mat<f64>,
    log_determinant: f64,
}

/// The prior on every Gaussian.
struct Prior {
    mean: Vec<f64>,
    /// Diagonal of the scale.
    scale: Vec<f64>,
    freedom: f64,
}

/// The state of one start.
struct Fit {
    gaussians: Vec<Gaussian>,
    /// R × G: the share of each Gaussian in a point's density.
    shares: Vec<Vec<f64>>,
    likelihood: f64,
    posterior: f64,
}

impl Prior {
    fn of(points: &Points, count: usize) -> Self {
        let (runs, dimensions) = (points.count(), points.width);
        let mean = points.mean(&(0..runs).collect::<Vec<_>>());
        let shrink = (count as f64).powf(2.0 / dimensions as f64);
        let variance = |at: usize| (0..runs).map(|run| (points.point(run)[at] - mean[at]).powi(2)).sum::<f64>();
        let scale = (0..dimensions).map(|at| variance(at) / runs as f64 / shrink).collect();
        Self { scale, freedom: dimensions as f64 + 2.0, mean }
    }

    /// The most probable Gaussian for points of which it has these shares.
    fn gaussian(&self, points: &Points, share: impl Fn(usize) -> f64) -> Gaussian {
        let (runs, d) = (points.count(), points.width);
        let total: f64 = (0..runs).map(&share).sum();
        let centre = |at: usize| (0..runs).map(|run| share(run) * points.point(run)[at]).sum::<f64>();
        // A Gaussian that has lost all its points is the prior's.
        let centre: Vec<f64> = (0..d).map(|at| if total > 0.0 { centre(at) / total } else { self.mean[at] }).collect();
        let mean = (0..d)
            .map(|at| (total * centre[at] + MEAN_WEIGHT * self.mean[at]) / (total + MEAN_WEIGHT))
            .collect::<Vec<f64>>();
        let pull = MEAN_WEIGHT * total / (MEAN_WEIGHT + total);
        let scatter = |row: usize, column: usize| {
            let within = |run: usize| {
                share(run) * (points.point(run)[row] - centre[row]) * (points.point(run)[column] - centre[column])
            };
            let between = pull * (centre[row] - self.mean[row]) * (centre[column] - self.mean[column]);
            let scale = if row == column { self.scale[row] } else { 0.0 };
            (0..runs).map(within).sum::<f64>() + between + scale
        };
        let divisor = self.freedom + total + d as f64 + 2.0;
        let covariance = Mat::from_fn(d, d, |row, column| scatter(row, column) / divisor);
        let (precision, log_determinant) = inverse(&covariance);
        Gaussian { weight: total / runs as f64, mean, precision, log_determinant }
    }

    /// Log density of a Gaussian under the prior, but for a constant.
    fn log_density(&self, gaussian: &Gaussian) -> f64 {
        let d = self.mean.len();
        let trace: f64 = (0..d).map(|at| self.scale[at] * gaussian.precision[(at, at)]).sum();
        let off = gaussian.square_distance(&self.mean);
        -0.5 * ((self.freedom + d as f64 + 2.0) * gaussian.log_determinant + trace + MEAN_WEIGHT * off)
    }
}

/// Inverse and log determinant of a symmetric positive matrix, by its eigenvalues.
fn inverse(matrix: &Mat<f64>) -> (Mat<f64>, f64) {
    let d = matrix.nrows();
    let Ok(spectrum) = matrix.self_adjoint_eigen(Side::Lower) else { return (Mat::identity(d, d), 0.0) };
    let largest = spectrum.S()[d - 1];
    let value = |at: usize| spectrum.S()[at].max(f64::EPSILON * largest);
    let vectors = spectrum.U();
    let scaled = Mat::from_fn(d, d, |row, at| vectors[(row, at)] / value(at));
    (&scaled * vectors.transpose(), (0..d).map(|at| value(at).ln()).sum())
}

impl Gaussian {
    /// (x − μ)ᵀ Σ⁻¹ (x − μ).
    fn square_distance(&self, point: &[f64]) -> f64 {
        let off: Vec<f64> = point.iter().zip(&self.mean).map(|(x, mean)| x - mean).collect();
        let product =
            |row: usize| (0..off.len()).map(|column| self.precision[(row, column)] * off[column]).sum::<f64>();
        (0..off.len()).map(|row| off[row] * product(row)).sum()
    }

    /// Log of its weight times its density at a point.
    fn log_share(&self, point: &[f64]) -> f64 {
        let constant = point.len() as f64 * (2.0 * std::f64::consts::PI).ln();
        // A weight of zero has a logarithm of −∞, and a share of zero: no NaN.
        self.weight.ln() - 0.5 * (constant + self.log_determinant + self.square_distance(point))
    }
}

impl Fit {
    fn of(points: &Points, count: usize, seed: u64, start: u64) -> Self {
        let scaled = (start % 2 == 1).then(|| points.of_equal_spread());
        let (_, groups) = kmeans::one_start(scaled.as_ref().unwrap_or(points), count, seed, start / 2);
        let prior = Prior::of(points, count);
        let shares = groups.iter().map(|&group| (0..count).map(|at| f64::from(at == group)).collect()).collect();
        let mut fit = Self { gaussians: Vec::new(), shares, likelihood: 0.0, posterior: f64::NEG_INFINITY };
        for _ in 0..STEPS_MAX {
            let before = fit.posterior;
            fit.step(points, &prior, count);
            if fit.posterior - before < GAIN_MIN * points.count() as f64 {
                break;
            }
        }
        fit
    }

    /// Gaussians from shares, then shares from Gaussians.
    fn step(&mut self, points: &Points, prior: &Prior, count: usize) {
        self.gaussians = (0..count).map(|at| prior.gaussian(points, |run| self.shares[run][at])).collect();
        self.likelihood = 0.0;
        for (run, shares) in self.shares.iter_mut().enumerate() {
            let logs: Vec<f64> = self.gaussians.iter().map(|gaussian| gaussian.log_share(points.point(run))).collect();
            let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let total: f64 = logs.iter().map(|log| (log - most).exp()).sum();
            shares.iter_mut().zip(&logs).for_each(|(share, log)| *share = (log - most).exp() / total);
            self.likelihood += most + total.ln();
        }
        self.posterior = self.likelihood + self.gaussians.iter().map(|g| prior.log_density(g)).sum::<f64>();
    }

    fn bic(&self, points: &Points) -> f64 {
        let (count, d) = (self.gaussians.len(), points.width);
        let parameters = count * (d + d * (d + 1) / 2) + count - 1;
        parameters as f64 * (points.count() as f64).ln() - 2.0 * self.likelihood
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two long clouds side by side, which k-means cuts across: x from 0 to 40, y at 0 and at 4.
    fn long_clouds() -> Points {
        let noise = |i: usize| f64::from(((i * 7919) % 101) as u32) / 101.0 - 0.5;
        let point = |i: usize| [i as f64 / 2.0, 4.0 * (i % 2) as f64 + 1.2 * noise(i)];
        Points { count: 80, width: 2, values: (0..80).flat_map(point).collect() }
    }

    #[test]
    fn long_clouds_that_kmeans_cuts_are_told_apart() {
        let points = long_clouds();
        let planted: Vec<usize> = (0..80).map(|i| i % 2).collect();
        let index = |groups: &[usize]| super::super::adjusted_rand_index(groups, &planted);
        assert!(index(&kmeans::kmeans(&points, 2, 1, 20)) < 0.2);
        let found = mixture(&points, 2, 1, STARTS);
        assert_eq!(index(&found.groups), 1.0);
        assert!(found.strength.iter().all(|&share| (0.5..=1.0).contains(&share)));
        let bic: Vec<f64> = (1..=5).map(|count| mixture(&points, count, 1, STARTS).bic).collect();
        assert!((0..5).all(|at| at == 1 || bic[1] < bic[at]), "two is the best number: {bic:?}");
    }

    #[test]
    fn no_step_makes_the_fit_less_probable() {
        let points = long_clouds();
        for count in [1, 2, 5, 9] {
            let prior = Prior::of(&points, count);
            let shares = (0..80).map(|run| (0..count).map(|at| f64::from(at == run * 31 % count)).collect()).collect();
            let mut fit = Fit { gaussians: Vec::new(), shares, likelihood: 0.0, posterior: f64::NEG_INFINITY };
            for _ in 0..60 {
                let before = fit.posterior;
                fit.step(&points, &prior, count);
                assert!(fit.posterior >= before - 1e-9 * before.abs(), "{count}: {before} then {}", fit.posterior);
                assert!(fit.shares.iter().all(|shares| (shares.iter().sum::<f64>() - 1.0).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn points_that_coincide_and_more_gaussians_than_points_give_numbers() {
        for (points, count) in [(Points::on_a_line(&[3.0; 6]), 3), (Points::on_a_line(&[0.0, 0.0, 9.0]), 3)] {
            let found = mixture(&points, count, 1, STARTS);
            assert!(found.bic.is_finite() && found.strength.iter().all(|x| x.is_finite()));
            assert!(found.groups.iter().all(|&group| group < 3));
        }
    }
}
