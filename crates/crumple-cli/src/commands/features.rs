//! `crumple features`: a table for optimisers and meta-models.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::feature_table::{FeatureMaker, FeatureTable};
use crumple::study::Loaded;
use crumple::target::{Named, resolve};
use serde_json::{Value, json};

use super::Answer;
use crate::options::{SimilarityArgs, rows};
use crate::output::Output;

#[derive(Args)]
#[command(
    about = "The numbers that are compared, one row a run, for optimisers and meta-models",
    after_help = "Columns: run, state, time; similarity and distance where a descriptor is given; the numbers, whose names depend on the study and the descriptor and on nothing else; the inputs.\n\nExample:\n  crumple features study mode-1 -o features.csv\n  crumple features study mode-1 new/d3plot"
)]
pub(crate) struct Features {
    /// Folder of the study
    study: PathBuf,
    /// What to compare with: a descriptor of the study by name, the path of its file, a mode, or a run [default: none,
    /// only the rotation spectrum of each run]
    descriptor: Option<String>,
    /// Only this run: an id of the study, or the path of a new result file, which is not added; @N for a state
    #[arg(value_name = "RUN[@STATE]", conflicts_with = "states")]
    run: Option<String>,
    /// Which states of the study's runs: last or all [default: last]
    #[arg(long, value_name = "WHICH")]
    states: Option<String>,
    /// File to write: .csv or .parquet [default: CSV to standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    similarity: SimilarityArgs,
}

impl Features {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let which = rows(self.states.as_deref())?;
        let options = self.similarity.options()?;
        if let Some(path) = &self.output {
            let known = ["csv", "parquet"];
            let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
            if !extension.is_some_and(|extension| known.contains(&extension.as_str())) {
                return Err(Error::Value {
                    name: "--output",
                    value: path.display().to_string(),
                    expected: "a file whose name ends in .csv or .parquet".into(),
                });
            }
        }
        let loaded = Loaded::open(&self.study)?;
        let descriptor =
            self.descriptor.as_deref().map(|word| self.similarity.descriptor(&loaded, word)).transpose()?;
        let maker = FeatureMaker::new(&loaded, descriptor.as_ref(), options)?;
        let table = match &self.run {
            None => maker.study(which)?,
            Some(run) => {
                let target = resolve(&loaded, &Named::in_study(&loaded.study, run))?;
                if let Some(descriptor) = &descriptor {
                    output.notes_on(&target.run, &target.caveats(descriptor.time));
                }
                maker.target(&target)?
            }
        };
        let name = descriptor.as_ref().map(|descriptor| &descriptor.name);
        match &self.output {
            Some(path) => {
                table.write(path)?;
                let facts = json!({ "descriptor": name, "names": table.names, "rows": table.rows.len(), "path": path });
                output.print(&facts, || format!("{} rows in {}", table.rows.len(), path.display()));
            }
            None => {
                let csv = table.csv()?;
                output.print(&json!({ "descriptor": name, "names": table.names, "rows": row_facts(&table) }), || csv);
            }
        }
        Ok(Answer::Done)
    }
}

fn row_facts(table: &FeatureTable) -> Vec<Value> {
    let facts = |(at, row): (usize, &crumple::feature_table::FeatureRow)| {
        let inputs: serde_json::Map<String, Value> =
            table.inputs(at).map(|(name, value)| (name.to_owned(), json!(value))).collect();
        json!({ "run": row.run, "state": row.state, "time": row.time, "similarity": row.score.map(|score| score.similarity), "distance": row.score.map(|score| score.distance), "numbers": row.numbers, "inputs": inputs })
    };
    table.rows.iter().enumerate().map(facts).collect()
}
