//! The line that starts a block: its name, its options, and what they say about the width of fields.

use std::path::PathBuf;

use crate::row::{Format, decode};

/// First words of LS-DYNA's keywords: what tells a deck without *KEYWORD from another text.
const FAMILIES: &[&str] = &[
    "KEYWORD",
    "NODE",
    "ELEMENT",
    "PART",
    "SECTION",
    "MAT",
    "SET",
    "DEFINE",
    "INCLUDE",
    "PARAMETER",
    "CONTROL",
    "DATABASE",
    "CONTACT",
    "CONSTRAINED",
    "BOUNDARY",
    "LOAD",
    "INITIAL",
    "RIGIDWALL",
    "AIRBAG",
    "ALE",
    "EOS",
    "HOURGLASS",
    "DAMPING",
    "DEFORMABLE",
    "TITLE",
    "COMMENT",
    "CASE",
    "CHANGE",
    "INTERFACE",
    "PERTURBATION",
    "SENSOR",
    "TERMINATION",
    "USER",
    "END",
];

/// The name on a keyword line in upper case, and the letter behind it that says how wide fields are.
pub(crate) fn keyword_of(line: &[u8]) -> (String, Option<char>) {
    let text = decode(line[1..].trim_ascii()).to_ascii_uppercase();
    let mut words = text.split(|c: char| c.is_ascii_whitespace() || c == '$' || c == ',');
    let name = words.next().unwrap_or_default();
    let suffix = |word: &str| word.chars().last().filter(|c| matches!(c, '+' | '-' | '%'));
    match suffix(name) {
        Some(letter) if name.len() > 1 => (name[..name.len() - 1].to_owned(), Some(letter)),
        _ => (name.to_owned(), words.find(|word| !word.is_empty()).filter(|word| word.len() == 1).and_then(suffix)),
    }
}

/// Whether a line can be the first keyword of a deck.
pub(crate) fn is_keyword(line: &[u8]) -> bool {
    let (name, _) = keyword_of(line);
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    name.chars().all(plain) && FAMILIES.contains(&name.split('_').next().unwrap_or_default())
}

/// What *KEYWORD says about the width of fields.
pub(crate) fn format_of_file(line: &[u8], format: Format) -> Format {
    let text: String = decode(line).chars().filter(|c| !c.is_whitespace()).collect();
    if text.contains("LONG=Y") || text.contains("LONG=K") {
        Format::Long
    } else if text.contains("LONG=S") {
        Format::Guess
    } else if text.contains("I10=Y") {
        Format::I10
    } else {
        format
    }
}

/// A path as this system writes it: decks of Windows have backslashes.
pub(crate) fn native(name: &str) -> PathBuf {
    if std::path::MAIN_SEPARATOR == '/' { PathBuf::from(name.replace('\\', "/")) } else { PathBuf::from(name) }
}
