//! Where to look for an eigenvalue of a given number: Weyl's law, fitted to what has been counted.
//!
//! It only guides; inertia counts decide.

use std::f64::consts::PI;

/// Eigenvalues below λ on a surface of area a with a free boundary of length p grow as N(λ) = a λ/4π + p √λ/4π (Weyl);
/// here with p fitted to one count, so that it also stands for junctions and the mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weyl {
    area: f64,
    edge: f64,
}

impl Weyl {
    /// Without a boundary.
    pub(crate) fn closed(area: f64) -> Weyl {
        Weyl { area: area / (4.0 * PI), edge: 0.0 }
    }

    /// Through the point (λ, count).
    pub(crate) fn through(area: f64, lambda: f64, count: f64) -> Weyl {
        let Weyl { area, .. } = Weyl::closed(area);
        Weyl { area, edge: (count - area * lambda) / lambda.sqrt() }
    }

    /// The λ with N(λ) = count.
    pub(crate) fn inverse(self, count: f64) -> f64 {
        let Weyl { area, edge } = self;
        // The positive root of area x² + edge x = count, x = √λ, without cancellation.
        let root = (edge * edge + 4.0 * area * count).sqrt();
        let x = if edge > 0.0 { 2.0 * count / (edge + root) } else { (root - edge) / (2.0 * area) };
        x * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_the_law() {
        for (area, lambda, count) in [(100.0, 3.0, 40.0), (100.0, 3.0, 15.0), (1e-9, 1e12, 70.0)] {
            let weyl = Weyl::through(area, lambda, count);
            assert!((weyl.inverse(count) / lambda - 1.0).abs() < 1e-12, "a square root and a quotient");
            assert!(weyl.inverse(0.5 * count) < lambda);
        }
    }
}
