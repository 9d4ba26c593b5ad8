//! The laws on real runs: LS-DYNA families of the example, their warts included.
//!
//! Ten of its hundred runs, so that the suite stays quick; numbers of the mesh are those that the example's DATA.md got
//! from another program.

mod world;

use std::path::{Path, PathBuf};

use crumple::basis::BasisOptions;
use crumple::bundle::find;
use crumple::descriptor::{Select, Threshold};
use crumple::run::Run;
use crumple::similarity::{Metric, SimilarityOptions, search};
use crumple::study::{AddOptions, Loaded, Rows, Study, check};
use world::{Point, described, energy, relative, square_distance, triples};

fn runs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/hat-section/runs")
}

/// Ten runs of the example with 120 eigenpairs.
fn study(folder: &Path, join: Option<f64>) -> Loaded {
    let ids =
        ["run_001", "run_002", "run_007", "run_011", "run_023", "run_042", "run_065", "run_074", "run_088", "run_100"];
    let found = find(&ids.map(|id| runs().join(id))).unwrap();
    let reference = Run::open("run_001", &found[0].path).unwrap();
    let options =
        BasisOptions { eigenpairs: 120, join: join.map(crumple::joints::Join::Distance), ..Default::default() };
    let mut study = Study::create(&folder.join("study"), &reference, &[], &[], &options, &()).unwrap();
    study.add(&found, AddOptions::default(), &()).unwrap();
    Loaded::of(study).unwrap()
}

#[test]
fn the_basis_is_the_one_that_another_program_found() {
    let folder = tempfile::tempdir().unwrap();
    let run = Run::open("run_001", &runs().join("run_001/d3plot")).unwrap();
    // DATA.md of the example: SciPy, six digits; the file rounds positions to f32.
    let apart =
        [0.0, 0.0, 4.28215e-5, 4.28215e-5, 1.71102e-4, 1.71102e-4, 2.67347e-4, 3.10168e-4, 3.84291e-4, 3.84292e-4];
    let joined = [
        0.0, 4.28215e-5, 1.71102e-4, 3.84292e-4, 5.41045e-4, 5.83858e-4, 6.52623e-4, 6.81481e-4, 6.95421e-4, 7.12163e-4,
    ];
    for (name, join, expected) in [("apart", None, apart), ("joined", Some(2.5), joined)] {
        let options =
            BasisOptions { eigenpairs: 10, join: join.map(crumple::joints::Join::Distance), ..Default::default() };
        let study = Study::create(&folder.path().join(name), &run, &[], &[], &options, &()).unwrap();
        let basis = study.basis().unwrap();
        assert!(basis.facts.complete && relative(basis.facts.area, 138_240.0) < 1e-5);
        for (found, expected) in basis.eigenvalues.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-5 * expected + 1e-12, "{name}: {found} and {expected}");
        }
    }
}

#[test]
fn the_laws_hold_on_real_runs() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = study(folder.path(), Some(2.5));
    assert!(check(loaded.study.folder()).unwrap().whole);
    let p0 = loaded.reference.mesh.vertices();
    for (id, record) in &loaded.study.manifest().runs {
        let run = Run::open(id.as_str(), &record.path).unwrap();
        let placement = loaded.reference.place(&run).unwrap();
        let rows = loaded.study.coefficients(None, Rows::Run(id)).unwrap();
        assert_eq!(rows.rows(), run.times().len());
        for state in 0..rows.rows() {
            let shape = loaded.reference.shape(&run, &placement, state).unwrap();
            // Parseval: what the coefficients hold is what the band-limited displacement has.
            let caught = energy(&triples(rows.row(state)));
            let all = square_distance(&loaded.basis.mass, &shape, p0);
            assert!(caught <= all * (1.0 + 1e-6), "{id}@{state}: {caught} of {all}");
        }
        let last = record.last;
        let caught = energy(&triples(rows.row(rows.rows() - 1)));
        assert!((last.captured - caught / (last.rms.powi(2) * loaded.basis.facts.area)).abs() < 1e-5, "{id}: {last:?}");
        assert!(last.captured > 0.9 && last.captured <= 1.0 && last.max >= last.rms, "{id}: {last:?}");
        assert!((0.0..=1.0).contains(&last.rigid_share) && last.strain_median <= last.strain_p95, "{id}: {last:?}");
    }
}

#[test]
fn descriptors_of_real_runs_find_their_runs() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = study(folder.path(), Some(2.5));
    for run in ["run_007", "run_065", "run_074"] {
        for select in [Select::Coordinates, Select::Difference] {
            let made = described(&loaded, run, select, Threshold::default());
            let descriptor = &made.descriptor;
            assert!(
                !descriptor.selected.eigenvectors.is_empty() && descriptor.selected.eigenvectors.len() < 40,
                "{descriptor:?}"
            );
            // One standard deviation above the mean, over all 3K magnitudes.
            let kept = |j: usize| made.values[j - 1].iter().any(|x: &f64| x.abs() > descriptor.selected.threshold);
            assert!((1..=120).all(|j| kept(j) == descriptor.selected.eigenvectors.contains(&j)));
            for metric in [Metric::Cosine, Metric::Euclidean, Metric::Mahalanobis] {
                let options = SimilarityOptions { metric, ..Default::default() };
                let hits = search(&loaded, descriptor, options, Rows::Last).unwrap();
                assert_eq!((hits.len(), hits[0].run.as_str()), (10, run), "{select:?} {metric:?}");
            }
            let displaced: Vec<Point> = made.reconstruction.clone();
            let errors = crumple::reconstruct::errors(&loaded.reference, &loaded.basis, &made.original, &displaced);
            assert_eq!(Some(errors), descriptor.selected.errors);
            assert!(errors.relative.unwrap() < 1.0, "{run} {select:?}: {errors:?}");
        }
    }
}

#[test]
fn adding_a_real_bundle_again_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut loaded = study(folder.path(), None);
    let before = loaded.study.manifest().clone();
    let ids: Vec<PathBuf> = before.runs.values().map(|record| record.path.clone()).collect();
    let again = loaded.study.add(&find(&ids).unwrap(), AddOptions::default(), &()).unwrap();
    assert_eq!((again.unchanged.len(), again.added.len()), (10, 0));
    assert_eq!(*loaded.study.manifest(), before);
}
