//! What is written is read again with the same numbers, whatever the form of the file.

mod shared;

use d3plot::{
    Beam, ByteOrder, Content, DeletionTable, Error, Family, Geometry, Layers, Part, Particle, Positions, Precision,
    Shell, Solid, Stored, Thermal, Warning, WriteOptions, Writer,
};

use shared::testdata;

/// One element of each kind and more, with numbers of their own.
fn mesh() -> (Geometry, Vec<Part>) {
    let mut geometry = Geometry::default();
    geometry.coordinates = (0..30).map(|k| [f64::from(k % 5), f64::from(k / 5), f64::from(k) / 8.0]).collect();
    geometry.node_ids = (0..30).map(|k| 1000 + 7 * k).collect();
    geometry.shells = (0..4).map(|k| Shell { nodes: [k, k + 1, k + 6, k + 5], part: k % 2 }).collect();
    geometry.shells.push(Shell { nodes: [10, 11, 16, 16], part: 1 });
    geometry.shell_ids = vec![9, 8, 7, 6, 5];
    geometry.solids = vec![Solid { nodes: [0, 1, 6, 5, 10, 11, 16, 15], part: 2 }];
    geometry.thick_shells = vec![Solid { nodes: [12, 13, 18, 17, 22, 23, 28, 27], part: 3 }; 2];
    geometry.beams = vec![
        Beam { nodes: [0, 29], orientation: Some(3), part: 4 },
        Beam { nodes: [1, 2], orientation: None, part: 4 },
    ];
    (geometry.solid_ids, geometry.thick_shell_ids, geometry.beam_ids) = (vec![77], vec![1, 2], vec![12, 11]);
    geometry.sph = vec![Particle { node: 24, part: 5 }, Particle { node: 25, part: 5 }];
    let names = ["Längsträger", "WEB", "", "前纵梁", "weld", "bird"];
    let parts = names.iter().zip([50, 40, 30, 31, 32, 33]).map(|(title, id)| Part::new(id, title)).collect();
    (geometry, parts)
}

fn everything() -> Content {
    Content {
        globals: 13,
        thermal: Thermal::TemperatureAndFlux,
        mass_scaling: true,
        temperature_rate: true,
        residual_forces: true,
        contact_penetration: 3,
        contact_energy: true,
        kinetic_energy: true,
        velocity: true,
        acceleration: true,
        solid_thermal: 2,
        layers: 5,
        stress: Stored::All,
        plastic_strain: Stored::All,
        histories: 2,
        resultants: true,
        thickness: true,
        strains: true,
        solid_points: 8,
        solid_histories: 7,
        beam_forces: true,
        beam_points: 4,
        beam_histories: 1,
        deletion: DeletionTable::Elements,
        sph_flags: vec![11, 1, 1, 6, 1, 1, 1, 1, 6, 1, 2],
        ..Content::default()
    }
}

/// Fills every table of a state with numbers that single precision holds, other ones in each state.
fn fill(writer: &mut Writer, family_fields: &[(String, usize)], k: usize) {
    let mut state = writer.state(k as f64 * 0.5);
    for (index, (name, count)) in family_fields.iter().enumerate() {
        if name != "time" {
            let values: Vec<f64> = (0..*count).map(|at| (at * 8 + index + 1000 * k) as f64 / 64.0 - 3.0).collect();
            state.set(name, &values).unwrap();
        }
    }
    state.write().unwrap();
}

