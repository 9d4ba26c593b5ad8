//! Laplace-Beltrami operators of a mesh.
//!
//! | paper | here          | size, kind                            | unit |
//! |-------|---------------|---------------------------------------|------|
//! | L     | `stiffness`   | D × D sparse, symmetric, ≥ 0, L·1 = 0 | 1    |
//! | M     | `mass`        | D, diagonal, > 0                      | ℓ²   |
//! |       | `mass_matrix` | D × D sparse, > 0, if M is not diagonal | ℓ² |
//! |       | `vertex_mass` | N, diagonal, ≥ 0                      | ℓ²   |
//!
//! D degrees of freedom for N vertices: D = N, unless vertices are joined or tied to others ([`Tie`]), whose value they
//! then have (`coupling.rs`); `vertex_mass` is 0 where a vertex follows several and M is diagonal.
//! Weak form: L φ = λ M φ, so λ is in 1/ℓ² (a pure number with [`Mass::Identity`]). Sign: positive (libigl's
//! `cotmatrix` is the negative of ours).
//!
//! `cotan`, `tufted` and `polygon` each turn the mesh into [`Elements`] on its vertices; here these become matrices on
//! degrees of freedom, joins and ties in the same way whatever the discretisation and the mass.

mod cotan;
mod polygon;
mod tufted;

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

pub(crate) use cotan::cotangents;

use crate::coupling::{CouplingError, Reduction, Tie};
pub use crate::csr::Csr;
use crate::join::{JoinError, ties_of};
use crate::mesh::{Mesh, Union};

/// How the operator is built from the mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OperatorOptions {
    /// Join mutually nearest vertices of different components at most this far apart, in the model's length unit
    /// ([`join`](crate::join)). Default `None`: components stay apart, and each adds a zero eigenvalue.
    pub join: Option<f64>,
    /// Vertices that follow others, taken in their order. Default: none.
    pub ties: Vec<Tie>,
    /// Which discretisation of the Laplacian. Default [`Kind::Cotan`].
    pub kind: Kind,
    /// Which mass. Default [`Mass::Lumped`].
    pub mass: Mass,
}

/// Which discretisation of the Laplacian.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Kind {
    /// Linear finite elements on the triangles (Pinkall and Polthier 1993; "cotangent weights"). An edge with three
    /// faces or more gets the sum over all of them. A triangle without area is left out and counted.
    #[default]
    Cotan,
    /// The same on the intrinsic Delaunay triangulation of the tufted cover, edge lengths mollified by 1e-5 of their
    /// mean (Sharp and Crane 2020): no negative weights, any connectivity, zero-area faces too. Equal to
    /// [`Kind::Cotan`] where every edge is Delaunay and no triangle is nearly flat.
    Tufted,
    /// Faces with four corners and more through a virtual vertex in their middle (Bunge, Herholz, Kazhdan and Botsch
    /// 2020), so no diagonal is chosen. Equal to [`Kind::Cotan`] on triangles.
    Polygon,
}

/// Which mass matrix.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Mass {
    /// Diagonal: a third of the area of each triangle to each of its corners.
    #[default]
    Lumped,
    /// ∫ φᵢ φⱼ of the linear hat functions: on a triangle of area A, A/6 on the diagonal and A/12 beside it. Eigenvalues
    /// come out above the exact ones, where those of the lumped mass mostly come out below; the solver is several times
    /// slower.
    Consistent,
    /// M = I: every vertex counts the same, however fine the mesh is there. Eigenvalues are pure numbers.
    Identity,
}

