//! From which state on two modes are apart: when could one have known?
//!
//! At each station of time the runs of two modes are looked at as they are grouped, with the coefficients of that moment
//! alone. They are apart when the nearest other run of nine in ten is one of the same mode (leave-one-out nearest
//! neighbour), from that station to the last one. Chance has one half.

use serde::{Deserialize, Serialize};

use super::states::{Histories, History, common_reach};
use super::{Along, By, Distances, Mode, Points};
use crate::Error;
use crate::basis::Basis;
use crate::study::Study;

/// Balanced share of nearest neighbours that are of the own mode, from which two modes count as apart.
pub const APART: f64 = 0.9;
/// Fewer runs than this have no neighbours to speak of.
const RUNS_MIN: usize = 3;
/// Members of a mode that are looked at, evenly spaced by run id.
const RUNS_MAX: usize = 100;
/// Modes that are looked at, the largest: HDBSCAN may find hundreds among thousands of runs.
const MODES_MAX: usize = 20;
/// Coefficients of all states that are read for it; more than a gigabyte is left.
const VALUES_MAX: usize = 250_000_000;

/// From when on two modes are apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parting {
    /// The two modes.
    pub modes: [String; 2],
    /// Time from which on they stay apart; none where they never are, or where a mode has fewer than 3 runs.
    pub time: Option<f64>,
    /// The state of the first mode's medoid at that time, counted from 0.
    pub state: Option<usize>,
    /// At each station, what the judgement rests on.
    pub evidence: Vec<Apart>,
}

/// How far apart two modes are at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Apart {
    /// The time.
    pub time: f64,
    /// Share of the runs whose nearest neighbour is of their own mode, mean of the two modes; 0.5 is chance.
    pub apart: f64,
}

/// All pairs of the twenty largest modes; or words that say why none was looked at.
///
/// # Errors
/// Reading errors.
pub(super) fn partings(
    study: &Study,
    by: By,
    basis: &Basis,
    modes: &[Mode],
) -> Result<Result<Vec<Parting>, String>, Error> {
    // The largest come first.
    let modes = &modes[..modes.len().min(MODES_MAX)];
    let records = &study.manifest().runs;
    let states: usize = records.values().map(|run| run.times.len()).sum();
    if modes.len() < 2 || states == records.len() {
        // One state a run: they are apart in it, or they would not be modes.
        return Ok(Ok(Vec::new()));
    }
    if states.saturating_mul(3 * study.manifest().eigenpairs) > VALUES_MAX {
        return Ok(Err(format!("{states} states are too many to look for the state at which modes part")));
    }
    let read = |by: By| Ok((by, Histories::read(study, by, Along::Time, basis.total_mass())?));
    let each: Vec<(By, Histories)> = by.each().into_iter().map(read).collect::<Result<_, Error>>()?;
    let histories = &each[0].1;
    let of_run =
        |id: &String| histories.runs.binary_search_by(|run| run.run.cmp(id)).ok().map(|at| &histories.runs[at]);
    let mut runs: Vec<&History> = Vec::new();
    let mut members: Vec<Vec<usize>> = Vec::new();
    for mode in modes {
        let step = mode.members.len().div_ceil(RUNS_MAX).max(1);
        let first = runs.len();
        runs.extend(mode.members.iter().step_by(step).filter_map(of_run));
        members.push((first..runs.len()).collect());
    }
    let common = common_reach(&runs.iter().map(|run| run.reach()).collect::<Vec<_>>());
    let stations: Vec<f64> = of_run(&modes[0].medoid)
        .map(|medoid| medoid.progress.iter().copied().filter(|&time| time > 0.0 && time <= common * 1.01).collect())
        .unwrap_or_default();
    let pairs: Vec<(usize, usize)> = (0..modes.len()).flat_map(|a| (a + 1..modes.len()).map(move |b| (a, b))).collect();
    let mut evidence: Vec<Vec<Apart>> = vec![Vec::new(); pairs.len()];
    for &time in &stations {
        // Every function has the same states of the same runs.
        let points = each.iter().map(|(by, histories)| Points::of(*by, &histories.at(&runs, &[time]), 1, basis));
        let distances = Points::together(points.collect()).distances();
        for (&(a, b), evidence) in pairs.iter().zip(&mut evidence) {
            let (a, b) = (&members[a], &members[b]);
            if a.len() >= RUNS_MIN && b.len() >= RUNS_MIN {
                evidence
                    .push(Apart { time, apart: (own_nearest(&distances, a, b) + own_nearest(&distances, b, a)) / 2.0 });
            }
        }
    }
    let parting = |(&(a, b), evidence): (&(usize, usize), Vec<Apart>)| {
        let together = evidence.iter().rposition(|apart| apart.apart < APART);
        let time = evidence.get(together.map_or(0, |at| at + 1)).map(|apart| apart.time);
        let state = time.and_then(|time| nearest(&of_run(&modes[a].medoid)?.progress, time));
        Parting { modes: [modes[a].name.clone(), modes[b].name.clone()], time, state, evidence }
    };
    Ok(Ok(pairs.iter().zip(evidence).map(parting).collect()))
}

/// The state whose time is nearest.
fn nearest(times: &[f64], time: f64) -> Option<usize> {
    (0..times.len()).min_by(|&a, &b| (times[a] - time).abs().total_cmp(&(times[b] - time).abs()))
}

/// Share of `own` whose nearest other run is of `own`; a tie is half a run.
fn own_nearest(distances: &Distances, own: &[usize], other: &[usize]) -> f64 {
    let nearest = |run: usize, among: &[usize]| {
        among
            .iter()
            .filter(|&&near| near != run)
            .map(|&near| distances.between(run, near))
            .fold(f64::INFINITY, f64::min)
    };
    let right = |&run: &usize| match nearest(run, own).total_cmp(&nearest(run, other)) {
        std::cmp::Ordering::Less => 1.0,
        std::cmp::Ordering::Equal => 0.5,
        std::cmp::Ordering::Greater => 0.0,
    };
    own.iter().map(right).sum::<f64>() / own.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_tell_groups_that_are_apart_and_coincidence_is_chance() {
        let share =
            |values: &[f64], a: &[usize], b: &[usize]| own_nearest(&Points::on_a_line(values).distances(), a, b);
        assert_eq!(share(&[0.0, 1.0, 2.0, 9.0, 9.5, 10.5], &[0, 1, 2], &[3, 4, 5]), 1.0);
        assert_eq!(share(&[5.0; 6], &[0, 1, 2], &[3, 4, 5]), 0.5);
        // 0 and 2 have 1 nearest, which is of the other kind.
        assert_eq!(share(&[0.0, 1.0, 2.0, 3.1], &[0, 2], &[1, 3]), 0.0);
    }
}
