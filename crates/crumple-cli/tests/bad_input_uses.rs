//! Bad input to the commands that compare: one error each, that names what is wrong.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};

use world::{DOZEN, Outcome, Own, STRANGER, example_run, testdata};

/// A command as words; `STUDY`, `FILE` (a descriptor), `RUN` and `OUT` stand for paths.
fn ask(line: &str, study: &Path, file: &Path, run: &Path, out: &Path) -> Outcome {
    let mut command = world::program();
    for word in line.split_whitespace() {
        match word {
            "STUDY" => command.arg(study),
            "FILE" => command.arg(file),
            "RUN" => command.arg(run),
            "OUT" => command.arg(out),
            word => command.arg(word),
        };
    }
    world::finish(command)
}

/// Every command that takes a descriptor.
const OF_A_DESCRIPTOR: [&str; 8] = [
    "search STUDY FILE",
    "verify STUDY FILE run_001",
    "verify STUDY FILE --calibrate",
    "distance STUDY FILE run_001",
    "features STUDY FILE",
    "monitor STUDY FILE RUN --timeout 1 --tolerance 0.1",
    "reconstruct STUDY run_001 --descriptor FILE -o OUT",
    "export STUDY --descriptor FILE -o OUT",
];

#[test]
fn a_descriptor_of_another_basis() {
    let own = Own::new();
    let other = own.beside("other");
    crumple!["init", &other, "--reference", example_run("run_001"), "-K", "30"].done();
    crumple!["add", &other, example_run("run_007")].done();
    crumple!["describe", &other, "run_007", "--name", "foreign"].done();
    let (file, run) = (other.join("descriptors/foreign.json"), example_run(STRANGER));
    for line in OF_A_DESCRIPTOR {
        ask(line, &own.study(), &file, &run, &own.beside("shape.stl")).refused(&["'foreign'", "another eigenbasis"]);
    }
}

#[test]
fn a_study_without_runs() {
    let own = Own::new();
    let study = own.beside("empty");
    crumple!["init", &study, "--reference", example_run("run_001"), "-K", "12"].done();
    let (run, out) = (example_run(STRANGER), own.beside("shape.stl"));
    for (line, says) in [
        ("search STUDY run_001", "'run_001'"),
        ("verify STUDY run_001 --calibrate", "'run_001'"),
        ("distance STUDY run_001 RUN", "'run_001'"),
        ("features STUDY run_001", "'run_001'"),
        ("monitor STUDY run_001 RUN", "'run_001'"),
        ("explain STUDY run_001 RUN", "'run_001'"),
        ("isometry STUDY run_001", "'run_001'"),
        ("reconstruct STUDY run_001 -o OUT", "'run_001'"),
        ("modes STUDY", "at least 3 runs"),
        ("classify STUDY RUN", "no modes yet"),
        ("compare STUDY", "no modes yet"),
    ] {
        let refused = ask(line, &study, &out, &run, &out).refused(&[says]);
        assert!(refused.stderr.contains("hint: "), "{line}: {}", refused.stderr);
    }
}

#[test]
fn a_state_that_the_run_does_not_have() {
    let own = Own::new();
    let (run, out) = (example_run(STRANGER), own.beside("shape.stl"));
    for line in [
        "search STUDY run_001@9",
        "verify STUDY target run_001@9",
        "distance STUDY target run_001@9",
        "features STUDY target run_001@9",
        "features STUDY run_001@9",
        "classify STUDY run_001@9",
        "explain STUDY run_007 run_001@9",
        "isometry STUDY run_001@9",
        "monitor STUDY run_001@9 RUN",
        "describe STUDY run_001@9",
        "reconstruct STUDY run_001@9 -o OUT",
    ] {
        ask(line, &own.study(), &out, &run, &out).refused(&["run_001 has 4 states", "no @9"]);
    }
}

#[test]
fn a_run_without_the_part() {
    let own = Own::new();
    let (run, out) = (testdata("s01_shells_latin1"), own.beside("shape.stl"));
    for line in [
        "search STUDY RUN",
        "verify STUDY target RUN",
        "distance STUDY target RUN",
        "features STUDY target RUN",
        "classify STUDY RUN",
        "explain STUDY run_007 RUN",
        "isometry STUDY RUN",
        "monitor STUDY target RUN --timeout 1 --tolerance 0.1",
        "describe STUDY RUN",
        "reconstruct STUDY RUN -o OUT",
        "add STUDY RUN",
    ] {
        let refused =
            ask(line, &own.study(), &out, &run, &out).refused(&["does not have the study's mesh", "node 1001"]);
        assert!(refused.stderr.contains("hint: "), "{line}: {}", refused.stderr);
    }
}

#[test]
fn a_threshold_that_chooses_nothing_because_all_or_none_pass() {
    let own = Own::new();
    let study = own.study();
    let page = own.beside("page.html");
    for (rule, says) in [
        ("value:0", "all 40 eigenvectors"),
        ("std:-50", "all 40 eigenvectors"),
        ("value:1e9", "no coefficient is larger"),
        ("std:90", "no coefficient is larger"),
    ] {
        crumple!["describe", &study, "run_007", "--threshold", rule].refused(&[rule.split(':').next().unwrap(), says]);
        crumple!["compare", &study, "--threshold", rule].refused(&[says]);
        crumple!["report", &study, "-o", &page, "--threshold", rule].refused(&[says]);
    }
}

#[test]
fn a_mode_of_one_run() {
    let own = Own::new();
    let study = own.beside("few");
    crumple!["init", &study, "--reference", example_run("run_001"), "-K", "12"].done();
    let runs: Vec<PathBuf> = DOZEN.iter().take(3).map(|run| example_run(run)).collect();
    crumple!["add", &study, &runs[0], &runs[1], &runs[2]].done();
    crumple!["modes", &study, "--count", "3"].done();
    let stranger = example_run(STRANGER);
    // It can be described and searched; nothing can be learned from its members.
    crumple!["describe", &study, "--mode", "mode-1", "--set", "mean"].done();
    crumple!["search", &study, "mode-1"].done();
    crumple!["verify", &study, "mode-1", "--calibrate"]
        .refused(&["calibration", "at least 3 runs"])
        .hints("add more runs");
    crumple!["monitor", &study, "mode-1", &stranger, "--timeout", "1"]
        .refused(&["--tolerance", "mode-1 has 0 runs beside"]);
    let told = crumple!["classify", &study, &stranger].done();
    assert!(told.stdout.contains("any") && !told.stdout.contains("inf"), "{}", told.stdout);
}

#[test]
fn eigenvalues_that_the_basis_does_not_have() {
    let own = Own::new();
    for count in ["0", "40", "4000"] {
        crumple!["isometry", own.study(), "run_001", "--eigenvalues", count].refused(&["--eigenvalues", "1 to"]);
    }
    let found = crumple!["isometry", own.study(), "run_001", "--eigenvalues", "10", "--json"].done().json();
    let states = found["states"].as_array().unwrap();
    assert_eq!((states.len(), states[0]["edges"]["max"].as_f64()), (4, Some(0.0)));
    let shift = &found["eigenvalues"]["shift"];
    assert_eq!(shift["count"], 10);
    assert!(shift["median"].as_f64().unwrap() > 0.0 && found["thin"] == true, "a crushed beam is stretched: {found}");
    assert!(crumple!["isometry", own.study(), "run_001@1"].done().stdout.contains("hardly stretches"));
}
