//! What holds for the spectrum of any mesh, and spectra known in closed form.

mod zoo;

use std::f64::consts::PI;

use mesh_spectrum::{EigenOptions, Method};
use zoo::{
    Parts, book, build, checked, copies, distance, flat_torus, flat_torus_spectrum, icosphere, rough, sheet, solve,
    solve_dense, t_joint, tube,
};

/// Two solutions of one problem: eigenvalues are exact to the square of the residual over the gap, measured 1e-12 λ_K.
const SAME: f64 = 1e-10;

#[test]
fn spectrum_of_the_unit_square_converges_with_second_order() {
    // Free boundary: λ = π²(p² + q²), p, q = 0, 1, 2, …; the error of linear elements is O(h²).
    let error = |cells| (solve(&build(sheet(cells, cells, 1.0, 1.0)), 8).eigenvalues[1] - PI * PI).abs();
    let order = (error(16) / error(32)).log2();
    assert!((1.8..2.2).contains(&order), "expected error ~ h², measured h^{order:.2}");
}

#[test]
fn flat_torus_has_the_spectrum_of_the_five_point_stencil() {
    // The second one is square: eigenvalues are eightfold, as many as a block is wide.
    for (nx, ny, hx, hy) in [(50, 40, 0.7, 0.8), (44, 44, 1.0, 1.0)] {
        let basis = solve(&build(flat_torus(nx, ny, hx, hy)), 300);
        assert_eq!(basis.certificate.method, Method::Sliced);
        let exact = &flat_torus_spectrum(nx, ny, hx, hy)[..300];
        assert!(distance(&basis.eigenvalues, exact) < SAME, "{:e}", distance(&basis.eigenvalues, exact));
        let multiple = exact.windows(2).filter(|pair| pair[1] - pair[0] < 1e-9).count();
        let reported: usize = basis.clusters.iter().map(|cluster| cluster.len() - 1).sum();
        assert_eq!(reported, multiple, "every multiple eigenvalue is marked, and no other");
    }
}

#[test]
fn open_tube_has_waves_around_and_cosines_along() {
    let (side, length, h) = (6, 40, 0.5);
    let basis = solve(&build(tube(side, length, h)), 150);
    let wave = |angle: f64| (2.0 - 2.0 * angle.cos()) / (h * h);
    let around = (0..4 * side).map(|p| wave(2.0 * PI * p as f64 / (4 * side) as f64));
    let mut exact: Vec<f64> =
        around.flat_map(|x| (0..=length).map(move |q| x + wave(PI * q as f64 / length as f64))).collect();
    exact.sort_by(f64::total_cmp);
    assert!(distance(&basis.eigenvalues, &exact[..150]) < SAME);
}

#[test]
fn unit_sphere_has_multiplicities_of_2l_plus_1() {
    let basis = solve(&build(icosphere(4)), 49);
    let mut first = 0;
    for l in 0..7 {
        for k in first..first + 2 * l + 1 {
            let exact = (l * (l + 1)) as f64;
            // The error is O(h² λ): h = 0.07, λ = 42 at most.
            assert!(
                (basis.eigenvalues[k] - exact).abs() <= 0.003 * exact * (1.0 + exact),
                "λ{k} = {}",
                basis.eigenvalues[k]
            );
        }
        first += 2 * l + 1;
    }
    // The icosahedron's symmetry has representations of dimension 3 and 5: l = 1 and l = 2 stay exactly multiple.
    assert_eq!(basis.clusters[..2], [1..4, 4..9]);
}

#[test]
fn closed_sphere_to_degree_twenty() {
    // 10 242 vertices, 441 pairs. The error is O(h² λ), h = 0.035: bands of 2l + 1 stay apart, with nothing between.
    let basis = solve(&build(icosphere(5)), 441);
    assert_eq!(basis.certificate.method, Method::Sliced);
    for l in 0..=20usize {
        let band = &basis.eigenvalues[l * l..(l + 1) * (l + 1)];
        let exact = (l * (l + 1)) as f64;
        assert!(band.iter().all(|e| (e - exact).abs() <= 0.001 * exact * (1.0 + 0.5 * exact)), "l = {l}: {band:?}");
    }
}

#[test]
fn nothing_moves_under_rotation_translation_or_renumbering() {
    let (vertices, triangles) = rough(40, 30);
    let basis = solve(&build((vertices.clone(), triangles.clone())), 100);
    let (s, c) = 0.7f64.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| {
        [c * x - s * y + 11.0, s * x * c + c * y * c - s * z - 5.0, s * s * x + s * c * y + c * z + 3.0]
    };
    let moved = solve(&build((vertices.iter().map(|&v| turn(v)).collect(), triangles.clone())), 100);
    // Coordinates of size 50 are rounded at 1e-14, cotangents at 1e-13 by edges of length 1.
    assert!(distance(&basis.eigenvalues, &moved.eigenvalues) < SAME);

    let n = vertices.len();
    let renumber = |v: u32| (v as usize * 617 % n) as u32; // 617 is prime and no divisor of 1271
    let mut shuffled = vec![[0.0; 3]; n];
    vertices.iter().enumerate().for_each(|(v, &point)| shuffled[renumber(v as u32) as usize] = point);
    let mut turned: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [b, c, a].map(renumber)).collect();
    turned.reverse();
    assert!(distance(&basis.eigenvalues, &solve(&build((shuffled, turned)), 100).eigenvalues) < SAME);
}

