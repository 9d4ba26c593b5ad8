//! The report opens in a browser: it draws everything, without an error and without the network.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};
use std::process::Command;

use world::{DOZEN, dozen, example, folder};

const LARGEST: u64 = 8_000_000;

fn chromium() -> Option<PathBuf> {
    let named = std::env::var_os("CRUMPLE_CHROMIUM").map(PathBuf::from).unwrap_or_else(|| "chromium".into());
    let version = Command::new(&named).arg("--version").output();
    version.is_ok_and(|output| output.status.success()).then_some(named)
}

/// The page after its scripts have run; nothing where there is no browser.
fn opened(page: &Path) -> Option<String> {
    let Some(chromium) = chromium() else {
        world::skipped("Chromium is not here");
        return None;
    };
    let profile = folder();
    let mut command = Command::new(chromium);
    command.args([
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-unsafe-swiftshader",
        "--use-angle=swiftshader",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--virtual-time-budget=20000",
        "--dump-dom",
    ]);
    command.arg(format!("--user-data-dir={}", profile.path().display()));
    command.arg(format!("file://{}", page.display()));
    Some(world::finish(command).done().stdout)
}

/// Value of an attribute of the page's root.
fn root_attribute<'a>(page: &'a str, name: &str) -> &'a str {
    let root = page.split("<html").nth(1).and_then(|rest| rest.split('>').next()).expect("a page has a root");
    let start = format!("{name}=\"");
    root.split(&start)
        .nth(1)
        .and_then(|rest| rest.split('"').next())
        .unwrap_or_else(|| panic!("no {name}: <html{root}>"))
}

#[track_caller]
fn assert_drawn(page: &Path, runs: &[String]) {
    let text = std::fs::read_to_string(page).unwrap();
    assert!(page.metadata().unwrap().len() < LARGEST, "{} bytes", text.len());
    assert!(runs.iter().all(|run| text.contains(run.as_str())), "a run is not on the page");
    assert_no_network(&text);
    let Some(drawn) = opened(page) else { return };
    assert_eq!(root_attribute(&drawn, "data-errors"), "0");
    assert_eq!(root_attribute(&drawn, "data-ready"), "yes");
    assert_eq!(root_attribute(&drawn, "data-webgl"), "yes");
    let count = |name| root_attribute(&drawn, name).parse::<usize>().unwrap();
    assert!(count("data-charts") >= 5, "{} charts", count("data-charts"));
    assert!(count("data-shapes") >= 1, "{} shapes", count("data-shapes"));
    assert_no_network(&drawn);
}

/// Nothing is loaded from elsewhere: no element, style or script names an address of the network to load.
#[track_caller]
fn assert_no_network(page: &str) {
    let page = page.to_ascii_lowercase();
    let loads = ["src", "srcset", "data", "poster", "action"].map(|name| format!(" {name}="));
    for (attribute, quote) in loads.iter().flat_map(|attribute| ["\"", "'", ""].map(|quote| (attribute, quote))) {
        for address in ["http:", "https:", "//"] {
            let found = page.find(&format!("{attribute}{quote}{address}"));
            assert!(
                found.is_none(),
                "loads from the network: {}",
                &page[found.unwrap()..].chars().take(120).collect::<String>()
            );
        }
    }
    for tag in ["<link", "<iframe", "<embed", "<object"] {
        for element in page.split(tag).skip(1) {
            let element = element.split('>').next().unwrap();
            assert!(!element.contains("http:") && !element.contains("https:"), "{tag}{element}");
        }
    }
    for call in ["@import", "url(http", "url(\"http", "url('http", "url(//", "importscripts("] {
        assert!(!page.contains(call), "{call}");
    }
}

#[test]
fn the_report_of_the_dozen_is_drawn() {
    let place = folder();
    let page = place.path().join("report.html");
    crumple!["report", &dozen().study, "-o", &page].done();
    assert_drawn(&page, &DOZEN.map(str::to_owned));
    assert_drawn(&dozen().study.join("report.html"), &DOZEN.map(str::to_owned));
}

#[test]
fn the_report_of_the_whole_example_is_drawn() {
    let place = folder();
    let study = place.path().join("study");
    let inputs = example().join("inputs.csv");
    crumple!["analyze", example().join("runs"), "--params", inputs, "--join", "2.5", "-o", &study].done();
    let runs: Vec<String> = (1..=100).map(|number| format!("run_{number:03}")).collect();
    assert_drawn(&study.join("report.html"), &runs);
}

#[cfg(unix)]
#[test]
fn names_cannot_break_the_page() {
    let place = folder();
    let runs = place.path().join("runs");
    let names = ["a<b>&\"c\"", "</script><script>document.title=1", "x' onload='y", "Ünïcode ✓"];
    // A slash makes folders; the id is the path.
    for (name, run) in names.iter().zip(DOZEN) {
        world::copy(&world::example_run(run), &runs.join(name));
    }
    let study = place.path().join("study");
    crumple!["analyze", &runs, "-K", "12", "-o", &study].done();
    assert_drawn(&study.join("report.html"), &["Ünïcode ✓".to_owned()]);
}
