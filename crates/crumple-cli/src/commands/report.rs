//! `crumple report`: one page.

use std::path::PathBuf;

use clap::Args;
use crumple::descriptor::DescribeOptions;
use crumple::modes::{self, ModesOptions};
use crumple::report::{findings, page};
use crumple::study::Loaded;
use crumple::{Error, Watch};
use serde_json::json;

use super::Answer;
use crate::options::DescribeArgs;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "The page needs no network; open it in any browser.\n\nExample:\n  crumple report study -o study.html"
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
        let options = self.describe.options()?;
        let loaded = Loaded::open(&self.study)?;
        let page = make(&loaded, &options, watch)?;
        crumple::report::write(&self.output, &page)?;
        let bytes = page.len();
        output.print(&json!({ "file": self.output, "bytes": bytes }), || {
            format!("{} ({:.1} MB)", self.output.display(), bytes as f64 / 1e6)
        });
        Ok(Answer::Done)
    }
}

/// The page; finds the modes first where the study has none.
pub(crate) fn make(loaded: &Loaded, options: &DescribeOptions, watch: &dyn Watch) -> Result<String, Error> {
    let modes = match modes::load(&loaded.study) {
        Err(Error::NoModes) => {
            let found = modes::modes(&loaded.study, &ModesOptions::default(), watch)?;
            modes::save(&loaded.study, &found)?;
            found
        }
        other => other?,
    };
    page(&findings(loaded, &modes, options, watch)?)
}