/// Stiffness and mass of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Operator {
    /// L, D × D; for [`Kind::Cotan`] Lᵢⱼ = −½ Σ cot of the angles opposite to edge ij, Lᵢᵢ = −Σⱼ Lᵢⱼ.
    pub stiffness: Csr,
    /// M's diagonal, D, ℓ²: a third of the area of each face at a degree of freedom; with [`Mass::Identity`] how many
    /// vertices it stands for. Where there is a `mass_matrix`, the sums of its rows.
    pub mass: Vec<f64>,
    /// N, ℓ²: the same per vertex, for M-products on vertices, with the sum of `mass`. A vertex that follows several has 0
    /// and they have its share, unless there is a `vertex_mass_matrix`: then the sums of its rows.
    pub vertex_mass: Vec<f64>,
    /// N, ℓ²: the surface's area, shared out among vertices as the lumped mass is, whatever M is. A vertex that follows
    /// several has 0 and they have its area.
    pub vertex_area: Vec<f64>,
    /// M, D × D, where it is not diagonal ([`Mass::Consistent`]).
    pub mass_matrix: Option<Csr>,
    /// The same on vertices, N × N, as if none followed another: with Φ's values on all vertices, Φᵀ M Φ = I.
    pub vertex_mass_matrix: Option<Csr>,
    /// N: the degree of freedom of each vertex; the one with the largest weight for a vertex that follows several.
    pub dof_of_vertex: Vec<u32>,
    /// D: the lowest vertex of each degree of freedom.
    pub vertex_of_dof: Vec<u32>,
    /// Vertices that follow several, in rising order, with their weights on degrees of freedom.
    pub followers: Vec<(u32, Vec<(u32, f64)>)>,
    /// Ties that hold nothing more, because other ties hold their vertex already.
    pub idle_ties: usize,
    /// How many pairs of vertices were joined.
    pub pairs_joined: usize,
    /// Connected components after joining, through triangles with area: the dimension of L's null space.
    pub components: usize,
    /// D component numbers, from 0, in the order of each one's lowest degree of freedom.
    pub component_of_dof: Vec<u32>,
    /// Triangles left out because they have no area.
    pub triangles_without_area: usize,
    /// Edges flipped on the way to the intrinsic Delaunay triangulation ([`Kind::Tufted`]), counted on both sheets.
    pub flips: usize,
}

/// Why a mesh has no operator.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum OperatorError {
    /// A vertex belongs to no triangle with area, so nothing determines a field there.
    #[error("vertex {vertex}: no triangle with area uses it; drop such vertices before building the operator{}",
        if *.used { ", or use the tufted operator, which takes faces without area" } else { "" })]
    NoMass {
        /// The lowest such vertex, numbered from 0.
        vertex: usize,
        /// Whether triangles without area use it.
        used: bool,
    },
    /// Areas or cotangents overflow.
    #[error("triangle {triangle}: its area or cotangents are not finite; rescale the model")]
    NotFinite {
        /// The triangle, numbered from 0.
        triangle: usize,
    },
    /// The virtual vertex of a face that is far from convex leaves a corner with a negative area.
    #[error(
        "vertex {vertex}: its area comes out as {mass:e}; a face there is far from convex; use the cotan operator, which splits it"
    )]
    NegativeMass {
        /// The lowest such vertex, numbered from 0.
        vertex: usize,
        /// Its area, ℓ².
        mass: f64,
    },
    /// Each vertex of a piece of the mesh follows the same mean of places on separate pieces, which nothing else connects:
    /// the piece then has no stiffness, and its mass, not being diagonal, couples what the stiffness does not.
    #[error(
        "vertex {vertex}: ties couple it by mass alone to a separate piece of the mesh; use the lumped mass, or leave these ties out"
    )]
    MassAcross {
        /// A vertex on one of the separate pieces.
        vertex: usize,
    },
    /// Edge flips do not come to an end, which only rounding can do.
    #[error(
        "no intrinsic Delaunay triangulation after {flips} flips; lengths that differ by many orders of magnitude leave no digits; use the cotan operator"
    )]
    Flips {
        /// Flips done.
        flips: usize,
    },
    /// The join distance is not usable.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// The ties are not usable.
    #[error(transparent)]
    Coupling(#[from] CouplingError),
}

/// What a discretisation makes of a mesh of N vertices.
struct Elements {
    /// Edges (i, j, w), i ≠ j, w = −Lᵢⱼ; several of one edge are summed.
    edges: Vec<(u32, u32, f64)>,
    /// N, ℓ²: sums of the mass matrix's rows.
    lumped: Vec<f64>,
    /// Entries (i, j, m), i ≠ j, of the consistent mass; empty unless asked for.
    mass_pairs: Vec<(u32, u32, f64)>,
    /// N: its diagonal.
    mass_diagonal: Vec<f64>,
    triangles_without_area: usize,
    flips: usize,
}

impl Elements {
    fn new(vertices: usize, consistent: bool) -> Elements {
        Elements {
            edges: Vec::new(),
            lumped: vec![0.0; vertices],
            mass_pairs: Vec::new(),
            mass_diagonal: if consistent { vec![0.0; vertices] } else { Vec::new() },
            triangles_without_area: 0,
            flips: 0,
        }
    }

