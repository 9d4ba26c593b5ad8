//! Fields by name: of all rows or of one part, over all states, in both precisions, lazily and by maps.

mod shared;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use d3plot::{Content, Error, Family, Geometry, Layers, Part, ReadOptions, Rows, Shell, Stored, WriteOptions, Writer};

use shared::{Copy, testdata};

fn open(name: &str) -> Family {
    Family::open(&testdata().join(name)).unwrap()
}

fn every_family() -> impl Iterator<Item = Family> {
    let folders = std::fs::read_dir(testdata()).unwrap().map(|entry| entry.unwrap().path());
    folders.filter_map(|folder| Family::open(&folder).ok())
}

#[test]
fn a_quantity_is_the_words_of_its_table() {
    // all of a shell's words, put together again from what is named: layers, resultants, thickness, energy
    let family = open("s01_shells_latin1");
    let table = family.table(1, "shell").unwrap().unwrap();
    let get = |name: &str| family.values(1, name).unwrap().unwrap();
    let (stress, strain) = (get("shell_stress"), get("shell_plastic_strain"));
    let (moment, shear, normal) = (get("shell_bending_moment"), get("shell_shear_force"), get("shell_normal_force"));
    let (thickness, two, energy) =
        (get("shell_thickness"), get("shell_element_variable"), get("shell_internal_energy"));
    assert_eq!(table.columns, 33);
    for shell in 0..family.header().shells {
        let of = |table: &d3plot::Table| table.rows().nth(shell).unwrap().to_vec();
        let mut words = Vec::new();
        for layer in 0..3 {
            words.extend(&of(&stress)[6 * layer..6 * layer + 6]);
            words.push(of(&strain)[layer]);
        }
        for rest in [&moment, &shear, &normal, &thickness, &two, &energy] {
            words.extend(of(rest));
        }
        assert_eq!(words, of(&table));
    }
}

#[test]
fn fields_that_are_listed_are_there_with_their_shape() {
    for family in every_family() {
        for field in family.fields() {
            for state in 0..family.times().len().min(2) {
                let table = family.values(state, field.name).unwrap().unwrap();
                assert_eq!(table.columns as u64, field.columns, "{}", field.name);
                let left_out = matches!(field.name, "coordinates" | "velocity" | "acceleration" | "shell");
                assert!(table.rows().len() as u64 == field.rows || left_out, "{}", field.name);
                let mut single: Vec<f32> = Vec::new();
                family.values_into(state, field.name, Rows::All, &mut single).unwrap();
                let same = |(a, b): (&f32, &f64)| *a == *b as f32 || a.is_nan() && b.is_nan();
                assert!(single.iter().zip(&table.values).all(same), "{}", field.name);
            }
        }
        assert!(family.values(0, "no such field").is_ok_and(|table| table.is_none()) || family.times().is_empty());
    }
}

#[test]
fn some_rows_are_those_of_all() {
    for family in every_family().filter(|family| !family.times().is_empty()) {
        for field in family.fields() {
            let all = family.values(0, field.name).unwrap().unwrap();
            let count = all.rows().len() as u32;
            // backwards, with gaps, one of them twice
            let mut rows: Vec<u32> = (0..count).rev().step_by(3).collect();
            rows.extend(rows.first().copied());
            let mut some: Vec<f64> = Vec::new();
            family.values_into(0, field.name, Rows::These(&rows), &mut some).unwrap();
            let expected: Vec<f64> =
                rows.iter().flat_map(|&row| all.rows().nth(row as usize).unwrap().to_vec()).collect();
            let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&some), bits(&expected), "{}", field.name);
            let beyond = family.values_into(0, field.name, Rows::These(&[count]), &mut some);
            assert!(matches!(beyond, Err(Error::NoSuchRow { .. })), "{}", field.name);
        }
    }
}

