//! A triangle mesh: vertices, triangles, and the face each triangle came from.
//!
//! Everything later in the flow ([`inspect`](crate::inspect), [`join`](crate::join), [`operator`](crate::operator))
//! starts from a [`Mesh`], so what can be wrong with plain arrays is refused here, once: indices out of range,
//! coordinates that are not finite, no triangle at all. What is merely unusual (triangles without area, edges with
//! three faces, unused vertices) is kept and reported by [`inspect`](crate::inspect).

use thiserror::Error;

/// A point or vector in space, in the model's length unit.
pub(crate) type Point = [f64; 3];

/// Triangles over shared vertices, in the model's length unit ℓ (usually mm).
///
/// Vertices are numbered from 0 in the order they were given; nothing is merged, dropped or renumbered.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    face_of_triangle: Vec<u32>,
    faces_left_out: usize,
}

/// Why arrays are not a mesh.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A face names a vertex that does not exist.
    #[error("face {face}: vertex {vertex} does not exist, there are {vertices} (numbered from 0)")]
    VertexOutOfRange {
        /// The face, numbered from 0 as given.
        face: usize,
        /// The index it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex}: coordinates {point:?} must be finite")]
    NotFinite {
        /// The vertex, numbered from 0.
        vertex: usize,
        /// Its coordinates.
        point: [f64; 3],
    },
    /// There is no face with three different vertices.
    #[error("no triangle: a mesh needs at least one face with three different vertices ({faces} faces given)")]
    NoTriangle {
        /// How many faces were given.
        faces: usize,
    },
    /// More vertices or faces than 32-bit indices can name.
    #[error("{given} {what}: at most {} can be numbered", u32::MAX)]
    TooMany {
        /// "vertices" or "faces".
        what: &'static str,
        /// How many were given.
        given: usize,
    },
}

impl Mesh {
    /// A mesh of triangles, N vertices and T triangles of vertex indices from 0.
    ///
    /// # Errors
    /// Indices out of range, coordinates that are not finite, no triangle.
    pub fn new(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Mesh, MeshError> {
        check(&vertices, &triangles)?;
        if triangles.is_empty() {
            return Err(MeshError::NoTriangle { faces: 0 });
        }
        let face_of_triangle = (0..triangles.len() as u32).collect();
        Ok(Mesh { vertices, triangles, face_of_triangle, faces_left_out: 0 })
    }

    /// A mesh of triangles and quadrilaterals, as shell elements come: `[a, b, c, d]` in order around the face,
    /// `[a, b, c, c]` a triangle.
    ///
    /// A quadrilateral is split along the diagonal with the larger minimum angle of its two triangles; along a–c
    /// when both are alike to 1e-4 rad (so that rounding does not decide on rectangles: single-precision
    /// coordinates leave about 1e-6). A face that repeats one of
    /// its vertices is a triangle; one with fewer than three different vertices is left out and counted
    /// ([`faces_left_out`](Mesh::faces_left_out)).
    ///
    /// # Errors
    /// As for [`Mesh::new`].
    pub fn from_faces(vertices: Vec<[f64; 3]>, faces: &[[u32; 4]]) -> Result<Mesh, MeshError> {
        check(&vertices, faces)?;
        let mut triangles = Vec::with_capacity(2 * faces.len());
        let mut face_of_triangle = Vec::with_capacity(2 * faces.len());
        let mut faces_left_out = 0;
        for (face, corners) in faces.iter().enumerate() {
            let mut ring: Vec<u32> = Vec::with_capacity(4);
            for &corner in corners {
                if !ring.contains(&corner) {
                    ring.push(corner);
                }
            }
            match ring[..] {
                [a, b, c] => triangles.push([a, b, c]),
                [a, b, c, d] => triangles.extend(split(&vertices, [a, b, c, d])),
                _ => faces_left_out += 1,
            }
            face_of_triangle.resize(triangles.len(), face as u32);
        }
        if triangles.is_empty() {
            return Err(MeshError::NoTriangle { faces: faces.len() });
        }
        Ok(Mesh { vertices, triangles, face_of_triangle, faces_left_out })
    }

    /// N vertices, in the model's length unit.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// T triangles, vertex indices from 0.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// T indices: the face, numbered from 0 as given, that each triangle is or is half of.
    pub fn face_of_triangle(&self) -> &[u32] {
        &self.face_of_triangle
    }

    /// How many faces had fewer than three different vertices and are not in the mesh.
    pub fn faces_left_out(&self) -> usize {
        self.faces_left_out
    }

    /// The three corner points of a triangle.
    pub(crate) fn corners(&self, triangle: [u32; 3]) -> [Point; 3] {
        triangle.map(|vertex| self.vertices[vertex as usize])
    }
}

fn check<const CORNERS: usize>(vertices: &[Point], faces: &[[u32; CORNERS]]) -> Result<(), MeshError> {
    // Half the range of u32, because two triangles may come from a face.
    for (what, given) in [("vertices", vertices.len()), ("faces", faces.len())] {
        if given > u32::MAX as usize / 2 {
            return Err(MeshError::TooMany { what, given });
        }
    }
    if let Some(vertex) = vertices.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
        return Err(MeshError::NotFinite { vertex, point: vertices[vertex] });
    }
    for (face, corners) in faces.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&corner| corner as usize >= vertices.len()) {
            return Err(MeshError::VertexOutOfRange { face, vertex, vertices: vertices.len() });
        }
    }
    Ok(())
}