    /// Adds a triangle of linear hat functions with `share` of its weight: cot at each corner, area in ℓ². Corners may
    /// coincide (loops of an intrinsic triangulation). False where a number is not finite.
    fn add_triangle(&mut self, corners: [u32; 3], cot: [f64; 3], area: f64, share: f64) -> bool {
        if !(area.is_finite() && cot.iter().all(|cot| cot.is_finite())) {
            return false;
        }
        for k in 0..3 {
            let (i, j) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            if i != j {
                self.edges.push((i, j, 0.5 * share * cot[k]));
            }
            self.lumped[corners[k] as usize] += share * area / 3.0;
            if !self.mass_diagonal.is_empty() {
                self.mass_diagonal[corners[k] as usize] += share * area / 6.0;
                self.add_mass(i, j, share * area / 12.0);
            }
        }
        true
    }

    /// Adds m at (i, j) and at (j, i).
    fn add_mass(&mut self, i: u32, j: u32, m: f64) {
        if i == j {
            self.mass_diagonal[i as usize] += 2.0 * m;
        } else {
            self.mass_pairs.push((i, j, m));
        }
    }
}

/// Builds L and M. Time and memory O(T) but for the flips of [`Kind::Tufted`], of which a reasonable mesh needs O(T).
///
/// # Errors
/// A vertex without a triangle that has area; a join distance or ties that are not usable; areas that overflow.
pub fn operator(mesh: &Mesh, options: &OperatorOptions) -> Result<Operator, OperatorError> {
    let &OperatorOptions { join: distance, ref ties, kind, mass: kind_of_mass } = options;
    let vertices = mesh.vertices().len();
    let near = distance.map_or(Ok(Vec::new()), |distance| ties_of(mesh, distance))?;
    let all: Vec<Tie> = near.iter().chain(ties).cloned().collect();
    let reduction = Reduction::new(vertices, &all)?;
    let dofs = reduction.dofs;
    let consistent = kind_of_mass == Mass::Consistent;
    let elements = match kind {
        Kind::Cotan => cotan::elements(mesh, consistent)?,
        Kind::Tufted => tufted::elements(mesh, consistent)?,
        Kind::Polygon => polygon::elements(mesh, consistent)?,
    };
    let Elements { edges, lumped, mass_pairs, mass_diagonal, triangles_without_area, flips } = elements;
    if let Some(vertex) = lumped.iter().position(|&mass| mass <= 0.0 || mass.is_nan()) {
        return Err(match lumped[vertex] {
            0.0 => {
                let used = mesh.triangles().iter().flatten().any(|&corner| corner as usize == vertex);
                OperatorError::NoMass { vertex, used }
            }
            mass => OperatorError::NegativeMass { vertex, mass },
        });
    }

    let mut edges = reduction.edges(edges);
    let mut connected = Union::new(dofs);
    edges.iter().for_each(|&(i, j, _)| connected.merge(i, j));
    let (component_of_dof, components) = connected.classes();

    let (vertex_mass_matrix, mass_matrix) = if consistent {
        let (pairs, diagonal) = reduction.mass(&mass_pairs, &mass_diagonal);
        let apart = |&&(i, j, _): &&(u32, u32, f64)| component_of_dof[i as usize] != component_of_dof[j as usize];
        if let Some(&(dof, ..)) = pairs.iter().find(apart) {
            return Err(OperatorError::MassAcross { vertex: reduction.vertex_of_dof()[dof as usize] as usize });
        }
        (Some(Csr::symmetric(&mass_pairs, mass_diagonal)), Some(Csr::symmetric(&pairs, diagonal)))
    } else {
        (None, None)
    };
    let vertex_area = reduction.vertex_mass(lumped.clone());
    let shared = match kind_of_mass {
        Mass::Lumped | Mass::Consistent => vertex_area.clone(),
        Mass::Identity => reduction.vertex_mass(vec![1.0; vertices]),
    };
    let mut mass = vec![0.0; dofs];
    reduction.dof_of_vertex.iter().zip(&shared).for_each(|(&dof, share)| mass[dof as usize] += share);
    Ok(Operator {
        stiffness: Csr::laplacian(dofs, &mut edges),
        mass,
        vertex_mass: if consistent { lumped } else { shared },
        vertex_area,
        mass_matrix,
        vertex_mass_matrix,
        vertex_of_dof: reduction.vertex_of_dof(),
        dof_of_vertex: reduction.dof_of_vertex,
        followers: reduction.followers,
        idle_ties: reduction.idle,
        pairs_joined: near.len(),
        components,
        component_of_dof,
        triangles_without_area,
        flips,
    })
}

