//! `crumple info`: what a result file holds.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use crumple::deck::{self, DeckInfo};
use crumple::joints::Join;
use crumple::run::{Run, Units};
use crumple::study::Study;
use crumple::{Error, descriptor, modes};
use serde_json::{Value, json};

use super::Answer;
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(
    after_help = "Example, in the repository:\n  crumple info examples/hat-section/runs/run_001\n  crumple info examples/hat-section/runs/run_001 --ranges\n  crumple info examples/hat-section/decks/run_001.k\n  crumple info study"
)]
pub(crate) struct Info {
    /// Root file of a family (d3plot), its folder, a keyword deck, or a study: then its runs, modes and descriptors
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
        let Some(info) = run.info() else {
            return run.deck().map_or(Ok(Answer::Done), |deck| self.deck(deck::info(deck), output));
        };
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

    /// What a deck holds.
    fn deck(&self, info: DeckInfo, output: &Output) -> Result<Answer, Error> {
        output.print(&json!(info), || {
            let list = |counts: &mut dyn Iterator<Item = (&str, usize)>| {
                let words: Vec<String> = counts.map(|(name, count)| format!("{count} {name}")).collect();
                if words.is_empty() { "none".to_owned() } else { words.join(", ") }
            };
            let named = |counts: &BTreeMap<String, usize>| list(&mut counts.iter().map(|(name, count)| (&**name, *count)));
            let mut sets = info.sets.iter().map(|(name, count)| (*name, *count));
            let mut skipped: Vec<(&str, u64)> =
                info.skipped.iter().map(|(keyword, skipped)| (&**keyword, skipped.blocks)).collect();
            skipped.sort_by_key(|(_, blocks)| std::cmp::Reverse(*blocks));
            let mut skipped = skipped.into_iter().map(|(keyword, blocks)| (keyword, blocks as usize));
            let mut text = format!(
                "{}\n{}, {} files\nnodes     {}\nelements  {}\nsections  {}\nmaterials {}\nsets      {}\nwelds     {}\nties      {}\nskipped   {}\n",
                if info.title.is_empty() { "(no title)" } else { &info.title },
                info.format,
                info.files.len(),
                info.nodes,
                named(&info.elements.iter().filter(|(_, count)| **count > 0).map(|(name, count)| (name.replace('_', " "), *count)).collect()),
                named(&info.sections),
                info.materials,
                list(&mut sets),
                named(&info.connections),
                named(&info.ties),
                list(&mut skipped),
            );
            let rows = info.parts.iter().map(|part| {
                let counts = [part.shells, part.solids, part.thick_shells, part.beams];
                let thickness = part.thickness.map_or_else(|| "–".into(), |thickness| thickness.to_string());
                let material = part.material.clone().unwrap_or_else(|| "–".into());
                let counts = counts.map(|count| count.to_string());
                [part.id.to_string(), part.title.clone()].into_iter().chain(counts).chain([thickness, material]).collect()
            });
            text += &table(&["#part", "title", "#shells", "#solids", "#thick shells", "#beams", "#thickness", "material"], rows);
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
            "deck": settings.deck, "operator": settings.operator, "mass": settings.mass,
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
            let join = match settings.join {
                None => "not joined".to_owned(),
                Some(Join::Distance(distance)) => format!("joined within {distance} {}", settings.length_unit),
                Some(Join::Deck(_)) => "joined by the deck's welds and ties".to_owned(),
            };
            format!(
                "study of {} runs on {} vertices, {} eigenpairs ({}, {} mass), {join}; reference {}\ndescriptors: {}\n{}",
                manifest.runs.len(),
                manifest.vertices,
                manifest.eigenpairs,
                settings.operator,
                settings.mass,
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
