//! *SET_…: lists of nodes, segments, parts and elements, as the deck writes them. [`crate::Resolver`] makes ids of them.

/// Of what a set is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SetKind {
    /// *SET_NODE.
    Nodes,
    /// *SET_SEGMENT.
    Segments,
    /// *SET_PART.
    Parts,
    /// *SET_SHELL.
    Shells,
    /// *SET_SOLID.
    Solids,
    /// *SET_TSHELL.
    ThickShells,
    /// *SET_BEAM.
    Beams,
}

impl SetKind {
    /// The word in the keyword.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nodes => "NODE",
            Self::Segments => "SEGMENT",
            Self::Parts => "PART",
            Self::Shells => "SHELL",
            Self::Solids => "SOLID",
            Self::ThickShells => "TSHELL",
            Self::Beams => "BEAM",
        }
    }

    pub(crate) fn of(word: &str) -> Option<Self> {
        const ALL: [SetKind; 7] = [
            SetKind::Nodes,
            SetKind::Segments,
            SetKind::Parts,
            SetKind::Shells,
            SetKind::Solids,
            SetKind::ThickShells,
            SetKind::Beams,
        ];
        ALL.into_iter().find(|kind| kind.name() == word)
    }
}

/// A set.
#[derive(Debug, Clone, PartialEq)]
pub struct Set {
    /// Of what.
    pub kind: SetKind,
    /// Its id.
    pub id: u64,
    /// Its title, if it has one.
    pub title: String,
    /// What it consists of, in the order of the deck.
    pub clauses: Vec<Clause>,
}

/// A piece of a set's definition.
#[derive(Debug, Clone, PartialEq)]
pub enum Clause {
    /// These ids.
    Ids(Vec<u64>),
    /// Ids from the first to the last, by the step; those that exist.
    Range {
        /// First id.
        first: u64,
        /// Last id.
        last: u64,
        /// Step, at least 1.
        step: u64,
    },
    /// Segments by their corner nodes; a triangle repeats its third or has 0.
    Segments(Vec<[u64; 4]>),
    /// The union of these sets of the same kind (ADD).
    Union(Vec<u64>),
    /// What all these sets of the same kind share (INTERSECT).
    Intersection(Vec<u64>),
    /// A line of GENERAL, or of ADD_ADVANCED: an option and its ids.
    Option {
        /// The option in upper case: `ALL`, `PART`, `DNODE`, ….
        word: String,
        /// Its ids.
        ids: Vec<u64>,
    },
}