/// Minimum angles closer than this, in radians, count as equal.
const ALIKE: f64 = 1e-4;

/// The two triangles of a quadrilateral, split along the diagonal with the larger minimum angle.
fn split(vertices: &[Point], [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let smallest = |halves: [[u32; 3]; 2]| {
        let angles = |half: [u32; 3]| smallest_angle(half.map(|vertex| vertices[vertex as usize]));
        angles(halves[0]).min(angles(halves[1]))
    };
    let along_ac = [[a, b, c], [a, c, d]];
    let along_bd = [[a, b, d], [b, c, d]];
    if smallest(along_bd) > smallest(along_ac) + ALIKE { along_bd } else { along_ac }
}

/// The smallest angle of a triangle, in radians; 0 where an edge has no length.
fn smallest_angle([a, b, c]: [Point; 3]) -> f64 {
    let angle = |at: Point, to: Point, and: Point| {
        let (u, v) = (sub(to, at), sub(and, at));
        norm(cross(u, v)).atan2(dot(u, v))
    };
    angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
}

pub(crate) fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

/// Twice the area of a triangle; `None` where it is zero to working precision.
///
/// |u×v| is computed with an error of a few 1e-16 of the longest edge squared; below 1e-12 of it, fewer than four
/// digits of the area are left, and the cotangents (its reciprocal) mean nothing.
pub(crate) fn double_area([a, b, c]: [Point; 3]) -> Option<f64> {
    let (u, v, w) = (sub(b, a), sub(c, a), sub(c, b));
    let area = norm(cross(u, v));
    (area > 1e-12 * dot(u, u).max(dot(v, v)).max(dot(w, w))).then_some(area)
}

/// A forest of merged indices: the classes of the smallest equivalence that holds all merged pairs.
pub(crate) struct Union(Vec<u32>);

impl Union {
    pub(crate) fn new(len: usize) -> Union {
        Union((0..len as u32).collect())
    }

    /// The lowest member of the class of `i`.
    pub(crate) fn root(&mut self, i: u32) -> u32 {
        let mut i = i;
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize]; // halve the path
            i = self.0[i as usize];
        }
        i
    }

    pub(crate) fn merge(&mut self, i: u32, j: u32) {
        let (i, j) = (self.root(i), self.root(j));
        self.0[i.max(j) as usize] = i.min(j);
    }

    /// The class of every index, numbered by lowest member, and how many there are.
    pub(crate) fn classes(mut self) -> (Vec<u32>, usize) {
        let mut class = vec![0; self.0.len()];
        let mut count = 0;
        for i in 0..self.0.len() {
            let root = self.root(i as u32) as usize;
            class[i] = if root == i {
                count += 1;
                count - 1
            } else {
                class[root]
            };
        }
        (class, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadrilateral_is_split_along_the_better_diagonal() {
        // A kite, long in x: the diagonal b-d (short, through the middle) leaves angles of 53°, a-c leaves 14°.
        let kite = vec![[-2.0, 0.0, 0.0], [0.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::from_faces(kite, &[[0, 1, 2, 3]]).unwrap();
        assert_eq!(mesh.triangles(), [[0, 1, 3], [1, 2, 3]]);
        assert_eq!(mesh.face_of_triangle(), [0, 0]);
    }

    #[test]
    fn faces_with_repeated_vertices() {
        let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::from_faces(square.clone(), &[[0, 0, 1, 1], [0, 1, 2, 2], [0, 1, 2, 3]]).unwrap();
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.face_of_triangle(), [1, 2, 2]);
        assert_eq!(mesh.faces_left_out(), 1);
        assert_eq!(Mesh::from_faces(square, &[[0, 0, 1, 1]]), Err(MeshError::NoTriangle { faces: 1 }));
    }

    #[test]
    fn errors_name_the_place() {
        let corner = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let error = Mesh::new(corner.clone(), vec![[0, 1, 2], [0, 1, 7]]).unwrap_err();
        assert_eq!(error.to_string(), "face 1: vertex 7 does not exist, there are 3 (numbered from 0)");
        let mut broken = corner;
        broken[2][1] = f64::NAN;
        assert!(matches!(Mesh::new(broken, vec![[0, 1, 2]]), Err(MeshError::NotFinite { vertex: 2, .. })));
    }
}
