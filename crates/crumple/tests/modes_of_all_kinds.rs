//! Laws of what modes tell beyond the groups: runs without a mode, states, names, partings, inputs, bad input.

mod world;

use std::collections::BTreeMap;

use crumple::Error;
use crumple::inputs::Table;
use crumple::modes::{Along, By, Choose, Method, Modes, ModesOptions, States, Values, load, modes, save};
use crumple::study::{AddOptions, Loaded, Study};
use world::{Model, Point, World, bend, noise};

/// Runs 0, 3, 6, … bend up, 1, 4, 7, … bend down, 2, 5, 8, … crumple, each a little stronger than the one before.
fn kind(run: usize) -> impl Fn(f64, Point) -> Point {
    let strength = 1.0 + 0.05 * (run / 3) as f64;
    move |t, p| match run % 3 {
        0 => bend(90.0, 1.1 * strength * t)(p),
        1 => bend(90.0, -1.1 * strength * t)(p),
        _ => {
            let [x, y, z] = p;
            [x - 0.3 * strength * t * x, y, z + 6.0 * strength * t * (x / 6.0).sin()]
        }
    }
}

fn id(run: usize) -> String {
    format!("run_{run:02}")
}

/// `runs` runs of `states` states at times 0 to 10.
fn bundle(runs: usize, states: usize) -> (World, Loaded) {
    let world = World::new();
    (0..runs).for_each(|run| world.write(&id(run), &Model::strip().family(states, kind(run))));
    let loaded = world.study(40);
    (world, loaded)
}

fn ask(study: &Study, options: ModesOptions) -> Modes {
    modes(study, &options, &()).unwrap()
}

/// The kind of each mode's members, where they are all of one.
fn kinds(found: &Modes) -> BTreeMap<&str, usize> {
    let kind = |run: &String| run[4..].parse::<usize>().unwrap() % 3;
    let one = |members: &[String]| {
        let first = kind(&members[0]);
        members.iter().all(|run| kind(run) == first).then_some(first)
    };
    found.modes.iter().map(|mode| (mode.name.as_str(), one(&mode.members).unwrap())).collect()
}

#[test]
fn runs_between_the_groups_have_no_mode() {
    let world = World::new();
    for run in 0..21 {
        world.write(&id(run), &Model::strip().family(2, kind(run)));
    }
    // Two that went far away from all, and from each other.
    world.write("run_98", &Model::strip().family(2, |t, p| p.map(|x| x + 400.0 * t)));
    world.write("run_99", &Model::strip().family(2, |t, p| p.map(|x| x - 400.0 * t)));
    let loaded = world.study(40);
    let by = By::Displacement;
    let found = ask(&loaded.study, ModesOptions { by, method: Method::Hdbscan, ..Default::default() });
    assert_eq!(found.modes.len(), 3, "{found:?}");
    assert_eq!(found.without_mode(), ["run_98", "run_99"]);
    for run in &found.runs {
        let (inside, strength) = (run.mode.is_some(), run.strength.unwrap());
        assert_eq!((run.distance.is_some(), run.silhouette.is_some()), (inside, inside));
        assert!(if inside { strength > 0.0 && strength <= 1.0 } else { strength == 0.0 }, "{run:?}");
        assert!(inside || run.score.unwrap() > 3.0 && !run.outlier, "{run:?}");
    }
    save(&loaded.study, &found).unwrap();
    assert_eq!(load(&loaded.study).unwrap(), found);
    // The largest that can be asked for: no group is that large but all.
    let none = ask(&loaded.study, ModesOptions { method: Method::Hdbscan, smallest: Some(20), ..Default::default() });
    assert_eq!((none.modes.len(), none.without_mode().len()), (0, 23));
    assert!(none.notes.iter().any(|note| note.contains("no two dense groups")), "{:?}", none.notes);
    save(&loaded.study, &none).unwrap();
    assert_eq!(load(&loaded.study).unwrap(), none);
}

#[test]
fn coordinates_give_the_modes_of_the_displacement() {
    let (_world, loaded) = bundle(12, 2);
    for method in Method::ALL {
        let of = |by| ask(&loaded.study, ModesOptions { by, method, ..Default::default() });
        let (coordinates, displacement) = (of(By::Coordinates), of(By::Displacement));
        assert_eq!(coordinates.runs, displacement.runs);
        assert_eq!(Modes { by: By::Displacement, ..coordinates }, displacement);
    }
}

