//! Any bytes give a mesh or an error: noise, good files cut at every byte, good files with any byte changed.

use mesh_files::{Format, MeshFile, parse};
use proptest::prelude::*;

const FORMATS: [Format; 5] = [Format::Obj, Format::Ply, Format::Stl, Format::Off, Format::Vtu];

/// What must hold of whatever is read.
fn law(bytes: &[u8], format: Format) -> Option<MeshFile> {
    match parse(bytes, format) {
        Ok(mesh) => {
            assert!(mesh.face_start.is_sorted() && mesh.face_start.last() == Some(&mesh.corners.len()));
            assert!(mesh.corners.iter().all(|&corner| (corner as usize) < mesh.vertices.len()));
            // Compressed data may be a thousand times its file.
            assert!(mesh.vertices.len() <= 1100 * bytes.len());
            Some(mesh)
        }
        Err(fault) => {
            assert!(!fault.to_string().is_empty());
            None
        }
    }
}

/// Good files, small ones. The VTU files are by VTK 9.7.2 (tests-python/write_meshes.py).
fn good() -> Vec<(Format, Vec<u8>)> {
    let mut files = vec![
        (Format::Obj, b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2/2 3//1 \\\n4\nf -1 -2 -3\n".to_vec()),
        (Format::Off, b"OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n".to_vec()),
        (Format::Ply, b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".to_vec()),
        (Format::Stl, b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n".to_vec()),
    ];
    let mut ply = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n".to_vec();
    ply.extend([0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_be_bytes()));
    ply.push(3);
    ply.extend([0i32, 1, 2].iter().flat_map(|x| x.to_be_bytes()));
    files.push((Format::Ply, ply));
    let mut stl = vec![b' '; 80];
    stl.extend(1u32.to_le_bytes());
    stl.extend([0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    stl.extend([0; 2]);
    files.push((Format::Stl, stl));
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/testdata")).unwrap() {
        let path = entry.unwrap().path();
        if let Some(format) = mesh_files::format_of(&path) {
            files.push((format, std::fs::read(path).unwrap()));
        }
    }
    files
}

#[test]
fn good_files_are_read() {
    for (format, bytes) in good() {
        assert!(law(&bytes, format).is_some(), "{format:?}: {:?}", parse(&bytes, format));
    }
}

#[test]
fn files_cut_at_every_byte() {
    for (format, bytes) in good() {
        for end in 0..bytes.len() {
            law(&bytes[..end], format);
        }
    }
}

#[test]
fn files_with_every_byte_changed() {
    for (format, mut bytes) in good() {
        for at in 0..bytes.len() {
            let kept = bytes[at];
            for byte in [0, b' ', b'9', b'-', 0x7f, 0xff, kept ^ 1, kept ^ 0x80] {
                bytes[at] = byte;
                law(&bytes, format);
            }
            bytes[at] = kept;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn noise(bytes in prop::collection::vec(any::<u8>(), 0..300), format in 0..5usize) {
        law(&bytes, FORMATS[format]);
    }

    /// A good file with a few bytes replaced, taken out or put in, read as any format.
    #[test]
    fn mutations(file in 0..9usize, format in 0..6usize, edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3u8), 1..8)) {
        let files = good();
        let (own, mut bytes) = files[file % files.len()].clone();
        for (at, byte, kind) in edits {
            if bytes.is_empty() { break; }
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                _ => bytes.insert(at, byte),
            }
        }
        law(&bytes, FORMATS.get(format).copied().unwrap_or(own));
    }

    /// Words that mean something to some format, in any order.
    #[test]
    fn words(format in 0..5usize, words in prop::collection::vec(prop::sample::select(&[
        "v", "f", "1", "2", "3", "-1", "0", "1e400", "nan", "/", "\n", "\\\n", "OFF", "ply\n", "format ascii 1.0\n",
        "format binary_little_endian 1.0\n", "element vertex ", "element face ", "99999999999999999999", "4000000000",
        "\nproperty float x", "\nproperty float y", "\nproperty float z", "\nproperty list uchar int vertex_indices", "\nend_header\n",
        "solid", "facet", "outer loop\n", "vertex ", "endloop\n", "<VTKFile>", "<Piece>", "</Piece>", "<AppendedData encoding=\"raw\">_",
    ][..]), 0..60)) {
        law(words.join(" ").as_bytes(), FORMATS[format]);
    }
}
