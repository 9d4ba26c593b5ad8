//! `crumple export`: arrays and tables.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::descriptor;
use crumple::export::{ExportOptions, Format, export};
use crumple::study::Loaded;
use serde_json::json;

use super::Answer;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "Writes eigenvalues, eigenvectors, mass, baseline, vertices, triangles, node_ids and coefficients as .npy, and the tables coefficients, runs and modes as CSV or Parquet.\n\nExample:\n  crumple export study -o exported --descriptor mode-1 --last"
)]
pub(crate) struct Export {
    /// Folder of the study
    study: PathBuf,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Format of the tables: csv or parquet [default: csv]
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    /// Only the coefficients of this descriptor
    #[arg(long, value_name = "DESCRIPTOR")]
    descriptor: Option<String>,
    /// Only the last state of each run
    #[arg(long)]
    last: bool,
}

impl Export {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let format = match self.format.as_deref() {
            None | Some("csv") => Format::Csv,
            Some("parquet") => Format::Parquet,
            Some(other) => {
                return Err(Error::Value { name: "--format", value: other.into(), expected: "csv or parquet".into() });
            }
        };
        let loaded = Loaded::open(&self.study)?;
        let descriptor = self.descriptor.as_deref().map(|name| descriptor::load(&loaded.study, name)).transpose()?;
        let files =
            export(&loaded, &self.output, &ExportOptions { format, descriptor: descriptor.as_ref(), last: self.last })?;
        output.print(&json!({ "files": files }), || {
            files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join("\n")
        });
        Ok(Answer::Done)
    }
}
