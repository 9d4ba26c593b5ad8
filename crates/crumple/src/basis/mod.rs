//! The eigenbasis of the reference mesh, as a study keeps it, and what it is good for.
//!
//! L φ = λ M φ with cotangent stiffness L and lumped mass M, Φᵀ M Φ = I; see `mesh-spectrum` for the solver. A study
//! stores eigenvectors as f32, and everything is computed with the rounded ones, so that a run added later is
//! projected on exactly the vectors of the first.

mod transform;

use std::ops::Range;

use faer::{Mat, Side};
use mesh_spectrum::{EigenOptions, OperatorError, OperatorOptions, Tie, Watch};
use serde::{Deserialize, Serialize};

pub(crate) use transform::coefficients_of;
pub use transform::{coefficients, synthesize};

use crate::Error;
use crate::joints::Join;
use crate::reference::Reference;
use crate::vector::Vector;

/// What is asked of the eigenbasis.
#[derive(Debug, Clone, PartialEq)]
pub struct BasisOptions {
    /// Eigenpairs K. Default 500 (Iza-Teran and Garcke 2018); a mesh with fewer vertices gives as many as it has.
    pub eigenpairs: usize,
    /// How separate sheets become one. Default: components stay apart.
    pub join: Option<Join>,
}

impl Default for BasisOptions {
    fn default() -> Self {
        Self { eigenpairs: 500, join: None }
    }
}

/// Eigenpairs, masses and the coefficients of the undeformed shape.
#[derive(Debug, Clone)]
pub struct Basis {
    /// Content name: the first 16 hexadecimal digits of the file's BLAKE3 hash. Descriptors carry it.
    pub id: String,
    /// λ, K, rising, in 1/length².
    pub eigenvalues: Vec<f64>,
    /// Φ, K × N, one eigenvector after another, in 1/length.
    pub eigenvectors: Vec<f32>,
    /// Lumped mass of each vertex, N, in length².
    pub mass: Vec<f64>,
    /// α⁰ = Φᵀ M p⁰, K × 3, in length².
    pub baseline: Vec<[f64; 3]>,
    /// What is known about it.
    pub facts: BasisFacts,
}

/// What is known about a basis besides its numbers; stored with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BasisFacts {
    /// Eigenpairs asked for.
    pub asked: usize,
    /// How separate sheets were joined, if at all.
    pub join: Option<Join>,
    /// Pairs of vertices that the join made one, or ties by which vertices follow others.
    pub joined_pairs: usize,
    /// Of these ties those that hold nothing more, because others hold their vertex already.
    #[serde(default)]
    pub idle_ties: usize,
    /// Vertices that follow several others, and so have no mass of their own.
    #[serde(default)]
    pub followers: usize,
    /// Connected components of the mesh.
    pub components: usize,
    /// Zero eigenvalues: connected components of the operator, after joining.
    pub null_space: usize,
    /// A distance worth giving to `--join`, when the mesh has several components that lie close together.
    pub join_advice: Option<f64>,
    /// Area of the surface, in length².
    pub area: f64,
    /// Length of the surface, in length: √12 times its largest standard deviation along a line, which is the length of a
    /// straight uniform beam.
    pub length: f64,
    /// Edges with more than two faces.
    pub non_manifold_edges: usize,
    /// Triangles without area, which are left out.
    pub flat_triangles: usize,
    /// Largest ‖Lφ − λMφ‖ in the M⁻¹ norm over λ_K, before rounding to f32.
    pub residual: f64,
    /// The same after rounding to f32.
    pub residual_stored: f64,
    /// Largest entry of |ΦᵀMΦ − I|, before rounding.
    pub orthogonality: f64,
    /// Whether inertia counts prove that no eigenpair is missing.
    pub complete: bool,
    /// Ranges of eigenvectors (counted from 1, both ends included) whose eigenvalues are equal within the solver's
    /// tolerance: the basis inside such a range is arbitrary.
    pub clusters: Vec<(usize, usize)>,
    /// Ranges whose eigenvalues are so close that a small change of the mesh mixes their vectors.
    pub close: Vec<(usize, usize)>,
}