#[test]
fn eigenvalues_shrink_with_the_square_of_the_size() {
    let (vertices, triangles) = rough(30, 20);
    let basis = solve(&build((vertices.clone(), triangles.clone())), 60);
    for scale in [1e-6, 25.4, 1e8] {
        let grown = build((vertices.iter().map(|v| v.map(|x| x * scale)).collect(), triangles.clone()));
        let back: Vec<f64> = solve(&grown, 60).eigenvalues.iter().map(|e| e * scale * scale).collect();
        assert!(distance(&basis.eigenvalues, &back) < SAME);
    }
}

#[test]
fn equal_parts_bring_equal_eigenvalues_in_tuples() {
    let part = rough(21, 20);
    let alone = solve(&build(part.clone()), 20);
    for number in [1, 2, 12] {
        let basis = solve(&build(copies(&part, number, 50.0)), 20 * number);
        let expected: Vec<f64> = alone.eigenvalues.iter().flat_map(|&e| vec![e; number]).collect();
        assert!(distance(&basis.eigenvalues, &expected) < SAME);
        if number > 1 {
            assert_eq!(basis.clusters, (0..20).map(|k| k * number..(k + 1) * number).collect::<Vec<_>>());
        }
        // Each vector lives on one part.
        let n = part.0.len();
        for phi in basis.eigenvectors.chunks(number * n) {
            assert_eq!(phi.chunks(n).filter(|part| part.iter().any(|x| *x != 0.0)).count(), 1);
        }
    }
}

#[test]
fn more_equal_modes_than_a_block_is_wide_are_all_found() {
    // Twelve equal pages on one spine: functions that vanish on the spine and sum to zero over the pages are elevenfold,
    // functions that are equal on all pages are simple.
    let basis = solve(&build(book(12, 20, 14)), 150);
    assert_eq!(basis.certificate.method, Method::Sliced);
    // Lowest is a quarter wave over the page's height, zero on the spine; then half a wave along all pages together.
    assert_eq!(basis.clusters[0], 1..12);
    assert!((basis.eigenvalues[1] / (PI / 28.0).powi(2) - 1.0).abs() < 0.01, "second order in 1/14");
    assert!((basis.eigenvalues[12] / (PI / 20.0).powi(2) - 1.0).abs() < 0.01, "second order in 1/20");
    let elevenfold = basis.clusters.iter().filter(|cluster| cluster.len() == 11).count();
    assert!(elevenfold >= 10, "{:?}", basis.clusters);
}

#[test]
fn dense_and_sliced_agree() {
    let meshes: [(Parts, usize); 4] =
        [(rough(34, 25), 250), (t_joint(18), 120), (tube(5, 30, 1.0), 100), (copies(&rough(22, 22), 2, 3.0), 90)];
    for (parts, count) in meshes {
        let built = build(parts);
        let (dense, sliced) = (solve_dense(&built, count), solve(&built, count));
        assert_eq!((dense.certificate.method, sliced.certificate.method), (Method::Dense, Method::Sliced));
        assert!(distance(&dense.eigenvalues, &sliced.eigenvalues) < SAME);
        // Residuals of 1e-11 λ_K over gaps of 1e-5 λ_K: angles of 1e-6, squared.
        let apart = zoo::subspace_distance(&dense, &sliced, &built.vertex_mass, 1e-5);
        assert!(apart < 1e-9, "{apart:e}");
        let next = dense.certificate.next_eigenvalue.zip(sliced.certificate.next_eigenvalue).unwrap();
        assert!((next.0 - next.1).abs() < SAME * next.0);
    }
}

#[test]
fn a_count_that_cuts_a_cluster_is_said() {
    let built = build(flat_torus(24, 24, 1.0, 1.0)); // 0, then four times the same, then four times
    for options in [EigenOptions::default(), EigenOptions { dense_below: usize::MAX, ..Default::default() }] {
        let cut = |count| checked(&built, &EigenOptions { count, ..options.clone() }).certificate.cluster_cut;
        assert_eq!([1, 3, 4, 5, 7, 9].map(cut), [false, true, true, false, true, false]);
    }
}

#[test]
fn more_pairs_than_there_are_gives_all() {
    for parts in [sheet(1, 1, 1.0, 1.0), rough(8, 8), rough(24, 20)] {
        let n = parts.0.len();
        let basis = solve(&build(parts), 5 * n);
        assert_eq!(basis.eigenvalues.len(), n);
        assert_eq!(basis.certificate.next_eigenvalue, None);
    }
}

#[test]
fn most_of_the_pairs_are_found_too() {
    // Between "a few" and "all": the upper half of the spectrum, where Weyl's law no longer holds.
    let built = build(rough(24, 20));
    let all = solve_dense(&built, 525).eigenvalues;
    for count in [200, 250, 262, 263, 400, 520, 524] {
        assert!(distance(&solve(&built, count).eigenvalues, &all[..count]) < SAME);
    }
}

#[test]
fn a_single_triangle() {
    // Legs 1: L = ½ [[2, −1, −1], [−1, 1, 0], [−1, 0, 1]], M = 1/6: λ = 0, 3, 9.
    let basis = solve(&build((vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]])), 500);
    for (computed, exact) in basis.eigenvalues.iter().zip([0.0, 3.0, 9.0]) {
        assert!((computed - exact).abs() < 1e-14);
    }
    assert!(basis.eigenvectors[..3].iter().all(|x| (x - 2f64.sqrt()).abs() < 1e-15), "1/√area");
}