#[test]
fn a_series_of_a_part_has_its_nodes_and_elements() {
    let family = open("s03_big_endian_mix");
    for part in 0..family.parts().len() {
        let nodes = family.nodes_of_part(part);
        let shells = family.shells_of_part(part);
        assert_eq!(shells.len(), family.parts()[part].shells);
        let mut seen = 0;
        for state in family.series("coordinates").of_part(part) {
            let state = state.unwrap();
            let all = family.coordinates(state.state).unwrap().unwrap();
            assert_eq!(state.time, family.times()[state.state]);
            assert!(state.values.rows().zip(&nodes).all(|(row, &node)| row == all[node as usize]));
            assert_eq!(state.values.rows().len(), nodes.len());
            seen += 1;
        }
        assert_eq!(seen, family.times().len());
        for state in family.series("shell_plastic_strain").of_part(part).layer(Layers::Mean) {
            let state = state.unwrap();
            let all = family.shell_plastic_strain(state.state, Layers::Mean).unwrap().unwrap();
            let expected: Vec<f64> = shells.iter().map(|&shell| all[shell as usize]).collect();
            assert_eq!((state.values.values, state.values.columns), (expected, 1));
        }
    }
    assert_eq!(family.series("no such field").count(), 0);
}

#[test]
fn a_tensor_is_reduced_component_by_component() {
    let family = open("s01_shells_latin1");
    let all = family.values(1, "shell_stress").unwrap().unwrap();
    let most = family.values_of_layer(1, "shell_stress", Layers::Max).unwrap().unwrap();
    let outer = family.values_of_layer(1, "shell_stress", Layers::Outer).unwrap().unwrap();
    assert_eq!((most.columns, outer.columns), (6, 6));
    for ((row, most), outer) in all.rows().zip(most.rows()).zip(outer.rows()) {
        for component in 0..6 {
            let layers = [row[component], row[6 + component], row[12 + component]];
            assert_eq!(most[component], layers.into_iter().fold(f64::MIN, f64::max));
        }
        assert_eq!(outer, &row[12..]);
    }
}

#[test]
fn strains_of_a_solid_are_the_last_six_of_its_histories() {
    let folder = tempfile::tempdir().unwrap();
    let mut geometry = Geometry::default();
    geometry.coordinates = (0..8).map(|k| [f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)]).collect();
    geometry.solids = vec![d3plot::Solid { nodes: [0, 1, 3, 2, 4, 5, 7, 6], part: 0 }];
    let content = Content { stress: Stored::Solids, solid_histories: 9, strains: true, ..Content::default() };
    let root = folder.path().join("d3plot");
    let mut writer =
        Writer::create(&root, &geometry, &[Part::new(1, "cube")], &content, &WriteOptions::default()).unwrap();
    let mut state = writer.state(0.0);
    state.set("solid", &(0..15).map(f64::from).collect::<Vec<_>>()).unwrap();
    state.write().unwrap();
    let family = Family::open(&root).unwrap();
    let get = |name: &str| family.values(0, name).unwrap().unwrap().values;
    assert_eq!(get("solid_history"), (6..15).map(f64::from).collect::<Vec<_>>());
    assert_eq!(get("solid_strain"), (9..15).map(f64::from).collect::<Vec<_>>());
}

#[test]
fn ranges_leave_out_and_count_what_is_not_finite() {
    let copy = Copy::of("s12_node_deletion");
    let family = Family::open(&copy.root()).unwrap();
    let globals =
        family.fields().iter().find(|field| field.name == "globals").map_or(0, |field| field.columns) as usize;
    let mut bytes = copy.read("d3plot01");
    for (node, word) in [(2, f32::NAN), (5, f32::INFINITY)] {
        let at = (1 + globals + 3 * node) * 4;
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
    }
    copy.write("d3plot01", &bytes);
    let ranges = family.ranges(0).unwrap();
    let found = ranges.iter().find(|range| range.name == "coordinates").unwrap();
    assert_eq!((found.not_finite, found.components.len(), found.points), (2, 3, 1));
    assert!(found.components.iter().all(|component| component.sum.is_finite()));
    assert!(family.times().len() == 4, "not a reason to refuse the state");
}

