//! Law: whatever a solver wrote, no stored number is NaN or infinite, nothing panics, and the study opens again.
//!
//! Random small meshes (folded, flat, degenerate, in several pieces), random deformations, runs that exploded up to the
//! limits of their word, and all questions asked of the study that results.

mod world;

use crumple::descriptor::{DescribeOptions, Select, Threshold, describe};
use crumple::modes::{By, Method, ModesOptions, load, modes, save};
use crumple::report::{describe_modes, findings, page};
use crumple::select::Kind;
use crumple::similarity::{Metric, SimilarityOptions, Weight, search};
use crumple::study::{AddOptions, Function, Loaded, Rows, Study, check};
use crumple::target::Named;
use proptest::prelude::*;
use world::{Family, Model, Point, World, cases, noise};

/// Everything that is stored is a number; the study can be opened and is whole.
fn stored_numbers(study: &Study) {
    let opened = Study::open(study.folder()).expect("a study that was written can be opened");
    for function in [Function::Displacement, Function::Rotation] {
        let rows = opened.coefficients_of(function, None, Rows::All).unwrap();
        assert!(rows.values.iter().all(|x| x.is_finite()) && rows.times.iter().all(|t| t.is_finite()));
    }
    for (run, record) in &opened.manifest().runs {
        let m = record.last;
        let all = [m.rms, m.max, m.captured, m.rigid_share, m.strain_median, m.strain_p95];
        assert!(all.iter().all(|x| x.is_finite()), "{run}: {m:?}");
        assert!((0.0..=1.0).contains(&m.captured) && (0.0..=1.0).contains(&m.rigid_share), "{run}: {m:?}");
    }
    let checkup = check(study.folder()).unwrap();
    assert!(checkup.whole, "{:?}", checkup.problems);
}

/// Asks everything that can be asked; errors are answers, panics and NaN are not.
fn ask_everything(study: Study) {
    let loaded = Loaded::of(study).unwrap();
    let runs: Vec<String> = loaded.study.manifest().runs.keys().cloned().collect();
    for method in Method::ALL {
        for by in [By::Displacement, By::Rotation] {
            let options = ModesOptions { method, by, ..Default::default() };
            let Ok(made) = modes(&loaded.study, &options, &()) else { continue };
            let numbers =
                made.runs.iter().flat_map(|run| [run.distance, run.silhouette, run.strength, run.score]).flatten();
            let numbers = numbers.chain(made.tried.iter().flat_map(|tried| [tried.stability, tried.bic]).flatten());
            assert!(numbers.chain(made.modes.iter().map(|mode| mode.spread)).all(f64::is_finite), "{made:?}");
            save(&loaded.study, &made).unwrap();
            assert_eq!(load(&loaded.study).unwrap(), made);
        }
    }
    for run in &runs {
        for select in [Select::Coordinates, Select::Difference] {
            let options = DescribeOptions { select, threshold: Threshold::Top(1), ..Default::default() };
            let made = describe(&loaded, &Named::parse(run), None, None, &options).unwrap().descriptor;
            let errors = made.selected.rivals.iter().map(|rival| rival.errors).chain(made.selected.errors);
            for e in errors {
                assert!(e.rms.is_finite() && e.max.is_finite() && e.relative.is_none_or(f64::is_finite), "{made:?}");
            }
            for metric in [Metric::Cosine, Metric::Euclidean, Metric::Mahalanobis] {
                for weight in [Weight::None, Weight::Frequency, Weight::Spread] {
                    for kind in [Kind::Rotation, Kind::Paper] {
                        let centred = weight == Weight::Spread;
                        let options = SimilarityOptions { kind: Some(kind), centred, weight, metric };
                        let Ok(hits) = search(&loaded, &made, options, Rows::All) else { continue };
                        let mut scores = hits.iter().flat_map(|hit| [hit.score.similarity, hit.score.distance]);
                        assert!(scores.all(f64::is_finite));
                    }
                }
            }
        }
    }
}

/// The page of a study: its numbers go through JSON, where a NaN would be null.
fn draw_the_page(study: &Study) {
    let loaded = Loaded::open(study.folder()).unwrap();
    let made = load(&loaded.study).unwrap();
    let options = DescribeOptions { threshold: Threshold::Top(1), ..Default::default() };
    let described = describe_modes(&loaded, &made, Some(&options), &()).unwrap();
    page(&findings(&loaded, &made, &described).unwrap()).unwrap();
}

/// Shells over a few nodes, corners drawn without a plan: repeated nodes, three faces on an edge, loose pieces.
fn any_model() -> impl Strategy<Value = Model> {
    let coordinate = prop_oneof![4 => -50.0_f64..50.0, 1 => Just(0.0), 1 => Just(10.0)];
    let nodes = proptest::collection::vec(proptest::array::uniform3(coordinate), 4..10);
    nodes
        .prop_flat_map(|nodes| {
            let corner = 0..nodes.len() as u32;
            let shells = proptest::collection::vec((proptest::array::uniform4(corner), 0_usize..2), 1..12);
            (Just(nodes), shells)
        })
        .prop_map(|(nodes, shells)| Model {
            node_ids: (0..nodes.len() as u32).map(|node| 100 + 3 * node).collect(),
            nodes,
            shells,
            parts: vec![(7, "LEFT".into()), (3, "RIGHT".into())],
        })
}

