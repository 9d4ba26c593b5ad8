//! What a mesh is like before anything is computed on it: how large, how many pieces, which defects.
//!
//! A caller shows this to the user, who decides with it whether pieces should be joined
//! ([`join`](crate::join)), which operator suits the mesh, and whether the mesh is the one meant.

use std::fmt;

use crate::mesh::{Mesh, Union, double_area, norm, sub};
use crate::operator::{Kind, cotangents};
use crate::proximity::mutual_pairs;
use crate::split::angle;

/// Triangles with a smaller angle than this (1°) are thin: the largest eigenvalue, and with it rounding, grows as its
/// reciprocal.
const THIN: f64 = 1.0 * DEGREE;

/// Triangles with a larger angle than this (170°) are flat: linear elements lose accuracy with the largest angle
/// (Babuška and Aziz 1976), not with the smallest.
const FLAT: f64 = 170.0 * DEGREE;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

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
    /// Edges whose weight in the cotangent operator is negative: the angles opposite to them add up to more than half a
    /// turn. With them a field can have a maximum inside of the mesh that its boundary does not have.
    pub negative_edges: usize,
    /// The smallest angle of the triangles with area, in radians.
    pub angle_min: f64,
    /// The largest, in radians.
    pub angle_max: f64,
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
    /// What speaks for [`Kind::Tufted`] on this mesh; nothing where [`Kind::Cotan`] serves as well.
    pub reasons: Vec<Reason>,
}

impl Inspection {
    /// The operator that suits the mesh.
    pub fn recommended(&self) -> Kind {
        if self.reasons.is_empty() { Kind::Cotan } else { Kind::Tufted }
    }
}

/// What speaks for the tufted operator. Places are the first ones; triangles are numbered from 0.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// Edges with more than two faces.
    NonManifold {
        /// How many.
        edges: usize,
        /// The vertices of the first.
        first: [u32; 2],
    },
    /// Triangles with an angle below 1° or above 170°.
    BadShape {
        /// How many.
        triangles: usize,
        /// The worst.
        worst: u32,
        /// Its smallest angle, in degrees.
        angle: f64,
    },
    /// Triangles without area, which the cotangent operator leaves out.
    WithoutArea {
        /// How many.
        triangles: usize,
        /// The first.
        first: u32,
    },
    /// Triangles that are there twice, which the cotangent operator counts twice.
    Duplicates {
        /// How many.
        triangles: usize,
        /// The first that repeats another.
        first: u32,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::NonManifold { edges, first: [a, b] } => {
                write!(f, "{edges} edges have more than two faces, the first between vertices {a} and {b}")
            }
            Reason::BadShape { triangles, worst, angle } => {
                write!(
                    f,
                    "{triangles} triangles are badly shaped, the worst is triangle {worst} with an angle of {angle:.2}°"
                )
            }
            Reason::WithoutArea { triangles, first } => {
                write!(f, "{triangles} triangles have no area, the first is triangle {first}")
            }
            Reason::Duplicates { triangles, first } => {
                write!(f, "{triangles} triangles repeat another one, the first is triangle {first}")
            }
        }
    }
}

