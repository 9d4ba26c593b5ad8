//! Agglomerative grouping: the two nearest groups become one until as many are left as wanted.
//!
//! Distances between groups are updated by Lance and Williams (1967): Ward on squared distances, average linkage on
//! distances. The nearest-neighbour chain (Murtagh 1983) merges in O(R²) time.

use super::Distances;

/// How the distance of a merged group follows from those of its halves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Linkage {
    Ward,
    Average,
}

/// All merges of R points, from which the groups for any number follow.
pub(super) struct Merges {
    count: usize,
    /// Distance, and a point of either half; R − 1 of them, nearest first.
    merges: Vec<(f64, usize, usize)>,
}

/// All merges. Works on a matrix of f64: 800 MB at ten thousand runs.
pub(super) fn agglomerate(distances: &Distances, linkage: Linkage) -> Merges {
    let n = distances.count;
    let start = |a: usize, b: usize| match linkage {
        Linkage::Ward => distances.between(a, b).powi(2),
        Linkage::Average => distances.between(a, b),
    };
    let mut matrix: Vec<f64> = (0..n * n).map(|at| start(at / n, at % n)).collect();
    let mut sizes = vec![1.0_f64; n];
    let mut alive = vec![true; n];
    let mut merges: Vec<(f64, usize, usize)> = Vec::with_capacity(n.saturating_sub(1));
    let mut chain: Vec<usize> = Vec::new();
    while merges.len() + 1 < n {
        if chain.is_empty() {
            chain.extend(alive.iter().position(|&alive| alive));
        }
        let tip = chain[chain.len() - 1];
        let before = chain.len().checked_sub(2).map(|at| chain[at]);
        // The one before is preferred among equals, so that the chain ends.
        let mut nearest = before.unwrap_or(usize::MAX);
        let mut least = before.map_or(f64::INFINITY, |before| matrix[tip * n + before]);
        for other in (0..n).filter(|&other| alive[other] && other != tip) {
            if matrix[tip * n + other] < least {
                (least, nearest) = (matrix[tip * n + other], other);
            }
        }
        if before != Some(nearest) {
            chain.push(nearest);
            continue;
        }
        chain.truncate(chain.len() - 2);
        let (kept, gone) = (tip.min(nearest), tip.max(nearest));
        merges.push((least, kept, gone));
        let (a, b) = (sizes[kept], sizes[gone]);
        for other in (0..n).filter(|&other| alive[other] && other != kept && other != gone) {
            let (da, db, c) = (matrix[kept * n + other], matrix[gone * n + other], sizes[other]);
            let merged = match linkage {
                Linkage::Ward => ((a + c) * da + (b + c) * db - c * least) / (a + b + c),
                Linkage::Average => (a * da + b * db) / (a + b),
            };
            matrix[kept * n + other] = merged;
            matrix[other * n + kept] = merged;
        }
        sizes[kept] = a + b;
        alive[gone] = false;
    }
    // The chain finds merges out of order; both linkages are monotone, so sorting restores the order.
    merges.sort_by(|x, y| x.0.total_cmp(&y.0));
    Merges { count: n, merges }
}

impl Merges {
    /// The group of each point when `count` groups are left.
    pub(super) fn groups(&self, count: usize) -> Vec<usize> {
        let n = self.count;
        let mut parent: Vec<usize> = (0..n).collect();
        for &(_, a, b) in &self.merges[..n.saturating_sub(count)] {
            let (a, b) = (root(&parent, a), root(&parent, b));
            parent[a.max(b)] = a.min(b);
        }
        let roots: Vec<usize> = (0..n).map(|run| root(&parent, run)).collect();
        let mut distinct = roots.clone();
        distinct.sort_unstable();
        distinct.dedup();
        roots.iter().map(|root| distinct.binary_search(root).unwrap_or(0)).collect()
    }
}

fn root(parent: &[usize], mut at: usize) -> usize {
    while parent[at] != at {
        at = parent[at];
    }
    at
}
