//! Same bytes at any number of threads, stopping, progress, refusals, and nothing but a result or an error on any mesh.

mod zoo;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use mesh_spectrum::{
    EigenError, EigenOptions, Instructions, Mesh, OperatorOptions, Orthogonality, Seconds, Watch, eigenbasis, inspect,
    join, operator,
};
use proptest::prelude::*;
use zoo::{build, copies, rough};

#[test]
fn the_same_bytes_at_any_number_of_threads() {
    // Two components with one chain of slices each; one component with two chains.
    for (parts, count) in [(copies(&rough(40, 25), 2, 40.0), 200), (rough(60, 40), 500)] {
        let built = build(parts);
        let options = EigenOptions { count, ..Default::default() };
        let solve = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut basis = pool.install(|| eigenbasis(&built, &options, &()).unwrap());
            // What may differ: seconds, and the memory that so many threads need.
            (basis.certificate.seconds, basis.certificate.peak_bytes) = (Seconds::default(), 0);
            basis
        };
        let one = solve(1);
        for threads in [1, 2, 5] {
            let other = solve(threads);
            assert!(one.eigenvectors.iter().zip(&other.eigenvectors).all(|(a, b)| a.to_bits() == b.to_bits()));
            assert_eq!(one, other);
        }
    }
}

/// Stops when asked for the `at`-th time.
struct Stopper {
    asked: AtomicUsize,
    at: usize,
}

impl Watch for Stopper {
    fn stopped(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) + 1 >= self.at
    }
}

#[test]
fn stopping_stops() {
    let built = build(rough(60, 50));
    let options = EigenOptions { count: 400, ..Default::default() };
    let never = Stopper { asked: AtomicUsize::new(0), at: usize::MAX };
    let certificate = eigenbasis(&built, &options, &never).unwrap().certificate;
    let all = never.asked.into_inner();
    // Between two questions there is one factorisation or one solve with eight right-hand sides at most.
    let long = certificate.factorisations + certificate.solves / 8;
    assert!(all >= long, "asked {all} times in {long} steps");
    for at in [1, 3, 40, all / 4, all / 2, 3 * all / 4, all - 1, all] {
        let stopper = Stopper { asked: AtomicUsize::new(0), at };
        assert_eq!(eigenbasis(&built, &options, &stopper), Err(EigenError::Stopped));
        // Once told, it does not go on: at most every thread asks again, at a few places.
        let after = stopper.asked.load(Ordering::Relaxed) - at;
        assert!(after <= 16 * rayon::current_num_threads(), "asked {after} times more");
    }
}

struct Log(Mutex<Vec<(usize, usize)>>);

impl Watch for Log {
    fn step(&self, stage: &'static str, done: usize, total: usize) {
        assert_eq!(stage, "eigenpairs");
        self.0.lock().unwrap().push((done, total));
    }
    fn slices(&self, done: usize, expected: usize) {
        assert!(1 <= done && done <= expected);
    }
}

#[test]
fn progress_ends_at_its_total() {
    let log = Log(Mutex::new(Vec::new()));
    eigenbasis(&build(rough(30, 25)), &EigenOptions { count: 150, ..Default::default() }, &log).unwrap();
    let seen = log.0.into_inner().unwrap();
    assert!(seen.len() > 2 && seen.iter().all(|&(done, total)| done <= total && total == 150));
    assert_eq!(seen.last(), Some(&(150, 150)));
}

#[test]
fn options_out_of_range_are_refused() {
    let built = build(rough(3, 3));
    let none = EigenOptions { count: 0, ..Default::default() };
    assert!(matches!(eigenbasis(&built, &none, &()), Err(EigenError::Option { option: "count", .. })));
    for tolerance in [0.0, -1.0, f64::NAN, 1.0] {
        let options = EigenOptions { tolerance, ..Default::default() };
        assert!(matches!(eigenbasis(&built, &options, &()), Err(EigenError::Option { option: "tolerance", .. })));
    }
}

#[test]
fn another_seed_gives_the_same_spectrum() {
    let built = build(rough(40, 25));
    let solve = |seed| eigenbasis(&built, &EigenOptions { count: 120, seed, ..Default::default() }, &()).unwrap();
    let (a, b) = (solve(1), solve(2));
    assert!(zoo::distance(&a.eigenvalues, &b.eigenvalues) < 1e-11);
    assert!(zoo::subspace_distance(&a, &b, &built.vertex_mass, 1e-5) < 1e-9);
}

#[test]
fn a_loose_or_tight_tolerance_keeps_its_promises() {
    let built = build(rough(40, 25));
    let reference = zoo::solve(&built, 150).eigenvalues;
    for tolerance in [1e-3, 1e-6, 1e-12] {
        let basis = zoo::checked(&built, &EigenOptions { count: 150, tolerance, ..Default::default() });
        assert!(zoo::distance(&reference, &basis.eigenvalues) < 1e-9);
    }
}

