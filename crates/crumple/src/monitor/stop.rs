//! Asking LS-DYNA to end a run.
//!
//! The solver looks for a file `d3kil` in its working directory every few cycles, reads a sense switch from it, and
//! removes it (LS-DYNA Keyword User's Manual, volume I, Getting Started, "Sense switch controls"). `sw1` writes a
//! restart file and terminates: the run can be taken up again where it was stopped.

use std::path::{Path, PathBuf};

use crate::Error;
use crate::study::store;

/// The file that LS-DYNA looks for.
pub const STOP_FILE: &str = "d3kil";

/// Asks the solver that writes the result file `root` to end, by a file in its folder. Returns that file.
///
/// # Errors
/// [`Error::Io`].
pub fn stop(root: &Path) -> Result<PathBuf, Error> {
    let file = run_folder(root).join(STOP_FILE);
    // The file appears whole: a solver that looks in between would find no switch.
    store::write_bytes(&file, b"sw1\n")?;
    Ok(file)
}

/// The folder of a root file.
pub fn run_folder(root: &Path) -> PathBuf {
    match root.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}
