//! A run written as another d3plot family, for `crumple convert`.

use std::path::Path;

use serde::Serialize;

use super::{Run, Source};
use crate::error::io;
use crate::{Error, Watch};

/// How a run is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ConvertOptions {
    /// Words of 8 bytes (`true`) or 4; `None` as in the run.
    pub double: Option<bool>,
    /// The highest byte of a word first.
    pub big_endian: bool,
    /// The most bytes of a file; `None` for the solver's default, or as many as one state needs.
    pub file_bytes: Option<u64>,
    /// The most states of a file; `None` for as many as fit.
    pub file_states: Option<usize>,
    /// Keep also what other programs misread (see [`d3plot::Keep`]).
    pub everything: bool,
}

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Converted {
    /// Whole states.
    pub states: usize,
    /// What was left out.
    pub left_out: Vec<&'static str>,
}

impl Run {
    /// Writes the whole states of the run as a d3plot family with the root `root`; its folder is made where it is missing.
    ///
    /// # Errors
    /// [`Error::Read`] with the reason; [`Error::Stopped`] if `watch` says so, a whole family of fewer states is there then.
    pub fn convert(&self, root: &Path, options: &ConvertOptions, watch: &dyn Watch) -> Result<Converted, Error> {
        let Source::D3plot(family) = &self.source else {
            return Err(Error::NoStates {
                run: self.path.display().to_string(),
                reason: ": it is a keyword deck".into(),
            });
        };
        if let Some(folder) = root.parent() {
            std::fs::create_dir_all(folder).map_err(io("making the folder", folder))?;
        }
        let header = family.header();
        let write = d3plot::WriteOptions {
            title: header.title.clone(),
            precision: match options.double {
                None => header.precision,
                Some(true) => d3plot::Precision::Double,
                Some(false) => d3plot::Precision::Single,
            },
            byte_order: if options.big_endian { d3plot::ByteOrder::Big } else { d3plot::ByteOrder::Little },
            member_bytes: options.file_bytes,
            member_states: options.file_states,
            run_time: header.run_time,
            release: header.release.clone(),
            ..d3plot::WriteOptions::default()
        };
        let keep = if options.everything { d3plot::Keep::Everything } else { d3plot::Keep::WidelyRead };
        let copied = family.copy(root, keep, &write, |states| {
            watch.step("states", states, family.times().len());
            !watch.stopped()
        })?;
        if watch.stopped() {
            return Err(Error::Stopped);
        }
        Ok(Converted { states: copied.states, left_out: copied.left_out })
    }
}
