//! Meshes that break other programs. Each works, certified and with a residual of at most max(1e-9, 100 × floor), or is
//! refused with the face or the vertex named.

mod zoo;

use mesh_spectrum::{EigenOptions, Kind, Mass, Mesh, OperatorOptions, eigenbasis, inspect, operator};

type Parts = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Whether it works; the refusal where it does not.
fn outcome((vertices, triangles): &Parts, kind: Kind, mass: Mass) -> Result<(), String> {
    let mesh = Mesh::new(vertices.clone(), triangles.clone()).map_err(|error| error.to_string())?;
    let seen = inspect(&mesh);
    assert!(seen.area.is_finite() && seen.components >= 1);
    let options = OperatorOptions { kind, mass, ..Default::default() };
    let built = operator(&mesh, &options).map_err(|error| error.to_string())?;
    let basis =
        eigenbasis(&built, &EigenOptions { count: 40, ..Default::default() }, &()).map_err(|e| e.to_string())?;
    let certificate = &basis.certificate;
    // Gershgorin's bound of the largest eigenvalue (over ¼ of it for a mass matrix).
    let row = |i: usize| {
        let scaled = |(j, value): (usize, f64)| value.abs() / (built.mass[i] * built.mass[j]).sqrt();
        built.stiffness.row(i).map(scaled).sum::<f64>()
    };
    let most = (0..built.mass.len()).map(row).fold(0.0, f64::max) * if mass == Mass::Consistent { 4.0 } else { 1.0 };
    let last = basis.eigenvalues.last().copied().filter(|&last| last > 0.0).unwrap_or(most);
    let floor = 2.2e-16 * most / last;
    assert!(certificate.complete);
    assert!(
        certificate.residual_max <= (100.0 * floor).max(1e-9),
        "{} with a floor of {floor:e}",
        certificate.residual_max
    );
    assert!(basis.eigenvectors.iter().all(|x| x.is_finite()));
    Ok(())
}

const ALL: [(Kind, Mass); 6] = [
    (Kind::Cotan, Mass::Lumped),
    (Kind::Cotan, Mass::Consistent),
    (Kind::Cotan, Mass::Identity),
    (Kind::Tufted, Mass::Lumped),
    (Kind::Tufted, Mass::Consistent),
    (Kind::Polygon, Mass::Lumped),
];

#[track_caller]
fn works(parts: &Parts) {
    for (kind, mass) in ALL {
        if let Err(refusal) = outcome(parts, kind, mass) {
            panic!("{kind}, {mass}: {refusal}");
        }
    }
}

/// The tufted operator takes it; the others take it or name a vertex or a face.
#[track_caller]
fn works_or_names(parts: &Parts) {
    for (kind, mass) in ALL {
        match outcome(parts, kind, mass) {
            Ok(()) => {}
            Err(refusal) => assert!(
                kind != Kind::Tufted && ["vertex ", "triangle "].iter().any(|word| refusal.starts_with(word)),
                "{kind}, {mass}: {refusal}"
            ),
        }
    }
}

fn scaled((mut vertices, triangles): Parts, factor: f64) -> Parts {
    vertices.iter_mut().flatten().for_each(|x| *x *= factor);
    (vertices, triangles)
}

#[test]
fn zero_area_faces() {
    let (mut vertices, mut triangles) = zoo::rough(25, 20);
    let at = vertices[40];
    vertices.push(at); // a copy of a vertex, and a face between the two and a neighbour
    let copy = vertices.len() as u32 - 1;
    triangles.extend([[40, 41, copy], [40, 41, 41]]);
    // Three vertices on a line.
    let (p, q) = (vertices[100], vertices[101]);
    vertices[102] = std::array::from_fn(|c| 2.0 * q[c] - p[c]);
    triangles.push([100, 101, 102]);
    let parts = (vertices, triangles);
    // Only a face without area uses the copy: the cotangent operators name it, and what to do.
    let refusal = outcome(&parts, Kind::Cotan, Mass::Lumped).unwrap_err();
    assert!(refusal.starts_with(&format!("vertex {copy}: ")) && refusal.contains("tufted"), "{refusal}");
    works_or_names(&parts);
}

