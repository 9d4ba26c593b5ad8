//! The rotation field: how far, and about which axis, each place of the surface has turned.
//!
//! A displacement is an integral of rotations: a hinge here and a hinge there move the far end differently, although
//! both are a hinge. The rotation field is local, so its spectrum says *what kind* of deformation it is wherever it
//! happens, and its lowest coefficients say *which way*. For a nearly isometric surface it holds the deformation but
//! for a translation.
//!
//! For each face the deformation gradient F maps two edges and the unit normal of the undeformed face to those of the
//! deformed one; F = R U with R a rotation by θ about an axis a (polar decomposition). The face has r = sin θ a, the
//! skew part of R, taken against the mean rotation of the whole surface: a part that turned with the car has not
//! deformed. Unlike the rotation vector θ a, sin θ a does not jump at half a turn, which folds do reach. A vertex has the
//! mean of its faces, weighted by area, so that with the lumped mass ρ = Φᵀ M r = Σ over faces of A_f r_f times the mean
//! of φ at its corners: the integral of φ r for a field that is constant on faces.

mod spectrum;

pub(crate) use spectrum::TURN_MIN;
pub use spectrum::{OCTAVES, RotationSpectrum, Ruler};

use std::collections::HashMap;

use faer::{Mat, Side};

use crate::vector::{Vector, add, cross, dot, subtract};

/// A 3 × 3 matrix by columns.
type Matrix = [Vector; 3];

/// The undeformed surface, ready to tell how deformed ones have turned.
#[derive(Debug, Clone)]
pub struct Rest<'a> {
    triangles: &'a [[u32; 3]],
    vertices: usize,
    /// T; `None` for a face without area.
    faces: Vec<Option<Face>>,
}

/// A face in coordinates of its own: edge u along the first axis, n the third.
#[derive(Debug, Clone, Copy)]
struct Face {
    /// Unit vectors along u, across it in the face, and along the normal.
    axes: Matrix,
    /// u = (a, 0), v = (b, d); d > 0.
    a: f64,
    b: f64,
    d: f64,
}

impl<'a> Rest<'a> {
    /// Looks at the undeformed faces. `undeformed`: N × 3.
    pub fn of(triangles: &'a [[u32; 3]], undeformed: &[Vector]) -> Self {
        let faces = triangles.iter().map(|face| Face::of(face.map(|vertex| undeformed[vertex as usize])));
        Self { triangles, vertices: undeformed.len(), faces: faces.collect() }
    }

    /// sin θ × axis at the vertices, N × 3, without unit. Vertices without a face that keeps its area have none: zero.
    ///
    /// `shape`: N × 3.
    pub fn field(&self, shape: &[Vector]) -> Vec<Vector> {
        let turned: Vec<Option<(Matrix, f64)>> = (0..self.triangles.len()).map(|face| self.turn(face, shape)).collect();
        let mut weighted = Matrix::default();
        for (rotation, area) in turned.iter().flatten() {
            weighted.iter_mut().zip(rotation).for_each(|(sum, column)| *sum = add(*sum, column.map(|x| area * x)));
        }
        let mean = nearest_to(&weighted);
        let mut sum = vec![Vector::default(); self.vertices];
        let mut areas = vec![0.0; self.vertices];
        for (triangle, turned) in self.triangles.iter().zip(&turned) {
            let Some((rotation, area)) = turned else { continue };
            let relative = skew_of_product(&mean, rotation);
            for &vertex in triangle {
                areas[vertex as usize] += area;
                sum[vertex as usize] = add(sum[vertex as usize], relative.map(|x| area * x));
            }
        }
        sum.iter().zip(&areas).map(|(sum, &area)| if area > 0.0 { sum.map(|x| x / area) } else { *sum }).collect()
    }