impl Basis {
    /// Computes the eigenbasis of the reference mesh; `ties` are what a deck holds of it.
    ///
    /// # Errors
    /// [`Error::Join`], [`Error::Operator`], [`Error::Eigen`], [`Error::Stopped`].
    pub fn compute(
        reference: &Reference,
        ties: &[Tie],
        options: &BasisOptions,
        watch: &dyn Watch,
    ) -> Result<Self, Error> {
        let &BasisOptions { eigenpairs, join } = options;
        if eigenpairs == 0 {
            return Err(Error::Value { name: "-K", value: "0".into(), expected: "at least one eigenpair".into() });
        }
        let inspection = mesh_spectrum::inspect(&reference.mesh);
        let distance = join.and_then(Join::distance);
        let operator =
            mesh_spectrum::operator(&reference.mesh, &OperatorOptions { join: distance, ties: ties.to_vec() })
                .map_err(|error| match error {
                    OperatorError::Join(error) => Error::Join(error),
                    error => Error::Operator(error),
                })?;
        let solved =
            mesh_spectrum::eigenbasis(&operator, &EigenOptions { count: eigenpairs, ..Default::default() }, watch)?;
        let eigenvectors: Vec<f32> = solved.eigenvectors.iter().map(|&x| x as f32).collect();
        let rounded: Vec<f64> = eigenvectors.iter().map(|&x| f64::from(x)).collect();
        let facts = BasisFacts {
            asked: eigenpairs,
            join,
            joined_pairs: operator.pairs_joined + ties.len(),
            idle_ties: operator.idle_ties,
            followers: operator.followers.len(),
            components: inspection.components,
            null_space: solved.certificate.components,
            join_advice: inspection.gap.filter(|_| join.is_none()),
            area: inspection.area,
            length: length_of(reference.mesh.vertices(), &operator.vertex_mass),
            non_manifold_edges: inspection.non_manifold_edges,
            flat_triangles: inspection.triangles_without_area,
            residual: solved.certificate.residual_max,
            residual_stored: residual(&operator, &solved.eigenvalues, &rounded),
            orthogonality: solved.certificate.orthogonality,
            complete: solved.certificate.complete,
            clusters: counted_from_one(&solved.clusters),
            close: counted_from_one(&solved.sensitive),
        };
        let mut basis = Self {
            id: String::new(),
            eigenvalues: solved.eigenvalues,
            eigenvectors,
            mass: operator.vertex_mass,
            baseline: Vec::new(),
            facts,
        };
        basis.baseline = coefficients(&basis, reference.mesh.vertices());
        Ok(basis)
    }

    /// Number of eigenpairs K.
    pub fn eigenpairs(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Number of vertices N.
    pub fn vertices(&self) -> usize {
        self.mass.len()
    }

    /// One eigenvector, N; `eigenvector` counts from 1 as in the paper.
    pub fn eigenvector(&self, eigenvector: usize) -> &[f32] {
        let n = self.vertices();
        &self.eigenvectors[(eigenvector - 1) * n..eigenvector * n]
    }

    /// The null space, which every reconstruction holds: one eigenvector a component, and the first two where there
    /// is one component, as the paper does. Counted from 1.
    pub fn always_in_reconstruction(&self) -> Range<usize> {
        let count = self.facts.null_space.max(2).min(self.eigenpairs());
        1..count + 1
    }
}

/// √12 times the largest standard deviation of the surface along a line.
fn length_of(vertices: &[Vector], mass: &[f64]) -> f64 {
    let area: f64 = mass.iter().sum();
    let mean = |of: &dyn Fn(&Vector) -> f64| vertices.iter().zip(mass).map(|(p, m)| m * of(p)).sum::<f64>() / area;
    let centre: Vector = std::array::from_fn(|c| mean(&|p| p[c]));
    let covariance = Mat::from_fn(3, 3, |a, b| mean(&|p| (p[a] - centre[a]) * (p[b] - centre[b])));
    let variances = covariance.self_adjoint_eigenvalues(Side::Lower).unwrap_or_default();
    (12.0 * variances.last().copied().unwrap_or(0.0)).sqrt()
}

/// Largest ‖Lφ − λMφ‖ in the M⁻¹ norm over λ_K, on the degrees of freedom of the operator.
fn residual(operator: &mesh_spectrum::Operator, eigenvalues: &[f64], eigenvectors: &[f64]) -> f64 {
    let n = operator.vertex_mass.len();
    let residuals = eigenvalues.iter().zip(eigenvectors.chunks_exact(n)).map(|(lambda, phi)| {
        let on_dofs = operator.on_dofs(phi);
        let stiff = operator.stiffness.times(&on_dofs);
        let square = |((s, m), x): ((&f64, &f64), &f64)| (s - lambda * m * x).powi(2) / m;
        stiff.iter().zip(&operator.mass).zip(&on_dofs).map(square).sum::<f64>().sqrt()
    });
    let largest = eigenvalues.last().copied().filter(|&lambda| lambda > 0.0).unwrap_or(1.0);
    residuals.fold(0.0, f64::max) / largest
}

fn counted_from_one(ranges: &[Range<usize>]) -> Vec<(usize, usize)> {
    ranges.iter().map(|range| (range.start + 1, range.end)).collect()
}
