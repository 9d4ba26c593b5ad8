//! Laws of the threshold rules on real coefficients: monotone, exact in number, reached, and minimal.
//!
//! "Minimal" is judged by the reconstruction that is really made, not by Parseval: one eigenvector less, in the order
//! of magnitude, and the wanted error is missed.

mod world;

use crumple::compare::compare;
use crumple::descriptor::{Select, Threshold};
use crumple::inputs::Table;
use crumple::reconstruct::{errors, reconstruct};
use crumple::study::Loaded;
use crumple::target::{Named, resolve, shape};
use world::{Model, Point, World, bend, described, energy};

const SELECTS: [Select; 2] = [Select::Coordinates, Select::Difference];

/// A crumpled beam: every eigenvector has something to say.
fn crumple(seed: f64) -> impl Fn(f64, Point) -> Point + Copy {
    move |t, [x, y, z]| {
        let [x, y, z] = bend(120.0, 0.8 * t)([x, y, z]);
        [
            x - 8.0 * t * (x / (11.0 + seed)).sin(),
            y + 5.0 * t * ((x + y) / (7.0 + seed)).cos(),
            z + 6.0 * t * (x / 5.0).sin() * (y / (9.0 + seed)).cos(),
        ]
    }
}

fn world() -> (World, Loaded) {
    let world = World::new();
    let model = Model::beam(12, 3, 120.0, 30.0, 25.0);
    for run in 0..4 {
        world.write(&format!("run_{run}"), &model.family(3, crumple(f64::from(run))));
    }
    let loaded = world.study(60);
    (world, loaded)
}

/// Eigenvectors by falling largest component of their values, as the paper orders them.
fn by_magnitude(values: &[Point]) -> Vec<usize> {
    let largest = |j: usize| values[j - 1].iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut order: Vec<usize> = (1..=values.len()).collect();
    order.sort_by(|&a, &b| largest(b).total_cmp(&largest(a)).then(a.cmp(&b)));
    order
}

#[test]
fn a_higher_threshold_keeps_a_part_of_what_a_lower_one_keeps() {
    let (_world, loaded) = world();
    for select in SELECTS {
        for rule in [Threshold::Std as fn(f64) -> Threshold, Threshold::Mean] {
            let kept: Vec<Vec<usize>> = [0.25, 0.5, 1.0, 1.5, 2.0, 3.0]
                .into_iter()
                .map(|c| described(&loaded, "run_1", select, rule(c)).descriptor.selected.eigenvectors)
                .collect();
            for (more, fewer) in kept.iter().zip(&kept[1..]) {
                assert!(fewer.iter().all(|j| more.contains(j)), "{select:?}: {fewer:?} of {more:?}");
            }
            assert!(kept[0].len() > kept[5].len());
        }
    }
}

#[test]
fn every_rule_keeps_exactly_what_passes_and_completes_triples() {
    let (_world, loaded) = world();
    for select in SELECTS {
        for rule in [Threshold::Std(1.0), Threshold::Mean(2.0), Threshold::Value(50.0)] {
            let found = described(&loaded, "run_2", select, rule);
            let t = found.descriptor.selected.threshold;
            for j in 1..=loaded.basis.eigenpairs() {
                let passes = found.values[j - 1].iter().any(|x| x.abs() > t);
                assert_eq!(
                    found.descriptor.selected.eigenvectors.contains(&j),
                    passes,
                    "{select:?} {rule}, eigenvector {j}"
                );
            }
            let values: Vec<Point> =
                found.descriptor.selected.eigenvectors.iter().map(|&j| found.values[j - 1]).collect();
            assert_eq!(
                found.descriptor.selected.values.iter().map(|value| [value[0], value[1], value[2]]).collect::<Vec<_>>(),
                values
            );
        }
        let magnitudes: Vec<f64> =
            described(&loaded, "run_2", select, Threshold::Std(1.0)).values.iter().flatten().map(|x| x.abs()).collect();
        let mean = magnitudes.iter().sum::<f64>() / magnitudes.len() as f64;
        let spread = (magnitudes.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / magnitudes.len() as f64).sqrt();
        let t = described(&loaded, "run_2", select, Threshold::Std(1.0)).descriptor.selected.threshold;
        assert!((t - mean - spread).abs() < 1e-12 * t, "the paper's t: mean + standard deviation of all 3K magnitudes");
    }
}

#[test]
fn top_keeps_as_many_as_it_says() {
    let (_world, loaded) = world();
    for select in SELECTS {
        for m in [1, 2, 7, 59, 60] {
            let found = described(&loaded, "run_3", select, Threshold::Top(m));
            assert_eq!(found.descriptor.selected.eigenvectors.len(), m);
            let mut expected = by_magnitude(&found.values)[..m].to_vec();
            expected.sort_unstable();
            assert_eq!(found.descriptor.selected.eigenvectors, expected);
        }
    }
}

