//! Vertices that follow others: spot welds, ties, joined sheets, as linear constraints u_v = Σ w u_j on a field u.
//!
//! With u = P x for the D values x that are left free (P: N × D, rows ≥ 0 that sum to 1), the operator on them is
//!
//! - L' = Pᵀ L P, the energy of the constrained fields. An edge's share w (uᵢ − uⱼ)² is w (Σ d_a x_a)² with Σ d = 0, and
//!   that is −w Σ_{a<b} d_a d_b (x_a − x_b)²: edges again, so L' stays a symmetric Laplacian with L'·1 = 0;
//! - M' = Pᵀ M P where M is not diagonal (consistent mass), and on vertices M as it is;
//! - M' = the row sums of Pᵀ M P where M is diagonal (lumped mass, identity), that is, Pᵀ m for the diagonal m of M: each
//!   vertex that follows gives its share to those it follows, by its weights. Explicit finite-element codes treat the
//!   mass of tied nodes so.
//!
//! None of this asks which discretisation L and M are from. Why row sums: Pᵀ M P itself has entries beside its diagonal as soon as a vertex follows two others. The row sums are
//! positive (weights are), keep the total area (P·1 = 1), and are Pᵀ M P itself where every vertex follows at most one
//! other, which is joining by distance and welding node to node. A lumped mass is a quadrature rule that is exact for
//! linear functions on a face; moving a point of it by Σ w keeps the value of every linear function there, so the
//! order of the error stays what lumping made it.
//!
//! On vertices the same diagonal M' is a `vertex_mass` with 0 at the vertices that follow several others (whose value the
//! others have) and the old area where a vertex follows one: Σ_v m'_v φᵢ(v) φⱼ(v) = δᵢⱼ exactly, with φ = P x.

use thiserror::Error;

use crate::mesh::Union;

/// A vertex whose value is a mean of others': a weight each, not negative, sum 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    /// The vertex that follows.
    pub vertex: u32,
    /// The vertices it follows, and their weights: one vertex with weight 1, or the corners of the triangle in which the
    /// point lies that holds it, with its barycentric coordinates.
    pub to: Vec<(u32, f64)>,
}

/// Why ties are not usable.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CouplingError {
    /// A vertex that does not exist.
    #[error("tie {tie}: vertex {vertex} does not exist, there are {vertices} (numbered from 0)")]
    VertexOutOfRange {
        /// The tie, numbered from 0.
        tie: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// Weights that are no mean.
    #[error("tie {tie} of vertex {vertex}: its weights must not be negative and sum to 1, they sum to {sum}")]
    Weights {
        /// The tie, numbered from 0.
        tie: usize,
        /// Its vertex.
        vertex: u32,
        /// The sum of its weights.
        sum: f64,
    },
}

/// Weights below this are dropped: a point that close to a corner or an edge is on it.
const NOTHING: f64 = 1e-6;

/// P, row by row: which values are free, and what the others are made of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reduction {
    /// N: the degree of freedom of each vertex, numbered from 0 in the order of each one's lowest vertex. For a vertex
    /// that follows several, the one with the largest weight.
    pub(crate) dof_of_vertex: Vec<u32>,
    /// D.
    pub(crate) dofs: usize,
    /// Vertices that follow several: their weights on degrees of freedom, in rising order of the vertex.
    pub(crate) followers: Vec<(u32, Vec<(u32, f64)>)>,
    /// Ties that hold nothing more: of a vertex that other ties hold already, or that follows itself.
    pub(crate) idle: usize,
}

/// A vertex's value on degrees of freedom.
type Weights = Vec<(u32, f64)>;

