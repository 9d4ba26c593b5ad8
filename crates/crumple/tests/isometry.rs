//! Laws of the strains and of the eigenvalue shift: nothing where a surface bends, the stretch itself where it stretches.

mod world;

use crumple::Error;
use crumple::basis::BasisOptions;
use crumple::isometry::{caveat, isometry, shift};
use crumple::joints::Join;
use crumple::study::{AddOptions, Loaded, Study};
use crumple::target::{Named, resolve};
use world::{Model, World, bend};

fn named(run: &str) -> Named {
    Named::parse(run)
}

#[test]
fn a_bent_plate_keeps_its_eigenvalues_and_a_stretched_one_does_not() {
    let world = World::new();
    let model = Model::plate(30, 10, 90.0, 37.0);
    world.write("bent", &model.family(3, |t, p| bend(90.0, 1.2 * t)(p)));
    world.write("grown", &model.family(3, |t, p| p.map(|x| (1.0 + 0.2 * t) * x)));
    let loaded = world.study(40);
    let of = |run: &str| {
        let target = resolve(&loaded, &named(run)).unwrap();
        let found = isometry(&loaded, &named(run), &target).unwrap();
        (found, shift(&loaded, &named(run), &target, 20, &()).unwrap())
    };
    // Chords of 3 mm on a radius of 75 mm are 7e-5 shorter than their arcs, and files are in single precision.
    let (bent, shifted) = of("bent");
    assert!(bent.edges.max < 1e-3 && bent.areas.max < 1e-3, "{bent:?}");
    assert!(shifted.max < 1e-3 && shifted.count == 20, "{shifted:?}");
    assert!(caveat(bent.edges.p95).is_none());
    // All lengths × 1.2: λ is in 1/length².
    let (grown, shifted) = of("grown");
    for strain in [grown.edges.median, grown.edges.p95, grown.edges.max] {
        assert!((strain - 0.2).abs() < 1e-5, "{grown:?}");
    }
    assert!((grown.areas.p95 - 0.44).abs() < 1e-5, "{grown:?}");
    assert!((shifted.mean - (1.0 / 1.44 - 1.0)).abs() < 1e-5 && shifted.max - shifted.median < 1e-5, "{shifted:?}");
    assert!(caveat(grown.edges.p95).is_some());
    // Nothing has happened yet.
    let (start, shifted) = of("grown@0");
    assert!(start.edges.max < 1e-6 && shifted.max < 1e-5, "{start:?} {shifted:?}");
}

#[test]
fn sheets_stay_joined_where_they_were_joined_undeformed() {
    let world = World::new();
    let lower = Model::plate(12, 6, 60.0, 31.0);
    let upper = lower.clone().moved(|[x, y, z]| [x, y, z + 1.0]);
    // The sheets come apart by far more than the distance that joins them, without any strain.
    let apart = move |t: f64, [x, y, z]: [f64; 3]| [x, y, if z > 0.5 { z + 40.0 * t } else { z }];
    world.write("apart", &lower.and(upper).family(2, apart));
    let options = BasisOptions { eigenpairs: 30, join: Some(Join::Distance(2.0)), ..Default::default() };
    let mut study = Study::create(&world.path("study"), &world.open("apart"), &[], &[], &options, &()).unwrap();
    study.add(&world.found(), AddOptions::default(), &()).unwrap();
    let loaded = Loaded::of(study).unwrap();
    let target = resolve(&loaded, &named("apart")).unwrap();
    assert_eq!(loaded.basis.facts.null_space, 1);
    let shifted = shift(&loaded, &named("apart"), &target, 25, &()).unwrap();
    assert!(shifted.max < 1e-6, "{shifted:?}");
    for count in [0, 30, 1000] {
        let refused = shift(&loaded, &named("apart"), &target, count, &());
        assert!(matches!(refused, Err(Error::Value { name: "--eigenvalues", .. })), "{count}");
    }
}
