//! Law: coefficients lose nothing but what lies beyond K. Parseval, and the shape that comes back from all of them.
//!
//! Tolerances: the basis and δ are stored as f32 (half a unit in the last place: 6e-8 relative), and Φᵀ M Φ = I then
//! holds to about 6e-8 √N for the sum of N roundings that do not know of each other; 1e-6 leaves a factor of two and more.

mod world;

use crumple::basis::{Basis, BasisOptions, coefficients, synthesize};
use crumple::project::project;
use crumple::reference::Reference;
use crumple::rotation::Ruler;
use crumple::study::{Rows, Study};
use crumple::{Kind, Mass};
use world::{Model, Point, World, bend, energy, noise, relative, rms, rotation, square_distance, triples};

const TOLERANCE: f64 = 1e-6;

/// Models with one component, with a closed surface, with edges, and with two components.
fn models() -> Vec<(&'static str, Model)> {
    vec![
        ("plate", Model::strip()),
        ("tube", Model::tube(12, 5, 20.0, 100.0)),
        ("beam", Model::beam(8, 2, 120.0, 30.0, 25.0)),
        ("two sheets", Model::strip().and(Model::plate(5, 3, 60.0, 31.0).moved(|[x, y, z]| [x, y, z + 9.0]))),
    ]
}

/// Bends, twists and stretches: no component of the displacement is small.
fn wild(t: f64, p: Point) -> Point {
    let [x, y, z] = rotation(0.4 * t)(bend(100.0, 1.2 * t)(p));
    [x + 3.0 * t * (y / 9.0).sin(), y * (1.0 - 0.2 * t), z + 5.0 * t * (x / 17.0).cos()]
}

fn projected_with(
    model: &Model,
    eigenpairs: usize,
) -> (World, Reference, Basis, Vec<Vec<Point>>, crumple::project::Projected) {
    let world = World::new();
    world.write("run", &model.family(4, wild));
    let study = world.empty_study("study", "run", eigenpairs);
    let (reference, basis, run) = (study.reference().unwrap(), study.basis().unwrap(), world.open("run"));
    let placement = reference.place(&run).unwrap();
    let shapes = (0..4).map(|state| reference.shape(&run, &placement, state).unwrap()).collect();
    let projected = project(&run, &reference, &basis, &[], &()).unwrap();
    (world, reference, basis, shapes, projected)
}

#[test]
fn all_coefficients_hold_the_whole_displacement() {
    for (name, model) in models() {
        let (_world, reference, basis, shapes, projected) = projected_with(&model, usize::MAX);
        let p0 = reference.mesh.vertices();
        assert_eq!(basis.eigenpairs(), basis.vertices(), "{name}");
        for (shape, state) in shapes.iter().zip(&projected.states) {
            let norm = square_distance(&basis.mass, shape, p0);
            let caught = energy(&triples(&state.delta));
            assert!((caught - norm).abs() <= TOLERANCE * norm, "{name}: Σ δ² = {caught}, ‖d‖² = {norm}");
            assert!((state.measures.captured - 1.0).abs() <= TOLERANCE, "{name}: {}", state.measures.captured);
            assert!(relative(state.measures.rms, (norm / basis.facts.area).sqrt()) <= TOLERANCE || norm == 0.0);
        }
        // The undeformed shape itself.
        let norm = square_distance(&basis.mass, p0, &vec![[0.0; 3]; p0.len()]);
        assert!(relative(energy(&basis.baseline), norm) <= TOLERANCE, "{name}");
    }
}

#[test]
fn the_captured_share_is_one_minus_what_is_left() {
    for (name, model) in models() {
        for eigenpairs in [1, 5, 20] {
            let (_world, reference, basis, shapes, projected) = projected_with(&model, eigenpairs);
            let all: Vec<usize> = (1..=basis.eigenpairs()).collect();
            for (shape, state) in shapes.iter().zip(&projected.states).skip(1) {
                let p0 = reference.mesh.vertices();
                let made = synthesize(&basis, &all, &triples(&state.delta));
                let band: Vec<Point> = made.iter().zip(p0).map(|(d, p)| [0, 1, 2].map(|c| p[c] + d[c])).collect();
                let rest = square_distance(&basis.mass, shape, &band) / square_distance(&basis.mass, shape, p0);
                let captured = state.measures.captured;
                assert!((captured - (1.0 - rest)).abs() <= TOLERANCE, "{name}, K = {eigenpairs}: {captured}, {rest}");
            }
        }
    }
}

