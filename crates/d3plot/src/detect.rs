//! What a file is, by the content of its first 64 words: word size and byte order, type, compression.
//!
//! No single word tells the form of a file, so the four forms are scored on all the words that have a known range.

use std::path::Path;

use crate::error::Error;
use crate::members::read_head;
use crate::words::{Words, decode_text};

/// Words of the control block without its extension.
pub(crate) const CONTROL_WORDS: u64 = 64;
/// What FEMZIP writes into NMMAT.
pub(crate) const FEMZIP: i64 = 76_893_465;
/// The most a form can score is 22; zeros, text and states stay below this.
const ENOUGH: u32 = 15;

/// Which database of LS-DYNA a family is; all four have the same layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum FileType {
    /// d3plot: the states of a run.
    #[default]
    D3plot,
    /// d3drlf: states of a dynamic relaxation.
    D3drlf,
    /// d3part: a subset of the parts.
    D3part,
    /// d3eigv: the states are vibration modes.
    D3eigv,
}

impl FileType {
    pub(crate) fn of(number: i64) -> Option<FileType> {
        Some(match number {
            1 => FileType::D3plot,
            2 => FileType::D3drlf,
            5 => FileType::D3part,
            11 => FileType::D3eigv,
            _ => return None,
        })
    }

    /// INUM.
    pub(crate) fn number(self) -> i64 {
        match self {
            FileType::D3plot => 1,
            FileType::D3drlf => 2,
            FileType::D3part => 5,
            FileType::D3eigv => 11,
        }
    }

    /// The usual name of the root file.
    pub fn name(self) -> &'static str {
        match self {
            FileType::D3plot => "d3plot",
            FileType::D3drlf => "d3drlf",
            FileType::D3part => "d3part",
            FileType::D3eigv => "d3eigv",
        }
    }
}

/// Every type number that LS-DYNA writes, by its usual name.
fn type_name(number: i64) -> Option<&'static str> {
    Some(match number {
        1 => "d3plot",
        2 => "d3drlf",
        3 => "d3thdt",
        4 => "intfor",
        5 => "d3part",
        6 => "blstfor",
        7 => "d3cpm",
        8 => "d3ale",
        11 => "d3eigv",
        12 => "d3mode",
        13 => "d3iter",
        21 => "d3ssd",
        22 => "d3spcm",
        23 => "d3psd",
        24 => "d3rms",
        25 => "d3ftg",
        26 => "d3acs",
        _ => return None,
    })
}

/// INUM without its sign (fields chosen by `*DATABASE_EXTENT_BINARY_COMP`) and without the 1000 of 8-byte numbers.
pub(crate) fn type_number(inum: i64) -> i64 {
    let number = inum.saturating_abs();
    if number > 1000 { number - 1000 } else { number }
}

/// VERSION is 960.0 in every file seen.
fn is_version(word: f64) -> bool {
    (100.0..10000.0).contains(&word)
}

/// How well the first words of a file make a control block in one form, 0 to 22.
fn score(words: Words, head: &[u8], file_bytes: u64) -> u32 {
    let ints: Vec<i64> = words.ints(head).take(CONTROL_WORDS as usize).collect();
    let Some(version) = words.floats(head).nth(14).filter(|_| ints.len() == CONTROL_WORDS as usize) else {
        return 0;
    };
    let file_words = i64::try_from(file_bytes / words.size()).unwrap_or(i64::MAX);
    let mut score = 0;
    score += 4 * u32::from(type_name(type_number(ints[11])).is_some());
    score += 4 * u32::from((2..=9).contains(&ints[15]));
    score += 2 * u32::from(matches!(ints[17], 2 | 6));
    score += 2 * u32::from(is_version(version));
    score += [16, 18, 28, 31, 39, 40, 57].iter().filter(|&&at| (0..=file_words).contains(&ints[at])).count() as u32;
    score += u32::from((0..=23).contains(&ints[19])) + u32::from((0..=2).contains(&ints[20]));
    score += u32::from((-1..=1).contains(&ints[21])) + u32::from((-1..=1).contains(&ints[22]));
    score
}

/// The form in which the head of a file is a control block, if there is one.
pub(crate) fn detect(head: &[u8], file_bytes: u64) -> Option<Words> {
    let mut best = None;
    for words in Words::ALL {
        let score = score(words, head, file_bytes);
        if score >= ENOUGH && best.is_none_or(|(most, _)| score > most) {
            best = Some((score, words));
        }
    }
    best.map(|(_, words)| words)
}

/// What the head of a file says before anything else is read.
#[derive(Debug, Clone)]
pub(crate) struct Glance {
    pub(crate) words: Words,
    pub(crate) inum: i64,
    pub(crate) title: String,
    pub(crate) femzip: bool,
    /// VERSION is a plausible float.
    version: bool,
}

/// Looks at the first words of a file only; `None` if they are not a control block.
pub(crate) fn glance(path: &Path, bytes: u64) -> Result<Option<Glance>, Error> {
    let head = read_head(path, CONTROL_WORDS * 8)?;
    Ok(detect(&head, bytes).map(|words| {
        let ints: Vec<i64> = words.ints(&head).collect();
        let title = decode_text(&head[..10 * words.size() as usize]);
        let version = words.floats(&head).nth(14).is_some_and(is_version);
        Glance { words, inum: ints[11], title, femzip: ints[51] == FEMZIP, version }
    }))
}

impl Glance {
    /// The type, if families of this type are read.
    pub(crate) fn file_type(&self) -> Option<FileType> {
        FileType::of(type_number(self.inum))
    }

    /// The error about any other type.
    pub(crate) fn wrong_type(&self, path: &Path) -> Error {
        wrong_type(path, self.words, self.inum)
    }
}

pub(crate) fn wrong_type(path: &Path, words: Words, inum: i64) -> Error {
    let number = type_number(inum);
    let name = type_name(number).unwrap_or("unknown");
    Error::FileType { path: path.to_owned(), number, name, offset: 11 * words.size() }
}

/// Whether a file is a root by its content. A file that cannot be read is none.
pub(crate) fn is_root(path: &Path, bytes: u64) -> bool {
    matches!(glance(path, bytes), Ok(Some(_)))
}

/// Whether a file that is named like a member is a root nevertheless. Connectivity that runs on into a member may score
/// well, being small integers, but not with a float among them.
pub(crate) fn is_surely_root(path: &Path, bytes: u64) -> bool {
    matches!(glance(path, bytes), Ok(Some(Glance { version: true, .. })))
}
