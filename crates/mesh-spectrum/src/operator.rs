//! Laplace-Beltrami operator on a triangle mesh, linear hat functions.
//!
//! | paper | here          | size, kind                            | unit |
//! |-------|---------------|---------------------------------------|------|
//! | L     | `stiffness`   | D × D sparse, symmetric, ≥ 0, L·1 = 0 | 1    |
//! | M     | `mass`        | D, diagonal, > 0                      | ℓ²   |
//! |       | `vertex_mass` | N, diagonal, ≥ 0                      | ℓ²   |
//!
//! D degrees of freedom for N vertices: D = N, unless vertices are joined or tied to others ([`Tie`]), whose value they
//! then have; `vertex_mass` is 0 where a vertex follows several.
//! Weak form: L φ = λ M φ, so λ is in 1/ℓ². Sign: positive (libigl's `cotmatrix` is the negative of ours).
//! Source: Pinkall and Polthier 1993. An edge with three faces or more gets the sum over all of them. We part from the
//! source once: a triangle without area is left out and counted.

use thiserror::Error;

use crate::coupling::{CouplingError, Reduction, Tie};
use crate::join::{JoinError, ties_of};
use crate::mesh::{Mesh, Point, Union, dot, double_area, sub};

/// How the operator is built from the mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OperatorOptions {
    /// Join mutually nearest vertices of different components at most this far apart, in the model's length unit
    /// ([`join`](crate::join)). Default `None`: components stay apart, and each adds a zero eigenvalue.
    pub join: Option<f64>,
    /// Vertices that follow others, taken in their order. Default: none.
    pub ties: Vec<Tie>,
}

/// Stiffness and lumped mass of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Operator {
    /// L, D × D: Lᵢⱼ = −½ Σ cot of the angles opposite to edge ij, Lᵢᵢ = −Σⱼ Lᵢⱼ.
    pub stiffness: Csr,
    /// M's diagonal, D, ℓ²: a third of the area of each face at a degree of freedom.
    pub mass: Vec<f64>,
    /// N, ℓ²: the same per vertex, for M-products on vertices. Sums to the mesh's area, as `mass` does. A vertex that
    /// follows several has 0 and they have its area.
    pub vertex_mass: Vec<f64>,
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
}

/// A square sparse matrix, compressed by rows: the columns of row i are `columns[start[i]..start[i + 1]]`, ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct Csr {
    /// One more than rows.
    pub start: Vec<usize>,
    /// Column of each entry.
    pub columns: Vec<u32>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

/// Why a mesh has no operator.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum OperatorError {
    /// A vertex belongs to no triangle with area, so nothing determines a field there.
    #[error("vertex {vertex}: no triangle with area uses it; drop such vertices before building the operator")]
    NoMass {
        /// The lowest such vertex, numbered from 0.
        vertex: usize,
    },
    /// Areas or cotangents overflow.
    #[error("triangle {triangle}: its area or cotangents are not finite; rescale the model")]
    NotFinite {
        /// The triangle, numbered from 0.
        triangle: usize,
    },
    /// The join distance is not usable.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// The ties are not usable.
    #[error(transparent)]
    Coupling(#[from] CouplingError),
}

