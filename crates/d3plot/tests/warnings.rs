//! What is missing or odd is told, and the rest is read.

mod shared;

use d3plot::{Family, Layers, Warning};

use shared::{Copy, testdata};

fn kinds(family: &Family) -> Vec<&'static str> {
    family.warnings().iter().map(Warning::kind).collect()
}

const MARK: [u8; 4] = (-999_999.0_f32).to_le_bytes();

#[test]
fn sound_families_have_no_warnings() {
    for name in [
        "s01_shells_latin1",
        "s02_double_solids",
        "s03_big_endian_mix",
        "s05_state_runs_on",
        "s06_extra_penout",
        "s07_temperature_mass",
        "s08_rigid_shells",
        "s10_no_marks_one_file",
        "s12_node_deletion",
        "s14_displacements",
        "x01_wide_numbers",
        "x05_rigid_shells_road",
        "x06_ten_node_tetrahedra",
        "x07_particles",
        "x10_states_in_root",
        "x11_geometry_runs_on",
        "lasso_beamip",
        "lasso_solid_int",
    ] {
        assert_eq!(kinds(&Family::open(&testdata().join(name)).unwrap()), [""; 0], "{name}");
    }
}

#[test]
fn a_cut_state_says_how_many_words_are_missing() {
    let family = Family::open(&testdata().join("s09_cut_in_state")).unwrap();
    let state = family.header().words_per_state;
    let [Warning::CutState { offset, words_missing, .. }] = family.warnings() else {
        panic!("{:?}", family.warnings())
    };
    // the member holds 1500 words: one state of 1356 and the start of another
    assert_eq!((*offset, *words_missing), (state * 4, 2 * state - 1500));
    assert!(family.warnings()[0].to_string().ends_with("(byte 5424) is cut, 1212 words are missing; left out"));
}

#[test]
fn gaps_between_members_are_counted() {
    let family = Family::open(&testdata().join("s04_gaps_in_numbers")).unwrap();
    let counts: Vec<u32> = family
        .warnings()
        .iter()
        .map(|warning| match warning {
            Warning::MissingMembers { count, .. } => *count,
            other => panic!("{other}"),
        })
        .collect();
    assert_eq!(counts, [2, 4, 88]);
}

#[test]
fn a_gap_inside_states_that_run_on_costs_those_states_only() {
    for missing in 1..=12 {
        let whole = Family::open(&testdata().join("s05_state_runs_on")).unwrap();
        let copy = Copy::of("s05_state_runs_on");
        std::fs::remove_file(copy.path(&format!("d3plot{missing:02}"))).unwrap();
        let family = Family::open(&copy.root()).unwrap();
        assert_eq!(family.times().len(), 2, "d3plot{missing:02}: {:?}", family.warnings());
        for (state, time) in family.times().iter().enumerate() {
            let same = whole.times().iter().position(|other| other == time).unwrap();
            assert_eq!(family.coordinates(state).unwrap(), whole.coordinates(same).unwrap());
        }
    }
}

#[test]
fn a_member_that_is_a_root_itself_is_left_out() {
    let copy = Copy::of("s12_node_deletion");
    std::fs::copy(copy.root(), copy.path("d3plot02")).unwrap();
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(kinds(&family), ["another-root"]);
    assert_eq!(family.members().len(), 2);
}

#[test]
fn adaptive_levels_are_named_from_every_level() {
    let folder = testdata().join("x08_adaptive");
    let base = Family::open(&folder).unwrap();
    let level = Family::open(&folder.join("d3plotaa")).unwrap();
    assert_eq!((kinds(&base), kinds(&level)), (vec!["adaptive-levels"], vec!["adaptive-levels"]));
    assert_eq!((base.header().shells, level.header().shells), (4, 16));
    assert_eq!(level.times().len(), 2);
}

#[test]
fn cut_titles_cost_only_titles() {
    let copy = Copy::of("s01_shells_latin1");
    let whole = Family::open(&copy.root()).unwrap();
    let root = copy.read("d3plot");
    let mark = root.windows(8).position(|bytes| bytes == [MARK, 90001_i32.to_le_bytes()].concat()).unwrap();
    copy.write("d3plot", &root[..mark + 4 + 8 + 76 + 10]);
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(kinds(&family), ["titles-cut"]);
    assert_eq!(family.parts()[0], whole.parts()[0]);
    assert_eq!(family.parts()[1].title, "");
    assert_eq!(family.times(), whole.times());
}

#[test]
fn an_unknown_title_record_hides_only_what_follows_it() {
    let family = Family::open(&testdata().join("x12_unknown_title")).unwrap();
    assert_eq!(kinds(&family), ["unknown-title-record"]);
    assert_eq!(family.parts()[1].title, "part 2");
    assert_eq!(family.times().len(), 2);
}

