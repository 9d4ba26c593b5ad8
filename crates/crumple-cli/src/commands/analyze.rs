//! `crumple analyze`: the whole way in one command.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use crumple::bundle::{self, Found};
use crumple::descriptor::{self, Descriptor, Set};
use crumple::modes;
use crumple::reference::Reference;
use crumple::report::{describe_modes, early_words, findings, page};
use crumple::run::Run;
use crumple::study::{AddOptions, Loaded, Study};
use crumple::{Error, Watch};
use serde_json::json;

use super::{Answer, add, describe, init};
use crate::options::{AddArgs, BasisArgs, DescribeArgs, ModesArgs};
use crate::output::{Output, percent, table, two};

#[derive(Args)]
#[command(
    after_help = "Repeating it on the same study adds what is new and finds modes, descriptors and report again.\n\nExample, in the repository:\n  crumple analyze examples/hat-section/runs --join 2.5 -o study"
)]
pub(crate) struct Analyze {
    /// Root files, run folders, or folders with runs below them
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Folder of the study; the page is written into it as report.html
    #[arg(short, long, value_name = "STUDY")]
    output: PathBuf,
    /// Run whose undeformed shells are the surface, by id or path [default: the study's own; for a new study the first
    /// by name]
    #[arg(long, value_name = "RUN")]
    reference: Option<String>,
    #[command(flatten)]
    basis: BasisArgs,
    #[command(flatten)]
    add: AddArgs,
    #[command(flatten)]
    modes: ModesArgs,
    #[command(flatten)]
    describe: DescribeArgs,
}

impl Analyze {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        self.basis.options()?;
        let (modes_options, describe_options) = (self.modes.options()?, self.describe.options(Set::default())?);
        let table = self.add.table()?;
        let mut seconds = Stopwatch::start();
        let found = bundle::find(&self.runs)?;
        if let Some(table) = &table {
            // A table that fits no run is found out before the eigenbasis is computed.
            table.join(&found.iter().map(|run| run.id.as_str()).collect::<Vec<_>>())?;
        }
        let known = Study::open(&self.output).ok().and_then(|study| study.settings().deck.clone());
        let reference = self.basis.with_deck(self.reference_run(&found)?, known.as_deref())?;
        seconds.lap("find");
        let mut study = self.open_or_create(&reference, found.len(), watch)?;
        seconds.lap("init");
        let options = AddOptions { replace: self.add.replace, skip_bad: self.add.skip_bad, params: table.as_ref() };
        let added = study.add(&found, options, watch)?;
        seconds.lap("add");
        add::tell(&study, &added, output);
        let modes = modes::modes(&study, &modes_options, watch)?;
        seconds.lap("modes");
        let loaded = Loaded::of(study)?;
        let described = describe_modes(&loaded, &modes, Some(&describe_options), watch)?;
        seconds.lap("describe");
        let page = page(&findings(&loaded, &modes, &described)?)?;
        // Everything is known before anything is replaced.
        modes::save(&loaded.study, &modes)?;
        descriptor::forget_modes(&loaded.study, &modes)?;
        let descriptors: Vec<Descriptor> = described.into_iter().map(|described| described.descriptor).collect();
        for descriptor in &descriptors {
            descriptor::save(&loaded.study, descriptor)?;
        }
        let path = crumple::report::save(&loaded.study, &page)?;
        seconds.lap("report");
        init::advise(&loaded, output)?;
        early_words(&loaded.study).iter().for_each(|words| output.note(words));
        modes.notes.iter().for_each(|words| output.note(words));
        let facts = json!({
            "study": self.output,
            "report": path,
            "init": init::facts(&loaded)?,
            "add": add::facts(&loaded.study, &added),
            "modes": super::modes::facts(&modes),
            "descriptors": descriptors.iter().map(describe::facts).collect::<Vec<_>>(),
            "seconds": seconds.laps,
        });
        output.print(&facts, || {
            let unit = &loaded.study.settings().length_unit;
            format!(
                "{}\n\n{}\n\nreport: {}",
                super::modes::words(&modes, loaded.study.settings()),
                descriptor_words(&descriptors, unit),
                path.display()
            )
        });
        Ok(Answer::Done)
    }

    fn reference_run(&self, found: &[Found]) -> Result<Run, Error> {
        let Some(name) = &self.reference else {
            // A study keeps its reference: a new run that comes first by name does not take its place.
            if let Ok(study) = Study::open(&self.output)
                && let Ok(run) = Run::open(&study.settings().reference, &study.settings().reference_path)
            {
                return Ok(run);
            }
            return first_usable(found, self.add.skip_bad);
        };
        if let Some(run) = found.iter().find(|run| run.id == *name) {
            return Run::open(&run.id, &run.path);
        }
        match &bundle::find(&[PathBuf::from(name)])?[..] {
            [only] => Run::open(&only.id, &only.path),
            several => Err(Error::Value {
                name: "--reference",
                value: name.clone(),
                expected: format!("one run; this folder holds {}", several.len()),
            }),
        }
    }

    fn open_or_create(&self, reference: &Run, runs: usize, watch: &dyn Watch) -> Result<Study, Error> {
        let (options, fields) = (self.basis.options()?, self.basis.fields()?);
        if runs < modes::RUNS_MIN && !self.output.exists() {
            // Found out before the eigenbasis is computed, but after what else is wrong with the one run.
            Reference::of_run(reference, &self.basis.parts)?;
            return Err(Error::TooFewRuns { what: "grouping into modes", needed: modes::RUNS_MIN, have: runs });
        }
        match Study::create(&self.output, reference, &self.basis.parts, &fields, &options, watch) {
            Err(Error::StudyExists { folder, what }) => {
                let study = match Study::open(&folder) {
                    Err(Error::NotAStudy { .. }) => return Err(Error::StudyExists { folder, what }),
                    other => other?,
                };
                if study.is_for(reference, &self.basis.parts, &fields, &options)? {
                    return Ok(study);
                }
                let what = "the study here has another mesh, other parts or fields, another operator, another join or another number of eigenpairs"
                    .to_owned();
                Err(Error::StudyExists { folder, what })
            }
            other => other,
        }
    }
}

