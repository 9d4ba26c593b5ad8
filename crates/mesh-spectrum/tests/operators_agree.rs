//! The operators agree with independent programs, entry by entry: robust_laplacian, libigl, and a NumPy program of the
//! polygon paper's definitions (tests-python/operators_reference.py has the versions).

mod zoo;

use std::collections::HashMap;
use std::path::PathBuf;

use mesh_spectrum::{Csr, Kind, Mass, Mesh, Operator, OperatorOptions, operator};
use serde_json::Value;

fn testdata(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "testdata", "operators", name].iter().collect()
}

fn mesh(name: &str) -> Mesh {
    let file = mesh_files::read(&testdata(&format!("{name}.obj"))).unwrap();
    Mesh::from_polygons(file.vertices.clone(), file.faces()).unwrap()
}

fn reference() -> Value {
    serde_json::from_str(&std::fs::read_to_string(testdata("reference.json")).unwrap()).unwrap()
}

fn build(name: &str, kind: Kind, mass: Mass) -> Operator {
    operator(&mesh(name), &OperatorOptions { kind, mass, ..Default::default() }).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// The largest difference of two symmetric matrices, relative to the largest entry.
#[track_caller]
fn same_matrix(ours: &Csr, theirs: &Value, allowed: f64, what: &str) {
    let mut rest: HashMap<(usize, usize), f64> = (0..ours.rows())
        .flat_map(|row| ours.row(row).map(move |(column, value)| ((row, column), value)))
        .filter(|((row, column), _)| row <= column)
        .collect();
    let most = rest.values().fold(0.0f64, |most, x| most.max(x.abs()));
    let (mut worst, mut place) = (0.0, (0, 0));
    for entry in theirs.as_array().unwrap() {
        let at = (entry[0].as_u64().unwrap() as usize, entry[1].as_u64().unwrap() as usize);
        let apart = (rest.remove(&at).unwrap_or(0.0) - entry[2].as_f64().unwrap()).abs() / most;
        if apart > worst {
            (worst, place) = (apart, at);
        }
    }
    for (at, value) in rest {
        if value.abs() / most > worst {
            (worst, place) = (value.abs() / most, at);
        }
    }
    assert!(worst <= allowed, "{what}: entry {place:?} is off by {worst:e} of the largest, {allowed:e} allowed");
}

#[track_caller]
fn same_numbers(ours: &[f64], theirs: &Value, allowed: f64, what: &str) {
    let theirs = numbers(theirs);
    let most = theirs.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let worst = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs() / most).fold(0.0, f64::max);
    assert!(worst <= allowed && ours.len() == theirs.len(), "{what}: off by {worst:e}, {allowed:e} allowed");
}

/// Stored numbers have 13 digits, and libigl takes areas from edge lengths.
const STORED: f64 = 2e-12;

#[test]
fn cotan_with_lumped_and_consistent_mass_as_libigl() {
    let reference = reference();
    for name in ["sheet", "ball", "fins", "moebius", "fan"] {
        let theirs = &reference["meshes"][name]["cotan"];
        let lumped = build(name, Kind::Cotan, Mass::Lumped);
        same_matrix(&lumped.stiffness, &theirs["stiffness"], STORED, name);
        same_numbers(&lumped.mass, &theirs["lumped"], STORED, name);
        let consistent = build(name, Kind::Cotan, Mass::Consistent);
        same_matrix(consistent.mass_matrix.as_ref().unwrap(), &theirs["consistent"], STORED, name);
        for (built, key) in [(&lumped, "eigenvalues_lumped"), (&consistent, "eigenvalues_consistent")] {
            let count = numbers(&theirs[key]).len();
            same_numbers(&zoo::solve(built, count).eigenvalues, &theirs[key], 1e-11, &format!("{name} {key}"));
        }
    }
}

#[test]
fn tufted_as_robust_laplacian() {
    let reference = reference();
    for name in ["sheet", "ball", "fins", "moebius", "fan", "needles"] {
        let theirs = &reference["meshes"][name]["tufted"];
        let ours = build(name, Kind::Tufted, Mass::Lumped);
        // Areas of nearly flat triangles from edge lengths have few digits.
        let allowed = if name == "needles" { 1e-7 } else { 1e-11 };
        same_matrix(&ours.stiffness, &theirs["stiffness"], allowed, name);
        same_numbers(&ours.mass, &theirs["lumped"], allowed, name);
        let count = numbers(&theirs["eigenvalues_lumped"]).len();
        same_numbers(&zoo::solve(&ours, count).eigenvalues, &theirs["eigenvalues_lumped"], allowed, name);
    }
}

#[test]
fn on_a_closed_surface_tufted_is_the_intrinsic_delaunay_operator_of_libigl() {
    let ours = build("ball", Kind::Tufted, Mass::Lumped);
    assert!(ours.flips > 0);
    same_matrix(&ours.stiffness, &reference()["meshes"]["ball"]["intrinsic_delaunay"]["stiffness"], 1e-11, "ball");
}

#[test]
fn polygon_as_the_papers_definitions() {
    let reference = reference();
    let theirs = &reference["meshes"]["polygons"]["polygon"];
    let ours = build("polygons", Kind::Polygon, Mass::Consistent);
    same_matrix(&ours.stiffness, &theirs["stiffness"], 1e-8, "stiffness");
    same_matrix(ours.mass_matrix.as_ref().unwrap(), &theirs["consistent"], 1e-8, "mass");
    same_numbers(&ours.mass, &theirs["lumped"], 1e-8, "row sums");
    let count = numbers(&theirs["eigenvalues_consistent"]).len();
    same_numbers(&zoo::solve(&ours, count).eigenvalues, &theirs["eigenvalues_consistent"], 1e-8, "eigenvalues");
}
