//! Laws of following: every whole state is seen once, in order, however the solver's bytes come; a run on the target's
//! path is let alone, a run that leaves it is told, and not before it left.

mod world;

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use crumple::Error;
use crumple::descriptor::{Descriptor, find};
use crumple::modes::{self, ModesOptions};
use crumple::monitor::{Align, Calibration, Follow, Monitor, Rule, Tracker, Verdict, calibrate, follow, stop};
use crumple::project::Projector;
use crumple::run::Run;
use crumple::study::{Loaded, Rows};
use crumple::target::Target;
use world::{Family, Model, Point, World, bend};

const STATES: usize = 13;

/// Bends by `angle`, and rings a little while it begins.
fn bending(angle: f64) -> impl Fn(f64, Point) -> Point {
    move |t, p| {
        let [x, y, z] = bend(90.0, angle * t * t)(p);
        [x, y, z + 0.02 * (1.0 - t) * ((60.0 * t + p[0]).sin() - p[0].sin())]
    }
}

/// Turns about its long axis by `angle`.
fn twisting(angle: f64) -> impl Fn(f64, Point) -> Point {
    move |t, [x, y, z]| {
        let (sin, cos) = (angle * t * t * x / 90.0).sin_cos();
        [
            x,
            18.5 + cos * (y - 18.5) - sin * z,
            sin * (y - 18.5) + cos * z + 0.02 * (1.0 - t) * ((60.0 * t + x).sin() - x.sin()),
        ]
    }
}

/// Bends to the middle of its time, then twists in place of bending on.
fn bending_then_twisting(t: f64, p: Point) -> Point {
    twisting(2.0 * (t - 0.5).max(0.0))(1.0, bending(1.2)(t.min(0.5), p))
}

/// Eight runs that bend, four that twist, grouped into two modes.
fn known(world: &World) -> Loaded {
    let model = Model::strip();
    for run in 0..8 {
        world.write(&format!("bend_{run}"), &model.family(STATES, bending(1.0 + 0.05 * f64::from(run))));
    }
    for run in 0..4 {
        world.write(&format!("twist_{run}"), &model.family(STATES, twisting(1.0 + 0.1 * f64::from(run))));
    }
    let loaded = world.study(40);
    let found = modes::modes(&loaded.study, &ModesOptions { count: Some(2), ..ModesOptions::default() }, &()).unwrap();
    modes::save(&loaded.study, &found).unwrap();
    loaded
}

fn calibrated(loaded: &Loaded, descriptor: &Descriptor, align: Align) -> Calibration {
    let tracker = Tracker::new(loaded, descriptor, None, align).unwrap();
    let target = tracker.target(descriptor).unwrap();
    calibrate(loaded, &tracker, descriptor, &target, &Rule::constant(0.0)).unwrap()
}

/// What the rule says about each state of a family.
fn verdicts(loaded: &Loaded, descriptor: &Descriptor, align: Align, run: &Run) -> Vec<Verdict> {
    let tracker = Tracker::new(loaded, descriptor, None, align).unwrap();
    let projector = Projector::new(&loaded.reference, &loaded.basis, &[]);
    let rule = calibrated(loaded, descriptor, align).rule;
    let mut monitor = Monitor::new(tracker.target(descriptor).unwrap(), rule);
    let verdict = |state: usize| {
        let target = Target::projected(run.id(), state, projector.state(run, state).unwrap());
        let place = tracker.place(&target).unwrap();
        monitor.step(place.at, &place.numbers).verdict
    };
    (0..run.times().len()).map(verdict).collect()
}

#[test]
fn the_rule_lets_alone_what_belongs_and_stops_what_does_not() {
    let world = World::new();
    let loaded = known(&world);
    let descriptor = find(&loaded, "bend_3", None).unwrap();
    let rule = calibrated(&loaded, &descriptor, Align::Time);
    assert_eq!((rule.members, rule.others), (7, 4));
    assert_eq!(rule.others_stopped, 4, "{rule:?}");
    assert!(rule.members_stopped <= 2, "the two ends of seven members, each judged by the others: {rule:?}");
    assert!(rule.others_stopped_at.unwrap() < 0.6, "{rule:?}");

    world.write("new", &Model::strip().family(STATES, bending(1.17)));
    let told = verdicts(&loaded, &descriptor, Align::Time, &world.open("new"));
    assert!(!told.contains(&Verdict::Diverged), "{told:?}");
    assert_eq!(told[..3], [Verdict::Early; 3], "what rings at the start is not judged: {told:?}");

    world.write("new", &Model::strip().family(STATES, bending_then_twisting));
    let told = verdicts(&loaded, &descriptor, Align::Time, &world.open("new"));
    let first = told.iter().position(|told| *told == Verdict::Diverged).expect("it left the path");
    assert!(first > STATES / 2, "it was on the path until the middle: {told:?}");
    assert!(told[4..=STATES / 2].iter().all(|told| *told == Verdict::Alike), "{told:?}");
}

