//! Do the groups come back when runs are left out? Stability under resampling (Ben-Hur, Elisseeff and Guyon 2002).
//!
//! Groups that a sample of the runs shows must be those that another sample shows, or they are the method's, not the
//! runs'. Samples of four fifths of the runs are grouped anew; two of them share runs, on which their groups are compared
//! by the adjusted Rand index.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::group::Grouper;
use super::{Distances, Points, adjusted_rand_index};

/// Samples; 20 have 190 pairs.
const SAMPLES: u64 = 20;
/// Share of the runs in a sample.
const SHARE: f64 = 0.8;
/// Of more runs than this, as many are drawn once and resampled: the mean over the pairs is known to two digits from them.
const RUNS_MAX: usize = 1000;
/// Fewer runs than this cannot do without a fifth.
pub(super) const RUNS_MIN: usize = 10;

/// For each number of groups the mean index over all pairs of samples; `None` where there are too few runs to say.
pub(super) fn stability(
    grouper: &Grouper<'_>,
    points: &Points,
    distances: &Distances,
    counts: &[usize],
    seed: u64,
) -> Vec<Option<f64>> {
    let runs = points.count();
    if runs < RUNS_MIN {
        return vec![None; counts.len()];
    }
    let drawn = draw(runs, runs.min(RUNS_MAX), seed, SAMPLES);
    let size = (SHARE * drawn.len() as f64).round() as usize;
    // Sample → number → the group of each run; a run outside the sample has none, one without a group has the last.
    let samples: Vec<Vec<Vec<Option<usize>>>> = (0..SAMPLES)
        .into_par_iter()
        .map(|sample| {
            let chosen: Vec<usize> = draw(drawn.len(), size, seed, sample).into_iter().map(|at| drawn[at]).collect();
            let between = distances.some(&chosen);
            let grouper = grouper.resample(&chosen, grouper.reduced().unwrap_or(points), &between);
            let group = |&count: &usize| {
                let mut of = vec![None; runs];
                let found = grouper.group(count).groups;
                chosen.iter().zip(found).for_each(|(&run, group)| of[run] = Some(group.unwrap_or(usize::MAX)));
                of
            };
            counts.iter().map(group).collect()
        })
        .collect();
    let mean = |at: usize| {
        let pairs: Vec<(usize, usize)> = (0..samples.len()).flat_map(|b| (0..b).map(move |a| (a, b))).collect();
        let agree = |&(a, b): &(usize, usize)| {
            let shared = samples[a][at].iter().zip(&samples[b][at]).filter_map(|(&a, &b)| Some((a?, b?)));
            let (a, b): (Vec<usize>, Vec<usize>) = shared.unzip();
            adjusted_rand_index(&a, &b)
        };
        pairs.iter().map(agree).sum::<f64>() / pairs.len() as f64
    };
    // As many groups as a sample has runs say nothing.
    (0..counts.len()).map(|at| (counts[at] < size).then(|| mean(at))).collect()
}

/// `size` of the numbers below `count`, rising, without repeats; each stream its own.
pub(super) fn draw(count: usize, size: usize, seed: u64, stream: u64) -> Vec<usize> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    let mut all: Vec<usize> = (0..count).collect();
    for at in 0..size.min(count) {
        let other = random.random_range(at..count);
        all.swap(at, other);
    }
    all.truncate(size);
    all.sort_unstable();
    all
}
