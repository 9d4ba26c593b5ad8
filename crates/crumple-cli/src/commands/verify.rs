//! `crumple verify`: pass or fail per run.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::descriptor;
use crumple::similarity::Comparer;
use crumple::study::Loaded;
use crumple::target::{Named, resolve};
use serde_json::json;

use super::Answer;
use crate::options::SimilarityArgs;
use crate::output::{Output, table};

#[derive(Args)]
#[command(
    about = "Does each run deform as the descriptor says? Exit code 1 if one does not",
    after_help = "Exit code: 0 all pass, 1 some fail, 2 bad input.\n\nExample:\n  crumple verify study mode-1 run_003 run_042 --threshold 0.92\n  crumple verify study mode-1 new/d3plot --threshold 0.92"
)]
pub(crate) struct Verify {
    /// Folder of the study
    study: PathBuf,
    /// Name of a descriptor of the study, or the path of its file
    descriptor: String,
    /// Runs: ids of the study, or paths of new result files, which are not added; @N for a state
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<String>,
    /// Smallest similarity that passes, -1 to 1. Take it from `crumple search`: between the worst run you like and the
    /// best you do not
    #[arg(long, value_name = "S", default_value_t = 0.9, allow_negative_numbers = true)]
    threshold: f64,
    #[command(flatten)]
    similarity: SimilarityArgs,
}

impl Verify {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        if !(-1.0..=1.0).contains(&self.threshold) {
            return Err(Error::Value {
                name: "--threshold",
                value: self.threshold.to_string(),
                expected: "a similarity from -1 to 1".into(),
            });
        }
        let options = self.similarity.options()?;
        let loaded = Loaded::open(&self.study)?;
        let descriptor = descriptor::load(&loaded.study, &self.descriptor)?;
        let comparer = Comparer::new(&loaded, &descriptor, options)?;
        let judge = |run: &String| {
            let target = resolve(&loaded, &Named::in_study(&loaded.study, run))?;
            Ok((target.run.clone(), target.state, comparer.score(&target.on(comparer.eigenvectors())).similarity))
        };
        let judged: Vec<(String, usize, f64)> = self.runs.iter().map(judge).collect::<Result<_, Error>>()?;
        let passes = |similarity: f64| similarity >= self.threshold;
        let results: Vec<_> = judged.iter().map(|(run, state, similarity)| json!({ "run": run, "state": state, "similarity": similarity, "pass": passes(*similarity) })).collect();
        output.print(
            &json!({ "descriptor": descriptor.name, "threshold": self.threshold, "results": results }),
            || {
                let cells = judged.iter().map(|(run, state, similarity)| {
                    vec![
                        run.clone(),
                        state.to_string(),
                        format!("{similarity:.4}"),
                        if passes(*similarity) { "pass" } else { "FAIL" }.to_owned(),
                    ]
                });
                table(&["run", "#state", "#similarity", "verdict"], cells)
            },
        );
        Ok(if judged.iter().all(|(_, _, similarity)| passes(*similarity)) { Answer::Done } else { Answer::No })
    }
}
