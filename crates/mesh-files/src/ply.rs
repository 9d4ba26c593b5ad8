//! Stanford PLY: a header that names elements and their properties, then the elements as text or binary.
//!
//! Read are x, y, z of `vertex` and the list `vertex_indices` (or `vertex_index`) of `face`; anything else is walked over.

use crate::MeshFile;
use crate::bytes::{Cursor, Kind, Order};
use crate::error::{Fault, Place, shown};
use crate::text::{number, words};

/// A property: its name, the kind of its values, and for a list that of its length.
struct Property {
    name: Vec<u8>,
    kind: Kind,
    length: Option<Kind>,
}

struct Element {
    name: Vec<u8>,
    count: usize,
    properties: Vec<Property>,
}

/// How the numbers after the header are written.
#[derive(Clone, Copy, PartialEq)]
enum Coding {
    Text,
    Binary(Order),
}

pub(crate) fn parse(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let (coding, elements, body) = header(bytes)?;
    let mut source = Source { cursor: Cursor::new(bytes, body), coding };
    let mut mesh = MeshFile::new();
    for element in &elements {
        read_element(element, &mut source, &mut mesh)?;
    }
    if elements.iter().any(|element| element.name == b"tristrips") {
        mesh.notes.push("triangle strips are not read; write faces".into());
    }
    let vertices = mesh.vertices.len();
    // Elements may come in any order, so corners are checked once all are there.
    if let Some(at) = mesh.corners.iter().position(|&corner| corner as usize >= vertices) {
        let face = mesh.face_start.partition_point(|&start| start <= at) - 1;
        let place = Place::Element("face", face);
        return Err(Fault::Index { place, index: i64::from(mesh.corners[at]), vertices, from: 0 });
    }
    Ok(mesh)
}

/// The header, and where it ends.
fn header(bytes: &[u8]) -> Result<(Coding, Vec<Element>, usize), Fault> {
    let mut at = 0;
    let (mut coding, mut elements) = (None, Vec::<Element>::new());
    for number_of_line in 1.. {
        let place = Place::Line(number_of_line);
        let expected = |expected: &'static str, found: &[u8]| Fault::Expected { place, expected, found: shown(found) };
        let rest = &bytes[at..];
        let Some(end) = rest.iter().position(|&byte| byte == b'\n' || byte == b'\r') else {
            return Err(expected("a line of the header up to end_header", rest));
        };
        let line = &rest[..end];
        at += end + 1;
        if rest[end] == b'\r' && bytes.get(at) == Some(&b'\n') {
            at += 1;
        }
        let words: Vec<&[u8]> = words(line).collect();
        match (number_of_line, &words[..]) {
            (1, [b"ply"]) => {}
            (1, _) => return Err(expected("ply", line)),
            (_, [b"format", b"ascii", ..]) => coding = Some(Coding::Text),
            (_, [b"format", b"binary_little_endian", ..]) => coding = Some(Coding::Binary(Order::Little)),
            (_, [b"format", b"binary_big_endian", ..]) => coding = Some(Coding::Binary(Order::Big)),
            (_, [b"element", name, count]) => {
                let count = number(Some(count), place, "the number of elements")?;
                elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
            }
            (_, [b"property", rest @ ..]) => {
                let property = property(rest).ok_or_else(|| expected("a property with known types", line))?;
                let element = elements.last_mut().ok_or_else(|| expected("an element before its properties", line))?;
                element.properties.push(property);
            }
            (_, [b"end_header"]) => break,
            (_, [] | [b"comment" | b"obj_info", ..]) => {}
            _ => return Err(expected("format, element, property, comment or end_header", line)),
        }
    }
    let missing = Fault::Expected {
        place: Place::Line(2),
        expected: "format ascii, binary_little_endian or binary_big_endian",
        found: "none in the header".into(),
    };
    Ok((coding.ok_or(missing)?, elements, at))
}

