//! Laws of similarity: what is 1, what nothing may change, what a distance is, and that an answer is always a number.

mod world;

use crumple::basis::{Basis, coefficients, synthesize};
use crumple::descriptor::{Descriptor, Select, Threshold};
use crumple::similarity::{Comparer, Metric, SimilarityOptions, Weight, cosine, search};
use crumple::study::{Loaded, Rows};
use proptest::prelude::*;
use world::{Model, Point, World, bend, cases, described, noise, rms, triples};

fn options() -> Vec<SimilarityOptions> {
    let mut all = Vec::new();
    for centred in [false, true] {
        for weight in [Weight::None, Weight::Frequency, Weight::Spread] {
            for metric in [Metric::Cosine, Metric::Euclidean, Metric::Mahalanobis] {
                all.push(SimilarityOptions { kind: None, centred, weight, metric });
            }
        }
    }
    all
}

fn deform(seed: f64) -> impl Fn(f64, Point) -> Point + Copy {
    move |t, p| {
        let [x, y, z] = bend(90.0, 0.3 * (seed - 2.0) * t)(p);
        [
            x + t * (p[1] / (8.0 + seed)).cos(),
            y - 2.0 * t * (p[0] / 21.0 + seed).sin(),
            z + 3.0 * t * (p[0] / 12.0).sin(),
        ]
    }
}

fn world(eigenpairs: usize) -> (World, Loaded) {
    let world = World::new();
    for run in 0..6 {
        world.write(&format!("run_{run}"), &Model::strip().family(3, deform(f64::from(run))));
    }
    let loaded = world.study(eigenpairs);
    (world, loaded)
}

proptest! {
    #![proptest_config(cases(200))]
    #[test]
    fn cosine_is_symmetric_bounded_and_knows_no_length(
        pairs in proptest::collection::vec((-1e6_f64..1e6, -1e6_f64..1e6), 1..30),
        length in 1e-100_f64..1e100,
    ) {
        let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        let longer: Vec<f64> = a.iter().map(|x| length * x).collect();
        let opposite: Vec<f64> = a.iter().map(|x| -x).collect();
        prop_assert!((cosine(&a, &b) - cosine(&b, &a)).abs() < 1e-14);
        prop_assert!((-1.0..=1.0).contains(&cosine(&a, &b)));
        prop_assert!((cosine(&a, &a) - 1.0).abs() < 1e-14);
        prop_assert!((cosine(&longer, &b) - cosine(&a, &b)).abs() < 1e-12);
        if a.iter().any(|&x| x != 0.0) {
            prop_assert!((cosine(&a, &opposite) + 1.0).abs() < 1e-14);
        }
    }
}

#[test]
fn cosine_of_huge_and_tiny_vectors_is_that_of_their_directions() {
    for length in [1e-200, 1e-160, 1e160, 1e200] {
        assert!((cosine(&[3.0 * length, 4.0 * length], &[3.0, 4.0]) - 1.0).abs() < 1e-12, "{length:e}");
    }
}

#[test]
fn a_run_is_most_like_itself_by_every_measure() {
    let (_world, loaded) = world(20);
    for select in [Select::Coordinates, Select::Difference] {
        let descriptor = described(&loaded, "run_4", select, Threshold::Top(9)).descriptor;
        for options in options() {
            let hits = search(&loaded, &descriptor, options, Rows::All).unwrap();
            assert_eq!((hits.len(), hits[0].run.as_str(), hits[0].state), (18, "run_4", 2), "{select:?} {options:?}");
            assert!((hits[0].score.similarity - 1.0).abs() < 1e-12 && hits[0].score.distance.abs() < 1e-12);
            for hit in &hits {
                assert!((-1.0..=1.0).contains(&hit.score.similarity) && hit.score.distance >= 0.0, "{hit:?}");
            }
        }
    }
}

#[test]
fn euclidean_distance_is_the_rms_of_the_band_limited_difference() {
    let (_world, loaded) = world(20);
    let basis = &loaded.basis;
    for select in [Select::Coordinates, Select::Difference] {
        let descriptor = described(&loaded, "run_1", select, Threshold::Top(8)).descriptor;
        let options = SimilarityOptions { metric: Metric::Euclidean, ..Default::default() };
        let rows = loaded.study.coefficients(Some(&descriptor.selected.eigenvectors), Rows::Last).unwrap();
        let target = rows.runs.iter().position(|run| run == "run_1").unwrap();
        let band = |row: usize| synthesize(basis, &descriptor.selected.eigenvectors, &triples(rows.row(row)));
        let comparer = Comparer::new(&loaded, &descriptor, options).unwrap();
        for row in 0..rows.rows() {
            let distance = comparer.score(&[rows.stored(row)]).distance;
            let expected = rms(&basis.mass, &band(row), &band(target));
            // f32 rounding of basis and coefficients, of shapes of some 50 mm.
            assert!((distance - expected).abs() < 1e-5 * (1.0 + expected), "{distance} and {expected}");
        }
    }
}

