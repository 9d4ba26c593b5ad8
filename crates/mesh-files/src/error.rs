//! What can be wrong with a mesh file, and where.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// Why a file gives no mesh.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// Neither its name nor its first bytes say what it is.
    #[error("{}: not a mesh file of a known kind; known are .obj .ply .stl .off .vtu .vtp", path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
    },
    /// The content is wrong.
    #[error("{}: {fault}", path.display())]
    Fault {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        fault: Fault,
    },
}

/// Where in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A line, counted from 1.
    Line(usize),
    /// A byte, counted from 0.
    Byte(usize),
    /// An array, by the number of its element in the file, from 0.
    Element(&'static str, usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(f, "line {line}"),
            Place::Byte(byte) => write!(f, "byte {byte}"),
            Place::Element(what, number) => write!(f, "{what} {number}"),
        }
    }
}

/// What is wrong with the content of a file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Fault {
    /// Something else was expected there.
    #[error("{place}: {found}; expected {expected}")]
    Expected {
        /// Where.
        place: Place,
        /// What was expected.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// The file ends too early.
    #[error("byte {offset}: {what}: {need} bytes expected, {left} left; the file is cut short or its header is wrong")]
    Truncated {
        /// What was being read.
        what: &'static str,
        /// Where it begins.
        offset: usize,
        /// Bytes that it takes.
        need: usize,
        /// Bytes that are there.
        left: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("{place}: a face names vertex {index}, there are {vertices} (numbered from {from})")]
    Index {
        /// Where.
        place: Place,
        /// The number it names, as written.
        index: i64,
        /// How many vertices there are.
        vertices: usize,
        /// The number of the first vertex in this format.
        from: u8,
    },
    /// A variant of the format that is not read.
    #[error("{what} is not read; {instead}")]
    NotRead {
        /// What it is.
        what: String,
        /// What to do.
        instead: &'static str,
    },
    /// More vertices or corners than 32-bit indices can name.
    #[error("more than {} {what}", u32::MAX)]
    TooMany {
        /// What there is too much of.
        what: &'static str,
    },
    /// There is no face in the file.
    #[error("no faces ({vertices} vertices){}", list(notes))]
    NoFaces {
        /// Vertices in the file.
        vertices: usize,
        /// What else is in it.
        notes: Vec<String>,
    },
}

fn list(notes: &[String]) -> String {
    notes.iter().map(|note| format!("; {note}")).collect()
}

/// The start of a text, for a message.
pub(crate) fn shown(text: &[u8]) -> String {
    const MOST: usize = 40;
    let head =
        String::from_utf8_lossy(&text[..text.len().min(MOST)]).trim().replace(|c: char| c.is_control(), "\u{fffd}");
    match (head.is_empty(), text.len() > MOST) {
        (true, _) => "nothing there".into(),
        (false, false) => format!("'{head}'"),
        (false, true) => format!("'{head}…'"),
    }
}
