//! Fields beside the shape: plastic strain of the example's runs, from files to coefficients, descriptors, search, modes.

use std::path::PathBuf;

use crumple::basis::{BasisOptions, coefficients};
use crumple::bundle::find;
use crumple::descriptor::{DescribeOptions, Threshold, describe};
use crumple::field::Field;
use crumple::modes::{Along, By, ModesOptions, States, modes};
use crumple::run::{FieldValues, Run};
use crumple::select::Kind;
use crumple::similarity::{SimilarityOptions, search};
use crumple::study::{AddOptions, Function, Loaded, Rows, Study, column_name};
use crumple::target::{Named, resolve};

fn runs() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", "..", "examples", "hat-section", "runs"].iter().collect()
}

fn strain() -> Field {
    "plastic_strain".parse().unwrap()
}

fn study(folder: &std::path::Path, fields: &[Field]) -> Loaded {
    let ids = ["run_001", "run_007", "run_011", "run_042", "run_049", "run_065", "run_074", "run_095"];
    let found = find(&ids.map(|id| runs().join(id))).unwrap();
    let reference = Run::open("run_001", &found[0].path).unwrap();
    let options = BasisOptions { eigenpairs: 80, ..Default::default() };
    let mut study = Study::create(&folder.join("study"), &reference, &[], fields, &options, &()).unwrap();
    study.add(&found, AddOptions::default(), &()).unwrap();
    Loaded::of(study).unwrap()
}

#[test]
fn coefficients_are_those_of_the_area_mean_of_the_shells() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = study(folder.path(), &[strain()]);
    let run = Run::open("run_065", &runs().join("run_065")).unwrap();
    let last = run.times().len() - 1;
    let FieldValues::Shells(shells) = run.field(strain(), last).unwrap() else { panic!("of shells") };
    // The mean by its definition, from the quads of the file.
    let mesh = &loaded.reference.mesh;
    let (mut sums, mut areas) = (vec![0.0; loaded.reference.vertices()], vec![0.0; loaded.reference.vertices()]);
    for (triangle, &shell) in mesh.triangles().iter().zip(&loaded.reference.shell_of_triangle) {
        let [a, b, c] = triangle.map(|vertex| mesh.vertices()[vertex as usize]);
        let side = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
        let (u, v) = (side(b), side(c));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let area = normal.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0;
        for &vertex in triangle {
            sums[vertex as usize] += area * shells[shell as usize];
            areas[vertex as usize] += area;
        }
    }
    let expected: Vec<[f64; 3]> = sums.iter().zip(&areas).map(|(sum, area)| [sum / area, 0.0, 0.0]).collect();
    let expected = coefficients(&loaded.basis, &expected);
    let found = resolve(&loaded, &Named::parse("run_065")).unwrap().values(Function::Field(strain())).unwrap();
    assert_eq!(found.len(), 80);
    let most = expected.iter().map(|x| x[0].abs()).fold(0.0, f64::max);
    for (found, expected) in found.iter().zip(&expected) {
        assert!((f64::from(*found) - expected[0]).abs() < 1e-6 * most, "{found} and {expected:?}"); // f32
    }
    assert_eq!(column_name(Function::Field(strain()), 7, 0), "plastic_strain_7");
}

#[test]
fn descriptors_search_and_modes_take_a_field_alone_and_beside_the_shape() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = study(folder.path(), &[strain()]);
    for functions in [vec![Function::Field(strain())], vec![Function::Displacement, Function::Field(strain())]] {
        let both = functions.len() == 2;
        let options = DescribeOptions { functions, threshold: Threshold::Top(10), ..Default::default() };
        let made = describe(&loaded, &Named::parse("run_065"), None, None, &options).unwrap().descriptor;
        assert_eq!(made.kind, Kind::Paper, "a field has no rotation");
        assert_eq!((made.size(), made.numbers()), if both { (20, 40) } else { (10, 10) });
        let errors = made.blocks().map(|block| block.errors.unwrap());
        assert!(errors.into_iter().all(|errors| errors.relative.unwrap() < 1.0 && errors.rms > 0.0));
        let hits = search(&loaded, &made, SimilarityOptions::default(), Rows::Last).unwrap();
        assert!(hits[0].run == "run_065" && (hits[0].score.similarity - 1.0).abs() < 1e-9);
        assert!(hits[1..].iter().all(|hit| hit.score.similarity < 1.0));
    }
    let by_strain = ModesOptions { by: By::Field(strain()), count: Some(2), ..Default::default() };
    assert_eq!(modes(&loaded.study, &by_strain, &()).unwrap().modes.len(), 2);
}

#[test]
fn modes_by_shape_and_field_weigh_both_alike_whatever_the_unit() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = study(folder.path(), &[strain()]);
    let of = |by: &str, states| {
        let options = ModesOptions { by: by.parse().unwrap(), count: Some(3), states, ..Default::default() };
        modes(&loaded.study, &options, &()).unwrap()
    };
    for by in ["displacement,plastic_strain", "rotation,plastic_strain"] {
        let both = of(by, States::Last);
        assert_eq!(both.modes.len(), 3, "{by}");
        assert_eq!(both.unit("mm"), "");
        // Both kinds have a mean square of 1 about their mean, so all runs together have 2.
        let one = ModesOptions { by: by.parse().unwrap(), count: Some(1), ..Default::default() };
        let one = modes(&loaded.study, &one, &()).unwrap();
        assert!((one.modes[0].spread - 2_f64.sqrt()).abs() < 1e-6, "{by}: {}", one.modes[0].spread);
        assert!(both.modes.iter().all(|mode| mode.spread < one.modes[0].spread));
        of(by, States::Series { along: Along::Intrusion });
    }
    assert_eq!("shape,plastic_strain".parse::<By>().unwrap(), By::DisplacementAnd(strain()));
    for wrong in ["displacement,", "plastic_strain,displacement", "shape,colour", ","] {
        assert!(wrong.parse::<By>().is_err(), "{wrong}");
    }
}

#[test]
fn a_field_that_is_not_there_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let velocity: Field = "velocity".parse().unwrap();
    let run = Run::open("run_001", &runs().join("run_001")).unwrap();
    let options = BasisOptions { eigenpairs: 10, ..Default::default() };
    let refused = Study::create(&folder.path().join("study"), &run, &[], &[velocity], &options, &()).unwrap_err();
    assert!(matches!(refused, crumple::Error::NoField { .. }) && refused.to_string().contains("velocity"), "{refused}");
    let loaded = study(folder.path(), &[]);
    let options = DescribeOptions { functions: vec![Function::Field(strain())], ..Default::default() };
    let unknown = describe(&loaded, &Named::parse("run_065"), None, None, &options).unwrap_err();
    assert!(matches!(unknown, crumple::Error::UnknownField { .. }), "{unknown}");
    let by_strain = ModesOptions { by: By::Field(strain()), ..Default::default() };
    assert!(matches!(modes(&loaded.study, &by_strain, &()), Err(crumple::Error::UnknownField { .. })));
}
