//! What we write, the tools of our users open: pandas, polars, DuckDB, NumPy, safetensors, VTK.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use world::{DOZEN, STATES, dozen, folder, repository};

const MISSING: &str = "Python with pandas, polars, duckdb, safetensors, vtk is not here";

/// A Python that has what the scripts need: the one that is named, the one that CI makes, or that of the system.
fn python() -> Option<PathBuf> {
    let made = repository().join("target/python/bin/python");
    let candidates = std::env::var_os("CRUMPLE_PYTHON")
        .map(|named| vec![PathBuf::from(named)])
        .unwrap_or_else(|| vec![made, PathBuf::from("python3")]);
    candidates.into_iter().find(|python| {
        let import =
            Command::new(python).args(["-c", "import pandas, polars, duckdb, safetensors, vtk, numpy"]).output();
        import.is_ok_and(|output| output.status.success())
    })
}

/// Runs a script of tests-python; its one line of JSON, or nothing where there is no Python.
fn open_with(script: &str, argument: &Path) -> Option<Value> {
    let Some(python) = python() else {
        world::skipped(MISSING);
        return None;
    };
    let mut command = Command::new(python);
    // Nothing is written beside the scripts.
    command.env("PYTHONDONTWRITEBYTECODE", "1").arg(repository().join("tests-python").join(script)).arg(argument);
    Some(world::finish(command).done().json())
}

#[test]
fn a_study_opens() {
    let Some(seen) = open_with("open_study.py", &dozen().study) else { return };
    let modes = world::rows(&dozen().analyzed["modes"]["modes"]).len();
    let expected = json!({
        "points": 1862, "triangles": 3456, "eigenpairs": 500, "runs": DOZEN.len(), "states": STATES * DOZEN.len(), "modes": modes,
    });
    assert_eq!(seen, expected);
}

#[test]
fn a_study_with_its_sheets_joined_that_grew_and_changed_opens() {
    let place = folder();
    let study = place.path().join("study");
    crumple!["init", &study, "--reference", world::example_run("run_001"), "-K", "40", "--join", "2.5"].done();
    for run in DOZEN {
        crumple!["add", &study, world::example_run(run)].done();
    }
    let changed = place.path().join("run_007");
    world::copy(&world::example_run("run_051"), &changed);
    crumple!["add", &study, &changed, "--replace"].done();
    let Some(seen) = open_with("open_study.py", &study) else { return };
    assert_eq!((&seen["runs"], &seen["eigenpairs"], &seen["modes"]), (&DOZEN.len().into(), &40.into(), &Value::Null));
}

#[test]
fn an_export_opens_and_its_formats_agree() {
    let place = folder();
    let export = |format: &str, options: &[&str]| {
        let mut command = world::program();
        command.arg("export").arg(&dozen().study).arg("-o").arg(place.path()).args(["--format", format]).args(options);
        world::finish(command).done();
    };
    let (k, rows) = (500, STATES * DOZEN.len());
    export("csv", &[]);
    export("parquet", &[]);
    let Some(seen) = open_with("check_export.py", place.path()) else { return };
    let arrays = json!({
        "eigenvalues.npy": [k], "eigenvectors.npy": [k, 1862], "mass.npy": [1862], "baseline.npy": [k, 3],
        "vertices.npy": [1862, 3], "triangles.npy": [3456, 3], "node_ids.npy": [1862], "coefficients.npy": [rows, k, 3],
    });
    for (name, shape) in arrays.as_object().unwrap() {
        assert_eq!(seen["arrays"][name], *shape, "{name}");
    }
    for format in ["csv", "parquet"] {
        assert_eq!(seen["tables"][format!("coefficients.{format}")], json!([rows, 3 + 3 * k]));
        assert_eq!(seen["tables"][format!("runs.{format}")][0], DOZEN.len());
        assert_eq!(seen["tables"][format!("modes.{format}")][0], DOZEN.len());
    }

    let mode = dozen().analyzed["modes"]["modes"][0]["name"].as_str().unwrap();
    let size = dozen().analyzed["descriptors"][0]["size"].as_u64().unwrap();
    export("csv", &["--last", "--descriptor", mode]);
    export("parquet", &["--last", "--descriptor", mode]);
    let seen = open_with("check_export.py", place.path()).unwrap();
    assert_eq!(seen["arrays"]["coefficients.npy"], json!([DOZEN.len(), size, 3]));
    assert_eq!(seen["tables"]["coefficients.csv"], json!([DOZEN.len(), 3 + 3 * size]));
}
