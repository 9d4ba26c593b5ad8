//! Laws that hold between what a family says here and what it says there.

mod shared;

use d3plot::{ByteOrder, Family, FileType, Layers, Precision};

use shared::{Copy, testdata};

fn open(name: &str) -> Family {
    Family::open(&testdata().join(name)).unwrap()
}

/// Every family of testdata that can be read.
fn all() -> Vec<Family> {
    let mut folders: Vec<_> = std::fs::read_dir(testdata()).unwrap().map(|entry| entry.unwrap().path()).collect();
    folders.sort();
    folders.retain(|path| path.is_dir() && !path.ends_with("lasso_femzip") && !path.ends_with("s13_cut_in_geometry"));
    folders.iter().map(|folder| Family::open(folder).unwrap()).collect()
}

#[test]
fn shapes_agree_with_the_header() {
    for family in all() {
        let (header, geometry) = (family.header(), family.geometry());
        assert_eq!(geometry.coordinates.len(), header.nodes);
        assert_eq!((geometry.shells.len(), geometry.solids.len()), (header.shells, header.solids));
        // all have user numbers, or none
        let numbered = !geometry.node_ids.is_empty();
        for (ids, count) in [
            (&geometry.node_ids, header.nodes),
            (&geometry.shell_ids, header.shells),
            (&geometry.solid_ids, header.solids),
            (&geometry.thick_shell_ids, header.thick_shells),
            (&geometry.beam_ids, header.beams),
        ] {
            assert_eq!(ids.len(), if numbered { count } else { 0 });
        }
        let elements = header.solids + header.thick_shells + header.beams + header.shells + header.sph;
        let counted: usize = family
            .parts()
            .iter()
            .map(|part| part.solids + part.thick_shells + part.beams + part.shells + part.sph)
            .sum();
        assert_eq!(counted, elements);
        assert_eq!(family.members().iter().map(|member| member.states).sum::<usize>(), family.times().len());
        assert!(family.times().is_sorted());
        let names: Vec<&str> = family.fields().iter().map(|field| field.name).collect();
        for state in 0..family.times().len() {
            let positions = family.coordinates(state).unwrap();
            assert_eq!(positions.is_some(), names.contains(&"coordinates"));
            assert!(positions.is_none_or(|positions| positions.len() == header.nodes));
            let strain = family.shell_plastic_strain(state, Layers::Max).unwrap();
            assert_eq!(strain.is_some(), names.contains(&"shell_plastic_strain"));
            assert!(strain.is_none_or(|strain| strain.len() == header.shells));
            let strain = family.solid_plastic_strain(state, Layers::Max).unwrap();
            assert_eq!(strain.is_some(), names.contains(&"solid_plastic_strain"));
            assert!(strain.is_none_or(|strain| strain.len() == header.solids));
            let time = family.table(state, "time").unwrap().unwrap();
            assert_eq!(time.values, [family.times()[state]]);
        }
    }
}

#[test]
fn positions_are_initial_positions_plus_displacements() {
    let family = open("s14_displacements");
    for state in 0..family.times().len() {
        let displacement = family.table(state, "displacement").unwrap().unwrap();
        let positions = family.coordinates(state).unwrap().unwrap();
        for ((position, moved), start) in positions.iter().zip(displacement.rows()).zip(&family.geometry().coordinates)
        {
            assert_eq!(position.as_slice(), [start[0] + moved[0], start[1] + moved[1], start[2] + moved[2]]);
        }
    }
}

#[test]
fn velocities_are_the_differences_of_positions() {
    // a real family: central differences over three states against the velocity of the middle one
    let family = open("lasso_solid_int");
    let state = family.times().len() / 2;
    let at = |state: usize| family.coordinates(state).unwrap().unwrap();
    let (before, after) = (at(state - 1), at(state + 1));
    let dt = family.times()[state + 1] - family.times()[state - 1];
    let velocity = family.velocity(state).unwrap().unwrap();
    let (mut dot, mut one, mut other) = (0.0, 0.0, 0.0);
    for node in 0..velocity.len() {
        for axis in 0..3 {
            let difference = (after[node][axis] - before[node][axis]) / dt;
            dot += difference * velocity[node][axis];
            one += difference * difference;
            other += velocity[node][axis] * velocity[node][axis];
        }
    }
    // states are far apart, so not exactly; another block of the state gives about 0
    assert!(dot / (one * other).sqrt() > 0.9, "correlation {}", dot / (one * other).sqrt());
}

