//! The tufted Laplacian: any triangles, no negative weight.
//!
//! Sharp and Crane 2020, "A Laplacian for nonmanifold triangle meshes":
//!
//! 1. **Mollify**: one length ε is added to every edge, the smallest with which each triangle's inequality has a slack
//!    of δ = 1e-5 of the mean edge; so a face without area becomes a thin one.
//! 2. **Cover**: every face is taken twice, front and back. Around an edge, sorted by angle, the side of a face that
//!    looks to the next face is glued to that face's side that looks back. The two sheets so made are an oriented
//!    surface without boundary in which every edge has two faces, whatever the mesh was.
//! 3. **Flip** edges of the cover, by their lengths alone, until every edge is Delaunay: cot α + cot β ≥ 0.
//! 4. L and M of linear elements on the cover's triangles, each with half its weight, on the vertices of the mesh.

use super::{Elements, OperatorError};
use crate::mesh::{Mesh, Point, cross, dot, norm, sub};

/// δ, in mean edge lengths: the value of the authors' program.
const MOLLIFY: f64 = 1e-5;

/// Cotangents that sum to more than this stay: right-angled grids are on the edge, and rounding must not decide.
const DELAUNAY: f64 = -2e-6;

pub(super) fn elements(mesh: &Mesh, consistent: bool) -> Result<Elements, OperatorError> {
    let mut elements = Elements::new(mesh.vertices().len(), consistent);
    let faces: Vec<u32> =
        (0..).zip(mesh.triangles()).filter(|&(_, &[a, b, c])| a != b && b != c && c != a).map(|(f, _)| f).collect();
    elements.triangles_without_area = mesh.triangles().len() - faces.len();
    let mut cover = Cover::new(mesh, &faces);
    elements.flips = cover.flip_to_delaunay().map_err(|flips| OperatorError::Flips { flips })?;
    elements.edges.reserve(3 * cover.origin.len());
    for (triangle, corners) in cover.origin.as_chunks::<3>().0.iter().enumerate() {
        let (cot, area) = cover.cotangents(3 * triangle);
        if !elements.add_triangle(*corners, cot, area, 0.5) {
            return Err(OperatorError::NotFinite { triangle: faces[triangle / 2] as usize });
        }
    }
    Ok(elements)
}

/// A closed triangulated surface by its half edges: three of a triangle follow each other, 3t to 3t + 2, counterclockwise.
struct Cover {
    /// Vertex where each half edge starts.
    origin: Vec<u32>,
    /// The half edge that it is glued to.
    twin: Vec<u32>,
    /// Its length, the same as its twin's.
    length: Vec<f64>,
}

/// A side of a face at an edge: the edge, the angle of the face around it, the face's half edge that runs from the lower
/// vertex to the higher one, and the other.
struct Side {
    edge: [u32; 2],
    angle: f64,
    up: u32,
    down: u32,
}

