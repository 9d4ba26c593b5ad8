//! Laws of the study on disk: read ∘ write = identity, whole at every moment, two writers lose nothing, adding twice is
//! adding once, and never an old answer for a new file.

mod world;

use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crumple::bundle::find;
use crumple::descriptor::{self, DescribeOptions, Select, Threshold, describe};
use crumple::study::{AddOptions, Loaded, Rows, Study, check};
use crumple::target::Named;
use crumple::{Error, Watch};
use world::{Model, Point, World, bend, described, noise};

fn turn(angle: f64) -> impl Fn(f64, Point) -> Point {
    move |t, p| bend(90.0, angle * t)(p)
}

fn bundle(runs: usize) -> World {
    let world = World::new();
    for run in 0..runs {
        world.write(&format!("run_{run:03}"), &Model::plate(3, 2, 30.0, 17.0).family(2, turn(0.01 * run as f64 + 0.1)));
    }
    world
}

fn whole(world: &World, study: &str) {
    let checkup = check(&world.path(study)).unwrap();
    assert!(checkup.whole, "{:?}", checkup.problems);
}

#[test]
fn what_is_read_is_what_was_written() {
    let world = World::new();
    for run in 0..3 {
        world.write(&format!("run_{run}"), &Model::strip().family(4, turn(0.3 + f64::from(run))));
    }
    let study = world.empty_study("study", "run_1", 17);
    let reference = crumple::reference::Reference::of_run(&world.open("run_1"), &[]).unwrap();
    let options = crumple::basis::BasisOptions { eigenpairs: 17, ..Default::default() };
    let basis = crumple::basis::Basis::compute(&reference, &[], &options, &()).unwrap();
    let (read_reference, read_basis) = (study.reference().unwrap(), study.basis().unwrap());
    assert_eq!(read_reference.mesh.vertices(), reference.mesh.vertices());
    assert_eq!(read_reference.mesh.triangles(), reference.mesh.triangles());
    assert_eq!(read_reference.node_ids, reference.node_ids);
    assert_eq!(read_reference.shell_of_triangle, reference.shell_of_triangle);
    assert_eq!(read_reference.parts, reference.parts);
    assert_eq!(read_basis.eigenvalues, basis.eigenvalues);
    assert_eq!(read_basis.eigenvectors, basis.eigenvectors);
    assert_eq!((read_basis.mass, read_basis.baseline), (basis.mass.clone(), basis.baseline.clone()));
    assert_eq!(read_basis.facts, basis.facts);

    let mut study = study;
    world.add(&mut study).unwrap();
    let basis = study.basis().unwrap();
    for run in ["run_0", "run_1", "run_2"] {
        let projected = crumple::project::project(&world.open(run), &reference, &basis, &[], &()).unwrap();
        let rows = study.coefficients(None, Rows::Run(run)).unwrap();
        let deltas: Vec<f32> = projected.states.iter().flat_map(|state| state.delta.clone()).collect();
        assert_eq!(rows.values, deltas);
        assert_eq!(rows.states, [0, 1, 2, 3]);
        assert_eq!(rows.times, projected.states.iter().map(|state| state.time).collect::<Vec<_>>());
        // Some columns in another order are the same numbers.
        let some = study.coefficients(Some(&[5, 2, 17]), Rows::Run(run)).unwrap();
        for state in 0..4 {
            for (at, j) in [5, 2, 17].into_iter().enumerate() {
                assert_eq!(some.row(state)[3 * at..3 * at + 3], rows.row(state)[3 * j - 3..3 * j]);
            }
        }
        let record = study.record(run).unwrap();
        assert_eq!((&record.times, record.last), (&rows.times, projected.states[3].measures));
        assert_eq!(Study::open(&world.path("study")).unwrap().record(run).unwrap(), record);
    }
    assert_eq!(study.manifest(), Study::open(&world.path("study")).unwrap().manifest());
    whole(&world, "study");
}

#[test]
fn a_descriptor_is_read_as_it_was_written() {
    let world = World::new();
    let mut random = noise(8);
    for run in 0..40 {
        let nodes = Model::strip().nodes.into_iter().map(|p| p.map(|x| x + 7.0 * random())).collect();
        world.write(&format!("run_{run}"), &Model::strip().family_of([(random() + 1.5, nodes)]));
    }
    let loaded = world.study(30);
    for run in 0..40 {
        for select in [Select::Coordinates, Select::Difference] {
            let made = described(&loaded, &format!("run_{run}"), select, Threshold::Std(0.5)).descriptor;
            descriptor::save(&loaded.study, &made).unwrap();
            // Every bit: the same file must be the same target on every machine.
            assert_eq!(descriptor::load(&loaded.study, &made.name).unwrap(), made);
        }
    }
    assert_eq!(descriptor::list(&loaded.study).unwrap().len(), 40);
}

