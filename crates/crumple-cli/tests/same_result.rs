//! The same question has the same answer: on one thread or two, now or later, and in the same bytes.

#[macro_use]
mod world;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;
use world::{DOZEN, Snapshot, example, folder, own_folder, snapshot};

const THREADS: [&str; 3] = ["1", "2", "1"];

/// The same bundle, analyzed with one thread, with two, and with one again.
fn studies() -> Vec<PathBuf> {
    let place = own_folder("studies");
    let runs = world::copy_runs(DOZEN, &place.join("runs"));
    let analyze = |(threads, number): (&str, usize)| {
        let study = place.join(number.to_string()).join("study");
        let inputs = example().join("inputs.csv");
        crumple!["analyze", &runs, "--params", &inputs, "-o", &study, "--threads", threads, "--seed", "7"].done();
        study
    };
    THREADS.into_iter().zip(1..).map(analyze).collect()
}

/// Everything that is an answer: not the locks.
fn bytes(study: &Path) -> Snapshot {
    snapshot(study).into_iter().filter(|(name, _)| !name.ends_with(".lock") && !name.ends_with(".writers")).collect()
}

fn asked(study: &Path, threads: &str) -> BTreeMap<&'static str, Value> {
    let labels = example().join("labels.csv");
    let ask = |words: &[&str]| {
        let mut command = world::program();
        command.arg(words[0]).arg(study).args(&words[1..]).args(["--json", "--threads", threads]);
        if words[0] == "compare" {
            command.arg("--labels").arg(&labels);
        }
        let mut told = world::finish(command).done().json();
        if let Some(facts) = told.as_object_mut() {
            facts.remove("path"); // names the study, which differs
        }
        told
    };
    BTreeMap::from([
        ("modes", ask(&["modes", "--seed", "7"])),
        ("modes, 3", ask(&["modes", "--count", "3", "--seed", "7"])),
        ("modes, ward", ask(&["modes", "--method", "ward"])),
        ("describe", ask(&["describe", "run_007", "--name", "target"])),
        ("describe, error", ask(&["describe", "run_007@2", "--threshold", "error:12"])),
        ("search", ask(&["search", "target"])),
        ("search, all states", ask(&["search", "target", "--states", "all", "--top", "100"])),
        ("search, mahalanobis", ask(&["search", "target", "--metric", "mahalanobis"])),
        ("compare", ask(&["compare"])),
    ])
}

#[test]
fn results_do_not_depend_on_threads_or_on_the_time_of_day() {
    let studies = studies();
    let first = bytes(&studies[0]);
    assert!(first.contains_key(Path::new("basis.safetensors")));
    assert!(first.keys().any(|name| name.starts_with("coefficients") && name.extension().is_some()));
    for (study, threads) in studies.iter().zip(THREADS).skip(1) {
        world::assert_same(&first, &bytes(study), &format!("the study made with {threads} threads"));
    }
    let answers = asked(&studies[0], "1");
    for (study, threads) in studies.iter().zip(["1", "2", "2"]) {
        for (question, answer) in asked(study, threads) {
            assert_eq!(answer, answers[question], "{question} with {threads} threads");
        }
    }
}

#[test]
fn the_order_of_the_runs_does_not_matter() {
    let place = folder();
    let runs = world::copy_runs(DOZEN, &place.path().join("runs"));
    let answers: Vec<Value> = [DOZEN.to_vec(), DOZEN.iter().rev().copied().collect()]
        .iter()
        .zip(["forth", "back"])
        .map(|(order, name)| {
            let study = place.path().join(name);
            crumple!["init", &study, "--reference", runs.join("run_001"), "-K", "40"].done();
            for run in order {
                crumple!["add", &study, runs.join(run)].done();
            }
            crumple!["describe", &study, "run_007"].done();
            let modes = crumple!["modes", &study, "--count", "3", "--json"].done().json();
            let search = crumple!["search", &study, "run_007", "--json"].done().json();
            serde_json::json!([modes, search])
        })
        .collect();
    assert_eq!(answers[0], answers[1]);
}

#[test]
fn another_seed_is_another_start_but_the_seed_is_told() {
    let own = world::Own::new();
    let modes = |seed: &str| crumple!["modes", own.study(), "--count", "4", "--seed", seed, "--json"].done().json();
    for seed in ["1", "2", "3"] {
        let told = modes(seed);
        assert_eq!(told["seed"], seed.parse::<u64>().unwrap());
        assert_eq!(told, modes(seed));
    }
}
