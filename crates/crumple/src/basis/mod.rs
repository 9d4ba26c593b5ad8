//! The eigenbasis of the reference mesh, as a study keeps it, and what it is good for.
//!
//! L φ = λ M φ with cotangent stiffness L and lumped mass M, or another operator of `mesh-spectrum`, Φᵀ M Φ = I; the
//! solver is there too. A study stores eigenvectors as f32, and everything is computed with the rounded ones, so that a
//! run added later is projected on exactly the vectors of the first.
//!
//! Two weights are kept apart, which only the lumped mass makes one. M is what coefficients are made with, so whatever is
//! compared with coefficients (how much of a displacement they catch, the energy of a rotation field) is taken in M. What
//! is told in lengths (root mean square displacements, errors of reconstructions) is a mean over the area of the surface.

mod transform;

use std::ops::Range;

use faer::{Mat, Side};
use mesh_spectrum::{Csr, EigenOptions, Kind, Mass, OperatorOptions, Tie, Watch};
use serde::{Deserialize, Serialize};

pub(crate) use transform::coefficients_of;
pub use transform::{coefficients, synthesize};

use crate::Error;
use crate::joints::Join;
use crate::reference::Reference;
use crate::vector::{Vector, dot, square};

/// What is asked of the eigenbasis.
#[derive(Debug, Clone, PartialEq)]
pub struct BasisOptions {
    /// Eigenpairs K. Default 500 (Iza-Teran and Garcke 2018); a mesh with fewer vertices gives as many as it has.
    pub eigenpairs: usize,
    /// How separate sheets become one. Default: components stay apart.
    pub join: Option<Join>,
    /// Which discretisation of the Laplacian. Default: cotangent.
    pub kind: Kind,
    /// Which mass. Default: lumped.
    pub mass: Mass,
}

