//! Laws of the rotation spectrum: what changes nothing, and what it says of surfaces that are hardly surfaces any more.

mod world;

use std::collections::BTreeMap;

use crumple::basis::BasisOptions;
use crumple::calibrate::calibrate;
use crumple::classify::Classifier;
use crumple::descriptor::{Descriptor, Threshold};
use crumple::explain::explain;
use crumple::features::Features;
use crumple::modes::{ModesOptions, modes};
use crumple::rotation::OCTAVES;
use crumple::select::{Kind, Select};
use crumple::similarity::{SimilarityOptions, cosine, search};
use crumple::study::{AddOptions, Loaded, Rows, Study};
use crumple::target::{Named, resolve};
use crumple::transfer::transfer;
use world::{Model, Point, World, bend, described, rotation};

const LENGTH: f64 = 120.0;

fn plate(fine: u32) -> Model {
    Model::plate(24 * fine, 6 * fine, LENGTH, 30.0)
}

/// Folds of a plate along x: heights of a wave, near-isometric for small ones.
fn fold(waves: f64, from: f64, way: f64) -> impl Fn(f64, Point) -> Point {
    move |t, [x, y, z]| {
        let at = (x - from) / 40.0;
        let inside = if (0.0..1.0).contains(&at) { (std::f64::consts::PI * at).sin().powi(2) } else { 0.0 };
        [x, y, z + way * t * inside * 3.0 * (std::f64::consts::TAU * waves * at).sin()]
    }
}

fn numbers(loaded: &Loaded) -> BTreeMap<String, Vec<f64>> {
    let features = Features::rotation(&loaded.basis);
    let samples = features.read(&loaded.study, Rows::Last).unwrap();
    (0..samples.rows()).map(|row| (samples.run(row).to_owned(), features.vector(&samples.stored(row)))).collect()
}

fn near(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < tolerance)
}

#[test]
fn moving_the_deformed_part_changes_nothing() {
    let world = World::new();
    let model = plate(1);
    let turn = rotation(2.0);
    let shape: Vec<Point> = model.nodes.iter().map(|&p| bend(LENGTH, 1.2)(p)).collect();
    let moved = shape.iter().map(|&p| turn(p).map(|x| x + 250.0)).collect();
    world.write("here", &model.family_of([(1.0, shape)]));
    world.write("there", &model.family_of([(1.0, moved)]));
    let found = numbers(&world.study(60));
    // Files are f32: 250 mm is rounded to 2e-5 mm, over edges of 5 mm.
    assert!(near(&found["here"], &found["there"], 1e-4), "{found:?}");
}

#[test]
fn another_unit_changes_nothing() {
    let of = |scale: f64| {
        let world = World::new();
        let model = plate(1).moved(|p| p.map(|x| scale * x));
        let shape = plate(1).nodes.iter().map(|&p| bend(LENGTH, 1.2)(p).map(|x| scale * x)).collect();
        world.write("run", &model.family_of([(1.0, shape)]));
        numbers(&world.study(60)).remove("run").unwrap()
    };
    let mm = of(1.0);
    assert!(near(&mm, &of(0.001), 1e-4) && near(&mm, &of(25.4), 1e-4));
}

#[test]
fn the_answer_does_not_depend_on_the_company() {
    let world = World::new();
    for run in 0..8 {
        let way = if run % 2 == 0 { 1.0 } else { -1.0 };
        let deform = fold(1.0 + f64::from(run / 4), 10.0 * f64::from(run), way);
        world.write(&format!("run_{run}"), &plate(1).family(2, deform));
    }
    let all = world.study(60);
    let few = World::new();
    for run in [0, 3, 5] {
        std::fs::create_dir_all(few.runs()).unwrap();
        let id = format!("run_{run}");
        let way = if run % 2 == 0 { 1.0 } else { -1.0 };
        few.write(&id, &plate(1).family(2, fold(1.0 + f64::from(run / 4), 10.0 * f64::from(run), way)));
    }
    let few = few.study(60);
    let similarities = |loaded: &Loaded| -> BTreeMap<String, f64> {
        let query = described(loaded, "run_3", Select::Coordinates, Threshold::Top(5)).descriptor;
        let options = SimilarityOptions { kind: Some(Kind::Rotation), ..Default::default() };
        search(loaded, &query, options, Rows::Last)
            .unwrap()
            .into_iter()
            .map(|hit| (hit.run, hit.score.similarity))
            .collect()
    };
    let (all, few) = (similarities(&all), similarities(&few));
    assert!(few.iter().all(|(run, similarity)| all[run] == *similarity), "{all:?} {few:?}");
}

#[test]
fn a_fold_is_a_fold_wherever_it_is_and_the_number_of_eigenvectors_hardly_matters() {
    for eigenpairs in [60, 120, usize::MAX] {
        let world = World::new();
        for (id, from) in [("left", 10.0), ("right", 65.0)] {
            world.write(id, &plate(1).family(2, fold(2.0, from, 1.0)));
        }
        world.write("bent", &plate(1).family(2, |t, p| bend(LENGTH, 1.5 * t + 1e-3)(p)));
        let found = numbers(&world.study(eigenpairs));
        let (fold, other) = (cosine(&found["left"], &found["right"]), cosine(&found["left"], &found["bent"]));
        assert!(fold > 0.97 && other < 0.3, "{eigenpairs}: {fold} {other}");
    }
}