fn property(words: &[&[u8]]) -> Option<Property> {
    let kind = |name: &[u8]| match name {
        b"char" | b"int8" => Some(Kind::I8),
        b"uchar" | b"uint8" => Some(Kind::U8),
        b"short" | b"int16" => Some(Kind::I16),
        b"ushort" | b"uint16" => Some(Kind::U16),
        b"int" | b"int32" => Some(Kind::I32),
        b"uint" | b"uint32" => Some(Kind::U32),
        b"int64" => Some(Kind::I64),
        b"uint64" => Some(Kind::U64),
        b"float" | b"float32" => Some(Kind::F32),
        b"double" | b"float64" => Some(Kind::F64),
        _ => None,
    };
    match *words {
        [b"list", length, of, name] => {
            Some(Property { name: name.to_vec(), kind: kind(of)?, length: Some(kind(length)?) })
        }
        [of, name] => Some(Property { name: name.to_vec(), kind: kind(of)?, length: None }),
        _ => None,
    }
}

fn read_element(element: &Element, source: &mut Source, mesh: &mut MeshFile) -> Result<(), Fault> {
    let place = |what: &'static str, number: usize| Place::Element(what, number);
    let axis = |property: &Property| match &property.name[..] {
        b"x" => Some(0),
        b"y" => Some(1),
        b"z" => Some(2),
        _ => None,
    };
    match &element.name[..] {
        b"vertex" => {
            let axes: Vec<Option<usize>> = element.properties.iter().map(axis).collect();
            if !(0..3).all(|c| axes.contains(&Some(c))) {
                let found = "a vertex element without".into();
                return Err(Fault::Expected { place: place("vertex", 0), expected: "properties x, y and z", found });
            }
            for number in 0..element.count {
                let mut point = [0.0; 3];
                for (property, axis) in element.properties.iter().zip(&axes) {
                    source.property(property, place("vertex", number), |value| {
                        if let Some(axis) = *axis {
                            point[axis] = value.float();
                        }
                        Ok(())
                    })?;
                }
                if mesh.vertices.len() == u32::MAX as usize {
                    return Err(Fault::TooMany { what: "vertices" });
                }
                mesh.vertices.push(point);
            }
        }
        b"face" => {
            let is_ring = |property: &Property| {
                property.length.is_some() && matches!(&property.name[..], b"vertex_indices" | b"vertex_index")
            };
            if !element.properties.iter().any(is_ring) {
                let found = "a face element without".into();
                return Err(Fault::Expected { place: place("face", 0), expected: "a list vertex_indices", found });
            }
            for number in 0..element.count {
                for property in &element.properties {
                    let ring = is_ring(property);
                    source.property(property, place("face", number), |value| {
                        if ring {
                            let index = value.integer();
                            let bad = Fault::Index {
                                place: place("face", number),
                                index,
                                vertices: mesh.vertices.len(),
                                from: 0,
                            };
                            mesh.corners.push(u32::try_from(index).map_err(|_| bad)?);
                        }
                        Ok(())
                    })?;
                }
                mesh.end_face();
            }
        }
        _ => {
            // An element of no bytes may claim any count: there is nothing to walk over.
            for number in 0..if element.properties.is_empty() { 0 } else { element.count } {
                for property in &element.properties {
                    source.property(property, place("element", number), |_| Ok(()))?;
                }
            }
        }
    }
    Ok(())
}

/// The numbers after the header.
struct Source<'a> {
    cursor: Cursor<'a>,
    coding: Coding,
}

/// A number as it stands in the file.
enum Value<'a> {
    Text(f64),
    Binary(Kind, &'a [u8], Order),
}

impl Value<'_> {
    fn float(&self) -> f64 {
        match *self {
            Value::Text(x) => x,
            Value::Binary(kind, bytes, order) => kind.float(bytes, order),
        }
    }

    fn integer(&self) -> i64 {
        match *self {
            Value::Text(x) if x.fract() == 0.0 && x.abs() < 1e15 => x as i64,
            Value::Text(_) => -1,
            Value::Binary(kind, bytes, order) => kind.integer(bytes, order),
        }
    }
}

