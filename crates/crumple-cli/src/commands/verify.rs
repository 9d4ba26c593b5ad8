//! `crumple verify`: pass or fail per run.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::similarity::{Comparer, Score};
use crumple::study::Loaded;
use crumple::target::{Named, resolve};
use serde::Serialize;
use serde_json::json;

use super::Answer;
use crate::options::SimilarityArgs;
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(
    about = "Does each run deform as the descriptor says? Exit code 1 if one does not",
    after_help = "Exit code: 0 all pass, 1 some fail, 2 bad input.\n\nExample:\n  crumple verify study mode-1 run_003 run_042 --threshold 0.97\n  crumple verify study mode-1 new/d3plot --threshold 0.97"
)]
pub(crate) struct Verify {
    /// Folder of the study
    study: PathBuf,
    /// What to compare with: a descriptor of the study by name, the path of its file, a mode, or a run
    descriptor: String,
    /// Runs: ids of the study, or paths of new result files, which are not added; @N for a state
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<String>,
    /// Smallest similarity that passes, -1 to 1, under the same options as `crumple search`. Take it from
    /// there: between the worst run you like and the
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
        let descriptor = self.similarity.descriptor(&loaded, &self.descriptor)?;
        let comparer = Comparer::new(&loaded, &descriptor, options)?;
        let judge = |run: &String| {
            let target = resolve(&loaded, &Named::in_study(&loaded.study, run))?;
            let score = comparer.score_target(&target)?;
            let warnings = target.caveats(descriptor.time);
            let pass = score.similarity >= self.threshold;
            Ok(Judged { run: target.run, state: target.state, time: target.time, score, pass, warnings })
        };
        let results: Vec<Judged> = self.runs.iter().map(judge).collect::<Result<_, Error>>()?;
        for judged in &results {
            judged.warnings.iter().for_each(|warning| output.note(&format!("{}: {warning}", judged.run)));
        }
        let all = results.iter().all(|judged| judged.pass);
        output.print(
            &json!({ "descriptor": descriptor.name, "kind": options.kind.unwrap_or(descriptor.kind), "threshold": self.threshold, "results": results }),
            || {
                let cells = results.iter().map(|judged| {
                    let verdict = if judged.pass { "pass" } else { "FAIL" };
                    vec![
                        judged.run.clone(),
                        judged.state.to_string(),
                        time(judged.time),
                        format!("{:.6}", judged.score.similarity),
                        verdict.to_owned(),
                    ]
                });
                table(&["run", "#state", "#time", "#similarity", "verdict"], cells)
            },
        );
        Ok(if all { Answer::Done } else { Answer::No })
    }
}

/// A run and the verdict on it.
#[derive(Serialize)]
struct Judged {
    run: String,
    state: usize,
    time: f64,
    #[serde(flatten)]
    score: Score,
    pass: bool,
    warnings: Vec<String>,
}