#[test]
fn energy_is_reached_and_not_with_one_eigenvector_less() {
    let (_world, loaded) = world();
    for select in SELECTS {
        for share in [0.5, 0.9, 0.99, 0.9999, 1.0] {
            let found = described(&loaded, "run_1", select, Threshold::Energy(share));
            let total = energy(&found.values);
            let order = by_magnitude(&found.values);
            let m = found.descriptor.selected.eigenvectors.len();
            let held = |m: usize| order[..m].iter().map(|&j| energy(&[found.values[j - 1]])).sum::<f64>() / total;
            assert!(held(m) >= share - 1e-12 && (m == 1 || held(m - 1) < share), "{share}: {} by {m}", held(m));
        }
    }
}

#[test]
fn an_error_is_reached_and_not_with_one_eigenvector_less() {
    let (_world, loaded) = world();
    let named = Named::parse("run_2");
    let target = resolve(&loaded, &named).unwrap();
    let original = shape(&loaded, &named, &target).unwrap();
    let rms = |select: Select, kept: &[usize]| {
        let made = reconstruct(&loaded.reference, &loaded.basis, select, kept, &target.delta);
        errors(&loaded.reference, &loaded.basis, &original, &made).rms
    };
    for select in SELECTS {
        for wanted in [1.8, 2.0, 2.5, 3.0, 5.0] {
            let found = described(&loaded, "run_2", select, Threshold::Error(wanted)).descriptor.selected;
            let stated = found.errors.unwrap().rms;
            let m = found.eigenvectors.len();
            // The choice is made by Parseval and the basis is rounded to f32: 1e-6 of the shape's size, 1e-4 mm.
            assert!(rms(select, &found.eigenvectors) <= wanted + 1e-4, "{select:?} {wanted}: {stated}");
            assert_eq!(stated, rms(select, &found.eigenvectors));
            let order = by_magnitude(&select.values(&loaded.basis, &target.delta));
            assert!(m == 1 || rms(select, &order[..m - 1]) > wanted - 1e-4, "{select:?} {wanted}: {m} are too many");
        }
    }
}

#[test]
fn what_cannot_be_reached_is_an_error_that_says_what_can() {
    let (_world, loaded) = world();
    let options = crumple::descriptor::DescribeOptions { threshold: Threshold::Error(1e-9), ..Default::default() };
    let error = crumple::descriptor::describe(&loaded, &Named::parse("run_1"), None, None, &options).unwrap_err();
    assert!(matches!(error, crumple::Error::Threshold { .. }) && error.to_string().contains("60"), "{error}");
}

#[test]
fn a_rule_made_in_code_is_checked_like_one_that_is_typed() {
    // `top:0` is refused by the parser; the same rule as a value must not panic.
    let values = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    let none = |_: &[usize], _: usize| 0.0;
    for rule in [Threshold::Top(0), Threshold::Energy(f64::NAN), Threshold::Std(f64::NAN), Threshold::Error(f64::NAN)] {
        let found = std::panic::catch_unwind(|| rule.select(&values, 3, false, none));
        assert!(matches!(found, Ok(Err(crumple::Error::Threshold { .. }))), "{rule}: {found:?}");
    }
    let nothing = std::panic::catch_unwind(|| Threshold::Energy(0.5).select(&[], 3, false, none));
    assert!(matches!(nothing, Ok(Err(_))), "no coefficients at all: {nothing:?}");
}

#[test]
fn compare_and_describe_choose_alike() {
    // `error:MM` and `top:M` with the M that it leads to are the same choice of eigenvectors for the query, so all that
    // `compare` says of the query's own ranking is the same.
    let world = World::new();
    let model = Model::beam(12, 3, 120.0, 30.0, 25.0);
    for run in 0..14 {
        let (seed, kind) = (f64::from(run), run % 2);
        let deform = move |t: f64, p: Point| {
            let [x, y, z] = crumple(seed)(0.4 * t, p);
            let way = if kind == 0 { 1.0 } else { -1.0 };
            [x, y, z + way * 3.0 * t * (x / 20.0).sin() + 4.0 * t * (x * (1.0 + 0.3 * seed) / 9.0).sin()]
        };
        world.write(&format!("run_{run:02}"), &model.family(2, deform));
    }
    let loaded = world.study(120);
    let labels = world.path("labels.csv");
    let rows: String = (0..14).map(|run| format!("run_{run:02},{}\n", ["even", "odd"][run % 2])).collect();
    std::fs::write(&labels, format!("run,label\n{rows}")).unwrap();
    let table = Table::read(&labels).unwrap();
    for wanted in [1.5, 2.5, 4.0] {
        let by_error = compare(&loaded, Some(&table), Threshold::Error(wanted)).unwrap();
        for row in by_error.rows.iter().filter(|row| row.method == "descriptor") {
            let by_size = compare(&loaded, Some(&table), Threshold::Top(row.size)).unwrap();
            let other = by_size
                .rows
                .iter()
                .find(|other| other.label == row.label && other.select == row.select && other.method == "descriptor")
                .unwrap();
            assert_eq!(row.size, other.size);
            assert_eq!(row.rms, other.rms);
            assert_eq!(
                (&row.nearest, row.average_precision),
                (&other.nearest, other.average_precision),
                "error:{wanted}, {}, {}: the {} eigenvectors that rank are not those that describe",
                row.label,
                row.select,
                row.size
            );
        }
    }
}
