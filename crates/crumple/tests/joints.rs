//! What welds and ties of a deck hold of a surface, and what a study keeps of it.

use std::path::{Path, PathBuf};

use crumple::Error;
use crumple::basis::BasisOptions;
use crumple::joints::{Join, Joints, joints};
use crumple::reference::Reference;
use crumple::run::Run;
use crumple::study::{Study, check};
use tempfile::TempDir;

/// Two sheets of 1 mm, 1 mm apart: the lower one of 10 mm squares (part 1, nodes from 1), the upper one of 7 mm squares
/// (part 2, nodes from 1001), so that no node lies above another one but at the corner.
fn sheets() -> String {
    let mut text =
        String::from("*KEYWORD\n*SECTION_SHELL\n1,2\n1.0,1.0,1.0,1.0\n*PART\nlower\n1,1,1\n*PART\nupper\n2,1,1\n");
    let (mut nodes, mut shells) = (String::from("*NODE\n"), String::from("*ELEMENT_SHELL\n"));
    for (part, first, size, count, z) in [(1, 1, 10.0, 8, 0.0), (2, 1001, 7.0, 11, 1.0)] {
        for j in 0..=count {
            for i in 0..=count {
                let id = first + j * (count + 1) + i;
                nodes += &format!("{id},{},{},{z}\n", f64::from(i) * size, f64::from(j) * size);
            }
        }
        for j in 0..count {
            for i in 0..count {
                let a = first + j * (count + 1) + i;
                shells += &format!("{a},{part},{a},{},{},{}\n", a + 1, a + count + 2, a + count + 1);
            }
        }
    }
    text += &nodes;
    text + &shells
}

struct World {
    folder: TempDir,
}

impl World {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn deck(&self, more: &str) -> Run {
        let path = self.path("model.k");
        std::fs::write(&path, sheets() + more + "*END\n").unwrap();
        Run::open("model", &path).unwrap()
    }

    fn joints(&self, more: &str) -> (Joints, Reference) {
        let run = self.deck(more);
        let reference = Reference::of_run(&run, &[]).unwrap();
        (joints(run.deck().unwrap(), &reference), reference)
    }
}

fn position(reference: &Reference, node: u64) -> [f64; 3] {
    reference.mesh.vertices()[reference.node_ids.iter().position(|id| *id == node).unwrap()]
}

