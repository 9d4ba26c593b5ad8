//! `crumple info`: what a result file holds.

use std::path::PathBuf;

use clap::Args;
use crumple::{Error, run::Run};
use serde_json::json;

use super::Answer;
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(after_help = "Example, in the repository:\n  crumple info examples/hat-section/runs/run_001")]
pub(crate) struct Info {
    /// Root file of a family (d3plot), or its folder
    run: PathBuf,
}

impl Info {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        if !self.run.exists() {
            return Err(Error::NoSuchPath(self.run.clone()));
        }
        let info = Run::open("", &self.run)?.info();
        output.print(&json!(info), || {
            let e = &info.elements;
            let times = match &info.times[..] {
                [] => "none".to_owned(),
                [only] => format!("1, at time {}", time(*only)),
                [first, .., last] => format!("{}, from time {} to {}", info.times.len(), time(*first), time(*last)),
            };
            let mut text = format!(
                "{}\n{}, {} precision, {}-endian, release {}, {} files\nnodes     {}\nelements  {} shells, {} solids, {} thick shells, {} beams, {} SPH\nstates    {times}\nfields    {}\n",
                if info.title.trim().is_empty() { "(no title)" } else { info.title.trim() },
                info.format,
                info.precision,
                info.byte_order,
                info.release.trim(),
                info.members.len(),
                info.nodes,
                e.shells,
                e.solids,
                e.thick_shells,
                e.beams,
                e.sph,
                info.fields.join(", ")
            );
            let rows = info.parts.iter().map(|part| {
                let e = &part.elements;
                let counts = [e.shells, e.solids, e.thick_shells, e.beams, e.sph];
                std::iter::once(part.id.to_string()).chain([part.title.trim().to_owned()]).chain(counts.map(|count| count.to_string())).collect()
            });
            text += &table(&["#part", "title", "#shells", "#solids", "#thick shells", "#beams", "#SPH"], rows);
            for warning in &info.warnings {
                text += &format!("\nwarning: {}", warning.message);
            }
            text
        });
        Ok(Answer::Done)
    }
}
