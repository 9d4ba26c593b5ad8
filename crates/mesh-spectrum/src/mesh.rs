//! A triangle mesh: vertices, triangles, and the face each triangle came from.
//!
//! Everything later in the flow ([`inspect`](crate::inspect), [`join`](crate::join), [`operator`](crate::operator))
//! starts from a [`Mesh`], so what can be wrong with plain arrays is refused here, once: indices out of range,
//! coordinates that are not finite, no triangle at all. What is merely unusual (triangles without area, edges with
//! three faces, unused vertices) is kept and reported by [`inspect`](crate::inspect).

use thiserror::Error;

use crate::split::{CORNERS_MAX, split};

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
    /// The faces as they were given, without repeated corners; absent where all are triangles.
    rings: Option<Rings>,
}

/// Rings of vertices one after another: face f is `corners[start[f]..start[f + 1]]`, empty where it was left out.
#[derive(Debug, Clone, PartialEq)]
struct Rings {
    start: Vec<usize>,
    corners: Vec<u32>,
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
    /// Positions for another number of vertices than the mesh has.
    #[error("positions of {given} vertices, and the mesh has {expected}")]
    OtherVertices {
        /// How many vertices the mesh has.
        expected: usize,
        /// How many were given.
        given: usize,
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
    /// A face has more corners than a mesh can be expected to mean.
    #[error(
        "face {face}: {corners} corners, at most {CORNERS_MAX} are split into triangles; split it in the program that made it"
    )]
    TooManyCorners {
        /// The face, numbered from 0 as given.
        face: usize,
        /// Its different corners.
        corners: usize,
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
        check(&vertices, triangles.iter().map(|triangle| &triangle[..]))?;
        if triangles.is_empty() {
            return Err(MeshError::NoTriangle { faces: 0 });
        }
        let face_of_triangle = (0..triangles.len() as u32).collect();
        Ok(Mesh { vertices, triangles, face_of_triangle, faces_left_out: 0, rings: None })
    }

    /// A mesh of triangles and quadrilaterals, as shell elements come: `[a, b, c, d]` in order around the face,
    /// `[a, b, c, c]` a triangle. See [`Mesh::from_polygons`].
    ///
    /// # Errors
    /// As for [`Mesh::new`].
    pub fn from_faces(vertices: Vec<[f64; 3]>, faces: &[[u32; 4]]) -> Result<Mesh, MeshError> {
        Mesh::from_polygons(vertices, faces.iter().map(|face| &face[..]))
    }

    /// A mesh of polygons, each a ring of vertex indices in order around the face.
    ///
    /// A quadrilateral is split along the diagonal with the larger minimum angle of its two triangles; along the one
    /// from its first corner when both are alike to 1e-4 rad (so that rounding does not decide on rectangles:
    /// single-precision coordinates leave about 1e-6). A polygon of up to 64 corners becomes the triangles whose
    /// smallest angle is largest. A triangle that is turned over against its face counts as worse than any other, so a
    /// face that is not convex is cut through its inward corner.
    ///
    /// A corner that a face repeats is taken once; a face with fewer than three different vertices is left out and
    /// counted ([`faces_left_out`](Mesh::faces_left_out)).
    ///
    /// # Errors
    /// As for [`Mesh::new`], and a face with more than 64 corners.
    pub fn from_polygons<'a>(
        vertices: Vec<[f64; 3]>,
        faces: impl Iterator<Item = &'a [u32]> + Clone,
    ) -> Result<Mesh, MeshError> {
        check(&vertices, faces.clone())?;
        let (mut triangles, mut face_of_triangle) = (Vec::new(), Vec::new());
        let mut faces_left_out = 0;
        let mut rings = Rings { start: vec![0], corners: Vec::new() };
        for (face, corners) in faces.enumerate() {
            let first = rings.corners.len();
            for &corner in corners {
                if !rings.corners[first..].contains(&corner) {
                    if rings.corners.len() - first == CORNERS_MAX {
                        return Err(MeshError::TooManyCorners { face, corners: corners.len() });
                    }
                    rings.corners.push(corner);
                }
            }
            if rings.corners.len() - first < 3 {
                rings.corners.truncate(first);
                faces_left_out += 1;
            }
            rings.start.push(rings.corners.len());
            split(&vertices, &rings.corners[first..], &mut triangles);
            if triangles.len() > u32::MAX as usize / 2 {
                return Err(MeshError::TooMany { what: "faces", given: triangles.len() });
            }
            face_of_triangle.resize(triangles.len(), face as u32);
        }
        let faces = rings.start.len() - 1;
        if triangles.is_empty() {
            return Err(MeshError::NoTriangle { faces });
        }
        let rings = (triangles.len() + faces_left_out > faces).then_some(rings);
        Ok(Mesh { vertices, triangles, face_of_triangle, faces_left_out, rings })
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

    /// How many faces were given, those left out included.
    pub fn faces(&self) -> usize {
        self.rings.as_ref().map_or(self.triangles.len() + self.faces_left_out, |rings| rings.start.len() - 1)
    }

    /// The faces that are in the mesh, each with its number as given and its corners in order, none of them twice.
    pub fn rings(&self) -> impl Iterator<Item = (u32, &[u32])> {
        let polygons = self.rings.iter().flat_map(|rings| {
            let ring = |ends: &[usize]| &rings.corners[ends[0]..ends[1]];
            let numbered = (0..).zip(rings.start.windows(2));
            numbered.map(move |(face, ends)| (face, ring(ends))).filter(|(_, ring)| !ring.is_empty())
        });
        let triangles = if self.rings.is_some() { &[] } else { &self.triangles[..] };
        polygons.chain(self.face_of_triangle.iter().copied().zip(triangles.iter().map(|triangle| &triangle[..])))
    }

    /// The mesh without the vertices that no face uses, and for each vertex kept its number here. Faces keep their
    /// numbers.
    pub fn without_unused_vertices(&self) -> (Mesh, Vec<u32>) {
        let mut new = vec![u32::MAX; self.vertices.len()];
        self.rings().flat_map(|(_, ring)| ring).for_each(|&vertex| new[vertex as usize] = 0);
        let kept: Vec<u32> = (0..).zip(&new).filter(|(_, new)| **new == 0).map(|(vertex, _)| vertex).collect();
        kept.iter().zip(0..).for_each(|(&old, number)| new[old as usize] = number);
        let renumbered = |corners: &[u32]| corners.iter().map(|&corner| new[corner as usize]).collect();
        let rings = self.rings.as_ref();
        let mesh = Mesh {
            vertices: kept.iter().map(|&vertex| self.vertices[vertex as usize]).collect(),
            triangles: self.triangles.iter().map(|triangle| triangle.map(|vertex| new[vertex as usize])).collect(),
            face_of_triangle: self.face_of_triangle.clone(),
            faces_left_out: self.faces_left_out,
            rings: rings.map(|rings| Rings { start: rings.start.clone(), corners: renumbered(&rings.corners) }),
        };
        (mesh, kept)
    }

    /// The same faces, cut into the same triangles, with the vertices elsewhere: a deformed state of this mesh.
    ///
    /// # Errors
    /// Another number of vertices, coordinates that are not finite.
    pub fn moved(&self, vertices: Vec<[f64; 3]>) -> Result<Mesh, MeshError> {
        let (expected, given) = (self.vertices.len(), vertices.len());
        if given != expected {
            return Err(MeshError::OtherVertices { expected, given });
        }
        check(&vertices, std::iter::empty::<&[u32]>())?;
        Ok(Mesh { vertices, ..self.clone() })
    }

    /// The three corner points of a triangle.
    pub(crate) fn corners(&self, triangle: [u32; 3]) -> [Point; 3] {
        triangle.map(|vertex| self.vertices[vertex as usize])
    }
}

