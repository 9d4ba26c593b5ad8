//! Analytic spectra: sphere, flat torus, plate with free edges. The error of linear elements is O(h²), whatever the
//! operator and the mass; the order is measured between two meshes. `--nocapture` prints the tables of docs/operators.md.

mod zoo;

use std::f64::consts::PI;

use mesh_spectrum::{Kind, Mass, Mesh, OperatorOptions, Tie, operator};

const ALL: [(Kind, Mass); 6] = [
    (Kind::Cotan, Mass::Lumped),
    (Kind::Cotan, Mass::Consistent),
    (Kind::Tufted, Mass::Lumped),
    (Kind::Tufted, Mass::Consistent),
    (Kind::Polygon, Mass::Lumped),
    (Kind::Polygon, Mass::Consistent),
];

/// The largest relative error of the eigenvalues after the first.
fn error(mesh: &Mesh, kind: Kind, mass: Mass, exact: &[f64]) -> f64 {
    let built = operator(mesh, &OperatorOptions { kind, mass, ..Default::default() }).unwrap();
    let basis = zoo::checked(&built, &mesh_spectrum::EigenOptions { count: exact.len(), ..Default::default() });
    basis.eigenvalues.iter().zip(exact).skip(1).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

/// Errors on meshes of which each has half the edge length of the one before; the order between the last two.
fn order(name: &str, meshes: &[Mesh], exact: &[f64], kinds: &[(Kind, Mass)]) {
    for &(kind, mass) in kinds {
        let errors: Vec<f64> = meshes.iter().map(|mesh| error(mesh, kind, mass, exact)).collect();
        let order = (errors[errors.len() - 2] / errors[errors.len() - 1]).log2();
        let sizes: Vec<usize> = meshes.iter().map(|mesh| mesh.vertices().len()).collect();
        let shown: Vec<String> = errors.iter().map(|error| format!("{error:.2e}")).collect();
        println!("{name:8} {kind:8} {mass:10} N = {sizes:?} errors {shown:?} order {order:.2}");
        assert!((1.8..2.3).contains(&order), "{name}, {kind}, {mass}: expected h², measured h^{order:.2}");
    }
}

/// A plate of 1 × 0.7 whose cells are bent by a smooth map, as triangles or as quadrilaterals.
fn plate(cells: u32, quadrilaterals: bool) -> Mesh {
    let at = |i: u32, j: u32| {
        let (x, y) = (f64::from(i) / f64::from(cells), f64::from(j) / f64::from(cells));
        let bend = 0.08 * (PI * x).sin() * (PI * y).sin();
        [x + bend, 0.7 * (y - bend), 0.0]
    };
    let vertices = (0..=cells).flat_map(|j| (0..=cells).map(move |i| at(i, j))).collect();
    let faces: Vec<[u32; 4]> = (0..cells)
        .flat_map(|j| (0..cells).map(move |i| j * (cells + 1) + i))
        .map(|a| [a, a + 1, a + cells + 2, a + cells + 1])
        .collect();
    let mesh = Mesh::from_faces(vertices, &faces).unwrap();
    if quadrilaterals { mesh } else { Mesh::new(mesh.vertices().to_vec(), mesh.triangles().to_vec()).unwrap() }
}

fn lowest(mut all: Vec<f64>, count: usize) -> Vec<f64> {
    all.sort_by(f64::total_cmp);
    all.truncate(count);
    all
}

#[test]
fn sphere() {
    // λ = l (l + 1), 2l + 1 times.
    let exact: Vec<f64> = (0..5).flat_map(|l| vec![f64::from(l * (l + 1)); 2 * l as usize + 1]).collect();
    let meshes: Vec<Mesh> = (2..5).map(zoo::icosphere).map(|(v, t)| Mesh::new(v, t).unwrap()).collect();
    order("sphere", &meshes, &exact, &ALL[..4]);
}

#[test]
fn flat_torus() {
    let wave = |p: i32, a: f64| (2.0 * PI * f64::from(p) / a).powi(2);
    let exact = lowest((-9..=9).flat_map(|p| (-9..=9).map(move |q| wave(p, 1.0) + wave(q, 0.8))).collect(), 21);
    let torus = |n: usize| {
        let (v, t) = zoo::flat_torus(n, n, 1.0 / n as f64, 0.8 / n as f64);
        Mesh::new(v, t).unwrap()
    };
    // The mesh is folded flat, layers on each other: the tufted cover goes by connectivity alone.
    order("torus", &[torus(16), torus(32), torus(64)], &exact, &ALL[..4]);
}

#[test]
fn plate_with_free_edges() {
    let wave = |p: i32, a: f64| (PI * f64::from(p) / a).powi(2);
    let exact = lowest((0..12).flat_map(|p| (0..12).map(move |q| wave(p, 1.0) + wave(q, 0.7))).collect(), 21);
    order("plate", &[16, 32, 64].map(|cells| plate(cells, false)), &exact, &ALL[..4]);
    order("quads", &[16, 32, 64].map(|cells| plate(cells, true)), &exact, &ALL);
}

#[test]
fn the_consistent_mass_bounds_a_flat_plates_eigenvalues_from_above() {
    // Rayleigh-Ritz with a subspace: no computed eigenvalue is below the exact one of the same number.
    let wave = |p: i32, a: f64| (PI * f64::from(p) / a).powi(2);
    let exact = lowest((0..40).flat_map(|p| (0..40).map(move |q| wave(p, 1.0) + wave(q, 0.7))).collect(), 150);
    let mesh = plate(40, false);
    let built = operator(&mesh, &OperatorOptions { mass: Mass::Consistent, ..Default::default() }).unwrap();
    let basis = zoo::solve(&built, 150);
    assert_eq!(basis.certificate.method, mesh_spectrum::Method::Sliced);
    for (computed, exact) in basis.eigenvalues.iter().zip(&exact) {
        assert!(*computed >= exact * (1.0 - 1e-9), "{computed} is below {exact}");
    }
}

#[test]
fn the_two_solvers_for_a_mass_matrix_agree() {
    // In intervals and dense, on a surface with holes, two components, and joined sheets.
    let meshes =
        [zoo::rough(40, 25), zoo::copies(&zoo::rough(30, 20), 2, 0.4), zoo::tube(6, 30, 1.0), zoo::t_joint(14)];
    for (number, (vertices, triangles)) in meshes.into_iter().enumerate() {
        let mesh = Mesh::new(vertices, triangles).unwrap();
        let join = (number == 1).then_some(0.5); // two sheets become one
        let options = OperatorOptions { mass: Mass::Consistent, join, ..Default::default() };
        let built = operator(&mesh, &options).unwrap();
        assert_eq!((built.components, built.pairs_joined > 0), (1, number == 1));
        let (sliced, dense) = (zoo::solve(&built, 200), zoo::solve_dense(&built, 200));
        let apart = zoo::distance(&dense.eigenvalues, &sliced.eigenvalues);
        assert!(apart < 1e-11, "mesh {number}: {apart:e}");
        let c = &sliced.certificate;
        assert!(c.complete && c.residual_max < 1e-10 && c.orthogonality < 1e-11, "{c:?}");
    }
}

#[test]
fn a_vertex_that_follows_two_keeps_the_consistent_mass_orthonormal() {
    let (vertices, triangles) = zoo::rough(20, 16);
    let mesh = Mesh::new(vertices, triangles).unwrap();
    let ties = vec![Tie { vertex: 120, to: vec![(60, 0.25), (200, 0.75)] }, Tie { vertex: 7, to: vec![(120, 1.0)] }];
    for mass in [Mass::Lumped, Mass::Consistent] {
        let built = operator(&mesh, &OperatorOptions { mass, ties: ties.clone(), ..Default::default() }).unwrap();
        let options = mesh_spectrum::EigenOptions { count: 30, ..Default::default() };
        let basis = mesh_spectrum::eigenbasis(&built, &options, &()).unwrap();
        for phi in basis.eigenvectors.chunks(basis.vertices) {
            assert!((phi[120] - 0.25 * phi[60] - 0.75 * phi[200]).abs() < 1e-12 && phi[7] == phi[120]);
            let weighed = built.vertex_mass_times(phi);
            let square: f64 = phi.iter().zip(&weighed).map(|(x, y)| x * y).sum();
            assert!((square - 1.0).abs() < 1e-10, "{mass}: {square}");
        }
    }
}

#[test]
fn with_the_identity_as_mass_vectors_are_orthonormal_in_the_plain_product() {
    let (vertices, triangles) = zoo::rough(30, 20);
    let mesh = Mesh::new(vertices, triangles).unwrap();
    let built = operator(&mesh, &OperatorOptions { mass: Mass::Identity, ..Default::default() }).unwrap();
    assert!(built.vertex_mass.iter().all(|&mass| mass == 1.0));
    let basis = zoo::solve(&built, 60);
    let n = mesh.vertices().len() as f64;
    // The constant vector has length 1.
    assert!(basis.eigenvectors[..basis.vertices].iter().all(|x| (x - 1.0 / n.sqrt()).abs() < 1e-14));
}
