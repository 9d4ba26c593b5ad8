//! Meshes that tests ask for by property.
#![allow(dead_code)] // each test file uses some of them

use mesh_spectrum::{EigenOptions, Eigenbasis, Mesh, Operator, OperatorOptions, eigenbasis, operator};

pub(crate) type Parts = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// A grid of nx × ny cells, each two triangles, periodic in a direction where asked; `place` maps (i, j) to a point.
pub(crate) fn grid(
    nx: usize,
    ny: usize,
    [wrap_x, wrap_y]: [bool; 2],
    place: impl Fn(usize, usize) -> [f64; 3],
) -> Parts {
    let (px, py) = (nx + usize::from(!wrap_x), ny + usize::from(!wrap_y));
    let vertices = (0..py).flat_map(|j| (0..px).map(move |i| (i, j))).map(|(i, j)| place(i, j)).collect();
    let at = |i: usize, j: usize| (i % px + j % py * px) as u32;
    let cells = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        [[a, b, c], [a, c, d]]
    });
    (vertices, triangles.collect())
}

/// A flat sheet of width lx and height ly.
pub(crate) fn sheet(nx: usize, ny: usize, lx: f64, ly: f64) -> Parts {
    grid(nx, ny, [false; 2], |i, j| [lx * i as f64 / nx as f64, ly * j as f64 / ny as f64, 0.0])
}

/// A sheet that nothing is symmetric on: waves and a jitter of a fifth of a cell. Edges are about 1 long.
pub(crate) fn rough(nx: usize, ny: usize) -> Parts {
    grid(nx, ny, [false; 2], |i, j| {
        let noise = |k: usize| (((i * 7919 + j * 104_729 + k * 1_299_709) % 1009) as f64 / 1009.0 - 0.5) * 0.4;
        let (x, y) = (i as f64 + noise(0), j as f64 + noise(1));
        [x, y, 2.0 * (0.3 * x).sin() + (0.17 * x * y / 9.0).cos() + noise(2)]
    })
}

/// A flat torus: a sheet folded twice so that opposite sides meet. Layers lie on each other, which the mesh cannot
/// know, and every cell stays a rectangle of hx × hy. nx and ny even.
pub(crate) fn flat_torus(nx: usize, ny: usize, hx: f64, hy: f64) -> Parts {
    let fold = |i: usize, n: usize| i.min(n - i) as f64;
    grid(nx, ny, [true; 2], |i, j| [hx * fold(i, nx), hy * fold(j, ny), 0.0])
}

