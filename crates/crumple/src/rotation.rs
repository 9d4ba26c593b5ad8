//! The rotation field: how far, and about which axis, each place of the surface has turned.
//!
//! A displacement is an integral of rotations: a hinge here and a hinge there move the far end differently, although
//! both are a hinge. The rotation field is local, so its spectrum says *what kind* of deformation it is wherever it
//! happens, and its lowest coefficients say *which way*. For a nearly isometric surface it holds the deformation but
//! for a translation.
//!
//! For each face the deformation gradient F maps two edges and the unit normal of the undeformed face to those of the
//! deformed one; F = R U with R a rotation by θ about an axis a (polar decomposition). A vertex has the mean of its
//! faces' rotations, weighted by area, and the field there is r = sin θ a, the skew part of R: unlike the rotation
//! vector θ a it does not jump at half a turn, which folds do reach. It is projected like any function: ρ = Φᵀ M r.

type Vector = [f64; 3];
/// A 3 × 3 matrix by columns.
type Matrix = [Vector; 3];

/// sin θ × axis at the vertices, N × 3, without unit. Vertices without a face that keeps its area have none: zero.
///
/// `undeformed`, `shape`: N × 3.
pub fn field(triangles: &[[u32; 3]], undeformed: &[Vector], shape: &[Vector]) -> Vec<Vector> {
    // Means are taken of unit quaternions, q and −q being the same rotation.
    let mut mean = vec![[0.0; 4]; undeformed.len()];
    for triangle in triangles {
        let corners = |points: &[Vector]| triangle.map(|vertex| points[vertex as usize]);
        let (Some((from, area)), Some((to, _))) = (frame(corners(undeformed)), frame(corners(shape))) else { continue };
        let Some(inverse) = inverse(&from) else { continue };
        let turned = quaternion(&nearest_rotation(multiply(&to, &inverse)));
        for &vertex in triangle {
            let mean = &mut mean[vertex as usize];
            let along: f64 = mean.iter().zip(&turned).map(|(a, b)| a * b).sum();
            let weight = if along < 0.0 { -area } else { area };
            mean.iter_mut().zip(&turned).for_each(|(mean, x)| *mean += weight * x);
        }
    }
    mean.into_iter().map(skew_part).collect()
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

/// The unit quaternion [w, x, y, z] of a rotation, by its largest component (Shepperd 1978).
fn quaternion(r: &Matrix) -> [f64; 4] {
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = *r;
    // Each row is 4 q_i q; the one with the largest q_i² is the most exact.
    let rows = [
        [1.0 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, 1.0 + xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, 1.0 - xx + yy - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, 1.0 - xx - yy + zz],
    ];
    let best = (0..4).max_by(|&a, &b| rows[a][a].total_cmp(&rows[b][b])).unwrap_or(0);
    let length = rows[best].iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 && length.is_finite() { rows[best].map(|x| x / length) } else { [1.0, 0.0, 0.0, 0.0] }
}

/// sin θ × axis of a quaternion of any length: with w = cos θ/2 and |(x, y, z)| = sin θ/2 it is 2 w (x, y, z); zero
/// for the zero quaternion.
fn skew_part([w, x, y, z]: [f64; 4]) -> Vector {
    let square = w * w + x * x + y * y + z * z;
    if square > 0.0 { [x, y, z].map(|component| 2.0 * w * component / square) } else { [0.0; 3] }
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

fn subtract(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|c| a[c] - b[c])
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Kind and direction of a deformation in a few numbers: √Σ ρ² in bands of index, then the first triples with sign.
///
/// `rho`: K × 3 of one state. Bands have geometric edges from 1 to K, rounded; [`BANDS`] of them at K = 500, fewer
/// where rounded edges coincide. The two blocks are returned apart, since they are scaled apart.
pub fn spectrum(rho: &[Vector]) -> (Vec<f64>, Vec<f64>) {
    let energy = |band: &[Vector]| band.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
    let edges = band_edges(rho.len());
    let bands = edges.windows(2).map(|edge| energy(&rho[edge[0] - 1..edge[1] - 1])).collect();
    (bands, rho.iter().take(TRIPLES).flatten().copied().collect())
}

/// Bands at K = 500.
pub const BANDS: usize = 13;
/// Triples whose direction counts.
pub const TRIPLES: usize = 4;

/// First eigenvector (counted from 1) of each band, and one past the last.
fn band_edges(eigenpairs: usize) -> Vec<usize> {
    let edge = |at: usize| (eigenpairs as f64).powf(at as f64 / BANDS as f64).round() as usize;
    let mut edges: Vec<usize> = (0..=BANDS).map(edge).collect();
    edges.dedup();
    if let Some(last) = edges.last_mut() {
        *last = eigenpairs + 1;
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[u32; 3]; 1] = [[0, 1, 2]];

    fn turned(axis: Vector, angle: f64, stretch: f64) -> Vector {
        let undeformed = [[0.0, 0.0, 0.0], [2.0, 0.3, 0.1], [0.4, 1.0, -0.2]];
        // Rodrigues' formula.
        let rotate = |p: Vector| {
            let (s, c) = angle.sin_cos();
            let (k, along) = (cross(axis, p), dot(axis, p));
            std::array::from_fn(|i| p[i] * c + k[i] * s + axis[i] * along * (1.0 - c))
        };
        let shape = undeformed.map(|p| rotate(p.map(|x| stretch * x)).map(|x| x + 7.0));
        field(&TRIANGLE, &undeformed, &shape)[1]
    }

    #[test]
    fn a_rotation_is_found_whatever_the_translation_and_the_stretch() {
        let axis = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
        for angle in [0.0, 1e-9, 0.1, 1.0, 3.0, std::f64::consts::PI] {
            for stretch in [1.0, 0.5, 40.0] {
                let found = turned(axis, angle, stretch);
                // The shape moves by 7: rounding is 7 · 2e-16 over edges of 0.5 and more, a few times.
                let error = (0..3).map(|c| (found[c] - angle.sin() * axis[c]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-13, "angle {angle}, stretch {stretch}: {found:?}");
            }
        }
    }

    #[test]
    fn faces_without_area_turn_nothing() {
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let good = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(field(&TRIANGLE, &flat, &good), [[0.0; 3]; 3]);
        assert_eq!(field(&TRIANGLE, &good, &flat), [[0.0; 3]; 3]);
    }

    #[test]
    fn bands_cover_every_eigenvector_once() {
        assert_eq!(band_edges(500), [1, 2, 3, 4, 7, 11, 18, 28, 46, 74, 119, 192, 310, 501]);
        for eigenpairs in 1..=60 {
            let edges = band_edges(eigenpairs);
            assert!(edges[0] == 1 && *edges.last().unwrap() == eigenpairs + 1 || eigenpairs == 1, "{edges:?}");
            assert!(edges.windows(2).all(|edge| edge[0] < edge[1]));
        }
    }
}