#[test]
fn adding_twice_is_adding_once() {
    let world = bundle(4);
    let mut study = world.empty_study("study", "run_000", 6);
    let first = world.add(&mut study).unwrap();
    assert_eq!(first.added.len(), 4);
    let before = study.manifest().clone();
    let second = world.add(&mut study).unwrap();
    assert_eq!((second.added.len(), second.unchanged.len()), (0, 4));
    assert_eq!(*study.manifest(), before);
    assert_eq!(
        std::fs::read_dir(world.path("study/coefficients")).unwrap().count(),
        2,
        "one part and the writers' lock"
    );
    // Moved elsewhere and added again: the same content under the same id.
    std::fs::rename(world.runs(), world.path("moved")).unwrap();
    let third = study.add(&find(&[world.path("moved")]).unwrap(), AddOptions::default(), &()).unwrap();
    assert_eq!((third.added.len(), third.unchanged.len()), (0, 4));
    assert!(study.record("run_002").unwrap().path.ends_with("moved/run_002/d3plot"));
    whole(&world, "study");
}

#[test]
fn another_content_under_an_id_takes_a_word() {
    let world = bundle(3);
    let mut study = world.empty_study("study", "run_000", 6);
    world.add(&mut study).unwrap();
    let before = study.coefficients(None, Rows::All).unwrap();
    world.write("run_001", &Model::plate(3, 2, 30.0, 17.0).family(4, turn(1.0)));
    assert!(matches!(world.add(&mut study), Err(Error::RunChanged { run }) if run == "run_001"));
    assert_eq!(study.coefficients(None, Rows::All).unwrap(), before);
    whole(&world, "study");
    let options = AddOptions { replace: true, ..Default::default() };
    let replaced = study.add(&world.found(), options, &()).unwrap();
    assert_eq!((replaced.replaced, replaced.unchanged.len()), (vec!["run_001".to_owned()], 2));
    let after = study.coefficients(None, Rows::All).unwrap();
    assert_eq!(after.runs.iter().filter(|run| *run == "run_001").count(), 4);
    for run in ["run_000", "run_002"] {
        let rows = |all: &crumple::study::Coefficients| -> Vec<f32> {
            (0..all.rows()).filter(|&row| all.runs[row] == run).flat_map(|row| all.row(row).to_vec()).collect()
        };
        assert_eq!(rows(&after), rows(&before));
    }
    whole(&world, "study");
}

#[test]
fn many_writers_at_once_lose_nothing() {
    let world = bundle(12);
    let alone = {
        let mut study = world.empty_study("alone", "run_000", 6);
        world.add(&mut study).unwrap();
        study.coefficients(None, Rows::All).unwrap()
    };
    world.empty_study("shared", "run_000", 6);
    let found = world.found();
    std::thread::scope(|scope| {
        for writer in 0..6 {
            let (found, folder) = (&found, world.path("shared"));
            scope.spawn(move || {
                // Every run is added by two writers.
                let mine = |at: usize| at % 6 == writer || (at + 1) % 6 == writer;
                for (_, run) in found.iter().enumerate().filter(|(at, _)| mine(*at)) {
                    let mut study = Study::open(&folder).unwrap();
                    study.add(std::slice::from_ref(run), AddOptions::default(), &()).unwrap();
                }
            });
        }
    });
    let shared = Study::open(&world.path("shared")).unwrap();
    assert_eq!(shared.coefficients(None, Rows::All).unwrap(), alone);
    whole(&world, "shared");
}

#[test]
fn a_handle_sees_what_another_committed_after_refresh() {
    let world = bundle(2);
    let mut one = world.empty_study("study", "run_000", 6);
    let mut other = Study::open(&world.path("study")).unwrap();
    one.add(&world.found()[..1], AddOptions::default(), &()).unwrap();
    assert!(other.manifest().runs.is_empty());
    other.refresh().unwrap();
    assert_eq!(other.coefficients(None, Rows::All).unwrap(), one.coefficients(None, Rows::All).unwrap());
    // Adding through a handle that is behind loses nothing either.
    let mut behind = Study::open(&world.path("study")).unwrap();
    one.add(&world.found()[1..], AddOptions::default(), &()).unwrap();
    world.write("run_002", &Model::plate(3, 2, 30.0, 17.0).family(2, turn(2.0)));
    behind.add(&find(&[world.root("run_002")]).unwrap(), AddOptions::default(), &()).unwrap();
    assert_eq!(behind.manifest().runs.len(), 3);
    // A replaced part may be gone under a handle that is behind: an error, the old numbers or the new; nothing between.
    let old = one.coefficients(None, Rows::Run("run_000")).unwrap();
    world.write("run_000", &Model::plate(3, 2, 30.0, 17.0).family(2, turn(-1.0)));
    behind.add(&world.found(), AddOptions { replace: true, ..Default::default() }, &()).unwrap();
    let meanwhile = one.coefficients(None, Rows::Run("run_000"));
    one.refresh().unwrap();
    let new = one.coefficients(None, Rows::Run("run_000")).unwrap();
    assert_ne!(new, old);
    assert!(meanwhile.is_err() || meanwhile.is_ok_and(|rows| rows == old || rows == new));
}

