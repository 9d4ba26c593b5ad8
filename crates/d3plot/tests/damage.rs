//! Any bytes give an answer or an error: families cut at every word, with bytes flipped, and of random bytes.

mod shared;

use std::io::{Seek, SeekFrom, Write};

use d3plot::{Error, Family, roots};
use proptest::prelude::*;

use shared::{Copy, read_everything, testdata};

/// Opens and reads all; an error must say something about a file of the family.
fn open_and_read(copy: &Copy) -> Option<Family> {
    let _ = roots(copy.folder()).unwrap();
    let result = Family::open(&copy.root()).and_then(|family| read_everything(&family).map(|_| family));
    match result {
        Ok(family) => Some(family),
        Err(error) => {
            assert!(error.path().starts_with(copy.folder()), "{error}");
            assert!(error.to_string().starts_with(&error.path().display().to_string()), "{error}");
            let _ = error.remedy();
            None
        }
    }
}

/// Cut lengths of a file: every word, and every byte near its end and its start.
fn cuts(bytes: u64, word: u64) -> impl Iterator<Item = u64> {
    (0..bytes).rev().filter(move |at| at % word == 0 || at % 97 == 0 || *at < 16 || bytes - at < 16)
}

#[test]
fn a_root_cut_anywhere_gives_the_states_or_an_error_and_never_a_wrong_mesh() {
    for (name, word) in
        [("s01_shells_latin1", 4), ("s02_double_solids", 8), ("s03_big_endian_mix", 4), ("s08_rigid_shells", 4)]
    {
        let whole = Family::open(&testdata().join(name)).unwrap();
        let copy = Copy::of(name);
        let bytes = copy.read("d3plot").len() as u64;
        let mut refused = 0;
        for length in cuts(bytes, word) {
            copy.set_length("d3plot", length);
            let Some(family) = open_and_read(&copy) else {
                refused += 1;
                continue;
            };
            // the geometry is believed only if it is all there, and the states are in the other members
            assert_eq!(family.geometry(), whole.geometry(), "{name} cut at {length}");
            assert_eq!(family.times(), whole.times(), "{name} cut at {length}");
            assert_eq!(refused, 0, "{name} cut at {length} is read, but not cut later");
        }
        assert!(refused > 64, "{name}");
    }
}

