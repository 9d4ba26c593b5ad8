//! Agreement with lasso-python 2.0.4 on the families that it reads rightly: every state, minimum, maximum and sum.
//! The numbers are in `testdata/lasso_numbers.json`, the script that made them beside it.

mod shared;

use std::path::Path;

use d3plot::Family;
use serde_json::Value;

use shared::{shared_data, testdata};

/// Sums of up to 10⁵ terms in another order.
const RELATIVE: f64 = 1e-9;

fn stored() -> Value {
    serde_json::from_str(&std::fs::read_to_string(testdata().join("lasso_numbers.json")).unwrap()).unwrap()
}

#[test]
fn families_of_testdata_agree_with_lasso_python() {
    check_all(&testdata(), &stored()["families"], 10);
}

#[test]
fn shared_families_and_the_first_hat_section_run_agree_with_lasso_python() {
    let Some(shared) = shared_data() else { return };
    check_all(&shared, &stored()["shared"], 6);
}

fn check_all(folder: &Path, families: &Value, count: usize) {
    let families = families.as_object().unwrap();
    assert_eq!(families.len(), count);
    for (name, expected) in families {
        check(name, &Family::open(&folder.join(name)).unwrap(), expected);
    }
}

fn check(name: &str, family: &Family, expected: &Value) {
    let times = expected["times"].as_array().unwrap();
    assert_eq!(family.times().len(), times.len(), "{name}");
    for (time, expected) in family.times().iter().zip(times) {
        assert!(same(*time, expected), "{name}: time {time}, lasso-python {expected}");
    }
    let geometry = family.geometry();
    agree(name, "initial_coordinates", geometry.coordinates.as_flattened(), &expected["initial_coordinates"]);
    let ids = [
        ("node_ids", &geometry.node_ids),
        ("shell_ids", &geometry.shell_ids),
        ("solid_ids", &geometry.solid_ids),
        ("beam_ids", &geometry.beam_ids),
    ];
    for (key, ids) in ids.iter().filter(|(key, _)| expected.get(key).is_some()) {
        // without numbers of its own everything counts from 1
        let count = expected[key]["count"].as_u64().unwrap();
        let ids: Vec<f64> = match ids.is_empty() {
            true => (1..=count).map(|id| id as f64).collect(),
            false => ids.iter().map(|&id| id as f64).collect(),
        };
        agree(name, key, &ids, &expected[key]);
    }
    let part_ids: Vec<u64> = expected["part_ids"].as_array().unwrap().iter().map(|id| id.as_u64().unwrap()).collect();
    if !part_ids.is_empty() {
        let mut ids: Vec<u64> = family.parts().iter().map(|part| part.id).collect();
        // lasso-python takes the first list, which the synthetic families have sorted
        if name.starts_with('s') {
            ids.sort_unstable();
        }
        assert_eq!(ids, part_ids, "{name}");
    }
    for (state, expected) in expected["states"].as_array().unwrap().iter().enumerate() {
        let flat = |vectors: Option<Vec<[f64; 3]>>| vectors.unwrap().as_flattened().to_vec();
        for (key, expected) in expected.as_object().unwrap() {
            let values = match key.as_str() {
                "coordinates" => flat(family.coordinates(state).unwrap()),
                "velocity" => flat(family.velocity(state).unwrap()),
                "shell_plastic_strain" => family.shell_plastic_strain_layers(state).unwrap().unwrap().values,
                "solid_plastic_strain" => family.solid_plastic_strain_points(state).unwrap().unwrap().values,
                other => panic!("{other}: not compared"),
            };
            // rigid shells are NaN here and left out there
            let values: Vec<f64> = values.into_iter().filter(|value| !value.is_nan()).collect();
            agree(name, &format!("{key} of state {state}"), &values, expected);
        }
    }
}

fn agree(name: &str, what: &str, values: &[f64], expected: &Value) {
    assert_eq!(values.len() as u64, expected["count"].as_u64().unwrap(), "{name}: {what}");
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!(same(least, &expected["min"]), "{name}: {what}: minimum {least}, lasso-python {}", expected["min"]);
    assert!(same(most, &expected["max"]), "{name}: {what}: maximum {most}, lasso-python {}", expected["max"]);
    let (sum, other): (f64, f64) = (values.iter().sum(), expected["sum"].as_f64().unwrap());
    let size: f64 = values.iter().map(|value| value.abs()).sum();
    assert!((sum - other).abs() <= RELATIVE * size, "{name}: {what}: sum {sum}, lasso-python {other}");
}

/// Equal but for the last digit, which the reader of JSON may lose.
fn same(found: f64, expected: &Value) -> bool {
    let expected = expected.as_f64().unwrap();
    (found - expected).abs() <= 2.0 * f64::EPSILON * expected.abs()
}
