//! `crumple isometry`: does the surface stretch, which the method assumes it hardly does?

use std::path::PathBuf;

use clap::Args;
use crumple::isometry::{self, Isometry as Found, Shift, caveat, isometry, shift};
use crumple::study::Loaded;
use crumple::target::{Named, resolve, states};
use crumple::{Error, Watch};
use serde_json::json;

use super::Answer;
use crate::output::{Output, table, time};

#[derive(Args)]
#[command(
    after_help = "Strains are magnitudes: by how much edges change their length and triangles their area.\n\nExample:\n  crumple isometry study run_007\n  crumple isometry study run_007@2 --eigenvalues 50"
)]
pub(crate) struct Isometry {
    /// Folder of the study
    study: PathBuf,
    /// A run, by id or path; @N for one state of it [default: every state]
    #[arg(value_name = "RUN[@STATE]")]
    run: String,
    /// Compare the first N eigenvalues above zero of the deformed surface, in its last state or the one named, with those of
    /// the study: on a surface that does not stretch they are the same. Costs an eigenbasis
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    eigenvalues: Option<usize>,
}

impl Isometry {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let loaded = Loaded::open(&self.study)?;
        let named = Named::in_study(&loaded.study, &self.run);
        let last = resolve(&loaded, &named)?;
        let all = if named.state.is_some() { last.state..last.state + 1 } else { 0..states(&loaded.study, &named)? };
        let of = |state| {
            let named = Named { run: named.run.clone(), state: Some(state) };
            isometry(&loaded, &named, &resolve(&loaded, &named)?)
        };
        let found: Vec<Found> = all.map(of).collect::<Result<_, _>>()?;
        let shifted = match self.eigenvalues {
            Some(count) => Some(shift(&loaded, &named, &last, count, watch)?),
            None => None,
        };
        output.notes_on(&last.run, &last.warnings);
        let most = found.iter().map(|state| state.edges.p95).fold(0.0, f64::max);
        let answer = json!({
            "run": last.run, "states": found, "thin": most > isometry::STRAIN_THIN,
            "eigenvalues": shifted.as_ref().map(|shift| json!({ "state": last.state, "shift": shift })),
        });
        output.print(&answer, || words(&found, shifted.as_ref().map(|shift| (last.state, shift)), most));
        Ok(Answer::Done)
    }
}

fn words(found: &[Found], shifted: Option<(usize, &Shift)>, most: f64) -> String {
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    let rows = found.iter().map(|state| {
        let of = [state.edges, state.areas].map(|of| [of.median, of.p95, of.max].map(percent));
        [state.state.to_string(), time(state.time)].into_iter().chain(of.concat()).collect()
    });
    let names = ["#state", "#time", "#edges, half", "#95 %", "#all", "#areas, half", "#95 %", "#all"];
    let mut text = format!("{}\nhalf, 95 % and all of the edges and triangles change by less\n", table(&names, rows));
    if let Some((state, shift)) = shifted {
        text += &format!(
            "\nstate {state}: the first {} eigenvalues above zero change by {} (median), at most {}; on average by {:+.2} %\n",
            shift.count,
            percent(shift.median),
            percent(shift.max),
            100.0 * shift.mean
        );
    }
    match caveat(most) {
        Some(caveat) => text += &format!("\n{caveat}\n"),
        None => text += "\nthe surface hardly stretches, as the method assumes\n",
    }
    text
}
