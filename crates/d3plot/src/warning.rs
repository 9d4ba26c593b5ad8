//! What a caller should know about a family that was read all the same.

use std::fmt;
use std::path::PathBuf;

use crate::error::name;

/// Something is missing from a family or odd about it, and the rest was read. `Display` is a sentence for people,
/// [`Warning::kind`] a word for programs.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// A member ends inside a state; the states before and after it are whole.
    CutState {
        /// The file that ends early.
        member: PathBuf,
        /// Byte at which the state starts in it.
        offset: u64,
        /// Its time.
        time: f64,
        /// Words of the state that are missing.
        words_missing: u64,
    },
    /// Members are missing from the numbering; their states are, too.
    MissingMembers {
        /// The last member before the gap.
        after: PathBuf,
        /// The first one behind it.
        before: PathBuf,
        /// How many numbers are missing.
        count: u32,
    },
    /// A file that is named like a member of this family is the root of another one and was left out.
    AnotherRoot {
        /// That file.
        path: PathBuf,
    },
    /// The mesh was refined during the run: other levels are families of their own beside this one.
    AdaptiveLevels {
        /// Their roots.
        levels: Vec<PathBuf>,
    },
    /// The titles end early; the parts without one have an empty title.
    TitlesCut {
        /// The file.
        member: PathBuf,
        /// Byte at which they end.
        offset: u64,
    },
    /// A title record of an unknown type, whose length nobody knows: what follows it in this file was not read.
    UnknownTitleRecord {
        /// The file.
        member: PathBuf,
        /// Byte at which it stands.
        offset: u64,
        /// Its type.
        record: i64,
    },
    /// What follows the last state of a member is neither an end mark, nor padding, nor a state with a later time.
    UnreadTail {
        /// The file.
        member: PathBuf,
        /// Byte from which on nothing was read.
        offset: u64,
        /// The word that should have been a time.
        word: f64,
    },
    /// Bytes at the end of a member that are not a whole word.
    OddBytes {
        /// The file.
        member: PathBuf,
        /// How many.
        bytes: u64,
    },
    /// The user numbers contradict the control block; nodes and elements are numbered 1, 2, 3 … instead.
    UserNumbers {
        /// The file.
        path: PathBuf,
    },
    /// Elements belong to parts beyond the number of parts that the control block gives; they were added at the end.
    PartsBeyondCount {
        /// Parts added.
        count: usize,
    },
    /// The words of a state as the control block gives them do not fit the end marks; another reading does.
    StateSize {
        /// Words a state by the control block.
        declared: u64,
        /// Words a state used instead.
        used: u64,
        /// What was read differently.
        reason: String,
    },
    /// The states leave out nodes of rigid bodies (NDIM 8, 9): their positions are rebuilt from the motion of the bodies.
    RigidNodes {
        /// How many nodes.
        count: u64,
        /// Whether velocity and acceleration are rebuilt, too; they are NaN if not.
        rates: bool,
    },
    /// There is no whole state in the family.
    NoStates,
}

impl Warning {
    /// A short word for the kind of warning, fit for a file or a test.
    pub fn kind(&self) -> &'static str {
        match self {
            Warning::CutState { .. } => "cut-state",
            Warning::MissingMembers { .. } => "missing-members",
            Warning::AnotherRoot { .. } => "another-root",
            Warning::AdaptiveLevels { .. } => "adaptive-levels",
            Warning::TitlesCut { .. } => "titles-cut",
            Warning::UnknownTitleRecord { .. } => "unknown-title-record",
            Warning::UnreadTail { .. } => "unread-tail",
            Warning::OddBytes { .. } => "odd-bytes",
            Warning::UserNumbers { .. } => "user-numbers",
            Warning::PartsBeyondCount { .. } => "parts-beyond-count",
            Warning::StateSize { .. } => "state-size",
            Warning::RigidNodes { .. } => "rigid-nodes",
            Warning::NoStates => "no-states",
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::CutState { member, offset, time, words_missing } => write!(
                f,
                "{}: the state at time {time} (byte {offset}) is cut, {words_missing} words are missing; left out",
                member.display()
            ),
            Warning::MissingMembers { after, before, count: 1 } => {
                write!(f, "a member is missing between {} and {}", after.display(), name(before))
            }
            Warning::MissingMembers { after, before, count } => {
                write!(f, "{count} members are missing between {} and {}", after.display(), name(before))
            }
            Warning::AnotherRoot { path } => {
                write!(f, "{}: the root of another family by its content; left out", path.display())
            }
            Warning::AdaptiveLevels { levels } => {
                let levels: Vec<String> = levels.iter().map(|level| name(level)).collect();
                write!(f, "other levels of an adaptive mesh exist and were not read: {}", levels.join(", "))
            }
            Warning::TitlesCut { member, offset } => {
                write!(f, "{}: the titles end early, at byte {offset}", member.display())
            }
            Warning::UnknownTitleRecord { member, offset, record } => write!(
                f,
                "{}: title record of unknown type {record} at byte {offset}; nothing behind it in this file was read",
                member.display()
            ),
            Warning::UnreadTail { member, offset, word } => write!(
                f,
                "{}: neither a later time nor an end mark at byte {offset} but {word:e}; the rest of this file was not read",
                member.display()
            ),
            Warning::OddBytes { member, bytes } => {
                write!(f, "{}: {bytes} bytes at its end are not a whole word", member.display())
            }
            Warning::UserNumbers { path } => write!(
                f,
                "{}: the user numbers contradict the control block; nodes and elements are numbered from 1 instead",
                path.display()
            ),
            Warning::PartsBeyondCount { count } => {
                write!(f, "elements belong to {count} parts beyond those of the control block; added")
            }
            Warning::StateSize { declared, used, reason } => {
                write!(f, "a state has {declared} words by the control block but {used} by the end marks: {reason}")
            }
            Warning::RigidNodes { count, rates } => {
                let (positions, others) = match rates {
                    true => ("results", ""),
                    false => ("positions", "; velocity and acceleration of these are NaN"),
                };
                write!(
                    f,
                    "the states leave out {count} nodes of rigid bodies: their {positions} are rebuilt from the motion of the bodies{others}"
                )
            }
            Warning::NoStates => f.write_str("the family has no whole state"),
        }
    }
}