#[test]
fn slivers_cost_digits_and_nothing_else() {
    // A vertex moved to 1e-3 .. 1e-9 of an edge: cotangents, and with them ‖A‖, of up to 1e9.
    for height in [1e-3, 1e-6, 1e-9] {
        let (mut vertices, triangles) = rough(30, 25);
        let [a, b] = [vertices[300], vertices[301]];
        vertices[332] = [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]) + if k == 2 { height } else { 0.0 });
        let built = build((vertices, triangles));
        match eigenbasis(&built, &EigenOptions { count: 100, ..Default::default() }, &()) {
            Ok(basis) => {
                let c = &basis.certificate;
                assert!(c.complete && c.residual_max <= c.residual_floor.max(1e-10), "{height}: {c:?}");
            }
            Err(error) => assert!(height < 1e-8, "{height}: {error}"),
        }
    }
}

/// Coordinates on a small lattice, so that points coincide and faces lose their area; a few are moved far off.
fn point() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        8 => [0..4i32, 0..4, 0..2].prop_map(|p| p.map(f64::from)),
        2 => [-1.0..1.0, -1.0..1.0, -1.0..1.0f64],
        1 => [-1e12..1e12, -1e-12..1e-12, 0.0..1e-300f64],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_small_mesh_gives_a_result_or_an_error(
        vertices in prop::collection::vec(point(), 3..14),
        faces in prop::collection::vec([0..14u32, 0..14, 0..14, 0..14], 1..24),
        distance in prop::option::of(0.01..20.0f64),
        count in 1..20usize,
    ) {
        let Ok(mesh) = Mesh::from_faces(vertices.clone(), &faces.iter().map(|f| f.map(|v| v % vertices.len() as u32)).collect::<Vec<_>>()) else {
            return Ok(());
        };
        let seen = inspect(&mesh);
        prop_assert!(seen.area >= 0.0 && seen.components >= 1 && seen.gap.is_none_or(|gap| gap > 0.0));
        if let Some(distance) = distance {
            prop_assert!(join(&mesh, distance).is_ok_and(|join| join.dofs + join.pairs >= vertices.len()) || distance > 0.01);
        }
        let Ok(built) = operator(&mesh, &OperatorOptions { join: distance, ..Default::default() }) else { return Ok(()) };
        match eigenbasis(&built, &EigenOptions { count, ..Default::default() }, &()) {
            Ok(basis) => {
                prop_assert!(basis.eigenvalues.iter().chain(&basis.eigenvectors).all(|x| x.is_finite()));
                prop_assert!(basis.eigenvalues.is_sorted() && basis.eigenvalues[0] == 0.0);
                prop_assert!(basis.certificate.orthogonality <= 1e-10);
            }
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}

#[test]
fn what_cannot_fit_is_refused_before_it_is_tried() {
    let built = build(rough(60, 50));
    let needed = eigenbasis(&built, &EigenOptions { count: 100, ..Default::default() }, &()).unwrap();
    let needed = needed.certificate.peak_bytes;
    // The result and a factor at least; not more than a few spaces of 500 columns.
    assert!((8 * 100 * 3111..100_000_000).contains(&needed), "{needed}");
    for limit in [1000, needed - 1] {
        let options = EigenOptions { count: 100, memory_limit: Some(limit), ..Default::default() };
        assert!(matches!(eigenbasis(&built, &options, &()), Err(EigenError::TooLittleMemory { .. })));
    }
    let enough = EigenOptions { count: 100, memory_limit: Some(needed), ..Default::default() };
    assert!(eigenbasis(&built, &enough, &()).is_ok());
}

#[test]
fn every_kind_of_instructions_gives_the_same_spectrum() {
    let built = build(rough(40, 25));
    let solve = |instructions| zoo::checked(&built, &EigenOptions { count: 150, instructions, ..Default::default() });
    let best = solve(Instructions::Best);
    for instructions in [Instructions::Avx2, Instructions::Portable] {
        let other = solve(instructions);
        assert!(zoo::distance(&best.eigenvalues, &other.eigenvalues) < 1e-11);
        assert!(zoo::subspace_distance(&best, &other, &built.vertex_mass, 1e-5) < 1e-9);
    }
}

#[test]
fn full_orthogonality_is_full() {
    let built = build(rough(60, 50));
    let options = EigenOptions { count: 300, orthogonality: Orthogonality::Full, ..Default::default() };
    assert!(zoo::checked(&built, &options).certificate.orthogonality <= 1e-12);
}
