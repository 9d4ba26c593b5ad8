//! STL: triangles without shared vertices, as text or binary. Vertices that are equal, bit for bit (0 and −0 alike), are
//! merged; the order is that in which they come first.

use std::collections::HashMap;

use crate::MeshFile;
use crate::bytes::{Cursor, Kind, Order};
use crate::error::{Fault, Place};
use crate::text::{lines, point, words};

/// Bytes before the count of a binary file, and bytes a triangle: normal, three corners, two bytes of attributes.
const HEAD: usize = 80;
const TRIANGLE: usize = 50;

pub(crate) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    // A binary file may begin with `solid` too; its length tells. Text holds `facet`, or ends its empty solid.
    let is_text = bytes.trim_ascii_start().starts_with(b"solid")
        && counted(bytes) != Some(bytes.len())
        && ["facet", "endsolid"].iter().any(|word| contains(bytes, word.as_bytes()));
    if is_text { text(bytes) } else { binary(bytes) }
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|window| window == word)
}

/// The length that a binary file says it has.
fn counted(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEAD..HEAD + 4)?;
    Some(HEAD + 4 + TRIANGLE * Kind::U32.integer(count, Order::Little) as usize)
}

fn binary(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut cursor = Cursor::new(bytes, 0);
    cursor.take(HEAD, "the head of a binary STL file")?;
    let count = Kind::U32.integer(cursor.take(4, "the number of triangles")?, Order::Little) as usize;
    let body = cursor.take(TRIANGLE.saturating_mul(count), "triangles")?;
    let mut merged = Merged::default();
    for triangle in body.as_chunks::<TRIANGLE>().0 {
        for corner in triangle[12..48].as_chunks::<12>().0 {
            let x = |c: usize| Kind::F32.float(&corner[4 * c..4 * c + 4], Order::Little);
            merged.add([x(0), x(1), x(2)])?;
        }
        merged.mesh.end_face();
    }
    if cursor.left() > 0 {
        merged.mesh.notes.push(format!("{} bytes after the last triangle are not read", cursor.left()));
    }
    Ok(merged.mesh)
}

fn text(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut merged = Merged::default();
    let mut corners = 0;
    for (at, line) in lines(bytes) {
        let place = Place::Line(at);
        let mut rest = words(line);
        let word = rest.next().map(<[u8]>::to_ascii_lowercase);
        match word.as_deref() {
            Some(b"vertex") => {
                merged.add(point(&mut rest, place)?)?;
                corners += 1;
            }
            Some(b"outer") if corners > 0 => return Err(open_loop(place)),
            Some(b"endloop") => {
                if corners > 0 {
                    merged.mesh.end_face();
                }
                corners = 0;
            }
            _ => {}
        }
    }
    if corners > 0 {
        return Err(open_loop(Place::Line(lines(bytes).count())));
    }
    Ok(merged.mesh)
}

fn open_loop(place: Place) -> Fault {
    Fault::Expected { place, expected: "endloop", found: "a facet that is not finished".into() }
}

/// A mesh whose equal vertices are one.
struct Merged {
    mesh: MeshFile,
    number_of: HashMap<[u64; 3], u32>,
}

impl Default for Merged {
    fn default() -> Merged {
        Merged { mesh: MeshFile::new(), number_of: HashMap::new() }
    }
}

impl Merged {
    /// Adds a corner to the face that is open.
    fn add(&mut self, point: [f64; 3]) -> Result<(), Fault> {
        let next = u32::try_from(self.mesh.vertices.len()).map_err(|_| Fault::TooMany { what: "vertices" })?;
        let vertices = &mut self.mesh.vertices;
        let corner = *self.number_of.entry(point.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            vertices.push(point.map(|x| x + 0.0)); // −0 becomes 0
            next
        });
        self.mesh.corners.push(corner);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a square; one corner is −0 where the other is 0.
    const SQUARE: [[[f32; 3]; 3]; 2] =
        [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], [[-0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]];

    fn as_binary(head: &[u8]) -> Vec<u8> {
        let mut bytes = head.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(2u32.to_le_bytes());
        for triangle in SQUARE {
            bytes.extend([0; 12]);
            triangle.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn text_and_binary_hold_the_same_mesh() {
        let facet = |t: [[f32; 3]; 3]| {
            let corner = |p: [f32; 3]| format!("   vertex {} {} {}\n", p[0], p[1], p[2]);
            format!(" facet normal 0 0 1\n  outer loop\n{}  endloop\n endfacet\n", t.map(corner).concat())
        };
        let text = format!("solid square\n{}endsolid square\n", SQUARE.map(facet).concat());
        let read = parse(text.as_bytes()).unwrap();
        assert_eq!((read.vertices.len(), read.corners.as_slice()), (4, &[0, 1, 2, 0, 2, 3][..]));
        assert_eq!(parse(&as_binary(b"made by hand")).unwrap(), read);
        assert_eq!(parse(&as_binary(b"solid facet, says the head")).unwrap(), read, "the length tells");
    }

    #[test]
    fn faults_name_the_place() {
        let mut cut = as_binary(b"");
        cut.truncate(150);
        assert_eq!(
            parse(&cut).unwrap_err().to_string(),
            "byte 84: triangles: 100 bytes expected, 66 left; the file is cut short or its header is wrong"
        );
        let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n";
        assert_eq!(
            parse(text.as_bytes()).unwrap_err().to_string(),
            "line 4: nothing there; expected three coordinates"
        );
        assert!(parse(b"solid a\nfacet\nouter loop\nvertex 0 0 0\n").unwrap_err().to_string().contains("endloop"));
    }
}