#[test]
fn a_slower_run_is_on_the_path_by_intrusion() {
    let world = World::new();
    let loaded = known(&world);
    let descriptor = find(&loaded, "bend_3", None).unwrap();
    // Half the speed: after all of the time it is where the target was after a part of it.
    world.write("new", &Model::strip().family(STATES, |t, p| bend(90.0, 0.6 * t)(p)));
    let told = verdicts(&loaded, &descriptor, Align::Intrusion, &world.open("new"));
    assert!(!told.contains(&Verdict::Diverged), "{told:?}");
    world.write("new", &Model::strip().family(STATES, |t, p| twisting(1.5)(t.sqrt(), p)));
    let told = verdicts(&loaded, &descriptor, Align::Intrusion, &world.open("new"));
    assert!(told.contains(&Verdict::Diverged), "{told:?}");
}

#[test]
fn a_path_needs_members_or_a_tolerance() {
    let world = World::new();
    let loaded = known(&world);
    let descriptor = find(&loaded, "bend_3@0", None);
    // The undeformed state is no target at all.
    let tracked = descriptor.and_then(|descriptor| {
        Tracker::new(&loaded, &descriptor, None, Align::Time).and_then(|tracker| tracker.target(&descriptor))
    });
    assert!(tracked.is_err());
    let found = modes::modes(&loaded.study, &ModesOptions { count: Some(6), ..ModesOptions::default() }, &()).unwrap();
    modes::save(&loaded.study, &found).unwrap();
    let small = found.modes.iter().find(|mode| mode.members.len() < 4).expect("twelve runs in six modes");
    let descriptor = find(&loaded, &small.medoid, None).unwrap();
    let tracker = Tracker::new(&loaded, &descriptor, None, Align::Time).unwrap();
    let target = tracker.target(&descriptor).unwrap();
    let error = calibrate(&loaded, &tracker, &descriptor, &target, &Rule::constant(0.0)).unwrap_err();
    assert!(matches!(error, Error::Value { name: "--tolerance", .. }), "{error}");
}

// ---- a solver at work ---------------------------------------------------------------------------------------------

/// Writes the bytes of a finished family to `to` as a solver does: one file after the other, in pieces that do not end
/// where states end, with pauses.
fn slowly(from: &Path, to: &Path, piece: usize, pause: Duration) {
    std::fs::create_dir_all(to.parent().unwrap()).unwrap();
    for number in 0.. {
        let name =
            |root: &Path| if number == 0 { root.to_owned() } else { format!("{}{number:02}", root.display()).into() };
        let Ok(bytes) = std::fs::read(name(from)) else { return };
        let mut file = File::create(name(to)).unwrap();
        for piece in bytes.chunks(piece) {
            file.write_all(piece).unwrap();
            file.flush().unwrap();
            sleep(pause);
        }
    }
}

/// Writes states behind the geometry into one file, each with the end mark behind it that the next one overwrites.
fn with_end_marks(family: &Family, staged: &Path, to: &Path, pause: Duration) {
    let bytes = |states: usize| {
        let states = family.states[..states].to_vec();
        // What is written is never overwritten.
        let staged = staged.join(states.len().to_string()).join("d3plot");
        Family { states, ..family.clone() }.states_a_member(0).write(&staged);
        std::fs::read(staged).unwrap()
    };
    std::fs::create_dir_all(to.parent().unwrap()).unwrap();
    for states in 0..=family.states.len() {
        let now = bytes(states);
        let mut file = OpenOptions::new().create(true).truncate(false).write(true).open(to).unwrap();
        // Two pieces: the second holds the end of the state and the mark.
        let (first, second) = now.split_at(now.len() * 2 / 3);
        file.write_all(first).unwrap();
        sleep(pause);
        file.seek(SeekFrom::Start(first.len() as u64)).unwrap();
        file.write_all(second).unwrap();
        sleep(pause);
    }
}

fn quick(timeout: f64) -> Follow {
    Follow { every: Duration::from_millis(7), timeout: Duration::from_secs_f64(timeout) }
}

