//! `crumple convert` and `crumple info --ranges`: what we write, lasso-python and VTK read with the same numbers; what we
//! read are the numbers that the families are known to hold.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use world::{folder, repository, rows, testdata};

/// A Python with lasso-python and VTK: the one that is named, the one that CI makes, or that of the system.
fn python() -> Option<PathBuf> {
    let made = repository().join("target/python/bin/python");
    let candidates = std::env::var_os("CRUMPLE_PYTHON")
        .map(|named| vec![PathBuf::from(named)])
        .unwrap_or_else(|| vec![made, PathBuf::from("python3")]);
    let found = candidates.into_iter().find(|python| {
        let import = Command::new(python).args(["-c", "import lasso.dyna, vtkmodules.vtkIOLSDyna"]).output();
        import.is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        world::skipped("Python with lasso-python and vtk is not here");
    }
    found
}

/// What another program finds in a family.
fn read_with(python: &Path, program: &str, root: &Path) -> Value {
    let mut command = Command::new(python);
    command.env("PYTHONDONTWRITEBYTECODE", "1").arg(repository().join("tests-python/read_d3plot.py"));
    world::finish({
        command.arg(program).arg(root);
        command
    })
    .done()
    .json()
}

fn info(run: &Path) -> Value {
    crumple!["info", run, "--ranges", "--json"].done().json()
}

/// Families that other programs read once they are written again, and what they have.
const CONVERTED: [&str; 7] = [
    "s01_shells_latin1",
    "s02_double_solids",
    "s03_big_endian_mix",
    "s09_cut_in_state",
    "s11_gbk_garbage",
    "lasso_solid_int",
    "lasso_order",
];

/// Single precision holds 24 bits, and the other programs add up in an order of their own.
const RELATIVE: f64 = 1e-6;

#[track_caller]
fn agree(what: &str, ours: &Value, other: &Value) {
    match (ours, other) {
        (Value::Array(ours), Value::Array(other)) => {
            assert_eq!(ours.len(), other.len(), "{what}");
            ours.iter().zip(other).for_each(|(ours, other)| agree(what, ours, other));
        }
        _ => {
            let (ours, other) = (ours.as_f64().unwrap(), other.as_f64().unwrap());
            // sums of terms that cancel are as exact as the terms
            assert!((ours - other).abs() <= RELATIVE * ours.abs().max(1e3), "{what}: {ours} here, {other} there");
        }
    }
}

#[test]
fn what_is_written_other_programs_read_with_the_same_numbers() {
    let Some(python) = python() else { return };
    for family in CONVERTED {
        let place = folder();
        let root = place.path().join("out/d3plot");
        let told = crumple!["convert", testdata(family), "-o", &root, "--json"].done().json();
        // the numbers are those of the family it was made of
        let ours = info(&testdata(family));
        assert_eq!(told["states"], ours["states"], "{family}");
        // VTK 9.7.2 dies on these two by a signal, as LS-DYNA wrote them and as they are written here
        let programs = if family.starts_with("lasso_") { &["lasso"][..] } else { &["lasso", "vtk"] };
        for &program in programs {
            let theirs = read_with(&python, program, &root);
            agree(&format!("{family}, times, {program}"), &ours["times"], &theirs["times"]);
            for (state, theirs) in ["first_state", "last_state"].iter().zip(rows(&theirs["states"])) {
                for field in ["coordinates", "velocity"] {
                    if ours[state][field].is_null() || theirs[field].is_null() {
                        assert!(
                            program == "vtk" || ours[state][field] == theirs[field],
                            "{family}: {field}, {program}"
                        );
                        continue;
                    }
                    // VTK shows the nodes of elements only, and those of a part once for each part
                    let keys: &[&str] = if program == "lasso" { &["min", "max", "sum"] } else { &[] };
                    for key in keys {
                        let what = format!("{family}: {key} of {field}, {state}, {program}");
                        agree(&what, &ours[state][field][key], &theirs[field][key]);
                    }
                    if program == "vtk" {
                        within(&format!("{family}: {field}, {state}"), &theirs[field], &ours[state][field]);
                    }
                }
                if program == "lasso" && !ours[state]["shell_plastic_strain"].is_null() {
                    let (ours, theirs) = (&ours[state]["shell_plastic_strain"], &theirs["plastic_strain"]);
                    agree(&format!("{family}: plastic strain"), &ours["min"], &theirs["min"][0]);
                    agree(&format!("{family}: plastic strain"), &ours["max"], &theirs["max"][0]);
                    agree(&format!("{family}: plastic strain"), &ours["sum"], &theirs["sum"][0]);
                }
            }
        }
    }
}

/// VTK's nodes are among ours, and in a mesh of elements alone they are all.
fn within(what: &str, theirs: &Value, ours: &Value) {
    for axis in 0..3 {
        let number = |of: &Value, key: &str| of[key][axis].as_f64().unwrap();
        assert!(number(theirs, "min") >= number(ours, "min") - 1e-6, "{what}");
        assert!(number(theirs, "max") <= number(ours, "max") + 1e-6, "{what}");
        // most of the box is theirs, too: not nothing, not another state
        assert!(number(theirs, "max") - number(theirs, "min") >= 0.0, "{what}");
    }
}

#[test]
fn a_converted_run_is_the_run() {
    for (options, precision) in [
        (&[][..], "single"),
        (&["--precision", "double"], "double"),
        (&["--byte-order", "big"], "single"),
        (&["--file-bytes", "8192"], "single"),
        (&["--file-states", "1"], "single"),
    ] {
        let place = folder();
        let root = place.path().join("d3plot");
        let mut command = world::program();
        command.arg("convert").arg(testdata("s01_shells_latin1")).arg("-o").arg(&root).args(options);
        world::finish(command).done();
        let (before, after) = (info(&testdata("s01_shells_latin1")), info(&root));
        assert_eq!(after["precision"], precision);
        for key in ["title", "nodes", "elements", "parts", "states", "times", "fields", "first_state", "last_state"] {
            assert_eq!(before[key], after[key], "{options:?}: {key}");
        }
        assert_eq!(rows(&after["warnings"]).len(), 0, "{options:?}");
    }
    // nothing is overwritten
    let place = folder();
    let root = place.path().join("d3plot");
    crumple!["convert", testdata("s01_shells_latin1"), "-o", &root].done();
    crumple!["convert", testdata("s12_node_deletion"), "-o", &root].refused(&["already there"]).hints("another file");
    crumple!["convert", "--quiet", testdata("x03_rigid_nodes"), "-o", place.path().join("other")]
        .refused(&["rigid bodies"]);
    crumple!["convert", testdata("s01_shells_latin1"), "-o", place.path().join("b"), "--precision", "half"]
        .refused(&["--precision", "single or double"]);
}

#[test]
fn ranges_are_those_that_the_families_are_known_to_hold() {
    let mut folders = vec![repository().join("crates/d3plot/testdata")];
    let shared = repository().join("../shared/data");
    if shared.is_dir() {
        folders.extend([shared.join("d3plot"), shared.join("d3plot-synthetic")]);
    }
    let mut checked = 0;
    for family in folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap()) {
        let family = family.unwrap().path();
        let Ok(text) = std::fs::read_to_string(family.join("expected.json")) else { continue };
        let known: Value = serde_json::from_str(&text).unwrap();
        let (root, known) = (family.join(known["root"].as_str().unwrap()), &known["expected"]);
        if known.get("error").is_some() {
            assert_eq!(crumple!["info", &root, "--json"].code, Some(2), "{}", root.display());
            continue;
        }
        for map in [false, true] {
            let mut command = world::program();
            command.arg("info").arg(&root).args(["--ranges", "--json"]).args(map.then_some("--map"));
            let found = world::finish(command).done().json();
            compare(&root, &found, known);
        }
        checked += 1;
    }
    assert!(checked >= 28, "{checked}");
}

