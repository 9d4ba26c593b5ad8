//! `crumple explain`: why two runs are alike or different.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::explain::{Explanation, explain, regions};
use crumple::study::{Loaded, write_shape};
use crumple::target::{self, Named, Target, resolve};
use serde_json::json;

use super::Answer;
use crate::output::{Output, table};

#[derive(Args)]
#[command(
    after_help = "The file shows the first run's shape with three numbers at each vertex: where the first, the second, and both turn in the octave, 1 being the mean.\n\nExample:\n  crumple explain study run_007 run_008 -o alike.vtu"
)]
pub(crate) struct Explain {
    /// Folder of the study
    study: PathBuf,
    /// A run, by id or path; @N for a state
    #[arg(value_name = "RUN[@STATE]")]
    first: String,
    /// Another
    #[arg(value_name = "OTHER[@STATE]")]
    second: String,
    /// Picture on the mesh, for ParaView: where on the part both turn
    #[arg(short, long, value_name = "FILE.vtu")]
    output: Option<PathBuf>,
    /// Octave of the picture, counted from 1 as in the table [default: the one that both share most]
    #[arg(long, value_name = "N")]
    octave: Option<usize>,
}

impl Explain {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let loaded = Loaded::open(&self.study)?;
        let unit = loaded.study.settings().length_unit.clone();
        let named = |word: &String| Named::in_study(&loaded.study, word);
        let (a, b) = (resolve(&loaded, &named(&self.first))?, resolve(&loaded, &named(&self.second))?);
        let found = explain(&loaded.basis, &a, &b, &unit);
        if let Some(path) = &self.output {
            if path.extension().is_none_or(|extension| extension != "vtu") {
                return Err(Error::Value {
                    name: "--output",
                    value: path.display().to_string(),
                    expected: "a name that ends in .vtu".into(),
                });
            }
            let octave = self.octave.map_or(found.alike_in, |octave| octave.wrapping_sub(1));
            let [first, second, both] = regions(&loaded, &a, &b, octave)?;
            let shape = target::shape(&loaded, &named(&self.first), &a)?;
            write_shape(path, &loaded.reference, &shape, &[("first", &first), ("second", &second), ("both", &both)])?;
        }
        output.print(&json!({ "first": a.run, "second": b.run, "explanation": found, "file": self.output }), || {
            words(&found, &a, &b, &unit)
        });
        Ok(Answer::Done)
    }
}

fn words(found: &Explanation, a: &Target, b: &Target, unit: &str) -> String {
    let rows = found.kind.iter().zip(1..).map(|(term, octave)| {
        vec![
            octave.to_string(),
            format!("{:.0} to {:.0}", term.wavelength.1, term.wavelength.0),
            format!("{:.1} %", 100.0 * term.shares[0]),
            format!("{:.1} %", 100.0 * term.shares[1]),
            format!("{:+.3}", term.adds),
        ]
    });
    let wavelength = format!("#wavelength, {unit}");
    format!(
        "{}\nwhich way as a whole adds {:+.3}\n{}",
        table(&["#octave", &wavelength, &format!("#{}", a.run), &format!("#{}", b.run), "#adds"], rows),
        found.direction,
        found.words.join("\n")
    )
}
