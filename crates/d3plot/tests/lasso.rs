//! Agreement with lasso-python 2.0.4 on the families that it reads rightly: every array that both read, over all states.
//! The numbers are in `testdata/lasso_numbers.json`, the script that made them beside it.

mod shared;

use std::path::Path;

use d3plot::{Deletion, Family};
use serde_json::Value;

use shared::{shared_data, testdata};

/// Sums of up to 10⁷ terms in another order.
const RELATIVE: f64 = 1e-9;

fn stored() -> Value {
    serde_json::from_str(&std::fs::read_to_string(testdata().join("lasso_numbers.json")).unwrap()).unwrap()
}

#[test]
fn families_of_testdata_agree_with_lasso_python() {
    check_all(&testdata(), &stored()["families"], 12);
}

#[test]
fn every_real_family_and_hat_section_run_agrees_with_lasso_python() {
    let Some(shared) = shared_data() else { return };
    // all but the FEMZIP one, two more that are testdata of the crate, 100 coarse and 82 fine runs of the beam
    check_all(&shared, &stored()["shared"], 188);
}

fn check_all(folder: &Path, families: &Value, count: usize) {
    let families = families.as_object().unwrap();
    assert_eq!(families.len(), count);
    for (name, expected) in families {
        check(name, &Family::open(&folder.join(name)).unwrap(), expected);
    }
}

fn check(name: &str, family: &Family, expected: &Value) {
    for (key, expected) in expected.as_object().unwrap() {
        let what = format!("{name}: {key}");
        match key.as_str() {
            "part_ids" => part_ids(name, family, expected),
            _ if key.starts_with("deleted_") => {
                let found: Vec<usize> = (0..family.times().len()).map(|state| deleted(family, state, key)).collect();
                assert_eq!(&serde_json::json!(found), expected, "{what}");
            }
            "sph" | "globals" => {
                // lasso-python does not name all words: the first ones of each row, of particles those behind the part
                let skip = usize::from(key == "sph");
                let rows: Vec<Vec<f64>> = states(family, key).collect();
                let count = expected[0].as_u64().unwrap() as usize / (rows.len() * row_count(family, key));
                let columns = rows[0].len() / row_count(family, key);
                let named =
                    rows.iter().flat_map(|state| state.chunks_exact(columns)).flat_map(|row| &row[skip..skip + count]);
                agree(&what, named.copied(), expected);
            }
            _ => match mesh(family, key, expected) {
                Some(values) => agree(&what, values.into_iter(), expected),
                // rigid shells are NaN here and left out there
                None => agree(&what, states(family, key).flatten().filter(|value| !value.is_nan()), expected),
            },
        }
    }
}

/// All values of a field, state by state.
fn states<'a>(family: &'a Family, field: &'a str) -> impl Iterator<Item = Vec<f64>> + 'a {
    let none = move || panic!("{}: no {field}", family.root().display());
    (0..family.times().len()).map(move |state| family.values(state, field).unwrap().unwrap_or_else(none).values)
}

fn row_count(family: &Family, field: &str) -> usize {
    family.fields().iter().find(|of| of.name == field).unwrap().rows as usize
}

/// An array that does not change with the states.
fn mesh(family: &Family, key: &str, expected: &Value) -> Option<Vec<f64>> {
    let geometry = family.geometry();
    let ids = |ids: &[u64]| -> Vec<f64> {
        match ids.is_empty() {
            // without numbers of its own everything counts from 1
            true => (1..=expected[0].as_u64().unwrap()).map(|id| id as f64).collect(),
            false => ids.iter().map(|&id| id as f64).collect(),
        }
    };
    let all = |indices: &mut dyn Iterator<Item = u32>| indices.map(f64::from).collect::<Vec<f64>>();
    Some(match key {
        "times" => family.times().to_vec(),
        "initial_coordinates" => geometry.coordinates.as_flattened().to_vec(),
        "node_ids" => ids(&geometry.node_ids),
        "solid_ids" => ids(&geometry.solid_ids),
        "beam_ids" => ids(&geometry.beam_ids),
        "shell_ids" => ids(&geometry.shell_ids),
        "solid_nodes" => all(&mut geometry.solids.iter().flat_map(|solid| solid.nodes)),
        "shell_nodes" => all(&mut geometry.shells.iter().flat_map(|shell| shell.nodes)),
        "beam_nodes" => all(&mut geometry.beams.iter().flat_map(|beam| beam.nodes)),
        "solid_parts" => all(&mut geometry.solids.iter().map(|solid| solid.part)),
        "shell_parts" => all(&mut geometry.shells.iter().map(|shell| shell.part)),
        "beam_parts" => all(&mut geometry.beams.iter().map(|beam| beam.part)),
        "sph_nodes" => all(&mut geometry.sph.iter().map(|particle| particle.node)),
        _ => return None,
    })
}

fn part_ids(name: &str, family: &Family, expected: &Value) {
    let expected: Vec<u64> = expected.as_array().unwrap().iter().map(|id| id.as_u64().unwrap()).collect();
    if expected.is_empty() {
        return;
    }
    let mut ids: Vec<u64> = family.parts().iter().map(|part| part.id).collect();
    // lasso-python takes the first list, which the synthetic families have sorted
    if name.starts_with(['s', 'x']) {
        ids.sort_unstable();
    }
    assert_eq!(ids, expected, "{name}");
}

fn deleted(family: &Family, state: usize, key: &str) -> usize {
    let Deletion { nodes, solids, shells, beams, .. } = family.deletion(state).unwrap().unwrap();
    let flags = match key {
        "deleted_nodes" => nodes,
        "deleted_solids" => solids,
        "deleted_shells" => shells,
        "deleted_beams" => beams,
        other => panic!("{other}: not compared"),
    };
    flags.into_iter().filter(|deleted| *deleted).count()
}

/// Number, least, largest, sum, and a sum with weights by place.
fn agree(what: &str, values: impl Iterator<Item = f64>, expected: &Value) {
    let expected: Vec<f64> = expected.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    let (mut count, mut least, mut most, mut sum, mut size) = (0, f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
    let mut weighted = 0.0;
    for value in values {
        (least, most) = (f64::min(least, value), f64::max(most, value));
        weighted += value * f64::from(count % 97 + 1);
        sum += value;
        size += value.abs();
        count += 1;
    }
    assert_eq!(f64::from(count), expected[0], "{what}: count");
    // the file of numbers has 15 digits
    let same = |found: f64, expected: f64| (found - expected).abs() <= 1e-14 * expected.abs();
    assert!(same(least, expected[1]), "{what}: least {least}, lasso-python {}", expected[1]);
    assert!(same(most, expected[2]), "{what}: largest {most}, lasso-python {}", expected[2]);
    assert!((sum - expected[3]).abs() <= RELATIVE * size, "{what}: sum {sum}, lasso-python {}", expected[3]);
    let within = RELATIVE * size * 97.0;
    assert!((weighted - expected[4]).abs() <= within, "{what}: weighted {weighted}, lasso-python {}", expected[4]);
}
