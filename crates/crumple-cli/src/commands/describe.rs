//! `crumple describe`: build and save a descriptor.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::descriptor::{self, Descriptor};
use crumple::modes;
use crumple::study::Loaded;
use crumple::target::Named;
use serde_json::{Value, json};

use super::Answer;
use crate::options::DescribeArgs;
use crate::output::{Output, percent, table, time};

#[derive(Args)]
#[command(
    after_help = "Example:\n  crumple describe study run_007 --name crush\n  crumple describe study --mode mode-1 --threshold error:5"
)]
pub(crate) struct Describe {
    /// Folder of the study
    study: PathBuf,
    /// Run to describe, by id or path; @N for a state of it, counted from 0 [default state: the last]
    #[arg(value_name = "RUN[@STATE]", required_unless_present = "mode", conflicts_with = "mode")]
    run: Option<String>,
    /// Describe the medoid of this mode
    #[arg(long, value_name = "NAME")]
    mode: Option<String>,
    /// Name to save it under [default: the run or the mode]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    #[command(flatten)]
    describe: DescribeArgs,
}

impl Describe {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let options = self.describe.options()?;
        let loaded = Loaded::open(&self.study)?;
        let named = match (&self.run, &self.mode) {
            (_, Some(mode)) => Named { run: modes::load(&loaded.study)?.mode(mode)?.medoid.clone(), state: None },
            (run, None) => Named::in_study(&loaded.study, run.as_deref().unwrap_or_default()),
        };
        let name = self.name.as_deref().or(self.mode.as_deref());
        let described = descriptor::describe(&loaded, &named, self.mode.as_deref(), name, &options)?;
        let path = descriptor::save(&loaded.study, &described.descriptor)?;
        let mut facts = facts(&described.descriptor);
        facts["path"] = json!(path);
        output.print(&facts, || words(&described.descriptor, &loaded.study.settings().length_unit));
        Ok(Answer::Done)
    }
}

/// What `describe` tells a script.
pub(crate) fn facts(descriptor: &Descriptor) -> Value {
    json!({
        "descriptor": descriptor.name,
        "run": descriptor.run,
        "state": descriptor.state,
        "time": descriptor.time,
        "mode": descriptor.mode,
        "select": descriptor.select,
        "eigenvectors": descriptor.eigenvectors,
        "size": descriptor.eigenvectors.len(),
        "numbers": 3 * descriptor.eigenvectors.len(),
        "threshold": { "rule": descriptor.rule, "value": descriptor.threshold },
        "errors": descriptor.errors,
        "rivals": descriptor.rivals,
        "split_clusters": descriptor.split_clusters,
    })
}

fn words(descriptor: &Descriptor, unit: &str) -> String {
    let m = descriptor.eigenvectors.len();
    let mut text = format!(
        "descriptor '{}' of {} at time {}: M = {m} eigenvectors, {} numbers ({} above t = {:.4} {unit}², rule {})\neigenvectors {}\n",
        descriptor.name,
        descriptor.run,
        time(descriptor.time),
        3 * m,
        descriptor.select.word(),
        descriptor.threshold,
        descriptor.rule,
        descriptor.eigenvectors.iter().map(usize::to_string).collect::<Vec<_>>().join(" ")
    );
    let row = |method: &str, size: usize, errors: &crumple::reconstruct::Errors| {
        vec![
            method.to_owned(),
            size.to_string(),
            format!("{:.2}", errors.rms),
            format!("{:.1}", errors.max),
            percent(errors.relative),
        ]
    };
    let rivals = descriptor.rivals.iter().map(|rival| row(&rival.method, rival.size, &rival.errors));
    text += &table(
        &["reconstruction", "#size", &format!("#RMS error, {unit}"), &format!("#largest, {unit}"), "#of displacement"],
        std::iter::once(row("descriptor", m, &descriptor.errors)).chain(rivals),
    );
    if !descriptor.split_clusters.is_empty() {
        let ranges: Vec<String> =
            descriptor.split_clusters.iter().map(|(first, last)| format!("{first}–{last}")).collect();
        text += &format!(
            "\nnote: eigenvectors {} have nearly equal eigenvalues and are kept in part; the choice among them depends on small changes of the mesh",
            ranges.join(", ")
        );
    }
    text
}