/// The first run by name. With `skip_bad` the first that can be read: a bundle whose first run failed is no reason to
/// stop.
fn first_usable(found: &[Found], skip_bad: bool) -> Result<Run, Error> {
    let mut first_error = None;
    for run in found {
        let opened = match &run.fault {
            Some(fault) => Err(Error::Refused { what: fault.what.clone(), remedy: fault.remedy.clone() }),
            None => Run::open(&run.id, &run.path),
        };
        match opened {
            Ok(run) => return Ok(run),
            Err(error) => first_error = first_error.or(Some(error)),
        }
        if !skip_bad {
            break;
        }
    }
    Err(first_error.unwrap_or(Error::Internal("a bundle without runs".into())))
}

fn descriptor_words(descriptors: &[Descriptor], unit: &str) -> String {
    let rows = descriptors.iter().map(|descriptor| {
        let errors = descriptor.selected.errors;
        vec![
            descriptor.name.clone(),
            descriptor.run.clone(),
            descriptor.size().to_string(),
            descriptor.numbers().to_string(),
            two(errors.map(|errors| errors.rms)),
            percent(errors.and_then(|errors| errors.relative)),
        ]
    });
    table(&["descriptor", "of", "#eigenvectors", "#numbers", &format!("#RMS error, {unit}"), "#of displacement"], rows)
}

/// Seconds a stage, in order.
struct Stopwatch {
    last: Instant,
    laps: serde_json::Map<String, serde_json::Value>,
}

impl Stopwatch {
    fn start() -> Self {
        Self { last: Instant::now(), laps: serde_json::Map::new() }
    }

    fn lap(&mut self, stage: &str) {
        let now = Instant::now();
        self.laps.insert(stage.to_owned(), json!((now - self.last).as_secs_f64()));
        self.last = now;
    }
}
