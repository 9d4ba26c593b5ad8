//! Laws of modes: the groups are those that a plain implementation finds, in any order of the runs, with evidence that
//! is what it says.
//!
//! Judged by displacement, where a distance is the M-weighted RMS distance of two shapes: the brute force here works on
//! the shapes themselves, so it shares no code with the coefficients.

mod world;

use std::collections::BTreeSet;

use crumple::modes::{By, Membership, Method, Modes, ModesOptions, adjusted_rand_index, load, modes, save};
use crumple::study::{AddOptions, Loaded};
use proptest::prelude::*;
use world::{Model, Point, World, bend, cases, noise, rms};

const METHODS: [Method; 3] = [Method::KMeans, Method::Ward, Method::Average];

fn found(loaded: &Loaded, count: Option<usize>, method: Method) -> Modes {
    let options = ModesOptions { count, method, by: By::Displacement, ..Default::default() };
    modes(&loaded.study, &options, &()).unwrap()
}

/// Shapes with `noise` mm of noise, all K = N coefficients.
fn scattered(
    runs: usize,
    seed: u64,
    place: impl Fn(usize, Point) -> Point,
    noise_mm: f64,
) -> (World, Loaded, Vec<Vec<Point>>) {
    let world = World::new();
    let model = Model::plate(3, 2, 30.0, 17.0);
    let mut random = noise(seed);
    for run in 0..runs {
        let nodes = model.nodes.iter().map(|&p| place(run, p).map(|x| x + noise_mm * random())).collect();
        world.write(&format!("run_{run:02}"), &model.family_of([(1.0, nodes)]));
    }
    let loaded = world.study(usize::MAX);
    let shapes = (0..runs)
        .map(|run| {
            let run = world.open(&format!("run_{run:02}"));
            loaded.reference.shape(&run, &loaded.reference.place(&run).unwrap(), 0).unwrap()
        })
        .collect();
    (world, loaded, shapes)
}

fn distances(loaded: &Loaded, shapes: &[Vec<Point>]) -> Vec<Vec<f64>> {
    shapes.iter().map(|a| shapes.iter().map(|b| rms(&loaded.basis.mass, a, b)).collect()).collect()
}

/// Modes as sets of run numbers.
fn sets(modes: &Modes) -> BTreeSet<BTreeSet<usize>> {
    let number = |run: &String| run[4..].parse().unwrap();
    modes.modes.iter().map(|mode| mode.members.iter().map(number).collect()).collect()
}

/// Merges the two nearest groups until `count` are left, every distance computed anew from its definition: O(R³) and worse.
fn naive(shapes: &[Vec<Point>], mass: &[f64], count: usize, ward: bool) -> BTreeSet<BTreeSet<usize>> {
    let mut groups: Vec<Vec<usize>> = (0..shapes.len()).map(|run| vec![run]).collect();
    let mean = |group: &[usize]| -> Vec<Point> {
        (0..mass.len())
            .map(|v| {
                std::array::from_fn(|c| group.iter().map(|&run| shapes[run][v][c]).sum::<f64>() / group.len() as f64)
            })
            .collect()
    };
    let distance = |a: &[usize], b: &[usize]| {
        if ward {
            // The growth of the sum of squares.
            let (na, nb) = (a.len() as f64, b.len() as f64);
            na * nb / (na + nb) * rms(mass, &mean(a), &mean(b)).powi(2)
        } else {
            let sum: f64 = a.iter().flat_map(|&a| b.iter().map(move |&b| rms(mass, &shapes[a], &shapes[b]))).sum();
            sum / (a.len() * b.len()) as f64
        }
    };
    while groups.len() > count {
        let pairs = (0..groups.len()).flat_map(|a| (a + 1..groups.len()).map(move |b| (a, b)));
        let nearest =
            pairs.min_by(|x, y| distance(&groups[x.0], &groups[x.1]).total_cmp(&distance(&groups[y.0], &groups[y.1])));
        let (a, b) = nearest.unwrap();
        let gone = groups.remove(b);
        groups[a].extend(gone);
    }
    groups.into_iter().map(|group| group.into_iter().collect()).collect()
}

