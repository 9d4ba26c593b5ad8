//! `crumple report`: one page.

use std::path::PathBuf;

use clap::Args;
use crumple::modes::{self, Modes, ModesOptions};
use crumple::report::{describe_modes, findings, page};
use crumple::study::{Loaded, Study};
use crumple::{Error, Watch};
use serde_json::json;

use super::Answer;
use crate::options::DescribeArgs;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "The page needs no network; open it in any browser. Without --select and --threshold a mode is described as its saved descriptor was.\n\nExample:\n  crumple report study -o study.html"
)]
pub(crate) struct Report {
    /// Folder of the study
    study: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "FILE.html")]
    output: PathBuf,
    #[command(flatten)]
    describe: DescribeArgs,
}

impl Report {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let asked = self.describe.asked()?;
        let loaded = Loaded::open(&self.study)?;
        let modes = modes_of(&loaded.study, watch)?;
        let described = describe_modes(&loaded, &modes, asked.as_ref(), watch)?;
        let page = page(&findings(&loaded, &modes, &described)?)?;
        crumple::report::write(&self.output, &page)?;
        let bytes = page.len();
        output.print(&json!({ "file": self.output, "bytes": bytes }), || {
            format!("{} ({:.1} MB)", self.output.display(), bytes as f64 / 1e6)
        });
        Ok(Answer::Done)
    }
}

/// The modes of a study; found and saved first where it has none.
fn modes_of(study: &Study, watch: &dyn Watch) -> Result<Modes, Error> {
    match modes::load(study) {
        Err(Error::NoModes) => {
            let found = modes::modes(study, &ModesOptions::default(), watch)?;
            modes::save(study, &found)?;
            Ok(found)
        }
        other => other,
    }
}