impl Reduction {
    /// Ties are taken in their order; those with one vertex first.
    ///
    /// # Errors
    /// A vertex out of range, weights that are no mean.
    pub(crate) fn new(vertices: usize, ties: &[Tie]) -> Result<Reduction, CouplingError> {
        let mut union = Union::new(vertices);
        let mut several: Vec<(u32, Weights)> = Vec::new();
        let mut idle = 0;
        for (tie, Tie { vertex, to }) in ties.iter().enumerate() {
            let outside = to.iter().map(|&(other, _)| other).chain([*vertex]).find(|&other| other as usize >= vertices);
            if let Some(vertex) = outside {
                return Err(CouplingError::VertexOutOfRange { tie, vertex, vertices });
            }
            let sum: f64 = to.iter().map(|&(_, weight)| weight).sum();
            if !(to.iter().all(|&(_, weight)| weight >= 0.0) && (sum - 1.0).abs() < 1e-6) {
                return Err(CouplingError::Weights { tie, vertex: *vertex, sum });
            }
            match mean(to.iter().copied())[..] {
                [(other, _)] if union.root(other) == union.root(*vertex) => idle += 1,
                [(other, _)] => union.merge(*vertex, other),
                _ => several.push((*vertex, to.clone())),
            }
        }
        // Class by class: `row[i]` is what the class of vertex i follows.
        let mut row: Vec<Option<Weights>> = vec![None; vertices];
        let mut order = Vec::new();
        for (vertex, to) in several {
            let vertex = union.root(vertex);
            if row[vertex as usize].is_some() {
                idle += 1;
                continue;
            }
            let mut weights = Weights::new();
            for (other, weight) in mean(to.into_iter().map(|(other, weight)| (union.root(other), weight))) {
                match &row[other as usize] {
                    Some(further) => weights.extend(further.iter().map(|&(last, part)| (last, weight * part))),
                    None => weights.push((other, weight)),
                }
            }
            // u = w u + rest means u = rest / (1 − w).
            weights.retain(|&(other, _)| other != vertex);
            let rest: f64 = weights.iter().map(|&(_, weight)| weight).sum();
            if rest < NOTHING {
                idle += 1;
                continue;
            }
            row[vertex as usize] = Some(mean(weights.into_iter().map(|(other, weight)| (other, weight / rest))));
            order.push(vertex);
        }
        // A row names vertices that were free when it was made; those that follow others by now were made later.
        for &vertex in order.iter().rev() {
            let Some(weights) = row[vertex as usize].take() else { continue };
            let mut last = Weights::new();
            for (other, weight) in weights {
                match &row[other as usize] {
                    Some(further) => last.extend(further.iter().map(|&(last, part)| (last, weight * part))),
                    None => last.push((other, weight)),
                }
            }
            row[vertex as usize] = Some(mean(last.into_iter()));
        }
        Ok(Reduction::numbered(&mut union, &row, idle))
    }

    /// Numbers the classes that are free.
    fn numbered(union: &mut Union, row: &[Option<Weights>], idle: usize) -> Reduction {
        let mut dof_of_vertex = vec![u32::MAX; row.len()];
        let mut dofs = 0;
        for vertex in 0..row.len() {
            let root = union.root(vertex as u32) as usize;
            if row[root].is_none() {
                if root == vertex {
                    dof_of_vertex[vertex] = dofs;
                    dofs += 1;
                } else {
                    dof_of_vertex[vertex] = dof_of_vertex[root];
                }
            }
        }
        let mut followers = Vec::new();
        for vertex in 0..row.len() {
            let Some(weights) = &row[union.root(vertex as u32) as usize] else { continue };
            let weights: Weights = weights.iter().map(|&(other, w)| (dof_of_vertex[other as usize], w)).collect();
            let most = weights.iter().fold((u32::MAX, 0.0), |most, &next| if next.1 > most.1 { next } else { most });
            dof_of_vertex[vertex] = most.0;
            followers.push((vertex as u32, weights));
        }
        Reduction { dof_of_vertex, dofs: dofs as usize, followers, idle }
    }

    /// L' from the edges (i, j, w), i ≠ j, w = −Lᵢⱼ, of L: edges between degrees of freedom.
    pub(crate) fn edges(&self, edges: Vec<(u32, u32, f64)>) -> Vec<(u32, u32, f64)> {
        let weights = self.weights();
        let dof = |vertex: u32| self.dof_of_vertex[vertex as usize];
        let mut reduced = Vec::with_capacity(edges.len());
        let mut difference: Weights = Vec::new();
        for (i, j, w) in edges {
            if weights[i as usize].is_none() && weights[j as usize].is_none() {
                let (i, j) = (dof(i), dof(j));
                if i != j {
                    reduced.push((i, j, w));
                }
                continue;
            }
            difference.clear();
            for (vertex, sign) in [(i, 1.0), (j, -1.0)] {
                match weights[vertex as usize] {
                    Some(of) => difference.extend(of.iter().map(|&(dof, part)| (dof, sign * part))),
                    None => difference.push((dof(vertex), sign)),
                }
            }
            difference.sort_by_key(|&(dof, _)| dof); // stable
            let d: Weights = difference
                .chunk_by(|a, b| a.0 == b.0)
                .map(|same| (same[0].0, same.iter().map(|d| d.1).sum()))
                .collect();
            for (at, &(a, da)) in d.iter().enumerate() {
                reduced.extend(d[at + 1..].iter().map(|&(b, db)| (a, b, -w * da * db)).filter(|edge| edge.2 != 0.0));
            }
        }
        reduced
    }

