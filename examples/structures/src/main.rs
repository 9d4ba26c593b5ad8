//! Labelled bundles of analytic, nearly isometric deformations of three structures, as d3plot families: a square tube,
//! a plate and an S-shaped channel rail. What a run does is drawn at random from a fixed seed; its label is what was
//! drawn, never looked at by any program that compares runs.

mod beam;
mod family;
mod model;
mod plan;
mod plate;
mod rail;
mod tube;

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Parser;

use model::Structure;

/// Write labelled bundles of analytic deformations: OUT_DIR/<structure>/{runs/run_NNN/d3plot, labels.csv, inputs.csv}.
#[derive(Parser)]
struct Arguments {
    /// Folder to write into
    out_dir: PathBuf,
    /// Only this structure: tube, plate or rail
    #[arg(long)]
    only: Option<String>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Arguments { out_dir, only } = Arguments::parse();
    let structures: [Box<dyn Structure>; 3] = [Box::new(tube::Tube), Box::new(plate::Plate), Box::new(rail::Rail)];
    if let Some(name) = only.as_deref().filter(|name| structures.iter().all(|structure| structure.name() != *name)) {
        return Err(format!("no structure {name}: tube, plate or rail").into());
    }
    for structure in structures.iter().filter(|one| only.as_deref().is_none_or(|name| name == one.name())) {
        write(structure.as_ref(), &out_dir.join(structure.name()))?;
    }
    Ok(())
}

/// States of a run, at equal times from 0 to 1.
const STATES: usize = 5;

fn write(structure: &dyn Structure, folder: &Path) -> Result<(), Box<dyn Error>> {
    let runs = plan::runs(structure);
    let model = structure.model();
    std::fs::create_dir_all(folder)?;
    let mut labels = csv::Writer::from_path(folder.join("labels.csv"))?;
    let mut inputs = csv::Writer::from_path(folder.join("inputs.csv"))?;
    labels.write_record(["run", "label", "clear"])?;
    let names: Vec<&str> = runs.iter().take(1).flat_map(|run| run.inputs.keys().copied()).collect();
    inputs.write_record(["run"].iter().chain(&names))?;
    for (number, run) in runs.iter().enumerate() {
        let id = format!("run_{:03}", number + 1);
        labels.write_record([id.as_str(), run.label, if run.clear { "true" } else { "false" }])?;
        let values = run.inputs.values().map(|value| format!("{value:.6}"));
        inputs.write_record(std::iter::once(id.clone()).chain(values))?;
        let states = (0..STATES).map(|state| {
            let time = state as f64 / (STATES - 1) as f64;
            (time, structure.shape(&run.inputs, plan::progress(&run.inputs, time)))
        });
        family::write(&folder.join("runs").join(&id), &model, states)?;
    }
    labels.flush()?;
    inputs.flush()?;
    println!("{}: {} runs, {} nodes", folder.display(), runs.len(), model.nodes.len());
    Ok(())
}