    /// Looks at the faces of a shape one by one. `shape`: N × 3.
    pub fn health(&self, shape: &[Vector]) -> Health {
        let turned: Vec<Option<Matrix>> =
            (0..self.triangles.len()).map(|face| self.turn(face, shape).map(|(rotation, _)| rotation)).collect();
        let mut face_at: HashMap<(u32, u32), usize> = HashMap::new();
        let (mut inner, mut over) = (0_usize, 0_usize);
        for (at, &[a, b, c]) in self.triangles.iter().enumerate() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let Some(other) = face_at.insert((from.min(to), from.max(to)), at) else { continue };
                if let (Some(one), Some(other)) = (&turned[at], &turned[other]) {
                    inner += 1;
                    // tr(R₁ᵀ R₂) = 1 + 2 cos θ.
                    let trace: f64 = one.iter().zip(other).map(|(x, y)| dot(*x, *y)).sum();
                    over += usize::from(trace < 1.0 + 2.0 * (5.0 * std::f64::consts::FRAC_PI_6).cos());
                }
            }
        }
        let lost = |(rest, turned): &(&Option<Face>, &Option<Matrix>)| rest.is_some() && turned.is_none();
        Health {
            without_area: self.faces.iter().zip(&turned).filter(lost).count(),
            turned_over: over as f64 / inner.max(1) as f64,
        }
    }

    /// The rotation of a face and its undeformed area; `None` where it has none, before or after.
    ///
    /// F keeps the unit normal a unit normal, so its polar decomposition is that of the 2 × 2 gradient G in the two faces'
    /// own axes, and the rotation nearest to G has cos ∝ G₁₁ + G₂₂, sin ∝ G₂₁ − G₁₂; det G > 0, both faces being counted
    /// the way their normals point.
    fn turn(&self, face: usize, shape: &[Vector]) -> Option<(Matrix, f64)> {
        let rest = self.faces[face]?;
        let now = Face::of(self.triangles[face].map(|vertex| shape[vertex as usize]))?;
        // G = [u' v'] [u v]⁻¹, times a d.
        let (c, s) = (now.a * rest.d + now.d * rest.a, now.a * rest.b - now.b * rest.a);
        let length = c.hypot(s);
        let (c, s) = (c / length, s / length);
        let [e1, e2, n] = rest.axes;
        let [f1, f2, m] = now.axes;
        // The face's axes turned in its plane.
        let (g1, g2): (Vector, Vector) =
            (std::array::from_fn(|i| c * f1[i] + s * f2[i]), std::array::from_fn(|i| c * f2[i] - s * f1[i]));
        let rotation: Matrix = std::array::from_fn(|column| {
            std::array::from_fn(|row| g1[row] * e1[column] + g2[row] * e2[column] + m[row] * n[column])
        });
        rotation.as_flattened().iter().all(|x| x.is_finite()).then_some((rotation, rest.a * rest.d / 2.0))
    }
}

impl Face {
    /// `None` for a triangle without area.
    fn of([a, b, c]: [Vector; 3]) -> Option<Self> {
        let (u, v) = (subtract(b, a), subtract(c, a));
        let normal = cross(u, v);
        let (length, double_area) = (dot(u, u).sqrt(), dot(normal, normal).sqrt());
        if !(length > 0.0 && double_area > 0.0) {
            return None;
        }
        let (e1, n) = (u.map(|x| x / length), normal.map(|x| x / double_area));
        Some(Self { axes: [e1, cross(n, e1), n], a: length, b: dot(v, e1), d: double_area / length })
    }
}

/// sin θ × axis at the vertices of one shape, N × 3: [`Rest::field`] for one question.
pub fn field(triangles: &[[u32; 3]], undeformed: &[Vector], shape: &[Vector]) -> Vec<Vector> {
    Rest::of(triangles, undeformed).field(shape)
}

/// sin θ × axis of a rotation Aᵀ B.
fn skew_of_product(a: &Matrix, b: &Matrix) -> Vector {
    let entry = |row: usize, column: usize| dot(a[row], b[column]);
    [(entry(2, 1) - entry(1, 2)) / 2.0, (entry(0, 2) - entry(2, 0)) / 2.0, (entry(1, 0) - entry(0, 1)) / 2.0]
}

/// What makes a rotation field doubtful.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// Faces that had an area and have none.
    pub without_area: usize,
    /// Share of the inner edges across which the surface turned by more than 150 degrees.
    pub turned_over: f64,
}

/// The rotation R that is nearest to a sum of rotations, max tr(Rᵀ B): their mean in the chordal metric (Moakher 2002),
/// by the quaternion of Horn 1987. The identity for B = 0.
fn nearest_to(b: &Matrix) -> Matrix {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if b.as_flattened().iter().all(|&x| x == 0.0) {
        return identity;
    }
    let Ok(spectrum) = horn(b).self_adjoint_eigen(Side::Lower) else { return identity };
    let best = spectrum.U().col(3);
    let [w, x, y, z] = [best[0], best[1], best[2], best[3]];
    [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
        [2.0 * (x * y - w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z + w * x)],
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z],
    ]
}

