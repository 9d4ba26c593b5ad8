//! `crumple modes`: group the runs, or name the modes that are there.

use std::path::PathBuf;

use clap::Args;
use crumple::descriptor::{self, forget_modes};
use crumple::modes::{self, APART, Choose, Modes as Found};
use crumple::report::early_words;
use crumple::study::Study;
use crumple::{Error, Watch};
use serde_json::{Value, json};

use super::Answer;
use crate::options::ModesArgs;
use crate::output::{Output, some, table, two};

#[derive(Args)]
#[command(
    after_help = "The modes are kept in the study (modes.parquet) until the next call. Names that were given stay with the runs they were given to.\n\nExample:\n  crumple modes study --count 3\n  crumple modes study --name mode-2=up\n  crumple modes study --method hdbscan\n  crumple modes study --states series --align intrusion"
)]
pub(crate) struct Modes {
    /// Folder of the study
    study: PathBuf,
    #[command(flatten)]
    modes: ModesArgs,
    /// Another word for --by, as the other commands have it: rotation or paper
    #[arg(long, value_name = "KIND", conflicts_with = "by")]
    kind: Option<String>,
    /// Give a mode a name, which it keeps; may be given several times. Alone it names the modes that are there, without
    /// grouping anew. Nothing after the = takes the name away
    #[arg(long = "name", value_name = "MODE=NAME")]
    names: Vec<String>,
}

impl Modes {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let mut options = self.modes.options()?;
        if let Some(kind) = &self.kind {
            options.by = kind.parse()?;
        }
        let names: Vec<(&str, &str)> = self.names.iter().map(|text| pair(text)).collect::<Result<_, _>>()?;
        let study = Study::open(&self.study)?;
        let mut found = match modes::load(&study) {
            Ok(found) if !names.is_empty() && self.kind.is_none() && !self.modes.asked() => found,
            _ => modes::modes(&study, &options, watch)?,
        };
        let before: Vec<String> = found.modes.iter().map(|mode| mode.name.clone()).collect();
        for (mode, name) in names {
            found.rename(mode, name)?;
        }
        modes::save(&study, &found)?;
        for (mode, before) in found.modes.iter().zip(&before).filter(|(mode, before)| mode.name != **before) {
            rename_descriptor(&study, before, &mode.name, &mode.medoid)?;
        }
        forget_modes(&study, &found)?;
        early_words(&study).iter().for_each(|words| output.note(words));
        found.notes.iter().for_each(|words| output.note(words));
        output.print(&facts(&found), || words(&found, study.settings()));
        Ok(Answer::Done)
    }
}

fn pair(text: &str) -> Result<(&str, &str), Error> {
    text.split_once('=').ok_or_else(|| Error::Value {
        name: "--name",
        value: text.to_owned(),
        expected: "MODE=NAME, as in mode-1=crush".into(),
    })
}

/// The descriptor that was made for a mode takes its new name.
fn rename_descriptor(study: &Study, before: &str, name: &str, medoid: &str) -> Result<(), Error> {
    let Ok(mut saved) = descriptor::load(study, before) else { return Ok(()) };
    if saved.mode.as_deref() == Some(before) && saved.run == medoid {
        (saved.name, saved.mode) = (name.to_owned(), Some(name.to_owned()));
        descriptor::save(study, &saved)?;
    }
    Ok(())
}

/// What `modes` tells a script.
pub(crate) fn facts(found: &Found) -> Value {
    json!({
        "modes": found.modes, "outliers": found.outliers(), "without_mode": found.without_mode(), "runs": found.runs,
        "tried": found.tried, "partings": found.partings, "notes": found.notes, "names": found.names,
        "count": found.modes.len(), "chosen": !found.given, "choose": found.choose, "by": found.by, "states": found.states,
        "method": found.method, "seed": found.seed,
    })
}

/// The modes as a table, and what is known about them.
pub(crate) fn words(found: &Found, settings: &crumple::study::Settings) -> String {
    let rows = found.modes.iter().map(|mode| {
        let members = some(mode.members.iter().map(String::as_str), 8);
        vec![
            mode.name.clone(),
            mode.members.len().to_string(),
            mode.medoid.clone(),
            format!("{:.2}", mode.silhouette),
            format!("{:.2}", mode.spread),
            members,
        ]
    });
    let unit = found.unit(&settings.length_unit);
    let spread = if unit.is_empty() { "#spread".to_owned() } else { format!("#spread, {unit}") };
    let mut text = table(&["mode", "#runs", "medoid", "#silhouette", &spread, "members"], rows);
    let outside = found.without_mode();
    if !outside.is_empty() {
        text += &format!("\nwithout a mode: {}", some(outside.into_iter(), 20));
    }
    let outliers = found.runs.iter().filter(|run| run.outlier);
    let outliers: Vec<String> =
        outliers.map(|run| format!("{} ({:.1})", run.run, run.score.unwrap_or_default())).collect();
    if !outliers.is_empty() {
        text += &format!("\noutliers, with scores: {}", some(outliers.iter().map(String::as_str), 20));
    }
    text += &evidence_words(found);
    for mode in &found.modes {
        mode.input_words().iter().for_each(|words| text += &format!("\n{}: {words}", mode.name));
    }
    text + &parting_words(found, &settings.time_unit)
}

/// Silhouette and stability of every number that was tried.
fn evidence_words(found: &Found) -> String {
    let with_bic = found.tried.iter().any(|tried| tried.bic.is_some());
    let rows = found.tried.iter().map(|tried| {
        let mut cells = vec![tried.count.to_string(), format!("{:.2}", tried.silhouette), two(tried.stability)];
        cells.extend(tried.bic.filter(|_| with_bic).map(|bic| format!("{bic:.0}")));
        cells
    });
    let mut names = vec!["#modes", "#silhouette", "#stability"];
    names.extend(with_bic.then_some("#BIC"));
    let how = match (found.method.takes_count(), found.given, found.choose) {
        (false, ..) => "as many as there are dense groups",
        (_, true, _) => "number of modes as given",
        (_, _, Choose::Silhouette) => "number of modes chosen by mean silhouette",
        (_, _, Choose::Stability) => "number of modes chosen by stability when runs are left out",
    };
    format!("\n\n{how}\n{}", table(&names, rows))
}

fn parting_words(found: &Found, unit: &str) -> String {
    let words = |parting: &modes::Parting| {
        let [a, b] = &parting.modes;
        match (parting.time, parting.state, parting.evidence.last()) {
            (Some(at), Some(state), _) => {
                let medoid = found.mode(a).map(|mode| mode.medoid.clone()).unwrap_or_default();
                format!("\n{a} and {b} part at {at:.3} {unit} (state {state} of {medoid})")
            }
            (_, _, Some(last)) => {
                format!(
                    "\n{a} and {b} never part: {:.0} % of nearest runs are of the own mode at the end",
                    100.0 * last.apart
                )
            }
            _ => format!("\n{a} and {b}: too few runs to say when they part"),
        }
    };
    let told: String = found.partings.iter().take(28).map(words).collect();
    if told.is_empty() {
        return told;
    }
    format!("\n{told}\n(from then on at least {:.0} % of nearest runs are of the own mode)", 100.0 * APART)
}