#[test]
fn a_state_without_displacement_is_captured_and_has_no_coefficients() {
    let (_world, .., projected) = projected_with(&Model::strip(), 7);
    let first = &projected.states[0];
    assert!(first.delta.iter().all(|&x| x == 0.0));
    assert_eq!((first.measures.captured, first.measures.rms, first.measures.rigid_share), (1.0, 0.0, 0.0));
}

#[test]
fn projecting_and_making_again_gives_the_shape_back() {
    for (name, model) in models() {
        let (_world, reference, basis, shapes, projected) = projected_with(&model, usize::MAX);
        let (p0, all) = (reference.mesh.vertices(), (1..=basis.eigenpairs()).collect::<Vec<_>>());
        for (shape, state) in shapes.iter().zip(&projected.states) {
            let delta = triples(&state.delta);
            for select in [crumple::descriptor::Select::Coordinates, crumple::descriptor::Select::Difference] {
                let made = crumple::reconstruct::reconstruct(&reference, &basis, select, &all, &delta);
                // Relative to the size of what is made of rounded numbers: the shape itself, or the displacement.
                let size = match select {
                    crumple::descriptor::Select::Coordinates => rms(&basis.mass, shape, &vec![[0.0; 3]; p0.len()]),
                    crumple::descriptor::Select::Difference => rms(&basis.mass, shape, p0),
                };
                let error = rms(&basis.mass, shape, &made);
                assert!(error <= TOLERANCE * size, "{name}, {select:?}: {error} of {size}");
            }
        }
    }
}

#[test]
fn coefficients_of_an_eigenvector_are_a_unit_vector() {
    for (name, model) in models() {
        let world = World::new();
        world.write("run", &model.family(1, |_, p| p));
        let study = world.empty_study("study", "run", 15);
        let basis = study.basis().unwrap();
        for j in 1..=basis.eigenpairs() {
            // A different multiple in each component.
            let field: Vec<Point> =
                basis.eigenvector(j).iter().map(|&x| [1.0, -2.0, 0.5].map(|s| s * f64::from(x))).collect();
            for (i, alpha) in coefficients(&basis, &field).iter().enumerate() {
                let expected = if i + 1 == j { [1.0, -2.0, 0.5] } else { [0.0; 3] };
                let error = (0..3).map(|c| (alpha[c] - expected[c]).abs()).fold(0.0, f64::max);
                assert!(error <= TOLERANCE, "{name}: coefficient {} of eigenvector {j} is {alpha:?}", i + 1);
            }
        }
    }
}

#[test]
fn projection_does_not_depend_on_how_states_are_batched() {
    // More vertices than a block (512) and more states than one; every state must be as if it were alone.
    let model = Model::plate(40, 14, 200.0, 71.0);
    let world = World::new();
    world.write("run", &model.family(5, wild));
    let loaded = world.study(12);
    let rows = loaded.study.coefficients(None, Rows::All).unwrap();
    let run = world.open("run");
    let placement = loaded.reference.place(&run).unwrap();
    for state in 0..5 {
        let shape = loaded.reference.shape(&run, &placement, state).unwrap();
        let displacement: Vec<Point> =
            shape.iter().zip(loaded.reference.mesh.vertices()).map(|(p, q)| [0, 1, 2].map(|c| p[c] - q[c])).collect();
        let size = energy(&coefficients(&loaded.basis, &displacement)).sqrt();
        let alone = coefficients(&loaded.basis, &displacement);
        for (j, (a, b)) in alone.iter().zip(triples(rows.row(state))).enumerate() {
            // Φᵀ M d as it is written down, without blocks.
            let plain: Point = std::array::from_fn(|c| {
                let phi = loaded.basis.eigenvector(j + 1);
                (0..phi.len()).map(|v| f64::from(phi[v]) * loaded.basis.mass[v] * displacement[v][c]).sum()
            });
            for c in 0..3 {
                // f64 sums of 615 terms; then f32.
                assert!((a[c] - plain[c]).abs() <= 1e-12 * size.max(1.0), "state {state}, eigenvector {}", j + 1);
                assert!((b[c] - plain[c]).abs() <= 1e-7 * plain[c].abs() + 1e-12 * size);
            }
        }
    }
}