impl Default for BasisOptions {
    fn default() -> Self {
        Self { eigenpairs: 500, join: None, kind: Kind::default(), mass: Mass::default() }
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
    /// M on vertices, N, diagonal: lumped areas in length², or with the identity as mass how many vertices each stands
    /// for, 1 unless a deck ties others to it.
    pub mass: Vec<f64>,
    /// M on vertices, N × N, where it is not diagonal; then `mass` holds the sums of its rows.
    pub mass_matrix: Option<Csr>,
    /// The surface's area, shared out among vertices, N, in length²; whatever M is. Means over the surface use it, and
    /// products with Φ use M. With the lumped mass both are the same.
    pub area: Vec<f64>,
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
    /// Name of the discretisation.
    #[serde(default = "cotan")]
    pub operator: String,
    /// Name of the mass.
    #[serde(default = "lumped")]
    pub mass: String,
    /// What speaks for the tufted operator on this mesh; empty where it was used.
    #[serde(default)]
    pub tufted_advice: Vec<String>,
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

fn cotan() -> String {
    Kind::default().to_string()
}

fn lumped() -> String {
    Mass::default().to_string()
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
        let &BasisOptions { eigenpairs, join, kind, mass } = options;
        if eigenpairs == 0 {
            return Err(Error::Value { name: "-K", value: "0".into(), expected: "at least one eigenpair".into() });
        }
        let inspection = mesh_spectrum::inspect(&reference.mesh);
        let distance = join.and_then(Join::distance);
        let operator_options = OperatorOptions { join: distance, ties: ties.to_vec(), kind, mass };
        let operator = mesh_spectrum::operator(&reference.mesh, &operator_options)?;
        let solved =
            mesh_spectrum::eigenbasis(&operator, &EigenOptions { count: eigenpairs, ..Default::default() }, watch)?;
        let eigenvectors: Vec<f32> = solved.eigenvectors.iter().map(|&x| x as f32).collect();
        let rounded: Vec<f64> = eigenvectors.iter().map(|&x| f64::from(x)).collect();
        let facts = BasisFacts {
            asked: eigenpairs,
            join,
            operator: kind.to_string(),
            mass: mass.to_string(),
            tufted_advice: match kind {
                Kind::Tufted => Vec::new(),
                _ => inspection.reasons.iter().map(ToString::to_string).collect(),
            },
            joined_pairs: operator.pairs_joined + ties.len(),
            idle_ties: operator.idle_ties,
            followers: operator.followers.len(),
            components: inspection.components,
            null_space: solved.certificate.components,
            join_advice: inspection.gap.filter(|_| join.is_none()),
            area: inspection.area,
            length: length_of(reference.mesh.vertices(), &operator.vertex_area),
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
            mass_matrix: operator.vertex_mass_matrix,
            area: operator.vertex_area,
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

    /// ‖1‖²_M, the sum of all entries of M: the surface's area, or with the identity as mass the number of vertices.
    /// What the squared norm of coefficients is divided by to make it a mean: Σ |Φᵀ M f|² / ‖1‖²_M is the mean square of
    /// f in M, as far as K eigenvectors go.
    pub fn total_mass(&self) -> f64 {
        self.mass.iter().sum()
    }

    /// What eigenvalues are multiplied by to be in 1/length²: 1, and N / A for N vertices on the area A with the identity as
    /// mass, whose eigenvalues are pure numbers (exact where all vertices have the same area).
    pub(crate) fn per_square_length(&self) -> f64 {
        if self.facts.mass == Mass::Identity.to_string() { self.total_mass() / self.facts.area } else { 1.0 }
    }

    /// ‖f‖²_M of a vector function on the vertices, N × 3: what the squares of all its coefficients sum to.
    pub(crate) fn square_norm(&self, values: &[[f64; 3]]) -> f64 {
        match self.mass_matrix {
            Some(_) => {
                let products = values.iter().zip(self.weigh(values)).map(|(f, w)| dot(*f, w));
                products.sum::<f64>().max(0.0) // not below by rounding
            }
            None => values.iter().zip(&self.mass).map(|(f, m)| m * square(*f)).sum(),
        }
    }

    /// M f for a vector function on the vertices, N × 3.
    pub(crate) fn weigh(&self, values: &[[f64; 3]]) -> Vec<[f64; 3]> {
        match &self.mass_matrix {
            Some(matrix) => (0..matrix.rows())
                .map(|row| {
                    let add = |sum: [f64; 3], (column, m): (usize, f64)| {
                        std::array::from_fn(|c| sum[c] + m * values[column][c])
                    };
                    matrix.row(row).fold([0.0; 3], add)
                })
                .collect(),
            None => values.iter().zip(&self.mass).map(|(value, m)| value.map(|x| m * x)).collect(),
        }
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
fn length_of(vertices: &[Vector], areas: &[f64]) -> f64 {
    let area: f64 = areas.iter().sum();
    let mean = |of: &dyn Fn(&Vector) -> f64| vertices.iter().zip(areas).map(|(p, a)| a * of(p)).sum::<f64>() / area;
    let centre: Vector = std::array::from_fn(|c| mean(&|p| p[c]));
    let covariance = Mat::from_fn(3, 3, |a, b| mean(&|p| (p[a] - centre[a]) * (p[b] - centre[b])));
    let variances = covariance.self_adjoint_eigenvalues(Side::Lower).unwrap_or_default();
    (12.0 * variances.last().copied().unwrap_or(0.0)).sqrt()
}

/// Largest ‖Lφ − λMφ‖ in the M⁻¹ norm over λ_K, on the degrees of freedom of the operator. For a mass that is not diagonal
/// in the norm of its row sums' inverse, which is at most twice as small.
fn residual(operator: &mesh_spectrum::Operator, eigenvalues: &[f64], eigenvectors: &[f64]) -> f64 {
    let n = operator.vertex_mass.len();
    let residuals = eigenvalues.iter().zip(eigenvectors.chunks_exact(n)).map(|(lambda, phi)| {
        let on_dofs = operator.on_dofs(phi);
        let stiff = operator.stiffness.times(&on_dofs);
        let weighed = match &operator.mass_matrix {
            Some(mass) => mass.times(&on_dofs),
            None => operator.mass.iter().zip(&on_dofs).map(|(m, x)| m * x).collect(),
        };
        let square = |((s, m), w): ((&f64, &f64), &f64)| (s - lambda * w).powi(2) / m;
        stiff.iter().zip(&operator.mass).zip(&weighed).map(square).sum::<f64>().sqrt()
    });
    let largest = eigenvalues.last().copied().filter(|&lambda| lambda > 0.0).unwrap_or(1.0);
    residuals.fold(0.0, f64::max) / largest
}

fn counted_from_one(ranges: &[Range<usize>]) -> Vec<(usize, usize)> {
    ranges.iter().map(|range| (range.start + 1, range.end)).collect()
}
