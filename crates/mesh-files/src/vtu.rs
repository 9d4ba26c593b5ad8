//! VTK's XML files: unstructured grids (`.vtu`) and polygons (`.vtp`), all pieces as one surface.
//!
//! The markup is read by an XML parser up to the appended data, which may be raw bytes; [`array`] decodes the arrays.
//! Quadratic cells become polygons with their middle nodes as corners. VTK file formats, "XML file formats".

mod array;

use roxmltree::{Document, Node};

use crate::MeshFile;
use crate::bytes::{Kind, Order};
use crate::error::{Fault, Place, shown};
use array::{Appended, Reader};

pub(crate) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let (markup, appended) = split(bytes)?;
    let document = Document::parse(&markup).map_err(|error| Fault::Expected {
        place: Place::Line(error.pos().row as usize),
        expected: "XML",
        found: error.to_string(),
    })?;
    let file = document.root_element();
    let grid = file.children().find(|node| node.has_tag_name("UnstructuredGrid") || node.has_tag_name("PolyData"));
    let Some(grid) = grid.filter(|_| file.has_tag_name("VTKFile")) else {
        let kind = file.attribute("type").unwrap_or(file.tag_name().name());
        return Err(Fault::NotRead {
            what: format!("VTK's {}", shown(kind.as_bytes())),
            instead: "write an unstructured grid or polygons",
        });
    };
    let reader = reader(file, appended)?;
    let mut surface = Surface::new();
    for piece in grid.children().filter(|node| node.has_tag_name("Piece")) {
        let points = child(piece, "Points")?;
        let points = points
            .children()
            .find(|node| node.has_tag_name("DataArray"))
            .map_or_else(|| Err(missing(points, "Points")), |array| reader.floats(array))?;
        let (points, rest) = points.as_chunks::<3>();
        if !rest.is_empty() {
            let found = format!("{} numbers", 3 * points.len() + rest.len());
            return Err(Fault::Expected { place: place(piece), expected: "three coordinates a point", found });
        }
        let first = surface.mesh.vertices.len();
        surface.mesh.vertices.extend(points);
        if surface.mesh.vertices.len() > u32::MAX as usize {
            return Err(Fault::TooMany { what: "vertices" });
        }
        let cells = |name| -> Result<(Vec<i64>, Vec<i64>, Node), Fault> {
            let cells = child(piece, name)?;
            Ok((reader.integers(named(cells, "connectivity")?)?, reader.integers(named(cells, "offsets")?)?, cells))
        };
        if grid.has_tag_name("PolyData") {
            if let Ok(polygons) = child(piece, "Polys")
                && polygons.children().any(|node| node.has_tag_name("DataArray"))
            {
                let (connectivity, offsets, _) = cells("Polys")?;
                surface.add(&connectivity, &offsets, |_| POLYGON, first)?;
            }
            if let Ok(strips) = child(piece, "Strips")
                && strips.children().any(|node| node.has_tag_name("DataArray"))
            {
                let (connectivity, offsets, _) = cells("Strips")?;
                surface.add(&connectivity, &offsets, |_| STRIP, first)?;
            }
        } else {
            let (connectivity, offsets, cells) = cells("Cells")?;
            let types = reader.integers(named(cells, "types")?)?;
            if types.len() != offsets.len() {
                let found = format!("{} types of {} cells", types.len(), offsets.len());
                return Err(Fault::Expected { place: place(cells), expected: "a type for each cell", found });
            }
            surface.add(&connectivity, &offsets, |cell| types[cell], first)?;
        }
    }
    Ok(surface.finish())
}

/// The markup, and the appended data behind it.
fn split(bytes: &[u8]) -> Result<(String, Option<Appended<'_>>), Fault> {
    let text = |bytes: &[u8]| {
        std::str::from_utf8(bytes).map(str::to_owned).map_err(|error| Fault::Expected {
            place: Place::Byte(error.valid_up_to()),
            expected: "XML in UTF-8",
            found: "bytes that are no text".into(),
        })
    };
    const TAG: &[u8] = b"<AppendedData";
    let Some(at) = bytes.windows(TAG.len()).position(|window| window == TAG) else {
        return Ok((text(bytes)?, None));
    };
    let end = |byte: u8, from: usize| bytes[from..].iter().position(|&b| b == byte).map(|found| from + found);
    let wrong = |offset| Fault::Expected {
        place: Place::Byte(offset),
        expected: "AppendedData with an underscore before the data",
        found: "none".into(),
    };
    let close = end(b'>', at).ok_or_else(|| wrong(at))?;
    let start = end(b'_', close).ok_or_else(|| wrong(close))? + 1;
    let raw = contains(&bytes[at..close], b"raw");
    let markup = text(&bytes[..at])? + "</VTKFile>";
    Ok((markup, Some(Appended { bytes, start, raw })))
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|window| window == word)
}