#[test]
fn a_time_that_goes_back_ends_its_member() {
    let copy = Copy::of("s04_gaps_in_numbers");
    let mut bytes = copy.read("d3plot05");
    bytes[..4].copy_from_slice(&0.0005_f32.to_le_bytes());
    copy.write("d3plot05", &bytes);
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(family.times().len(), 5);
    assert!(kinds(&family).contains(&"unread-tail"));
    bytes[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    copy.write("d3plot05", &bytes);
    assert_eq!(Family::open(&copy.root()).unwrap().times().len(), 5);
}

#[test]
fn user_numbers_that_contradict_are_replaced_by_a_count() {
    let copy = Copy::of("s12_node_deletion");
    let family = Family::open(&copy.root()).unwrap();
    let numbers = 64 + 3 * family.header().nodes + 5 * family.header().shells;
    copy.poke(&[(numbers + 5, 3)]);
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(kinds(&family), ["user-numbers"]);
    assert!(family.geometry().node_ids.is_empty());
    assert_eq!([0, 1, 2].map(|node| family.geometry().node_id(node)), [1, 2, 3]);
}

#[test]
fn a_part_beyond_the_count_becomes_one_more() {
    let copy = Copy::of("s12_node_deletion");
    let family = Family::open(&copy.root()).unwrap();
    let (nodes, parts) = (family.header().nodes, family.parts().len());
    copy.poke(&[(64 + 3 * nodes + 4, 2_000_000_000)]);
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(kinds(&family), ["parts-beyond-count"]);
    assert_eq!(family.parts().len(), parts + 1);
    assert_eq!(family.geometry().shells[0].part as usize, parts);
    assert_eq!(family.parts()[parts].shells, 1);
}

#[test]
fn words_that_the_header_claims_but_the_states_lack_are_found_out_by_the_end_marks() {
    // KINENG set, but no kinetic energy in the states
    let copy = Copy::of("s06_extra_penout");
    let whole = Family::open(&testdata().join("s06_extra_penout")).unwrap();
    let mut family = Vec::new();
    let state = whole.header().words_per_state as usize;
    let nodes = whole.header().nodes;
    let kinetic = whole.fields().iter().find(|field| field.name == "kinetic_energy").map(|field| field.rows).unwrap();
    assert_eq!(kinetic as usize, nodes);
    let bytes = copy.read("d3plot01");
    // the block stands before the velocities
    let before: usize = {
        let words = |name: &str| {
            whole
                .fields()
                .iter()
                .find(|field| field.name == name)
                .map_or(0, |field| (field.rows * field.columns) as usize)
        };
        ["time", "globals", "coordinates", "contact_penetration", "contact_energy"].iter().map(|name| words(name)).sum()
    };
    for k in 0..3 {
        let state = &bytes[k * state * 4..(k + 1) * state * 4];
        family.extend_from_slice(&state[..before * 4]);
        family.extend_from_slice(&state[(before + nodes) * 4..]);
    }
    family.extend(MARK);
    copy.write("d3plot01", &family);
    let family = Family::open(&copy.root()).unwrap();
    let [Warning::StateSize { declared, used, reason }] = family.warnings() else { panic!("{:?}", family.warnings()) };
    assert_eq!((*declared as usize, *used as usize), (state, state - nodes));
    // both have one word a node: the marks cannot tell which is missing
    assert_eq!(reason, "no contact energy or no kinetic energy");
    assert_eq!(family.times(), whole.times());
    for state in 0..3 {
        assert_eq!(family.velocity(state).unwrap(), whole.velocity(state).unwrap());
        assert_eq!(
            family.shell_plastic_strain(state, Layers::Max).unwrap(),
            whole.shell_plastic_strain(state, Layers::Max).unwrap()
        );
    }
}

#[test]
fn rigid_nodes_are_told() {
    let family = Family::open(&testdata().join("x03_rigid_nodes")).unwrap();
    assert_eq!(family.warnings(), [Warning::RigidNodes { count: 4, rates: true }]);
    assert!(family.warnings()[0].to_string().contains("4 nodes of rigid bodies: their results are rebuilt"));
    let family = Family::open(&testdata().join("x04_rigid_nodes_road")).unwrap();
    assert_eq!(family.warnings(), [Warning::RigidNodes { count: 4, rates: false }]);
    assert!(family.warnings()[0].to_string().contains("velocity and acceleration of these are NaN"));
}

#[test]
fn a_root_alone_has_no_states() {
    let copy = Copy::of("s12_node_deletion");
    std::fs::remove_file(copy.path("d3plot01")).unwrap();
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(kinds(&family), ["no-states"]);
    assert_eq!(family.geometry().shells.len(), 18);
}
