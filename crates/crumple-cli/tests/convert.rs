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

/// What another program finds in families.
fn read_with(python: &Path, program: &str, roots: &[PathBuf]) -> Vec<Value> {
    let mut command = Command::new(python);
    command.env("PYTHONDONTWRITEBYTECODE", "1").arg(repository().join("tests-python/read_d3plot.py"));
    let told = world::finish({
        command.arg(program).args(roots);
        command
    })
    .done()
    .stdout;
    told.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn info(run: &Path) -> Value {
    crumple!["info", run, "--ranges", "--json"].done().json()
}

/// Families that VTK 9.7.2 does not read in any form: solids of eight points, user numbers beyond 32 bits.
const NOT_BY_VTK: [&str; 4] = ["lasso_order", "lasso_solid_int", "x01_wide_numbers", "x06_ten_node_tetrahedra"];

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
    let place = folder();
    let (mut names, mut ours) = (Vec::new(), Vec::new());
    for family in std::fs::read_dir(testdata("")).unwrap() {
        let name = family.unwrap().file_name().into_string().unwrap();
        let Ok(text) = std::fs::read_to_string(testdata(&name).join("expected.json")) else { continue };
        let known: Value = serde_json::from_str(&text).unwrap();
        if known["expected"].get("error").is_some() {
            continue;
        }
        let run = testdata(&name).join(known["root"].as_str().unwrap());
        let told = crumple!["convert", &run, "-o", place.path().join(&name).join("d3plot"), "--json"].done().json();
        // the numbers are those of the family it was made of
        let found = info(&run);
        assert_eq!(told["states"], found["states"], "{name}");
        names.push(name);
        ours.push(found);
    }
    assert_eq!(names.len(), 28);
    // other words, other sizes of files
    for (options, name) in [
        (&["--precision", "double"][..], "s01_shells_latin1"),
        (&["--precision", "single", "--file-states", "1"], "s02_double_solids"),
        (&["--file-bytes", "65536"], "s03_big_endian_mix"),
        (&["--precision", "double", "--file-states", "2"], "s09_cut_in_state"),
    ] {
        let mut command = world::program();
        let root = place.path().join(format!("{name} {}", options.join(" "))).join("d3plot");
        command.arg("convert").arg(testdata(name)).arg("-o").arg(&root).args(options);
        world::finish(command).done();
        names.push(root.parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned());
        ours.push(info(&testdata(name)));
    }
    let roots = |names: &[&String]| names.iter().map(|name| place.path().join(name).join("d3plot")).collect::<Vec<_>>();
    let by_lasso = read_with(&python, "lasso", &roots(&names.iter().collect::<Vec<_>>()));
    let for_vtk: Vec<&String> = names.iter().filter(|name| !NOT_BY_VTK.contains(&name.as_str())).collect();
    let by_vtk = read_with(&python, "vtk", &roots(&for_vtk));
    for ((name, ours), lasso) in names.iter().zip(&ours).zip(&by_lasso) {
        same_as_lasso(name, ours, lasso);
        if let Some(at) = for_vtk.iter().position(|other| *other == name) {
            same_numbers(name, lasso, &by_vtk[at]);
        }
    }
}

/// lasso-python finds what the family was made of.
fn same_as_lasso(name: &str, ours: &Value, lasso: &Value) {
    agree(&format!("{name}: times"), &ours["times"], &lasso["times"]);
    for (state, theirs) in ["first_state", "last_state"].iter().zip(rows(&lasso["states"])) {
        for field in ["coordinates", "velocity"] {
            // velocities of nodes of rigid bodies may be rebuilt, or not at all
            if field == "velocity" && name.contains("rigid_nodes") {
                continue;
            }
            for key in ["min", "max", "sum"] {
                match ours[state][field].is_null() {
                    true => assert!(theirs[field].is_null(), "{name}: {field}"),
                    false => {
                        agree(
                            &format!("{name}: {key} of {field}, {state}"),
                            &ours[state][field][key],
                            &theirs[field][key],
                        );
                    }
                }
            }
        }
        // where rigid shells get words, these are zeros
        let strain = &ours[state]["shell_plastic_strain"];
        if !strain.is_null() {
            let keys = if name.contains("rigid_shells") { &["max", "sum"][..] } else { &["min", "max", "sum"] };
            for &key in keys {
                agree(&format!("{name}: plastic strain, {key}"), &strain[key], &theirs["plastic_strain"][key][0]);
            }
        }
    }
}

/// Two programs find the same: times, positions and velocities at the corners of elements, stress and plastic strain.
fn same_numbers(name: &str, lasso: &Value, vtk: &Value) {
    agree(&format!("{name}: times"), &lasso["times"], &vtk["times"]);
    for (lasso, vtk) in rows(&lasso["states"]).iter().zip(rows(&vtk["states"])) {
        for (what, numbers) in lasso["corners"].as_object().unwrap() {
            let theirs = &vtk["corners"][what];
            match numbers.is_null() {
                true => assert!(theirs.is_null(), "{name}: {what}"),
                false => ["min", "max", "sum"]
                    .iter()
                    .for_each(|key| agree(&format!("{name}: {key} of {what}"), &numbers[key], &theirs[key])),
            }
        }
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
    crumple!["convert", testdata("s01_shells_latin1"), "-o", place.path().join("b"), "--precision", "half"]
        .refused(&["--precision", "single or double"]);
}

#[test]
fn what_other_programs_misread_is_left_out_and_named() {
    let place = folder();
    let convert = |family: &str, name: &str, all: bool| {
        let mut command = world::program();
        command
            .arg("convert")
            .arg(testdata(family))
            .arg("-o")
            .arg(place.path().join(name).join("d3plot"))
            .arg("--json");
        world::finish({
            command.args(all.then_some("--everything"));
            command
        })
        .done()
        .json()
    };
    let left_out =
        |told: &Value| rows(&told["left_out"]).iter().map(|name| name.to_string()).collect::<Vec<_>>().join(" ");
    let plain = left_out(&convert("s07_temperature_mass", "plain", false));
    assert!(plain.contains("mass_scaling") && plain.contains("heat_flux"), "{plain}");
    assert_eq!(left_out(&convert("s07_temperature_mass", "all", true)), "");
    let (before, after) = (info(&testdata("s07_temperature_mass")), info(&place.path().join("all")));
    assert_eq!((&before["fields"], &before["last_state"]), (&after["fields"], &after["last_state"]));
    let materials = left_out(&convert("s08_rigid_shells", "rigid", false));
    assert!(materials.contains("material numbers"), "{materials}");
    assert_eq!(left_out(&convert("s14_displacements", "positions", false)), "");
    assert!(info(&place.path().join("positions"))["fields"].to_string().contains("coordinates"));
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
