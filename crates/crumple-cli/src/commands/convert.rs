//! `crumple convert`: a run as another d3plot family.

use std::path::PathBuf;

use clap::Args;
use crumple::run::{ConvertOptions, Run};
use crumple::{Error, Watch};
use serde_json::json;

use super::Answer;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "Writes whole states only, with an end mark in every file: a run that was killed, or whose files have gaps, becomes one that other programs read. Nothing is overwritten.\n\nExample:\n  crumple convert examples/hat-section/runs/run_001 -o out/d3plot"
)]
pub(crate) struct Convert {
    /// Root file of a family (d3plot), or its folder
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Root file to write; its members are numbered behind it
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Words of the files: single or double [default: as in the run]
    #[arg(long, value_name = "PRECISION")]
    precision: Option<String>,
    /// Byte order: little or big [default: little]
    #[arg(long, value_name = "ORDER")]
    byte_order: Option<String>,
    /// The most bytes of a file; what is longer runs on into the next, which few programs read [default: the solver's, 7 × 512 × 512 words, or what one state needs]
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u64).range(4096..))]
    file_bytes: Option<u64>,
    /// The most states of a file [default: as many as fit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    file_states: Option<u32>,
    /// Keep also what other programs misread: mass scaling, heat flux, residual forces, contact words, histories of beams, tensors of
    /// plastic and thermal strain, displacements as such, rigid shells without words. What is left out is named
    #[arg(long)]
    everything: bool,
    /// Map the files into memory. Only for files that nothing writes to: if one becomes shorter meanwhile, this program ends
    /// by a signal, where plain reading gives an error
    #[arg(long)]
    map: bool,
}

impl Convert {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let one_of = |name: &'static str, value: &Option<String>, words: [&str; 2]| match value.as_deref() {
            None => Ok(None),
            Some(value) if words.contains(&value) => Ok(Some(value == words[1])),
            Some(other) => {
                Err(Error::Value { name, value: other.into(), expected: format!("{} or {}", words[0], words[1]) })
            }
        };
        let options = ConvertOptions {
            double: one_of("--precision", &self.precision, ["single", "double"])?,
            big_endian: one_of("--byte-order", &self.byte_order, ["little", "big"])?.unwrap_or(false),
            file_bytes: self.file_bytes,
            file_states: self.file_states.map(|states| states as usize),
            everything: self.everything,
        };
        let run = Run::open_mapped("", &self.run, self.map)?;
        for warning in run.warnings() {
            output.note(&warning);
        }
        let converted = run.convert(&self.output, &options, watch)?;
        let written = Run::open("", &self.output)?;
        let facts = json!({ "file": written.path(), "states": converted.states, "files": written.files().len(), "left_out": converted.left_out });
        output.print(&facts, || {
            let left_out = match &converted.left_out[..] {
                [] => String::new(),
                tables => format!("; left out: {}", tables.join(", ")),
            };
            format!(
                "{}: {} states in {} files{left_out}",
                written.path().display(),
                converted.states,
                written.files().len()
            )
        });
        Ok(Answer::Done)
    }
}
