//! `crumple search`: the most similar runs and states.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::similarity;
use crumple::study::{Loaded, Rows};
use serde_json::json;

use super::Answer;
use crate::options::{SimilarityArgs, rows};
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(after_help = "Example:\n  crumple search study mode-1 --top 10")]
pub(crate) struct Search {
    /// Folder of the study
    study: PathBuf,
    /// What to compare with: a descriptor of the study by name, the path of its file, a mode, or a run
    descriptor: String,
    /// How many results, best first
    #[arg(long, value_name = "N", default_value_t = 20, allow_negative_numbers = true)]
    top: usize,
    /// Which states: the `last` one of each run, or `all` [default: last]
    #[arg(long, value_name = "WHICH")]
    states: Option<String>,
    #[command(flatten)]
    similarity: SimilarityArgs,
}

impl Search {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let (options, rows) = (self.similarity.options()?, rows(self.states.as_deref())?);
        let loaded = Loaded::open(&self.study)?;
        let descriptor = self.similarity.descriptor(&loaded, &self.descriptor)?;
        let mut hits = similarity::search(&loaded, &descriptor, options, rows)?;
        let searched = hits.len();
        hits.truncate(self.top);
        output.print(&json!({ "descriptor": descriptor.name, "kind": options.kind.unwrap_or(descriptor.kind), "searched": searched, "results": hits }), || {
            let cells = hits.iter().zip(1..).map(|(hit, rank)| {
                vec![
                    rank.to_string(),
                    hit.run.clone(),
                    hit.state.to_string(),
                    time(hit.time),
                    format!("{:.6}", hit.score.similarity),
                    format!("{:.6}", hit.score.distance),
                ]
            });
            let what = if rows == Rows::Last { "runs" } else { "states" };
            format!(
                "{}\n{searched} {what} searched",
                table(&["#", "run", "#state", "#time", "#similarity", "#distance"], cells)
            )
        });
        Ok(Answer::Done)
    }
}
