//! Surface meshes from files: OBJ, PLY, STL, OFF, VTU and VTP become plain arrays.
//!
//! ```
//! let mesh = mesh_files::parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", mesh_files::Format::Obj)?;
//! assert_eq!(mesh.vertices.len(), 3);
//! assert_eq!(mesh.faces().collect::<Vec<_>>(), [&[0u32, 1, 2]]);
//! # Ok::<(), mesh_files::Fault>(())
//! ```
//!
//! Vertices keep the order of the file, because whatever is computed on them is given back in that order; only STL, which
//! repeats a vertex in each of its triangles, has its equal vertices merged. Faces keep their corners, however many.
//! What is no surface (normals, texture, colours, lines, points) is not read, and said in [`MeshFile::notes`] where it
//! may have been meant.
//!
//! Any bytes give a mesh or an error, never a panic, and never more memory than some multiple of the file; a count in a
//! header is believed once the file is long enough for it. Own readers, because the crates there are do not keep the
//! order of vertices (`tobj`: one numbering an object), take a header's word for an allocation (`stl_io`) or keep a table
//! of names for each vertex (`ply-rs`); XML, base64 and zlib come from well-kept crates.

mod bytes;
mod error;
mod obj;
mod off;
mod ply;
mod stl;
mod text;
mod vtu;

use std::path::Path;

pub use error::{Error, Fault, Place};

/// The formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ: text.
    Obj,
    /// Stanford PLY: text, or binary of either byte order.
    Ply,
    /// Stereolithography: text or binary.
    Stl,
    /// Object File Format of Geomview: text.
    Off,
    /// VTK's XML files of unstructured grids (`.vtu`) and of polygons (`.vtp`), with data as text, base64 or raw, plain or
    /// compressed by zlib.
    Vtu,
}

/// A surface: vertices, and faces as rings of vertices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshFile {
    /// Vertices in the order of the file. They may hold what is no number.
    pub vertices: Vec<[f64; 3]>,
    /// Where each face's corners begin in `corners`, and where the last one's end: one more than faces.
    pub face_start: Vec<usize>,
    /// Corners of all faces, vertex indices from 0, each below the number of vertices.
    pub corners: Vec<u32>,
    /// What was in the file and was not read, one line each.
    pub notes: Vec<String>,
}

impl MeshFile {
    fn new() -> MeshFile {
        MeshFile { face_start: vec![0], ..MeshFile::default() }
    }

    fn end_face(&mut self) {
        self.face_start.push(self.corners.len());
    }

    /// The faces, each a ring of vertex indices from 0.
    pub fn faces(&self) -> impl Iterator<Item = &[u32]> + Clone {
        self.face_start.windows(2).map(|ends| &self.corners[ends[0]..ends[1]])
    }
}

/// Reads a mesh; the format is told by the name's extension, else by the first bytes.
///
/// # Errors
/// [`Error::Io`], [`Error::Unknown`], and [`Error::Fault`] with the place of what is wrong.
pub fn read(path: &Path) -> Result<MeshFile, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })?;
    let format = format_of(path).or_else(|| guess(&bytes)).ok_or_else(|| Error::Unknown { path: path.to_owned() })?;
    parse(&bytes, format).map_err(|fault| Error::Fault { path: path.to_owned(), fault })
}

/// The format that a file's name says.
pub fn format_of(path: &Path) -> Option<Format> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "obj" => Some(Format::Obj),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        "off" => Some(Format::Off),
        "vtu" | "vtp" => Some(Format::Vtu),
        _ => None,
    }
}

/// The format that a file's first bytes say, where they do.
fn guess(bytes: &[u8]) -> Option<Format> {
    let head = bytes.trim_ascii_start();
    let begins = |word: &[u8]| head.starts_with(word);
    if begins(b"ply\n") || begins(b"ply\r") {
        Some(Format::Ply)
    } else if begins(b"<?xml") || begins(b"<VTKFile") {
        Some(Format::Vtu)
    } else if [&b"OFF"[..], b"COFF", b"NOFF", b"CNOFF", b"STOFF"].iter().any(|word| begins(word)) {
        Some(Format::Off)
    } else if begins(b"solid") {
        Some(Format::Stl)
    } else {
        None
    }
}

/// Reads a mesh from the bytes of a file.
///
/// # Errors
/// What is wrong, with the line or the byte; and a file without any face.
pub fn parse(bytes: &[u8], format: Format) -> Result<MeshFile, Fault> {
    let mesh = match format {
        Format::Obj => obj::parse(bytes),
        Format::Ply => ply::parse(bytes),
        Format::Stl => stl::parse(bytes),
        Format::Off => off::parse(bytes),
        Format::Vtu => vtu::parse(bytes),
    }?;
    if mesh.face_start.len() < 2 {
        return Err(Fault::NoFaces { vertices: mesh.vertices.len(), notes: mesh.notes });
    }
    Ok(mesh)
}
