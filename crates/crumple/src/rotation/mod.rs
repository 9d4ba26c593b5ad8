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

/// sin θ × axis at the vertices, N × 3, without unit. Vertices without a face that keeps its area have none: zero.
///
/// `undeformed`, `shape`: N × 3.
pub fn field(triangles: &[[u32; 3]], undeformed: &[Vector], shape: &[Vector]) -> Vec<Vector> {
    let turned: Vec<Option<(Matrix, f64)>> = triangles.iter().map(|face| turn(*face, undeformed, shape)).collect();
    let mut weighted = Matrix::default();
    for (rotation, area) in turned.iter().flatten() {
        weighted.iter_mut().zip(rotation).for_each(|(sum, column)| *sum = add(*sum, column.map(|x| area * x)));
    }
    let mean = nearest_to(&weighted);
    let mut sum = vec![Vector::default(); undeformed.len()];
    let mut areas = vec![0.0; undeformed.len()];
    for (triangle, (rotation, area)) in
        triangles.iter().zip(&turned).filter_map(|(face, turned)| Some((face, turned.as_ref()?)))
    {
        let relative = skew_part(&transposed_times(&mean, rotation));
        for &vertex in triangle {
            areas[vertex as usize] += area;
            sum[vertex as usize] = add(sum[vertex as usize], relative.map(|x| area * x));
        }
    }
    sum.iter().zip(&areas).map(|(sum, &area)| if area > 0.0 { sum.map(|x| x / area) } else { *sum }).collect()
}

/// What makes a rotation field doubtful.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// Faces that had an area and have none.
    pub without_area: usize,
    /// Share of the inner edges across which the surface turned by more than 150 degrees.
    pub turned_over: f64,
}

/// Looks at the faces one by one. `undeformed`, `shape`: N × 3.
pub fn health(triangles: &[[u32; 3]], undeformed: &[Vector], shape: &[Vector]) -> Health {
    let has_area = |face: [u32; 3], points: &[Vector]| frame(face.map(|vertex| points[vertex as usize])).is_some();
    let turned: Vec<Option<Matrix>> =
        triangles.iter().map(|face| turn(*face, undeformed, shape).map(|(rotation, _)| rotation)).collect();
    let lost = |face: &&[u32; 3]| has_area(**face, undeformed) && !has_area(**face, shape);
    let mut face_at: HashMap<(u32, u32), usize> = HashMap::new();
    let (mut inner, mut over) = (0_usize, 0_usize);
    for (at, &[a, b, c]) in triangles.iter().enumerate() {
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
    Health { without_area: triangles.iter().filter(lost).count(), turned_over: over as f64 / inner.max(1) as f64 }
}

/// The rotation of a face and its undeformed area; `None` where it has none, before or after.
fn turn(face: [u32; 3], undeformed: &[Vector], shape: &[Vector]) -> Option<(Matrix, f64)> {
    let corners = |points: &[Vector]| face.map(|vertex| points[vertex as usize]);
    let ((from, area), (to, _)) = (frame(corners(undeformed))?, frame(corners(shape))?);
    let rotation = nearest_rotation(multiply(&to, &inverse(&from)?));
    rotation.as_flattened().iter().all(|x| x.is_finite()).then_some((rotation, area))
}

/// The rotation R that is nearest to a sum of rotations, max tr(Rᵀ B): their mean in the chordal metric (Moakher 2002),
/// by the quaternion of Horn 1987. The identity for B = 0.
fn nearest_to(b: &Matrix) -> Matrix {
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = *b;
    let horn = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let Ok(spectrum) = Mat::from_fn(4, 4, |i, j| horn[i][j]).self_adjoint_eigen(Side::Lower) else { return identity };
    if b.as_flattened().iter().all(|&x| x == 0.0) {
        return identity;
    }
    let best = spectrum.U().col(3);
    let [w, x, y, z] = [best[0], best[1], best[2], best[3]];
    [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
        [2.0 * (x * y - w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z + w * x)],
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z],
    ]
}

/// Aᵀ B.
fn transposed_times(a: &Matrix, b: &Matrix) -> Matrix {
    b.map(|column| std::array::from_fn(|row| dot(a[row], column)))
}

/// sin θ × axis of a rotation.
fn skew_part([[_, yx, zx], [xy, _, zy], [xz, yz, _]]: &Matrix) -> Vector {
    [(zy - yz) / 2.0, (xz - zx) / 2.0, (yx - xy) / 2.0]
}

/// Two edges and the unit normal as columns, and the area; `None` for a triangle without area.
fn frame([a, b, c]: [Vector; 3]) -> Option<(Matrix, f64)> {
    let (u, v) = (subtract(b, a), subtract(c, a));
    let normal = cross(u, v);
    let double_area = dot(normal, normal).sqrt();
    (double_area > 0.0).then(|| ([u, v, normal.map(|x| x / double_area)], double_area / 2.0))
}

/// The rotation of the polar decomposition, by Newton's iteration X ← (X + X⁻ᵀ) / 2 (Higham 1986). F keeps the unit
/// normal's side, so det F = ratio of areas > 0 and the limit is a rotation.
fn nearest_rotation(mut x: Matrix) -> Matrix {
    // Converges quadratically; a strain of a factor 1000 takes 14 steps.
    for _ in 0..30 {
        let Some(inverse) = inverse(&x) else { return x };
        let mut change = 0.0_f64;
        for column in 0..3 {
            for row in 0..3 {
                let next = (x[column][row] + inverse[row][column]) / 2.0;
                change = change.max((next - x[column][row]).abs());
                x[column][row] = next;
            }
        }
        if change < 1e-14 {
            break;
        }
    }
    x
}

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    b.map(|column| std::array::from_fn(|row| (0..3).map(|k| a[k][row] * column[k]).sum()))
}

/// `None` for a singular matrix.
fn inverse(m: &Matrix) -> Option<Matrix> {
    let rows = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let determinant = dot(m[0], rows[0]);
    (determinant != 0.0 && determinant.is_finite())
        .then(|| std::array::from_fn(|column| std::array::from_fn(|row| rows[row][column] / determinant)))
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
                let (found, _) = turn(TRIANGLE[0], &undeformed, &shape).unwrap();
                let found = skew_part(&found);
                // The shape moves by 7: rounding is 7 · 2e-16 over edges of 0.5 and more, a few times.
                let error = (0..3).map(|c| (found[c] - angle.sin() * axis[c]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-13, "angle {angle}, stretch {stretch}: {found:?}");
            }
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
