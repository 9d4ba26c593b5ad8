//! k-means: Lloyd's iteration from k-means++ starts (Arthur and Vassilvitskii 2007), the best of several.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{Points, square_distance};

/// Starts that are tried.
pub(super) const STARTS: u64 = 20;
/// Iterations of one start; Lloyd's iteration on a few hundred points ends after a few dozen.
const ITERATIONS_MAX: usize = 300;

/// The group of each point. The result depends on the seed, not on the number of threads: each start has its own
/// stream of random numbers, and the best is taken by sum of squares, ties by the order of the starts.
pub(super) fn kmeans(points: &Points, count: usize, seed: u64, starts: u64) -> Vec<usize> {
    let runs: Vec<(f64, Vec<usize>)> =
        (0..starts).into_par_iter().map(|start| one_start(points, count, seed, start)).collect();
    let best = runs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, groups)| groups).unwrap_or_default()
}

/// Sum of squares and groups from one start.
pub(super) fn one_start(points: &Points, count: usize, seed: u64, start: u64) -> (f64, Vec<usize>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(start);
    lloyd(points, plus_plus(points, count, &mut random))
}

/// Starting centres: each next one with a probability proportional to its squared distance from those before.
fn plus_plus(points: &Points, count: usize, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let first = random.random_range(0..points.count());
    let mut centres = vec![points.point(first).to_vec()];
    let mut nearest: Vec<f64> =
        (0..points.count()).map(|run| square_distance(points.point(run), &centres[0])).collect();
    while centres.len() < count {
        let total: f64 = nearest.iter().sum();
        let mut left = random.random::<f64>() * total;
        // Where all points coincide with a centre already, any point will do.
        let chosen = nearest.iter().position(|&d| {
            left -= d;
            left < 0.0
        });
        let centre = points.point(chosen.unwrap_or(points.count() - 1)).to_vec();
        for (run, nearest) in nearest.iter_mut().enumerate() {
            *nearest = nearest.min(square_distance(points.point(run), &centre));
        }
        centres.push(centre);
    }
    centres
}

fn lloyd(points: &Points, mut centres: Vec<Vec<f64>>) -> (f64, Vec<usize>) {
    let mut groups = vec![usize::MAX; points.count()];
    let mut total = f64::INFINITY;
    for _ in 0..ITERATIONS_MAX {
        let nearest = |run: usize| {
            let distances = centres.iter().map(|centre| square_distance(points.point(run), centre));
            distances
                .enumerate()
                .fold((0, f64::INFINITY), |best, (group, d)| if d < best.1 { (group, d) } else { best })
        };
        let assigned: Vec<(usize, f64)> = (0..points.count()).map(nearest).collect();
        total = assigned.iter().map(|(_, d)| d).sum();
        let next: Vec<usize> = assigned.iter().map(|(group, _)| *group).collect();
        if next == groups {
            break;
        }
        groups = next;
        move_centres(points, &groups, &assigned, &mut centres);
    }
    (total, groups)
}

/// Each centre to the mean of its points; one without points to the point that is farthest from its own centre.
fn move_centres(points: &Points, groups: &[usize], assigned: &[(usize, f64)], centres: &mut [Vec<f64>]) {
    let mut sizes = vec![0_usize; centres.len()];
    groups.iter().for_each(|&group| sizes[group] += 1);
    for (centre, &size) in centres.iter_mut().zip(&sizes) {
        if size > 0 {
            centre.fill(0.0);
        }
    }
    for (run, &group) in groups.iter().enumerate() {
        centres[group].iter_mut().zip(points.point(run)).for_each(|(mean, x)| *mean += x / sizes[group] as f64);
    }
    let mut farthest: Vec<usize> = (0..points.count()).collect();
    farthest.sort_by(|&a, &b| assigned[b].1.total_cmp(&assigned[a].1).then(a.cmp(&b)));
    let mut farthest = farthest.into_iter();
    for (centre, _) in centres.iter_mut().zip(&sizes).filter(|(_, size)| **size == 0) {
        if let Some(run) = farthest.next() {
            *centre = points.point(run).to_vec();
        }
    }
}
