//! Triangles in, certified Laplace-Beltrami eigenpairs out.
//!
//! `mesh` → `inspect` → `join` → `operator` → `eigen/`: arrays become a [`Mesh`]; [`inspect`] says what it is like;
//! [`operator`] builds stiffness and mass, with separate sheets [joined](join()) where asked for; [`eigenbasis`] finds the
//! K lowest pairs of L φ = λ M φ and the evidence that they are right and that none is missing.
//!
//! `examples/obj_to_eigenpairs.rs` starts from a mesh file and prints pairs with their residuals. Quadrilaterals and
//! non-manifold or badly shaped meshes have operators of their own, see [`Kind`]; [`inspect`] recommends one.
//!
//! The spectrum of a sheet of 2 × 1 with a free boundary is λ = π² (p²/4 + q²):
//!
//! ```
//! use mesh_spectrum::{EigenOptions, Mesh, OperatorOptions, eigenbasis, operator};
//!
//! let (nx, ny) = (40, 20);
//! let vertices = (0..=ny).flat_map(|j| (0..=nx).map(move |i| [i as f64 / 20.0, j as f64 / 20.0, 0.0])).collect();
//! let faces: Vec<[u32; 4]> = (0..ny)
//!     .flat_map(|j| (0..nx).map(move |i| j * (nx + 1) + i))
//!     .map(|a| [a, a + 1, a + nx + 2, a + nx + 1])
//!     .collect();
//! let mesh = Mesh::from_faces(vertices, &faces)?;
//!
//! let operator = operator(&mesh, &OperatorOptions::default())?;
//! let basis = eigenbasis(&operator, &EigenOptions { count: 4, ..Default::default() }, &())?;
//!
//! let over_pi_squared: Vec<f64> = basis.eigenvalues.iter().map(|e| e / std::f64::consts::PI.powi(2)).collect();
//! for (computed, exact) in over_pi_squared.iter().zip([0.0, 0.25, 1.0, 1.0]) {
//!     assert!((computed - exact).abs() < 0.01);
//! }
//! assert!(basis.certificate.complete && basis.certificate.residual_max < 1e-10);
//! assert_eq!(basis.sensitive, [2..4]); // one half wave across, two along: the same eigenvalue
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod coupling;
mod csr;
mod eigen;
mod inspect;
mod join;
mod mesh;
mod operator;
mod proximity;
mod split;

pub use coupling::{CouplingError, Tie};
pub use eigen::{
    Certificate, EigenError, EigenOptions, Eigenbasis, InertiaCount, Instructions, Method, Orthogonality, Seconds,
    Watch, eigenbasis,
};
pub use inspect::{Inspection, Reason, inspect};
pub use join::{Join, JoinError, join, ties_of};
pub use mesh::{Mesh, MeshError};
pub use operator::{Csr, Kind, Mass, Operator, OperatorError, OperatorOptions, UnknownName, operator};
