//! What holds for stiffness and mass of any mesh.

mod zoo;

use mesh_spectrum::{Mesh, OperatorOptions, inspect, join, operator};
use zoo::{build, copies, rough, sheet, t_joint, tube};

#[test]
fn constants_cost_nothing_and_the_stiffness_is_symmetric_and_semidefinite() {
    for parts in [rough(9, 7), t_joint(5), tube(3, 8, 0.5), copies(&rough(4, 4), 3, 9.0)] {
        let built = build(parts);
        let l = &built.stiffness;
        let n = l.rows();
        for row in 0..n {
            let (sum, size) = l.row(row).fold((0.0, 0.0), |(sum, size), (_, x)| (sum + x, size + x.abs()));
            assert!(
                f64::abs(sum) <= 1e-15 * 8.0 * size,
                "a row of L sums to 0 but for the rounding of its eight terms"
            );
            for (column, value) in l.row(row) {
                let mirrored = l.row(column).find(|entry| entry.0 == row).map(|entry| entry.1);
                assert_eq!(mirrored, Some(value), "symmetric to the last bit");
            }
        }
        for seed in 1..20 {
            let x: Vec<f64> = (0..n).map(|i| (i * i * seed % 1009) as f64 - 504.0).collect();
            let energy: f64 = l.times(&x).iter().zip(&x).map(|(a, b)| a * b).sum();
            assert!(energy >= 0.0);
        }
    }
}

#[test]
fn mass_sums_to_the_area() {
    let mesh = |(vertices, triangles)| Mesh::new(vertices, triangles).unwrap();
    for mesh in [mesh(rough(9, 7)), mesh(t_joint(5)), mesh(sheet(4, 4, 2.0, 3.0))] {
        let built = operator(&mesh, &OperatorOptions::default()).unwrap();
        let area = inspect(&mesh).area;
        assert!(
            (built.mass.iter().sum::<f64>() / area - 1.0).abs() < 1e-14,
            "sums of the same triangles in another order"
        );
        assert_eq!(built.mass, built.vertex_mass);
    }
}

#[test]
fn a_t_joint_has_edges_with_three_triangles() {
    let (vertices, triangles) = t_joint(5);
    let seen = inspect(&Mesh::new(vertices, triangles).unwrap());
    assert_eq!((seen.non_manifold_edges, seen.components), (5, 1));
    assert!((seen.area - 75.0).abs() < 1e-12);
    assert!((seen.boundary_length - (30.0 + 15.0)).abs() < 1e-12, "plate 30, rib three sides of 5");
}

#[test]
fn parallel_plates_joined_are_one_surface() {
    let (vertices, triangles) = copies(&sheet(12, 8, 120.0, 80.0), 2, 2.0); // mm, 2 mm apart
    let mesh = Mesh::new(vertices, triangles).unwrap();
    let seen = inspect(&mesh);
    assert_eq!((seen.components, seen.gap_median, seen.gap), (2, Some(2.0), Some(2.5)));
    let joined = join(&mesh, seen.gap.unwrap()).unwrap();
    assert_eq!((joined.pairs, joined.dofs), (13 * 9, 13 * 9));

    let apart = operator(&mesh, &OperatorOptions::default()).unwrap();
    let one = operator(&mesh, &OperatorOptions { join: seen.gap, ..Default::default() }).unwrap();
    assert_eq!((apart.components, one.components), (2, 1));
    assert!((one.mass.iter().sum::<f64>() - 2.0 * 9600.0).abs() < 1e-9);
    assert_eq!(one.vertex_mass, apart.vertex_mass);
    // Twice the stiffness and twice the mass of one plate: its spectrum, with one zero.
    let (one, plate) = (zoo::solve(&one, 20), zoo::solve(&build(sheet(12, 8, 120.0, 80.0)), 20));
    assert!(zoo::distance(&one.eigenvalues, &plate.eigenvalues) < 1e-12, "two dense solutions of 117 unknowns");
}