#[test]
fn one_part_touches_only_its_own_pages() {
    // the file is cut behind the pages of the first part after opening: its nodes are read all the same
    let folder = tempfile::tempdir().unwrap();
    let mut geometry = Geometry::default();
    geometry.coordinates = (0..40_000).map(|k| [f64::from(k), 0.0, 0.0]).collect();
    geometry.shells =
        vec![Shell { nodes: [0, 1, 2, 3], part: 0 }, Shell { nodes: [39_996, 39_997, 39_998, 39_999], part: 1 }];
    let parts = [Part::new(1, "first"), Part::new(2, "last")];
    let root = folder.path().join("d3plot");
    let mut writer = Writer::create(&root, &geometry, &parts, &Content::default(), &WriteOptions::default()).unwrap();
    writer.state(0.0).write().unwrap();
    writer.finish().unwrap();
    let family = Family::open(&root).unwrap();
    let states = folder.path().join("d3plot01");
    std::fs::OpenOptions::new().write(true).open(states).unwrap().set_len(4096).unwrap();
    let first = family.series("coordinates").of_part(0).next().unwrap().unwrap();
    assert_eq!(first.values.values[..6], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    assert!(matches!(family.series("coordinates").of_part(1).next(), Some(Err(Error::Changed { .. }))));
}

#[test]
fn a_file_cut_while_it_is_read_is_an_error_and_never_a_signal() {
    let copy = Copy::of("s01_shells_latin1");
    let whole = copy.read("d3plot01");
    let family = Family::open(&copy.root()).unwrap();
    let expected = family.coordinates(0).unwrap().unwrap();
    let done = AtomicBool::new(false);
    let (mut read, mut cut) = (0, 0);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            // shorter and whole again, as fast as it goes
            let file = std::fs::OpenOptions::new().write(true).open(copy.path("d3plot01")).unwrap();
            while !done.load(Ordering::Relaxed) {
                file.set_len(100).unwrap();
                std::thread::yield_now();
                copy.write("d3plot01", &whole);
                std::thread::yield_now();
            }
        });
        for _ in 0..20_000 {
            match family.coordinates(0) {
                // zeros or the old bytes may be read while the file is being written again; the shape is right
                Ok(positions) => {
                    read += usize::from(positions.unwrap().len() == expected.len());
                }
                Err(Error::Changed { path, .. }) => {
                    assert_eq!(path, copy.path("d3plot01"));
                    cut += 1;
                }
                Err(other) => panic!("{other}"),
            }
            if cut > 100 && read > 100 {
                break;
            }
        }
        done.store(true, Ordering::Relaxed);
    });
    assert!(read + cut > 0);
    copy.set_length("d3plot01", 100);
    assert!(matches!(family.coordinates(0), Err(Error::Changed { .. })));
}

#[test]
fn maps_and_bytes_in_memory_read_the_same() {
    for entry in std::fs::read_dir(testdata()).unwrap() {
        let folder = entry.unwrap().path();
        let Ok(family) = Family::open(&folder) else { continue };
        let mapped = Family::open_with(&folder, ReadOptions { map: true }).unwrap();
        let files: Vec<(PathBuf, Vec<u8>)> =
            family.members().iter().map(|member| (member.path.clone(), std::fs::read(&member.path).unwrap())).collect();
        let in_memory = Family::of_bytes(files).unwrap();
        for other in [&mapped, &in_memory] {
            assert_eq!((family.geometry(), family.times()), (other.geometry(), other.times()));
            for state in 0..family.times().len() {
                for field in family.fields() {
                    let bits = |family: &Family| -> Vec<u64> {
                        let values = family.values(state, field.name).unwrap().unwrap().values;
                        values.iter().map(|value| value.to_bits()).collect()
                    };
                    assert_eq!(bits(&family), bits(other), "{}", field.name);
                }
            }
        }
    }
    assert!(matches!(Family::of_bytes(Vec::new()), Err(Error::NotFound { .. })));
}
