//! `crumple check`: is the study whole.

use std::path::PathBuf;

use clap::Args;
use crumple::{Error, study};
use serde_json::json;

use super::Answer;
use crate::output::Output;

#[derive(Args)]
#[command(after_help = "Exit code: 0 whole, 1 not, 2 no study there.\n\nExample:\n  crumple check study")]
pub(crate) struct Check {
    /// Folder of the study
    study: PathBuf,
}

impl Check {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let checkup = study::check(&self.study)?;
        output.print(&json!(checkup), || {
            let verdict = if checkup.whole { "whole" } else { "NOT whole" };
            let lines = checkup
                .problems
                .iter()
                .map(|problem| format!("\nproblem: {problem}"))
                .chain(checkup.notes.iter().map(|note| format!("\nnote: {note}")));
            format!("{verdict}: {} files, {} runs{}", checkup.files, checkup.runs, lines.collect::<String>())
        });
        Ok(if checkup.whole { Answer::Done } else { Answer::No })
    }
}
