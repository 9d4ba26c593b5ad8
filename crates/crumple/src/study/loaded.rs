//! A study with its mesh and basis in memory.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::{Coefficients, Error, Rows, Study, basis_file};
use crate::basis::Basis;
use crate::reference::Reference;

/// A study with its mesh and basis in memory: what most questions need.
#[derive(Debug)]
pub struct Loaded {
    /// The study.
    pub study: Study,
    /// Its reference mesh.
    pub reference: Reference,
    /// Its eigenbasis.
    pub basis: Basis,
    last_states: Mutex<Option<Kept>>,
}

/// Last states, and the runs and parts they were read from, so that a study that has changed since is read again.
#[derive(Debug)]
struct Kept {
    of: Vec<(String, String)>,
    rows: Arc<Coefficients>,
}

impl Loaded {
    /// Opens a study and reads mesh and basis.
    ///
    /// # Errors
    /// As [`Study::open`], [`Study::reference`], [`Study::basis`].
    pub fn open(folder: &Path) -> Result<Self, Error> {
        Self::of(Study::open(folder)?)
    }

    /// Reads mesh and basis of a study.
    ///
    /// # Errors
    /// As [`Study::reference`], [`Study::basis`].
    pub fn of(study: Study) -> Result<Self, Error> {
        let (reference, basis) = (study.reference()?, study.basis()?);
        let (vertices, eigenpairs) = (study.manifest.vertices, study.manifest.eigenpairs);
        if reference.vertices() != vertices || basis.vertices() != vertices || basis.eigenpairs() != eigenpairs {
            let what = format!(
                "mesh, basis and manifest do not fit together: {} and {} vertices, {vertices} expected",
                reference.vertices(),
                basis.vertices()
            );
            return Err(Error::Damaged { path: study.folder.join(basis_file::FILE), what });
        }
        Ok(Self { study, reference, basis, last_states: Mutex::default() })
    }
}

impl Loaded {
    /// All K coefficients of the last state of every run, read once.
    ///
    /// # Errors
    /// As [`Study::coefficients`].
    pub fn last_states(&self) -> Result<Arc<Coefficients>, Error> {
        let now: Vec<_> = self.study.manifest.runs.iter().map(|(id, run)| (id.clone(), run.part.clone())).collect();
        let mut kept = self.last_states.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = kept.as_ref().filter(|kept| kept.of == now) {
            return Ok(Arc::clone(&kept.rows));
        }
        let rows = Arc::new(self.study.coefficients(None, Rows::Last)?);
        *kept = Some(Kept { of: now, rows: Arc::clone(&rows) });
        Ok(rows)
    }
}
