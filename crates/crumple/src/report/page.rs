//! The page: a template, a style, scripts and the findings in one file that needs no network.

use std::path::{Path, PathBuf};

use minijinja::{Environment, context};

use super::Findings;
use crate::Error;
use crate::study::{Study, store};

const TEMPLATE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/css/page.css");
const VENDOR: &str = include_str!("page/vendor/vendor.min.js");
/// In the order in which they use each other.
const SCRIPTS: [&str; 7] = [
    include_str!("page/js/data.js"),
    include_str!("page/js/shapes.js"),
    include_str!("page/js/cloud.js"),
    include_str!("page/js/charts.js"),
    include_str!("page/js/table.js"),
    include_str!("page/js/sections.js"),
    include_str!("page/js/main.js"),
];

/// The page as HTML.
///
/// # Errors
/// [`Error::Internal`] if the template and its values do not fit together.
pub fn page(findings: &Findings) -> Result<String, Error> {
    let internal = |error: String| Error::Internal(error);
    let json = serde_json::to_string(findings).map_err(|error| internal(error.to_string()))?;
    let mut environment = Environment::new();
    environment.add_template("page.html", TEMPLATE).map_err(|error| internal(error.to_string()))?;
    let template = environment.get_template("page.html").map_err(|error| internal(error.to_string()))?;
    let values = context! {
        title => findings.title(),
        // Without a < nothing inside the script element can end it or open a comment.
        findings_json => json.replace('<', "\\u003c"),
        style => STYLE,
        vendor => VENDOR,
        script => SCRIPTS.join("\n"),
    };
    template.render(values).map_err(|error| internal(error.to_string()))
}

/// Writes the page into its study, as `report.html`; returns its path.
///
/// # Errors
/// [`Error::Io`].
pub fn save(study: &Study, page: &str) -> Result<PathBuf, Error> {
    let _writing = study.writing()?;
    let path = study.folder().join("report.html");
    write(&path, page)?;
    Ok(path)
}

/// Writes the page to a file.
///
/// # Errors
/// [`Error::Io`].
pub fn write(path: &Path, page: &str) -> Result<(), Error> {
    store::write_bytes(path, page.as_bytes())
}