#[test]
fn a_root_cut_at_a_block_is_not_completed_with_words_of_the_next_member() {
    // the geometry is longer than one block of 512 words: cut there, it could run on
    let copy = Copy::of("s02_double_solids");
    copy.set_length("d3plot", 512 * 8);
    match Family::open(&copy.root()) {
        Err(Error::Truncated { path, offset, need, left, .. }) => {
            assert_eq!(path, copy.root());
            assert_eq!(offset + left, 512 * 8);
            assert!(need > left);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_member_cut_anywhere_costs_only_its_own_states() {
    for (name, word) in [("s01_shells_latin1", 4), ("s02_double_solids", 8)] {
        let whole = Family::open(&testdata().join(name)).unwrap();
        let copy = Copy::of(name);
        let bytes = copy.read("d3plot01").len() as u64;
        let lost = whole.members()[1].states;
        let state_bytes = whole.header().words_per_state * word;
        for length in cuts(bytes, word) {
            copy.set_length("d3plot01", length);
            let family = open_and_read(&copy).expect("a cut member is no reason to refuse the family");
            let kept = lost.min((length / state_bytes) as usize);
            let mut times = whole.times()[..kept].to_vec();
            times.extend(&whole.times()[lost..]);
            assert_eq!(family.times(), times, "{name} cut at {length}");
            let inside = length % state_bytes >= word && kept < lost;
            let told = family.warnings().iter().any(|warning| warning.kind() == "cut-state");
            assert_eq!(told, inside, "{name} cut at {length}: {:?}", family.warnings());
            if kept > 0 {
                assert_eq!(family.coordinates(kept - 1).unwrap(), whole.coordinates(kept - 1).unwrap());
            }
        }
    }
}

#[test]
fn states_that_run_on_survive_a_cut_anywhere() {
    let whole = Family::open(&testdata().join("x11_geometry_runs_on")).unwrap();
    let copy = Copy::of("x11_geometry_runs_on");
    for member in ["d3plot01", "d3plot04", "d3plot08"] {
        let bytes = copy.read(member);
        for length in cuts(bytes.len() as u64, 4) {
            copy.set_length(member, length);
            if let Some(family) = open_and_read(&copy) {
                for (state, time) in family.times().iter().enumerate() {
                    let same = whole.times().iter().position(|other| other == time).expect("no invented times");
                    assert_eq!(
                        family.coordinates(state).unwrap(),
                        whole.coordinates(same).unwrap(),
                        "{member} {length}"
                    );
                }
            }
        }
        copy.write(member, &bytes);
    }
}

#[test]
fn every_byte_of_a_root_may_be_wrong() {
    for name in ["s12_node_deletion", "x03_rigid_nodes", "x07_particles", "x10_states_in_root"] {
        let copy = Copy::of(name);
        let good = copy.read("d3plot");
        let mut root = std::fs::OpenOptions::new().write(true).open(copy.root()).unwrap();
        let mut put = |at: usize, byte: u8| {
            root.seek(SeekFrom::Start(at as u64)).unwrap();
            root.write_all(&[byte]).unwrap();
        };
        for (at, byte) in good.iter().enumerate() {
            // every flip where counts and flags stand, one behind
            let flips = [0x01, 0x80, 0xff];
            for flip in if at < 512 { &flips[..] } else { &flips[at % 3..=at % 3] } {
                put(at, byte ^ flip);
                open_and_read(&copy);
            }
            put(at, *byte);
        }
    }
}

#[test]
fn every_count_may_be_anything() {
    for name in ["s06_extra_penout", "s08_rigid_shells", "x03_rigid_nodes", "x06_ten_node_tetrahedra", "x07_particles"]
    {
        let copy = Copy::of(name);
        let good = copy.read("d3plot");
        for word in 10..82.min(good.len() / 4) {
            for value in [i32::MIN, -10000, -1, 0, 1, 2, 3, 7, 1000, 67_108_864, 1_000_000_000, i32::MAX] {
                copy.write("d3plot", &good);
                copy.poke(&[(word, value)]);
                open_and_read(&copy);
            }
        }
    }
}

#[test]
fn a_file_that_shrinks_after_opening_gives_an_error() {
    let copy = Copy::of("s01_shells_latin1");
    let family = Family::open(&copy.root()).unwrap();
    copy.set_length("d3plot01", 700);
    assert!(matches!(family.coordinates(1), Err(Error::Changed { .. })));
    std::fs::remove_file(copy.path("d3plot03")).unwrap();
    let gone = family.coordinates(0).and_then(|_| family.coordinates(4));
    assert!(matches!(gone, Err(Error::Changed { .. } | Error::NotFound { .. })), "{gone:?}");
}

fn families() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "s01_shells_latin1",
        "s02_double_solids",
        "s03_big_endian_mix",
        "s05_state_runs_on",
        "s06_extra_penout",
        "s07_temperature_mass",
        "s08_rigid_shells",
        "s10_no_marks_one_file",
        "s14_displacements",
        "x01_wide_numbers",
        "x03_rigid_nodes",
        "x04_rigid_nodes_road",
        "x05_rigid_shells_road",
        "x06_ten_node_tetrahedra",
        "x07_particles",
        "x10_states_in_root",
        "x11_geometry_runs_on",
        "lasso_beamip",
        "lasso_order",
    ])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_are_answered(bytes in prop::collection::vec(any::<u8>(), 0..3000), more in prop::collection::vec(any::<u8>(), 0..600)) {
        let copy = Copy::of("s12_node_deletion");
        copy.write("d3plot", &bytes);
        copy.write("d3plot01", &more);
        open_and_read(&copy);
    }

    #[test]
    fn random_bytes_behind_a_good_control_block_are_answered(bytes in prop::collection::vec(any::<u8>(), 0..3000)) {
        let copy = Copy::of("s12_node_deletion");
        let mut root = copy.read("d3plot")[..256].to_vec();
        root.extend(bytes);
        copy.write("d3plot", &root);
        open_and_read(&copy);
    }

    #[test]
    fn mutated_families_are_answered(
        name in families(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>()), 1..8),
        words in prop::collection::vec((10_usize..100, prop_oneof![any::<i32>(), -20_i32..20]), 0..4),
        cut in prop::option::of((any::<prop::sample::Index>(), any::<prop::sample::Index>())),
        garbage in prop::collection::vec(any::<u8>(), 0..40),
    ) {
        let copy = Copy::of(name);
        let mut files: Vec<String> =
            std::fs::read_dir(copy.folder()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        files.sort();
        for (file, at, value) in &changes {
            let file = file.get(&files);
            let mut bytes = copy.read(file);
            *at.get_mut(&mut bytes) = *value;
            copy.write(file, &bytes);
        }
        copy.poke(&words);
        if let Some((file, at)) = cut {
            let file = file.get(&files);
            let mut bytes = copy.read(file);
            bytes.truncate(at.index(bytes.len()));
            bytes.extend(garbage);
            copy.write(file, &bytes);
        }
        open_and_read(&copy);
    }
}