#[test]
fn a_state_that_is_there_is_taken_as_it_is_and_one_between_is_between() {
    // At time 5 of 5 states is state 2; the last state of a study that ends there is the same.
    let (_world, whole) = bundle(9, 5);
    let half = World::new();
    (0..9).for_each(|run| {
        half.write(
            &id(run),
            &Model::strip().family_of((0..3).map(|state| {
                let t = f64::from(state) / 4.0;
                (10.0 * t, Model::strip().nodes.into_iter().map(|p| kind(run)(t, p)).collect())
            })),
        )
    });
    let half = half.study(40);
    for by in [By::Displacement, By::Rotation] {
        let options = |states| ModesOptions { by, states, count: Some(3), ..Default::default() };
        let at = |stations: Vec<f64>| States::At { along: Along::Time, stations };
        let (middle, last) = (ask(&whole.study, options(at(vec![5.0]))), ask(&half.study, options(States::Last)));
        for (a, b) in middle.runs.iter().zip(&last.runs) {
            assert_eq!((&a.run, &a.mode), (&b.run, &b.mode));
            // f32 on both ways.
            assert!((a.distance.unwrap() - b.distance.unwrap()).abs() < 1e-4 * (1.0 + b.distance.unwrap()), "{by:?}");
        }
        let end = ask(&whole.study, options(at(vec![10.0])));
        let plain = ask(&whole.study, options(States::Last));
        assert_eq!((end.runs, end.modes), (plain.runs, plain.modes));
        let notes = ask(&whole.study, options(at(vec![3.0, 6.0]))).notes;
        assert!(notes[0].contains("3, 6"), "{notes:?}");
    }
}

#[test]
fn a_run_that_writes_other_states_is_the_same_run_along_time_and_one_that_is_slower_along_intrusion() {
    let world = World::new();
    for run in 0..9 {
        world.write(&id(run), &Model::strip().family(9, kind(run)));
    }
    // The path of run 0, written at other times; and run through with another speed.
    let path = |t: f64| -> Vec<Point> { Model::strip().nodes.into_iter().map(|p| kind(0)(t, p)).collect() };
    world.write(
        "run_90",
        &Model::strip().family_of((0..=64).map(|at| f64::from(at) / 64.0).map(|t| (10.0 * t, path(t)))),
    );
    world.write(
        "run_93",
        &Model::strip().family_of((0..=64).map(|at| f64::from(at) / 64.0).map(|t| (10.0 * t, path(t * t)))),
    );
    let loaded = world.study(40);
    let of = |along| {
        let options =
            ModesOptions { by: By::Displacement, count: Some(11), method: Method::Ward, ..Default::default() };
        let series = ask(&loaded.study, ModesOptions { states: States::Series { along }, ..options.clone() });
        let far = ask(&loaded.study, ModesOptions { states: States::Series { along }, count: Some(1), ..options });
        assert_eq!(series.modes.len(), 11);
        let medoid = far.modes[0].medoid.clone();
        let distance = |run: &str| far.runs.iter().find(|other| other.run == run).unwrap().distance.unwrap();
        (medoid, distance("run_00"), distance("run_90"), distance("run_93"))
    };
    let (medoid, first, other, slow) = of(Along::Time);
    // Steps of an eighth, interpolated linearly, are not far from the path itself.
    assert!(medoid == "run_00" || medoid == "run_90" || (first - other).abs() < 0.5, "{first} {other}");
    assert!((first - slow).abs() > (first - other).abs(), "{first} {other} {slow}");
    let (_, first, other, slow) = of(Along::Intrusion);
    assert!((first - other).abs() < 0.5 && (first - slow).abs() < 0.5, "{first} {other} {slow}");
}

#[test]
fn whole_series_find_the_kinds_and_early_ends_are_said() {
    let (world, _) = bundle(15, 6);
    let early = Model::strip().family_of((0..3).map(|state| {
        let t = f64::from(state) / 10.0;
        (10.0 * t, Model::strip().nodes.into_iter().map(|p| kind(0)(t, p)).collect())
    }));
    world.write("run_99", &early);
    let mut study = world.empty_study("again", "run_00", 40);
    world.add(&mut study).unwrap();
    for along in [Along::Time, Along::Intrusion] {
        let found =
            ask(&study, ModesOptions { states: States::Series { along }, count: Some(3), ..Default::default() });
        assert_eq!(found.without_mode(), ["run_99"], "{along:?}");
        assert!(found.notes.iter().any(|note| note.contains("run_99")), "{:?}", found.notes);
        assert_eq!(kinds(&found).len(), 3);
    }
    let at = ask(
        &study,
        ModesOptions {
            states: States::At { along: Along::Intrusion, stations: vec![0.5, 1.0] },
            count: Some(3),
            ..Default::default()
        },
    );
    assert_eq!(kinds(&at).len(), 3);
}