impl Operator {
    /// M x on vertices: N values in, N out. With [`Mass::Lumped`] and [`Mass::Identity`] a product with a diagonal.
    ///
    /// # Panics
    /// If `x` is shorter than N.
    pub fn vertex_mass_times(&self, x: &[f64]) -> Vec<f64> {
        match &self.vertex_mass_matrix {
            Some(matrix) => matrix.times(x),
            None => self.vertex_mass.iter().zip(x).map(|(mass, x)| mass * x).collect(),
        }
    }

    /// A field on vertices as its values on degrees of freedom: N values in, D out.
    ///
    /// # Panics
    /// If `field` is shorter than N.
    pub fn on_dofs(&self, field: &[f64]) -> Vec<f64> {
        self.vertex_of_dof.iter().map(|&vertex| field[vertex as usize]).collect()
    }

    /// Gives vertices that follow several their value, in fields whose other values are there: K × N, row-major.
    pub(crate) fn fill_followers(&self, fields: &mut [f64]) {
        if self.followers.is_empty() {
            return;
        }
        for field in fields.chunks_exact_mut(self.vertex_mass.len()) {
            for (vertex, weights) in &self.followers {
                let value = |&(dof, weight): &(u32, f64)| weight * field[self.vertex_of_dof[dof as usize] as usize];
                field[*vertex as usize] = weights.iter().map(value).sum();
            }
        }
    }
}

/// A name that is none of the known ones.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("'{name}': expected {expected}")]
pub struct UnknownName {
    /// The name.
    pub name: String,
    /// Those there are.
    pub expected: &'static str,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Cotan => "cotan",
            Kind::Tufted => "tufted",
            Kind::Polygon => "polygon",
        })
    }
}

impl FromStr for Kind {
    type Err = UnknownName;
    fn from_str(name: &str) -> Result<Kind, UnknownName> {
        match name {
            "cotan" | "cotangent" => Ok(Kind::Cotan),
            "tufted" => Ok(Kind::Tufted),
            "polygon" => Ok(Kind::Polygon),
            _ => Err(UnknownName { name: name.into(), expected: "cotan, tufted or polygon" }),
        }
    }
}

impl fmt::Display for Mass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Mass::Lumped => "lumped",
            Mass::Consistent => "consistent",
            Mass::Identity => "identity",
        })
    }
}

impl FromStr for Mass {
    type Err = UnknownName;
    fn from_str(name: &str) -> Result<Mass, UnknownName> {
        match name {
            "lumped" => Ok(Mass::Lumped),
            "consistent" => Ok(Mass::Consistent),
            "identity" => Ok(Mass::Identity),
            _ => Err(UnknownName { name: name.into(), expected: "lumped, consistent or identity" }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_of_one_right_angled_triangle() {
        // Legs of length 1: cot = 0 at the right angle, 1 at the others.
        let mesh = Mesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        let built = operator(&mesh, &OperatorOptions::default()).unwrap();
        assert_eq!(built.stiffness.values, [1.0, -0.5, -0.5, -0.5, 0.5, 0.0, -0.5, 0.0, 0.5]);
        assert_eq!(built.mass, [1.0 / 6.0; 3]);
    }

    #[test]
    fn a_triangle_without_area_connects_nothing() {
        // Two triangles and a flat one that bridges them: constants on either side cost no energy.
        let vertices =
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
        let mesh = Mesh::new(vertices, vec![[0, 1, 2], [3, 4, 5], [0, 1, 3]]).unwrap();
        let built = operator(&mesh, &OperatorOptions::default()).unwrap();
        assert_eq!((built.components, built.triangles_without_area), (2, 1));
    }

    #[test]
    fn a_vertex_without_mass_is_named() {
        let mesh = Mesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [9.0; 3], [0.0, 1.0, 0.0]], vec![[0, 1, 3]]).unwrap();
        assert_eq!(operator(&mesh, &OperatorOptions::default()), Err(OperatorError::NoMass { vertex: 2, used: false }));
    }
}
