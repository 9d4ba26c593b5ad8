//! Two groups of values: how far apart they are, and how likely chance alone would set them that far apart.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Cliff's δ (1993): the share of pairs in which the value of `own` is larger less the share in which it is smaller,
/// −1 to 1; 0 for groups that overlap entirely. 2 AUC − 1 of the receiver operating characteristic.
pub(super) fn cliffs_delta(own: &[f64], rest: &[f64]) -> f64 {
    let pairs = (own.len() * rest.len()) as f64;
    if pairs == 0.0 { 0.0 } else { 2.0 * rank_sum(own, rest).0 / pairs - 1.0 }
}

/// Two-sided p of the rank-sum test (Wilcoxon 1945; Mann and Whitney 1947). Exact without ties where both groups are
/// small; else the normal approximation with the correction for ties and for continuity.
pub(super) fn rank_sum_p(own: &[f64], rest: &[f64]) -> f64 {
    let (u, ties) = rank_sum(own, rest);
    let (m, n) = (own.len(), rest.len());
    if m == 0 || n == 0 {
        return 1.0;
    }
    if ties == 0.0 && m.min(n) <= 8 && m + n <= 60 {
        return exact_p(u, m, n);
    }
    let (mf, nf) = (m as f64, n as f64);
    let total = mf + nf;
    let variance = mf * nf / 12.0 * (total + 1.0 - ties / (total * (total - 1.0)));
    let off = ((u - mf * nf / 2.0).abs() - 0.5).max(0.0);
    if variance <= 0.0 { 1.0 } else { erfc(off / variance.sqrt() / std::f64::consts::SQRT_2).min(1.0) }
}

/// U (pairs in which `own` is larger, ties one half), and Σ t³ − t over groups of t equal values.
fn rank_sum(own: &[f64], rest: &[f64]) -> (f64, f64) {
    let mut all: Vec<(f64, bool)> = own.iter().map(|&x| (x, true)).chain(rest.iter().map(|&x| (x, false))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut u, mut ties, mut smaller) = (0.0, 0.0, 0.0);
    for equal in all.chunk_by(|a, b| a.0 == b.0) {
        let ours = equal.iter().filter(|(_, own)| *own).count() as f64;
        let t = equal.len() as f64;
        u += ours * (smaller + (t - ours) / 2.0);
        smaller += t - ours;
        ties += t * t * t - t;
    }
    (u, ties)
}

/// Share of all ways to choose m of m + n ranks whose U is at least as far from its mean.
fn exact_p(u: f64, m: usize, n: usize) -> f64 {
    let (m, n) = (m.min(n), m.max(n));
    // ways[k][s]: choices of k of the ranks so far with U = s; a rank that is chosen as the k-th has all earlier ones that
    // are not chosen below it.
    let mut ways = vec![vec![0.0_f64; m * n + 1]; m + 1];
    ways[0][0] = 1.0;
    for rank in 0..m + n {
        for k in (1..=m.min(rank + 1)).rev() {
            let below = rank + 1 - k;
            if below <= n {
                for s in below..=m * n {
                    let more = ways[k - 1][s - below];
                    ways[k][s] += more;
                }
            }
        }
    }
    let middle = (m * n) as f64 / 2.0;
    let far = |s: usize| (s as f64 - middle).abs() >= (u - middle).abs() - 1e-9;
    let total: f64 = ways[m].iter().sum();
    ways[m].iter().enumerate().filter(|(s, _)| far(*s)).map(|(_, ways)| ways).sum::<f64>() / total
}

/// Complementary error function: Numerical Recipes' Chebyshev fit in exp(−x²) form (Press et al. 2007, 6.2.2), relative
/// error below 1.2e-7.
fn erfc(x: f64) -> f64 {
    let z = x.abs();
    let t = 2.0 / (2.0 + z);
    let coefficients = [
        -1.265_512_23,
        1.000_023_68,
        0.374_091_96,
        0.096_784_18,
        -0.186_288_06,
        0.278_868_07,
        -1.135_203_98,
        1.488_515_87,
        -0.822_152_23,
        0.170_872_77,
    ];
    let sum = coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let value = t * (-z * z + sum).exp();
    if x >= 0.0 { value } else { 2.0 - value }
}

