//! Wavefront OBJ: `v x y z` and `f a b c …`, corners as `a`, `a/t`, `a/t/n` or `a//n`, from 1, or back from the last
//! vertex so far when negative.

use crate::MeshFile;
use crate::error::{Fault, Place};
use crate::text::{lines, number, point, words};

pub(crate) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut mesh = MeshFile::new();
    // The highest vertex named, and where: a face may name vertices that come after it.
    let mut highest = (0, 0);
    let mut others = 0;
    let mut joined: Vec<u8> = Vec::new();
    for (at, line) in lines(bytes) {
        // A line that ends in a backslash goes on in the next.
        if let Some(part) = line.trim_ascii_end().strip_suffix(b"\\") {
            joined.extend(part);
            joined.push(b' ');
            continue;
        }
        let before = std::mem::take(&mut joined);
        let whole = if before.is_empty() { before } else { [&before[..], line].concat() };
        let line = if whole.is_empty() { line } else { &whole[..] };
        let place = Place::Line(at);
        let mut rest = words(line);
        match rest.next() {
            Some(b"v") => mesh.vertices.push(point(&mut rest, place)?),
            Some(b"f") => {
                for word in rest {
                    let first = word.split(|&byte| byte == b'/').next();
                    let index: i64 = number(first, place, "the number of a vertex")?;
                    let from_zero = if index > 0 { index - 1 } else { mesh.vertices.len() as i64 + index };
                    let fault = || Fault::Index { place, index, vertices: mesh.vertices.len(), from: 1 };
                    let corner = u32::try_from(from_zero).ok().filter(|_| index != 0).ok_or_else(fault)?;
                    if corner >= highest.0 {
                        highest = (corner, at);
                    }
                    mesh.corners.push(corner);
                }
                mesh.end_face();
            }
            Some(b"l" | b"p" | b"curv" | b"surf") => others += 1,
            _ => {}
        }
    }
    if mesh.vertices.len() > u32::MAX as usize {
        return Err(Fault::TooMany { what: "vertices" });
    }
    if !mesh.corners.is_empty() && highest.0 as usize >= mesh.vertices.len() {
        let (index, place) = (i64::from(highest.0) + 1, Place::Line(highest.1));
        return Err(Fault::Index { place, index, vertices: mesh.vertices.len(), from: 1 });
    }
    if others > 0 {
        mesh.notes.push(format!("{others} lines, points, curves or free-form surfaces are not read"));
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_exporters_write() {
        let text = b"# \xe9\nmtllib a.mtl\no part\nv 0 0 0 1.0\r\nv 1 0 0 0.5 0.5 0.5\nvn 0 0 1\nv 1e0 1 0\nv 0 1 0\nf 1/1/1 2//1 3/3 \\\n 4\nf -4 -3 -2\nl 1 2\n";
        let mesh = parse(text).unwrap();
        assert_eq!(mesh.vertices, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(mesh.faces().collect::<Vec<_>>(), [&[0u32, 1, 2, 3][..], &[0, 1, 2]]);
        assert_eq!(mesh.notes.len(), 1);
        assert_eq!(parse(&text.map(|byte| if byte == b'\n' { b'\r' } else { byte })).unwrap().vertices.len(), 4);
    }

    #[test]
    fn faults_name_the_line() {
        let fault = |text: &str| parse(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(fault("v 0 0\n"), "line 1: nothing there; expected three coordinates");
        assert_eq!(fault("v 0 0 0\nf 1 x 1\n"), "line 2: 'x'; expected the number of a vertex");
        assert_eq!(fault("v 0 0 0\nf 1 2 1\n\n"), "line 2: a face names vertex 2, there are 1 (numbered from 1)");
        assert_eq!(fault("v 0 0 0\nf 0 1 1\n"), "line 2: a face names vertex 0, there are 1 (numbered from 1)");
        assert_eq!(fault("v 0 0 0\nf -2 1 1\n"), "line 2: a face names vertex -2, there are 1 (numbered from 1)");
    }
}
