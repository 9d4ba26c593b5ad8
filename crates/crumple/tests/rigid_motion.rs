//! Laws of motion and of units: what a rigid motion, another scale, another numbering or another frame may change, and
//! what not.
//!
//! Tolerances: positions in the files are f32 (6e-8 of the largest coordinate, here about 100 mm: 6e-6 mm), δ too. A
//! number that is exact in theory is therefore held to 1e-5 of the displacements, which are tens of mm.

mod world;

use crumple::basis::Basis;
use crumple::descriptor::{Select, Threshold};
use crumple::modes::{By, ModesOptions, modes};
use crumple::project::{Measures, project};
use crumple::rotation;
use crumple::similarity::{Metric, SimilarityOptions, search};
use crumple::study::{Loaded, Rows};
use world::{Model, Point, World, bend, described, energy, relative, rotation, triples};

/// Coefficients and measures of one deformation of one model.
fn moved(model: &Model, map: impl Fn(Point) -> Point) -> (Basis, Vec<Point>, Measures) {
    let world = World::new();
    world.write("run", &model.family_of([(1.0, model.nodes.iter().map(|&p| map(p)).collect())]));
    let study = world.empty_study("study", "run", 20);
    let (reference, basis) = (study.reference().unwrap(), study.basis().unwrap());
    let projected = project(&world.open("run"), &reference, &basis, &[], &()).unwrap();
    let state = &projected.states[0];
    (basis, triples(&state.delta), state.measures)
}

fn two_sheets() -> Model {
    Model::strip().and(Model::strip().moved(|[x, y, z]| [x, y, z + 8.0]))
}

#[test]
fn a_translation_touches_only_the_null_space() {
    for model in [Model::strip(), two_sheets()] {
        let (basis, delta, measures) = moved(&model, |p| [p[0] + 30.0, p[1] - 7.0, p[2] + 12.0]);
        let null = basis.facts.null_space;
        let (inside, outside) = (energy(&delta[..null]), energy(&delta[null..]));
        assert!(outside.sqrt() < 1e-5 * inside.sqrt(), "{} beside {}", outside.sqrt(), inside.sqrt());
        // ‖t‖² area: all of it is there.
        assert!(relative(inside, (900.0 + 49.0 + 144.0) * basis.facts.area) < 1e-5);
        assert!(measures.rigid_share > 1.0 - 1e-6 && measures.strain_p95 < 1e-5, "{measures:?}");
    }
}

#[test]
fn a_rigid_motion_is_rigid_and_strains_nothing() {
    for angle in [0.02, 0.7, 2.0, std::f64::consts::PI] {
        let turn = rotation(angle);
        let (_, _, measures) = moved(&Model::beam(8, 2, 120.0, 30.0, 25.0), |p| {
            let [x, y, z] = turn(p);
            [x + 5.0, y - 3.0, z + 11.0]
        });
        assert!(measures.rigid_share > 1.0 - 1e-6, "angle {angle}: {measures:?}");
        assert!(measures.strain_p95 < 1e-5, "angle {angle}: {measures:?}");
        assert!(!measures.warnings().is_empty());
    }
}

#[test]
fn a_bend_is_not_rigid_and_hardly_strains() {
    // About the middle of the strip; about an end most of the displacement would be the turn of the other end.
    let middle = Model::strip().moved(|[x, y, z]| [x - 45.0, y, z]);
    let (_, _, measures) = moved(&middle, bend(90.0, 1.5));
    // A circle's chord for an arc of 1.5/9 rad a cell: 1 − (1/6²)·1.5²/81… = 1.2e-3.
    assert!(measures.rigid_share < 0.95 && measures.strain_p95 < 2e-3, "{measures:?}");
    let (_, _, stretched) = moved(&Model::strip(), |[x, y, z]| [1.3 * x, y, z]);
    // Edges along x and the diagonals stretch, edges along y do not.
    assert!((stretched.strain_p95 - 0.3).abs() < 1e-5 && stretched.strain_median > 0.0, "{stretched:?}");
}

#[test]
fn a_reflection_is_no_rigid_motion() {
    let model = Model::beam(8, 2, 120.0, 30.0, 25.0);
    let (_, _, measures) = moved(&model, |[x, y, z]| [x, y, 40.0 - z]);
    assert!(measures.rigid_share < 1.0 - 1e-3 && measures.strain_p95 < 1e-5, "{measures:?}");
}

#[test]
fn a_rigid_motion_has_no_rotation_field() {
    let model = Model::beam(8, 2, 120.0, 30.0, 25.0);
    let triangles: Vec<[u32; 3]> = model.shells.iter().flat_map(|&([a, b, c, d], _)| [[a, b, c], [a, c, d]]).collect();
    // Half a turn is where the axis turns over; rounding decides for each face on which side it is.
    for angle in [0.3, 1.6, 3.0, std::f64::consts::PI, 3.3, 6.0] {
        let turn = rotation(angle);
        // As a file holds it.
        let shape: Vec<Point> = model.nodes.iter().map(|&p| turn(p).map(|x| f64::from(x as f32))).collect();
        let field = rotation::field(&triangles, &model.nodes, &shape);
        // f32 positions over edges of 8 mm: 1e-6 rad.
        assert!(field.as_flattened().iter().all(|x| x.abs() < 1e-5), "turn by {angle}");
    }
}