fn compare(root: &Path, found: &Value, known: &Value) {
    let names = [("nodes", "n_nodes"), ("states", "n_states")];
    names.iter().for_each(|(ours, theirs)| assert_eq!(found[*ours], known[*theirs], "{}", root.display()));
    for (ours, theirs) in
        [("solids", "n_solids"), ("thick_shells", "n_thick_shells"), ("beams", "n_beams"), ("shells", "n_shells")]
    {
        assert_eq!(found["elements"][ours], known[theirs], "{}", root.display());
    }
    assert_eq!((&found["precision"], &found["byte_order"]), (&known["precision"], &known["byte_order"]));
    agree("times", &found["times"], &known["times"]);
    for state in ["first_state", "last_state"] {
        let Some(fields) = known[state].as_object() else { continue };
        for (field, known) in fields {
            let found = &found[state][field];
            let what = format!("{}: {field} of {state}", root.display());
            match known {
                Value::Object(known) if field == "deletion_table" => {
                    assert_eq!(found.as_object(), Some(known), "{what}")
                }
                Value::Object(known) => known.iter().for_each(|(key, known)| agree(&what, &found[key], known)),
                Value::Null => assert!(found.is_null(), "{what}"),
                known => agree(&what, found, known),
            }
        }
    }
}

#[test]
fn info_says_units_and_materials_and_why() {
    let run = crumple!["info", world::example_run("run_007"), "--json"].done().json();
    assert_eq!((&run["units"]["length"], &run["units"]["time"]), (&"mm".into(), &"ms".into()));
    assert!(run["units"]["reason"].as_str().unwrap().contains("across"));
    assert_eq!(run["solver"], "LS-DYNA R712");
    let rigid = crumple!["info", testdata("s08_rigid_shells"), "--json"].done().json();
    assert!(rows(&rigid["parts"]).iter().any(|part| part["material"] == 20), "{rigid}");
    let words = crumple!["info", testdata("s08_rigid_shells"), "--ranges"].done().stdout;
    assert!(words.contains("material") && words.contains("shell_plastic_strain"), "{words}");
}
