//! `crumple classify`: which mode a run belongs to, or none.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::classify::{Classifier, Verdict};
use crumple::modes;
use crumple::study::Loaded;
use crumple::target::{Named, resolve};
use serde::Serialize;
use serde_json::json;

use super::Answer;
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(
    after_help = "A run is refused where it is less like the nearest mode than 98 % of that mode's own runs are. Exit code: 0 all have a mode, 1 some are refused, 2 bad input.\n\nExample:\n  crumple classify study run_042 new/d3plot"
)]
pub(crate) struct Classify {
    /// Folder of the study
    study: PathBuf,
    /// Runs: ids of the study, or paths of new result files, which are not added; @N for a state
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<String>,
    /// By which numbers: `rotation`, the rotation spectrum, or `paper`, all coefficients of the displacement
    /// [default: rotation]
    #[arg(long, value_name = "KIND")]
    kind: Option<String>,
}

impl Classify {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let kind = self.kind.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        let loaded = Loaded::open(&self.study)?;
        let classifier = Classifier::of(&loaded, &modes::load(&loaded.study)?, kind)?;
        let judge = |run: &String| {
            let target = resolve(&loaded, &Named::in_study(&loaded.study, run))?;
            let verdict = classifier.classify(&target)?;
            Ok(Judged { run: target.run, state: target.state, time: target.time, verdict, warnings: target.warnings })
        };
        let results: Vec<Judged> = self.runs.iter().map(judge).collect::<Result<_, Error>>()?;
        for judged in &results {
            output.notes_on(&judged.run, &judged.warnings);
        }
        let evidence = classifier.evidence;
        output.print(&json!({ "kind": kind, "results": results, "evidence": evidence }), || {
            let cells = results.iter().map(|judged| {
                let verdict = &judged.verdict;
                vec![
                    judged.run.clone(),
                    time(judged.time),
                    verdict.mode.clone().unwrap_or_else(|| "none".into()),
                    format!("{:.3}", verdict.score),
                    // A mode of one run says nothing of how far its members lie apart.
                    if verdict.accepted.is_finite() { format!("{:.3}", verdict.accepted) } else { "any".into() },
                    verdict.margin.map_or_else(|| "–".into(), |margin| format!("{margin:.3}")),
                    match &verdict.mode {
                        Some(_) => format!("most like {} ({:.3})", verdict.like.0, verdict.like.1),
                        None => {
                            format!("nearest is {}, by {} ({:.3})", verdict.nearest, verdict.like.0, verdict.like.1)
                        }
                    },
                ]
            });
            format!(
                "{}\nof the {} runs known, each left out in turn, {} would get another mode and {} none",
                table(&["run", "#time", "mode", "#score", "#needed", "#margin", "why"], cells),
                evidence.runs,
                evidence.wrong,
                evidence.refused
            )
        });
        Ok(if results.iter().all(|judged| judged.verdict.mode.is_some()) { Answer::Done } else { Answer::No })
    }
}

/// A run and what was found.
#[derive(Serialize)]
struct Judged {
    run: String,
    state: usize,
    time: f64,
    #[serde(flatten)]
    verdict: Verdict,
    warnings: Vec<String>,
}
