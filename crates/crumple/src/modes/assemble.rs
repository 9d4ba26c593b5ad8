//! From groups to modes: names by size, medoids, spread, outliers.

use super::group::Grouping;
use super::names::numbered;
use super::states::Sampled;
use super::{Distances, Membership, Mode, Modes, ModesOptions, Points, silhouettes};

/// Scores above this make an outlier.
const OUTLIER: f64 = 3.0;
/// Modes of fewer runs have no outliers: a median of four distances says little.
const RUNS_MIN: usize = 5;

pub(super) fn assemble(
    sampled: &Sampled,
    points: &Points,
    distances: &Distances,
    grouping: &Grouping,
    options: &ModesOptions,
) -> Modes {
    let runs = &sampled.runs;
    let values = silhouettes(distances, &grouping.groups);
    let mut found: Vec<Group> = (0..grouping.count())
        .map(|group| (0..runs.len()).filter(|&run| grouping.groups[run] == Some(group)).collect::<Vec<_>>())
        .filter(|members| !members.is_empty())
        .map(|members| Group::of(members, points, distances))
        .collect();
    found.sort_by(|a, b| b.members.len().cmp(&a.members.len()).then(runs[a.medoid].cmp(&runs[b.medoid])));
    let strength = |run: usize| grouping.strength.as_ref().map(|strength| strength[run]);
    let mut modes = Vec::new();
    let mut memberships = Vec::new();
    for (at, group) in found.iter().enumerate() {
        let name = numbered(at);
        for (&run, &off) in group.members.iter().zip(&group.off) {
            let score = group.score(off);
            memberships.push(Membership {
                run: runs[run].clone(),
                mode: Some(name.clone()),
                distance: Some(distances.between(run, group.medoid)),
                silhouette: values[run],
                strength: strength(run),
                score,
                outlier: score.is_some_and(|score| score > OUTLIER),
            });
        }
        let size = group.members.len() as f64;
        modes.push(Mode {
            name,
            medoid: runs[group.medoid].clone(),
            members: group.members.iter().map(|&run| runs[run].clone()).collect(),
            silhouette: group.members.iter().filter_map(|&run| values[run]).sum::<f64>() / size,
            spread: (group.off.iter().map(|d| d * d).sum::<f64>() / size).sqrt(),
            inputs: Vec::new(),
        });
    }
    for run in (0..runs.len()).filter(|&run| grouping.groups[run].is_none()) {
        let scores = found.iter().filter_map(|group| group.score(points.distance_to(run, &group.mean)));
        memberships.push(outside(&runs[run], scores.reduce(f64::min), strength(run)));
    }
    memberships.extend(sampled.left_out.iter().map(|run| outside(run, None, None)));
    memberships.sort_by(|a, b| a.run.cmp(&b.run));
    Modes {
        by: options.by,
        states: options.states.clone(),
        method: options.method,
        seed: options.seed,
        given: options.count.is_some(),
        choose: options.choose,
        modes,
        runs: memberships,
        tried: Vec::new(),
        partings: Vec::new(),
        names: Vec::new(),
        notes: sampled.notes.clone(),
    }
}

fn outside(run: &str, score: Option<f64>, strength: Option<f64>) -> Membership {
    Membership { run: run.to_owned(), mode: None, distance: None, silhouette: None, strength, score, outlier: false }
}

/// The members of a mode, and how far each is from their mean.
struct Group {
    members: Vec<usize>,
    medoid: usize,
    mean: Vec<f64>,
    off: Vec<f64>,
}

impl Group {
    fn of(members: Vec<usize>, points: &Points, distances: &Distances) -> Self {
        let medoid = medoid(distances, &members);
        let (mean, off) = (points.mean(&members), points.distances_to_mean(&members));
        Self { members, medoid, mean, off }
    }

    /// How many robust standard deviations a distance to the mean is above the median of the members'.
    fn score(&self, off: f64) -> Option<f64> {
        if self.off.len() < RUNS_MIN {
            return None;
        }
        let centre = median(self.off.clone());
        let deviations: Vec<f64> = self.off.iter().map(|d| (d - centre).abs()).collect();
        let mean = deviations.iter().sum::<f64>() / deviations.len() as f64;
        // Of a normal distribution the standard deviation is 1.4826 × the median absolute deviation and 1.2533 × the mean
        // one, which stands in where more than half of the runs are equal (Iglewicz and Hoaglin 1993).
        let robust = 1.4826 * median(deviations);
        let scale = if robust > 0.0 { robust } else { 1.2533 * mean };
        Some(if scale > 0.0 { (off - centre) / scale } else { 0.0 })
    }
}

/// The member with the smallest mean distance to the others; ties by order, which is by run id.
pub(crate) fn medoid(distances: &Distances, members: &[usize]) -> usize {
    let total = |&run: &usize| (members.iter().map(|&other| distances.between(run, other)).sum::<f64>(), run);
    members.iter().map(total).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, run)| run)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len().is_multiple_of(2) { (values[middle - 1] + values[middle]) / 2.0 } else { values[middle] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(values: &[f64]) -> Vec<Option<f64>> {
        let points = Points::on_a_line(values);
        let group = Group::of((0..values.len()).collect(), &points, &points.distances());
        group.off.iter().map(|&off| group.score(off)).collect()
    }

    #[test]
    fn the_medoid_is_in_the_middle_and_outliers_are_far() {
        let values = [0.0, 1.0, 2.0, 3.0, 4.0, 60.0];
        assert_eq!(medoid(&Points::on_a_line(&values).distances(), &[0, 1, 2, 3, 4, 5]), 2);
        let outlier: Vec<bool> = scores(&values).iter().map(|score| score.unwrap() > OUTLIER).collect();
        assert_eq!(outlier, [false, false, false, false, false, true]);
        assert_eq!(scores(&values[..4]), [None; 4]);
    }

    #[test]
    fn one_of_many_equal_runs_that_differs_is_an_outlier_and_none_of_equal_ones_is() {
        let mut values = [2.5; 9];
        assert_eq!(scores(&values), [Some(0.0); 9]);
        values[4] = 3.5;
        let outlier: Vec<bool> = scores(&values).iter().map(|score| score.unwrap() > OUTLIER).collect();
        assert_eq!(outlier.iter().position(|&outlier| outlier), Some(4), "{:?}", scores(&values));
        assert_eq!(outlier.iter().filter(|&&outlier| outlier).count(), 1);
    }
}
