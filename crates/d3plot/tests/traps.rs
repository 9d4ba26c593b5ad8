//! Traps of real files that no other test springs; the table in `docs/reading.md` lists them all with their tests.

mod shared;

use d3plot::{
    ByteOrder, Content, Error, Family, Geometry, Layers, Part, Particle, Positions, Precision, Shell, Stored, Warning,
    WriteOptions, Writer,
};

use shared::{Copy, testdata};

fn sheet() -> (Geometry, Vec<Part>) {
    let mut geometry = Geometry::default();
    geometry.coordinates = (0..12).map(|k| [f64::from(k % 4), f64::from(k / 4), 0.0]).collect();
    let quad = |k: u32| Shell { nodes: [k, k + 1, k + 5, k + 4], part: k % 2 };
    geometry.shells = [0, 1, 2, 4, 5, 6].map(quad).to_vec();
    (geometry, vec![Part::new(10, "A"), Part::new(20, "B")])
}

fn written(content: &Content, options: &WriteOptions, states: u32) -> (tempfile::TempDir, Family) {
    let (geometry, parts) = sheet();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    let mut writer = Writer::create(&root, &geometry, &parts, content, options).unwrap();
    for k in 0..states {
        writer.state(f64::from(k)).write().unwrap();
    }
    writer.finish().unwrap();
    let family = Family::open(&root).unwrap();
    (folder, family)
}

#[test]
fn trap_1_every_word_size_and_byte_order_is_told_by_content() {
    for (precision, byte_order) in [
        (Precision::Single, ByteOrder::Little),
        (Precision::Single, ByteOrder::Big),
        (Precision::Double, ByteOrder::Little),
        (Precision::Double, ByteOrder::Big),
    ] {
        let options = WriteOptions { precision, byte_order, ..WriteOptions::default() };
        let (_folder, family) = written(&Content::default(), &options, 2);
        assert_eq!((family.header().precision, family.header().byte_order), (precision, byte_order));
        assert_eq!(family.times(), [0.0, 1.0]);
    }
}

#[test]
fn trap_2_any_number_of_extra_words_is_skipped_exactly() {
    let whole = Family::open(&testdata().join("s12_node_deletion")).unwrap();
    for extra in [1, 13, 16, 17, 18, 63, 64, 200] {
        let copy = Copy::of("s12_node_deletion");
        copy.poke(&[(57, extra)]);
        let root = copy.read("d3plot");
        copy.write("d3plot", &[&root[..256], &vec![0; extra as usize * 4], &root[256..]].concat());
        let family = Family::open(&copy.root()).unwrap();
        assert_eq!((family.geometry(), family.times(), family.warnings()), (whole.geometry(), whole.times(), &[][..]));
    }
}

#[test]
fn trap_4_states_without_coordinates() {
    let content = Content { positions: Positions::None, velocity: true, ..Content::default() };
    let (_folder, family) = written(&content, &WriteOptions::default(), 3);
    assert_eq!(family.times().len(), 3);
    assert_eq!(family.coordinates(1).unwrap(), None);
    assert!(family.velocity(1).unwrap().is_some());
}

