//! HDBSCAN: groups are the dense regions that last longest as the density that is asked for rises; points in none of them
//! have no group (Campello, Moulavi and Sander 2013; the condensed tree as in McInnes and Healy 2017).
//!
//! 1. core(a): distance to the m-th nearest point, a itself being the first; mutual reachability of a and b:
//!    max(core(a), core(b), d(a, b)).
//! 2. Single linkage on it, by the minimum spanning tree. Mutual reachability has many equal values; what merges at the same
//!    distance merges at once, so that the order of the points decides nothing (a binary tree would).
//! 3. From the root down, a split is one where two parts or more have at least m points; else points fall out of the region that
//!    goes on. Density is λ = 1/distance.
//! 4. A region's stability is Σ over its points of (λ at which the point leaves − λ at which the region began). From the
//!    leaves up the better of a region and its parts is kept; the root is no answer.
//!
//! No crate: what there is (`hdbscan` 0.12) wants all distances a second time, as rows of `Vec`s, and tells neither how
//! firmly a point belongs nor how far outside it lies.

use super::Distances;

/// What came of it.
pub(super) struct Dense {
    /// The group of each point, numbered without gaps from 0 in the order of their first points; `None` for points in no
    /// dense region.
    pub(super) groups: Vec<Option<usize>>,
    /// λ at which the point leaves its group over the largest such λ in it: 1 in the core, 0 without a group.
    pub(super) strength: Vec<f64>,
}

/// Groups of at least `smallest` points, 2 or more; also the m of the core distance.
pub(super) fn hdbscan(distances: &Distances, smallest: usize) -> Dense {
    let n = distances.count;
    let farthest = (0..n).flat_map(|a| (0..a).map(move |b| (a, b))).map(|(a, b)| distances.between(a, b));
    let farthest = farthest.fold(0.0, f64::max);
    if farthest == 0.0 {
        // All points coincide: as dense as can be.
        return Dense { groups: vec![Some(0); n], strength: vec![1.0; n] };
    }
    let tree = single_linkage(distances, smallest);
    // Points that coincide are not infinitely dense, only a billion times denser than all.
    let density = |distance: f64| 1.0 / distance.max(1e-9 * farthest);
    let regions = condense(&tree, n, smallest, density);
    let kept = choose(&regions);
    label(&regions, &kept, n)
}

/// A merge of single linkage: nodes (points below n, then earlier merges) at a distance, and the number of points below.
struct Merge {
    parts: Vec<usize>,
    distance: f64,
    size: usize,
}

/// Minimum spanning tree of mutual reachability by Prim's algorithm, its edges merged in order of length.
fn single_linkage(distances: &Distances, smallest: usize) -> Vec<Merge> {
    let n = distances.count;
    let core: Vec<f64> = (0..n)
        .map(|a| {
            let mut near: Vec<f64> = (0..n).map(|b| distances.between(a, b)).collect();
            let at = (smallest - 1).min(n - 1);
            *near.select_nth_unstable_by(at, f64::total_cmp).1
        })
        .collect();
    let mut edges: Vec<(f64, usize, usize)> = Vec::with_capacity(n - 1);
    let mut nearest = vec![(f64::INFINITY, 0); n];
    let mut inside = vec![false; n];
    let mut tip = 0;
    for _ in 1..n {
        inside[tip] = true;
        let mut next = (f64::INFINITY, usize::MAX);
        for other in (0..n).filter(|&other| !inside[other]) {
            let reach = distances.between(tip, other).max(core[tip]).max(core[other]);
            if reach < nearest[other].0 {
                nearest[other] = (reach, tip);
            }
            if nearest[other].0 < next.0 {
                next = (nearest[other].0, other);
            }
        }
        tip = next.1;
        edges.push((next.0, nearest[tip].1, tip));
    }
    edges.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut node_of: Vec<usize> = (0..n).collect();
    let mut parent: Vec<usize> = (0..n).collect();
    let mut merges: Vec<Merge> = Vec::with_capacity(n - 1);
    for (distance, a, b) in edges {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        let size = |node: usize| if node < n { 1 } else { merges[node - n].size };
        let parts = |node: usize| match node.checked_sub(n).map(|at| &merges[at]) {
            Some(merge) if merge.distance == distance => merge.parts.clone(),
            _ => vec![node],
        };
        let (left, right) = (node_of[a], node_of[b]);
        let merge = Merge { parts: [parts(left), parts(right)].concat(), distance, size: size(left) + size(right) };
        parent[b] = a;
        node_of[a] = n + merges.len();
        merges.push(merge);
    }
    merges
}

fn root(parent: &mut [usize], mut at: usize) -> usize {
    while parent[at] != at {
        parent[at] = parent[parent[at]];
        at = parent[at];
    }
    at
}

/// A dense region: where it begins, its points with the density at which each leaves, and the regions it splits into.
struct Region {
    parent: Option<usize>,
    birth: f64,
    leaves: Vec<(usize, f64)>,
    /// Points that stay until it splits, and the density of the split.
    split: Option<(usize, f64)>,
    children: Vec<usize>,
}

/// The regions, parents before children; the first is all points.
fn condense(tree: &[Merge], n: usize, smallest: usize, density: impl Fn(f64) -> f64) -> Vec<Region> {
    let new = |parent, birth| Region { parent, birth, leaves: Vec::new(), split: None, children: Vec::new() };
    let size = |node: usize| if node < n { 1 } else { tree[node - n].size };
    let mut regions = vec![new(None, 0.0)];
    let mut open = vec![(n + tree.len() - 1, 0)];
    while let Some((node, region)) = open.pop() {
        let merge = &tree[node - n];
        let at = density(merge.distance);
        let (large, small): (Vec<usize>, Vec<usize>) = merge.parts.iter().partition(|&&part| size(part) >= smallest);
        for part in small {
            regions[region].leaves.extend(points_below(tree, n, part).into_iter().map(|point| (point, at)));
        }
        if let [part] = large[..] {
            open.push((part, region));
            continue;
        }
        regions[region].split = Some((large.iter().map(|&part| size(part)).sum(), at));
        for part in large {
            regions.push(new(Some(region), at));
            let child = regions.len() - 1;
            regions[region].children.push(child);
            open.push((part, child));
        }
    }
    regions
}