proptest! {
    #![proptest_config(cases(12))]
    #[test]
    fn agglomeration_is_that_of_the_plain_definition(seed in 0_u64..1000, runs in 4_usize..12) {
        let (_world, loaded, shapes) = scattered(runs, seed, |_, p| p, 5.0);
        for count in 1..=runs {
            for (method, ward) in [(Method::Ward, true), (Method::Average, false)] {
                let plain = naive(&shapes, &loaded.basis.mass, count, ward);
                prop_assert_eq!(sets(&found(&loaded, Some(count), method)), plain, "{:?}, {} of {}", method, count, runs);
            }
        }
    }
}

#[test]
fn evidence_is_what_it_says() {
    let (_world, loaded, shapes) = scattered(14, 9, |run, p| [p[0], p[1], p[2] + 6.0 * (run % 3) as f64], 4.0);
    let distances = distances(&loaded, &shapes);
    let number = |run: &str| -> usize { run[4..].parse().unwrap() };
    for method in METHODS {
        for count in [2, 3, 5] {
            let modes = found(&loaded, Some(count), method);
            let group = |run: usize| {
                modes.modes.iter().position(|mode| Some(&mode.name) == modes.runs[run].mode.as_ref()).unwrap()
            };
            let mean_to = |run: usize, mode: usize| {
                let others: Vec<usize> = (0..14).filter(|&other| other != run && group(other) == mode).collect();
                others.iter().map(|&other| distances[run][other]).sum::<f64>() / others.len() as f64
            };
            for (run, from_run) in distances.iter().enumerate() {
                let own = group(run);
                let others = (0..modes.modes.len()).filter(|&mode| mode != own);
                let (a, b) = (mean_to(run, own), others.map(|mode| mean_to(run, mode)).fold(f64::INFINITY, f64::min));
                let silhouette = if a.is_nan() { 0.0 } else { (b - a) / a.max(b) };
                // Distances are kept as f32 of f32 coefficients.
                let told = modes.runs[run].silhouette.unwrap();
                assert!((told - silhouette).abs() < 1e-5, "{method:?} {count}, run {run}: {told} and {silhouette}");
                let to_medoid = from_run[number(&modes.modes[own].medoid)];
                assert!((modes.runs[run].distance.unwrap() - to_medoid).abs() < 1e-5 * (1.0 + to_medoid));
            }
            for (at, mode) in modes.modes.iter().enumerate() {
                let members: Vec<usize> = (0..14).filter(|&run| group(run) == at).collect();
                assert_eq!(mode.members.iter().map(|run| number(run)).collect::<Vec<_>>(), members);
                let total = |run: usize| members.iter().map(|&other| distances[run][other]).sum::<f64>();
                let least = members.iter().map(|&run| total(run)).fold(f64::INFINITY, f64::min);
                assert!(
                    total(number(&mode.medoid)) <= least + 1e-4,
                    "{} is not in the middle of {}",
                    mode.medoid,
                    mode.name
                );
                let mean: Vec<Point> = (0..shapes[0].len())
                    .map(|v| {
                        let sum = |c: usize| members.iter().map(|&run| shapes[run][v][c]).sum::<f64>();
                        std::array::from_fn(|c| sum(c) / members.len() as f64)
                    })
                    .collect();
                let squares: f64 =
                    members.iter().map(|&run| rms(&loaded.basis.mass, &shapes[run], &mean).powi(2)).sum();
                assert!((mode.spread - (squares / members.len() as f64).sqrt()).abs() < 1e-4);
            }
            let sizes: Vec<usize> = modes.modes.iter().map(|mode| mode.members.len()).collect();
            assert!(sizes.windows(2).all(|pair| pair[0] >= pair[1]), "largest first: {sizes:?}");
        }
    }
}

#[test]
fn one_mode_is_all_runs_and_as_many_modes_as_runs_are_the_runs() {
    let (_world, loaded, _) = scattered(7, 4, |_, p| p, 5.0);
    for method in METHODS {
        let one = found(&loaded, Some(1), method);
        assert_eq!((one.modes.len(), one.modes[0].members.len()), (1, 7));
        assert!(one.runs.iter().all(|run| run.silhouette == Some(0.0)));
        let all = found(&loaded, Some(7), method);
        assert_eq!(all.modes.len(), 7, "{method:?}");
        assert!(all.modes.iter().all(|mode| mode.members == [mode.medoid.clone()] && mode.spread < 1e-5));
        for count in [0, 8] {
            let options = ModesOptions { count: Some(count), method, ..Default::default() };
            assert!(matches!(modes(&loaded.study, &options, &()), Err(crumple::Error::Value { .. })));
        }
    }
}

