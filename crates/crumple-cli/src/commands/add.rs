//! `crumple add`: project runs and add them to a study.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use crumple::bundle;
use crumple::project::Spent;
use crumple::study::{AddOptions, Added, Study};
use crumple::{Error, Watch};
use serde_json::{Value, json};

use super::Answer;
use crate::options::AddArgs;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "Safe to repeat, to interrupt, and to run several at once on one study.\n\nExample, in the repository:\n  crumple add study examples/hat-section/runs"
)]
pub(crate) struct Add {
    /// Folder of the study
    study: PathBuf,
    /// Root files, run folders, or folders with runs below them
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    #[command(flatten)]
    add: AddArgs,
}

impl Add {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let mut study = Study::open(&self.study)?;
        let table = self.add.table()?;
        let found = bundle::find(&self.runs)?;
        let options = AddOptions { replace: self.add.replace, skip_bad: self.add.skip_bad, params: table.as_ref() };
        let added = study.add(&found, options, watch)?;
        tell(&study, &added, output);
        output.print(&facts(&study, &added), || {
            format!(
                "{} added, {} replaced, {} unchanged, {} left out; {} runs in the study{}",
                added.added.len(),
                added.replaced.len(),
                added.unchanged.len(),
                added.skipped.len(),
                study.manifest().runs.len(),
                spent_words(&added.spent)
            )
        });
        Ok(Answer::Done)
    }
}

/// Where the time of all threads went.
fn spent_words(spent: &Spent) -> String {
    if *spent == Spent::default() {
        return String::new();
    }
    let parts = [
        ("reading", spent.reading),
        ("displacements", spent.displacement),
        ("rotations", spent.rotation),
        ("fields", spent.fields),
    ];
    let seconds = parts.iter().filter(|(_, time)| !time.is_zero());
    let seconds: Vec<String> = seconds.map(|(name, time)| format!("{name} {:.2} s", time.as_secs_f64())).collect();
    format!("\ntime of all threads: {}", seconds.join(", "))
}

/// What `add` tells a script.
pub(crate) fn facts(study: &Study, added: &Added) -> Value {
    let skipped: Vec<Value> =
        added.skipped.iter().map(|(run, reason)| json!({ "run": run, "reason": reason })).collect();
    let spent = added.spent;
    json!({
        "seconds": {
            "reading": spent.reading.as_secs_f64(), "displacement": spent.displacement.as_secs_f64(),
            "rotation": spent.rotation.as_secs_f64(), "fields": spent.fields.as_secs_f64(),
        },
        "added": added.added, "replaced": added.replaced, "unchanged": added.unchanged, "skipped": skipped, "notes": added.notes,
        "runs": study.manifest().runs.len(), "warnings": warnings(study, added).into_iter().map(|(run, warning)| json!({ "run": run, "warning": warning })).collect::<Vec<_>>(),
    })
}

/// Notes and warnings, for the person; the same warning of many runs in one line.
pub(crate) fn tell(study: &Study, added: &Added, output: &Output) {
    added.notes.iter().for_each(|note| output.note(note));
    for (run, reason) in &added.skipped {
        output.note(&format!("{run} left out: {reason}"));
    }
    // What happened to most runs is one line, not one a run.
    let mut runs_of: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (run, warning) in warnings(study, added) {
        runs_of.entry(without_numbers(warning)).or_default().push(run);
    }
    for (run, warning) in warnings(study, added) {
        match runs_of.get_mut(&without_numbers(warning)).map(std::mem::take).as_deref() {
            None | Some([]) => {}
            Some([_]) => output.note(&format!("{run}: {warning}")),
            Some(runs) => output.note(&format!("{} runs have a note like that of {run}: {warning}", runs.len())),
        }
    }
}

fn without_numbers(warning: &str) -> String {
    warning.chars().filter(|c| !c.is_ascii_digit()).collect()
}

fn warnings<'a>(study: &'a Study, added: &Added) -> Vec<(&'a str, &'a str)> {
    let new = |id: &String| added.added.contains(id) || added.replaced.contains(id);
    study
        .manifest()
        .runs
        .iter()
        .filter(|(id, _)| new(id))
        .flat_map(|(id, run)| run.warnings.iter().map(move |warning| (id.as_str(), warning.as_str())))
        .collect()
}