#[test]
fn names_stay_with_their_runs() {
    let (world, loaded) = bundle(15, 2);
    let mut study = loaded.study;
    let three = || ModesOptions { count: Some(3), ..Default::default() };
    let mut found = ask(&study, three());
    let bent_up = found.modes.iter().find(|mode| mode.members[0] == "run_00").unwrap().name.clone();
    found.rename(&bent_up, "bent up").unwrap();
    assert!(found.runs.iter().filter(|run| run.mode.as_deref() == Some("bent up")).count() == 5);
    save(&study, &found).unwrap();
    // The same groups by another method and measure, and with more runs: the name is with run 0's kind.
    for run in [15, 18, 21, 24, 27, 16] {
        world.write(&id(run), &Model::strip().family(2, kind(run)));
    }
    study.add(&world.found(), AddOptions::default(), &()).unwrap();
    for options in [three(), ModesOptions { method: Method::Ward, by: By::Displacement, ..three() }] {
        let again = ask(&study, options);
        assert_eq!(kinds(&again)["bent up"], 0, "{:?}", again.names);
        save(&study, &again).unwrap();
    }
    // One mode of all runs is another group: the name rests, and comes back.
    let one = ask(&study, ModesOptions { count: Some(1), ..Default::default() });
    assert_eq!(one.modes[0].name, "mode-1");
    assert!(one.notes.iter().any(|note| note.contains("no mode is 'bent up' now")), "{:?}", one.notes);
    save(&study, &one).unwrap();
    let back = ask(&study, three());
    assert_eq!(kinds(&back)["bent up"], 0);
    // Taken away it is a number again.
    let mut back = back;
    back.rename("bent up", "").unwrap();
    assert!(back.names.is_empty() && back.modes.iter().all(|mode| mode.name.starts_with("mode-")));
}

#[test]
fn names_that_cannot_be_are_refused() {
    let (_world, loaded) = bundle(9, 2);
    let mut found = ask(&loaded.study, ModesOptions { count: Some(3), ..Default::default() });
    found.rename("mode-1", "crush").unwrap();
    for bad in ["mode-7", "none", "a/b", ".hidden", "crush", "a=b"] {
        let error = found.rename("mode-2", bad).unwrap_err();
        assert!(matches!(error, Error::Value { name: "--name", .. }), "{bad}: {error}");
    }
    assert!(matches!(found.rename("mode-1", "bend"), Err(Error::UnknownMode { .. })), "it is 'crush' now");
}

#[test]
fn modes_part_when_their_paths_do() {
    let world = World::new();
    let mut random = noise(3);
    // All bend alike until half time; then one half goes on and the other goes back and beyond.
    for run in 0..16 {
        let shake = 0.02 * random();
        let angle = move |t: f64| match (run % 2, t > 0.5) {
            (_, false) => 1.0 + shake,
            (0, true) => 2.0 + shake,
            (_, true) => -1.0 + shake,
        };
        world.write(&id(run), &Model::strip().family(6, move |t, p| bend(90.0, t * angle(t))(p)));
    }
    let loaded = world.study(40);
    for by in [By::Displacement, By::Rotation] {
        let found = ask(&loaded.study, ModesOptions { by, count: Some(2), ..Default::default() });
        let [parting] = &found.partings[..] else { panic!("{:?}", found.partings) };
        // States at 0, 2, 4, 6, …; times are f32 in the file.
        assert_eq!(parting.state, Some(3), "{by:?} {parting:?}");
        assert!((parting.time.unwrap() - 6.0).abs() < 1e-5);
        let early = |time: f64| time < 5.0;
        assert!(parting.evidence.iter().all(|at| early(at.time) || at.apart == 1.0), "{parting:?}");
        assert!(parting.evidence.iter().all(|at| !early(at.time) || at.apart < 0.9), "{parting:?}");
    }
}

/// A bundle with a table: `strength` that goes with the crumpling, `supplier` that goes with bending up, `noise`.
fn with_inputs(runs: usize) -> (World, Study) {
    let world = World::new();
    let mut random = noise(8);
    let mut table = "run,strength,supplier,noise,same\n".to_owned();
    for run in 0..runs {
        world.write(&id(run), &Model::strip().family(2, kind(run)));
        let strength = if run % 3 == 2 { 1.0 } else { 3.0 } + random();
        let supplier = if run % 3 == 0 { "east" } else { "west" };
        table += &format!("{},{strength},{supplier},{},7\n", id(run), random());
    }
    let path = world.path("inputs.csv");
    std::fs::write(&path, table).unwrap();
    let mut study = world.empty_study("study", "run_00", 40);
    let table = Table::read(&path).unwrap();
    study.add(&world.found(), AddOptions { params: Some(&table), ..Default::default() }, &()).unwrap();
    (world, study)
}