/// Cramér's V (1946) of a table of categories × (own, rest), less the bias of small numbers (Bergsma 2013): 0 for none,
/// 1 for a category that decides.
pub(super) fn cramers_v(own: &[&str], rest: &[&str]) -> f64 {
    let table = table(own, rest);
    let total = (own.len() + rest.len()) as f64;
    let rows = table.len() as f64;
    if table.len() < 2 || own.is_empty() || rest.is_empty() {
        return 0.0;
    }
    let free = rows - 1.0;
    let phi = (chi_square(&table, own.len(), rest.len()) / total - free / (total - 1.0)).max(0.0);
    // With two columns the smaller dimension is two, of which the correction leaves 2 − 1/(total − 1).
    let rows = rows - free * free / (total - 1.0);
    let least = (rows.min(2.0 - 1.0 / (total - 1.0)) - 1.0).max(0.0);
    if least > 0.0 { (phi / least).sqrt().min(1.0) } else { 0.0 }
}

fn table(own: &[&str], rest: &[&str]) -> Vec<[usize; 2]> {
    let mut table: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    own.iter().for_each(|&value| table.entry(value).or_default()[0] += 1);
    rest.iter().for_each(|&value| table.entry(value).or_default()[1] += 1);
    table.into_values().collect()
}

fn chi_square(table: &[[usize; 2]], own: usize, rest: usize) -> f64 {
    let total = (own + rest) as f64;
    let cell = |row: &[usize; 2]| {
        let sum = (row[0] + row[1]) as f64;
        let term = |seen: usize, column: usize| {
            let expected = sum * column as f64 / total;
            (seen as f64 - expected).powi(2) / expected
        };
        term(row[0], own) + term(row[1], rest)
    };
    table.iter().map(cell).sum()
}

