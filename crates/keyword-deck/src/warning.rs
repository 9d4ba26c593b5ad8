//! What a reader of a deck should know although it could be read.

use std::fmt;
use std::path::PathBuf;

use crate::error::Place;

/// Something that was noticed. `Display` is the whole sentence, [`Warning::kind`] a word that scripts can rely on.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Warning {
    /// An included file is not there; the rest was read.
    MissingInclude {
        /// The *INCLUDE.
        place: Place,
        /// The name in the deck.
        name: String,
        /// The paths that were tried, in order.
        searched: Vec<PathBuf>,
    },
    /// An included file cannot be read as text.
    UnreadableInclude {
        /// The *INCLUDE.
        place: Place,
        /// The name in the deck.
        name: String,
        /// Why.
        why: String,
    },
    /// A block that changes the mesh, and that is not followed.
    NotFollowed {
        /// Its first place.
        place: Place,
        /// Its keyword.
        keyword: String,
        /// What it would change.
        what: &'static str,
    },
    /// An encrypted block.
    Encrypted {
        /// Where it begins.
        place: Place,
    },
    /// Lines in front of the first keyword.
    BeforeFirstKeyword {
        /// The first of them.
        place: Place,
        /// How many.
        lines: u64,
    },
    /// A card that could not be read in a block that the mesh does not need; its block is left out.
    BadCard {
        /// Where.
        place: Place,
        /// Its keyword.
        keyword: String,
        /// What is wrong with it.
        what: String,
    },
    /// Something is defined twice; the first definition counts.
    Twice {
        /// What: "node", "part", ….
        what: &'static str,
        /// The first such id.
        id: u64,
        /// How many ids.
        count: usize,
    },
    /// A transformation that is not defined or not understood: the nodes of the include stay where they are.
    NotTransformed {
        /// Where.
        place: Place,
        /// Why.
        what: String,
    },
    /// A parameter is defined a second time.
    ParameterTwice {
        /// Where.
        place: Place,
        /// Its name.
        name: String,
        /// Whether the new value counts.
        replaced: bool,
    },
    /// Elements name nodes that are nowhere in the deck.
    NodesMissing {
        /// How many elements.
        elements: usize,
        /// The first such element.
        element: u64,
        /// The node it names.
        node: u64,
    },
}

impl Warning {
    /// A word that scripts can rely on.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::MissingInclude { .. } => "missing-include",
            Self::UnreadableInclude { .. } => "unreadable-include",
            Self::NotFollowed { .. } => "not-followed",
            Self::Encrypted { .. } => "encrypted",
            Self::BeforeFirstKeyword { .. } => "before-first-keyword",
            Self::BadCard { .. } => "bad-card",
            Self::Twice { .. } => "defined-twice",
            Self::NotTransformed { .. } => "not-transformed",
            Self::ParameterTwice { .. } => "parameter-twice",
            Self::NodesMissing { .. } => "nodes-missing",
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MissingInclude { place, name, searched } => {
                let searched: Vec<String> = searched.iter().map(|path| path.display().to_string()).collect();
                write!(f, "{place}: the included file '{name}' is not there; searched: {}", searched.join(", "))
            }
            Self::UnreadableInclude { place, name, why } => {
                write!(f, "{place}: the included file '{name}' was left out: {why}")
            }
            Self::NotFollowed { place, keyword, what } => write!(f, "{place}: *{keyword} is not followed; {what}"),
            Self::Encrypted { place } => write!(f, "{place}: an encrypted block was left out"),
            Self::BeforeFirstKeyword { place, lines } => {
                write!(f, "{place}: {lines} lines in front of the first keyword were left out")
            }
            Self::BadCard { place, keyword, what } => write!(f, "{place}: *{keyword} was left out: {what}"),
            Self::Twice { what, id, count: 1 } => {
                write!(f, "{what} {id} is defined twice; the first definition counts")
            }
            Self::Twice { what, id, count } => {
                write!(f, "{count} {what} ids are defined twice, {id} first; the first definition counts")
            }
            Self::NotTransformed { place, what } => {
                write!(f, "{place}: {what}; the nodes of this include stay where its file has them")
            }
            Self::ParameterTwice { place, name, replaced } => {
                let word = if *replaced { "new" } else { "first" };
                write!(f, "{place}: the parameter '{name}' is defined a second time; the {word} value counts")
            }
            Self::NodesMissing { elements, element, node } => write!(
                f,
                "{elements} elements name nodes that the deck does not define, element {element} (node {node}) first"
            ),
        }
    }
}