    /// M' = Pᵀ M P from entries (i, j, m), i ≠ j, of M that stand for both places, and its diagonal: the same on degrees of
    /// freedom.
    pub(crate) fn mass(&self, pairs: &[(u32, u32, f64)], diagonal: &[f64]) -> (Vec<(u32, u32, f64)>, Vec<f64>) {
        let weights = self.weights();
        let own: Vec<Weights> = self.dof_of_vertex.iter().map(|&dof| vec![(dof, 1.0)]).collect();
        let of = |vertex: u32| match weights[vertex as usize] {
            Some(several) => &several[..],
            None => &own[vertex as usize][..],
        };
        let mut sums = vec![0.0; self.dofs];
        let mut reduced = Vec::with_capacity(pairs.len());
        for &(i, j, m) in pairs {
            for &(a, of_i) in of(i) {
                for &(b, of_j) in of(j) {
                    match a == b {
                        true => sums[a as usize] += 2.0 * m * of_i * of_j,
                        false => reduced.push((a, b, m * of_i * of_j)),
                    }
                }
            }
        }
        for (i, &m) in (0..).zip(diagonal) {
            let parts = of(i);
            for (at, &(a, of_a)) in parts.iter().enumerate() {
                sums[a as usize] += m * of_a * of_a;
                reduced.extend(parts[at + 1..].iter().map(|&(b, of_b)| (a, b, m * of_a * of_b)));
            }
        }
        (reduced, sums)
    }

    /// M' on vertices: the area of a vertex that follows several goes to those it follows.
    pub(crate) fn vertex_mass(&self, mut mass: Vec<f64>) -> Vec<f64> {
        let vertex_of_dof = self.vertex_of_dof();
        for (vertex, weights) in &self.followers {
            let moved = std::mem::take(&mut mass[*vertex as usize]);
            weights.iter().for_each(|&(dof, weight)| mass[vertex_of_dof[dof as usize] as usize] += weight * moved);
        }
        mass
    }

    /// D: the lowest vertex of each degree of freedom.
    pub(crate) fn vertex_of_dof(&self) -> Vec<u32> {
        let weights = self.weights();
        let mut vertex_of_dof = vec![u32::MAX; self.dofs];
        for vertex in (0..self.dof_of_vertex.len()).rev().filter(|&vertex| weights[vertex].is_none()) {
            vertex_of_dof[self.dof_of_vertex[vertex] as usize] = vertex as u32;
        }
        vertex_of_dof
    }

    fn weights(&self) -> Vec<Option<&Weights>> {
        let mut of: Vec<Option<&Weights>> = vec![None; self.dof_of_vertex.len()];
        self.followers.iter().for_each(|(vertex, weights)| of[*vertex as usize] = Some(weights));
        of
    }
}

