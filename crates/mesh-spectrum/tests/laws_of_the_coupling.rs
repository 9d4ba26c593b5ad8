//! Laws of vertices that follow others: the spectrum is that of one surface, the mass stays a mass.

use std::f64::consts::PI;

use mesh_spectrum::{
    EigenOptions, Kind, Mass, Mesh, Operator, OperatorError, OperatorOptions, Tie, eigenbasis, operator, ties_of,
};

/// A grid of nx × ny squares over [x0, x1] × [0, 1], split along one diagonal, appended to vertices and triangles.
fn grid(x0: f64, x1: f64, nx: u32, ny: u32, vertices: &mut Vec<[f64; 3]>, triangles: &mut Vec<[u32; 3]>) -> Vec<u32> {
    let first = vertices.len() as u32;
    for j in 0..=ny {
        for i in 0..=nx {
            let x = x0 + (x1 - x0) * f64::from(i) / f64::from(nx);
            vertices.push([x, f64::from(j) / f64::from(ny), 0.0]);
        }
    }
    for j in 0..ny {
        for i in 0..nx {
            let a = first + j * (nx + 1) + i;
            triangles.extend([[a, a + 1, a + nx + 2], [a, a + nx + 2, a + nx + 1]]);
        }
    }
    (first..vertices.len() as u32).collect()
}

/// The plate 2 × 1 in two halves whose meshes do not match at x = 1; the fine half's edge follows the coarse one's.
fn halves() -> (Mesh, Vec<Tie>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let coarse = grid(0.0, 1.0, 20, 20, &mut vertices, &mut triangles);
    let fine = grid(1.0, 2.0, 33, 33, &mut vertices, &mut triangles);
    let on_edge = |vertex: &&u32| vertices[**vertex as usize][0] == 1.0;
    let edge: Vec<u32> = coarse.iter().filter(on_edge).copied().collect();
    let tie = |&vertex: &u32| {
        let y = 20.0 * vertices[vertex as usize][1];
        let at = (y.floor() as usize).min(19);
        Tie { vertex, to: vec![(edge[at], 1.0 - (y - at as f64)), (edge[at + 1], y - at as f64)] }
    };
    let ties = fine.iter().filter(on_edge).map(tie).collect();
    (Mesh::new(vertices, triangles).unwrap(), ties)
}

fn spectrum(operator: &Operator, count: usize) -> Vec<f64> {
    eigenbasis(operator, &EigenOptions { count, ..Default::default() }, &()).unwrap().eigenvalues
}

#[test]
fn two_halves_with_other_meshes_tied_together_sound_like_the_whole() {
    let (mesh, ties) = halves();
    let apart = operator(&mesh, &OperatorOptions::default()).unwrap();
    let tied = operator(&mesh, &OperatorOptions { ties, ..Default::default() }).unwrap();
    assert_eq!((apart.components, tied.components), (2, 1));
    assert_eq!(tied.idle_ties, 0);
    // Both ends and no vertex between them lie on a vertex of the coarse edge.
    assert_eq!((tied.followers.len(), tied.mass.len()), (32, mesh.vertices().len() - 34));
    let mut exact: Vec<f64> =
        (0..8u32).flat_map(|p| (0..8u32).map(move |q| PI * PI * (f64::from(p * p) / 4.0 + f64::from(q * q)))).collect();
    exact.sort_by(f64::total_cmp);
    // The whole plate in one mesh of the coarse half's squares has an error of h² λ / 12 or so: 1 % at the tenth.
    for (found, exact) in spectrum(&tied, 12).iter().zip(&exact) {
        assert!((found - exact).abs() < 0.012 * exact + 1e-9, "{found} for {exact}");
    }
}

#[test]
fn the_mass_stays_a_mass() {
    let (mesh, ties) = halves();
    let tied = operator(&mesh, &OperatorOptions { ties: ties.clone(), ..Default::default() }).unwrap();
    for mass in [&tied.mass, &tied.vertex_mass] {
        assert!((mass.iter().sum::<f64>() - 2.0).abs() < 1e-12, "the area");
        assert!(mass.iter().all(|m| *m >= 0.0));
    }
    assert!(tied.mass.iter().all(|m| *m > 0.0));
    let basis = eigenbasis(&tied, &EigenOptions { count: 30, ..Default::default() }, &()).unwrap();
    let n = mesh.vertices().len();
    for i in 0..30 {
        let a = &basis.eigenvectors[i * n..][..n];
        for tie in &ties {
            let mean: f64 = tie.to.iter().map(|&(vertex, weight)| weight * a[vertex as usize]).sum();
            assert!((a[tie.vertex as usize] - mean).abs() < 1e-12);
        }
        for j in 0..=i {
            let b = &basis.eigenvectors[j * n..][..n];
            let inner: f64 = a.iter().zip(b).zip(&tied.vertex_mass).map(|((a, b), m)| a * b * m).sum();
            assert!((inner - f64::from(u8::from(i == j))).abs() < 1e-10, "orthonormal in the mass on vertices");
        }
    }
    // A field that obeys the ties has the same energy and the same norm on vertices and on degrees of freedom.
    let x: Vec<f64> = (0..tied.mass.len()).map(|at| (at as f64).sin()).collect();
    let energy: f64 = tied.stiffness.times(&x).iter().zip(&x).map(|(l, x)| l * x).sum();
    assert!(energy > 0.0);
    let constant = tied.stiffness.times(&vec![1.0; x.len()]);
    assert!(constant.iter().all(|l| l.abs() < 1e-12), "constants cost nothing");
}

