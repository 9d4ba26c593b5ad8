//! `crumple verify`: pass or fail per run.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::calibrate::{Known, calibrate};
use crumple::descriptor::{self, Calibration, Descriptor};
use crumple::inputs::Table;
use crumple::modes;
use crumple::similarity::{Comparer, Score, SimilarityOptions};
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
    after_help = "Exit code: 0 all pass, 1 some fail, 2 bad input.\n\nExample:\n  crumple verify study mode-1 --calibrate\n  crumple verify study mode-1 run_003 run_042\n  crumple verify study mode-1 new/d3plot --threshold 0.9"
)]
pub(crate) struct Verify {
    /// Folder of the study
    study: PathBuf,
    /// What to compare with: a descriptor of the study by name, the path of its file, a mode, or a run
    descriptor: String,
    /// Runs: ids of the study, or paths of new result files, which are not added; @N for a state
    #[arg(required_unless_present = "calibrate", value_name = "RUN")]
    runs: Vec<String>,
    /// Smallest similarity that passes, -1 to 1, under the same options as `crumple search` [default: the calibrated
    /// one, else 0.9]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    threshold: Option<f64>,
    /// First find the threshold that separates the runs of the descriptor's mode from the others, with its error rates
    /// by cross-validation, and save it with the descriptor
    #[arg(long)]
    calibrate: bool,
    /// Calibrate by this table (CSV) of labels, column `label`, not by the modes
    #[arg(long, value_name = "CSV", requires = "calibrate")]
    labels: Option<PathBuf>,
    /// The label that the descriptor stands for [default: that of the run it was made from]
    #[arg(long, value_name = "LABEL", requires = "labels")]
    label: Option<String>,
    #[command(flatten)]
    similarity: SimilarityArgs,
}

impl Verify {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        if let Some(threshold) = self.threshold.filter(|threshold| !(-1.0..=1.0).contains(threshold)) {
            return Err(Error::Value {
                name: "--threshold",
                value: threshold.to_string(),
                expected: "a similarity from -1 to 1".into(),
            });
        }
        let options = self.similarity.options()?;
        let loaded = Loaded::open(&self.study)?;
        let mut descriptor = self.similarity.descriptor(&loaded, &self.descriptor)?;
        if self.calibrate {
            let found = self.calibrated(&loaded, &descriptor, options)?;
            descriptor.calibration = Some(found);
            if descriptor::list(&loaded.study)?.contains(&descriptor.name) {
                descriptor::save(&loaded.study, &descriptor)?;
            } else {
                output.note("the descriptor is not saved in the study, so neither is its calibration");
            }
        }
        let comparer = Comparer::new(&loaded, &descriptor, options)?;
        // A calibration is for the numbers and the measure that it was made with.
        let plain = SimilarityOptions { kind: options.kind, ..Default::default() };
        let kind = options.kind_for(&descriptor);
        let calibration = descriptor.calibration.as_ref().filter(|found| found.kind == kind && options == plain);
        let threshold = self.threshold.or(calibration.map(|found| found.threshold)).unwrap_or(0.9);
        let known = match calibration {
            Some(found) => Some((found.known, Known::of(&loaded, &comparer)?)),
            None => None,
        };
        let judge = |run: &String| {
            let target = resolve(&loaded, &Named::in_study(&loaded.study, run))?;
            let score = comparer.score_target(&target)?;
            let warnings = target.caveats(descriptor.time);
            let pass = score.similarity >= threshold;
            let known = match &known {
                Some((limit, known)) => Some(known.nearest(&target)? >= *limit),
                None => None,
            };
            Ok(Judged { run: target.run, state: target.state, time: target.time, score, pass, known, warnings })
        };
        let results: Vec<Judged> = self.runs.iter().map(judge).collect::<Result<_, Error>>()?;
        for judged in &results {
            output.notes_on(&judged.run, &judged.warnings);
        }
        let facts = json!({
            "descriptor": descriptor.name, "kind": kind, "threshold": threshold, "calibrated": calibration.is_some(),
            "calibration": descriptor.calibration, "results": results,
        });
        output.print(&facts, || words(&descriptor, self.calibrate, threshold, &results));
        Ok(if results.iter().all(|judged| judged.pass) { Answer::Done } else { Answer::No })
    }

    fn calibrated(
        &self,
        loaded: &Loaded,
        descriptor: &Descriptor,
        options: SimilarityOptions,
    ) -> Result<Calibration, Error> {
        let Some(path) = &self.labels else {
            let modes = modes::load(&loaded.study)?;
            let own = match &descriptor.mode {
                Some(mode) => modes.mode(mode)?,
                None => modes.modes.iter().find(|mode| mode.members.contains(&descriptor.run)).ok_or_else(|| {
                    Error::UnknownMode {
                        asked: format!("of {}", descriptor.run),
                        available: "none that holds it".into(),
                    }
                })?,
            };
            return calibrate(loaded, descriptor, options, |run| Some(own.members.iter().any(|member| member == run)));
        };
        let table = Table::read(path)?;
        let labels = table.values_of("label", loaded.study.manifest().runs.keys().map(String::as_str))?;
        let own = self.label.clone().or_else(|| labels.get(&descriptor.run).cloned()).ok_or_else(|| Error::Value {
            name: "--label",
            value: "none".into(),
            expected: format!("a label: {} has none in {}", descriptor.run, path.display()),
        })?;
        if !labels.values().any(|label| *label == own) {
            return Err(Error::Value {
                name: "--label",
                value: own,
                expected: format!("a label of {}", path.display()),
            });
        }
        calibrate(loaded, descriptor, options, |run| labels.get(run).map(|label| *label == own))
    }
}

fn words(descriptor: &Descriptor, calibrated: bool, threshold: f64, results: &[Judged]) -> String {
    let mut text = String::new();
    if let (true, Some(found)) = (calibrated, &descriptor.calibration) {
        text += &format!(
            "threshold {:.4} separates {} runs that do from {} that do not; on runs that it was not chosen by ({} folds) {:.1} % of those that do would fail and {:.1} % of the others pass\nunlike anything known: less than {:.4} like every run of the study\n",
            found.threshold,
            found.right,
            found.wrong,
            found.folds,
            100.0 * found.false_fail,
            100.0 * found.false_pass,
            found.known
        );
    }
    if results.is_empty() {
        return text;
    }
    let cells = results.iter().map(|judged| {
        let verdict = match (judged.pass, judged.known) {
            (true, Some(false)) => "pass, but unlike anything known",
            (true, _) => "pass",
            (false, Some(false)) => "FAIL, unlike anything known",
            (false, _) => "FAIL",
        };
        vec![
            judged.run.clone(),
            judged.state.to_string(),
            time(judged.time),
            format!("{:.6}", judged.score.similarity),
            verdict.to_owned(),
        ]
    });
    text + &format!(
        "{}\npasses from {threshold:.4} on",
        table(&["run", "#state", "#time", "#similarity", "verdict"], cells)
    )
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
    /// Whether it is like any run of the study; null without a calibration.
    known: Option<bool>,
    warnings: Vec<String>,
}