#[test]
fn layers_lie_between_the_least_and_the_largest() {
    for name in ["s01_shells_latin1", "s05_state_runs_on", "s08_rigid_shells"] {
        let family = open(name);
        let state = family.times().len() - 1;
        let value = |layers| family.shell_plastic_strain(state, layers).unwrap().unwrap();
        let table = family.shell_plastic_strain_layers(state).unwrap().unwrap();
        let (least, most, mean) = (value(Layers::Min), value(Layers::Max), value(Layers::Mean));
        let named = [value(Layers::Mid), value(Layers::Inner), value(Layers::Outer)];
        for (shell, row) in table.rows().enumerate() {
            assert_eq!(row.len(), family.header().layers);
            for (layer, values) in named.iter().enumerate() {
                assert!(values[shell] == row[layer] || row[layer].is_nan() && values[shell].is_nan());
            }
            assert!(row.iter().all(|value| value.is_nan() || (least[shell]..=most[shell]).contains(value)));
            assert!(mean[shell].is_nan() || (least[shell]..=most[shell]).contains(&mean[shell]));
        }
    }
}

#[test]
fn rigid_shells_are_nan_and_the_others_are_not() {
    for (name, rigid_parts) in [("s08_rigid_shells", vec![1]), ("x05_rigid_shells_road", vec![0, 2])] {
        let family = open(name);
        let strain = family.shell_plastic_strain(1, Layers::Max).unwrap().unwrap();
        for (shell, value) in family.geometry().shells.iter().zip(&strain) {
            assert_eq!(rigid_parts.contains(&shell.part), value.is_nan(), "{name}");
        }
        assert_eq!(family.header().rigid_shells, strain.iter().filter(|value| value.is_nan()).count());
        let rows = family.fields().iter().find(|field| field.name == "shell").unwrap().rows as usize;
        assert_eq!(rows + family.header().rigid_shells, family.header().shells);
        // the deletion table counts them all the same
        assert_eq!(family.deleted_shells(1).unwrap().unwrap().len(), family.header().shells);
    }
}

#[test]
fn deletion_tables_have_an_order_of_their_own() {
    // the generator deletes every (9 − state)th entry of solids, thick shells, shells, beams put one after the other
    let family = open("s03_big_endian_mix");
    let state = 3;
    let deletion = family.deletion(state).unwrap().unwrap();
    let flags: Vec<bool> = [&deletion.solids, &deletion.thick_shells, &deletion.shells, &deletion.beams]
        .into_iter()
        .flatten()
        .copied()
        .collect();
    let expected: Vec<bool> = (0..flags.len()).map(|entry| entry % (9 - state) == 0).collect();
    assert_eq!(flags, expected);
    let (geometry, lengths) =
        (family.geometry(), [&deletion.solids, &deletion.thick_shells, &deletion.shells, &deletion.beams]);
    let counts = [geometry.solids.len(), geometry.thick_shells.len(), geometry.shells.len(), geometry.beams.len()];
    assert_eq!(lengths.map(Vec::len), counts);
    assert!(family.deletion(0).unwrap().unwrap().solids.iter().all(|deleted| !deleted));
    assert!(open("s01_shells_latin1").deletion(0).unwrap().is_none());
}

#[test]
fn an_element_is_deleted_when_all_its_nodes_are() {
    let copy = Copy::of("s12_node_deletion");
    let family = Family::open(&copy.root()).unwrap();
    let shell = family.geometry().shells[4];
    let state_words = family.header().words_per_state as usize;
    let nodes = family.header().nodes;
    // the table of nodes is the last block of a state
    let mut bytes = copy.read("d3plot01");
    for node in 0..nodes {
        let word: f32 = if shell.nodes.contains(&(node as u32)) { 0.0 } else { 1.0 };
        let at = (state_words - nodes + node) * 4;
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
    }
    copy.write("d3plot01", &bytes);
    let deletion = family.deletion(0).unwrap().unwrap();
    let dead: Vec<usize> = (0..deletion.shells.len()).filter(|&shell| deletion.shells[shell]).collect();
    assert_eq!(dead, [4]);
    assert_eq!(deletion.nodes.iter().filter(|deleted| **deleted).count(), 4);
}

#[test]
fn user_numbers_are_those_of_the_deck() {
    for (name, first) in [("s03_big_endian_mix", 1000), ("x01_wide_numbers", 5_000_000_000)] {
        let family = open(name);
        let geometry = family.geometry();
        for ids in [
            &geometry.node_ids,
            &geometry.shell_ids,
            &geometry.solid_ids,
            &geometry.thick_shell_ids,
            &geometry.beam_ids,
        ] {
            for (index, id) in ids.iter().enumerate() {
                assert_eq!(*id, first + 7 * index as u64, "{name}");
            }
        }
        // parts in internal order count down from there, whatever list the file sorts
        assert!(family.parts().windows(2).all(|pair| pair[0].id == pair[1].id + 11), "{name}");
    }
}

