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
        // What the name meant before is gone: a mode of that name now is described anew, by its own medoid.
        let search = crumple!["search", &study, &mode.0, "--json"];
        match now.iter().find(|(name, _)| *name == mode.0) {
            Some((_, medoid)) => assert_eq!(search.done().json()["results"][0]["run"], **medoid),
            None => drop(search.refused(&["no descriptor", &mode.0]).hints("--mode")),
        }
    }
    // What the user has named himself stays.
    crumple!["search", &study, "mine"].done();
}

#[test]
fn a_mode_keeps_the_name_it_was_given_and_its_descriptor() {
    let place = folder();
    let study = own_study(place.path());
    crumple!["modes", &study, "--count", "3"].done();
    let mode = |told: &serde_json::Value, name: &str| -> serde_json::Value {
        let modes = rows(&told["modes"]);
        modes.iter().find(|mode| mode["name"] == name).unwrap_or_else(|| panic!("no {name}: {told}")).clone()
    };
    crumple!["describe", &study, "--mode", "mode-1"].done();
    let before = crumple!["search", &study, "mode-1", "--json"].done().json();
    let named = crumple!["modes", &study, "--name", "mode-1=crush", "--json"].done().json();
    assert_eq!(named["count"], 3, "the modes that are there are named, not found anew");
    let after = crumple!["search", &study, "crush", "--json"].done().json();
    assert_eq!(before["results"], after["results"]);
    crumple!["search", &study, "mode-1"].refused(&["no descriptor 'mode-1'"]);
    crumple!["describe", &study, "--mode", "crush"].done();
    // The next call keeps it with its runs; the page and the list know it.
    let again = crumple!["modes", &study, "--count", "3", "--method", "ward", "--json"].done().json();
    let (was, is) = (mode(&named, "crush"), mode(&again, "crush"));
    let shared = texts(&was["members"]).iter().filter(|run| texts(&is["members"]).contains(run)).count();
    assert!(2 * shared > rows(&was["members"]).len() && 2 * shared > rows(&is["members"]).len());
    assert!(crumple!["info", &study].done().stdout.contains("crush"));
    let page = place.path().join("page.html");
    crumple!["report", &study, "-o", &page].done();
    assert!(std::fs::read_to_string(&page).unwrap().contains("\"name\":\"crush\""));
    // Where no mode is it now, that is said.
    let one = crumple!["modes", &study, "--count", "1"].done();
    assert!(one.stderr.contains("no mode is 'crush' now"), "{}", one.stderr);
}

#[test]
fn runs_without_a_mode_go_through_everything() {
    let place = folder();
    let study = own_study(place.path());
    // No two groups of six of a dozen runs: no modes at all.
    let told = crumple!["modes", &study, "--method", "hdbscan", "--smallest", "12", "--json"].done().json();
    assert_eq!((rows(&told["modes"]).len(), rows(&told["without_mode"]).len()), (0, 12));
    for method in ["hdbscan", "mixture"] {
        let words = crumple!["modes", &study, "--method", method].done().stdout;
        assert!(words.contains("stability") && words.contains("silhouette"), "{words}");
        crumple!["report", &study, "-o", place.path().join("page.html")].done();
        crumple!["export", &study, "-o", place.path().join(method), "--format", "csv"].done();
        crumple!["compare", &study].done();
        crumple!["info", &study].done();
    }
    let series = crumple!["modes", &study, "--states", "series", "--align", "intrusion"].done();
    assert!(series.stderr.contains("which all reach"), "{}", series.stderr);
    crumple!["modes", &study, "--at-intrusion", "0.5", "--at-intrusion", "1"].done();
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