/// Coefficients, target and offset under another basis of the same spaces.
fn with_basis(loaded: &Loaded, basis: Basis, shapes: &[Vec<Point>]) -> (Basis, Vec<Vec<Point>>) {
    let mut basis = basis;
    basis.baseline = coefficients(&basis, loaded.reference.mesh.vertices());
    let p0 = loaded.reference.mesh.vertices();
    let delta = |shape: &Vec<Point>| {
        let d: Vec<Point> = shape.iter().zip(p0).map(|(p, q)| std::array::from_fn(|c| p[c] - q[c])).collect();
        coefficients(&basis, &d)
    };
    let deltas = shapes.iter().map(delta).collect();
    (basis, deltas)
}

#[test]
fn another_basis_of_the_same_spaces_gives_the_same_similarities() {
    // A tube: waves around it come as sine and cosine of one eigenvalue. In double precision, so that rounding of the
    // positions does not part them.
    let world = World::new();
    let model = Model::tube(10, 4, 20.0, 60.0);
    for run in 0..4 {
        world.write(&format!("run_{run}"), &model.family(2, deform(f64::from(run))).double());
    }
    let loaded = world.study(9);
    let clusters = loaded.basis.facts.clusters.clone();
    let &(first, last) = clusters.iter().find(|(first, last)| last - first == 1).expect("a pair of equal eigenvalues");
    let shapes: Vec<Vec<Point>> = (0..4)
        .map(|run| {
            let run = world.open(&format!("run_{run}"));
            loaded.reference.shape(&run, &loaded.reference.place(&run).unwrap(), 1).unwrap()
        })
        .collect();
    // All signs turned, and the pair turned into each other by an angle.
    let n = loaded.basis.vertices();
    let mut other = loaded.basis.clone();
    other.eigenvectors.iter_mut().for_each(|x| *x = -*x);
    let (sin, cos) = 0.8_f32.sin_cos();
    for v in 0..n {
        let (a, b) = (loaded.basis.eigenvector(first)[v], loaded.basis.eigenvector(last)[v]);
        other.eigenvectors[(first - 1) * n + v] = cos * a - sin * b;
        other.eigenvectors[(last - 1) * n + v] = sin * a + cos * b;
    }
    let (here, deltas) = with_basis(&loaded, loaded.basis.clone(), &shapes);
    let (there, other_deltas) = with_basis(&loaded, other, &shapes);
    assert!(first > 1);
    let j = [1, first, last];
    for select in [Select::Coordinates, Select::Difference] {
        let similarity = |basis: &Basis, deltas: &[Vec<Point>], run: usize| {
            let on =
                |run: usize| -> Vec<f64> { j.iter().flat_map(|&j| select.value(basis, &deltas[run], j)).collect() };
            cosine(&on(0), &on(run))
        };
        for run in 0..4 {
            let (a, b) = (similarity(&here, &deltas, run), similarity(&there, &other_deltas, run));
            assert!((a - b).abs() < 1e-5, "{select:?}, run {run}: {a} and {b}");
        }
        // Half of the pair is not a thing of the shape: a descriptor that cuts it must say so.
        let cut = described(&loaded, "run_1", select, Threshold::Top(9)).descriptor;
        assert!(cut.selected.split_clusters.is_empty());
    }
    for m in 1..9 {
        let descriptor = described(&loaded, "run_1", Select::Difference, Threshold::Top(m)).descriptor;
        for &(first, last) in &clusters {
            let held = (first..=last).filter(|j| descriptor.selected.eigenvectors.contains(j)).count();
            let cut = held > 0 && held < last + 1 - first;
            assert_eq!(descriptor.selected.split_clusters.contains(&(first, last)), cut, "{descriptor:?}");
        }
    }
}

