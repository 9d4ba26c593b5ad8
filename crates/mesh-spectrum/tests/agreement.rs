//! Agreement with an independent program: SciPy's eigenvalues of the hat-section beam (testdata/scipy_eigenvalues.py).

mod zoo;

use mesh_spectrum::{Mesh, OperatorOptions, inspect, operator};
use serde_json::Value;

fn hat_section() -> Mesh {
    let text = include_str!("../testdata/hat-section.obj");
    let numbers = |line: &str| line[2..].split(' ').map(|word| word.parse().unwrap()).collect::<Vec<f64>>();
    let lines = |kind| text.lines().filter(move |line| line.starts_with(kind)).map(numbers);
    let vertices = lines("v ").map(|v| [v[0], v[1], v[2]]).collect();
    let faces: Vec<[u32; 4]> = lines("f ").map(|f| [f[0], f[1], f[2], f[3]].map(|v| v as u32 - 1)).collect();
    Mesh::from_faces(vertices, &faces).unwrap()
}

#[test]
fn the_bundle_is_what_its_data_sheet_says() {
    let seen = inspect(&hat_section());
    assert_eq!((seen.components, seen.gap_median, seen.gap), (2, Some(2.0), Some(2.5)));
    assert!((seen.area - 138_240.0).abs() < 1e-6, "mm²");
    let built = operator(&hat_section(), &OperatorOptions::default()).unwrap();
    // Six digits are printed there.
    let printed = [
        0.0,
        0.0,
        4.28215e-05,
        4.28215e-05,
        1.71102e-04,
        1.71102e-04,
        2.67347e-04,
        3.10168e-04,
        3.84291e-04,
        3.84292e-04,
    ];
    for (computed, printed) in zoo::solve(&built, 10).eigenvalues.iter().zip(printed) {
        assert!((computed - printed).abs() <= 6e-6 * printed, "{computed} is not {printed}");
    }
}

#[test]
fn five_hundred_eigenvalues_agree_with_scipy() {
    let stored: Value = serde_json::from_str(include_str!("../testdata/hat-section.json")).unwrap();
    for (name, join) in [("separate", None), ("joined_at_2.5_mm", Some(2.5))] {
        let built = operator(&hat_section(), &OperatorOptions { join, ..Default::default() }).unwrap();
        assert_eq!(built.mass.len() as u64, stored[name]["dofs"].as_u64().unwrap());
        let theirs: Vec<f64> =
            stored[name]["eigenvalues"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        let ours = zoo::solve(&built, 500).eigenvalues;
        let apart = zoo::distance(&theirs, &ours);
        assert!(apart < 1e-9, "{name}: {apart:e} of λ_K; ours is exact to 1e-12, theirs to 1e-13");
        let dense = zoo::solve_dense(&built, 500).eigenvalues;
        assert!(zoo::distance(&theirs, &dense) < 1e-9);
    }
}
