//! Joining components that belong together but share no vertices, such as spot-welded sheets.
//!
//! Ties by what a model says are the general case ([`Tie`](crate::Tie)). Mutually nearest vertices of different components become one degree of freedom: the field takes one value on
//! both, so the spectrum is that of one connected surface. The geometry is not moved and no area is lost.

use thiserror::Error;

use crate::coupling::{Reduction, Tie};
use crate::inspect::{components, longest_edge};
use crate::mesh::Mesh;
use crate::proximity::mutual_pairs;

/// Which vertices share a degree of freedom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Join {
    /// N degrees of freedom, numbered from 0 in the order of each one's lowest vertex.
    pub dof_of_vertex: Vec<u32>,
    /// How many degrees of freedom there are; N minus the pairs, unless pairs of three components close a ring.
    pub dofs: usize,
    /// How many pairs of vertices were joined.
    pub pairs: usize,
}

/// Why vertices cannot be joined.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum JoinError {
    /// The distance is zero, negative or not a number.
    #[error("join distance {distance}: a positive length in the model's unit is needed")]
    Distance {
        /// The distance given.
        distance: f64,
    },
    /// The distance is more than ten times the longest edge.
    #[error(
        "join distance {distance}: more than ten times the longest edge ({longest}); is it in the model's length unit?"
    )]
    TooFar {
        /// The distance given.
        distance: f64,
        /// The mesh's longest edge.
        longest: f64,
    },
}

/// Makes mutually nearest vertices of different components, at most `distance` apart (model's length unit), one degree
/// of freedom. Equal distances are decided by the lowest vertex, so the result is unique.
///
/// # Errors
/// A distance that is not a positive length, or more than ten times the longest edge (vertices that far apart do not
/// name the same place, and the search would take the square of their number).
pub fn join(mesh: &Mesh, distance: f64) -> Result<Join, JoinError> {
    let ties = ties_of(mesh, distance)?;
    // Vertices of the mesh with one weight each: never refused.
    let reduction = Reduction::new(mesh.vertices().len(), &ties).unwrap_or_else(|error| unreachable!("{error}"));
    Ok(Join { dof_of_vertex: reduction.dof_of_vertex, dofs: reduction.dofs, pairs: ties.len() })
}

/// The pairs of [`join`] as ties: the higher vertex of each has the value of the lower one.
///
/// # Errors
/// As [`join`].
pub fn ties_of(mesh: &Mesh, distance: f64) -> Result<Vec<Tie>, JoinError> {
    if !(distance > 0.0 && distance.is_finite()) {
        return Err(JoinError::Distance { distance });
    }
    let longest = longest_edge(mesh);
    if distance > 10.0 * longest {
        return Err(JoinError::TooFar { distance, longest });
    }
    let (component_of_vertex, _) = components(mesh);
    let pairs = mutual_pairs(mesh.vertices(), &component_of_vertex, distance);
    Ok(pairs.iter().map(|pair| Tie { vertex: pair.high, to: vec![(pair.low, 1.0)] }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_mutual_pairs_of_different_components_are_joined() {
        // Two triangles 1 apart in z; the second one's last vertex is shifted out of reach.
        let vertices =
            vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 9.0, 1.0]];
        let mesh = Mesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let joined = join(&mesh, 1.0).unwrap();
        assert_eq!(joined, Join { dof_of_vertex: vec![0, 1, 2, 0, 1, 3], dofs: 4, pairs: 2 });
        assert_eq!(join(&mesh, 0.9).unwrap().pairs, 0);
        assert!(matches!(join(&mesh, f64::NAN), Err(JoinError::Distance { .. })));
        assert!(matches!(join(&mesh, 1e3), Err(JoinError::TooFar { .. })));
    }
}
