//! How good a grouping is: silhouettes (Rousseeuw 1987), and the adjusted Rand index (Hubert and Arabie 1985).

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Distances;

/// (b − a) / max(a, b) for each run: a the mean distance to the others of its group, b the mean distance to the
/// nearest other group. 0 for a run that is alone in its group, and for a single group; none for a run without a group,
/// which counts for no other run either.
pub(crate) fn silhouettes(distances: &Distances, groups: &[Option<usize>]) -> Vec<Option<f64>> {
    let count = groups.iter().flatten().max().map_or(0, |most| most + 1);
    let mut sizes = vec![0_usize; count];
    groups.iter().flatten().for_each(|&group| sizes[group] += 1);
    let of = |run: usize| {
        let own = groups[run]?;
        let mut sums = vec![0.0; count];
        for (other, group) in groups.iter().enumerate() {
            if let Some(group) = *group {
                sums[group] += distances.between(run, other);
            }
        }
        if sizes[own] < 2 {
            return Some(0.0);
        }
        let a = sums[own] / (sizes[own] - 1) as f64;
        let others = (0..count).filter(|&group| group != own && sizes[group] > 0);
        let b = others.map(|group| sums[group] / sizes[group] as f64).fold(f64::INFINITY, f64::min);
        Some(if b.is_infinite() || a.max(b) == 0.0 { 0.0 } else { (b - a) / a.max(b) })
    };
    (0..groups.len()).into_par_iter().map(of).collect()
}

/// The mean over the runs that have a group; 0 where none has.
pub(super) fn mean_silhouette(values: &[Option<f64>]) -> f64 {
    let count = values.iter().flatten().count();
    values.iter().flatten().sum::<f64>() / count.max(1) as f64
}
/// Agreement of two groupings of the same things, 1 when they are the same, about 0 when they are independent.
pub fn adjusted_rand_index(a: &[usize], b: &[usize]) -> f64 {
    let pairs = |n: usize| (n * n.saturating_sub(1)) as f64 / 2.0;
    let mut table: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let (mut rows, mut columns): (BTreeMap<usize, usize>, BTreeMap<usize, usize>) = Default::default();
    for (&a, &b) in a.iter().zip(b) {
        *table.entry((a, b)).or_default() += 1;
        *rows.entry(a).or_default() += 1;
        *columns.entry(b).or_default() += 1;
    }
    let together: f64 = table.values().map(|&n| pairs(n)).sum();
    let (in_a, in_b): (f64, f64) = (rows.values().map(|&n| pairs(n)).sum(), columns.values().map(|&n| pairs(n)).sum());
    let expected = in_a * in_b / pairs(a.len()).max(1.0);
    let most = (in_a + in_b) / 2.0;
    if most == expected { 1.0 } else { (together - expected) / (most - expected) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_does_not_depend_on_names_and_knows_chance() {
        assert_eq!(adjusted_rand_index(&[0, 0, 1, 1], &[5, 5, 2, 2]), 1.0);
        // Rounding of a handful of operations on small numbers.
        assert!((adjusted_rand_index(&[0, 0, 1, 1], &[0, 1, 0, 1]) + 0.5).abs() < 1e-15);
        // Hubert and Arabie's formula by hand: 2 pairs together, expected 4·4/15, most 4.
        let value = adjusted_rand_index(&[0, 0, 0, 1, 1, 2], &[0, 0, 1, 1, 1, 1]);
        let (together, a, b, all) = (2.0, 4.0, 7.0, 15.0);
        assert!((value - (together - a * b / all) / ((a + b) / 2.0 - a * b / all)).abs() < 1e-15);
    }
}
