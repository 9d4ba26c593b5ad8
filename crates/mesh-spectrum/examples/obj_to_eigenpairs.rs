//! An OBJ file in (or PLY, STL, OFF, VTU), eigenpairs with residuals out. A small sheet of its own if none is named:
//!
//! ```text
//! cargo run --release -p mesh-spectrum --example obj_to_eigenpairs -- part.obj 20
//! ```

use mesh_spectrum::{EigenOptions, Mesh, OperatorOptions, eigenbasis, inspect, operator};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = match arguments.next() {
        Some(path) => mesh_files::read(path.as_ref())?,
        None => mesh_files::parse(sheet(30, 20).as_bytes(), mesh_files::Format::Obj)?,
    };
    let count = arguments.next().map_or(Ok(10), |count| count.parse())?;

    // 1. Arrays become a mesh; vertices that no face uses have no place in the operator.
    let (mesh, _) = Mesh::from_polygons(file.vertices.clone(), file.faces())?.without_unused_vertices();

    // 2. What is it like, and which operator suits it?
    let seen = inspect(&mesh);
    println!("{} vertices, {} pieces, area {:.6}", mesh.vertices().len(), seen.components, seen.area);
    seen.reasons.iter().for_each(|reason| println!("note: {reason}"));

    // 3. Stiffness L and mass M.
    let operator = operator(&mesh, &OperatorOptions { kind: seen.recommended(), ..Default::default() })?;

    // 4. The lowest pairs of L φ = λ M φ, certified complete by inertia counts.
    let basis = eigenbasis(&operator, &EigenOptions { count, ..Default::default() }, &())?;

    // 5. Each residual ‖L φ − λ M φ‖ in the M⁻¹ norm, over the largest eigenvalue, measured here once more.
    let largest = basis.eigenvalues.last().copied().unwrap_or(1.0).max(f64::MIN_POSITIVE);
    println!("{:>4} {:>22} {:>12}", "", "eigenvalue", "residual");
    for (number, (eigenvalue, phi)) in
        basis.eigenvalues.iter().zip(basis.eigenvectors.chunks(basis.vertices)).enumerate()
    {
        let square = |((s, x), m): ((&f64, &f64), &f64)| (s - eigenvalue * m * x).powi(2) / m;
        let stiff = operator.stiffness.times(phi);
        let residual = stiff.iter().zip(phi).zip(&operator.mass).map(square).sum::<f64>().sqrt() / largest;
        println!("{:>4} {eigenvalue:>22.15e} {residual:>12.1e}", number + 1);
        assert!(residual <= basis.certificate.residual_floor.max(1.01e-10));
    }
    let certificate = &basis.certificate;
    println!("none missing: {}; orthogonal to {:.1e}", certificate.complete, certificate.orthogonality);
    Ok(())
}

/// A sheet of 3 × 2 as an OBJ file: λ = π² (p²/9 + q²/4).
fn sheet(nx: usize, ny: usize) -> String {
    let corner = |i: usize, j: usize| format!("v {} {} 0\n", 3.0 * i as f64 / nx as f64, 2.0 * j as f64 / ny as f64);
    let face = |i: usize, j: usize| {
        let a = j * (nx + 1) + i + 1;
        format!("f {a} {} {} {}\n", a + 1, a + nx + 2, a + nx + 1)
    };
    let corners = (0..=ny).flat_map(|j| (0..=nx).map(move |i| corner(i, j)));
    corners.chain((0..ny).flat_map(|j| (0..nx).map(move |i| face(i, j)))).collect()
}
