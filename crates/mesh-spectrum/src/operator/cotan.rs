//! Linear finite elements on the mesh's own triangles.
//!
//! Lᵢⱼ = −½ Σ cot of the angles opposite to edge ij (Pinkall and Polthier 1993). An edge with three faces or more gets
//! the sum over all of them, which is what finite elements on a branching surface give. We part from the source once: a
//! triangle without area is left out and counted.

use super::{Elements, OperatorError};
use crate::mesh::{Mesh, Point, dot, double_area, sub};

pub(super) fn elements(mesh: &Mesh, consistent: bool) -> Result<Elements, OperatorError> {
    let mut elements = Elements::new(mesh.vertices().len(), consistent);
    elements.edges.reserve(3 * mesh.triangles().len());
    for (number, &triangle) in mesh.triangles().iter().enumerate() {
        let corners = mesh.corners(triangle);
        let Some(double_area) = double_area(corners) else {
            elements.triangles_without_area += 1;
            continue;
        };
        if !elements.add_triangle(triangle, cotangents(corners, double_area), 0.5 * double_area, 1.0) {
            return Err(OperatorError::NotFinite { triangle: number });
        }
    }
    Ok(elements)
}

/// cot θ at each corner of a triangle: cot θ = (u·v) / |u×v|, with u and v the edges that leave the corner;
/// |u×v|, twice the area, is the same at all three corners.
pub(crate) fn cotangents([a, b, c]: [Point; 3], double_area: f64) -> [f64; 3] {
    let cot = |u, v| dot(u, v) / double_area;
    [cot(sub(b, a), sub(c, a)), cot(sub(c, b), sub(a, b)), cot(sub(a, c), sub(b, c))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cotangents_of_a_triangle_obey_their_identity() {
        // cot α cot β + cot β cot γ + cot γ cot α = 1 for any three angles that sum to π.
        for c in [[0.3, 2.0, 0.0], [5.0, 0.01, -3.0], [-1.0, 0.2, 4.0]] {
            let corners = [[0.1, 0.0, 0.5], [1.0, 0.2, 0.0], c];
            let [x, y, z] = cotangents(corners, double_area(corners).unwrap());
            assert!((x * y + y * z + z * x - 1.0).abs() < 1e-12, "rounding only: angles are above 0.01 rad");
        }
    }
}
