//! `crumple compare`: the descriptor against its rivals.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::compare::{Comparison, compare};
use crumple::inputs::Table;
use crumple::study::Loaded;
use serde_json::json;

use super::Answer;
use crate::output::{Output, percent, table, two};

#[derive(Args)]
#[command(
    after_help = "A table of labels has the run in its first column and a column `label`; a column `clear` (true, false) says which runs may stand for their label. The query of a label is the medoid of its clear runs; runs of other labels count as wrong.\n\nExample:\n  crumple compare study --labels examples/hat-section/labels.csv"
)]
pub(crate) struct Compare {
    /// Folder of the study
    study: PathBuf,
    /// Table (CSV) of labels to judge rankings and modes by; nothing is computed from it but the judgement
    #[arg(long, value_name = "CSV")]
    labels: Option<PathBuf>,
    /// Threshold of the descriptors, as in `describe` [default: std:1]
    #[arg(long, value_name = "RULE")]
    threshold: Option<String>,
}

impl Compare {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let threshold = self.threshold.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        let loaded = Loaded::open(&self.study)?;
        let labels = self.labels.as_deref().map(Table::read).transpose()?;
        let comparison = compare(&loaded, labels.as_ref(), threshold)?;
        comparison.notes.iter().for_each(|note| output.note(note));
        output.print(&json!(comparison), || words(&comparison, &loaded.study.settings().length_unit));
        Ok(Answer::Done)
    }
}

fn words(comparison: &Comparison, unit: &str) -> String {
    let rows = comparison.rows.iter().chain(&comparison.rotation).map(|row| {
        vec![
            row.label.clone(),
            row.query.clone(),
            row.select.to_owned(),
            row.method.clone(),
            row.size.to_string(),
            two(row.rms),
            row.max.map_or_else(|| "–".into(), |max| format!("{max:.1}")),
            percent(row.relative),
            two(row.precision_at_9),
            row.average_precision.map_or_else(|| "–".into(), |ap| format!("{ap:.3}")),
            row.mean_average_precision.map_or_else(|| "–".into(), |ap| format!("{ap:.3}")),
        ]
    });
    let rms = format!("#RMS, {unit}");
    let max = format!("#max, {unit}");
    let mut text =
        table(&["label", "query", "select", "method", "#M", &rms, &max, "#of displ.", "#P@9", "#AP", "#mean AP"], rows);
    if !comparison.modes.is_empty() {
        let rows = comparison.modes.iter().map(|modes| {
            let method = format!("{:?}", modes.method).to_lowercase();
            vec![
                format!("{:?}", modes.by).to_lowercase(),
                method,
                modes.count.to_string(),
                if modes.chosen { "chosen" } else { "given" }.into(),
                modes.without.to_string(),
                format!("{:.2}", modes.silhouette),
                format!("{:.2}", modes.ari),
                format!("{:.2}", modes.ari_all),
            ]
        });
        text += "\n\nmodes found without labels, against them (adjusted Rand index)\n";
        text +=
            &table(&["by", "method", "#modes", "number", "#no mode", "#silhouette", "#ARI", "#ARI, all labels"], rows);
    }
    text
}
