//! `crumple modes`: group the runs.

use std::path::PathBuf;

use clap::Args;
use crumple::descriptor::forget_modes;
use crumple::modes::{self, Modes as Found};
use crumple::report::early_words;
use crumple::study::Study;
use crumple::{Error, Watch};
use serde_json::{Value, json};

use super::Answer;
use crate::options::ModesArgs;
use crate::output::{Output, some, table};

#[derive(Args)]
#[command(
    after_help = "The modes are kept in the study (modes.parquet) until the next call.\n\nExample:\n  crumple modes study --count 3"
)]
pub(crate) struct Modes {
    /// Folder of the study
    study: PathBuf,
    #[command(flatten)]
    modes: ModesArgs,
}

impl Modes {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let options = self.modes.options()?;
        let study = Study::open(&self.study)?;
        let found = modes::modes(&study, &options, watch)?;
        modes::save(&study, &found)?;
        forget_modes(&study, &found)?;
        early_words(&study).iter().for_each(|words| output.note(words));
        output.print(&facts(&found), || words(&found, &study.settings().length_unit));
        Ok(Answer::Done)
    }
}

/// What `modes` tells a script.
pub(crate) fn facts(found: &Found) -> Value {
    json!({
        "modes": found.modes, "outliers": found.outliers(), "runs": found.runs, "tried": found.tried,
        "count": found.modes.len(), "chosen": !found.given, "by": found.by, "method": found.method, "seed": found.seed,
    })
}

/// The modes as a table.
pub(crate) fn words(found: &Found, unit: &str) -> String {
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
    let unit = found.unit(unit);
    let spread = if unit.is_empty() { "#spread".to_owned() } else { format!("#spread, {unit}") };
    let mut text = table(&["mode", "#runs", "medoid", "#silhouette", &spread, "members"], rows);
    let outliers = found.outliers();
    if !outliers.is_empty() {
        text += &format!("\noutliers: {}", outliers.join(" "));
    }
    if !found.given {
        let tried: Vec<String> =
            found.tried.iter().map(|tried| format!("{}: {:.2}", tried.count, tried.silhouette)).collect();
        text += &format!("\nnumber of modes chosen by mean silhouette ({})", tried.join(", "));
    }
    text
}