#[test]
fn duplicated_and_turned_faces() {
    let (vertices, mut triangles) = zoo::rough(25, 20);
    let again: Vec<[u32; 3]> = triangles.iter().step_by(7).map(|&[a, b, c]| [b, c, a]).collect();
    let over: Vec<[u32; 3]> = triangles.iter().skip(3).step_by(11).map(|&[a, b, c]| [c, b, a]).collect();
    triangles.extend(again.into_iter().chain(over));
    works(&(vertices, triangles));
}

#[test]
fn isolated_vertices_are_named() {
    let (mut vertices, triangles) = zoo::rough(12, 10);
    let lonely = vertices.len();
    vertices.push([1e3; 3]);
    for (kind, mass) in ALL {
        let refusal = outcome(&(vertices.clone(), triangles.clone()), kind, mass).unwrap_err();
        assert!(refusal.starts_with(&format!("vertex {lonely}: ")), "{refusal}");
    }
    let mesh = Mesh::new(vertices, triangles).unwrap();
    let (dropped, kept) = mesh.without_unused_vertices();
    assert_eq!(kept.len(), lonely);
    assert!(operator(&dropped, &OperatorOptions::default()).is_ok());
}

#[test]
fn t_joints_and_books() {
    works(&zoo::t_joint(15));
    works(&zoo::book(7, 20, 6));
}

#[test]
fn a_moebius_strip() {
    let (around, across) = (60u32, 7u32);
    let place = |i: u32, j: u32| {
        let (t, w) = (std::f64::consts::TAU * f64::from(i) / f64::from(around), 0.1 * (f64::from(j) - 3.0));
        let r = 2.0 + w * (0.5 * t).cos();
        [r * t.cos(), r * t.sin(), w * (0.5 * t).sin()]
    };
    let vertices = (0..around).flat_map(|i| (0..across).map(move |j| place(i, j))).collect();
    let at = |i: u32, j: u32| if i < around { i * across + j } else { across - 1 - j };
    let quad =
        |i: u32, j: u32| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let triangles = (0..around).flat_map(|i| (0..across - 1).flat_map(move |j| quad(i, j))).collect();
    works(&(vertices, triangles));
}

#[test]
fn coordinates_of_a_millionth_and_of_a_million() {
    for factor in [1e-6, 1e6, 1e-20, 1e20] {
        works(&scaled(zoo::rough(25, 20), factor));
    }
    // Far from the origin, as whole cars in millimetres are.
    let (mut vertices, triangles) = zoo::rough(25, 20);
    vertices.iter_mut().for_each(|p| p[0] += 1e6);
    works(&(vertices, triangles));
}

#[test]
fn a_single_triangle() {
    works(&(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]));
    works(&(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, 1e-3, 0.0]], vec![[0, 1, 2]]));
    // Without area.
    works_or_names(&(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]], vec![[0, 1, 2]]));
}

#[test]
fn an_edge_ratio_of_a_million() {
    // Cells that grow from 1e-6 to 1 along x; then cells that are all a million times longer than wide.
    let (mut vertices, triangles) = zoo::sheet(30, 20, 30.0, 20.0);
    vertices.iter_mut().for_each(|p| p[0] = 10f64.powf(6.0 * p[0] / 30.0 - 6.0) * 20.0);
    works(&(vertices, triangles));
    let (mut vertices, triangles) = zoo::sheet(30, 20, 30.0, 20.0);
    vertices.iter_mut().for_each(|p| p[0] *= 1e6);
    works_or_names(&(vertices, triangles));
    // A tiny patch in a coarse sheet, all triangles of good shape.
    let (mut vertices, mut triangles) = zoo::sheet(20, 20, 20.0, 20.0);
    let [a, b, c] = triangles.swap_remove(300);
    let mut corners = [a, b, c];
    for _ in 0..20 {
        // The triangle's middle one takes its place, half as large.
        let middle =
            |p: u32, q: u32, v: &[[f64; 3]]| std::array::from_fn(|k| 0.5 * (v[p as usize][k] + v[q as usize][k]));
        let [a, b, c] = corners;
        let first = vertices.len() as u32;
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let point = middle(p, q, &vertices);
            vertices.push(point);
        }
        let [ab, bc, ca] = [first, first + 1, first + 2];
        triangles.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc]]);
        corners = [ab, bc, ca];
    }
    triangles.push(corners);
    works(&(vertices, triangles));
}
