//! Agreement with `expected.json`: what the generator of the synthetic families wrote, and what an independent reader
//! (`check_d3plot.py`, compared with lasso-python 2.0.4) finds in the real ones.

mod shared;

use std::path::{Path, PathBuf};

use d3plot::{ByteOrder, Error, Family, Part, Precision, roots};
use serde_json::{Map, Value, json};

use shared::{shared_data, testdata};

/// Sums over 10⁵ values in another order; everything else is exact in f64.
const RELATIVE: f64 = 1e-9;

#[test]
fn every_family_of_testdata_agrees_with_its_expected_numbers() {
    let checked = check_all(&testdata());
    assert_eq!(checked, 30, "testdata has 26 synthetic families and 4 real ones");
}

#[test]
fn every_shared_family_agrees_with_its_expected_numbers() {
    let Some(shared) = shared_data() else { return };
    assert!(check_all(&shared.join("d3plot")) >= 10);
    assert!(check_all(&shared.join("d3plot-synthetic")) >= 14);
}

#[test]
fn a_folder_opens_like_its_root() {
    for folder in ["s01_shells_latin1", "s05_state_runs_on", "lasso_order"] {
        let by_folder = Family::open(&testdata().join(folder)).unwrap();
        let by_root = Family::open(&testdata().join(folder).join("d3plot")).unwrap();
        assert_eq!(by_folder.root(), by_root.root());
        assert_eq!(by_folder.times(), by_root.times());
    }
}

fn check_all(folder: &Path) -> usize {
    let mut families: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("expected.json").is_file())
        .collect();
    families.sort();
    for family in &families {
        check(family);
    }
    families.len()
}

fn check(folder: &Path) {
    let text = std::fs::read_to_string(folder.join("expected.json")).unwrap();
    let file: Value = serde_json::from_str(&text).unwrap();
    let expected = file["expected"].as_object().unwrap();
    let root = folder.join(file["root"].as_str().unwrap());
    let result = Family::open(&root);
    if let Some(words) = expected.get("error") {
        let error = result.expect_err("an error was expected");
        match words.as_str().unwrap() {
            "femzip" => assert!(matches!(error, Error::Femzip { .. }), "{error}"),
            _ => assert!(matches!(error, Error::Truncated { .. }), "{error}"),
        }
        assert!(roots(folder).is_ok());
        return;
    }
    let family = result.unwrap_or_else(|error| panic!("{}: {error}", root.display()));
    let found = summary(&family);
    let mut wrong = Vec::new();
    // told by warnings here, in words of its own there
    let words = ["notes", "truncated_member", "n_nodes_in_control_block", "adaptive_levels"];
    for (key, value) in expected.iter().filter(|(key, _)| !words.contains(&key.as_str())) {
        // here the reader that made the numbers takes the sorted list of part numbers for the one in internal order:
        // the third list of this file, the places of the sorted numbers, says otherwise, and so does lasso-python
        if key == "part_ids" && folder.ends_with("ansys_bird_strike_gap") {
            continue;
        }
        compare(key, found.get(key).unwrap_or(&Value::Null), value, &mut wrong);
    }
    assert!(wrong.is_empty(), "{}:\n{}", root.display(), wrong.join("\n"));
    let cut = family.warnings().iter().any(|warning| warning.kind() == "cut-state");
    assert_eq!(cut, expected.contains_key("truncated_member"), "{}", root.display());
}

/// The numbers of `expected.json` out of a family.
fn summary(family: &Family) -> Map<String, Value> {
    let (header, geometry, parts) = (family.header(), family.geometry(), family.parts());
    let sum = |nodes: &mut dyn Iterator<Item = u32>| nodes.map(|node| u64::from(node) + 1).sum::<u64>();
    let used: Vec<usize> = (1..=parts.len()).filter(|part| has_elements(&parts[part - 1])).collect();
    let titles: Vec<Value> = parts
        .iter()
        .filter(|part| !part.title_bytes.is_empty())
        .map(|part| json!([part.id, hex(&part.title_bytes)]))
        .collect();
    let names: Vec<String> =
        family.members().iter().map(|member| member.path.file_name().unwrap().to_str().unwrap().to_owned()).collect();
    let mut found = json!({
        "precision": if header.precision == Precision::Single { "single" } else { "double" },
        "byte_order": if header.byte_order == ByteOrder::Little { "little" } else { "big" },
        "n_nodes": header.nodes,
        "n_solids": header.solids,
        "n_thick_shells": header.thick_shells,
        "n_beams": header.beams,
        "n_shells": header.shells,
        "n_shell_triangles": geometry.shells.iter().filter(|shell| shell.is_triangle()).count(),
        "n_rigid_shells": header.rigid_shells,
        "n_sph": header.sph,
        "n_materials_header": header.parts,
        "parts_used": used,
        "part_ids": parts.iter().map(|part| part.id).collect::<Vec<u64>>(),
        "words_per_state": header.words_per_state,
        "n_states": family.times().len(),
        "times": family.times(),
        "members": names,
        "initial_coordinates": vectors(&geometry.coordinates),
        "connectivity_sums": {
            "solid": sum(&mut geometry.solids.iter().flat_map(|solid| solid.nodes)),
            "tshell": sum(&mut geometry.thick_shells.iter().flat_map(|solid| solid.nodes)),
            "beam": sum(&mut geometry.beams.iter().flat_map(|beam| beam.nodes)),
            "shell": sum(&mut geometry.shells.iter().flat_map(|shell| shell.nodes)),
        },
        "part_titles": titles,
    });
    if !family.times().is_empty() {
        found["first_state"] = state(family, 0);
        found["last_state"] = state(family, family.times().len() - 1);
    }
    match found {
        Value::Object(found) => found,
        _ => unreachable!(),
    }
}