#[test]
fn titles_keep_their_bytes_whatever_their_encoding() {
    let latin = open("s01_shells_latin1");
    assert_eq!(latin.parts()[1].title, "Querträger Ø 40 µm");
    assert_eq!(latin.parts()[1].title_bytes, b"Quertr\xe4ger \xd8 40 \xb5m");
    let gbk = open("s11_gbk_garbage");
    assert_eq!(gbk.parts()[0].title_bytes, [0xc7, 0xb0, 0xd7, 0xdd, 0xc1, 0xba]);
    assert_eq!(gbk.parts()[0].title.chars().count(), 6);
    assert_eq!(gbk.parts()[2].title_bytes, [0xa1; 71]);
}

#[test]
fn titles_in_utf8_are_read_as_such() {
    let copy = Copy::of("s01_shells_latin1");
    let mut root = copy.read("d3plot");
    let title = root.windows(4).position(|bytes| bytes == b"ngst").unwrap() - 2;
    let name = "前纵梁 Längsträger";
    root[title..title + 72].fill(b' ');
    root[title..title + name.len()].copy_from_slice(name.as_bytes());
    copy.write("d3plot", &root);
    assert_eq!(Family::open(&copy.root()).unwrap().parts()[0].title, name);
}

#[test]
fn what_the_header_says() {
    let family = open("lasso_order");
    let header = family.header();
    assert_eq!((header.precision, header.byte_order), (Precision::Single, ByteOrder::Little));
    assert_eq!(header.file_type, FileType::D3plot);
    assert_eq!(header.release, "R920");
    let header = open("x10_states_in_root").header().clone();
    assert_eq!((header.precision, header.byte_order), (Precision::Double, ByteOrder::Big));
    assert_eq!(header.title, "synthetic family");
}

#[test]
fn states_may_be_read_in_any_order_by_many_threads() {
    let family = open("s04_gaps_in_numbers");
    let alone: Vec<_> = (0..6).map(|state| family.coordinates(state).unwrap()).collect();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (family, alone) = (&family, &alone);
            scope.spawn(move || {
                for turn in 0..60 {
                    let state = (turn * 5 + thread) % 6;
                    assert_eq!(family.coordinates(state).unwrap(), alone[state]);
                }
            });
        }
    });
}

/// Writes airbag sections into a family without them, as the manual has them: two bags, 5 particles.
fn with_airbags(copy: &Copy, version: i32) {
    let words = |values: &[i32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    copy.poke(&[(54, version * 1000 + 2)]);
    let root = copy.read("d3plot");
    let whole = open("s12_node_deletion");
    let mark = root.windows(4).position(|bytes| bytes == (-999_999.0_f32).to_le_bytes()).unwrap();
    let (of_bag, of_particle, particles, in_state) = (4, 14, 5, 2);
    let mut control = words(&[of_bag, of_particle, particles, in_state]);
    control.extend(words(&[3][..usize::from(version == 4)]));
    control.extend(words(&vec![1; 9 * (of_bag + of_particle + in_state) as usize]));
    let geometry = words(&vec![7; 2 * of_bag as usize]);
    copy.write("d3plot", &[&root[..256], &control, &root[256..mark], &geometry, &root[mark..]].concat());
    let (states, size) = (copy.read("d3plot01"), whole.header().words_per_state as usize * 4);
    let mut longer = Vec::new();
    for state in states.chunks_exact(size).take(whole.times().len()) {
        longer.extend_from_slice(state);
        longer.extend(vec![0x3f; (2 * in_state + particles * of_particle) as usize * 4]);
    }
    longer.extend((-999_999.0_f32).to_le_bytes());
    copy.write("d3plot01", &longer);
}

#[test]
fn airbag_particles_are_passed_over_if_the_end_marks_confirm_them() {
    let whole = open("s12_node_deletion");
    for version in [0, 3, 4] {
        let copy = Copy::of("s12_node_deletion");
        with_airbags(&copy, version);
        let family = Family::open(&copy.root()).unwrap();
        assert_eq!(family.warnings(), []);
        assert_eq!((family.geometry(), family.times()), (whole.geometry(), whole.times()));
        for state in 0..whole.times().len() {
            assert_eq!(family.coordinates(state).unwrap(), whole.coordinates(state).unwrap());
            assert_eq!(family.deletion(state).unwrap(), whole.deletion(state).unwrap());
        }
        // one word more a particle than the states have: refused, not guessed
        copy.poke(&[(65, copy.word(65) + 1), (67, copy.word(67) - 1)]);
        let error = Family::open(&copy.root()).unwrap_err();
        assert!(error.to_string().contains("airbag particles (NPEFG)"), "{error}");
    }
}
