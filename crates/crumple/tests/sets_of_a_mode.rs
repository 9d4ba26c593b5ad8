//! A descriptor of a mode's members together says what the descriptors of the members say one by one.

mod world;

use crumple::descriptor::{DescribeOptions, Described, Select, Set, Threshold, describe};
use crumple::modes::{Mode, ModesOptions, modes, save};
use crumple::study::Loaded;
use crumple::target::Named;
use world::{Model, World, bend, described};

/// Eight runs that bend up or down, each with folds of its own, and the larger mode of the two.
fn world() -> (World, Loaded, Mode) {
    let world = World::new();
    let model = Model::beam(12, 3, 120.0, 30.0, 25.0);
    for run in 0..8 {
        let way = if run < 5 { 1.0 } else { -1.0 };
        let wave = 7.0 + f64::from(run);
        let deform = move |t: f64, p| {
            let [x, y, z] = bend(120.0, 0.6 * way * t)(p);
            [x, y + 6.0 * t * (x / wave).sin(), z + 6.0 * t * (x / (wave + 3.0)).cos()]
        };
        world.write(&format!("run_{run}"), &model.family(2, deform));
    }
    let loaded = world.study(80);
    let found = modes(&loaded.study, &ModesOptions { count: Some(2), ..Default::default() }, &()).unwrap();
    save(&loaded.study, &found).unwrap();
    let mode = found.modes[0].clone();
    assert_eq!(mode.members, ["run_0", "run_1", "run_2", "run_3", "run_4"]);
    (world, loaded, mode)
}

fn together(loaded: &Loaded, mode: &Mode, set: Set, select: Select, threshold: Threshold) -> Described {
    let medoid = Named { run: mode.medoid.clone(), state: None };
    let options = DescribeOptions { set, select, threshold, ..Default::default() };
    describe(loaded, &medoid, Some(&mode.name), None, &options).unwrap()
}

#[test]
fn a_share_keeps_what_matters_for_as_many_members_whatever_the_rule() {
    let (_world, loaded, mode) = world();
    for select in [Select::Coordinates, Select::Difference] {
        for rule in [Threshold::Std(1.0), Threshold::Top(9), Threshold::Energy(0.999), Threshold::Error(1.0)] {
            let each: Vec<Vec<usize>> = mode
                .members
                .iter()
                .map(|run| described(&loaded, run, select, rule).descriptor.selected.eigenvectors)
                .collect();
            // In coordinates the undeformed shape, which is the same for all, counts most.
            let differ = each.iter().any(|other| *other != each[0]);
            assert!(differ || select == Select::Coordinates, "{rule}: {each:?}");
            for share in [0.2, 0.6, 1.0] {
                let passes = |j: &usize| each.iter().filter(|own| own.contains(j)).count() as f64 >= share * 5.0;
                let expected: Vec<usize> = (1..=loaded.basis.eigenpairs()).filter(passes).collect();
                let found = together(&loaded, &mode, Set::Share(share), select, rule).descriptor.selected;
                assert_eq!(found.eigenvectors, expected, "{select:?} {rule} share {share}");
                let medoid = described(&loaded, &mode.medoid, select, rule).values;
                for (value, &j) in found.values.iter().zip(&found.eigenvectors) {
                    assert_eq!(value[..], medoid[j - 1], "the medoid's values");
                }
            }
        }
    }
}

#[test]
fn a_mean_has_the_mean_and_the_spread_of_its_members() {
    let (_world, loaded, mode) = world();
    for select in [Select::Coordinates, Select::Difference] {
        let rule = Threshold::Top(12);
        let each: Vec<Vec<[f64; 3]>> =
            mode.members.iter().map(|run| described(&loaded, run, select, rule).values).collect();
        let found = together(&loaded, &mode, Set::Mean, select, rule).descriptor.selected;
        assert_eq!((found.values.len(), found.spread.len()), (12, 12));
        for ((value, spread), &j) in found.values.iter().zip(&found.spread).zip(&found.eigenvectors) {
            for c in 0..3 {
                let of: Vec<f64> = each.iter().map(|values| values[j - 1][c]).collect();
                let mean = of.iter().sum::<f64>() / 5.0;
                let deviation = (of.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 5.0).sqrt();
                // Sums in another order, of values up to some thousands.
                assert!((value[c] - mean).abs() < 1e-9 && (spread[c] - deviation).abs() < 1e-6, "{select:?} {j} {c}");
            }
        }
    }
}