/// Bent and folded plates of one mesh.
fn bundle(fine: u32) -> (World, Loaded) {
    let world = World::new();
    for run in 0..8 {
        let amount = 0.6 + 0.1 * f64::from(run);
        world.write(&format!("up_{run}"), &plate(fine).family(2, move |t, p| bend(LENGTH, amount * t + 1e-3)(p)));
        world.write(
            &format!("down_{run}"),
            &plate(fine).family(2, move |t, p| {
                let [x, y, z] = bend(LENGTH, amount * t + 1e-3)(p);
                [x, y, -z]
            }),
        );
        world.write(&format!("fold_{run}"), &plate(fine).family(2, fold(1.0, 9.0 * f64::from(run), 1.0)));
    }
    let loaded = world.study(100);
    (world, loaded)
}

fn wanted(loaded: &Loaded, run: &str) -> Descriptor {
    described(loaded, run, Select::Coordinates, Threshold::Top(5)).descriptor
}

#[test]
fn another_mesh_of_the_part_finds_the_same() {
    let ((_coarse, coarse), (_fine, fine)) = (bundle(1), bundle(2));
    for kind in ["up", "down", "fold"] {
        let (query, direction) = transfer(&coarse, &fine, &wanted(&coarse, &format!("{kind}_3"))).unwrap();
        assert!(direction);
        let hits = search(&fine, &query, SimilarityOptions::default(), Rows::Last).unwrap();
        assert!(hits[..8].iter().all(|hit| hit.run.starts_with(kind)), "{kind}: {hits:?}");
        // A wave of 40 mm on shells of 5 mm and of 2.5 mm.
        assert!(hits[0].score.similarity > 0.95, "{kind}: {:?}", hits[0]);
    }
    // A part that lies elsewhere has another direction, but the same kinds.
    let far = World::new();
    let moved = |model: Model| model.moved(|[x, y, z]| [2.0 * x + 500.0, 2.0 * y, 2.0 * z]);
    let double = |[x, y, z]: Point| [2.0 * x + 500.0, 2.0 * y, 2.0 * z];
    let model = plate(1);
    for (id, from) in [("fold", 30.0), ("folds", 50.0)] {
        let shape = fold(1.0, from, 1.0);
        far.write(
            id,
            &moved(plate(1)).family_of([(1.0, model.nodes.iter().map(|&p| double(shape(1.0, p))).collect())]),
        );
    }
    let bent = model.nodes.iter().map(|&p| double(bend(LENGTH, 1.0)(p))).collect();
    far.write("bent", &moved(plate(1)).family_of([(1.0, bent)]));
    let far = far.study(100);
    let (query, direction) = transfer(&coarse, &far, &wanted(&coarse, "fold_3")).unwrap();
    assert!(!direction);
    let hits = search(&far, &query, SimilarityOptions::default(), Rows::Last).unwrap();
    assert_eq!(hits[2].run, "bent");
    assert!(hits[1].score.similarity > 0.95 && hits[2].score.similarity < 0.6, "{hits:?}");
}

#[test]
fn an_explanation_adds_up() {
    let (_world, loaded) = bundle(1);
    let named = |run: &str| resolve(&loaded, &Named::parse(run)).unwrap();
    for (a, b) in [("up_0", "up_7"), ("up_0", "down_0"), ("up_0", "fold_2"), ("fold_1", "fold_6")] {
        let found = explain(&loaded.basis, &named(a), &named(b), "mm");
        let hits = search(
            &loaded,
            &wanted(&loaded, a),
            SimilarityOptions { kind: Some(Kind::Rotation), ..Default::default() },
            Rows::Last,
        )
        .unwrap();
        let said = hits.iter().find(|hit| hit.run == b).unwrap().score.similarity;
        let terms: f64 = found.kind.iter().map(|term| term.adds).sum();
        assert!((found.similarity - said).abs() < 1e-9 && (terms + found.direction - said).abs() < 1e-9);
        assert!(found.kind.len() == OCTAVES && !found.words.is_empty());
        let shares = |state: usize| found.kind.iter().map(|term| term.shares[state]).sum::<f64>();
        assert!(shares(0) <= 1.0 + 1e-6 && shares(1) <= 1.0 + 1e-6);
    }
    let opposite = explain(&loaded.basis, &named("up_3"), &named("down_3"), "mm");
    assert!(opposite.words.iter().any(|words| words.contains("opposite")), "{:?}", opposite.words);
}