/// Follows to the last state; every state's number and positions.
fn followed(path: &Path, states: usize, options: Follow) -> Vec<(usize, Vec<Point>)> {
    let mut seen = Vec::new();
    follow(path, options, &(), |run, state| {
        seen.push((state, run.positions(state)?));
        Ok(if seen.len() == states { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    })
    .unwrap();
    seen
}

#[test]
fn every_state_is_seen_once_and_whole() {
    let world = World::new();
    let family = Model::strip().family(STATES, bending(1.0));
    let whole = |seen: Vec<(usize, Vec<Point>)>, how: &str| {
        assert_eq!(seen.len(), STATES, "{how}");
        for (at, (state, positions)) in seen.into_iter().enumerate() {
            assert_eq!(state, at, "{how}");
            let near = |a: &Point, b: &Point| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-4);
            let expected = &family.states[state].1;
            assert!(positions.iter().zip(expected).all(|(a, b)| near(a, b)), "{how}: state {state} was not whole");
        }
    };
    for (piece, members) in [(211, 0), (997, 1), (4099, 3)] {
        let (from, to) = (world.path(&format!("done/{piece}/d3plot")), world.path(&format!("job/{piece}/d3plot")));
        family.clone().states_a_member(members).write(&from);
        std::thread::scope(|scope| {
            scope.spawn(|| slowly(&from, &to, piece, Duration::from_millis(2)));
            // The folder or the root; neither is there when we begin.
            let path = if members == 1 { to.parent().unwrap() } else { &to };
            whole(followed(path, STATES, quick(60.0)), &format!("pieces of {piece} bytes, {members} states a file"));
        });
    }
    let (staged, to) = (world.path("staged/d3plot"), world.path("marks/d3plot"));
    std::thread::scope(|scope| {
        // Behind half a state lies what was there before, so only a look apart from the next tells that it is whole.
        let options = Follow { every: Duration::from_millis(200), ..quick(60.0) };
        scope.spawn(|| with_end_marks(&family, &staged, &to, Duration::from_millis(5)));
        whole(followed(&to, STATES, options), "end marks that are overwritten");
    });
}

#[test]
fn a_folder_that_never_fills_is_one_error() {
    let world = World::new();
    let empty = world.path("empty");
    std::fs::create_dir(&empty).unwrap();
    let never = |path: &Path| follow(path, quick(0.05), &(), |_, _| Ok(ControlFlow::<()>::Continue(()))).unwrap_err();
    for path in [empty.clone(), world.path("nowhere"), empty.join("d3plot")] {
        let error = never(&path);
        assert!(matches!(error, Error::Silent { seen: 0, .. }), "{error}");
        assert!(error.to_string().contains("none came"), "{error}");
    }
    // What is there and is no family says why.
    std::fs::write(empty.join("d3plot"), "a letter").unwrap();
    assert!(never(&empty.join("d3plot")).to_string().len() > never(&world.path("nowhere")).to_string().len());
    // A run that stalls says how far it came.
    world.write("short", &Model::strip().family(3, bending(1.0)));
    let error = never(&world.root("short"));
    assert!(matches!(error, Error::Silent { seen: 3, last_time: Some(10.0), .. }), "{error}");
}

#[test]
fn a_run_that_is_started_anew_is_told() {
    let world = World::new();
    world.write("new", &Model::strip().family(5, bending(1.0)));
    let root = world.root("new");
    let result = follow(&root, quick(60.0), &(), |_, state| {
        if state == 4 {
            world.write("new", &Model::strip().family(2, bending(1.0)));
        }
        Ok(ControlFlow::<()>::Continue(()))
    });
    assert!(matches!(result, Err(Error::Restarted { before: 5, now: 2, .. })), "{result:?}");
}

#[test]
fn the_stop_request_lies_beside_the_result_file() {
    let world = World::new();
    world.write("new", &Model::strip().family(2, bending(1.0)));
    let file = stop(&world.root("new")).unwrap();
    assert_eq!(file, world.runs().join("new/d3kil"));
    assert_eq!(std::fs::read(&file).unwrap(), b"sw1\n");
}

#[test]
fn the_paths_of_a_study_are_what_its_runs_are() {
    let world = World::new();
    let loaded = known(&world);
    let descriptor = find(&loaded, "bend_3", None).unwrap();
    let tracker = Tracker::new(&loaded, &descriptor, None, Align::Time).unwrap();
    let tracks = tracker.tracks(Rows::All).unwrap();
    assert_eq!(tracks.len(), 12);
    let run = world.open("bend_5");
    let projector = Projector::new(&loaded.reference, &loaded.basis, &[]);
    let (_, track) = tracks.iter().find(|(id, _)| id == "bend_5").unwrap();
    for (state, place) in track.places().iter().enumerate() {
        let target = Target::projected("bend_5", state, projector.state(&run, state).unwrap());
        assert_eq!(*place, tracker.place(&target).unwrap(), "state {state}: read and projected are the same");
    }
}