/// Moves, collapses, explodes or keeps a shape.
fn any_deformation() -> impl Strategy<Value = (u8, f64, u64)> {
    (0_u8..6, -3.0_f64..3.0, any::<u64>())
}

fn deformed(model: &Model, (kind, amount, seed): (u8, f64, u64)) -> Vec<Point> {
    let mut random = noise(seed);
    let map = |p: Point| match kind {
        0 => p,
        1 => p.map(|x| x + amount),
        2 => [0.0; 3],
        3 => [p[0], amount * p[1], 0.0],
        4 => p.map(|x| x * 10_f64.powf(10.0 * amount)),
        _ => p.map(|x| x + amount * random()),
    };
    model.nodes.iter().copied().map(map).collect()
}

proptest! {
    #![proptest_config(cases(40))]
    #[test]
    fn any_mesh_and_any_deformation(model in any_model(), runs in proptest::collection::vec(any_deformation(), 3..6)) {
        let world = World::new();
        for (number, deformation) in runs.iter().enumerate() {
            let states = [(0.0, model.nodes.clone()), (1.0, deformed(&model, *deformation))];
            world.write(&format!("run_{number}"), &model.family_of(states));
        }
        let options = crumple::basis::BasisOptions { eigenpairs: 6, ..Default::default() };
        let study = Study::create(&world.path("study"), &world.open("run_0"), &[], &[], &options, &());
        // A mesh that cannot be used is refused in words.
        if let Ok(mut study) = study {
            let add = AddOptions { skip_bad: true, ..Default::default() };
            study.add(&world.found(), add, &()).unwrap();
            stored_numbers(&study);
            ask_everything(study);
        }
    }
}

/// A study of three sound runs and one more.
fn with(family: Family) -> (World, Result<crumple::study::Added, crumple::Error>, Study) {
    let world = World::new();
    for run in 0..3 {
        let bend = world::bend(90.0, 0.4 * f64::from(run));
        world.write(&format!("run_{run}"), &Model::strip().family(3, move |t, p| bend(p.map(|x| t * x))));
    }
    let mut study = world.empty_study("study", "run_0", 10);
    world.add(&mut study).unwrap();
    world.write("run_9", &family);
    let found = crumple::bundle::find(&[world.root("run_9")]).unwrap();
    let added = study.add(&found, AddOptions::default(), &());
    (world, added, study)
}

#[test]
fn an_exploded_run_never_spoils_the_study() {
    let nodes = |size: f64, every: usize| -> Vec<Point> {
        let mut nodes = Model::strip().nodes;
        nodes.iter_mut().step_by(every).for_each(|p| *p = [size, -size, size]);
        nodes
    };
    for every in [1, 7, 60] {
        for size in [1e6, 1e15, 1e30, 3.4e38] {
            let (_world, _, study) = with(Model::strip().family_of([(1.0, nodes(size, every))]));
            stored_numbers(&study);
            ask_everything(study);
        }
        for size in [1e100, 1e160, 1e300, 1.7e308] {
            let (_world, _, study) = with(Model::strip().family_of([(1.0, nodes(size, every))]).double());
            stored_numbers(&study);
            ask_everything(study);
        }
    }
}

#[test]
fn nodes_that_are_no_numbers_are_named() {
    for broken in [f64::NAN, f64::INFINITY] {
        let mut nodes = Model::strip().nodes;
        nodes[17][1] = broken;
        let states = [(0.0, Model::strip().nodes), (1.0, nodes)];
        let (_world, added, study) = with(Model::strip().family_of(states));
        let Err(crumple::Error::NotFinite { state, count, node, .. }) = &added else { panic!("{added:?}") };
        // Ids count from 1.
        assert_eq!((*state, *count, *node), (1, 1, 18));
        stored_numbers(&study);
    }
}

#[test]
fn a_surface_that_vanished_is_a_shape_too() {
    let (world, added, study) = with(Model::strip().family(2, |t, p| p.map(|x| (1.0 - t) * x)));
    added.unwrap();
    stored_numbers(&study);
    ask_everything(study);
    draw_the_page(&Study::open(&world.path("study")).unwrap());
}

#[test]
fn a_degenerate_face_beside_good_ones_does_not_stop_the_study() {
    // A face that has shrunk to a line of two nodes, one of them used by no other face: "vertices that no face uses are
    // dropped" holds for it too.
    let mut model = Model::strip();
    model.nodes.push([200.0, 0.0, 0.0]);
    model.node_ids.push(999);
    model.shells.push(([49, 50, 50, 50], 0));
    let world = World::new();
    world.write("run", &model.family(2, |t, p| p.map(|x| x * (1.0 + t))));
    let options = crumple::basis::BasisOptions { eigenpairs: 6, ..Default::default() };
    let study = Study::create(&world.path("study"), &world.open("run"), &[], &[], &options, &());
    assert!(study.is_ok(), "one shell of a thousand stops the study: {}", study.unwrap_err());
}
