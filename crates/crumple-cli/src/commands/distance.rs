//! `crumple distance`: one number, for an optimiser.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::similarity::Comparer;
use crumple::study::Loaded;
use crumple::target::{Named, resolve};
use serde_json::json;

use super::Answer;
use crate::options::SimilarityArgs;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "Prints the number and nothing else: 1 − similarity, or RMS length with --metric euclidean.\n\nExample:\n  crumple distance study mode-1 new/d3plot"
)]
pub(crate) struct Distance {
    /// Folder of the study
    study: PathBuf,
    /// What to compare with: a descriptor of the study by name, the path of its file, a mode, or a run
    descriptor: String,
    /// Run: an id of the study, or the path of a new result file, which is not added; @N for a state
    #[arg(value_name = "RUN[@STATE]")]
    run: String,
    #[command(flatten)]
    similarity: SimilarityArgs,
}

impl Distance {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let options = self.similarity.options()?;
        let loaded = Loaded::open(&self.study)?;
        let descriptor = self.similarity.descriptor(&loaded, &self.descriptor)?;
        let comparer = Comparer::new(&loaded, &descriptor, options)?;
        let target = resolve(&loaded, &Named::in_study(&loaded.study, &self.run))?;
        let score = comparer.score_target(&target)?;
        let warnings = target.caveats(descriptor.time);
        output.notes_on(&target.run, &warnings);
        let facts = json!({ "descriptor": descriptor.name, "kind": options.kind_for(&descriptor), "run": target.run, "state": target.state, "time": target.time, "distance": score.distance, "similarity": score.similarity, "warnings": warnings });
        output.print(&facts, || score.distance.to_string());
        Ok(Answer::Done)
    }
}