#[test]
fn everything_in_every_form_is_read_as_it_was_written() {
    let (geometry, parts) = mesh();
    for precision in [Precision::Single, Precision::Double] {
        for byte_order in [ByteOrder::Little, ByteOrder::Big] {
            for (member_bytes, member_states, states_in_root) in
                [(None, None, false), (None, Some(1), false), (None, None, true), (Some(4096), None, false)]
            {
                let folder = tempfile::tempdir().unwrap();
                let root = folder.path().join("run(2).ptf");
                let options = WriteOptions {
                    title: "everything".into(),
                    precision,
                    byte_order,
                    member_bytes,
                    member_states,
                    states_in_root,
                    ..WriteOptions::default()
                };
                let mut writer = Writer::create(&root, &geometry, &parts, &everything(), &options).unwrap();
                // the tables, as a reader names them
                let empty = Family::open(&root).unwrap();
                let tables = |family: &Family| -> Vec<(String, usize)> {
                    let fields = family.fields();
                    let of_elements = ["shell_", "thick_shell_", "beam_", "solid_s", "solid_p", "solid_h"];
                    let own =
                        fields.iter().filter(|field| !of_elements.iter().any(|kind| field.name.starts_with(kind)));
                    own.map(|field| (field.name.to_owned(), (field.rows * field.columns) as usize)).collect()
                };
                let names = tables(&empty);
                assert!(names.len() > 20);
                (0..5).for_each(|k| fill(&mut writer, &names, k));
                writer.finish().unwrap();

                let family = Family::open(&root).unwrap();
                assert_eq!(family.warnings(), [], "{options:?}");
                assert_eq!(family.times(), [0.0, 0.5, 1.0, 1.5, 2.0], "{options:?}");
                assert_eq!(family.geometry(), &geometry);
                assert_eq!((family.header().precision, family.header().byte_order), (precision, byte_order));
                assert_eq!(family.header().title, "everything");
                let ids: Vec<(u64, &str)> = family.parts().iter().map(|part| (part.id, part.title.as_str())).collect();
                assert_eq!(ids[0], (50, "Längsträger"));
                assert_eq!(ids[3], (31, "前纵梁"));
                for k in 0..5 {
                    for (index, (name, count)) in names.iter().enumerate().skip(1) {
                        let values = family.table(k, name).unwrap().unwrap().values;
                        let expected: Vec<f64> =
                            (0..*count).map(|at| (at * 8 + index + 1000 * k) as f64 / 64.0 - 3.0).collect();
                        assert_eq!(values, expected, "{name} of state {k}");
                    }
                }
                match (member_bytes, member_states) {
                    (Some(limit), _) => assert!(family.members().iter().all(|member| member.bytes <= limit)),
                    (_, Some(_)) => assert_eq!(family.members().len(), 6),
                    _ => assert_eq!(family.members().len(), if states_in_root { 1 } else { 2 }),
                }
            }
        }
    }
}

/// Writes a family again, table by table, as it was or in another form.
fn copy(family: &Family, root: &std::path::Path, options: &WriteOptions) {
    let content = Content::of(family);
    let mut writer = Writer::create(root, family.geometry(), family.parts(), &content, options).unwrap();
    let tables: Vec<&str> = family.fields().iter().map(|field| field.name).collect();
    for (k, time) in family.times().iter().enumerate() {
        let mut state = writer.state(*time);
        for table in tables.iter().filter(|table| **table != "time") {
            let values = family.table(k, table).unwrap();
            if let Some(table_values) = values.filter(|_| !UNWRITTEN.contains(table)) {
                state.set(table, &table_values.values).unwrap();
            }
        }
        state.write().unwrap();
    }
    writer.finish().unwrap();
}

/// Tables that a written family does not have.
const UNWRITTEN: [&str; 4] = ["road", "rigid_motion", "airbag", "airbag_particle"];

#[test]
fn families_of_testdata_survive_being_written_again() {
    let mut copied = 0;
    for entry in std::fs::read_dir(testdata()).unwrap() {
        let folder = entry.unwrap().path();
        let Ok(family) = Family::open(&folder) else { continue };
        // the nodal blocks of these leave nodes out
        if family.warnings().iter().any(|warning| warning.kind() == "rigid-nodes") {
            continue;
        }
        let place = tempfile::tempdir().unwrap();
        let root = place.path().join("d3plot");
        let header = family.header();
        let options = WriteOptions {
            title: header.title.clone(),
            precision: header.precision,
            byte_order: ByteOrder::Little,
            ..WriteOptions::default()
        };
        copy(&family, &root, &options);
        let again = Family::open(&root).unwrap();
        assert_eq!(again.warnings(), if family.times().is_empty() { &[Warning::NoStates][..] } else { &[] });
        assert_eq!(again.geometry(), &numbered(family.geometry()), "{}", folder.display());
        assert_eq!(again.times(), family.times());
        let facts = |part: &Part| (part.id, part.title.clone(), part.material, part.shells, part.solids);
        assert!(again.parts().iter().map(facts).eq(family.parts().iter().map(facts)), "{}", folder.display());
        let names = |family: &Family| -> Vec<(&str, u64)> {
            family
                .fields()
                .iter()
                .filter(|field| !UNWRITTEN.contains(&field.name))
                .map(|f| (f.name, f.columns))
                .collect()
        };
        assert_eq!(names(&again), names(&family), "{}", folder.display());
        for k in 0..family.times().len() {
            for (name, _) in names(&family) {
                let values = |family: &Family| family.table(k, name).unwrap().map(|table| bits(&table.values));
                assert_eq!(values(&again), values(&family), "{}: {name}", folder.display());
            }
            let strain =
                |family: &Family| bits(&family.shell_plastic_strain(k, Layers::Max).unwrap().unwrap_or_default());
            assert_eq!(strain(&again), strain(&family));
            assert_eq!(again.deletion(k).unwrap(), family.deletion(k).unwrap());
        }
        copied += 1;
    }
    assert!(copied >= 24, "{copied}");
}