fn next(h: usize) -> usize {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

impl Cover {
    /// Front of the k-th face: triangle 2k; back, turned over: 2k + 1.
    fn new(mesh: &Mesh, faces: &[u32]) -> Cover {
        let mut origin = Vec::with_capacity(6 * faces.len());
        let mut sides = Vec::with_capacity(3 * faces.len());
        for (k, &face) in faces.iter().enumerate() {
            let [a, b, c] = mesh.triangles()[face as usize];
            origin.extend([a, b, c, a, c, b]);
            // Half edge a→b of the front is b→a of the back: (0, 5), (1, 4), (2, 3).
            for (i, (from, to, other)) in [(a, b, c), (b, c, a), (c, a, b)].into_iter().enumerate() {
                let (front, back) = ((6 * k + i) as u32, (6 * k + 5 - i) as u32);
                let (edge, up, down) = if from < to { ([from, to], front, back) } else { ([to, from], back, front) };
                let points = [edge[0], edge[1], other].map(|vertex| mesh.vertices()[vertex as usize]);
                sides.push(Side { edge, angle: angle_around(points), up, down });
            }
        }
        sides.sort_by(|a, b| a.edge.cmp(&b.edge).then(a.angle.total_cmp(&b.angle)).then(a.up.cmp(&b.up)));
        let mut cover = Cover { twin: vec![0; origin.len()], length: vec![0.0; origin.len()], origin };
        let (mut edges, mut sum) = (0, 0.0);
        for around in sides.chunk_by(|a, b| a.edge == b.edge) {
            let [a, b] = around[0].edge.map(|vertex| mesh.vertices()[vertex as usize]);
            let length = norm(sub(a, b));
            edges += 1;
            sum += length;
            for (i, side) in around.iter().enumerate() {
                // A face's half edge up looks towards growing angles.
                let (up, down) = (side.up, around[(i + 1) % around.len()].down);
                (cover.twin[up as usize], cover.twin[down as usize]) = (down, up);
                (cover.length[up as usize], cover.length[down as usize]) = (length, length);
            }
        }
        cover.mollify(MOLLIFY * sum / edges.max(1) as f64);
        cover
    }

    fn mollify(&mut self, slack: f64) {
        let missing = self.length.as_chunks::<3>().0.iter().map(|&[a, b, c]| {
            let longest = a.max(b).max(c);
            slack + longest - (a + b + c - longest)
        });
        let more = missing.fold(0.0, f64::max);
        self.length.iter_mut().for_each(|length| *length += more);
    }

    /// cot of the angle opposite to each half edge of the triangle of h, in the order of its corners (the first is that
    /// of the triangle's second half edge, which is opposite to its first corner), and the area.
    fn cotangents(&self, h: usize) -> ([f64; 3], f64) {
        let first = h - h % 3;
        let [a, b, c] = [0, 1, 2].map(|k| self.length[first + k]);
        let area = area(a, b, c);
        let cot = |opposite: f64, p: f64, q: f64| (p * p + q * q - opposite * opposite) / (4.0 * area);
        ([cot(b, c, a), cot(c, a, b), cot(a, b, c)], area)
    }

    /// cot of the angle opposite to h.
    fn cot(&self, h: usize) -> f64 {
        self.cotangents(h).0[next(next(h)) % 3]
    }

    /// Flips until every edge is Delaunay; how many flips it took, as an error if they do not end.
    fn flip_to_delaunay(&mut self) -> Result<usize, usize> {
        let half_edges = self.origin.len();
        let mut open: Vec<u32> = (0..half_edges as u32).filter(|&h| h < self.twin[h as usize]).collect();
        let mut waiting: Vec<bool> = self.twin.iter().zip(0..).map(|(&twin, h)| h < twin).collect();
        let mut flips = 0;
        while let Some(h) = open.pop() {
            let h = h as usize;
            waiting[h] = false;
            let g = self.twin[h] as usize;
            if h / 3 == g / 3 || self.cot(h) + self.cot(g) >= DELAUNAY || !self.flip(h) {
                continue;
            }
            flips += 1;
            if flips > 100 * half_edges {
                return Err(flips);
            }
            let first = |h: usize| h - h % 3;
            for outer in [first(h) + 1, first(h) + 2, first(g) + 1, first(g) + 2] {
                let outer = outer.min(self.twin[outer] as usize);
                if !waiting[outer] {
                    waiting[outer] = true;
                    open.push(outer as u32);
                }
            }
        }
        Ok(flips)
    }

    /// Turns the diagonal h of the quadrilateral i, m, j, k (h from i to j, k on its side, m on the other) into k–m.
    /// False where the new length is no number.
    fn flip(&mut self, h: usize) -> bool {
        let g = self.twin[h] as usize;
        let (jk, im) = (next(h), next(g));
        let (ki, mj) = (next(jk), next(im));
        let length = {
            // i at the origin, j at (l, 0), k above, m below.
            let l = self.length[h];
            let apex = |from_i: f64, from_j: f64| {
                let x = 0.5 * (l + (from_i - from_j) * ((from_i + from_j) / l));
                (x, 2.0 * area(l, from_i, from_j) / l)
            };
            let (k, m) = (apex(self.length[ki], self.length[jk]), apex(self.length[im], self.length[mj]));
            (k.0 - m.0).hypot(k.1 + m.1)
        };
        if !(length.is_finite() && length > 0.0) {
            return false;
        }
        let (a, b) = (h - h % 3, g - g % 3);
        let (old, new) = ([ki, im, mj, jk], [a + 1, a + 2, b + 1, b + 2]);
        let moved = |twin: u32| old.iter().position(|&o| o == twin as usize).map_or(twin, |at| new[at] as u32);
        let sides = old.map(|o| (self.origin[o], self.length[o], moved(self.twin[o])));
        let (k, m) = (self.origin[ki], self.origin[mj]);
        for (place, (origin, length, twin)) in new.into_iter().zip(sides) {
            (self.origin[place], self.length[place], self.twin[place]) = (origin, length, twin);
            self.twin[twin as usize] = place as u32;
        }
        for (place, origin, twin) in [(a, m, b), (b, k, a)] {
            (self.origin[place], self.length[place], self.twin[place]) = (origin, length, twin as u32);
        }
        true
    }
}

/// The angle, right-handed around the line from the first point to the second, at which the third lies; from any zero
/// that depends on the line alone.
fn angle_around([from, to, point]: [Point; 3]) -> f64 {
    let axis = sub(to, from);
    // The coordinate axis that the line is least along.
    let least = (0..3).min_by(|&a, &b| axis[a].abs().total_cmp(&axis[b].abs())).unwrap_or(0);
    let e1 = cross(axis, std::array::from_fn(|c| if c == least { 1.0 } else { 0.0 }));
    let e2 = cross(axis, e1);
    let out = sub(point, from);
    let angle = (dot(out, e2) / norm(e2)).atan2(dot(out, e1) / norm(e1));
    if angle.is_nan() { 0.0 } else { angle }
}

/// The area of a triangle by its edges, to rounding of the edges (Kahan 2014, "Miscalculating area and angles of a
/// needle-like triangle"); 0 where they make no triangle.
fn area(a: f64, b: f64, c: f64) -> f64 {
    let mut edges = [a, b, c];
    edges.sort_by(|a, b| b.total_cmp(a));
    let [a, b, c] = edges;
    let square = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.25 * square.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every half edge is its twin's twin, runs the other way, and has its length.
    fn is_whole(cover: &Cover) {
        for h in 0..cover.origin.len() {
            let g = cover.twin[h] as usize;
            assert_eq!((cover.twin[g] as usize, cover.length[g]), (h, cover.length[h]));
            assert!(g != h && cover.origin[g] == cover.origin[next(h)] && cover.origin[h] == cover.origin[next(g)]);
        }
    }

    #[test]
    fn a_cover_stays_whole_while_it_is_flipped() {
        // Three fins on one edge, with obtuse angles, one of them twice.
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.1, 0.0], [0.4, -0.05, 0.1], [0.6, 0.0, -0.2]];
        let mesh = Mesh::new(vertices, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 4, 1]]).unwrap();
        let mut cover = Cover::new(&mesh, &[0, 1, 2, 3]);
        is_whole(&cover);
        let area = |cover: &Cover| (0..8).map(|t| cover.cotangents(3 * t).1).sum::<f64>();
        let before = area(&cover);
        assert!(cover.flip_to_delaunay().unwrap() > 0);
        is_whole(&cover);
        assert!((area(&cover) / before - 1.0).abs() < 1e-12, "a flip moves no area");
        for h in 0..cover.origin.len() {
            assert!(cover.cot(h) + cover.cot(cover.twin[h] as usize) >= DELAUNAY);
        }
    }

    #[test]
    fn faces_around_an_edge_are_glued_to_their_neighbours() {
        // Three fins at 0°, 100° and 200°: the front of the first looks to the second.
        let fin = |degrees: f64| {
            let (s, c) = degrees.to_radians().sin_cos();
            [c, s, 0.5]
        };
        let vertices = vec![[0.0; 3], [0.0, 0.0, 1.0], fin(0.0), fin(200.0), fin(100.0)];
        let mesh = Mesh::new(vertices, vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]]).unwrap();
        let cover = Cover::new(&mesh, &[0, 1, 2]);
        // Half edge 0→1 of the front of face k is 6k, 1→0 of its back 6k + 5.
        assert_eq!([cover.twin[0], cover.twin[6], cover.twin[12]], [17, 5, 11]);
    }
}
