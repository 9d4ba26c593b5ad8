//! Faces with four corners and more through a virtual vertex in their middle.
//!
//! Bunge, Herholz, Kazhdan and Botsch 2020, "Polygon Laplacian made simple": a face with corners x₁ … xₙ gets a virtual
//! vertex p = Σ wⱼ xⱼ, Σ w = 1, and becomes a fan of n triangles around it. With P = (I; wᵀ), which gives the virtual
//! vertex the affine combination of its corners' values, L = Pᵀ L△ P and M = Pᵀ M△ P for the fan's L△ and M△. No
//! diagonal is chosen, and the operator is exact for linear functions on a flat face.
//!
//! p minimises the sum of the squared areas of its fan, and of all w that give it, w is the shortest. Triangles go the
//! ordinary way, of which this is a special case.

use faer::{Mat, Side};

use super::cotan::cotangents;
use super::{Elements, OperatorError};
use crate::mesh::{Mesh, Point, dot, double_area, sub};

/// Corners whose squared distances from their common plane are less than this share of the face's size are taken as
/// flat: so much is rounding of single-precision coordinates.
const FLAT: f64 = 1e-10;

pub(super) fn elements(mesh: &Mesh, consistent: bool) -> Result<Elements, OperatorError> {
    let mut elements = Elements::new(mesh.vertices().len(), consistent);
    for (face, ring) in mesh.rings() {
        let corners: Vec<Point> = ring.iter().map(|&vertex| mesh.vertices()[vertex as usize]).collect();
        let good = match (ring, &corners[..]) {
            (&[a, b, c], &[p, q, r]) => match double_area([p, q, r]) {
                Some(area) => elements.add_triangle([a, b, c], cotangents([p, q, r], area), 0.5 * area, 1.0),
                None => {
                    elements.triangles_without_area += 1;
                    true
                }
            },
            _ => add_fan(&mut elements, ring, &corners),
        };
        if !good {
            let triangle = mesh.face_of_triangle().partition_point(|&other| other < face);
            return Err(OperatorError::NotFinite { triangle });
        }
    }
    Ok(elements)
}

/// Adds Pᵀ L△ P and Pᵀ M△ P of one face. False where a number is not finite.
fn add_fan(elements: &mut Elements, ring: &[u32], corners: &[Point]) -> bool {
    let n = ring.len();
    let weights = weights(corners);
    let mut centre = [0.0; 3];
    for (w, x) in weights.iter().zip(corners) {
        (0..3).for_each(|c| centre[c] += w * x[c]);
    }
    // Half cotangents: over each edge of the ring, and over each spoke.
    let (mut rim, mut spoke) = (vec![0.0; n], vec![0.0; n]);
    // Areas of the fan's triangles.
    let mut area = vec![0.0; n];
    for i in 0..n {
        let j = (i + 1) % n;
        let triangle = [corners[i], corners[j], centre];
        let Some(double_area) = double_area(triangle) else { continue };
        let [at_i, at_j, at_centre] = cotangents(triangle, double_area);
        area[i] = 0.5 * double_area;
        rim[i] += 0.5 * at_centre;
        spoke[i] += 0.5 * at_j;
        spoke[j] += 0.5 * at_i;
    }
    let (total, all_spokes) = (area.iter().sum::<f64>(), spoke.iter().sum::<f64>());
    if !(total.is_finite() && rim.iter().chain(&spoke).chain(&weights).all(|x| x.is_finite())) {
        return false;
    }
    if total == 0.0 {
        elements.triangles_without_area += n - 2;
        return true;
    }
    // The two fan triangles at a corner.
    let beside = |i: usize| area[i] + area[(i + n - 1) % n];
    for i in 0..n {
        // −(Pᵀ L△ P)ᵢⱼ, and (Pᵀ M△ P)ᵢⱼ with M△ = A/12 (1 + δ): A/6 on the diagonal of each triangle.
        for j in i + 1..n {
            let (a, b) = (weights[i], weights[j]);
            let shared = [(i, j), (j, i)].into_iter().filter(|&(from, to)| (from + 1) % n == to).map(|(from, _)| from);
            let rims: f64 = shared.clone().map(|edge| rim[edge]).sum();
            let weight = rims + spoke[i] * b + a * spoke[j] - all_spokes * a * b;
            elements.edges.push((ring[i], ring[j], weight));
            if !elements.mass_diagonal.is_empty() {
                let along: f64 = shared.map(|edge| area[edge]).sum();
                let m = (along + beside(i) * b + a * beside(j) + 2.0 * total * a * b) / 12.0;
                elements.add_mass(ring[i], ring[j], m);
            }
        }
        let w = weights[i];
        elements.lumped[ring[i] as usize] += beside(i) / 3.0 + w * total / 3.0;
        if !elements.mass_diagonal.is_empty() {
            let m = (2.0 * beside(i) + 2.0 * beside(i) * w + 2.0 * total * w * w) / 12.0;
            elements.mass_diagonal[ring[i] as usize] += m;
        }
    }
    true
}