#[test]
fn pairs_by_distance_are_ties_of_one_weight() {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    grid(0.0, 1.0, 12, 12, &mut vertices, &mut triangles);
    let lower = vertices.len();
    grid(0.0, 1.0, 12, 12, &mut vertices, &mut triangles);
    vertices[lower..].iter_mut().for_each(|point| point[2] = 0.05);
    let mesh = Mesh::new(vertices, triangles).unwrap();
    let ties = ties_of(&mesh, 0.06).unwrap();
    assert_eq!(ties.len(), 169);
    let by_distance = operator(&mesh, &OperatorOptions { join: Some(0.06), ..Default::default() }).unwrap();
    let by_ties = operator(&mesh, &OperatorOptions { ties: ties.clone(), ..Default::default() }).unwrap();
    assert_eq!((&by_distance.stiffness, &by_distance.vertex_mass), (&by_ties.stiffness, &by_ties.vertex_mass));
    // Constraints raise eigenvalues, and not beyond as many places as there are constraints (Courant and Fischer).
    let few = operator(&mesh, &OperatorOptions { ties: ties[40..42].to_vec(), ..Default::default() }).unwrap();
    let apart = operator(&mesh, &OperatorOptions::default()).unwrap();
    let (free, held) = (spectrum(&apart, 42), spectrum(&few, 40));
    for k in 0..40 {
        assert!(free[k] <= held[k] + 1e-9 && held[k] <= free[k + 2] + 1e-9, "{k}");
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[test]
fn ties_hold_on_every_discretisation_with_every_mass() {
    let (mesh, ties) = halves();
    // The same mesh of squares, which is what the polygon operator is for.
    let square = |pair: &[[u32; 3]]| [pair[0][0], pair[0][1], pair[0][2], pair[1][2]];
    let squares: Vec<[u32; 4]> = mesh.triangles().chunks(2).map(square).collect();
    let mesh = Mesh::from_faces(mesh.vertices().to_vec(), &squares).unwrap();
    let n = mesh.vertices().len();
    for kind in [Kind::Cotan, Kind::Tufted, Kind::Polygon] {
        for mass in [Mass::Lumped, Mass::Consistent, Mass::Identity] {
            let build = |ties: &[Tie]| {
                operator(&mesh, &OperatorOptions { ties: ties.to_vec(), kind, mass, ..Default::default() }).unwrap()
            };
            let (free, tied) = (build(&[]), build(&ties));
            let x: Vec<f64> = (0..tied.mass.len()).map(|at| (at as f64).sin()).collect();
            let mut u: Vec<f64> = tied.dof_of_vertex.iter().map(|&dof| x[dof as usize]).collect();
            for (vertex, weights) in &tied.followers {
                u[*vertex as usize] = weights.iter().map(|&(dof, weight)| weight * x[dof as usize]).sum();
            }
            // Sums of 1,600 products in another order.
            let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs();
            let energy = dot(&free.stiffness.times(&u), &u);
            assert!(near(dot(&tied.stiffness.times(&x), &x), energy), "{kind} {mass}: L' = Pᵀ L P");
            if let Some(matrix) = &tied.mass_matrix {
                let norm = dot(&free.vertex_mass_times(&u), &u);
                assert!(near(dot(&matrix.times(&x), &x), norm), "{kind} {mass}: M' = Pᵀ M P");
            }
            let total: f64 = free.mass.iter().sum();
            for shared in [&tied.mass, &tied.vertex_mass] {
                assert!(near(shared.iter().sum(), total), "{kind} {mass}: no mass is lost");
            }
            assert!(near(tied.vertex_area.iter().sum(), 2.0), "{kind} {mass}: the area");

            let basis = eigenbasis(&tied, &EigenOptions { count: 20, ..Default::default() }, &()).unwrap();
            assert!(basis.certificate.complete && basis.eigenvalues[1] > 0.0);
            for (i, a) in basis.eigenvectors.chunks_exact(n).enumerate() {
                for tie in &ties {
                    let mean: f64 = tie.to.iter().map(|&(vertex, weight)| weight * a[vertex as usize]).sum();
                    assert!((a[tie.vertex as usize] - mean).abs() < 1e-12, "{kind} {mass}");
                }
                let weighed = tied.vertex_mass_times(a);
                for (j, b) in basis.eigenvectors.chunks_exact(n).enumerate() {
                    let off = dot(&weighed, b) - f64::from(u8::from(i == j));
                    assert!(off.abs() < 1e-10, "{kind} {mass}: orthonormal in M on vertices");
                }
            }
        }
    }
}

#[test]
fn a_piece_that_hangs_between_two_others_by_mass_alone_is_named() {
    // Each corner of the first triangle follows the middle between the other two.
    let corners = |x: f64| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
    let vertices = [0.0, 5.0, 9.0].into_iter().flat_map(corners).collect();
    let mesh = Mesh::new(vertices, vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]]).unwrap();
    let ties: Vec<Tie> = (0..3).map(|vertex| Tie { vertex, to: vec![(3, 0.5), (6, 0.5)] }).collect();
    let build = |mass| operator(&mesh, &OperatorOptions { ties: ties.clone(), mass, ..Default::default() });
    assert_eq!(build(Mass::Lumped).unwrap().components, 2);
    assert_eq!(build(Mass::Consistent), Err(OperatorError::MassAcross { vertex: 3 }));
}