/// p of the categories by permutation: the share of random divisions of the same runs whose χ² is as large. With few runs,
/// or many categories, the χ² distribution does not hold; this does.
pub(super) fn categories_p(own: &[&str], rest: &[&str], seed: u64) -> f64 {
    // Ten thousand, fewer of many values: what takes ten million draws shows in a thousand divisions as well.
    let permutations = (10_000_000 / (own.len() + rest.len()).max(1)).clamp(999, 9999);
    if own.is_empty() || rest.is_empty() {
        return 1.0;
    }
    let seen = chi_square(&table(own, rest), own.len(), rest.len());
    let mut names: Vec<&str> = own.iter().chain(rest).copied().collect();
    names.sort_unstable();
    names.dedup();
    let mut all: Vec<usize> = own.iter().chain(rest).map(|value| names.binary_search(value).unwrap_or(0)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut as_large = 0;
    for _ in 0..permutations {
        let mut table = vec![[0, 0]; names.len()];
        for at in 0..all.len() {
            let other = random.random_range(at..all.len());
            all.swap(at, other);
            table[all[at]][usize::from(at >= own.len())] += 1;
        }
        as_large += usize::from(chi_square(&table, own.len(), rest.len()) >= seen * (1.0 - 1e-12));
    }
    // The division that was seen is one of them (Phipson and Smyth 2010).
    (as_large + 1) as f64 / (permutations + 1) as f64
}

/// p values adjusted for their number, so that of those below q a share of at most q is wrong (Benjamini and Hochberg 1995).
pub(super) fn adjusted(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[b].total_cmp(&p[a]));
    let mut result = vec![1.0; p.len()];
    let mut least = 1.0_f64;
    for (from_the_top, &at) in order.iter().enumerate() {
        least = least.min(p[at] * p.len() as f64 / (p.len() - from_the_top) as f64);
        result[at] = least;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All ways to choose m of the first m + n numbers.
    fn choices(m: usize, n: usize) -> Vec<Vec<f64>> {
        let all = 0..1_u32 << (m + n);
        let chosen = all.filter(|bits| bits.count_ones() as usize == m);
        chosen.map(|bits| (0..m + n).filter(|&at| bits >> at & 1 == 1).map(|at| at as f64).collect()).collect()
    }

    #[test]
    fn delta_is_its_definition() {
        let (own, rest) = ([1.0, 4.0, 4.0, 9.0], [4.0, 0.0, 2.0]);
        let sign = |a: f64, b: f64| f64::from(u8::from(a > b)) - f64::from(u8::from(a < b));
        let sum: f64 = own.iter().flat_map(|&a| rest.iter().map(move |&b| sign(a, b))).sum();
        assert!((cliffs_delta(&own, &rest) - sum / 12.0).abs() < 1e-15);
        assert_eq!(cliffs_delta(&[5.0, 6.0], &[1.0, 2.0]), 1.0);
        assert_eq!(cliffs_delta(&[5.0, 5.0], &[5.0, 5.0, 5.0]), 0.0);
    }

    #[test]
    fn small_groups_get_the_exact_p() {
        for (m, n) in [(1, 4), (2, 3), (3, 5), (4, 4)] {
            let all = choices(m, n);
            let off = |own: &[f64]| {
                let rest: Vec<f64> = (0..m + n).map(|at| at as f64).filter(|x| !own.contains(x)).collect();
                (cliffs_delta(own, &rest).abs(), rank_sum_p(own, &rest))
            };
            for own in &all {
                let (delta, p) = off(own);
                let as_far = all.iter().filter(|other| off(other).0 >= delta - 1e-12).count();
                assert!((p - as_far as f64 / all.len() as f64).abs() < 1e-12, "{own:?} of {}", m + n);
            }
        }
    }

    #[test]
    fn large_groups_and_ties_agree_with_scipy() {
        // scipy 1.17.1: mannwhitneyu(range(20), range(5, 35), method='asymptotic').pvalue, and with values halved by //.
        let values = |range: std::ops::Range<i32>| range.map(f64::from).collect::<Vec<_>>();
        let halved = |range: std::ops::Range<i32>| range.map(|x| f64::from(x / 2)).collect::<Vec<_>>();
        let error = |p: f64, expected: f64| (p / expected - 1.0).abs();
        assert!(error(rank_sum_p(&values(0..20), &values(5..35)), 0.0002118196387509613) < 1e-6);
        assert!(error(rank_sum_p(&halved(0..20), &halved(5..35)), 0.00021506291143615967) < 1e-6);
    }

    #[test]
    fn categories_that_decide_have_v_one_and_names_alone_have_none() {
        let (a, b) = (vec!["x"; 12], vec!["y"; 15]);
        assert!((cramers_v(&a, &b) - 1.0).abs() < 1e-12);
        assert!(categories_p(&a, &b, 1) < 0.001);
        assert_eq!(cramers_v(&["x"; 9], &["x"; 5]), 0.0);
        assert_eq!(categories_p(&["x"; 9], &["x"; 5], 1), 1.0);
        // Every run a category of its own decides nothing.
        let names: Vec<String> = (0..20).map(|at| at.to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        assert_eq!((cramers_v(&names[..8], &names[8..]), categories_p(&names[..8], &names[8..], 1)), (0.0, 1.0));
    }

    #[test]
    fn chance_alone_is_found_as_often_as_said() {
        // Uniform p under chance: of 2000 divisions about 5 % are below 0.05. σ is 0.5 %, four of them 2 %.
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut draw = |n: usize| (0..n).map(|_| random.random::<f64>()).collect::<Vec<f64>>();
        let low = (0..2000).filter(|_| rank_sum_p(&draw(12), &draw(30)) < 0.05).count();
        assert!((60..140).contains(&low), "{low}");
    }

    #[test]
    fn adjusting_is_that_of_benjamini_and_hochberg() {
        let p = [0.01, 0.04, 0.03, 0.005];
        let by_hand = [0.02, 0.04, 0.04, 0.02];
        assert!(adjusted(&p).iter().zip(by_hand).all(|(a, b)| (a - b).abs() < 1e-15));
        assert!(adjusted(&[]).is_empty());
    }
}