/// w: p minimises Σ |eᵢ × (p − xᵢ)|², eᵢ the edges, so Σ (|e|² − e eᵀ) (p − xᵢ) = 0; and w = 1/n + (x − c)·y with
/// Σ (x − c)(x − c)ᵀ y = p − c around the corners' mean c, which is the shortest.
fn weights(corners: &[Point]) -> Vec<f64> {
    let n = corners.len() as f64;
    let mean: Point = std::array::from_fn(|c| corners.iter().map(|x| x[c]).sum::<f64>() / n);
    let x: Vec<Point> = corners.iter().map(|&x| sub(x, mean)).collect();
    let (mut h, mut g, mut s) = ([[0.0; 3]; 3], [0.0; 3], [[0.0; 3]; 3]);
    for i in 0..x.len() {
        let e = sub(x[(i + 1) % x.len()], x[i]);
        let (length2, along) = (dot(e, e), dot(e, x[i]));
        for a in 0..3 {
            g[a] += length2 * x[i][a] - e[a] * along;
            for b in 0..3 {
                h[a][b] += if a == b { length2 } else { 0.0 } - e[a] * e[b];
                s[a][b] += x[i][a] * x[i][b];
            }
        }
    }
    let y = solve(s, solve(h, g));
    x.iter().map(|&x| 1.0 / n + dot(x, y)).collect()
}

/// The shortest x that comes closest to A x = b, A symmetric and ≥ 0, directions below [`FLAT`] of its trace left out.
fn solve(a: [Point; 3], b: Point) -> Point {
    let trace = a[0][0] + a[1][1] + a[2][2];
    let Ok(eigen) = Mat::from_fn(3, 3, |i, j| a[i][j]).self_adjoint_eigen(Side::Lower) else { return [0.0; 3] };
    let (u, s) = (eigen.U(), eigen.S().column_vector());
    let along = |k: usize| (0..3).map(|i| u[(i, k)] * b[i]).sum::<f64>() / s[k];
    let kept: Vec<usize> = (0..3).filter(|&k| s[k] > FLAT * trace).collect();
    std::array::from_fn(|i| kept.iter().map(|&k| u[(i, k)] * along(k)).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_virtual_vertex_of_a_parallelogram_is_its_centre() {
        let corners = [[0.0, 0.0, 5.0], [4.0, 0.0, 5.0], [5.0, 2.0, 5.0], [1.0, 2.0, 5.0]];
        for w in weights(&corners) {
            assert!((w - 0.25).abs() < 1e-14, "rounding");
        }
    }

    #[test]
    fn a_linear_function_on_a_flat_face_has_its_exact_energy() {
        // f = x + 2y on a flat pentagon: Σ fᵢ Lᵢⱼ fⱼ = |∇f|² A = 5 A.
        let xy = [[0.0, 0.0], [3.0, -0.5], [4.0, 2.0], [2.0, 4.0], [-1.0, 2.5]];
        let mesh = Mesh::from_polygons(xy.map(|[x, y]| [x, y, 0.0]).to_vec(), [&[0u32, 1, 2, 3, 4][..]].into_iter());
        let elements = elements(&mesh.unwrap(), true).unwrap();
        let f = xy.map(|[x, y]| x + 2.0 * y);
        let energy: f64 = elements.edges.iter().map(|&(i, j, w)| w * (f[i as usize] - f[j as usize]).powi(2)).sum();
        let area: f64 = (0..5).map(|i| 0.5 * (xy[i][0] * xy[(i + 1) % 5][1] - xy[(i + 1) % 5][0] * xy[i][1])).sum();
        assert!((energy / (5.0 * area) - 1.0).abs() < 1e-12);
        assert!((elements.lumped.iter().sum::<f64>() / area - 1.0).abs() < 1e-12);
        let all = elements.mass_diagonal.iter().sum::<f64>()
            + elements.mass_pairs.iter().map(|pair| 2.0 * pair.2).sum::<f64>();
        assert!((all / area - 1.0).abs() < 1e-12, "∫ 1·1 is the area");
    }
}