fn points_below(tree: &[Merge], n: usize, node: usize) -> Vec<usize> {
    let mut open = vec![node];
    let mut points = Vec::new();
    while let Some(node) = open.pop() {
        if node < n { points.push(node) } else { open.extend(&tree[node - n].parts) }
    }
    points
}

/// The regions that are groups: those at least as stable as their parts together, never the root.
fn choose(regions: &[Region]) -> Vec<bool> {
    let own = |region: &Region| {
        let left: f64 = region.leaves.iter().map(|(_, at)| at - region.birth).sum();
        left + region.split.map_or(0.0, |(points, at)| points as f64 * (at - region.birth))
    };
    let mut kept = vec![false; regions.len()];
    let mut best = vec![0.0; regions.len()];
    // Children come after their parents, so this goes from the leaves up.
    for at in (1..regions.len()).rev() {
        let parts: f64 = regions[at].children.iter().map(|&child| best[child]).sum();
        let stability = own(&regions[at]);
        kept[at] = regions[at].children.is_empty() || stability >= parts;
        best[at] = stability.max(parts);
    }
    // Of two kept regions one inside the other, the outer is the group.
    for at in 1..regions.len() {
        let mut above = regions[at].parent;
        while let Some(parent) = above {
            kept[at] &= !kept[parent];
            above = regions[parent].parent;
        }
    }
    kept
}

fn label(regions: &[Region], kept: &[bool], n: usize) -> Dense {
    let group_of = |mut region: usize| loop {
        if kept[region] {
            break Some(region);
        }
        region = regions[region].parent?;
    };
    let mut of: Vec<Option<(usize, f64)>> = vec![None; n];
    let mut most = vec![0.0_f64; regions.len()];
    for (at, region) in regions.iter().enumerate() {
        let Some(group) = group_of(at) else { continue };
        for &(point, density) in &region.leaves {
            of[point] = Some((group, density));
            most[group] = most[group].max(density);
        }
    }
    let mut numbers: Vec<usize> = Vec::new();
    let mut dense = Dense { groups: Vec::new(), strength: Vec::new() };
    for found in of {
        dense.groups.push(found.map(|(group, _)| {
            numbers.iter().position(|&number| number == group).unwrap_or_else(|| {
                numbers.push(group);
                numbers.len() - 1
            })
        }));
        dense.strength.push(found.map_or(0.0, |(group, density)| density / most[group]));
    }
    dense
}

#[cfg(test)]
mod tests {
    use super::super::Points;
    use super::*;

    /// Groups as sorted lists of values, and the values without a group.
    fn found(values: &[f64], smallest: usize) -> (Vec<Vec<i64>>, Vec<i64>) {
        let dense = hdbscan(&Points::on_a_line(values).distances(), smallest);
        let count = dense.groups.iter().flatten().max().map_or(0, |most| most + 1);
        let of = |group: Option<usize>| {
            let all = values.iter().zip(&dense.groups).filter(|(_, of)| **of == group).map(|(x, _)| (10.0 * x) as i64);
            let mut all: Vec<i64> = all.collect();
            all.sort_unstable();
            all
        };
        let mut groups: Vec<Vec<i64>> = (0..count).map(|group| of(Some(group))).collect();
        groups.sort();
        (groups, of(None))
    }

    #[test]
    fn groups_of_different_density_and_points_far_from_all() {
        let values = [0.0, 0.1, 0.2, 0.3, 0.4, 30.0, 31.0, 32.0, 33.0, 34.0, 200.0, -150.0];
        let (groups, none) = found(&values, 3);
        assert_eq!(groups, [vec![0, 1, 2, 3, 4], vec![300, 310, 320, 330, 340]]);
        assert_eq!(none, [-1500, 2000]);
        assert_eq!(
            found(&values, 6),
            (vec![], {
                let mut all: Vec<i64> = values.iter().map(|x| (10.0 * x) as i64).collect();
                all.sort_unstable();
                all
            })
        );
    }

    #[test]
    fn the_order_of_the_points_changes_nothing_even_where_distances_are_equal() {
        // Whole numbers have many equal distances.
        let values: Vec<f64> = (0..40_u32).map(|i| f64::from((i * i * 7) % 83)).collect();
        for smallest in 2..7 {
            let first = found(&values, smallest);
            for step in [3, 7, 11, 39] {
                let turned: Vec<f64> = (0..40).map(|i| values[i * step % 40]).collect();
                assert_eq!(found(&turned, smallest), first, "{smallest} {step}");
            }
        }
    }

    #[test]
    fn strength_is_one_in_the_core_and_falls_outwards() {
        let dense = hdbscan(&Points::on_a_line(&[0.0, 1.0, 2.0, 3.5, 90.0, 91.0, 92.0]).distances(), 2);
        assert_eq!(dense.groups[3], dense.groups[0]);
        assert!(dense.strength[3] < dense.strength[1] && dense.strength[1] == 1.0, "{:?}", dense.strength);
        let same = hdbscan(&Points::on_a_line(&[4.0; 6]).distances(), 3);
        assert_eq!((same.groups, same.strength), (vec![Some(0); 6], vec![1.0; 6]));
    }
}
