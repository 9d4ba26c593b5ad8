//! Meshes to measure on.

use std::error::Error;

type Parts = (Vec<[f64; 3]>, Vec<[u32; 4]>);

/// A hat-section beam of 120 × 60 × 400: a plate, and a hat on it. With `merged`, the flanges are one sheet with the
/// plate, and three faces meet where the hat leaves it; without, plate and hat are two parts, 2 apart.
pub(crate) fn hat_section(vertices: usize, merged: bool) -> Parts {
    let (width, flange, height, length) = (120.0, 20.0, 60.0, 400.0);
    let top = width - 2.0 * flange;
    let contour = if merged { width + top + 2.0 * height } else { 2.0 * width + 2.0 * height };
    let edge = (contour * length / vertices as f64).sqrt();
    let cells = |length: f64| (length / edge).round().max(1.0) as usize;
    let mut section: Vec<[f64; 2]> = Vec::new();
    let mut segments: Vec<(usize, usize)> = Vec::new();
    // A polyline from an existing point or a new one, through corners, to an existing point or a new one.
    let mut line = |section: &mut Vec<[f64; 2]>, corners: &[[f64; 2]], from: Option<usize>, to: Option<usize>| {
        let mut last = from.unwrap_or_else(|| {
            section.push(corners[0]);
            section.len() - 1
        });
        for (k, pair) in corners.windows(2).enumerate() {
            let n = cells((pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]));
            for i in 1..=n {
                let t = i as f64 / n as f64;
                let next = match to {
                    Some(to) if k + 2 == corners.len() && i == n => to,
                    _ => {
                        section.push([0, 1].map(|c| pair[0][c] + t * (pair[1][c] - pair[0][c])));
                        section.len() - 1
                    }
                };
                segments.push((last, next));
                last = next;
            }
        }
    };
    let (a, b) = (flange, width - flange);
    if merged {
        line(&mut section, &[[0.0, 0.0], [a, 0.0], [b, 0.0], [width, 0.0]], None, None);
        let (left, right) = (cells(flange), cells(flange) + cells(top));
        line(&mut section, &[[a, 0.0], [a, height], [b, height], [b, 0.0]], Some(left), Some(right));
    } else {
        line(&mut section, &[[0.0, 0.0], [width, 0.0]], None, None);
        let z = 2.0;
        let hat = [[0.0, z], [a, z], [a, height], [b, height], [b, z], [width, z]];
        line(&mut section, &hat, None, None);
    }
    let along = cells(length);
    let n = section.len();
    let points = (0..=along).flat_map(|k| {
        let z = length * k as f64 / along as f64;
        section.iter().map(move |p| [p[0], p[1], z]).collect::<Vec<_>>()
    });
    let faces = (0..along).flat_map(|k| {
        let at = move |p: usize, k: usize| (k * n + p) as u32;
        segments.iter().map(move |&(p, q)| [at(p, k), at(q, k), at(q, k + 1), at(p, k + 1)]).collect::<Vec<_>>()
    });
    (points.collect(), faces.collect())
}

/// A closed surface without symmetry: a torus with waves, its grid jittered by a third of a cell.
pub(crate) fn closed(vertices: usize) -> Parts {
    let ny = ((vertices as f64 / 2.5).sqrt().round() as usize).max(3);
    let nx = (vertices / ny).max(3);
    let noise = |i: usize, j: usize, k: usize| {
        let mut z = (i * 0x9E37_79B9 + j * 0x85EB_CA6B + k * 0xC2B2_AE35) as u64;
        z = (z ^ (z >> 15)).wrapping_mul(0x2545_F491_4F6C_DD1D);
        (z >> 40) as f64 / (1u64 << 24) as f64 - 0.5
    };
    let turn = std::f64::consts::TAU;
    let points = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))).map(|(i, j)| {
        let u = turn * (i as f64 + 0.33 * noise(i, j, 0)) / nx as f64;
        let v = turn * (j as f64 + 0.33 * noise(i, j, 1)) / ny as f64;
        let r = 40.0 * (1.0 + 0.2 * (3.0 * u).sin() * (2.0 * v).cos() + 0.1 * (u + 2.0 * v).cos());
        let ring = 100.0 + r * v.cos();
        [ring * u.cos(), ring * u.sin() * 1.3, r * v.sin() + 15.0 * (2.0 * u).sin()]
    });
    let faces = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))).map(|(i, j)| {
        let at = |i: usize, j: usize| (j % ny * nx + i % nx) as u32;
        [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
    });
    (points.collect(), faces.collect())
}

/// Vertices and faces of three or four corners.
pub(crate) fn read_obj(text: &str) -> Result<Parts, Box<dyn Error>> {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let corner = |word: &str| -> Result<u32, Box<dyn Error>> {
            let number: u32 = word.split('/').next().unwrap_or(word).parse()?;
            number.checked_sub(1).ok_or_else(|| "vertices are counted from 1".into())
        };
        match words[..] {
            ["v", x, y, z, ..] => vertices.push([x.parse()?, y.parse()?, z.parse()?]),
            ["f", a, b, c] => faces.push([corner(a)?, corner(b)?, corner(c)?, corner(c)?]),
            ["f", a, b, c, d] => faces.push([corner(a)?, corner(b)?, corner(c)?, corner(d)?]),
            _ => {}
        }
    }
    Ok((vertices, faces))
}