impl<'a> Source<'a> {
    /// Reads one property of one element: one value, or as many as the list says.
    fn property(
        &mut self,
        property: &Property,
        place: Place,
        mut each: impl FnMut(Value) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        let Some(length) = property.length else {
            return each(self.value(property.kind, place)?);
        };
        let count = self.value(length, place)?.integer();
        let bad = Fault::Expected { place, expected: "the length of a list", found: count.to_string() };
        for _ in 0..u32::try_from(count).map_err(|_| bad)? {
            each(self.value(property.kind, place)?)?;
        }
        Ok(())
    }

    fn value(&mut self, kind: Kind, place: Place) -> Result<Value<'a>, Fault> {
        match self.coding {
            Coding::Binary(order) => {
                let what = match place {
                    Place::Element("vertex", _) => "vertices",
                    Place::Element("face", _) => "faces",
                    _ => "elements",
                };
                Ok(Value::Binary(kind, self.cursor.take(kind.size(), what)?, order))
            }
            Coding::Text => Ok(Value::Text(number(Some(self.cursor.word()), place, "a number")?)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "element vertex 4\ncomment columns as scanners write them\nproperty uchar red\nproperty float x\nproperty double y\nproperty float z\nelement edge 1\nproperty int vertex1\nelement face 2\nproperty list uchar int vertex_indices\nproperty short flags\nend_header\n";

    fn binary(order: Order) -> Vec<u8> {
        let (name, big) = match order {
            Order::Little => ("little", false),
            Order::Big => ("big", true),
        };
        let mut bytes = format!("ply\nformat binary_{name}_endian 1.0\n{HEAD}").into_bytes();
        let mut put = |little: &[u8]| {
            let mut word = little.to_vec();
            if big {
                word.reverse();
            }
            bytes.extend(word);
        };
        for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0f32]] {
            put(&[200]);
            put(&x.to_le_bytes());
            put(&f64::from(y).to_le_bytes());
            put(&0.5f32.to_le_bytes());
        }
        put(&7i32.to_le_bytes());
        for face in [&[0i32, 1, 2][..], &[3, 0, 2]] {
            put(&[3]);
            face.iter().for_each(|corner| put(&corner.to_le_bytes()));
            put(&(-1i16).to_le_bytes());
        }
        bytes
    }

    #[test]
    fn text_and_both_byte_orders_hold_the_same_mesh() {
        let rows = "9 0 0 0.5\n9 1 0 0.5\n9 1 1 .5\n9 0 1 5e-1\n7\n3 0 1 2 -1\n3 3 0 2 -1\n";
        let text = parse(format!("ply\nformat ascii 1.0\n{HEAD}{rows}").as_bytes()).unwrap();
        assert_eq!(text.vertices[2], [1.0, 1.0, 0.5]);
        assert_eq!(text.faces().collect::<Vec<_>>(), [[0u32, 1, 2], [3, 0, 2]]);
        assert_eq!(parse(&binary(Order::Little)).unwrap(), text);
        assert_eq!(parse(&binary(Order::Big)).unwrap(), text);
    }

    #[test]
    fn faults_name_the_place() {
        let fault = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
        assert!(fault(b"plyx\n").contains("expected ply"));
        assert!(fault(b"ply\nelement vertex x\n").starts_with("line 2: 'x'; expected the number of elements"));
        assert!(fault(b"ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\n").starts_with("line 4"));
        assert!(fault(b"ply\nend_header\n").contains("format ascii"));
        let whole = binary(Order::Little);
        assert!(fault(&whole[..whole.len() - 1]).contains("faces: 2 bytes expected, 1 left"));
        let greedy = b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\nabc";
        assert!(fault(greedy).contains("vertices: 4 bytes expected, 3 left"), "and no allocation before");
    }
}
