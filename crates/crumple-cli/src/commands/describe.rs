//! `crumple describe`: build and save a descriptor.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::descriptor::{self, Descriptor, Selected, Set};
use crumple::explain::spectrum_words;
use crumple::modes;
use crumple::reconstruct::Errors;
use crumple::select::Kind;
use crumple::study::Loaded;
use crumple::target::Named;
use serde_json::{Value, json};

use super::{Answer, interactive};
use crate::options::DescribeArgs;
use crate::output::{Output, percent, table, time};

#[derive(Args)]
#[command(
    after_help = "Example:\n  crumple describe study run_007 --name crush\n  crumple describe study --mode mode-1 --threshold error:5"
)]
pub(crate) struct Describe {
    /// Folder of the study
    study: PathBuf,
    /// Run to describe, by id or path; @N for a state of it, counted from 0 [default state: the last]
    #[arg(value_name = "RUN[@STATE]", required_unless_present = "mode", conflicts_with = "mode")]
    run: Option<String>,
    /// Describe this mode
    #[arg(long, value_name = "NAME")]
    mode: Option<String>,
    /// What of the mode: its medoid, the mean of its runs (with their spread), or share:S, the eigenvectors that matter
    /// for at least this share of its runs with the medoid's values [default: medoid]
    #[arg(long, value_name = "SET", requires = "mode")]
    set: Option<String>,
    /// Name to save it under [default: the run or the mode]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Look for t by hand: t, M, the errors and a picture of the reconstruction; + and - raise and lower t, s saves, q
    /// quits
    #[arg(long)]
    interactive: bool,
    #[command(flatten)]
    describe: DescribeArgs,
}

impl Describe {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let set = self.set.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        let options = self.describe.options(set)?;
        let loaded = Loaded::open(&self.study)?;
        let named = match (&self.run, &self.mode) {
            (_, Some(mode)) => Named { run: modes::load(&loaded.study)?.mode(mode)?.medoid.clone(), state: None },
            (run, None) => Named::in_study(&loaded.study, run.as_deref().unwrap_or_default()),
        };
        let name = self.name.as_deref().or(self.mode.as_deref());
        if self.interactive {
            return interactive::search(&loaded, &named, self.mode.as_deref(), name, &options, output);
        }
        let described = descriptor::describe(&loaded, &named, self.mode.as_deref(), name, &options)?;
        let path = descriptor::save(&loaded.study, &described.descriptor)?;
        let mut facts = facts(&described.descriptor);
        facts["path"] = json!(path);
        let unit = &loaded.study.settings().length_unit;
        let spectrum = spectrum_words(&loaded.basis, &described.descriptor.spectrum, unit);
        facts["words"] = json!(spectrum);
        output.print(&facts, || format!("{}\n{spectrum}", words(&described.descriptor, unit)));
        Ok(Answer::Done)
    }
}

/// What `describe` tells a script.
pub(crate) fn facts(descriptor: &Descriptor) -> Value {
    let mut facts = json!({
        "descriptor": descriptor.name,
        "kind": descriptor.kind,
        "run": descriptor.run,
        "state": descriptor.state,
        "time": descriptor.time,
        "mode": descriptor.mode,
        "set": descriptor.set,
        "size": descriptor.size(),
        "numbers": descriptor.numbers(),
        "spectrum": descriptor.spectrum,
        "beside": descriptor.beside.iter().map(selected_facts).collect::<Vec<_>>(),
    });
    if let (Some(facts), Value::Object(selected)) = (facts.as_object_mut(), selected_facts(&descriptor.selected)) {
        facts.extend(selected);
    }
    facts
}

fn selected_facts(selected: &Selected) -> Value {
    json!({
        "function": function_word(selected),
        "select": selected.select,
        "signed": selected.signed,
        "eigenvectors": selected.eigenvectors,
        "threshold": { "rule": selected.rule, "value": selected.threshold },
        "spread": selected.spread,
        "scale": selected.scale,
        "errors": selected.errors,
        "rivals": selected.rivals,
        "split_clusters": selected.split_clusters,
    })
}

fn function_word(selected: &Selected) -> String {
    selected.field.map_or_else(|| "shape".into(), |field| field.to_string())
}

pub(super) fn words(descriptor: &Descriptor, unit: &str) -> String {
    let what = match (&descriptor.mode, descriptor.set) {
        (Some(mode), Set::Mean) => format!("the mean of {mode}"),
        (Some(mode), Set::Share(share)) => {
            format!("what matters for {:.0} % of {mode}, with the values of {}", 100.0 * share, descriptor.run)
        }
        _ => format!("{} at time {}", descriptor.run, time(descriptor.time)),
    };
    let mut text = format!(
        "descriptor '{}' of {what}, compared by its {}\n",
        descriptor.name,
        match descriptor.kind {
            Kind::Rotation => "rotation spectrum (--kind paper: by the coefficients below)",
            Kind::Paper => "coefficients",
        }
    );
    for selected in descriptor.blocks() {
        text += &selected_words(selected, unit);
    }
    text
}

/// The selection of one function, and how well it rebuilds it.
fn selected_words(selected: &Selected, unit: &str) -> String {
    let m = selected.eigenvectors.len();
    let numbers: usize = selected.values.iter().map(Vec::len).sum();
    // A field's own unit is not known.
    let (errors_unit, threshold_unit) = match selected.field {
        None => (format!(", {unit}"), format!(" {unit}²")),
        Some(_) => (String::new(), String::new()),
    };
    let mut text = format!(
        "{}: M = {m} eigenvectors, {numbers} numbers ({} above t = {:.4}{threshold_unit}, rule {})\neigenvectors {}\n",
        function_word(selected),
        if selected.field.is_some() { "coefficients" } else { selected.select.word() },
        selected.threshold,
        selected.rule,
        selected.eigenvectors.iter().map(usize::to_string).collect::<Vec<_>>().join(" ")
    );
    let row = |method: &str, size: usize, errors: &Errors| {
        let digits = if selected.field.is_some() { 4 } else { 2 };
        vec![
            method.to_owned(),
            size.to_string(),
            format!("{:.digits$}", errors.rms),
            format!("{:.*}", digits - 1, errors.max),
            percent(errors.relative),
        ]
    };
    let own = selected.errors.iter().map(|errors| row("descriptor", m, errors));
    let rivals = selected.rivals.iter().map(|rival| row(&rival.method, rival.size, &rival.errors));
    text += &table(
        &[
            "reconstruction",
            "#size",
            &format!("#RMS error{errors_unit}"),
            &format!("#largest{errors_unit}"),
            "#of the whole",
        ],
        own.chain(rivals),
    );
    if !selected.split_clusters.is_empty() {
        let ranges: Vec<String> =
            selected.split_clusters.iter().map(|(first, last)| format!("{first}–{last}")).collect();
        text += &format!(
            "\nnote: eigenvectors {} have nearly equal eigenvalues and are kept in part; the choice among them depends on small changes of the mesh (--whole-clusters keeps them together)",
            ranges.join(", ")
        );
    }
    text + "\n"
}