/// How the file's arrays are coded.
fn reader<'a>(file: Node, appended: Option<Appended<'a>>) -> Result<Reader<'a>, Fault> {
    let wrong =
        |expected, found: &str| Fault::Expected { place: place(file), expected, found: shown(found.as_bytes()) };
    let order = match file.attribute("byte_order").unwrap_or("LittleEndian") {
        "LittleEndian" => Order::Little,
        "BigEndian" => Order::Big,
        other => return Err(wrong("byte_order LittleEndian or BigEndian", other)),
    };
    let header = match file.attribute("header_type").unwrap_or("UInt32") {
        "UInt32" => Kind::U32,
        "UInt64" => Kind::U64,
        other => return Err(wrong("header_type UInt32 or UInt64", other)),
    };
    let compressed = match file.attribute("compressor").unwrap_or_default() {
        "" => false,
        "vtkZLibDataCompressor" => true,
        other => {
            return Err(Fault::NotRead {
                what: format!("the compressor {}", shown(other.as_bytes())),
                instead: "write it with ZLib, or without compression",
            });
        }
    };
    Ok(Reader { order, header, compressed, appended })
}

fn place(node: Node) -> Place {
    Place::Line(node.document().text_pos_at(node.range().start).row as usize)
}

fn missing(node: Node, name: &str) -> Fault {
    let found = format!("{} without {name}", node.tag_name().name());
    Fault::Expected { place: place(node), expected: "the arrays of points and cells", found }
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, Fault> {
    node.children().find(|child| child.has_tag_name(name)).ok_or_else(|| missing(node, name))
}

fn named<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, Fault> {
    let is_it = |child: &Node| child.has_tag_name("DataArray") && child.attribute("Name") == Some(name);
    node.children().find(is_it).ok_or_else(|| missing(node, name))
}

/// VTK's numbers for cells.
const STRIP: i64 = 6;
const POLYGON: i64 = 7;

/// The surface cells so far.
struct Surface {
    mesh: MeshFile,
    lines: usize,
    others: usize,
}

impl Surface {
    fn new() -> Surface {
        Surface { mesh: MeshFile::new(), lines: 0, others: 0 }
    }

    /// Adds a piece's cells; its points begin at `first`.
    fn add(
        &mut self,
        connectivity: &[i64],
        offsets: &[i64],
        kind: impl Fn(usize) -> i64,
        first: usize,
    ) -> Result<(), Fault> {
        let points = self.mesh.vertices.len() - first;
        let mut start = 0;
        for (cell, &end) in offsets.iter().enumerate() {
            let place = Place::Element("cell", cell);
            let ends = usize::try_from(end).ok().filter(|&end| end >= start);
            let nodes = ends.and_then(|end| connectivity.get(start..end)).ok_or_else(|| Fault::Expected {
                place,
                expected: "an offset within the connectivity, not before the last one",
                found: end.to_string(),
            })?;
            start += nodes.len();
            let corner = |&index: &i64| {
                let inside = usize::try_from(index).ok().filter(|&index| index < points);
                let fault = Fault::Index { place, index, vertices: points, from: 0 };
                inside.map(|index| (first + index) as u32).ok_or(fault)
            };
            let corners = nodes.iter().map(corner).collect::<Result<Vec<u32>, Fault>>()?;
            self.add_cell(kind(cell), &corners);
        }
        Ok(())
    }

    fn add_cell(&mut self, kind: i64, c: &[u32]) {
        match (kind, c) {
            (5 | POLYGON | 9, _) => self.ring(c),
            (8, &[a, b, c, d]) => self.ring(&[a, b, d, c]),
            // Every second triangle of a strip is turned over.
            (STRIP, _) => c.windows(3).enumerate().for_each(|(k, t)| match k % 2 {
                0 => self.ring(t),
                _ => self.ring(&[t[1], t[0], t[2]]),
            }),
            (22, &[a, b, c, ab, bc, ca]) => self.ring(&[a, ab, b, bc, c, ca]),
            (23, &[a, b, c, d, ab, bc, cd, da]) => self.ring(&[a, ab, b, bc, c, cd, d, da]),
            (28, &[a, b, c, d, ab, bc, cd, da, m]) => {
                [[a, ab, m, da], [ab, b, bc, m], [m, bc, c, cd], [da, m, cd, d]]
                    .iter()
                    .for_each(|quad| self.ring(quad));
            }
            (1..=4 | 21, _) => self.lines += 1,
            _ => self.others += 1,
        }
    }

    fn ring(&mut self, corners: &[u32]) {
        self.mesh.corners.extend(corners);
        self.mesh.end_face();
    }

    fn finish(mut self) -> MeshFile {
        for (count, what) in [(self.lines, "points and lines"), (self.others, "cells that are no faces (solids?)")] {
            if count > 0 {
                self.mesh.notes.push(format!("{count} {what} are not read"));
            }
        }
        self.mesh
    }
}