/// Three kinds of deformation, two runs of each; `map` is applied to the undeformed and to every deformed shape.
///
/// Triangles, because rounding may choose another diagonal of a quad, and then the operator is another one.
fn bundle(
    map: impl Fn(Point) -> Point + Copy,
    layout: impl Fn(&Model) -> Model,
    states_a_member: usize,
) -> (World, Loaded) {
    let world = World::new();
    let model = Model::strip().triangulated();
    let kinds: [&dyn Fn(f64, Point) -> Point; 3] =
        [&|t, p| bend(90.0, 1.4 * t)(p), &|t, [x, y, z]| [x, y, z + 9.0 * t * (x / 14.0).sin()], &|t, [x, y, z]| {
            [x - 0.3 * t * x, y + 4.0 * t * (x / 20.0).cos(), z - 6.0 * t * (y / 9.0).sin()]
        }];
    for (kind, deformation) in kinds.iter().enumerate() {
        for strength in [0.7, 1.0] {
            let undeformed = layout(&model).moved(map);
            let states = (0..4).map(|state| {
                let t = strength * f64::from(state) / 3.0;
                (f64::from(state), layout(&model).nodes.iter().map(|&p| map(deformation(t, p))).collect())
            });
            let family = undeformed.family_of(states).states_a_member(states_a_member);
            world.write(&format!("{kind}_{strength}"), &family);
        }
    }
    let loaded = world.study(25);
    (world, loaded)
}

/// Similarity of every run to the descriptor of the first, by both choices.
fn similarities(loaded: &Loaded, metric: Metric) -> Vec<(String, f64)> {
    let mut all = Vec::new();
    for select in [Select::Coordinates, Select::Difference] {
        let descriptor = described(loaded, "0_1", select, Threshold::Top(8)).descriptor;
        let options = SimilarityOptions { metric, ..Default::default() };
        let mut hits = search(loaded, &descriptor, options, Rows::Last).unwrap();
        hits.sort_by(|a, b| a.run.cmp(&b.run));
        all.extend(hits.into_iter().map(|hit| {
            let value = if metric == Metric::Euclidean { hit.score.distance } else { hit.score.similarity };
            (format!("{} {}", select.word(), hit.run), value)
        }));
    }
    all
}

fn same(a: &[(String, f64)], b: &[(String, f64)], factor: f64, tolerance: f64) {
    for ((name, a), (_, b)) in a.iter().zip(b) {
        assert!((factor * a - b).abs() <= tolerance, "{name}: {} and {b}", factor * a);
    }
    assert_eq!(a.len(), b.len());
}

fn groups(loaded: &Loaded, by: By) -> Vec<Vec<String>> {
    let options = ModesOptions { count: Some(3), by, ..Default::default() };
    let found = modes(&loaded.study, &options, &()).unwrap();
    found.modes.into_iter().map(|mode| mode.members).collect()
}

/// Everything that must be the same in two bundles of the same deformations.
fn agree(a: &Loaded, b: &Loaded, length: f64) {
    same(&similarities(a, Metric::Cosine), &similarities(b, Metric::Cosine), 1.0, 1e-4);
    // In mm, of displacements of tens of mm.
    same(&similarities(a, Metric::Euclidean), &similarities(b, Metric::Euclidean), length, 1e-3 * length);
    for by in [By::Displacement, By::Rotation] {
        assert_eq!(groups(a, by), groups(b, by), "{by:?}");
    }
    for rule in [Threshold::Energy(0.99), Threshold::Error(1.0 * length), Threshold::Std(1.0)] {
        let scaled = match rule {
            Threshold::Error(_) => Threshold::Error(1.0),
            other => other,
        };
        for select in [Select::Coordinates, Select::Difference] {
            let (a, b) = (described(a, "1_1", select, scaled), described(b, "1_1", select, rule));
            assert_eq!(a.descriptor.selected.eigenvectors, b.descriptor.selected.eigenvectors, "{select:?} {rule}");
            assert!(
                relative(length * a.descriptor.selected.errors.unwrap().rms, b.descriptor.selected.errors.unwrap().rms)
                    < 1e-3
            );
        }
    }
}

