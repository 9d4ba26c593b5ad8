//! Times the eigenbasis of an OBJ mesh: `cargo run --release --example measure -- MESH.obj K [JOIN] [REPEATS]`.
//! `RAYON_NUM_THREADS=1` for one thread. Prints the median of the repeats; the same line as testdata/scipy_eigenvalues.py.

use std::time::Instant;

use mesh_spectrum::{EigenOptions, Mesh, OperatorOptions, eigenbasis, inspect, operator};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = std::fs::read_to_string(&arguments[0])?;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["v", x, y, z] => vertices.push([x.parse()?, y.parse()?, z.parse()?]),
            ["f", a, b, c] => {
                faces.push([a.parse::<u32>()? - 1, b.parse::<u32>()? - 1, c.parse::<u32>()? - 1, c.parse::<u32>()? - 1])
            }
            ["f", a, b, c, d] => {
                faces.push([a.parse::<u32>()? - 1, b.parse::<u32>()? - 1, c.parse::<u32>()? - 1, d.parse::<u32>()? - 1])
            }
            _ => {}
        }
    }
    let count = arguments[1].parse()?;
    let join = arguments.get(2).and_then(|word| word.parse().ok());
    let repeats = arguments.get(3).map_or(Ok(1), |word| word.parse())?;
    let mesh = Mesh::from_faces(vertices, &faces)?;
    let seen = inspect(&mesh);
    println!(
        "components {} gap {:?} edges {:.2} .. {:.2}",
        seen.components, seen.gap, seen.edge_length_mean, seen.edge_length_max
    );
    let start = Instant::now();
    let operator = operator(&mesh, &OperatorOptions { join })?;
    println!("operator {:.4} s, {} dofs", start.elapsed().as_secs_f64(), operator.mass.len());
    let mut times = Vec::new();
    let mut last = None;
    for _ in 0..repeats {
        let start = Instant::now();
        last = Some(eigenbasis(&operator, &EigenOptions { count, ..Default::default() }, &())?);
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let basis = last.expect("at least one repeat");
    let c = &basis.certificate;
    println!(
        "wall {:.4} s (least {:.4}), residual {:.1e} (floor {:.1e}), orthogonality {:.1e}, {} counts, {:?}, lambda_K {:.12e}",
        times[times.len() / 2],
        times[0],
        c.residual_max,
        c.residual_floor,
        c.orthogonality,
        c.counts.len(),
        c.method,
        basis.eigenvalues[basis.eigenvalues.len() - 1],
    );
    println!("{:.3?}", c.seconds);
    Ok(())
}