/// A written family always has user numbers.
fn numbered(geometry: &Geometry) -> Geometry {
    let mut geometry = geometry.clone();
    let count = |ids: &mut Vec<u64>, count: usize| {
        if ids.is_empty() {
            *ids = (1..=count as u64).collect();
        }
    };
    count(&mut geometry.node_ids, geometry.coordinates.len());
    count(&mut geometry.shell_ids, geometry.shells.len());
    count(&mut geometry.solid_ids, geometry.solids.len());
    count(&mut geometry.thick_shell_ids, geometry.thick_shells.len());
    count(&mut geometry.beam_ids, geometry.beams.len());
    geometry
}

/// Equal bits are equal numbers, NaN too.
fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn small() -> (Geometry, Vec<Part>) {
    let (mut geometry, _) = mesh();
    geometry.solids.clear();
    geometry.thick_shells.clear();
    geometry.beams.clear();
    geometry.sph.clear();
    (geometry.solid_ids, geometry.thick_shell_ids, geometry.beam_ids) = Default::default();
    (geometry, vec![Part::new(7, "A"), Part::new(3, "B")])
}

#[test]
fn a_family_is_whole_after_every_state() {
    let (geometry, parts) = small();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    for states_in_root in [false, true] {
        let options = WriteOptions { states_in_root, member_states: Some(2), ..WriteOptions::default() };
        let root = root.with_extension(if states_in_root { "a" } else { "b" });
        let mut writer = Writer::create(&root, &geometry, &parts, &Content::default(), &options).unwrap();
        for k in 0..5 {
            let seen = Family::open(&root).unwrap();
            assert_eq!(seen.times().len(), k);
            assert!(seen.warnings().iter().all(|warning| *warning == Warning::NoStates));
            let mut state = writer.state(k as f64);
            state.coordinates(&geometry.coordinates).unwrap();
            // nothing of a state is there before it is written
            assert_eq!(Family::open(&root).unwrap().times().len(), k);
            state.write().unwrap();
            writer.flush().unwrap();
        }
        assert_eq!(writer.states(), 5);
    }
}

#[test]
fn displacements_are_what_is_stored() {
    let (geometry, parts) = small();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    let content = Content { positions: Positions::Displacements, ..Content::default() };
    let mut writer = Writer::create(&root, &geometry, &parts, &content, &WriteOptions::default()).unwrap();
    writer.state(0.0).write().unwrap();
    let moved: Vec<[f64; 3]> = geometry.coordinates.iter().map(|[x, y, z]| [x + 1.0, *y, z - 0.5]).collect();
    let mut state = writer.state(1.0);
    state.coordinates(&moved).unwrap();
    state.write().unwrap();
    writer.finish().unwrap();
    let family = Family::open(&root).unwrap();
    assert_eq!(family.coordinates(0).unwrap().unwrap(), geometry.coordinates);
    assert_eq!(family.coordinates(1).unwrap().unwrap(), moved);
    let stored = family.table(1, "displacement").unwrap().unwrap();
    assert!(stored.rows().all(|row| row == [1.0, 0.0, -0.5]));
}

#[test]
fn rigid_shells_have_no_words() {
    let (geometry, mut parts) = small();
    parts[0].material = Some(24);
    parts[1].material = Some(20);
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    let content = Content { plastic_strain: Stored::All, layers: 2, ..Content::default() };
    let mut writer = Writer::create(&root, &geometry, &parts, &content, &WriteOptions::default()).unwrap();
    let mut state = writer.state(0.0);
    state.set("shell_plastic_strain", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]).unwrap();
    state.write().unwrap();
    let family = Family::open(&root).unwrap();
    assert_eq!(family.parts()[1].material, Some(20));
    assert_eq!(family.header().rigid_shells, 3);
    let most = family.shell_plastic_strain(0, Layers::Max).unwrap().unwrap();
    assert_eq!((most[0], most[2]), (1.0, 5.0));
    assert!([1, 3, 4].iter().all(|&shell| most[shell].is_nan()));
}

