//! What is in a study: files with sizes and checksums, and a record of each run. Replaced by rename, last.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::store;
use crate::Error;
use crate::error::io;
use crate::project::Measures;

/// The layout this program writes and reads.
pub const LAYOUT: u64 = 2;
/// Name of the manifest in a study's folder.
pub(crate) const FILE: &str = "manifest.json";

/// The manifest of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the layout.
    pub layout: u64,
    /// Version of the program that wrote it last.
    pub crumple: String,
    /// Content name of the basis.
    pub basis: String,
    /// Number of eigenpairs K.
    pub eigenpairs: usize,
    /// Number of vertices N.
    pub vertices: usize,
    /// The files that never change, by path below the study's folder.
    pub files: BTreeMap<String, FileRecord>,
    /// Columns of the input tables, in the order they came.
    pub inputs: Vec<String>,
    /// The runs, by id.
    pub runs: BTreeMap<String, RunRecord>,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Length in bytes.
    pub bytes: u64,
    /// BLAKE3 hash, hexadecimal.
    pub blake3: String,
}

/// One run of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Absolute path of its root file when it was added.
    pub path: PathBuf,
    /// Name, length and time of change of each of its files when it was added: tells cheaply that nothing changed.
    pub stamp: String,
    /// BLAKE3 hash of times and positions on the mesh.
    pub content: String,
    /// Path of the part that holds its coefficients, below the study's folder.
    pub part: String,
    /// Times of its states.
    pub times: Vec<f64>,
    /// Numbers about its last state.
    pub last: Measures,
    /// Values from the input tables, by column.
    pub inputs: BTreeMap<String, String>,
    /// What was noticed about it.
    pub warnings: Vec<String>,
}

impl FileRecord {
    /// Measures a file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn of(path: &Path) -> Result<Self, Error> {
        let mut hasher = blake3::Hasher::new();
        let mut file = std::fs::File::open(path).map_err(io("read", path))?;
        let bytes = std::io::copy(&mut file, &mut hasher).map_err(io("read", path))?;
        Ok(Self { bytes, blake3: hasher.finalize().to_hex().to_string() })
    }
}

impl Manifest {
    /// Reads the manifest of the study in `folder`.
    ///
    /// # Errors
    /// [`Error::NotAStudy`], [`Error::OtherLayout`], [`Error::Damaged`].
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(FILE);
        if !folder.exists() {
            return Err(Error::NotAStudy { folder: folder.to_owned(), what: "no such folder".into() });
        }
        let text = match std::fs::read_to_string(&path) {
            Err(error)
                if error.kind() == std::io::ErrorKind::NotFound
                    || error.kind() == std::io::ErrorKind::NotADirectory =>
            {
                return Err(Error::NotAStudy { folder: folder.to_owned(), what: format!("it has no {FILE}") });
            }
            Err(error) if error.kind() == std::io::ErrorKind::InvalidData => {
                return Err(Error::Damaged { path, what: "not a manifest: it is no text".into() });
            }
            other => other.map_err(io("read", &path))?,
        };
        let damaged =
            |error: serde_json::Error| Error::Damaged { path: path.clone(), what: format!("not a manifest: {error}") };
        // The layout is looked at before anything else: another one may have other fields.
        let value: serde_json::Value = serde_json::from_str(&text).map_err(damaged)?;
        let layout = value.get("layout").and_then(serde_json::Value::as_u64);
        match layout {
            Some(LAYOUT) => serde_json::from_value(value).map_err(damaged),
            Some(found) => Err(Error::OtherLayout { folder: folder.to_owned(), found, expected: LAYOUT }),
            None => Err(Error::Damaged { path, what: "not a manifest: no layout number".into() }),
        }
    }

    /// Replaces the manifest of the study in `folder`.
    ///
    /// # Errors
    /// [`Error::Io`]; the old manifest stays.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(self).map_err(|error| Error::Internal(error.to_string()))?;
        store::write_bytes(&folder.join(FILE), text.as_bytes())
    }
}
