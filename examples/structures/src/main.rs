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

/// Write labelled bundles of analytic deformations: `OUT_DIR/STRUCTURE/{runs/run_NNN/d3plot, labels.csv, inputs.csv}`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Inputs, Point};

    fn strains(structure: &dyn Structure, shape: &[Point]) -> Vec<f64> {
        let model = structure.model();
        let length = |points: &[Point], a: u32, b: u32| {
            (0..3).map(|c| (points[a as usize][c] - points[b as usize][c]).powi(2)).sum::<f64>().sqrt()
        };
        let sides = model.quads.iter().flat_map(|&[a, b, c, d]| [(a, b), (b, c), (c, d), (d, a)]);
        let mut strains: Vec<f64> =
            sides.map(|(a, b)| (length(shape, a, b) / length(&model.nodes, a, b) - 1.0).abs()).collect();
        strains.sort_by(f64::total_cmp);
        strains
    }

    fn only(structure: &dyn Structure, mode: &'static str) -> Inputs {
        let runs = plan::runs(structure);
        let mut inputs = runs.into_iter().find(|run| run.label == mode && run.clear).expect("a clear run").inputs;
        structure.modes().iter().filter(|other| **other != mode).for_each(|other| _ = inputs.insert(other, 0.0));
        inputs
    }

    #[test]
    fn nothing_moves_at_share_zero() {
        let structures: [Box<dyn Structure>; 3] = [Box::new(tube::Tube), Box::new(plate::Plate), Box::new(rail::Rail)];
        for structure in structures {
            let (model, inputs) = (structure.model(), only(structure.as_ref(), structure.modes()[0]));
            let size = model.nodes.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
            for (a, b) in model.nodes.iter().zip(structure.shape(&inputs, 0.0)) {
                // The axis is integrated to the order of rounding of its length, and a wall that is pushed in by w bulges
                // by √w: a ten thousandth of a shell.
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-5 * size), "{}: {a:?} {b:?}", structure.name());
            }
        }
    }

    #[test]
    fn folds_and_hinges_hardly_stretch() {
        // A chord is shorter than its arc: shells of a seventh of a wavelength, turned by up to 1.25 at their ends.
        for (structure, mode) in [
            (&tube::Tube as &dyn Structure, "fold"),
            (&rail::Rail, "fold"),
            (&plate::Plate, "corrugate"),
            (&plate::Plate, "hinge"),
        ] {
            let strains = strains(structure, &structure.shape(&only(structure, mode), 1.0));
            let quantile = |share: f64| strains[(share * (strains.len() - 1) as f64) as usize];
            assert!(quantile(0.5) < 0.01 && quantile(0.8) < 0.05, "{mode}: {} {}", quantile(0.5), quantile(0.8));
        }
    }

    #[test]
    fn the_bundles_are_the_same_everywhere() {
        let labels: Vec<&str> = plan::runs(&tube::Tube).iter().map(|run| run.label).take(4).collect();
        assert_eq!(labels, ["twist", "bend_up", "bend_up", "twist"]);
    }
}