#[test]
fn what_is_loaded_follows_the_study() {
    let world = bundle(3);
    let mut study = world.empty_study("study", "run_000", 6);
    study.add(&world.found()[..2], AddOptions::default(), &()).unwrap();
    let mut loaded = Loaded::of(study).unwrap();
    assert_eq!(loaded.last_states().unwrap().rows(), 2);
    loaded.study.add(&world.found(), AddOptions::default(), &()).unwrap();
    assert_eq!(loaded.last_states().unwrap().rows(), 3, "the last states of a study that has three runs now");
}

// ---- killed ---------------------------------------------------------------------------------------------------------

/// Ends the process without a word when the given number of steps is done, as the system does.
struct Killed(usize);

impl Watch for Killed {
    fn step(&self, _: &'static str, done: usize, _: usize) {
        if done >= self.0 {
            std::process::abort();
        }
    }
}

/// The process that is killed: adds all runs of a world to its study. Only does something when it is told where.
#[test]
fn child_that_adds_until_it_is_killed() {
    let (Ok(folder), Ok(steps)) = (std::env::var("CRUMPLE_TEST_WORLD"), std::env::var("CRUMPLE_TEST_STEPS")) else {
        return;
    };
    let folder = std::path::PathBuf::from(folder);
    let mut study = Study::open(&folder.join("study")).unwrap();
    let options = AddOptions { skip_bad: true, ..Default::default() };
    study.add(&find(&[folder.join("runs")]).unwrap(), options, &Killed(steps.parse().unwrap())).unwrap();
}

fn killed_add(world: &World, steps: usize) {
    let status = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "child_that_adds_until_it_is_killed"])
        .env("CRUMPLE_TEST_WORLD", world.path(""))
        .env("CRUMPLE_TEST_STEPS", steps.to_string())
        .output()
        .unwrap()
        .status;
    assert!(!status.success(), "the child was to be killed");
}

#[test]
fn a_killed_add_leaves_a_whole_study_and_can_be_repeated() {
    let world = bundle(5);
    let expected = {
        let mut study = world.empty_study("alone", "run_000", 6);
        world.add(&mut study).unwrap();
        study.coefficients(None, Rows::All).unwrap()
    };
    world.empty_study("study", "run_000", 6);
    for steps in 1..=5 {
        killed_add(&world, steps);
        whole(&world, "study");
        // What such a process may have left: a part no manifest names, a part half written.
        std::fs::write(world.path("study/coefficients/0123456789abcdef.parquet"), "half").unwrap();
        std::fs::write(world.path("study/coefficients/.part.tmp-1"), "half").unwrap();
        whole(&world, "study");
    }
    let notes = check(&world.path("study")).unwrap().notes.join("\n");
    assert!(notes.contains("0123456789abcdef.parquet"), "{notes}");
    let mut study = Study::open(&world.path("study")).unwrap();
    world.add(&mut study).unwrap();
    assert_eq!(study.coefficients(None, Rows::All).unwrap(), expected);
    let checkup = check(&world.path("study")).unwrap();
    assert!(checkup.whole && checkup.notes.is_empty(), "{checkup:?}");
}

#[test]
fn a_killed_add_keeps_the_parts_it_finished() {
    // Two parts of 64 runs are on disk when the last batch begins. Hours of work, where runs are large.
    let world = bundle(140);
    world.empty_study("study", "run_000", 4);
    killed_add(&world, 135);
    let kept = Study::open(&world.path("study")).unwrap().manifest().runs.len();
    assert!(kept >= 128, "{kept} of 135 runs that were done are kept");
    whole(&world, "study");
}

/// Asks to stop after some steps.
struct Stopping(AtomicUsize, usize);

impl Watch for Stopping {
    fn step(&self, _: &'static str, _: usize, _: usize) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed) >= self.1
    }
}