/// Three kinds of deformation of different strength.
fn kinds(run: usize) -> impl Fn(f64, Point) -> Point {
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

/// The number in a mode's name.
fn group_of(run: &Membership) -> usize {
    run.mode.as_ref().unwrap()[5..].parse().unwrap()
}

#[test]
fn planted_groups_are_found_and_counted() {
    let world = World::new();
    for run in 0..15 {
        world.write(&format!("run_{run:02}"), &Model::strip().family(2, kinds(run)));
    }
    let loaded = world.study(40);
    let planted: Vec<usize> = (0..15).map(|run| run % 3).collect();
    for by in [By::Displacement, By::Rotation] {
        for method in Method::ALL {
            for count in if method.takes_count() { vec![Some(3), None] } else { vec![None] } {
                let options = ModesOptions { count, method, by, ..Default::default() };
                let found = modes(&loaded.study, &options, &()).unwrap();
                let groups: Vec<usize> = found.runs.iter().map(group_of).collect();
                assert_eq!(adjusted_rand_index(&groups, &planted), 1.0, "{by:?} {method:?} {count:?}: {groups:?}");
                assert_eq!(
                    (found.given, found.tried.len()),
                    (count.is_some(), if count.is_some() || !method.takes_count() { 1 } else { 7 })
                );
            }
        }
    }
}

#[test]
fn the_order_in_which_runs_came_changes_nothing() {
    let world = World::new();
    for run in 0..9 {
        world.write(&format!("run_{run:02}"), &Model::strip().family(2, kinds(run)));
    }
    let together = world.study(25);
    let mut study = world.empty_study("one by one", "run_00", 25);
    for run in [5, 2, 8, 0, 1, 7, 3, 6, 4] {
        let found = crumple::bundle::find(&[world.root(&format!("run_{run:02}"))]).unwrap();
        study.add(&found, AddOptions::default(), &()).unwrap();
    }
    let one_by_one = Loaded::of(study).unwrap();
    for by in [By::Displacement, By::Rotation] {
        for method in Method::ALL {
            let count = method.takes_count().then_some(3);
            let options = ModesOptions { count, method, by, ..Default::default() };
            let here = modes(&together.study, &options, &()).unwrap();
            assert_eq!(here, modes(&one_by_one.study, &options, &()).unwrap(), "{by:?} {method:?}");
            assert_eq!(here, modes(&together.study, &options, &()).unwrap());
        }
    }
}

#[test]
fn modes_are_read_as_they_were_written() {
    let (_world, loaded, _) = scattered(8, 3, |run, p| p.map(|x| x + (run % 2) as f64 * 3.1), 1.0 / 3.0);
    for method in Method::ALL {
        let made = found(&loaded, None, method);
        save(&loaded.study, &made).unwrap();
        assert_eq!(load(&loaded.study).unwrap(), made);
    }
}

#[test]
fn runs_that_are_all_one_have_no_modes_to_tell_apart() {
    for motion in [0.0, 1.0] {
        let world = World::new();
        for run in 0..5 {
            world.write(&format!("run_{run:02}"), &Model::strip().family(2, move |t, p| bend(90.0, motion * t)(p)));
        }
        let loaded = world.study(20);
        for by in [By::Displacement, By::Rotation] {
            for method in Method::ALL {
                let options = ModesOptions { count: None, method, by, ..Default::default() };
                let made = modes(&loaded.study, &options, &()).unwrap();
                for run in &made.runs {
                    let still = run.silhouette == Some(0.0) && run.distance == Some(0.0) && !run.outlier;
                    assert!(still, "{motion} {by:?} {method:?}: rounding makes {run:?}");
                }
                save(&loaded.study, &made).unwrap();
                assert_eq!(load(&loaded.study).unwrap(), made);
            }
        }
    }
}