#[test]
fn noise_is_held_as_well_as_a_smooth_shape() {
    let model = Model::strip();
    let mut random = noise(3);
    let nodes: Vec<Point> = model.nodes.iter().map(|p| p.map(|x| x + random())).collect();
    let world = World::new();
    world.write("run", &model.family_of([(0.0, nodes)]));
    let loaded = world.study(usize::MAX);
    let rows = loaded.study.coefficients(None, Rows::Last).unwrap();
    let record = loaded.study.record("run").unwrap();
    assert!((record.last.captured - 1.0).abs() <= TOLERANCE);
    let area = loaded.basis.facts.area;
    assert!(relative((energy(&triples(rows.row(0))) / area).sqrt(), record.last.rms) <= TOLERANCE);
}

#[test]
fn coefficients_and_what_is_compared_with_them_have_the_same_mass() {
    // Cells from 3 to 21 mm long: a mean over vertices is not a mean over the area.
    let graded = Model::strip().moved(|[x, y, z]| [x * x / 90.0 + 0.2 * x, y, z]);
    let world = World::new();
    world.write("run", &graded.family(4, wild));
    for kind in [Kind::Cotan, Kind::Tufted, Kind::Polygon] {
        let mut rms: Vec<f64> = Vec::new();
        for mass in [Mass::Lumped, Mass::Consistent, Mass::Identity] {
            let name = format!("{kind}-{mass}");
            let options = BasisOptions { eigenpairs: usize::MAX, kind, mass, ..Default::default() };
            let run = world.open("run");
            let study = Study::create(&world.path(&name), &run, &[], &[], &options, &()).unwrap();
            let (reference, basis) = (study.reference().unwrap(), study.basis().unwrap());
            let last = project(&run, &reference, &basis, &[], &()).unwrap().states.pop().unwrap();
            assert!((last.measures.captured - 1.0).abs() <= TOLERANCE, "{name}: {}", last.measures.captured);
            let turned = last.measures.turn.powi(2) * basis.total_mass();
            assert!(relative(energy(&triples(&last.rotation)), turned) <= TOLERANCE, "{name}: all of the rotation");
            let spectrum = Ruler::of(&basis).spectrum(&triples(&last.rotation), last.measures.turn);
            assert!(spectrum.octaves.iter().sum::<f64>() <= 1.0 + TOLERANCE, "{name}: {:?}", spectrum.octaves);
            // Lengths are means over the surface, whatever the mass.
            rms.push(last.measures.rms);
            let shape = reference.shape(&run, &reference.place(&run).unwrap(), 3).unwrap();
            let errors = crumple::reconstruct::errors(&reference, &basis, &shape, reference.mesh.vertices());
            assert!(relative(errors.rms, last.measures.rms) <= 1e-12, "{name}");
            assert!(relative(basis.area.iter().sum(), basis.facts.area) < 1e-9, "{name}");
            if mass == Mass::Identity {
                assert!(basis.mass.iter().all(|&mass| mass == 1.0));
                let by_vertex = (energy(&triples(&last.delta)) / basis.total_mass()).sqrt();
                assert!(relative(by_vertex, last.measures.rms) > 0.01, "{name}: the mesh is one where it matters");
            }
        }
        assert!(rms.iter().all(|other| relative(*other, rms[0]) < 1e-12), "{kind}: {rms:?}");
    }
}
