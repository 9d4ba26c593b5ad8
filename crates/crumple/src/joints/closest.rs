//! The point of some triangles that lies nearest to a given one.
//!
//! A uniform grid of boxes: a triangle is listed in every box that its bounding box meets, and a question looks into the
//! boxes within its radius.

use std::collections::HashMap;

use mesh_spectrum::Mesh;

pub(super) type Point = [f64; 3];

/// A point inside a triangle of the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foot {
    /// The triangle.
    pub(super) triangle: u32,
    /// Barycentric coordinates, not negative, sum 1.
    pub(super) weights: [f64; 3],
    /// How far it is.
    pub(super) distance: f64,
    /// How far the given point's projection on the plane lies outside the triangle; 0 inside.
    pub(super) outside: f64,
}

/// Some triangles of a mesh, for questions after the nearest point.
pub(super) struct Closest<'a> {
    mesh: &'a Mesh,
    width: f64,
    boxes: HashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Closest<'a> {
    /// Boxes are as wide as the mean of the triangles' longest edges; wider where some are much larger, so that none
    /// fills more than a few thousand.
    pub(super) fn new(mesh: &'a Mesh, triangles: &[u32]) -> Self {
        let longest = |&triangle: &u32| {
            let [a, b, c] = corners(mesh, triangle);
            distance(a, b).max(distance(b, c)).max(distance(c, a))
        };
        let (sum, most) =
            triangles.iter().map(longest).fold((0.0, 0.0f64), |(sum, most), edge| (sum + edge, most.max(edge)));
        let width = (sum / triangles.len().max(1) as f64).max(most / 16.0).max(f64::MIN_POSITIVE);
        let mut boxes: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let place = |x: f64| (x / width).floor() as i64;
        for &triangle in triangles {
            let corners = corners(mesh, triangle);
            let low: [i64; 3] =
                std::array::from_fn(|c| place(corners.iter().map(|p| p[c]).fold(f64::INFINITY, f64::min)));
            let high: [i64; 3] =
                std::array::from_fn(|c| place(corners.iter().map(|p| p[c]).fold(f64::NEG_INFINITY, f64::max)));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        boxes.entry([x, y, z]).or_default().push(triangle);
                    }
                }
            }
        }
        Self { mesh, width, boxes }
    }

    /// The nearest point at most `radius` (and at most eight boxes) away in a triangle that is `wanted`; of several the
    /// lowest triangle's.
    pub(super) fn find(&self, point: Point, radius: f64, wanted: impl Fn(u32) -> bool) -> Option<Foot> {
        let radius = radius.min(8.0 * self.width);
        let place = |x: f64| (x / self.width).floor() as i64;
        let (low, high) = (point.map(|x| place(x - radius)), point.map(|x| place(x + radius)));
        let mut best: Option<Foot> = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    for &triangle in self.boxes.get(&[x, y, z]).into_iter().flatten().filter(|&&t| wanted(t)) {
                        let foot = foot(self.mesh, triangle, point);
                        let better =
                            best.is_none_or(|old| (foot.distance, foot.triangle) < (old.distance, old.triangle));
                        if foot.distance <= radius && better {
                            best = Some(foot);
                        }
                    }
                }
            }
        }
        best
    }
}

/// The nearest point of one triangle (Ericson, Real-Time Collision Detection, 5.1.5).
pub(super) fn foot(mesh: &Mesh, triangle: u32, p: Point) -> Foot {
    let [a, b, c] = corners(mesh, triangle);
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let found = barycentric(ab, ac, ap, sub(p, b), sub(p, c));
    // A triangle without area has no coordinates inside.
    let weights = if found.iter().all(|w| *w >= 0.0) { found } else { [1.0, 0.0, 0.0] };
    let at: Point = std::array::from_fn(|i| weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i]);
    let away = sub(p, at);
    let normal = cross(ab, ac);
    let along = dot(away, normal) / dot(normal, normal).sqrt();
    let distance = dot(away, away).sqrt();
    let outside = if along.is_finite() { (distance * distance - along * along).max(0.0).sqrt() } else { distance };
    // Rounding of a point right above the triangle is no way outside.
    let outside = if outside < 1e-6 * dot(ab, ab).max(dot(ac, ac)).sqrt() { 0.0 } else { outside };
    Foot { triangle, weights, distance, outside }
}

fn barycentric(ab: Point, ac: Point, ap: Point, bp: Point, cp: Point) -> [f64; 3] {
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let (v, w) = (vb / (va + vb + vc), vc / (va + vb + vc));
    [1.0 - v - w, v, w]
}

fn corners(mesh: &Mesh, triangle: u32) -> [Point; 3] {
    mesh.triangles()[triangle as usize].map(|vertex| mesh.vertices()[vertex as usize])
}

pub(super) fn sub(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(super) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn distance(a: Point, b: Point) -> f64 {
    dot(sub(a, b), sub(a, b)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_is_in_every_region_of_a_triangle_the_nearest_of_a_fine_grid() {
        let mesh = Mesh::new(vec![[0.0; 3], [4.0, 0.0, 0.0], [1.0, 3.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        let steps = 60;
        for p in [
            [-1.0, -1.0, 1.0],
            [5.0, -1.0, 0.0],
            [1.0, 5.0, 0.5],
            [2.0, -2.0, 0.0],
            [4.0, 3.0, 1.0],
            [-1.0, 2.0, 0.0],
            [1.5, 1.0, 2.0],
        ] {
            let found = foot(&mesh, 0, p);
            let mut least = f64::INFINITY;
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (v, w) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    least = least.min(distance(p, [4.0 * v + w, 3.0 * w, 0.0]));
                }
            }
            assert!(found.distance <= least + 1e-12 && least < found.distance + 0.02, "{p:?}: {found:?}, {least}");
            assert!(found.weights.iter().all(|w| *w >= 0.0));
            let grid = Closest::new(&mesh, &[0]);
            assert_eq!(grid.find(p, 9.0, |_| true), Some(found));
            assert_eq!(grid.find(p, 9.0, |_| false), None);
        }
        assert_eq!(foot(&mesh, 0, [1.5, 1.0, 2.0]).outside, 0.0);
        assert!((foot(&mesh, 0, [2.0, -2.0, 1.0]).outside - 2.0).abs() < 1e-12);
    }
}
