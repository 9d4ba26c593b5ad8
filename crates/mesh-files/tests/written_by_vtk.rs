//! Files that VTK wrote, in every coding, are the mesh that was written (tests-python/write_meshes.py, vtk 9.7.2).

use std::path::Path;

const POINTS: [[f64; 3]; 7] = [
    [0.0, 0.0, 0.125],
    [1.0, 0.0, 0.0],
    [2.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
    [2.0, 1.0, 0.0],
    [3.0, 0.5, 0.1],
];

fn read(name: &str) -> mesh_files::MeshFile {
    mesh_files::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata").join(name)).unwrap()
}

#[test]
fn unstructured_grids_in_every_coding() {
    let mut seen = 0;
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/testdata")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".vtu") {
            let mesh = read(&name);
            // As text VTK writes digits that may round.
            let apart = mesh.vertices.iter().flatten().zip(POINTS.iter().flatten()).map(|(a, b)| (a - b).abs());
            assert!(mesh.vertices.len() == 7 && apart.fold(0.0, f64::max) < 1e-12, "{name}: {:?}", mesh.vertices);
            assert_eq!(mesh.faces().collect::<Vec<_>>(), [&[0u32, 1, 4, 3][..], &[1, 2, 5, 4], &[2, 6, 5]], "{name}");
            seen += 1;
        }
    }
    assert_eq!(seen, 13);
}

#[test]
fn polygons_ply_and_stl() {
    let polygons = read("polygons.vtp");
    assert_eq!((polygons.vertices.len(), polygons.corners.len()), (7, 11));
    for name in ["ascii.ply", "binary.ply", "ascii.stl", "binary.stl"] {
        let mesh = read(name);
        assert_eq!((mesh.vertices.len(), mesh.faces().count()), (7, 5), "{name}");
        assert!(POINTS.iter().all(|p| mesh.vertices.iter().any(|q| (0..3).all(|c| (p[c] - q[c]).abs() < 1e-6))));
    }
}
