//! VTU files: the reference mesh of a study, and shapes for ParaView.
//!
//! VTK's XML format with raw appended data, little-endian, 64-bit lengths (VTK file formats, "XML file formats").
//! What is read back is only what this module wrote.

use std::io::Write;
use std::path::Path;

use mesh_spectrum::Mesh;

use super::store;
use crate::Error;
use crate::error::io;
use crate::reference::Reference;

/// Name of the reference mesh in a study's folder.
pub(crate) const FILE: &str = "mesh.vtu";
const TRIANGLE: u8 = 5;

/// A named array of a VTU file.
struct Array<'a> {
    name: &'a str,
    kind: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

/// Writes the reference mesh: points, triangles, `node_id` on points, `face` (index of the shell) on cells.
pub(crate) fn write(reference: &Reference, path: &Path) -> Result<(), Error> {
    let node_ids = Array {
        name: "node_id",
        kind: "Int64",
        components: 1,
        bytes: reference.node_ids.iter().flat_map(|&id| (id as i64).to_le_bytes()).collect(),
    };
    let faces = Array {
        name: "face",
        kind: "Int32",
        components: 1,
        bytes: reference.shell_of_triangle.iter().flat_map(|&face| (face as i32).to_le_bytes()).collect(),
    };
    write_vtu(path, reference.mesh.vertices(), reference.mesh.triangles(), vec![node_ids], vec![faces])
}

/// Writes a shape on the mesh: positions N × 3 and vector fields N × 3 on its points.
///
/// # Errors
/// [`Error::Io`].
pub fn write_shape(
    path: &Path,
    reference: &Reference,
    positions: &[[f64; 3]],
    fields: &[(&str, &[f64])],
) -> Result<(), Error> {
    let node_ids = Array {
        name: "node_id",
        kind: "Int64",
        components: 1,
        bytes: reference.node_ids.iter().flat_map(|&id| (id as i64).to_le_bytes()).collect(),
    };
    let fields = fields.iter().map(|(name, values)| Array {
        name,
        kind: "Float64",
        components: values.len() / positions.len().max(1),
        bytes: values.iter().flat_map(|x| x.to_le_bytes()).collect(),
    });
    write_vtu(
        path,
        positions,
        reference.mesh.triangles(),
        std::iter::once(node_ids).chain(fields).collect(),
        Vec::new(),
    )
}

fn doubles(values: &[[f64; 3]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
}

fn write_vtu(
    path: &Path,
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    point_data: Vec<Array<'_>>,
    cell_data: Vec<Array<'_>>,
) -> Result<(), Error> {
    let points_array = Array { name: "Points", kind: "Float64", components: 3, bytes: doubles(points) };
    let cells = [
        Array {
            name: "connectivity",
            kind: "Int32",
            components: 1,
            bytes: triangles.iter().flatten().flat_map(|&v| (v as i32).to_le_bytes()).collect(),
        },
        Array {
            name: "offsets",
            kind: "Int32",
            components: 1,
            bytes: (1..=triangles.len()).flat_map(|end| (3 * end as i32).to_le_bytes()).collect(),
        },
        Array { name: "types", kind: "UInt8", components: 1, bytes: vec![TRIANGLE; triangles.len()] },
    ];
    let mut offset = 0;
    let mut declare = |array: &Array<'_>| {
        let line = format!(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>\n",
            array.kind, array.name, array.components
        );
        offset += 8 + array.bytes.len();
        line
    };
    let mut head = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n",
    );
    head += &format!("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", points.len(), triangles.len());
    head += &format!("<Points>\n{}</Points>\n", declare(&points_array));
    head += &format!("<Cells>\n{}</Cells>\n", cells.iter().map(&mut declare).collect::<String>());
    head += &format!("<PointData>\n{}</PointData>\n", point_data.iter().map(&mut declare).collect::<String>());
    head += &format!("<CellData>\n{}</CellData>\n", cell_data.iter().map(&mut declare).collect::<String>());
    head += "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    store::write_whole(path, |file| {
        file.write_all(head.as_bytes()).map_err(io("write", path))?;
        for array in std::iter::once(&points_array).chain(&cells).chain(&point_data).chain(&cell_data) {
            file.write_all(&(array.bytes.len() as u64).to_le_bytes()).map_err(io("write", path))?;
            file.write_all(&array.bytes).map_err(io("write", path))?;
        }
        file.write_all(b"\n</AppendedData>\n</VTKFile>\n").map_err(io("write", path))
    })
}

/// Reads the reference mesh back. `parts` are the labels that the study's settings keep.
pub(crate) fn read(path: &Path, parts: Vec<String>) -> Result<Reference, Error> {
    let damaged = |what: &str| Error::Damaged { path: path.to_owned(), what: what.to_owned() };
    let bytes = std::fs::read(path).map_err(io("read", path))?;
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let start =
        bytes.windows(mark.len()).position(|window| window == mark).ok_or_else(|| damaged("no appended data"))?;
    let head = std::str::from_utf8(&bytes[..start]).map_err(|_| damaged("its head is not text"))?;
    let data = &bytes[start + mark.len()..];
    let array = |name: &str| -> Option<&[u8]> {
        let declared = head.split("<DataArray ").find(|line| line.contains(&format!("Name=\"{name}\"")))?;
        let offset: usize = declared.split("offset=\"").nth(1)?.split('"').next()?.parse().ok()?;
        let (length, rest) = data.get(offset..)?.split_first_chunk::<8>()?;
        rest.get(..usize::try_from(u64::from_le_bytes(*length)).ok()?)
    };
    let named = |name: &str| array(name).ok_or_else(|| damaged(&format!("no array '{name}'")));
    let doubles: Vec<f64> = named("Points")?.as_chunks().0.iter().map(|word| f64::from_le_bytes(*word)).collect();
    let indices = |name: &str| {
        Ok::<Vec<u32>, Error>(named(name)?.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect())
    };
    let node_ids: Vec<u64> = named("node_id")?.as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)).collect();
    let vertices = doubles.as_chunks().0.to_vec();
    let triangles: Vec<[u32; 3]> = indices("connectivity")?.as_chunks().0.to_vec();
    let faces = indices("face")?;
    if vertices.len() != node_ids.len() || faces.len() != triangles.len() {
        return Err(damaged("sizes of its arrays do not fit together"));
    }
    let mesh = Mesh::new(vertices, triangles).map_err(|error| damaged(&error.to_string()))?;
    Ok(Reference { mesh, shell_of_triangle: faces, node_ids, parts })
}
