//! Measures the eigenbasis of a mesh, and writes L and M for others to solve: what `just bench-eigen` runs.
//!
//! `cargo run --release --example measure -- MESH K [--full] [--dump FOLDER] [--rates]`
//!
//! MESH is an OBJ file, or `hat:N`, `hat-apart:N` (a hat-section beam of about N vertices, its flanges merged with the
//! plate or not), `closed:N` (an irregular closed surface). `RAYON_NUM_THREADS=1` for one thread. Prints one line of
//! JSON.

mod shapes;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use faer::{Accum, Mat, Par};
use mesh_spectrum::{EigenOptions, Mesh, Operator, OperatorOptions, Orthogonality, eigenbasis, operator};
use serde_json::json;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let flag = |name: &str| arguments.iter().any(|word| word == name);
    let after = |name: &str| arguments.iter().position(|word| word == name).and_then(|at| arguments.get(at + 1));
    let [mesh, count, ..] = &arguments[..] else { return Err("MESH and K are needed".into()) };

    let (vertices, faces) = match mesh.split_once(':') {
        Some(("hat", n)) => shapes::hat_section(n.parse()?, true),
        Some(("hat-apart", n)) => shapes::hat_section(n.parse()?, false),
        Some(("closed", n)) => shapes::closed(n.parse()?),
        _ => shapes::read_obj(&std::fs::read_to_string(mesh)?)?,
    };
    let mesh = Mesh::from_faces(vertices, &faces)?;
    let operator = operator(&mesh, &OperatorOptions::default())?;
    if let Some(folder) = after("--dump") {
        return dump(&operator, Path::new(folder));
    }
    let orthogonality = if flag("--full") { Orthogonality::Full } else { Orthogonality::Standard };
    let options = EigenOptions { count: count.parse()?, orthogonality, ..Default::default() };
    let start = Instant::now();
    let basis = eigenbasis(&operator, &options, &())?;
    let wall = start.elapsed().as_secs_f64();
    let c = &basis.certificate;
    let s = &c.seconds;
    println!(
        "{}",
        json!({
            "vertices": basis.vertices,
            "pairs": basis.eigenvalues.len(),
            "wall": wall,
            "residual": c.residual_max,
            "residual_floor": c.residual_floor,
            "orthogonality": c.orthogonality,
            "certified": c.complete,
            "missing": 0,
            "factorisations": c.factorisations,
            "solves": c.solves,
            "peak_bytes_expected": c.peak_bytes,
            "seconds": {
                "order": s.order, "factor": s.factor, "solve": s.solve, "orthogonalise": s.orthogonalise,
                "project": s.project, "vectors": s.vectors, "certify": s.certify, "output": s.output,
            },
            "gigaflops": if flag("--rates") { Some(gigaflops()) } else { None },
            "last_eigenvalue": basis.eigenvalues.last(),
        })
    );
    Ok(())
}

/// 10⁹ operations a second of a dense product, one thread, the best of five.
fn gigaflops() -> f64 {
    let n = 1000;
    let (a, mut c) = (Mat::from_fn(n, n, |i, j| (i + j) as f64), Mat::zeros(n, n));
    let time = (0..5).map(|_| {
        let start = Instant::now();
        faer::linalg::matmul::matmul(c.as_mut(), Accum::Replace, a.as_ref(), a.as_ref(), 1.0, Par::Seq);
        start.elapsed().as_secs_f64()
    });
    2.0 * (n * n * n) as f64 / time.fold(f64::INFINITY, f64::min) * 1e-9
}

/// L in compressed rows and M's diagonal, as raw arrays.
fn dump(operator: &Operator, folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let l = &operator.stiffness;
    let bytes = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    std::fs::write(
        folder.join("start.i64"),
        l.start.iter().flat_map(|&x| (x as i64).to_le_bytes()).collect::<Vec<_>>(),
    )?;
    std::fs::write(folder.join("columns.i32"), l.columns.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>())?;
    std::fs::write(folder.join("values.f64"), bytes(&l.values))?;
    std::fs::write(folder.join("mass.f64"), bytes(&operator.mass))?;
    Ok(())
}