#[test]
fn a_classifier_names_the_mode_and_refuses_a_stranger() {
    let (world, loaded) = bundle(1);
    let found = modes(&loaded.study, &ModesOptions { count: Some(3), ..Default::default() }, &()).unwrap();
    for kind in [Kind::Rotation, Kind::Paper] {
        let classifier = Classifier::of(&loaded, &found, kind).unwrap();
        for mode in &found.modes {
            let verdict = classifier.classify(&resolve(&loaded, &Named::parse(&mode.members[3])).unwrap()).unwrap();
            // By displacement a fold is another one elsewhere, so its nearest members may be of another mode.
            assert!(kind == Kind::Paper || verdict.nearest == mode.name, "{verdict:?}");
            assert!(verdict.margin.unwrap() >= 0.0 && verdict.scores.len() == 3);
        }
    }
    // Twisted, as no run of the study is.
    world.write(
        "twisted",
        &plate(1).family(2, |t, [x, y, z]| {
            let (s, c) = (1.5 * t * x / LENGTH).sin_cos();
            [x, 15.0 + (y - 15.0) * c, z + (y - 15.0) * s]
        }),
    );
    let path = world.root("twisted");
    let stranger = resolve(&loaded, &Named::parse(path.to_str().unwrap())).unwrap();
    let verdict = Classifier::of(&loaded, &found, Kind::Rotation).unwrap().classify(&stranger).unwrap();
    assert!(verdict.mode.is_none() && verdict.score < verdict.accepted, "{verdict:?}");
}

#[test]
fn a_calibrated_threshold_separates() {
    let (_world, loaded) = bundle(1);
    let query = wanted(&loaded, "up_3");
    for kind in [Kind::Rotation, Kind::Paper] {
        let options = SimilarityOptions { kind: Some(kind), ..Default::default() };
        let found = calibrate(&loaded, &query, options, |run| Some(run.starts_with("up"))).unwrap();
        assert_eq!((found.right, found.wrong, found.kind), (7, 16, kind));
        let hits = search(&loaded, &query, options, Rows::Last).unwrap();
        if kind == Kind::Rotation {
            assert_eq!((found.false_pass, found.false_fail), (0.0, 0.0));
            assert!(hits.iter().all(|hit| (hit.score.similarity >= found.threshold) == hit.run.starts_with("up")));
        }
    }
    let few = calibrate(&loaded, &query, SimilarityOptions::default(), |run| Some(run == "up_1"));
    assert!(matches!(few, Err(crumple::Error::TooFewRuns { .. })));
}

/// Warnings of one run on a plate.
fn warned(shape: impl Fn(Point) -> Point) -> (Vec<String>, Vec<f64>) {
    let world = World::new();
    let model = plate(1);
    world.write("run", &model.family_of([(1.0, model.nodes.iter().map(|&p| shape(p)).collect())]));
    let loaded = world.study(60);
    let warnings = loaded.study.record("run").unwrap().warnings.clone();
    (warnings, numbers(&loaded).remove("run").unwrap())
}

#[test]
fn a_surface_that_is_none_any_more_has_a_clear_word_and_numbers() {
    let turn = rotation(1.0);
    for (word, (warnings, numbers)) in
        [
            ("did not deform", warned(|p| turn(p).map(|x| x + 40.0))),
            ("lost their area", warned(|[x, y, z]| [x.max(30.0), y, z])),
            (
                "inside out",
                warned(|[x, y, z]| {
                    if ((x / 5.0) as i64 + (y / 5.0) as i64) % 2 == 0 { [x, y, z] } else { [30.0 - x, 10.0 - y, z] }
                }),
            ),
        ]
    {
        assert!(warnings.iter().any(|warning| warning.contains(word)), "{word}: {warnings:?}");
        assert!(numbers.iter().all(|x| x.is_finite()), "{word}: {numbers:?}");
    }
    let (warnings, _) = warned(|p| bend(LENGTH, 0.3)(p));
    assert!(
        !warnings.iter().any(|warning| ["did not", "lost", "inside"].iter().any(|word| warning.contains(word))),
        "{warnings:?}"
    );
}

#[test]
fn the_kind_hardly_depends_on_operator_and_mass() {
    let world = World::new();
    world.write("run", &plate(2).family(2, fold(2.0, 30.0, 1.0)));
    let of = |operator: crumple::Kind, mass: crumple::Mass| {
        let options = BasisOptions { eigenpairs: 120, kind: operator, mass, ..Default::default() };
        let made = std::fs::read_dir(world.path("")).unwrap().count();
        let path = world.path(&format!("study-{made}"));
        let mut study = Study::create(&path, &world.open("run"), &[], &[], &options, &()).unwrap();
        study.add(&world.found(), AddOptions::default(), &()).unwrap();
        numbers(&Loaded::of(study).unwrap()).remove("run").unwrap()[..OCTAVES].to_vec()
    };
    let mut usual = Vec::new();
    for operator in [crumple::Kind::Cotan, crumple::Kind::Tufted, crumple::Kind::Polygon] {
        for mass in [crumple::Mass::Lumped, crumple::Mass::Consistent, crumple::Mass::Identity] {
            let found = of(operator, mass);
            usual = if usual.is_empty() { found.clone() } else { usual };
            let similar = cosine(&usual, &found);
            // No more than another mesh of the part may change it. The consistent mass weighs what is as short as a shell
            // by as little as a quarter (0.987); with the identity the vertices of the rim count for twice their area (0.9997).
            assert!(similar > 0.95, "{operator} {mass}: {similar}");
        }
    }
}
