//! Every way of giving runs, and the ids that they get: a run's id is its path below the folder given.

mod world;

use std::path::{Path, PathBuf};

use crumple::Error;
use crumple::bundle::find;
use world::{Model, World};

fn write(path: &Path) {
    Model::strip().family(1, |_, p| p).write(path);
}

fn ids(paths: &[PathBuf]) -> Vec<String> {
    find(paths).unwrap().into_iter().map(|found| found.id).collect()
}

#[test]
fn folders_within_folders() {
    let world = World::new();
    for id in ["a/run_1", "a/run_2", "b/deep/er/run_1", "c"] {
        write(&world.root(id));
    }
    assert_eq!(ids(&[world.runs()]), ["a/run_1", "a/run_2", "b/deep/er/run_1", "c"]);
    assert_eq!(ids(&[world.runs().join("a")]), ["run_1", "run_2"]);
    assert_eq!(ids(&[world.runs().join("b")]), ["deep/er/run_1"]);
    // The folder that is the run itself, its root file, and both with a slash too many.
    for given in [world.runs().join("c"), world.root("c"), world.runs().join("c/"), world.runs().join("a/../c")] {
        assert_eq!(ids(&[given]), ["c"]);
    }
}

#[test]
fn several_families_in_a_folder_carry_their_names() {
    let world = World::new();
    for name in ["left.ptf", "right.ptf"] {
        write(&world.runs().join("pair").join(name));
    }
    write(&world.root("single"));
    assert_eq!(ids(&[world.runs()]), ["pair/left.ptf", "pair/right.ptf", "single"]);
    assert_eq!(ids(&[world.runs().join("pair")]), ["left.ptf", "right.ptf"]);
    assert_eq!(ids(&[world.runs().join("pair/left.ptf")]), ["left.ptf"]);
}

#[test]
fn a_family_beside_folders_of_others_has_an_id_too() {
    let world = World::new();
    write(&world.runs().join("d3plot"));
    write(&world.root("below"));
    assert_eq!(ids(&[world.runs()]), ["below", "d3plot"]);
}

#[test]
fn members_are_not_runs() {
    let world = World::new();
    Model::strip().family(7, |_, p| p).states_a_member(2).write(&world.root("run"));
    assert_eq!(std::fs::read_dir(world.runs().join("run")).unwrap().count(), 5);
    assert_eq!(ids(&[world.runs()]), ["run"]);
}

#[test]
fn the_same_file_given_twice_is_one_run() {
    let world = World::new();
    write(&world.root("a/run_1"));
    write(&world.root("b"));
    let (all, b) = (world.runs(), world.root("b"));
    assert_eq!(ids(&[b.clone(), b.clone(), world.runs().join("b")]), ["b"]);
    assert_eq!(ids(&[all.clone(), all.clone()]), ["a/run_1", "b"]);
    assert_eq!(ids(&[all.clone(), b]), ["a/run_1", "b"]);
    // Under two names it would count twice in every ranking and every mode.
    let overlapping = find(&[all, world.runs().join("a")]).unwrap();
    let mut files: Vec<PathBuf> = overlapping.iter().map(|found| found.path.canonicalize().unwrap()).collect();
    files.sort();
    files.dedup();
    assert_eq!(overlapping.len(), files.len(), "one file is two runs: {overlapping:?}");
}

#[test]
fn two_runs_of_one_id_are_refused() {
    let world = World::new();
    write(&world.root("a/run_1"));
    write(&world.root("b/run_1"));
    let error = find(&[world.runs().join("a"), world.runs().join("b")]).unwrap_err();
    let Error::SameId { id, first, second } = &error else { panic!("{error}") };
    assert_eq!(id, "run_1");
    assert!(first.ends_with("a/run_1/d3plot") && second.ends_with("b/run_1/d3plot"), "{error}");
    assert!(error.remedy().is_some());
}

#[test]
#[cfg(unix)]
fn links_in_circles_end() {
    let world = World::new();
    write(&world.root("run"));
    std::os::unix::fs::symlink(world.runs(), world.runs().join("round")).unwrap();
    std::os::unix::fs::symlink(world.runs().join("run"), world.runs().join("run/self")).unwrap();
    std::os::unix::fs::symlink("nowhere", world.runs().join("dangling")).unwrap();
    assert_eq!(ids(&[world.runs()]), ["run"]);
}

#[test]
#[cfg(unix)]
fn a_link_to_a_run_is_the_run() {
    let world = World::new();
    write(&world.path("elsewhere/run_9/d3plot"));
    std::os::unix::fs::symlink(world.path("elsewhere/run_9"), world.runs().join("linked")).unwrap();
    assert_eq!(ids(&[world.runs()]), ["linked"]);
}

#[test]
fn a_broken_file_is_reported_with_its_fault() {
    let world = World::new();
    write(&world.root("good"));
    std::fs::create_dir_all(world.runs().join("bad")).unwrap();
    std::fs::write(world.root("bad"), "not at all").unwrap();
    std::fs::create_dir_all(world.runs().join("empty")).unwrap();
    std::fs::write(world.root("empty"), "").unwrap();
    let found = find(&[world.runs()]).unwrap();
    let faults: Vec<(&str, bool)> = found.iter().map(|run| (run.id.as_str(), run.fault.is_some())).collect();
    assert_eq!(faults, [("bad", true), ("empty", true), ("good", false)]);
    let mut study = world.empty_study("study", "good", 5);
    let Err(Error::BadRuns { failures, total }) = world.add(&mut study) else { panic!("bad runs were added") };
    assert_eq!((failures.len(), total), (2, 3));
    assert!(study.manifest().runs.is_empty());
    let options = crumple::study::AddOptions { skip_bad: true, ..Default::default() };
    let added = study.add(&found, options, &()).unwrap();
    assert_eq!((added.added, added.skipped.len()), (vec!["good".to_owned()], 2));
}

#[test]
fn a_file_beside_a_refused_one_has_one_id_however_it_is_given() {
    let world = World::new();
    write(&world.root("run"));
    std::fs::write(world.runs().join("run/other.ptf"), "not at all").unwrap();
    let by_folder: Vec<_> = find(&[world.runs().join("run")]).unwrap();
    let good = by_folder.iter().find(|run| run.fault.is_none()).unwrap();
    assert_eq!(ids(&[world.root("run")]).concat(), good.id, "{by_folder:?}");
}

#[test]
fn what_is_no_run_is_said_at_once() {
    let world = World::new();
    std::fs::write(world.runs().join("notes.txt"), "some words").unwrap();
    let error = find(&[world.runs()]).unwrap_err();
    assert!(matches!(&error, Error::NoRuns { files: 1, .. }), "{error}");
    assert!(matches!(find(&[world.runs().join("missing")]), Err(Error::NoSuchPath(_))));
    // The doc's promise for a file given by name.
    let found = find(&[world.runs().join("notes.txt")]);
    let said = match &found {
        Err(_) => true,
        Ok(runs) => runs.iter().all(|run| run.fault.is_some()),
    };
    assert!(said, "a text file is a run: {found:?}");
    assert!(find(&[]).unwrap().is_empty());
}