/// Looks a mesh over. Takes O(T log T) time.
pub fn inspect(mesh: &Mesh) -> Inspection {
    let vertices = mesh.vertices();
    let (component_of_vertex, components) = components(mesh);
    let areas: Vec<Option<f64>> = mesh.triangles().iter().map(|&t| double_area(mesh.corners(t))).collect();

    let mut used = vec![false; vertices.len()];
    mesh.triangles().iter().flatten().for_each(|&vertex| used[vertex as usize] = true);

    let shape = shape(mesh, &areas);
    let length = |[a, b]: [u32; 2]| norm(sub(vertices[a as usize], vertices[b as usize]));
    let edges = edges(mesh, &areas);
    let edge_length_mean = edges.iter().map(|edge| length(edge.ends)).sum::<f64>() / edges.len().max(1) as f64;
    let triangles_without_area = areas.iter().filter(|area| area.is_none()).count();
    let non_manifold: Vec<&Edge> = edges.iter().filter(|edge| edge.faces > 2).collect();
    let mut reasons = Vec::new();
    if let Some(edge) = non_manifold.first() {
        reasons.push(Reason::NonManifold { edges: non_manifold.len(), first: edge.ends });
    }
    if let Some(worst) = shape.worst {
        let angle = shape.angle_min / DEGREE;
        reasons.push(Reason::BadShape { triangles: shape.bad, worst, angle });
    }
    if let Some(first) = areas.iter().position(Option::is_none) {
        reasons.push(Reason::WithoutArea { triangles: triangles_without_area, first: first as u32 });
    }
    reasons.extend(duplicates(mesh));

    let gap_median = (components > 1 && edge_length_mean > 0.0)
        .then(|| mutual_pairs(vertices, &component_of_vertex, 0.5 * edge_length_mean))
        .and_then(|pairs| {
            let mut distances: Vec<f64> = pairs.iter().map(|pair| pair.distance).collect();
            distances.sort_by(f64::total_cmp);
            distances.get(distances.len() / 2).copied()
        });

    Inspection {
        area: 0.5 * areas.iter().flatten().sum::<f64>(),
        boundary_length: edges.iter().filter(|edge| edge.faces == 1).map(|edge| length(edge.ends)).sum(),
        components,
        component_of_vertex,
        triangles_without_area,
        non_manifold_edges: non_manifold.len(),
        negative_edges: edges.iter().filter(|edge| edge.weight < -1e-12).count(),
        angle_min: shape.angle_min,
        angle_max: shape.angle_max,
        unused_vertices: used.iter().filter(|used| !**used).count(),
        faces_left_out: mesh.faces_left_out(),
        edge_length_mean,
        edge_length_max: longest_edge(mesh),
        gap_median,
        gap: gap_median.map(|median| round_up(1.25 * median, edge_length_mean)),
        reasons,
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

/// An edge, lower vertex first, its number of triangles, and the sum of half the cotangents opposite to it.
struct Edge {
    ends: [u32; 2],
    faces: usize,
    weight: f64,
}

/// Every different edge, ascending.
fn edges(mesh: &Mesh, areas: &[Option<f64>]) -> Vec<Edge> {
    let mut all: Vec<([u32; 2], f64)> = Vec::with_capacity(3 * mesh.triangles().len());
    for (&[a, b, c], area) in mesh.triangles().iter().zip(areas) {
        let cot = area.map_or([0.0; 3], |area| cotangents(mesh.corners([a, b, c]), area));
        for (k, [p, q]) in [[b, c], [c, a], [a, b]].into_iter().enumerate() {
            if p != q {
                all.push(([p.min(q), p.max(q)], 0.5 * cot[k]));
            }
        }
    }
    all.sort_unstable_by_key(|edge| edge.0);
    let merged = |same: &[([u32; 2], f64)]| Edge {
        ends: same[0].0,
        faces: same.len(),
        weight: same.iter().map(|edge| edge.1).sum(),
    };
    all.chunk_by(|a, b| a.0 == b.0).map(merged).collect()
}

/// Angles of the triangles with area.
struct Shape {
    angle_min: f64,
    angle_max: f64,
    bad: usize,
    /// Of those that are bad, the one with the smallest angle.
    worst: Option<u32>,
}

fn shape(mesh: &Mesh, areas: &[Option<f64>]) -> Shape {
    let mut shape = Shape { angle_min: f64::INFINITY, angle_max: 0.0, bad: 0, worst: None };
    for ((number, &triangle), area) in (0..).zip(mesh.triangles()).zip(areas) {
        if area.is_none() {
            continue;
        }
        let [a, b, c] = mesh.corners(triangle);
        let angles = [angle(a, b, c), angle(b, c, a), angle(c, a, b)];
        let (least, most) = (angles.into_iter().fold(f64::INFINITY, f64::min), angles.into_iter().fold(0.0, f64::max));
        if least < THIN || most > FLAT {
            shape.bad += 1;
            if shape.worst.is_none() || least < shape.angle_min {
                shape.worst = Some(number);
            }
        }
        shape.angle_min = shape.angle_min.min(least);
        shape.angle_max = shape.angle_max.max(most);
    }
    shape.angle_min = shape.angle_min.min(shape.angle_max); // 0 without any triangle
    shape
}

/// Triangles with the same three vertices as one before, whichever way round.
fn duplicates(mesh: &Mesh) -> Option<Reason> {
    let key = |mut triangle: [u32; 3]| {
        triangle.sort_unstable();
        triangle
    };
    let mut all: Vec<([u32; 3], u32)> = mesh.triangles().iter().zip(0..).map(|(&t, number)| (key(t), number)).collect();
    all.sort_unstable();
    let again = || all.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| pair[1].1);
    again().min().map(|first| Reason::Duplicates { triangles: again().count(), first })
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
        assert_eq!(seen.reasons[1], Reason::WithoutArea { triangles: 1, first: 2 });
        assert!((seen.angle_max / DEGREE - 90.0).abs() < 1e-12 && (seen.angle_min / DEGREE - 45.0).abs() < 1e-12);
    }

    #[test]
    fn what_speaks_for_another_operator() {
        let square = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, -1e-3, 0.0]];
        let good = inspect(&Mesh::new(square[..4].to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap());
        assert_eq!((good.recommended(), good.negative_edges), (Kind::Cotan, 0));
        let bad = inspect(&Mesh::new(square, vec![[0, 1, 2], [0, 2, 3], [0, 4, 1], [2, 0, 1], [3, 0, 2]]).unwrap());
        assert_eq!(bad.recommended(), Kind::Tufted);
        assert_eq!(bad.negative_edges, 1, "the one opposite to the flat corner");
        let words: Vec<String> = bad.reasons.iter().map(Reason::to_string).collect();
        assert_eq!(words[0], "2 edges have more than two faces, the first between vertices 0 and 1");
        assert_eq!(words[1], "1 triangles are badly shaped, the worst is triangle 2 with an angle of 0.11°");
        assert_eq!(words[2], "2 triangles repeat another one, the first is triangle 3");
    }

    #[test]
    fn two_digits_upwards() {
        for (x, up) in [(2.5, 2.5), (2.51, 2.6), (0.01234, 0.013), (0.125, 0.13), (990.0, 990.0), (991.0, 1000.0)] {
            assert!((round_up(x, 1.0) / up - 1.0).abs() < 1e-14, "{x} became {}", round_up(x, 1.0));
        }
    }
}
