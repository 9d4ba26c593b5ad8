//! The examples for optimisers and meta-models, as their READMEs start them, where their tools are here.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use world::{example, finish, folder, own_folder, repository, skipped};

/// A Python that has these modules: the one that is named, the one that CI makes, or that of the system.
fn python(modules: &str) -> Option<Command> {
    let made = repository().join("target/python/bin/python");
    let candidates = std::env::var_os("CRUMPLE_PYTHON")
        .map(|named| vec![PathBuf::from(named)])
        .unwrap_or_else(|| vec![made, PathBuf::from("python3")]);
    let has = |python: &PathBuf| {
        let import = Command::new(python).args(["-c", &format!("import {modules}")]).output();
        import.is_ok_and(|output| output.status.success())
    };
    let python = candidates.into_iter().find(has)?;
    let mut command = Command::new(python);
    command.env("PYTHONDONTWRITEBYTECODE", "1");
    Some(command)
}

/// All hundred runs with their inputs, and the descriptor `crush`.
fn study() -> &'static Path {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        let study = own_folder("hundred").join("study");
        crumple!["init", &study, "--reference", world::example_run("run_001"), "--join", "2.5", "-K", "100"].done();
        crumple!["add", &study, example().join("runs"), "--params", example().join("inputs.csv")].done();
        crumple!["describe", &study, "run_007", "--name", "crush"].done();
        study
    })
}

fn program() -> &'static str {
    env!("CARGO_BIN_EXE_crumple")
}

#[test]
fn dakotas_driver_answers_a_parameter_file() {
    let Some(mut python) = python("csv") else { return skipped("Python is not here") };
    let place = folder();
    // Dakota's standard format, as its user's manual shows it.
    let parameters = "                    2 variables\n  2.0e+00 thickness_mm\n  1.0e+02 notch_mm\n                    2 functions\n                    1 ASV_1:thickness\n                    1 ASV_2:distance\n                    2 derivative_variables\n                    1 DVV_1:thickness_mm\n                    2 DVV_2:notch_mm\n                    0 analysis_components\n                    1 eval_id\n";
    std::fs::write(place.path().join("params.in"), parameters).unwrap();
    let driver = repository().join("examples/optimizers/dakota/driver.py");
    python.arg(driver).args(["params.in", "results.out"]).current_dir(&place);
    python.env("CRUMPLE", program()).env("DESCRIPTOR", "crush");
    let mut answer = |study: &Path| {
        python.env("STUDY", study);
        let output = python.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read_to_string(place.path().join("results.out")).unwrap()
    };
    let lines: Vec<Vec<String>> =
        answer(study()).lines().map(|line| line.split_whitespace().map(str::to_owned).collect()).collect();
    assert_eq!(lines[0], ["2", "thickness"]);
    assert_eq!(lines[1][1], "distance");
    let told = crumple!["distance", study(), "crush", place.path().join("results.run")].done().stdout;
    assert!((lines[1][0].parse::<f64>().unwrap() - told.trim().parse::<f64>().unwrap()).abs() < 1e-9);
    assert_eq!(answer(&place.path().join("nowhere")), "FAIL\n", "what Dakota takes for a failed design");
}

#[test]
fn optuna_finds_a_thin_sheet_within_the_distance() {
    let Some(mut python) = python("optuna") else { return skipped("Python with optuna is not here") };
    python.arg(repository().join("examples/optimizers/optuna/optimise.py")).arg(study()).arg("crush");
    python.args(["--trials", "25", "--crumple", program()]);
    let told = finish(python).done().stdout;
    assert!(told.starts_with("25 trials, 25 with a number"), "{told}");
    let distance = told.split("distance ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    assert!(distance.parse::<f64>().unwrap() <= 0.2, "{told}");
}

#[test]
fn a_surrogate_predicts_the_deformation_better_than_the_mean() {
    let Some(mut python) = python("sklearn, pandas") else { return skipped("Python with scikit-learn is not here") };
    let place = folder();
    let table = place.path().join("features.csv");
    crumple!["features", study(), "crush", "-o", &table].done();
    python.arg(repository().join("examples/surrogate/predict.py")).arg(&table);
    let told = finish(python).done().stdout;
    let of = |model: &str| -> f64 {
        let line = told.lines().find(|line| line.starts_with("distance") && line.contains(model)).unwrap();
        line.rsplit(' ').next().unwrap().parse().unwrap()
    };
    assert_eq!(of("mean of the others"), 0.0, "{told}");
    assert!(of("random forest") > 0.0, "{told}");
}