#[test]
fn trap_8_rigid_shells_that_have_words_all_the_same() {
    // as a d3part: NUMRBE counts shells whose words are there
    let content = Content { plastic_strain: Stored::All, layers: 3, ..Content::default() };
    let (geometry, parts) = sheet();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    let mut writer = Writer::create(&root, &geometry, &parts, &content, &WriteOptions::default()).unwrap();
    for k in 0..3 {
        let mut state = writer.state(f64::from(k));
        state.set("shell_plastic_strain", &[-1.0; 18]).unwrap();
        state.write().unwrap();
    }
    writer.finish().unwrap();
    let whole = Family::open(&root).unwrap();
    let bytes = std::fs::read(&root).unwrap();
    let words = |values: &[i32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let mut header = bytes[..256].to_vec();
    header[15 * 4..16 * 4].copy_from_slice(&5_i32.to_le_bytes());
    std::fs::write(&root, [&header, &words(&[3, 2, 24, 20]), &bytes[256..]].concat()).unwrap();
    let family = Family::open(&root).unwrap();
    let [Warning::StateSize { used, reason, .. }] = family.warnings() else { panic!("{:?}", family.warnings()) };
    assert_eq!((*used, family.times()), (whole.header().words_per_state, whole.times()));
    assert!(reason.starts_with("rigid shells have words"), "{reason}");
    let strain = family.shell_plastic_strain(2, Layers::Max).unwrap().unwrap();
    assert!(strain.iter().all(|value| !value.is_nan()));
}

#[test]
fn trap_9_rigid_nodes_in_no_layout_that_checks_are_refused_by_name() {
    let copy = Copy::of("x03_rigid_nodes");
    let root = copy.read("d3plot");
    // a node of the first body counts as another one: then one node is neither rigid nor active
    let body: Vec<u8> = [1_i32, 2, 7].iter().flat_map(|node| node.to_le_bytes()).collect();
    let at = root.windows(4).position(|word| word == (-999_999.0_f32).to_le_bytes()).unwrap();
    let place = (0..at).rev().find(|&place| root[place..].starts_with(&body[..8]));
    let place = place.expect("the list of the first body");
    let mut wrong = root.clone();
    wrong[place..place + 4].copy_from_slice(&2_i32.to_le_bytes());
    copy.write("d3plot", &wrong);
    let error = Family::open(&copy.root()).unwrap_err();
    assert!(error.to_string().contains("NDIM = 8"), "{error}");
}

#[test]
fn trap_20_titles_in_any_order_or_none() {
    let (folder, whole) = written(&Content::default(), &WriteOptions { title: "T".into(), ..Default::default() }, 2);
    let root = folder.path().join("d3plot");
    let bytes = std::fs::read(&root).unwrap();
    let mark = bytes.windows(4).position(|word| word == (-999_999.0_f32).to_le_bytes()).unwrap();
    // the mark, 90001 with two parts, 90000, the mark
    let (parts, head) = (mark + 4..mark + 12 + 2 * 76, mark + 12 + 2 * 76..mark + 16 + 2 * 76 + 72);
    let swapped = [&bytes[..mark + 4], &bytes[head.clone()], &bytes[parts.clone()], &bytes[head.end..]].concat();
    std::fs::write(&root, swapped).unwrap();
    let family = Family::open(&root).unwrap();
    assert_eq!((family.parts(), family.times()), (whole.parts(), whole.times()));
    // none at all: the states are in the next member
    for end in [mark, mark + 4] {
        std::fs::write(&root, &bytes[..end]).unwrap();
        let family = Family::open(&root).unwrap();
        assert!(family.parts().iter().all(|part| part.title.is_empty()));
        assert_eq!((family.times(), family.parts()[1].id), (whole.times(), 20));
    }
}

#[test]
fn trap_21_parts_without_elements_are_kept_and_marked() {
    let (geometry, mut parts) = sheet();
    parts.push(Part::new(15, "NODAL RIGID BODY"));
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    let options = WriteOptions::default();
    Writer::create(&root, &geometry, &parts, &Content::default(), &options).unwrap().finish().unwrap();
    let family = Family::open(&root).unwrap();
    let told: Vec<(u64, bool)> = family.parts().iter().map(|part| (part.id, part.is_used())).collect();
    assert_eq!(told, [(10, true), (20, true), (15, false)]);
}

#[test]
fn trap_22_plastic_strain_tensors_have_18_words_however_many_layers() {
    for layers in [1, 3, 5, 10] {
        let content = Content {
            layers,
            stress: Stored::All,
            plastic_strain: Stored::All,
            thickness: true,
            strains: true,
            plastic_strain_tensor: true,
            ..Content::default()
        };
        let (_folder, family) = written(&content, &WriteOptions::default(), 3);
        assert_eq!((family.times().len(), family.warnings()), (3, &[][..]));
        assert_eq!(family.values(1, "shell_plastic_strain_tensor").unwrap().unwrap().columns, 18);
        assert_eq!(family.values(1, "shell_strain").unwrap().unwrap().columns, 12);
    }
}

#[test]
fn trap_24_lists_of_particle_flags_of_any_length() {
    for (flags, words) in
        [(vec![10, 1, 1, 6, 1, 1, 1, 1, 6, 1], 20), (vec![11, 1, 1, 6, 1, 1, 1, 1, 12, 1, 2], 28), (vec![3, -1, 6], 8)]
    {
        let (mut geometry, mut parts) = sheet();
        geometry.sph = vec![Particle { node: 3, part: 2 }, Particle { node: 7, part: 2 }];
        parts.push(Part::new(30, "BIRD"));
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("d3plot");
        let content = Content { sph_flags: flags, ..Content::default() };
        let mut writer = Writer::create(&root, &geometry, &parts, &content, &WriteOptions::default()).unwrap();
        for k in 0..3 {
            writer.state(f64::from(k)).write().unwrap();
        }
        writer.finish().unwrap();
        let family = Family::open(&root).unwrap();
        let sph = family.values(2, "sph").unwrap().unwrap();
        assert_eq!((family.times().len(), sph.columns, sph.values[0]), (3, words, 3.0));
        assert_eq!(family.warnings(), []);
    }
}

#[test]
fn trap_29_memory_does_not_follow_what_a_header_claims() {
    // parts: each would cost memory though nothing of it is in the file
    let copy = Copy::of("s12_node_deletion");
    copy.poke(&[(51, 3000)]);
    let error = Family::open(&copy.root()).unwrap_err();
    assert!(matches!(error, Error::Count { name: "NMMAT", value: 3000, .. }), "{error}");
}

#[test]
fn two_runs_mixed_in_one_folder_are_told() {
    // members of a longer run left behind in the folder of a shorter one: their times do not go on
    let copy = Copy::of("s01_shells_latin1");
    let whole = Family::open(&copy.root()).unwrap();
    let old = copy.read("d3plot01");
    std::fs::write(copy.path("d3plot09"), old).unwrap();
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(family.times(), whole.times());
    let kinds: Vec<&str> = family.warnings().iter().map(Warning::kind).collect();
    assert_eq!(kinds, ["missing-members", "unread-tail"]);
    // a member of another mesh
    std::fs::remove_file(copy.path("d3plot09")).unwrap();
    std::fs::copy(testdata().join("s12_node_deletion/d3plot01"), copy.path("d3plot02")).unwrap();
    let family = Family::open(&copy.root()).unwrap();
    assert!(
        family
            .warnings()
            .iter()
            .any(|warning| matches!(warning, Warning::UnreadTail { .. } | Warning::CutState { .. }))
    );
    assert_eq!(family.coordinates(0).unwrap(), whole.coordinates(0).unwrap());
}
