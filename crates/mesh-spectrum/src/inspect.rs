//! What a mesh is like before anything is computed on it: how large, how many pieces, which defects.
//!
//! A caller shows this to the user, who decides with it whether pieces should be joined
//! ([`join`](crate::join)) and whether the mesh is the one meant.

use crate::mesh::{Mesh, Union, double_area, norm, sub};
use crate::proximity::mutual_pairs;

/// Size, components and defects of a mesh. Lengths in the model's length unit ℓ, areas in ℓ².
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    /// Sum of all triangles' areas, ℓ².
    pub area: f64,
    /// Total length of edges with exactly one triangle, ℓ.
    pub boundary_length: f64,
    /// Connected components, by shared vertices. An unused vertex is a component of its own here.
    pub components: usize,
    /// N component numbers, from 0, in the order of each component's lowest vertex.
    pub component_of_vertex: Vec<u32>,
    /// Triangles whose area is zero to working precision (below 1e-12 of their longest edge squared); the operator
    /// leaves them out.
    pub triangles_without_area: usize,
    /// Edges with more than two triangles, such as T-joints. The operator sums over all of them.
    pub non_manifold_edges: usize,
    /// Vertices of no triangle. The operator refuses a mesh that has them.
    pub unused_vertices: usize,
    /// Faces with fewer than three different vertices, left out when the mesh was made.
    pub faces_left_out: usize,
    /// Mean length of the different edges (diagonals of split quadrilaterals included), ℓ.
    pub edge_length_mean: f64,
    /// Length of the longest edge, ℓ.
    pub edge_length_max: f64,
    /// Median distance between mutually nearest vertices of different components, of those closer than half the mean
    /// edge; `None` without such pairs, ℓ.
    pub gap_median: Option<f64>,
    /// The distance to [`join`](crate::join) at if the components belong together: a quarter more than `gap_median`,
    /// because sheets are not perfectly parallel, rounded up to two significant digits, ℓ.
    pub gap: Option<f64>,
}

/// Looks a mesh over. Takes O(T log T) time.
pub fn inspect(mesh: &Mesh) -> Inspection {
    let vertices = mesh.vertices();
    let (component_of_vertex, components) = components(mesh);
    let areas: Vec<Option<f64>> = mesh.triangles().iter().map(|&t| double_area(mesh.corners(t))).collect();

    let mut used = vec![false; vertices.len()];
    mesh.triangles().iter().flatten().for_each(|&vertex| used[vertex as usize] = true);

    let length = |[a, b]: [u32; 2]| norm(sub(vertices[a as usize], vertices[b as usize]));
    let edges = edges(mesh);
    let edge_length_mean = edges.iter().map(|(edge, _)| length(*edge)).sum::<f64>() / edges.len().max(1) as f64;

    let gap_median = (components > 1 && edge_length_mean > 0.0)
        .then(|| mutual_pairs(vertices, &component_of_vertex, 0.5 * edge_length_mean))
        .and_then(|pairs| {
            let mut distances: Vec<f64> = pairs.iter().map(|pair| pair.distance).collect();
            distances.sort_by(f64::total_cmp);
            distances.get(distances.len() / 2).copied()
        });

    Inspection {
        area: 0.5 * areas.iter().flatten().sum::<f64>(),
        boundary_length: edges.iter().filter(|(_, faces)| *faces == 1).map(|(edge, _)| length(*edge)).sum(),
        components,
        component_of_vertex,
        triangles_without_area: areas.iter().filter(|area| area.is_none()).count(),
        non_manifold_edges: edges.iter().filter(|(_, faces)| *faces > 2).count(),
        unused_vertices: used.iter().filter(|used| !**used).count(),
        faces_left_out: mesh.faces_left_out(),
        edge_length_mean,
        edge_length_max: longest_edge(mesh),
        gap_median,
        gap: gap_median.map(|median| round_up(1.25 * median, edge_length_mean)),
    }
}

/// Component of every vertex by shared vertices, numbered by lowest vertex, and their number.
pub(crate) fn components(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut union = Union::new(mesh.vertices().len());
    for &[a, b, c] in mesh.triangles() {
        union.merge(a, b);
        union.merge(b, c);
    }
    union.classes()
}

pub(crate) fn longest_edge(mesh: &Mesh) -> f64 {
    let longest = |[a, b, c]: [[f64; 3]; 3]| norm(sub(a, b)).max(norm(sub(b, c))).max(norm(sub(c, a)));
    mesh.triangles().iter().map(|&t| longest(mesh.corners(t))).fold(0.0, f64::max)
}

/// Every different edge, lower vertex first, with its number of triangles.
fn edges(mesh: &Mesh) -> Vec<([u32; 2], usize)> {
    let mut all: Vec<[u32; 2]> = Vec::with_capacity(3 * mesh.triangles().len());
    for &[a, b, c] in mesh.triangles() {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            if p != q {
                all.push([p.min(q), p.max(q)]);
            }
        }
    }
    all.sort_unstable();
    all.chunk_by(|a, b| a == b).map(|same| (same[0], same.len())).collect()
}

/// The next number of two significant digits at or above `x`. Vertices that coincide (x = 0) are joined at a
/// thousandth of an edge.
fn round_up(x: f64, edge: f64) -> f64 {
    let x = x.max(1e-3 * edge);
    let unit = 10f64.powf(x.log10().floor() - 1.0);
    // 1e-9: 2.5 may be stored as 25.000000000000004 units; dividing by 1/unit keeps 2.5 itself exact.
    let digits = (x / unit - 1e-9).ceil();
    if unit < 1.0 { digits / (1.0 / unit).round() } else { digits * unit }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_parallel_triangles_and_an_unused_vertex() {
        let triangle = |z| [[0.0, 0.0, z], [10.0, 0.0, z], [0.0, 10.0, z]];
        let mut vertices = triangle(0.0).to_vec();
        vertices.push([99.0; 3]);
        vertices.extend(triangle(2.0));
        let seen = inspect(&Mesh::new(vertices, vec![[0, 1, 2], [4, 5, 6], [4, 5, 4]]).unwrap());
        assert_eq!((seen.components, seen.component_of_vertex), (3, vec![0, 0, 0, 1, 2, 2, 2]));
        assert_eq!((seen.triangles_without_area, seen.unused_vertices, seen.non_manifold_edges), (1, 1, 1));
        assert!((seen.area - 100.0).abs() < 1e-12);
        // One triangle's boundary is 20 + 10√2; the other has its edge 4-5 three times (twice from the flat triangle).
        assert!((seen.boundary_length - (20.0 + 200f64.sqrt()) - (10.0 + 200f64.sqrt())).abs() < 1e-12);
        assert_eq!((seen.gap_median, seen.gap), (Some(2.0), Some(2.5)));
    }

    #[test]
    fn two_digits_upwards() {
        for (x, up) in [(2.5, 2.5), (2.51, 2.6), (0.01234, 0.013), (0.125, 0.13), (990.0, 990.0), (991.0, 1000.0)] {
            assert!((round_up(x, 1.0) / up - 1.0).abs() < 1e-14, "{x} became {}", round_up(x, 1.0));
        }
    }
}
