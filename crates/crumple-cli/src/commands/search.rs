//! `crumple search`: the most similar runs and states.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::descriptor::Descriptor;
use crumple::explain::explain;
use crumple::similarity::{self, Found, Hit};
use crumple::study::{Loaded, Rows};
use crumple::target::{Named, resolve};
use crumple::transfer::transfer;
use serde_json::json;

use super::Answer;
use crate::options::{SimilarityArgs, rows};
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(
    after_help = "Example:\n  crumple search study mode-1 --top 10\n  crumple search study run_007 --why --top 3"
)]
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
    /// Study that the descriptor is from, when it is another: the same part on another mesh, or another part, of which
    /// only the kind of deformation is compared (kind rotation)
    #[arg(long, value_name = "STUDY", conflicts_with_all = ["kind", "eigenvectors"])]
    from: Option<PathBuf>,
    /// Say of each result what makes it alike (kind rotation)
    #[arg(long, conflicts_with = "from")]
    why: bool,
    #[command(flatten)]
    similarity: SimilarityArgs,
}

impl Search {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let (options, rows) = (self.similarity.options()?, rows(self.states.as_deref())?);
        let loaded = Loaded::open(&self.study)?;
        let descriptor = self.wanted(&loaded, output)?;
        let Found { hits, searched } = similarity::search_best(&loaded, &descriptor, options, rows, self.top)?;
        let why = self.reasons(&loaded, &descriptor, &hits)?;
        output.print(&json!({ "descriptor": descriptor.name, "kind": options.kind_for(&descriptor), "searched": searched, "results": hits, "why": why }), || {
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
                table(&["#", "run", "#state", "#time", "#similarity", "#distance"], cells),
            ) + &why.iter().map(|(run, words)| format!("\n{run}: {}", words.join("; "))).collect::<String>()
        });
        Ok(Answer::Done)
    }

    /// The descriptor, carried over where it is of another study.
    fn wanted(&self, loaded: &Loaded, output: &Output) -> Result<Descriptor, Error> {
        let Some(folder) = &self.from else { return self.similarity.descriptor(loaded, &self.descriptor) };
        let from = Loaded::open(folder)?;
        let found = self.similarity.descriptor(&from, &self.descriptor)?;
        let (carried, direction) = transfer(&from, loaded, &found)?;
        if !direction {
            output.note(
                "the two parts do not lie on each other: only the kind of deformation is compared, not its direction",
            );
        }
        Ok(carried)
    }

    /// What makes each result alike, in words.
    fn reasons(&self, loaded: &Loaded, wanted: &Descriptor, hits: &[Hit]) -> Result<Vec<(String, Vec<String>)>, Error> {
        if !self.why {
            return Ok(Vec::new());
        }
        let unit = &loaded.study.settings().length_unit;
        let target = resolve(loaded, &Named { run: wanted.run.clone(), state: Some(wanted.state) })?;
        let reason = |hit: &Hit| {
            let other = resolve(loaded, &Named { run: hit.run.clone(), state: Some(hit.state as usize) })?;
            Ok((hit.run.clone(), explain(&loaded.basis, &target, &other, unit).words))
        };
        hits.iter().map(reason).collect()
    }
}