/// Every tie couples a vertex to the point straight below or above it.
#[track_caller]
fn straight(found: &Joints, reference: &Reference) {
    for tie in &found.ties {
        let at = position(reference, tie.node);
        assert!((tie.to.iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-9);
        let mut point = [0.0; 3];
        for (node, weight) in &tie.to {
            let there = position(reference, *node);
            (0..3).for_each(|c| point[c] += weight * there[c]);
        }
        assert!((point[0] - at[0]).abs() < 1e-9 && (point[1] - at[1]).abs() < 1e-9, "{tie:?}");
        assert!((point[2] - at[2]).abs() > 0.9, "the other sheet");
    }
}

#[test]
fn a_tied_contact_holds_nodes_by_the_faces_below_them() {
    let world = World::new();
    // All of the upper sheet's nodes: those beyond the lower sheet's edge have no face below.
    let (found, reference) = world.joints("*CONTACT_TIED_SHELL_EDGE_TO_SURFACE\n2,1,3,3\n");
    straight(&found, &reference);
    assert_eq!(found.ties.len(), 144);
    let source = &found.sources["CONTACT_TIED_SHELL_EDGE_TO_SURFACE"];
    assert_eq!((source.defined, source.used, source.ties, source.out_of_reach), (1, 1, 144, 0));
    // 0.6 of both thicknesses is 1.2 mm; negative contact thicknesses of 0.8 mm in all reach 0.48 mm only.
    let (short, _) = world.joints("*CONTACT_TIED_SHELL_EDGE_TO_SURFACE\n2,1,3,3\n\n,,-0.4,-0.4\n");
    assert_eq!((short.ties.len(), short.sources["CONTACT_TIED_SHELL_EDGE_TO_SURFACE"].out_of_reach), (0, 144));
    // By sets of every kind.
    let sets = "*SET_NODE_LIST\n1\n1001,1002,1003\n*SET_SEGMENT\n1\n1,2,11,10\n*SET_SHELL_LIST\n1\n1,2\n*SET_PART_LIST\n1\n1\n";
    for (side, expected) in [("1,1,4,2", 3), ("1,1,4,0", 2), ("1,1,4,1", 3), ("1,0,4,5", 3), ("1,1,4,6", 0)] {
        let (found, reference) = world.joints(&format!("{sets}*CONTACT_TIED_NODES_TO_SURFACE\n{side}\n"));
        straight(&found, &reference);
        assert_eq!(found.ties.len(), expected, "{side}");
    }
    let (nothing, _) = world.joints("*CONTACT_TIED_NODES_TO_SURFACE\n9,1,4,3\n");
    assert!(nothing.ties.is_empty() && nothing.notes.iter().any(|note| note.contains("*SET_NODE 9 is not defined")));
}

#[test]
fn beams_and_solids_that_weld_hold_points_inside_faces() {
    let world = World::new();
    let beams = "*NODE\n9001,23.0,23.0,0.0\n9002,23.0,23.0,1.0\n9003,51.0,33.0,0.1\n9004,51.0,33.0,0.9\n9005,500.,0.,0.\n9006,500.,0.,1.\n\
                 *ELEMENT_BEAM\n1,3,9001,9002\n2,3,9003,9004\n3,3,9005,9006\n*PART\nspots\n3,3,3\n*SECTION_BEAM\n3,9\n6.0,6.0\n*MAT_SPOTWELD\n3\n\
                 *SET_PART_LIST\n1\n1,2\n*CONTACT_SPOTWELD\n3,1,3,2\n";
    let (found, reference) = world.joints(beams);
    straight(&found, &reference);
    let source = &found.sources["ELEMENT_BEAM (welds)"];
    assert_eq!((source.defined, source.used, source.ties, source.out_of_reach), (3, 2, 2, 1));
    for (tie, weld) in found.ties.iter().zip([[23.0, 23.0], [51.0, 33.0]]) {
        let at = position(&reference, tie.node);
        assert!((0..2).all(|c| (at[c] - weld[c]).abs() <= 5.0), "within half an edge: {at:?}");
    }
    // Without a contact nothing holds the beams.
    let (loose, _) = world.joints(beams.split("*CONTACT").next().unwrap());
    assert_eq!((loose.ties.len(), loose.sources["ELEMENT_BEAM (welds)"].out_of_reach), (0, 3));

    let mut solids = String::from("*NODE\n");
    for (at, [x, y]) in [[30.0, 30.0], [35.0, 30.0], [35.0, 35.0], [30.0, 35.0]].into_iter().enumerate() {
        solids += &format!("{},{x},{y},0.0\n{},{x},{y},1.0\n", 9001 + at, 9005 + at);
    }
    solids += "*ELEMENT_SOLID\n1,3\n9001,9002,9003,9004,9005,9006,9007,9008\n*PART\nspots\n3,3,3\n*SECTION_SOLID\n3,1\n*MAT_SPOTWELD\n3\n\
               *SET_PART_LIST\n1\n1,2\n*CONTACT_TIED_NODES_TO_SURFACE\n3,1,3,2\n";
    let (found, reference) = world.joints(&solids);
    straight(&found, &reference);
    assert_eq!(found.sources["ELEMENT_SOLID (welds)"].ties, 1);
}

#[test]
fn welds_and_rigid_bodies_hold_their_nodes() {
    let world = World::new();
    // Node 1 lies below 1001; 11 and 13 are neighbours in the lower sheet.
    let (found, _) =
        world.joints("*CONSTRAINED_SPOTWELD\n1,1001\n*CONSTRAINED_RIVET\n80,80\n*CONSTRAINED_SPOTWELD\n80,77777\n");
    assert_eq!(found.ties.len(), 1);
    assert_eq!((found.ties[0].node, &found.ties[0].to), (1001, &vec![(1, 1.0)]));
    assert_eq!((found.sources["CONSTRAINED_SPOTWELD"].defined, found.sources["CONSTRAINED_SPOTWELD"].used), (2, 1));
    let (ring, _) = world
        .joints("*SET_NODE_LIST\n5\n1,2,1001,1002\n*CONSTRAINED_NODAL_RIGID_BODY\n5\n*CONSTRAINED_NODE_SET\n5,7\n");
    let pairs: Vec<(u64, u64)> = ring.ties.iter().map(|tie| (tie.to[0].0, tie.node)).collect();
    assert_eq!(pairs, [(1, 1001), (2, 1002), (1, 1001), (2, 1002)], "neighbours of one sheet stay apart");
    let rivets =
        "*NODE\n9001,40.0,40.0,0.5\n*SET_NODE_LIST\n6\n9001\n*CONSTRAINED_INTERPOLATION_SPOTWELD\n1,2,6,2.0,5.0\n";
    let (found, reference) = world.joints(rivets);
    straight(&found, &reference);
    assert_eq!(found.ties.len(), 1);
}

#[test]
fn a_study_keeps_what_joined_it_and_check_holds_it_true() {
    let world = World::new();
    let options = |join| BasisOptions { eigenpairs: 20, join, ..Default::default() };
    let run = world.deck("*SET_NODE_LIST\n1\n1001,1014,1040\n*CONTACT_TIED_NODES_TO_SURFACE\n1,1,4,3\n");
    let apart = Study::create(&world.path("apart"), &run, &[], &[], &options(None), &()).unwrap();
    assert_eq!(apart.basis().unwrap().facts.null_space, 2);
    let study = Study::create(&world.path("study"), &run, &[], &[], &options(Some(Join::DECK)), &()).unwrap();
    let basis = study.basis().unwrap();
    assert_eq!((basis.facts.null_space, basis.facts.joined_pairs, basis.facts.followers), (1, 3, 2));
    assert_eq!(
        (study.settings().join, study.reference().unwrap().parts),
        (Some(Join::DECK), vec!["1 lower".to_owned(), "2 upper".to_owned()])
    );
    // Φᵀ M Φ = I in the mass that is stored, with the eigenvectors that are stored (single precision).
    for i in 1..=20 {
        for j in 1..=i {
            let (a, b) = (basis.eigenvector(i), basis.eigenvector(j));
            let inner: f64 =
                a.iter().zip(b).zip(&basis.mass).map(|((a, b), m)| f64::from(*a) * f64::from(*b) * m).sum();
            assert!((inner - f64::from(u8::from(i == j))).abs() < 1e-6, "{i}, {j}: {inner}");
        }
    }
    assert!(study.is_for(&run, &[], &[], &options(Some(Join::DECK))).unwrap());
    assert!(!study.is_for(&run, &[], &[], &options(Some(Join::Distance(2.0)))).unwrap());
    let other = world.deck("*SET_NODE_LIST\n1\n1001\n*CONTACT_TIED_NODES_TO_SURFACE\n1,1,4,3\n");
    assert!(!study.is_for(&other, &[], &[], &options(Some(Join::DECK))).unwrap(), "a deck that ties other nodes");
    let whole = |name: &str| check(&world.path(name)).unwrap();
    assert!(whole("study").whole && whole("apart").whole);
    // Another tie than the basis was made with, under a checksum that says it is right.
    let spoil = |file: &str, from: &str, to: &str| {
        let path = world.path("study").join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
        seal(&world.path("study"), file);
    };
    spoil("joints.json", "\"node\":1040", "\"node\":1041");
    assert!(whole("study").problems[0].contains("not held by the eigenvectors"), "{:?}", whole("study").problems);
    spoil("joints.json", "\"node\":1041", "\"node\":1040");
    spoil("study.toml", "join = \"deck\"", "join = 2.5");
    assert!(whole("study").problems[0].contains("different things about the join"), "{:?}", whole("study").problems);
    spoil("study.toml", "join = 2.5", "join = \"deck\"");
    assert!(whole("study").whole);
    std::fs::remove_file(world.path("study/joints.json")).unwrap();
    assert!(!whole("study").whole);
}

/// Writes the checksum of a file into the manifest.
fn seal(study: &Path, file: &str) {
    let path = study.join("manifest.json");
    let mut manifest: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let record = crumple::study::FileRecord::of(&study.join(file)).unwrap();
    manifest["files"][file] = serde_json::to_value(record).unwrap();
    std::fs::write(&path, serde_json::to_vec(&manifest).unwrap()).unwrap();
}

#[test]
fn a_deck_of_another_model_is_refused() {
    let world = World::new();
    let options = BasisOptions { eigenpairs: 5, join: Some(Join::DECK), ..Default::default() };
    let run = world.deck("");
    let other = world.path("other.k");
    std::fs::write(&other, "*NODE\n1,0,0,0\n").unwrap();
    let with_other = Run::open("model", &world.path("model.k"))
        .unwrap()
        .with_deck(std::sync::Arc::new(crumple::deck::read(&other).unwrap()));
    let error = Study::create(&world.path("study"), &with_other, &[], &[], &options, &()).unwrap_err();
    assert!(matches!(error, Error::OtherDeck { .. }) && error.remedy().is_some(), "{error}");
    assert!(!world.path("study").exists());
    // A deck has no states, and says so.
    let mut study = Study::create(&world.path("study"), &run, &[], &[], &options, &()).unwrap();
    let found = crumple::bundle::find(&[world.path("model.k")]).unwrap();
    let error = study.add(&found, Default::default(), &()).unwrap_err();
    assert!(matches!(error, Error::NoStates { .. }), "{error}");
}