#[test]
fn user_numbers_beyond_32_bits_are_kept() {
    let (mut geometry, mut parts) = small();
    geometry.node_ids[3] = 5_000_000_000;
    parts[0].id = 6_000_000_000;
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    let writer = Writer::create(&root, &geometry, &parts, &Content::default(), &WriteOptions::default()).unwrap();
    writer.finish().unwrap();
    let family = Family::open(&root).unwrap();
    assert_eq!(family.geometry().node_ids, geometry.node_ids);
    assert_eq!((family.parts()[0].id, family.parts()[0].title.as_str()), (6_000_000_000, "A"));
}

#[test]
fn nothing_is_overwritten_and_what_does_not_fit_is_refused() {
    let (geometry, parts) = small();
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("d3plot");
    let create = |root: &std::path::Path, geometry: &Geometry, content: &Content| {
        Writer::create(root, geometry, &parts, content, &WriteOptions::default())
    };
    let mut writer = create(&root, &geometry, &Content::default()).unwrap();
    assert!(matches!(create(&root, &geometry, &Content::default()), Err(Error::Exists { path }) if path == root));
    std::fs::write(folder.path().join("other07"), "").unwrap();
    let other = create(&folder.path().join("other"), &geometry, &Content::default());
    assert!(matches!(other, Err(Error::Exists { path }) if path.ends_with("other07")));

    let says = |result: Result<(), Error>, words: &str| {
        let error = result.unwrap_err();
        assert!(matches!(error, Error::Content { .. }) && error.to_string().contains(words), "{error}");
    };
    let mut state = writer.state(0.0);
    says(state.coordinates(&geometry.coordinates[1..]).map(drop), "87 values given for 'coordinates', 90 expected");
    says(state.set("shell_plastic_strain", &[0.0]).map(drop), "hold no 'shell_plastic_strain'");
    let fresh = folder.path().join("fresh");
    let refused = |geometry: &Geometry, content: Content| create(&fresh, geometry, &content).map(drop);
    says(refused(&Geometry::default(), Content::default()), "no nodes");
    says(refused(&geometry, Content { solid_points: 4, ..Content::default() }), "4 integration points");
    let mut wrong = geometry.clone();
    wrong.shells[2].nodes[1] = 30;
    says(refused(&wrong, Content::default()), "shell 2 (counted from 0) names node 30, there are 30");
    let mut wrong = geometry.clone();
    wrong.shell_ids.pop();
    says(refused(&wrong, Content::default()), "4 user numbers for 5 shells");
    assert!(!fresh.exists());
}

#[test]
fn by_default_nothing_runs_on() {
    // more than 7 × 512 × 512 words of geometry, and of a state: other programs lose their way where these run on
    let (nx, ny) = (500_u32, 320_u32);
    let mut geometry = Geometry::default();
    geometry.coordinates = (0..nx * ny).map(|k| [f64::from(k % nx), f64::from(k / nx), 0.0]).collect();
    let corners = (0..nx * (ny - 1)).filter(|k| k % nx + 1 < nx);
    geometry.shells = corners.map(|k| Shell { nodes: [k, k + 1, k + nx + 1, k + nx], part: 0 }).collect();
    let content = Content { velocity: true, acceleration: true, layers: 3, stress: Stored::All, ..Content::default() };
    let place = tempfile::tempdir().unwrap();
    let root = place.path().join("d3plot");
    let options = WriteOptions::default();
    let mut writer = Writer::create(&root, &geometry, &[Part::new(1, "sheet")], &content, &options).unwrap();
    assert!(writer.words_per_state() > 7 * 512 * 512);
    (0..2).for_each(|k| writer.state(f64::from(k)).write().unwrap());
    writer.finish().unwrap();
    let family = Family::open(&root).unwrap();
    assert_eq!((family.times(), family.warnings()), (&[0.0, 1.0][..], &[][..]));
    let states: Vec<usize> = family.members().iter().map(|member| member.states).collect();
    assert_eq!(states, [0, 1, 1]);
}