/// Its exact discrete spectrum, ascending: on right-angled triangles the cotangent operator is the 5-point stencil.
pub(crate) fn flat_torus_spectrum(nx: usize, ny: usize, hx: f64, hy: f64) -> Vec<f64> {
    let wave = |p: usize, n: usize, h: f64| (2.0 - 2.0 * (std::f64::consts::TAU * p as f64 / n as f64).cos()) / (h * h);
    let mut all: Vec<f64> = (0..nx).flat_map(|p| (0..ny).map(move |q| wave(p, nx, hx) + wave(q, ny, hy))).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// A tube of square cross-section, `side` cells a side, `length` cells long, open at both ends.
pub(crate) fn tube(side: usize, length: usize, h: f64) -> Parts {
    grid(4 * side, length, [true, false], |i, j| {
        let (edge, along) = (i / side % 4, (i % side) as f64);
        let s = side as f64;
        let [x, y] = [[along, 0.0], [s, along], [s - along, s], [0.0, s - along]][edge];
        [h * x, h * y, h * j as f64]
    })
}

/// Points on the unit sphere from an icosahedron whose triangles are quartered `times` times.
pub(crate) fn icosphere(times: usize) -> Parts {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let unit = |p: [f64; 3]| {
        let norm = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        p.map(|x| x / norm)
    };
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        vertices.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]].map(unit));
    }
    let distance = |a: u32, b: u32, v: &[[f64; 3]]| {
        (0..3).map(|k| (v[a as usize][k] - v[b as usize][k]).powi(2)).sum::<f64>().sqrt()
    };
    let near = |a, b| distance(a, b, &vertices) < 1.1; // the edge is 1.0515, the next distance 1.7
    let mut triangles = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            triangles.extend((b + 1..12).filter(|&c| near(a, b) && near(b, c) && near(a, c)).map(|c| [a, b, c]));
        }
    }
    for _ in 0..times {
        let mut middle = std::collections::HashMap::new();
        let mut next = Vec::new();
        for [a, b, c] in triangles {
            let mut mid = |p: u32, q: u32| {
                *middle.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    let (p, q) = (vertices[p as usize], vertices[q as usize]);
                    vertices.push(unit([p[0] + q[0], p[1] + q[1], p[2] + q[2]]));
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = next;
    }
    (vertices, triangles)
}

/// `copies` of the same part, `shift` apart in z.
pub(crate) fn copies((vertices, triangles): &Parts, copies: usize, shift: f64) -> Parts {
    let n = vertices.len() as u32;
    let all = (0..copies).flat_map(|k| vertices.iter().map(move |v| [v[0], v[1], v[2] + shift * k as f64])).collect();
    (all, (0..copies as u32).flat_map(|k| triangles.iter().map(move |t| t.map(|v| v + k * n))).collect())
}

/// Two sheets that meet at right angles along a line: three triangles at each of its edges.
pub(crate) fn t_joint(n: usize) -> Parts {
    let (mut vertices, mut triangles) = sheet(2 * n, n, 2.0 * n as f64, n as f64);
    let first = vertices.len();
    for j in 0..=n {
        vertices.extend((1..=n).map(|k| [n as f64, j as f64, k as f64]));
    }
    let at = |j: usize, k: usize| {
        if k == 0 { (j * (2 * n + 1) + n) as u32 } else { (first + j * n + k - 1) as u32 }
    };
    for j in 0..n {
        for k in 0..n {
            let (a, b, c, d) = (at(j, k), at(j + 1, k), at(j + 1, k + 1), at(j, k + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (vertices, triangles)
}

/// Sheets of length × height cells that share one edge line, like the pages of a book.
pub(crate) fn book(pages: usize, length: usize, height: usize) -> Parts {
    let mut vertices: Vec<[f64; 3]> = (0..=length).map(|j| [0.0, 0.0, j as f64]).collect();
    let mut triangles = Vec::new();
    for page in 0..pages {
        let (s, c) = (std::f64::consts::TAU * page as f64 / pages as f64).sin_cos();
        let first = vertices.len();
        let at = |k: usize, j: usize| if k == 0 { j as u32 } else { (first + (k - 1) * (length + 1) + j) as u32 };
        for k in 1..=height {
            vertices.extend((0..=length).map(|j| [c * k as f64, s * k as f64, j as f64]));
        }
        for k in 0..height {
            for j in 0..length {
                let (a, b, d, e) = (at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1));
                triangles.extend([[a, b, d], [a, d, e]]);
            }
        }
    }
    (vertices, triangles)
}

pub(crate) fn build((vertices, triangles): Parts) -> Operator {
    operator(&Mesh::new(vertices, triangles).unwrap(), &OperatorOptions::default()).unwrap()
}

pub(crate) fn solve(operator: &Operator, count: usize) -> Eigenbasis {
    checked(operator, &EigenOptions { count, ..Default::default() })
}

/// Through the dense solver, whatever the size.
pub(crate) fn solve_dense(operator: &Operator, count: usize) -> Eigenbasis {
    checked(operator, &EigenOptions { count, dense_below: usize::MAX, ..Default::default() })
}

/// Solves, and measures the laws of every basis again, from the definitions and on vertices.
pub(crate) fn checked(operator: &Operator, options: &EigenOptions) -> Eigenbasis {
    let basis = eigenbasis(operator, options, &()).unwrap();
    let (n, k) = (basis.vertices, basis.eigenvalues.len());
    assert_eq!((n, k), (operator.vertex_mass.len(), options.count.min(operator.mass.len())));
    assert_eq!(basis.eigenvectors.len(), k * n);
    assert!(basis.eigenvalues.is_sorted());
    assert_eq!(basis.eigenvalues.iter().filter(|&&e| e == 0.0).count(), operator.components.min(k));
    assert!(basis.certificate.complete);

    let phi: Vec<&[f64]> = basis.eigenvectors.chunks(n).collect();
    let weighted: Vec<Vec<f64>> = phi.iter().map(|phi| operator.vertex_mass_times(phi)).collect();
    for (i, a) in phi.iter().enumerate() {
        for (j, weighted) in weighted[..=i].iter().enumerate() {
            let inner: f64 = a.iter().zip(weighted).map(|(a, b)| a * b).sum();
            let off = (inner - if i == j { 1.0 } else { 0.0 }).abs();
            assert!(off <= 1e-10, "φ{i} M φ{j} is off by {off:e}; 1e-10 is promised");
        }
    }
    let last = basis.eigenvalues[k - 1];
    for (phi, eigenvalue) in phi.iter().zip(&basis.eigenvalues) {
        let mut on_dofs = vec![0.0; operator.mass.len()];
        operator.dof_of_vertex.iter().zip(*phi).for_each(|(&dof, &x)| on_dofs[dof as usize] = x);
        let l_phi = operator.stiffness.times(&on_dofs);
        let m_phi = match &operator.mass_matrix {
            Some(mass) => mass.times(&on_dofs),
            None => on_dofs.iter().zip(&operator.mass).map(|(x, m)| x * m).collect(),
        };
        // With a mass matrix this is the norm of its row sums' inverse, which is at most twice as small.
        let square = |i: usize| (l_phi[i] - eigenvalue * m_phi[i]).powi(2) / operator.mass[i];
        let residual = (0..on_dofs.len()).map(square).sum::<f64>().sqrt();
        let allowed = options.tolerance.max(basis.certificate.residual_floor) * last;
        assert!(
            last == 0.0 || residual <= 1.01 * allowed,
            "residual {residual:e} of {allowed:e} allowed; the sums round otherwise"
        );
    }
    basis
}

/// The largest distance between two spectra, relative to the largest eigenvalue.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / a[a.len() - 1]
}

/// How far the spaces of two bases are apart, space by space: eigenvalues are grouped where a gap is wider than
/// `gap` × λ_K (the last group is left out, because K may cut it), and ‖P_a − P_b‖² / 2 = size − ‖Aᵀ M B‖².
pub(crate) fn subspace_distance(a: &Eigenbasis, b: &Eigenbasis, vertex_mass: &[f64], gap: f64) -> f64 {
    let (n, k) = (a.vertices, a.eigenvalues.len());
    let mut worst = 0.0f64;
    let mut start = 0;
    for end in 1..k {
        if a.eigenvalues[end] - a.eigenvalues[end - 1] <= gap * a.eigenvalues[k - 1] {
            continue;
        }
        let mut shared = 0.0;
        for i in start..end {
            for j in start..end {
                let (x, y) = (&a.eigenvectors[i * n..][..n], &b.eigenvectors[j * n..][..n]);
                shared += x.iter().zip(y).zip(vertex_mass).map(|((x, y), m)| x * y * m).sum::<f64>().powi(2);
            }
        }
        worst = worst.max(((end - start) as f64 - shared).abs());
        start = end;
    }
    worst
}
