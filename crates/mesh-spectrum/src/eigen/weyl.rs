//! Where to look for an eigenvalue of a given number: Weyl's law, fitted to what has been counted.
//!
//! It only guides; inertia counts decide.

use std::f64::consts::PI;

/// By how much a mesh lowers an eigenvalue: λ̂ = λ (1 − h² λ / 16) on squares of side h with lumped mass, the mean over
/// all directions of a wave.
const DISPERSION: f64 = 1.0 / 16.0;

/// The most that is believed of it, relative to an eigenvalue: meshes of very unequal triangles have nothing of the kind.
const DISPERSION_MAX: f64 = 0.2;

/// Eigenvalues below λ on a surface of area a with a free boundary of length p grow as N(λ) = a λ/4π + p √λ/4π (Weyl);
/// here with p fitted to one count, so that it also stands for junctions, and for the lower eigenvalues of a mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weyl {
    area: f64,
    edge: f64,
    /// λ / λ̂ − 1 for a λ̂ of 1.
    mesh: f64,
}

impl Weyl {
    /// Without a boundary, on a mesh of so many vertices with lumped mass, or on the surface itself.
    pub(crate) fn closed(area: f64, vertices: Option<usize>) -> Weyl {
        let mesh = vertices.map_or(0.0, |vertices| DISPERSION * area / vertices as f64);
        Weyl { area: area / (4.0 * PI), edge: 0.0, mesh }
    }

    /// The same law through the point (λ, count).
    pub(crate) fn through(self, lambda: f64, count: f64) -> Weyl {
        let mesh = if self.mesh * lambda < DISPERSION_MAX { self.mesh } else { 0.0 };
        let lambda = lambda * (1.0 + mesh * lambda);
        Weyl { edge: (count - self.area * lambda) / lambda.sqrt(), mesh, ..self }
    }

    /// The λ with N(λ) = count.
    pub(crate) fn inverse(self, count: f64) -> f64 {
        let Weyl { area, edge, mesh } = self;
        // The positive root of area x² + edge x = count, x = √λ, without cancellation.
        let root = (edge * edge + 4.0 * area * count).sqrt();
        let x = if edge > 0.0 { 2.0 * count / (edge + root) } else { (root - edge) / (2.0 * area) };
        2.0 * x * x / (1.0 + (1.0 + 4.0 * mesh * x * x).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_the_law() {
        for (area, lambda, count) in [(100.0, 3.0, 40.0), (100.0, 3.0, 15.0), (1e-9, 1e12, 70.0)] {
            let weyl = Weyl::closed(area, Some(1000)).through(lambda, count);
            assert!((weyl.inverse(count) / lambda - 1.0).abs() < 1e-12, "a square root and a quotient");
            assert!(weyl.inverse(0.5 * count) < lambda);
        }
    }
}
