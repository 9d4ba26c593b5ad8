//! Faces with more than three corners become triangles.
//!
//! The triangles whose smallest angle is largest: thin triangles cost accuracy and make the operator's largest
//! eigenvalue large. A triangle that is turned over against its face (one that lies outside of a face that is not
//! convex) is worse than any thin one.

use crate::mesh::{Point, cross, dot, norm, sub};

/// Corners of the largest face that is split: the time is their cube.
pub(crate) const CORNERS_MAX: usize = 64;

/// Angles closer than this, in radians, count as equal.
const ALIKE: f64 = 1e-4;

/// Appends the triangles of a ring of three or more different corners; of fewer, nothing.
pub(crate) fn split(vertices: &[Point], ring: &[u32], triangles: &mut Vec<[u32; 3]>) {
    match *ring {
        [a, b, c] => triangles.push([a, b, c]),
        [a, b, c, d] => triangles.extend(quadrilateral(vertices, [a, b, c, d])),
        [_, _, _, _, ..] => polygon(vertices, ring, triangles),
        _ => {}
    }
}

/// The two triangles of a quadrilateral, split along the better diagonal.
fn quadrilateral(vertices: &[Point], ring @ [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let normal = area_vector(vertices, &ring);
    let worst = |halves: [[u32; 3]; 2]| {
        let angles = |half: [u32; 3]| angle_in(half.map(|vertex| vertices[vertex as usize]), normal);
        angles(halves[0]).min(angles(halves[1]))
    };
    let along_ac = [[a, b, c], [a, c, d]];
    let along_bd = [[a, b, d], [b, c, d]];
    if worst(along_bd) > worst(along_ac) + ALIKE { along_bd } else { along_ac }
}

/// The best triangles of a polygon by dynamic programming (Klincsek 1980): the best of corners i to j is a triangle
/// i, k, j and the best of i to k and of k to j. Time O(n³).
fn polygon(vertices: &[Point], ring: &[u32], triangles: &mut Vec<[u32; 3]>) {
    let n = ring.len();
    let normal = area_vector(vertices, ring);
    let point = |i: usize| vertices[ring[i] as usize];
    // The smallest angle of the best triangles between corners i and j, and the apex over the edge i–j.
    let mut best = vec![(f64::INFINITY, 0); n * n];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            let mut chosen = (f64::NEG_INFINITY, i + 1);
            for k in i + 1..j {
                let angle = angle_in([point(i), point(k), point(j)], normal);
                let worst = angle.min(best[i * n + k].0).min(best[k * n + j].0);
                if worst > chosen.0 + if chosen.0.is_finite() { ALIKE } else { 0.0 } {
                    chosen = (worst, k);
                }
            }
            best[i * n + j] = chosen;
        }
    }
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        let k = best[i * n + j].1;
        triangles.push([ring[i], ring[k], ring[j]]);
        open.extend([(k, j), (i, k)].into_iter().filter(|(i, j)| j - i > 1));
    }
}

/// Twice the area of a ring, as a vector along its normal (Newell).
pub(crate) fn area_vector(vertices: &[Point], ring: &[u32]) -> Point {
    let from = vertices[ring[0] as usize];
    let spokes = |i: usize| sub(vertices[ring[i] as usize], from);
    (1..ring.len() - 1).fold([0.0; 3], |sum, i| {
        let part = cross(spokes(i), spokes(i + 1));
        [sum[0] + part[0], sum[1] + part[1], sum[2] + part[2]]
    })
}

/// The smallest angle of a triangle, in radians, less π where it is turned over against the normal.
fn angle_in(corners: [Point; 3], normal: Point) -> f64 {
    let [a, b, c] = corners;
    let over = dot(cross(sub(b, a), sub(c, a)), normal) < 0.0;
    smallest_angle(corners) - if over { std::f64::consts::PI } else { 0.0 }
}

/// The smallest angle of a triangle, in radians; 0 where an edge has no length.
fn smallest_angle([a, b, c]: [Point; 3]) -> f64 {
    angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
}

/// The angle at a corner between two others, in radians.
pub(crate) fn angle(at: Point, to: Point, and: Point) -> f64 {
    let (u, v) = (sub(to, at), sub(and, at));
    norm(cross(u, v)).atan2(dot(u, v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;

    fn triangles(vertices: Vec<Point>) -> Vec<[u32; 3]> {
        let ring: Vec<u32> = (0..vertices.len() as u32).collect();
        Mesh::from_polygons(vertices, [&ring[..]].into_iter()).unwrap().triangles().to_vec()
    }

    fn area(vertices: &[Point], triangles: &[[u32; 3]]) -> f64 {
        triangles.iter().map(|t| 0.5 * norm(area_vector(vertices, t))).sum()
    }

    #[test]
    fn a_quadrilateral_is_split_along_the_better_diagonal() {
        // A kite, long in x: the diagonal b-d (short, through the middle) leaves angles of 53°, a-c leaves 14°.
        let kite = vec![[-2.0, 0.0, 0.0], [0.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(triangles(kite), [[0, 1, 3], [1, 2, 3]]);
    }

    #[test]
    fn a_face_that_is_not_convex_is_cut_through_its_inward_corner() {
        let dart = vec![[0.0, 0.0, 0.0], [4.0, -1.0, 0.0], [1.0, 0.0, 0.0], [4.0, 1.0, 0.0]];
        let split = triangles(dart.clone());
        assert_eq!(split, [[0, 1, 2], [0, 2, 3]]);
        assert!((area(&dart, &split) - 1.0).abs() < 1e-15);
        // A star of five points: ten corners, every second one inward.
        let star: Vec<Point> = (0..10)
            .map(|k| {
                let (s, c) = (std::f64::consts::PI * k as f64 / 5.0).sin_cos();
                let radius = if k % 2 == 0 { 1.0 } else { 0.4 };
                [radius * c, radius * s, 0.3]
            })
            .collect();
        let split = triangles(star.clone());
        let exact = 5.0 * 0.4 * (std::f64::consts::PI / 5.0).sin();
        assert_eq!(split.len(), 8);
        assert!((area(&star, &split) - exact).abs() < 1e-14, "no triangle lies outside");
    }

    #[test]
    fn a_regular_hexagon_keeps_angles_of_thirty_degrees() {
        let hexagon: Vec<Point> =
            (0..6).map(|k| (std::f64::consts::PI * k as f64 / 3.0).sin_cos()).map(|(s, c)| [c, s, 0.0]).collect();
        let split = triangles(hexagon.clone());
        let angle = |t: &[u32; 3]| smallest_angle(t.map(|v| hexagon[v as usize])).to_degrees();
        assert!(split.len() == 4 && split.iter().all(|t| angle(t) > 29.9), "{split:?}");
    }
}