/// Builds L and M. Time and memory O(T).
///
/// # Errors
/// A vertex without a triangle that has area; a join distance that is not usable; areas that overflow.
pub fn operator(mesh: &Mesh, options: &OperatorOptions) -> Result<Operator, OperatorError> {
    let OperatorOptions { join: distance, ties } = options;
    let vertices = mesh.vertices().len();
    let near = distance.map_or(Ok(Vec::new()), |distance| ties_of(mesh, distance))?;
    let all: Vec<Tie> = near.iter().chain(ties).cloned().collect();
    let reduction = Reduction::new(vertices, &all)?;
    let dofs = reduction.dofs;

    let mut vertex_mass = vec![0.0; vertices];
    let mut edges: Vec<(u32, u32, f64)> = Vec::with_capacity(3 * mesh.triangles().len());
    let mut triangles_without_area = 0;
    for (number, &triangle) in mesh.triangles().iter().enumerate() {
        let corners = mesh.corners(triangle);
        let Some(double_area) = double_area(corners) else {
            triangles_without_area += 1;
            continue;
        };
        let cot = cotangents(corners, double_area);
        if !double_area.is_finite() || !cot.iter().all(|cot| cot.is_finite()) {
            return Err(OperatorError::NotFinite { triangle: number });
        }
        for k in 0..3 {
            // The edge opposite to corner k.
            edges.push((triangle[(k + 1) % 3], triangle[(k + 2) % 3], 0.5 * cot[k]));
            vertex_mass[triangle[k] as usize] += double_area / 6.0;
        }
    }
    if let Some(vertex) = vertex_mass.iter().position(|&mass| mass <= 0.0) {
        return Err(OperatorError::NoMass { vertex });
    }

    let vertex_mass = reduction.vertex_mass(vertex_mass);
    let mut mass = vec![0.0; dofs];
    for (&dof, vertex_mass) in reduction.dof_of_vertex.iter().zip(&vertex_mass) {
        mass[dof as usize] += vertex_mass;
    }
    let mut connected = Union::new(dofs);
    let mut entries: Vec<(u32, u32, f64)> = Vec::with_capacity(4 * edges.len());
    for (i, j, weight) in reduction.edges(edges) {
        entries.extend([(i, j, -weight), (j, i, -weight), (i, i, weight), (j, j, weight)]);
        connected.merge(i, j);
    }
    let (component_of_dof, components) = connected.classes();
    Ok(Operator {
        stiffness: Csr::from_entries(dofs, entries),
        mass,
        vertex_mass,
        vertex_of_dof: reduction.vertex_of_dof(),
        dof_of_vertex: reduction.dof_of_vertex,
        followers: reduction.followers,
        idle_ties: reduction.idle,
        pairs_joined: near.len(),
        components,
        component_of_dof,
        triangles_without_area,
    })
}

/// cot θ at each corner of a triangle: cot θ = (u·v) / |u×v|, with u and v the edges that leave the corner;
/// |u×v|, twice the area, is the same at all three corners.
pub(crate) fn cotangents([a, b, c]: [Point; 3], double_area: f64) -> [f64; 3] {
    let cot = |u, v| dot(u, v) / double_area;
    [cot(sub(b, a), sub(c, a)), cot(sub(c, b), sub(a, b)), cot(sub(a, c), sub(b, c))]
}

impl Operator {
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

impl Csr {
    /// Sums entries (row, column, value) that share a place. The sum's order is that of the entries, so it does not
    /// depend on how they are sorted, and the result is exactly symmetric if the entries come in symmetric pairs.
    pub(crate) fn from_entries(rows: usize, mut entries: Vec<(u32, u32, f64)>) -> Csr {
        entries.sort_by_key(|&(row, column, _)| (row, column)); // stable
        let mut matrix = Csr { start: vec![0; rows + 1], columns: Vec::new(), values: Vec::new() };
        for same in entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            matrix.start[same[0].0 as usize + 1] += 1;
            matrix.columns.push(same[0].1);
            matrix.values.push(same.iter().map(|entry| entry.2).sum());
        }
        for row in 0..rows {
            matrix.start[row + 1] += matrix.start[row];
        }
        matrix
    }

    /// How many rows (and columns) there are.
    pub fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// (column, value) of each entry of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.start[row]..self.start[row + 1];
        self.columns[range.clone()].iter().zip(&self.values[range]).map(|(&column, &value)| (column as usize, value))
    }

    /// The product with a vector of as many entries as there are rows.
    ///
    /// # Panics
    /// If `x` is shorter.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        (0..self.rows()).map(|row| self.row(row).map(|(column, value)| value * x[column]).sum()).collect()
    }
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
        assert_eq!(operator(&mesh, &OperatorOptions::default()), Err(OperatorError::NoMass { vertex: 2 }));
    }
}
