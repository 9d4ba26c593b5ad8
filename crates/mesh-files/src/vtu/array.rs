//! One array of a VTK XML file: text, base64 or raw bytes, plain or in blocks compressed by zlib.
//!
//! Plain: a length in bytes, then the data. Compressed: the number of blocks, the size of a block and of the last one
//! (0: a whole one) before compression, the compressed size of each, then all blocks. Lengths are `header_type`. In base64
//! the lengths of compressed data are coded by themselves; that of plain data by some writers with the data, by others
//! by itself.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use roxmltree::Node;

use super::{place, shown};
use crate::bytes::{Cursor, Kind, Order};
use crate::error::{Fault, Place};
use crate::text::{number, words};

/// The appended data: `bytes[start..]` of the file.
pub(super) struct Appended<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) start: usize,
    pub(super) raw: bool,
}

/// How the file's arrays are coded.
pub(super) struct Reader<'a> {
    pub(super) order: Order,
    pub(super) header: Kind,
    pub(super) compressed: bool,
    pub(super) appended: Option<Appended<'a>>,
}

impl Reader<'_> {
    pub(super) fn floats(&self, node: Node) -> Result<Vec<f64>, Fault> {
        let order = self.order;
        self.values(node, |word, place| number(Some(word), place, "a number"), |kind, bytes| kind.float(bytes, order))
    }

    pub(super) fn integers(&self, node: Node) -> Result<Vec<i64>, Fault> {
        let order = self.order;
        self.values(
            node,
            |word, place| number(Some(word), place, "a whole number"),
            |kind, bytes| kind.integer(bytes, order),
        )
    }

    fn values<T>(
        &self,
        node: Node,
        of_text: impl Fn(&[u8], Place) -> Result<T, Fault>,
        of_bytes: impl Fn(Kind, &[u8]) -> T,
    ) -> Result<Vec<T>, Fault> {
        let wrong =
            |expected, found: &str| Fault::Expected { place: place(node), expected, found: shown(found.as_bytes()) };
        let kind = kind(node.attribute("type").unwrap_or_default())
            .ok_or_else(|| wrong("the type of an array", node.attribute("type").unwrap_or_default()))?;
        let inside = || node.text().unwrap_or_default().as_bytes();
        let bytes = match node.attribute("format").unwrap_or("ascii") {
            "ascii" => return words(inside()).map(|word| of_text(word, place(node))).collect(),
            "binary" => {
                let letters: Vec<u8> = inside().iter().copied().filter(|byte| !byte.is_ascii_whitespace()).collect();
                self.decode(&mut Stream { cursor: Cursor::new(&letters, 0), raw: false })?
            }
            "appended" => {
                let offset: usize = number(node.attribute("offset").map(str::as_bytes), place(node), "an offset")?;
                let appended = self.appended.as_ref().ok_or_else(|| wrong("AppendedData", "none in the file"))?;
                let cursor = Cursor::new(appended.bytes, appended.start.saturating_add(offset));
                self.decode(&mut Stream { cursor, raw: appended.raw })?
            }
            other => return Err(wrong("format ascii, binary or appended", other)),
        };
        if bytes.len() % kind.size() != 0 {
            let found = format!("{} bytes", bytes.len());
            return Err(Fault::Expected { place: place(node), expected: "whole numbers of the array's type", found });
        }
        Ok(bytes.chunks_exact(kind.size()).map(|word| of_bytes(kind, word)).collect())
    }

    /// The bytes of an array at the front of a stream.
    fn decode(&self, stream: &mut Stream) -> Result<Vec<u8>, Fault> {
        let size = self.header.size();
        let lengths = |bytes: &[u8]| -> Vec<usize> {
            let length = |word| usize::try_from(self.header.integer(word, self.order)).unwrap_or(usize::MAX);
            bytes.chunks_exact(size).map(length).collect()
        };
        if !self.compressed {
            let (head, alone) = stream.peek(size)?;
            let length = lengths(&head[..size])[0];
            if alone {
                stream.take(size)?;
                return stream.take(length);
            }
            let mut all = stream.take(length.saturating_add(size))?;
            all.drain(..size);
            return Ok(all);
        }
        let (head, _) = stream.peek(size)?;
        let blocks = lengths(&head)[0];
        let head = lengths(&stream.take(blocks.saturating_add(3).saturating_mul(size))?);
        let [_, block, last, compressed @ ..] = &head[..] else { return Ok(Vec::new()) };
        let total = compressed.iter().fold(0usize, |sum, &length| sum.saturating_add(length));
        let data = stream.take(total)?;
        let (mut bytes, mut at) = (Vec::new(), 0);
        for (k, &length) in compressed.iter().enumerate() {
            let size = if k + 1 == blocks && *last > 0 { *last } else { *block };
            let part = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(&data[at..at + length], size);
            let part = part.ok().filter(|part| part.len() == size).ok_or_else(|| Fault::Expected {
                place: Place::Element("compressed block", k),
                expected: "zlib data of the size that its header says",
                found: format!("{length} bytes that are not"),
            })?;
            bytes.extend(part);
            at += length;
        }
        Ok(bytes)
    }
}

/// Bytes as they are, or as letters of base64.
struct Stream<'a> {
    cursor: Cursor<'a>,
    raw: bool,
}

impl Stream<'_> {
    /// The next bytes, coded by themselves.
    fn take(&mut self, count: usize) -> Result<Vec<u8>, Fault> {
        if self.raw {
            return Ok(self.cursor.take(count, "an array")?.to_vec());
        }
        let letters = self.cursor.take(count.div_ceil(3).saturating_mul(4), "an array in base64")?;
        let mut bytes = decode(letters)?;
        bytes.truncate(count);
        Ok(bytes)
    }

    /// The next bytes without taking them, and whether they are coded by themselves (always so when raw).
    fn peek(&self, count: usize) -> Result<(Vec<u8>, bool), Fault> {
        let mut ahead = Stream { cursor: self.cursor.clone(), raw: self.raw };
        if self.raw {
            return Ok((ahead.take(count)?, true));
        }
        let letters = ahead.cursor.take(count.div_ceil(3) * 4, "the length of an array")?;
        let bytes = decode(letters)?;
        let alone = bytes.len() == count;
        Ok((bytes, alone))
    }
}

fn decode(letters: &[u8]) -> Result<Vec<u8>, Fault> {
    STANDARD.decode(letters).map_err(|error| Fault::Expected {
        place: Place::Element("array in base64, letters", letters.len()),
        expected: "base64 of the length that the header says",
        found: error.to_string(),
    })
}

fn kind(name: &str) -> Option<Kind> {
    Some(match name {
        "Int8" => Kind::I8,
        "UInt8" => Kind::U8,
        "Int16" => Kind::I16,
        "UInt16" => Kind::U16,
        "Int32" => Kind::I32,
        "UInt32" => Kind::U32,
        "Int64" => Kind::I64,
        "UInt64" => Kind::U64,
        "Float32" => Kind::F32,
        "Float64" => Kind::F64,
        _ => return None,
    })
}