fn check<'a>(vertices: &[Point], faces: impl Iterator<Item = &'a [u32]> + Clone) -> Result<(), MeshError> {
    // Half the range of u32, because two triangles may come from a face.
    for (what, given) in [("vertices", vertices.len()), ("faces", faces.clone().count())] {
        if given > u32::MAX as usize / 2 {
            return Err(MeshError::TooMany { what, given });
        }
    }
    if let Some(vertex) = vertices.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
        return Err(MeshError::NotFinite { vertex, point: vertices[vertex] });
    }
    for (face, corners) in faces.enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&corner| corner as usize >= vertices.len()) {
            return Err(MeshError::VertexOutOfRange { face, vertex, vertices: vertices.len() });
        }
    }
    Ok(())
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
    fn faces_with_repeated_vertices() {
        let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::from_faces(square.clone(), &[[0, 0, 1, 1], [0, 1, 2, 2], [0, 1, 2, 3]]).unwrap();
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.face_of_triangle(), [1, 2, 2]);
        assert_eq!(mesh.faces_left_out(), 1);
        assert_eq!(Mesh::from_faces(square, &[[0, 0, 1, 1]]), Err(MeshError::NoTriangle { faces: 1 }));
    }

    #[test]
    fn unused_vertices_are_dropped_and_named() {
        let vertices = vec![[9.0; 3], [0.0; 3], [1.0, 0.0, 0.0], [8.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::from_polygons(vertices, [&[1u32, 2, 4, 5][..], &[3, 3, 0]].into_iter()).unwrap();
        assert_eq!((mesh.faces(), mesh.faces_left_out()), (2, 1));
        let (small, kept) = mesh.without_unused_vertices();
        assert_eq!(kept, [1, 2, 4, 5]);
        assert_eq!(small.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(small.rings().collect::<Vec<_>>(), [(0, &[0u32, 1, 2, 3][..])]);
    }

    #[test]
    fn a_moved_mesh_keeps_its_triangles() {
        // Of this rhombus the other diagonal would be chosen.
        let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let rhombus = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.9, 0.4, 0.0], [0.9, 0.4, 0.0]];
        let mesh = Mesh::from_faces(square, &[[0, 1, 2, 3]]).unwrap();
        let moved = mesh.moved(rhombus.clone()).unwrap();
        assert_eq!((moved.triangles(), moved.vertices()), (mesh.triangles(), &rhombus[..]));
        assert_ne!(Mesh::from_faces(rhombus.clone(), &[[0, 1, 2, 3]]).unwrap().triangles(), mesh.triangles());
        assert_eq!(mesh.moved(rhombus[..3].to_vec()), Err(MeshError::OtherVertices { expected: 4, given: 3 }));
        let mut broken = rhombus;
        broken[1][2] = f64::INFINITY;
        assert!(matches!(mesh.moved(broken), Err(MeshError::NotFinite { vertex: 1, .. })));
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