/// All scores of all runs, in mm (factor 1) and in another unit.
#[test]
fn mahalanobis_and_cosine_know_no_unit() {
    let scores = |scale: f64, options: SimilarityOptions| -> Vec<(String, f64)> {
        let world = World::new();
        for run in 0..6 {
            let family = Model::strip().family(2, deform(f64::from(run)));
            let states =
                family.states.iter().map(|(t, nodes)| (*t, nodes.iter().map(|p| p.map(|x| scale * x)).collect()));
            let family = Model::strip().moved(|p| p.map(|x| scale * x)).family_of(states);
            world.write(&format!("run_{run}"), &family);
        }
        let loaded = world.study(12);
        let descriptor = described(&loaded, "run_2", Select::Difference, Threshold::Top(5)).descriptor;
        let mut hits = search(&loaded, &descriptor, options, Rows::Last).unwrap();
        hits.sort_by(|a, b| a.run.cmp(&b.run));
        hits.into_iter().map(|hit| (hit.run, hit.score.similarity)).collect()
    };
    for options in options() {
        // m and inches as well as mm.
        for scale in [0.001, 25.4] {
            for ((run, a), (_, b)) in scores(1.0, options).iter().zip(scores(scale, options)) {
                assert!((a - b).abs() < 2e-3, "{run} by {options:?}, scale {scale}: {a} and {b}");
            }
        }
    }
}

/// A comparison in a study whose runs are all alike, or that never moved.
fn always_numbers(loaded: &Loaded, descriptor: &Descriptor) {
    for options in options() {
        for hit in search(loaded, descriptor, options, Rows::All).unwrap() {
            let finite = hit.score.similarity.is_finite() && hit.score.distance.is_finite();
            assert!(finite, "{options:?}: {hit:?}");
        }
    }
}

#[test]
fn an_answer_is_a_number_where_nothing_moved() {
    let world = World::new();
    for run in 0..3 {
        world.write(&format!("run_{run}"), &Model::strip().family(2, |_, p| p));
    }
    let loaded = world.study(8);
    always_numbers(&loaded, &described(&loaded, "run_0", Select::Coordinates, Threshold::Top(3)).descriptor);
    always_numbers(&loaded, &described(&loaded, "run_0", Select::Difference, Threshold::Top(3)).descriptor);
    always_numbers(&loaded, &described(&loaded, "run_0", Select::Coordinates, Threshold::Std(1.0)).descriptor);
}

#[test]
fn an_answer_is_a_number_where_all_runs_are_one() {
    let world = World::new();
    for run in 0..4 {
        world.write(&format!("run_{run}"), &Model::strip().family(2, deform(4.0)));
    }
    let loaded = world.study(8);
    for select in [Select::Coordinates, Select::Difference] {
        let descriptor = described(&loaded, "run_0", select, Threshold::Top(4)).descriptor;
        always_numbers(&loaded, &descriptor);
        let last = search(&loaded, &descriptor, SimilarityOptions::default(), Rows::Last).unwrap();
        assert!(last.iter().all(|hit| (hit.score.similarity - 1.0).abs() < 1e-12));
        // Ties by run.
        let runs: Vec<&str> = last.iter().map(|hit| hit.run.as_str()).collect();
        assert_eq!(runs, ["run_0", "run_1", "run_2", "run_3"]);
    }
}

#[test]
fn statistics_of_one_run_are_refused_in_words() {
    let world = World::new();
    world.write("alone", &Model::strip().family(2, deform(1.0)));
    let loaded = world.study(8);
    let descriptor = described(&loaded, "alone", Select::Coordinates, Threshold::Top(3)).descriptor;
    for options in options() {
        let needs = options.centred || options.weight == Weight::Spread || options.metric == Metric::Mahalanobis;
        let answer = search(&loaded, &descriptor, options, Rows::Last);
        assert_eq!(matches!(answer, Err(crumple::Error::TooFewRuns { .. })), needs, "{options:?}");
    }
}

#[test]
fn rounding_of_a_coefficient_that_never_varies_does_not_decide() {
    // Runs differ in x and z. In y nothing moves, or by the last bit of the file's numbers, as on another processor.
    let similarities = |bit: f64| -> Vec<f64> {
        let world = World::new();
        let mut random = noise(5);
        for run in 0..6 {
            let deformed = Model::strip().nodes.into_iter().map(|p| {
                let [x, _, z] = deform(f64::from(run))(1.0, p);
                [x, p[1] + bit * random(), z]
            });
            world.write(&format!("run_{run}"), &Model::strip().family_of([(1.0, deformed.collect())]));
        }
        let loaded = world.study(10);
        let descriptor = described(&loaded, "run_1", Select::Difference, Threshold::Top(6)).descriptor;
        let options = SimilarityOptions { weight: Weight::Spread, ..Default::default() };
        let mut hits = search(&loaded, &descriptor, options, Rows::Last).unwrap();
        hits.sort_by(|a, b| a.run.cmp(&b.run));
        hits.into_iter().map(|hit| hit.score.similarity).collect()
    };
    for (without, with) in similarities(0.0).into_iter().zip(similarities(4e-6)) {
        assert!((with - without).abs() < 0.02, "the last bit of y turns a similarity of {without} into {with}");
    }
}