/// The vectors that the file holds: without those of rigid bodies that are rebuilt.
fn stored(family: &Family, state: usize, field: &str) -> Option<Vec<[f64; 3]>> {
    let table = family.table(state, field).unwrap()?;
    Some(table.rows().map(|row| [row[0], row[1], row[2]]).collect())
}

/// The expected lists leave SPH out.
fn has_elements(part: &Part) -> bool {
    part.solids + part.thick_shells + part.beams + part.shells > 0
}

fn state(family: &Family, state: usize) -> Value {
    let mut found = json!({ "time": family.times()[state], "coordinates": null });
    let all = [
        ("coordinates", family.coordinates(state).unwrap()),
        ("velocity", stored(family, state, "velocity")),
        ("acceleration", stored(family, state, "acceleration")),
    ];
    for (key, values) in all {
        if let Some(values) = values {
            found[key] = vectors(&values);
        }
    }
    if let Some(table) = family.table(state, "temperature").unwrap() {
        found["temperature"] = columns(&table.values, table.columns);
    }
    let strains = [
        ("solid_plastic_strain", family.solid_plastic_strain_points(state).unwrap()),
        ("tshell_plastic_strain", family.thick_shell_plastic_strain_layers(state).unwrap()),
        ("shell_plastic_strain", family.shell_plastic_strain_layers(state).unwrap()),
    ];
    for (key, table) in strains {
        // rigid shells are NaN here and left out there
        if let Some(table) = table {
            let values = || table.values.iter().copied().filter(|value| !value.is_nan());
            found[key] = json!({
                "points": table.columns,
                "min": values().fold(f64::INFINITY, f64::min),
                "max": values().fold(f64::NEG_INFINITY, f64::max),
                "sum": values().sum::<f64>(),
            });
        }
    }
    for (kind, field) in [("node", "node_deletion"), ("element", "element_deletion")] {
        if let Some(table) = family.table(state, field).unwrap() {
            let zeros = table.values.iter().filter(|value| **value == 0.0).count();
            found["deletion_table"] = json!({ "kind": kind, "entries": table.values.len(), "zeros": zeros });
        }
    }
    found
}

fn vectors(values: &[[f64; 3]]) -> Value {
    columns(values.as_flattened(), 3)
}

fn columns(values: &[f64], columns: usize) -> Value {
    let column = |at: usize| values.iter().skip(at).step_by(columns).copied();
    let each = |fold: &dyn Fn(usize) -> f64| (0..columns).map(fold).collect::<Vec<f64>>();
    json!({
        "min": each(&|at| column(at).fold(f64::INFINITY, f64::min)),
        "max": each(&|at| column(at).fold(f64::NEG_INFINITY, f64::max)),
        "sum": each(&|at| column(at).sum()),
    })
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn compare(path: &str, found: &Value, expected: &Value, wrong: &mut Vec<String>) {
    // there in the order of the titles, here in that of the parts; an empty title is like none
    if path == "part_titles" && by_id(found) == by_id(expected) {
        return;
    }
    match (found, expected) {
        (Value::Object(found), Value::Object(expected)) => {
            for (key, value) in expected {
                compare(&format!("{path}.{key}"), found.get(key).unwrap_or(&Value::Null), value, wrong);
            }
        }
        (Value::Array(found), Value::Array(expected)) if found.len() == expected.len() => {
            for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
                compare(&format!("{path}[{index}]"), found, expected, wrong);
            }
        }
        // no numbers of their own: whatever stands there counts from 1
        (_, Value::Null) if path == "part_ids" => {}
        (Value::Number(found), Value::Number(expected)) => {
            let (found, expected) = (found.as_f64().unwrap(), expected.as_f64().unwrap());
            // a sum of terms that cancel is as exact as its terms: here up to 10³ each
            if (found - expected).abs() > RELATIVE * expected.abs().max(1e3) {
                wrong.push(format!("{path}: {found} found, {expected} expected"));
            }
        }
        _ if found != expected => wrong.push(format!("{path}: {found} found, {expected} expected")),
        _ => {}
    }
}

fn by_id(titles: &Value) -> Vec<&Value> {
    let mut titles: Vec<&Value> = titles.as_array().unwrap().iter().filter(|title| title[1] != "").collect();
    titles.sort_by_key(|title| title[0].as_u64());
    titles
}
