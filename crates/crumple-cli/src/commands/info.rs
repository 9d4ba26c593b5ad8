//! `crumple info`: what a result file holds.

use std::path::PathBuf;

use clap::Args;
use crumple::run::{Run, Units};
use crumple::study::Study;
use crumple::{Error, descriptor, modes};
use serde_json::{Value, json};

use super::Answer;
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(
    after_help = "Example, in the repository:\n  crumple info examples/hat-section/runs/run_001\n  crumple info examples/hat-section/runs/run_001 --ranges\n  crumple info study"
)]
pub(crate) struct Info {
    /// Root file of a family (d3plot), its folder, or a study: then its runs, modes and descriptors
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Also the least, largest and sum of every field in the first and last state
    #[arg(long)]
    ranges: bool,
    /// Map the files into memory. Only for files that nothing writes to: if one becomes shorter meanwhile, this program ends
    /// by a signal, where plain reading gives an error
    #[arg(long)]
    map: bool,
}

impl Info {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        if !self.run.exists() {
            return Err(Error::NoSuchPath(self.run.clone()));
        }
        if self.run.join("manifest.json").is_file() {
            return self.study(output);
        }
        let run = Run::open_mapped("", &self.run, self.map)?;
        let info = run.info();
        let mut facts = json!(info);
        let ranges = if self.ranges { run.ranges()? } else { None };
        if self.ranges {
            let [first, last] = ranges.clone().map_or([Value::Null, Value::Null], |ranges| ranges);
            facts["first_state"] = first;
            facts["last_state"] = last;
        }
        output.print(&facts, || {
            let e = &info.elements;
            let times = match &info.times[..] {
                [] => "none".to_owned(),
                [only] => format!("1, at time {}", time(*only)),
                [first, .., last] => format!("{}, from time {} to {}", info.times.len(), time(*first), time(*last)),
            };
            let mut text = format!(
                "{}\n{}, {} precision, {}-endian, solver {}, {} files\nnodes     {}\nelements  {} shells, {} solids, {} thick shells, {} beams, {} SPH\nstates    {times}\nunits     {}\nfields    {}\n",
                if info.title.trim().is_empty() { "(no title)" } else { info.title.trim() },
                info.format,
                info.precision,
                info.byte_order,
                info.solver,
                info.members.len(),
                info.nodes,
                e.shells,
                e.solids,
                e.thick_shells,
                e.beams,
                e.sph,
                units(&info.units),
                info.fields.join(", ")
            );
            let materials = info.parts.iter().any(|part| part.material.is_some());
            let rows = info.parts.iter().map(|part| {
                let e = &part.elements;
                let counts = [e.shells, e.solids, e.thick_shells, e.beams, e.sph].map(|count| count.to_string());
                let material = part.material.map_or("–".to_owned(), |number| number.to_string());
                let names = [part.id.to_string(), part.title.trim().to_owned()];
                names.into_iter().chain(materials.then_some(material)).chain(counts).collect()
            });
            let mut columns = vec!["#part", "title"];
            columns.extend(materials.then_some("#material"));
            columns.extend(["#shells", "#solids", "#thick shells", "#beams", "#SPH"]);
            text += &table(&columns, rows);
            for state in ranges.iter().flatten() {
                text += &ranges_table(state);
            }
            for warning in &info.warnings {
                text += &format!("\nwarning: {}", warning.message);
            }
            text
        });
        Ok(Answer::Done)
    }

    /// What a study holds.
    fn study(&self, output: &Output) -> Result<Answer, Error> {
        let study = Study::open(&self.run)?;
        let (manifest, settings) = (study.manifest(), study.settings());
        let modes = match modes::load(&study) {
            Err(Error::NoModes) => Vec::new(),
            other => other?.modes,
        };
        let names: Vec<&str> = modes.iter().map(|mode| mode.name.as_str()).collect();
        let descriptors = descriptor::list(&study)?;
        let facts = json!({
            "study": study.folder(), "reference": settings.reference, "parts": settings.parts, "join": settings.join,
            "vertices": manifest.vertices, "eigenpairs": manifest.eigenpairs, "inputs": manifest.inputs,
            "runs": manifest.runs.keys().collect::<Vec<_>>(), "modes": names, "descriptors": descriptors,
        });
        output.print(&facts, || {
            let mode_of = |run: &str| modes.iter().find(|mode| mode.members.iter().any(|member| member == run));
            let rows = manifest.runs.iter().map(|(id, run)| {
                let last = run.times.last().copied().unwrap_or_default();
                let mode = mode_of(id).map_or("–", |mode| &mode.name).to_owned();
                vec![id.clone(), run.times.len().to_string(), time(last), mode, run.path.display().to_string()]
            });
            let or_none = |names: &[String]| if names.is_empty() { "none yet".to_owned() } else { names.join(", ") };
            format!(
                "study of {} runs on {} vertices, {} eigenpairs; reference {}\ndescriptors: {}\n{}",
                manifest.runs.len(),
                manifest.vertices,
                manifest.eigenpairs,
                settings.reference,
                or_none(&descriptors),
                table(&["run", "#states", "#last time", "mode", "file"], rows)
            )
        });
        Ok(Answer::Done)
    }
}

/// The units, or that they cannot be told, and why.
fn units(units: &Units) -> String {
    let unit = |unit: Option<&str>| unit.unwrap_or("unknown").to_owned();
    format!("length {}, time {} (a guess: {})", unit(units.length), unit(units.time), units.reason)
}

/// The ranges of a state: a line for each component of each field that it has.
fn ranges_table(state: &Value) -> String {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]);
    let mut rows = Vec::new();
    for (name, range) in state.as_object().into_iter().flatten() {
        let [min, max, sum] = ["min", "max", "sum"].map(|key| list(&range[key]));
        if range.get("sum").is_none() || name == "tshell_plastic_strain" {
            continue;
        }
        for component in 0..sum.len() {
            let name = if sum.len() > 1 { format!("{name} {}", component + 1) } else { name.clone() };
            let number = |list: &[Value]| {
                list.get(component).and_then(Value::as_f64).map_or("–".into(), |x| format!("{x:.6e}"))
            };
            rows.push(vec![name, number(&min), number(&max), number(&sum)]);
        }
    }
    let at = state["time"].as_f64().unwrap_or_default();
    format!("\nstate at time {}\n{}", time(at), table(&["field", "#least", "#largest", "#sum"], rows))
}