/// The symmetric 4 × 4 matrix of Horn 1987 for a cross-covariance S = Σ p qᵀ: its largest eigenvalue is the maximum of
/// tr(R S) over rotations R, and the eigenvector of it the quaternion of that rotation.
pub(crate) fn horn(s: &Matrix) -> Mat<f64> {
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = *s;
    let entries = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    Mat::from_fn(4, 4, |i, j| entries[i][j])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[u32; 3]; 1] = [[0, 1, 2]];

    /// Rodrigues' formula.
    fn rotate(axis: Vector, angle: f64, p: Vector) -> Vector {
        let (s, c) = angle.sin_cos();
        let (k, along) = (cross(axis, p), dot(axis, p));
        std::array::from_fn(|i| p[i] * c + k[i] * s + axis[i] * along * (1.0 - c))
    }

    #[test]
    fn a_rotation_is_found_whatever_the_translation_and_the_stretch() {
        let axis = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
        let undeformed = [[0.0, 0.0, 0.0], [2.0, 0.3, 0.1], [0.4, 1.0, -0.2]];
        for angle in [0.0, 1e-9, 0.1, 1.0, 3.0, std::f64::consts::PI] {
            for stretch in [1.0, 0.5, 40.0] {
                let shape = undeformed.map(|p| rotate(axis, angle, p.map(|x| stretch * x)).map(|x| x + 7.0));
                let (found, area) = Rest::of(&TRIANGLE, &undeformed).turn(0, &shape).unwrap();
                let found = skew_of_product(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], &found);
                assert!(area > 0.0);
                // The shape moves by 7: rounding is 7 · 2e-16 over edges of 0.5 and more, a few times.
                let error = (0..3).map(|c| (found[c] - angle.sin() * axis[c]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-13, "angle {angle}, stretch {stretch}: {found:?}");
            }
        }
    }

    #[test]
    fn the_rotation_is_that_of_the_polar_decomposition() {
        // U = Rᵀ F is symmetric and positive: u · U v = v · U u, and u · U u > 0.
        let undeformed = [[0.0, 0.0, 0.0], [2.0, 0.3, 0.1], [0.4, 1.0, -0.2]];
        for shape in [
            [[1.0, 2.0, 3.0], [1.5, 4.0, 2.0], [0.0, 2.0, 4.5]],
            [[0.0, 0.0, 0.0], [-2.0, -0.3, -0.1], [0.4, 1.0, -0.2]],
            [[5.0, 0.0, 0.0], [5.1, 0.0, 0.0], [5.0, 7.0, 0.0]],
        ] {
            let (rotation, _) = Rest::of(&TRIANGLE, &undeformed).turn(0, &shape).unwrap();
            let edges = |points: &[Vector; 3]| [subtract(points[1], points[0]), subtract(points[2], points[0])];
            let ([u, v], [fu, fv]) = (edges(&undeformed), edges(&shape));
            let back = |x: Vector| -> Vector { std::array::from_fn(|row| dot(rotation[row], x)) };
            assert!((dot(u, back(fv)) - dot(v, back(fu))).abs() < 1e-13, "{shape:?}");
            assert!(dot(u, back(fu)) * dot(v, back(fv)) > dot(u, back(fv)).powi(2) && dot(u, back(fu)) > 0.0);
        }
    }

    #[test]
    fn a_rigid_motion_of_the_shape_changes_nothing() {
        // Two faces, one of which turns about the common edge.
        let faces = [[0, 1, 2], [1, 3, 2]];
        let undeformed = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.2, 0.9, 0.1]];
        let mut shape = undeformed;
        shape[3] = [0.9, 0.7, 0.8];
        let moved = shape.map(|p| rotate([0.0, 0.6, 0.8], 2.5, p).map(|x| x - 3.0));
        for (a, b) in field(&faces, &undeformed, &shape).iter().zip(field(&faces, &undeformed, &moved)) {
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-12), "{a:?} {b:?}");
        }
        let rigid = undeformed.map(|p| rotate([0.0, 0.6, 0.8], 2.5, p).map(|x| x - 3.0));
        assert!(field(&faces, &undeformed, &rigid).as_flattened().iter().all(|x| x.abs() < 1e-12));
    }

    #[test]
    fn faces_without_area_turn_nothing() {
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let good = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(field(&TRIANGLE, &flat, &good), [[0.0; 3]; 3]);
        assert_eq!(field(&TRIANGLE, &good, &flat), [[0.0; 3]; 3]);
    }
}
