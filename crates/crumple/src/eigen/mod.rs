//! Eigenpairs of any surface, alone, in a file that other tools open.
//!
//! [`Surface`] → operator → eigenbasis → [`write()`]: `eigenvalues` `[K]` f64, `eigenvectors` `[K, N]` f64 (or f32), `mass` `[N]`
//! f64, `points` `[N, 3]` f64, `triangles` `[T, 3]` u32, `vertex_ids` `[N]` u64, and with the consistent mass its matrix on
//! vertices as `mass_indptr` `[N + 1]`, `mass_indices`, `mass_data`, which is SciPy's `csr_matrix`.

mod file;

use std::time::Instant;

use mesh_spectrum::{
    EigenOptions, Eigenbasis, Inspection, Operator, OperatorOptions, Watch, eigenbasis, inspect, operator,
};

use crate::Error;
use crate::surface::Surface;

pub use file::{Precision, check_writable, write};

/// Eigenpairs of a surface with all that is known about them.
#[derive(Debug, Clone)]
pub struct Solved {
    /// What the mesh is like.
    pub inspection: Inspection,
    /// Stiffness and mass.
    pub operator: Operator,
    /// The pairs and their certificate.
    pub basis: Eigenbasis,
    /// Wall seconds of each step, in order: `inspect`, `operator`, `eigenbasis`.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Computes the lowest eigenpairs of a surface.
///
/// # Errors
/// [`Error::Join`], [`Error::Operator`], [`Error::Eigen`], [`Error::Stopped`].
pub fn solve(
    surface: &Surface,
    operator_options: &OperatorOptions,
    options: &EigenOptions,
    watch: &dyn Watch,
) -> Result<Solved, Error> {
    let mut seconds = Vec::new();
    let mut last = Instant::now();
    let mut lap = |step| {
        let now = Instant::now();
        seconds.push((step, (now - std::mem::replace(&mut last, now)).as_secs_f64()));
    };
    let inspection = inspect(&surface.mesh);
    lap("inspect");
    let operator = operator(&surface.mesh, operator_options)?;
    lap("operator");
    let basis = eigenbasis(&operator, options, watch)?;
    lap("eigenbasis");
    Ok(Solved { inspection, operator, basis, seconds })
}

/// The most memory this process has held so far, in bytes, where the system tells (Linux).
pub fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| 1024 * kilobytes)
}