#[test]
fn scaling_the_model_scales_coefficients_by_the_square_and_changes_no_similarity() {
    let (_a, here) = bundle(|p| p, Model::clone, 3);
    let (_b, there) = bundle(|p| p.map(|x| 4.0 * x), Model::clone, 3);
    let rows = |loaded: &Loaded| loaded.study.coefficients(None, Rows::All).unwrap();
    let (a, b) = (rows(&here), rows(&there));
    let largest = a.values.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
    // The signs of eigenvectors are fixed by rule, so even they agree.
    assert!(a.values.iter().zip(&b.values).all(|(a, b)| (16.0 * a - b).abs() < 1e-4 * 16.0 * largest));
    assert!(here.basis.mass.iter().zip(&there.basis.mass).all(|(a, b)| relative(16.0 * a, *b) < 1e-12));
    assert!(
        here.basis.eigenvalues.iter().zip(&there.basis.eigenvalues).skip(1).all(|(a, b)| relative(a / 16.0, *b) < 1e-9)
    );
    agree(&here, &there, 4.0);
    for (a, b) in here.study.manifest().runs.values().zip(there.study.manifest().runs.values()) {
        assert!(
            relative(4.0 * a.last.rms, b.last.rms) < 1e-5 && (a.last.rigid_share - b.last.rigid_share).abs() < 1e-5
        );
    }
}

#[test]
fn numbering_and_files_change_nothing() {
    let (_a, here) = bundle(|p| p, Model::clone, 3);
    // 50 nodes, 72 shells: 7 divides neither.
    let (_b, reordered) = bundle(|p| p, |model| model.reordered(7), 3);
    let (_c, one_a_file) = bundle(|p| p, Model::clone, 1);
    let (_d, all_in_root) = bundle(|p| p, Model::clone, 0);
    for there in [&reordered, &one_a_file, &all_in_root] {
        agree(&here, there, 1.0);
    }
    // Another layout of the files is not even rounded otherwise.
    let rows = |loaded: &Loaded| loaded.study.coefficients(None, Rows::All).unwrap();
    assert_eq!(rows(&here), rows(&one_a_file));
    assert_eq!(rows(&here), rows(&all_in_root));
}

#[test]
fn a_run_that_numbers_its_nodes_otherwise_is_the_same_run() {
    let world = World::new();
    let deform = |t: f64, p: Point| bend(90.0, t)(p);
    world.write("a", &Model::strip().family(3, deform));
    world.write("b", &Model::strip().reordered(7).family(3, deform));
    let loaded = world.study(15);
    let rows = |run| loaded.study.coefficients(None, Rows::Run(run)).unwrap().values;
    assert_eq!(rows("a"), rows("b"));
    let content = |run| &loaded.study.record(run).unwrap().content;
    assert_eq!(content("a"), content("b"));
}

#[test]
fn turning_the_frame_keeps_lengths_of_triples_and_distances() {
    let turn = rotation(1.1);
    let (_a, here) = bundle(|p| p, Model::clone, 3);
    let (_b, there) = bundle(turn, Model::clone, 3);
    let rows = |loaded: &Loaded| loaded.study.coefficients(None, Rows::Last).unwrap();
    let (a, b) = (rows(&here), rows(&there));
    for row in 0..a.rows() {
        let size = energy(&triples(a.row(row))).sqrt();
        for (a, b) in triples(a.row(row)).iter().zip(triples(b.row(row))) {
            let length = |p: &Point| p.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((length(a) - length(&b)).abs() < 1e-4 * size);
            // And the triple turns with the frame; rounding may choose the other sign of the eigenvector where entries of
            // both signs are equally large.
            let turned = turn(*a);
            let with = |sign: f64| (0..3).all(|c| (sign * turned[c] - b[c]).abs() < 1e-4 * size);
            assert!(with(1.0) || with(-1.0), "{turned:?}, {b:?}");
        }
    }
    // `top` by largest component depends on the frame; all eigenvectors do not.
    for metric in [Metric::Cosine, Metric::Euclidean] {
        let scores = |loaded: &Loaded| -> Vec<f64> {
            let descriptor = described(loaded, "0_1", Select::Difference, Threshold::Top(25)).descriptor;
            let options = SimilarityOptions { metric, ..Default::default() };
            let mut hits = search(loaded, &descriptor, options, Rows::Last).unwrap();
            hits.sort_by(|a, b| a.run.cmp(&b.run));
            hits.iter().map(|hit| hit.score.distance).collect()
        };
        for (a, b) in scores(&here).iter().zip(scores(&there)) {
            assert!((a - b).abs() < 1e-4 * (1.0 + a.abs()), "{metric:?}: {a}, {b}");
        }
    }
    for by in [By::Displacement, By::Rotation] {
        assert_eq!(groups(&here, by), groups(&there, by), "{by:?}");
    }
}

#[test]
fn rounding_does_not_choose_the_diagonals_of_rectangles() {
    let triangles = |map: &dyn Fn(Point) -> Point| {
        let world = World::new();
        world.write("run", &Model::strip().moved(map).family(1, |_, p| p));
        let reference = world.empty_study("study", "run", 1).reference().unwrap();
        reference.mesh.triangles().to_vec()
    };
    let straight = triangles(&|p| p);
    let turn = rotation(0.4);
    // Positions of 100 mm are rounded to 4e-6 mm in a single-precision file: angles of a cell of 9 mm to 1e-6 rad.
    let turned = triangles(&turn);
    let other = straight.iter().zip(&turned).filter(|(a, b)| a != b).count();
    assert_eq!(other, 0, "{other} of {} triangles are others in a turned frame", straight.len());
}