#[test]
fn inputs_that_go_with_a_mode_are_told_and_others_are_not() {
    let (_world, study) = with_inputs(30);
    let found = ask(&study, ModesOptions { count: Some(3), ..Default::default() });
    let kinds = kinds(&found);
    for mode in &found.modes {
        let input = |name: &str| mode.inputs.iter().find(|input| input.input == name).unwrap();
        assert!(mode.inputs.iter().all(|input| input.input != "same"), "an input that does not vary tells nothing");
        assert!(!input("noise").tells, "{mode:?}");
        let (strength, supplier) = (input("strength"), input("supplier"));
        match kinds[mode.name.as_str()] {
            2 => assert!(strength.tells && strength.effect < -0.9, "{strength:?}"),
            0 => assert!(supplier.tells && supplier.effect > 0.9, "{supplier:?}"),
            _ => {}
        }
        assert!(
            matches!(strength.values, Values::Numbers { .. }) && matches!(supplier.values, Values::Categories { .. })
        );
        assert!(mode.inputs.iter().all(|input| input.p <= input.p_adjusted && input.p_adjusted <= 1.0));
        assert!(mode.inputs.windows(2).all(|pair| pair[0].tells >= pair[1].tells));
    }
}

#[test]
fn few_runs_tell_nothing() {
    let (_world, study) = with_inputs(9);
    let found = ask(&study, ModesOptions { count: Some(3), ..Default::default() });
    for mode in &found.modes {
        // 3 runs against 6: the least p is 2 in 84, and twelve questions are asked.
        assert!(mode.inputs.iter().all(|input| !input.tells), "{mode:?}");
        assert!(mode.input_words()[0].contains("no input tells this mode apart"), "{:?}", mode.input_words());
    }
    let all = ask(&study, ModesOptions { count: Some(9), ..Default::default() });
    assert!(all.modes.iter().all(|mode| mode.inputs.is_empty() && mode.input_words().is_empty()));
    assert!(all.partings.iter().all(|parting| parting.time.is_none() && parting.evidence.is_empty()));
}

#[test]
fn stability_is_told_and_can_choose() {
    let (_world, loaded) = bundle(24, 2);
    for choose in [Choose::Silhouette, Choose::Stability] {
        for method in [Method::KMeans, Method::Ward, Method::Average, Method::Mixture] {
            let found = ask(&loaded.study, ModesOptions { choose, method, ..Default::default() });
            assert_eq!(found.modes.len(), 3, "{choose:?} {method:?}: {:?}", found.tried);
            let three = found.tried[1];
            assert_eq!((three.count, three.stability), (3, Some(1.0)), "{method:?}");
            assert_eq!(found.tried.iter().all(|tried| tried.bic.is_some()), method == Method::Mixture);
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused_in_words() {
    let (_world, loaded) = bundle(9, 3);
    let refused = |options: ModesOptions| match modes(&loaded.study, &options, &()) {
        Err(Error::Value { name, expected, .. }) => (name, expected),
        other => panic!("{options:?}: {other:?}"),
    };
    let at =
        |along, station| ModesOptions { states: States::At { along, stations: vec![station] }, ..Default::default() };
    for count in [0, 10] {
        assert_eq!(refused(ModesOptions { count: Some(count), ..Default::default() }).0, "--count");
    }
    let dense = ModesOptions { method: Method::Hdbscan, ..Default::default() };
    assert!(refused(ModesOptions { count: Some(3), ..dense.clone() }).1.contains("--smallest"));
    assert!(refused(ModesOptions { smallest: Some(3), ..Default::default() }).1.contains("hdbscan"));
    for smallest in [0, 1, 10] {
        assert_eq!(refused(ModesOptions { smallest: Some(smallest), ..dense.clone() }).0, "--smallest");
    }
    for time in [0.0, -1.0, 11.0, f64::NAN] {
        let (name, expected) = refused(at(Along::Time, time));
        assert!(name == "--at" && expected.contains("at most 10"), "{time}: {expected}");
    }
    for share in [0.0, 1.1, f64::NAN] {
        assert_eq!(refused(at(Along::Intrusion, share)).0, "--at-intrusion");
    }
    let (_world, two) = bundle(2, 2);
    assert!(matches!(modes(&two.study, &ModesOptions::default(), &()), Err(Error::TooFewRuns { have: 2, .. })));
}

#[test]
fn runs_that_never_move_have_answers_whatever_is_asked() {
    let world = World::new();
    (0..12).for_each(|run| world.write(&id(run), &Model::strip().family(3, |_, p| p)));
    let loaded = world.study(20);
    for by in [By::Displacement, By::Rotation] {
        for method in Method::ALL {
            for along in [Along::Time, Along::Intrusion] {
                let states = States::Series { along };
                let found = ask(&loaded.study, ModesOptions { by, method, states, ..Default::default() });
                assert!(found.runs.iter().all(|run| run.distance == Some(0.0) && !run.outlier), "{by:?} {method:?}");
                save(&loaded.study, &found).unwrap();
                assert_eq!(load(&loaded.study).unwrap(), found);
            }
        }
    }
}
