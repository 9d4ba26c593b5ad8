//! What happens the second time: modes that change, a bundle that grows, a run that ended early.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};

use world::{dozen, example_run, folder, rows, texts};

/// A copy of the dozen's study.
fn own_study(place: &Path) -> PathBuf {
    let study = place.join("study");
    world::copy(&dozen().study, &study);
    study
}

/// A copy of run_001, whose states are in one file, with that file cut after three fifths of its length.
fn cut_run(to: &Path) -> PathBuf {
    world::copy(&example_run("run_001"), to);
    let states = std::fs::File::options().write(true).open(to.join("d3plot01")).unwrap();
    let length = states.metadata().unwrap().len();
    states.set_len(length * 3 / 5).unwrap();
    to.to_owned()
}

#[test]
fn a_study_tells_what_it_holds() {
    let place = folder();
    let study = own_study(place.path());
    crumple!["describe", &study, "run_001", "--name", "mine"].done();
    let told = crumple!["info", &study, "--json"].done().json();
    assert_eq!(texts(&told["runs"]), world::DOZEN);
    assert!(texts(&told["descriptors"]).contains(&"mine"));
    assert_eq!(rows(&told["modes"]).len(), rows(&dozen().analyzed["modes"]["modes"]).len());
    assert_eq!((&told["vertices"], &told["eigenpairs"]), (&1862.into(), &500.into()));
    assert!(crumple!["info", &study].done().stdout.contains("run_001"));
}

#[test]
fn descriptors_of_modes_that_are_gone_go_with_them() {
    let place = folder();
    let study = own_study(place.path());
    crumple!["describe", &study, "run_001", "--name", "mine"].done();
    let medoids = |told: &serde_json::Value| -> Vec<(String, String)> {
        let text = |mode: &serde_json::Value, key: &str| mode[key].as_str().unwrap().to_owned();
        rows(&told["modes"]).iter().map(|mode| (text(mode, "name"), text(mode, "medoid"))).collect()
    };
    let before = medoids(&dozen().analyzed["modes"]);
    let now = medoids(&crumple!["modes", &study, "--count", "5", "--by", "displacement", "--json"].done().json());
    assert_ne!(before, now);
    for mode in &before {
        let search = crumple!["search", &study, &mode.0, "--json"];
        if now.contains(mode) {
            search.done();
        } else {
            search.refused(&["no descriptor", &mode.0]).hints("--mode");
        }
    }
    // What the user has named himself stays.
    crumple!["search", &study, "mine"].done();
}

#[test]
fn a_page_is_made_as_asked_and_else_as_saved() {
    let place = folder();
    let study = own_study(place.path());
    let page = |name: &str, arguments: &[&str]| {
        let file = place.path().join(name);
        let mut command = world::program();
        command.arg("report").arg(&study).arg("-o").arg(&file).args(arguments);
        world::finish(command).done();
        std::fs::read_to_string(file).unwrap()
    };
    let saved = page("saved.html", &[]);
    assert!(saved.contains("mean + 1 standard deviation of all"));
    let asked = page("asked.html", &["--threshold", "top:3"]);
    assert!(asked.contains("the 3 largest") && !asked.contains("mean + 1 standard deviation of all"));
    assert_eq!(page("again.html", &[]), saved);
}

#[test]
fn a_study_keeps_its_reference_when_an_earlier_name_comes() {
    let place = folder();
    let runs = world::copy_runs(["run_003", "run_004", "run_005"], &place.path().join("runs"));
    let study = place.path().join("study");
    let analyze = || crumple!["analyze", &runs, "-o", &study, "-K", "30", "--json"].done().json();
    assert_eq!(analyze()["init"]["reference"], "run_003");
    // This run has a notch, and so a part, that run_003 does not have.
    world::copy_runs(["run_001"], &runs);
    let told = analyze();
    assert_eq!(told["init"]["reference"], "run_003");
    assert_eq!(texts(&told["add"]["added"]), ["run_001"]);
}

#[test]
fn a_run_that_ended_early_is_judged_with_a_word() {
    let place = folder();
    let study = own_study(place.path());
    let cut = cut_run(&place.path().join("cut"));
    let mode = dozen().analyzed["modes"]["modes"][0]["name"].as_str().unwrap();
    let verified = crumple!["verify", &study, mode, &cut, "--threshold", "-1", "--json"].done();
    let warnings = texts(&verified.json()["results"][0]["warnings"]).join("; ");
    assert!(warnings.contains("d3plot01") && warnings.contains("the descriptor's at"), "{warnings}");
    let measured = crumple!["distance", &study, mode, &cut].done();
    assert!(measured.stderr.contains("note: ") && measured.stderr.contains("d3plot01"), "{}", measured.stderr);
    assert!(measured.stdout.trim().parse::<f64>().is_ok(), "the number and nothing else: {}", measured.stdout);
    crumple!["add", &study, &cut].done();
    let modes = crumple!["modes", &study].done();
    assert!(modes.stderr.contains("well before the others (cut at"), "{}", modes.stderr);
}