#[test]
fn a_stopped_add_keeps_what_is_finished_even_beside_a_bad_run() {
    for bad in [false, true] {
        let world = bundle(30);
        if bad {
            std::fs::write(world.root("run_000"), "not at all").unwrap();
        }
        let mut study = world.empty_study("study", "run_001", 6);
        let stopped = study.add(&world.found(), AddOptions::default(), &Stopping(AtomicUsize::new(0), 10));
        assert!(matches!(stopped, Err(Error::Stopped)), "{stopped:?}");
        study.refresh().unwrap();
        let kept = study.manifest().runs.len();
        assert!((9..30).contains(&kept), "{kept} runs are kept, bad run: {bad}");
        whole(&world, "study");
    }
}

#[test]
fn a_stopped_init_leaves_nothing() {
    let world = bundle(1);
    let options = crumple::basis::BasisOptions { eigenpairs: 6, ..Default::default() };
    let stopped = Study::create(
        &world.path("study"),
        &world.open("run_000"),
        &[],
        &[],
        &options,
        &Stopping(AtomicUsize::new(0), 0),
    );
    assert!(matches!(stopped, Err(Error::Stopped)), "{stopped:?}");
    let left: Vec<_> = std::fs::read_dir(world.path("")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["runs"]);
}

// ---- files that change ------------------------------------------------------------------------------------------------

/// Rewrites a run as soon as it has been projected, as a solver does that is still at work.
struct SolverAtWork<'a>(Mutex<Option<&'a World>>);

impl Watch for SolverAtWork<'_> {
    fn step(&self, stage: &'static str, _: usize, _: usize) {
        if stage == "projecting runs"
            && let Some(world) = self.0.lock().unwrap().take()
        {
            world.write("run_000", &Model::plate(3, 2, 30.0, 17.0).family(9, turn(1.7)));
        }
    }
}

#[test]
fn a_run_that_changes_while_it_is_added_is_looked_at_again() {
    let world = bundle(1);
    let mut study = world.empty_study("study", "run_000", 6);
    study.add(&world.found(), AddOptions::default(), &SolverAtWork(Mutex::new(Some(&world)))).unwrap();
    let options = AddOptions { replace: true, ..Default::default() };
    study.add(&world.found(), options, &()).unwrap();
    let states = study.record("run_000").unwrap().times.len();
    assert_eq!(states, world.open("run_000").times().len(), "the study stays with the states of an older file");
}

#[test]
fn a_run_that_was_overwritten_is_not_described_with_old_coefficients() {
    let world = bundle(3);
    let loaded = world.study(6);
    world.write("run_001", &Model::plate(3, 2, 30.0, 17.0).family(2, turn(1.5)));
    let made = describe(&loaded, &Named::parse("run_001"), None, None, &DescribeOptions::default());
    assert!(matches!(made, Err(Error::RunChanged { .. })), "old coefficients, new shape: {made:?}");
}

#[test]
#[cfg(unix)]
fn writers_of_two_hosts_do_not_share_a_temporary_file() {
    // Another host's process with our number is in the middle of writing a part: it holds the writers' lock, and its
    // temporary file has the name that we would choose. A second name of the same file shows whether we wrote into it.
    let world = bundle(2);
    let mut study = world.empty_study("study", "run_000", 6);
    let parts = world.path("study/coefficients");
    let lock = std::fs::File::options().create(true).truncate(false).write(true).open(parts.join(".writers")).unwrap();
    lock.lock_shared().unwrap();
    std::fs::write(world.path("theirs"), "half a part").unwrap();
    for count in 0..200 {
        let name = format!(".part.tmp-{}-{count}", std::process::id());
        std::fs::hard_link(world.path("theirs"), parts.join(name)).unwrap();
    }
    world.add(&mut study).unwrap();
    assert_eq!(
        std::fs::read_to_string(world.path("theirs")).unwrap(),
        "half a part",
        "another writer's file is overwritten"
    );
    assert!(check(&world.path("study")).unwrap().whole);
}

#[test]
fn inputs_keep_their_columns_whatever_they_are_called() {
    let world = bundle(3);
    let mut study = world.empty_study("study", "run_000", 6);
    std::fs::write(world.path("inputs.csv"), "run,rms,input_rms,mm\nrun_000,1,2,3\nrun_001,4,5,6\nrun_002,7,8,9\n")
        .unwrap();
    let table = crumple::inputs::Table::read(&world.path("inputs.csv")).unwrap();
    study.add(&world.found(), AddOptions { params: Some(&table), ..Default::default() }, &()).unwrap();
    whole(&world, "study");
    let loaded = Loaded::of(study).unwrap();
    let options = crumple::export::ExportOptions::default();
    crumple::export::export(&loaded, &world.path("out"), &options).unwrap();
    let head = std::fs::read_to_string(world.path("out/runs.csv")).unwrap();
    let mut names: Vec<&str> = head.lines().next().unwrap().split(',').collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count, "two columns of one name: polars and DuckDB refuse such a table: {names:?}");
}
