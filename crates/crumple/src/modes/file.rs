//! Modes on disk: `modes.parquet`, one row a run, with everything else in its metadata.

use super::{Membership, Modes};
use crate::Error;
use crate::study::{Column, Study, metadata_of, write_columns};

const FILE: &str = "modes.parquet";
const KEY: &str = "crumple.modes";

/// Writes the modes into their study, in place of those that are there.
///
/// # Errors
/// [`Error::Io`].
pub fn save(study: &Study, modes: &Modes) -> Result<(), Error> {
    let whole = serde_json::to_string(modes).map_err(|error| Error::Internal(error.to_string()))?;
    let _writing = study.writing()?;
    write_columns(&study.folder().join(FILE), &columns(modes), Some((KEY, whole)))
}

/// The membership of each run as a table; a run without a mode has empty cells.
pub(crate) fn columns(modes: &Modes) -> Vec<(String, Column)> {
    let medoid = |run: &str| modes.modes.iter().any(|mode| mode.medoid == run);
    let number = |of: &dyn Fn(&Membership) -> Option<f64>| Column::Number(modes.runs.iter().map(of).collect());
    vec![
        ("run".to_owned(), Column::Text(modes.runs.iter().map(|run| Some(run.run.clone())).collect())),
        ("mode".to_owned(), Column::Text(modes.runs.iter().map(|run| run.mode.clone()).collect())),
        ("medoid".to_owned(), Column::Flag(modes.runs.iter().map(|run| medoid(&run.run)).collect())),
        ("distance".to_owned(), number(&|run| run.distance)),
        ("silhouette".to_owned(), number(&|run| run.silhouette)),
        ("strength".to_owned(), number(&|run| run.strength)),
        ("score".to_owned(), number(&|run| run.score)),
        ("outlier".to_owned(), Column::Flag(modes.runs.iter().map(|run| run.outlier).collect())),
    ]
}

/// Reads the modes of a study.
///
/// # Errors
/// [`Error::NoModes`], [`Error::Damaged`].
pub fn load(study: &Study) -> Result<Modes, Error> {
    let path = study.folder().join(FILE);
    if !path.exists() {
        return Err(Error::NoModes);
    }
    let text = metadata_of(&path, KEY)?;
    serde_json::from_str(&text).map_err(|error| Error::Damaged { path, what: format!("not a table of modes: {error}") })
}
