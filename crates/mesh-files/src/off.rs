//! OFF: an optional keyword, three counts, a line a vertex, a line a face. `COFF`, `NOFF`, `STOFF` and their
//! combinations have more columns, which are not read.

use crate::MeshFile;
use crate::error::{Fault, Place, shown};
use crate::text::{lines, number, point, words};

pub(crate) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let without_comment = |line: &'_ [u8]| line.iter().position(|&byte| byte == b'#').unwrap_or(line.len());
    let mut content = lines(bytes)
        .map(|(at, line)| (Place::Line(at), &line[..without_comment(line)]))
        .filter(|(_, line)| !line.trim_ascii().is_empty());
    let mut last = Place::Line(1);
    let mut line = |expected: &'static str| {
        let end = Fault::Expected { place: last, expected, found: "the file ends here".into() };
        let (place, line) = content.next().ok_or(end)?;
        last = place;
        Ok((place, line))
    };

    let (mut place, mut counts) = line("OFF")?;
    let mut rest = words(counts).peekable();
    if let Some(keyword) = rest.next_if(|word| !word[0].is_ascii_digit() || word.ends_with(b"OFF")) {
        let known = keyword
            .strip_suffix(b"OFF")
            .is_some_and(|more| matches!(more, b"" | b"C" | b"N" | b"CN" | b"ST" | b"STC" | b"STN" | b"STCN"));
        if !known {
            let shown = shown(keyword);
            return Err(match keyword.ends_with(b"OFF") {
                true => Fault::NotRead { what: format!("{shown} (other than three dimensions)"), instead: "write OFF" },
                false => Fault::Expected { place, expected: "OFF", found: shown },
            });
        }
        if rest.peek() == Some(&&b"BINARY"[..]) {
            return Err(Fault::NotRead { what: "binary OFF".into(), instead: "write OFF as text, or PLY" });
        }
        if rest.peek().is_none() {
            (place, counts) = line("the numbers of vertices and faces")?;
            rest = words(counts).peekable();
        }
    }
    let vertices: usize = number(rest.next(), place, "the number of vertices")?;
    let faces: usize = number(rest.next(), place, "the number of faces")?;

    let mut mesh = MeshFile::new();
    if vertices > u32::MAX as usize {
        return Err(Fault::TooMany { what: "vertices" });
    }
    for _ in 0..vertices {
        let (place, line) = line("a vertex")?;
        mesh.vertices.push(point(&mut words(line), place)?);
    }
    for _ in 0..faces {
        let (place, line) = line("a face")?;
        let mut rest = words(line);
        let corners: usize = number(rest.next(), place, "the number of corners")?;
        for _ in 0..corners {
            let index: i64 = number(rest.next(), place, "the number of a vertex")?;
            match u32::try_from(index) {
                Ok(corner) if (corner as usize) < vertices => mesh.corners.push(corner),
                _ => return Err(Fault::Index { place, index, vertices, from: 0 }),
            }
        }
        mesh.end_face();
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keyword_counts_and_columns_vary() {
        let square = "# made by hand\n4 2 0\n0 0 0\n1 0 0 # corner\n\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3 255 0 0\n";
        let plain = parse(square.as_bytes()).unwrap();
        assert_eq!((plain.vertices.len(), plain.faces().count()), (4, 2));
        assert_eq!(parse(format!("OFF\n{square}").as_bytes()).unwrap(), plain);
        assert_eq!(parse(b"OFF 3 1 0\n0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n").unwrap().faces().count(), 1);
        assert_eq!(parse(b"COFF\n1 1 0\n0 0 0 1 2 3 4\n1 0\n").unwrap().corners, [0]);
    }

    #[test]
    fn faults_name_the_line() {
        let fault = |text: &str| parse(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(fault("OFF\n1 1 0\n0 0 0\n"), "line 3: the file ends here; expected a face");
        assert_eq!(
            fault("OFF\n1 1 0\n0 0 0\n3 0 0 1\n"),
            "line 4: a face names vertex 1, there are 1 (numbered from 0)"
        );
        assert_eq!(
            fault("OFF\n99999999999999999999 1 0\n"),
            "line 2: '99999999999999999999'; expected the number of vertices"
        );
        assert!(fault("OFF BINARY\n\0\0").contains("binary OFF is not read"));
        assert!(fault("4OFF\n").contains("three dimensions"));
        assert!(fault("hello\n").contains("expected OFF"));
    }
}