/// Entries of one place summed, those without weight left out, the sum 1 again; in rising order.
fn mean(weights: impl Iterator<Item = (u32, f64)>) -> Weights {
    let mut sorted: Weights = weights.collect();
    sorted.sort_by_key(|&(vertex, _)| vertex); // stable
    let mut summed: Weights = sorted
        .chunk_by(|a, b| a.0 == b.0)
        .map(|same| (same[0].0, same.iter().map(|entry| entry.1).sum()))
        .filter(|&(_, weight)| weight > NOTHING)
        .collect();
    let total: f64 = summed.iter().map(|&(_, weight)| weight).sum();
    summed.iter_mut().for_each(|(_, weight)| *weight /= total);
    summed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tie(vertex: u32, to: &[(u32, f64)]) -> Tie {
        Tie { vertex, to: to.to_vec() }
    }

    #[test]
    fn chains_end_at_vertices_that_are_free() {
        // 0 follows 1 and 2; then 1 follows 3 and 4; 5 is 2.
        let ties = [tie(0, &[(1, 0.5), (2, 0.5)]), tie(1, &[(3, 0.25), (4, 0.75)]), tie(5, &[(2, 1.0)])];
        let reduction = Reduction::new(6, &ties).unwrap();
        assert_eq!(reduction.dofs, 3, "2, 3 and 4 are free");
        assert_eq!(reduction.dof_of_vertex, [0, 2, 0, 1, 2, 0]);
        assert_eq!(reduction.followers, [(0, vec![(0, 0.5), (1, 0.125), (2, 0.375)]), (1, vec![(1, 0.25), (2, 0.75)])]);
        assert_eq!(reduction.vertex_mass(vec![8.0; 6]), [0.0, 0.0, 12.0, 11.0, 17.0, 8.0]);
    }

    #[test]
    fn ties_that_say_nothing_new_are_counted() {
        let ties = [
            tie(0, &[(1, 1.0)]),
            tie(1, &[(0, 1.0)]),
            tie(2, &[(3, 0.5), (4, 0.5)]),
            tie(2, &[(0, 0.5), (4, 0.5)]),
            tie(3, &[(2, 1.0 - 1e-9), (4, 1e-9)]),
        ];
        let reduction = Reduction::new(5, &ties).unwrap();
        // 3 is 2, so 2 = (2 + 4) / 2 is 2 = 4.
        assert_eq!((reduction.dofs, reduction.idle), (2, 2));
        assert_eq!(reduction.followers, [(2, vec![(1, 1.0)]), (3, vec![(1, 1.0)])]);
    }

    #[test]
    fn what_is_no_mean_is_refused() {
        let words = |ties: &[Tie]| Reduction::new(3, ties).unwrap_err().to_string();
        assert!(words(&[tie(0, &[(1, 0.5)])]).contains("sum to 0.5"));
        assert!(words(&[tie(0, &[(1, 1.5), (2, -0.5)])]).contains("not be negative"));
        assert!(words(&[tie(0, &[(1, f64::NAN)])]).contains("NaN"));
        assert!(words(&[tie(0, &[(9, 1.0)])]).contains("vertex 9 does not exist"));
    }

    #[test]
    fn reduced_matrices_have_the_energy_and_the_norm_of_the_constrained_field() {
        let ties = [tie(0, &[(1, 0.3), (2, 0.7)]), tie(3, &[(0, 0.5), (4, 0.5)])];
        let reduction = Reduction::new(5, &ties).unwrap();
        let edges = vec![(0, 1, 2.0), (0, 3, 1.5), (2, 4, 0.5), (3, 4, 3.0), (1, 2, -0.25)];
        let x = [1.0, -2.0, 5.0]; // vertices 1, 2 and 4
        let mut u = [0.0, 1.0, -2.0, 0.0, 5.0];
        u[0] = 0.3 * u[1] + 0.7 * u[2];
        u[3] = 0.5 * u[0] + 0.5 * u[4];
        let energy = |edges: &[(u32, u32, f64)], u: &[f64]| -> f64 {
            edges.iter().map(|&(i, j, w)| w * (u[i as usize] - u[j as usize]).powi(2)).sum()
        };
        let whole = energy(&edges, &u);
        let diagonal = [3.0, 1.0, 2.0, 5.0, 4.0];
        let product = |pairs: &[(u32, u32, f64)], diagonal: &[f64], u: &[f64]| -> f64 {
            let beside = pairs.iter().map(|&(i, j, m)| 2.0 * m * u[i as usize] * u[j as usize]);
            diagonal.iter().zip(u).map(|(m, u)| m * u * u).chain(beside).sum()
        };
        let (pairs, reduced) = reduction.mass(&edges, &diagonal);
        let mass = product(&edges, &diagonal, &u);
        assert!((product(&pairs, &reduced, &x) - mass).abs() < 1e-12 * mass.abs());
        assert!((energy(&reduction.edges(edges), &x) - whole).abs() < 1e-12 * whole.abs());
    }
}
