//! Why a deck cannot be read: what is wrong, where, what was expected, and what to do about it.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A line of a file, numbered from 1.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Place {
    /// The file.
    pub file: Arc<Path>,
    /// Its line, from 1.
    pub line: u64,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)
    }
}

/// Everything that can go wrong with a deck. `Display` says what is wrong, where, and what was expected;
/// [`Error::remedy`] what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is nothing at this path.
    #[error("{path}: no such file")]
    NotFound {
        /// The path that was given.
        path: PathBuf,
    },
    /// A folder was given.
    #[error("{path}: a folder, a keyword deck was expected")]
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// The file has no bytes.
    #[error("{path}: the file is empty, a keyword deck was expected")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// No keyword of LS-DYNA is where one must be.
    #[error(
        "{place}: not a keyword deck: a line that starts with a keyword such as *KEYWORD or *NODE was expected, '{found}' is there"
    )]
    NotADeck {
        /// Where.
        place: Place,
        /// What is there, cut to a few characters.
        found: String,
    },
    /// The file is packed or of another encoding.
    #[error("{path}: {what}, not the text of a keyword deck")]
    Packed {
        /// The file.
        path: PathBuf,
        /// What it looks like.
        what: &'static str,
    },
    /// A line that no deck has.
    #[error("{place}: a line of more than {most} bytes, no deck has such lines")]
    LineTooLong {
        /// Where.
        place: Place,
        /// The most that is read.
        most: usize,
    },
    /// A field of a card is not what it must be.
    #[error("{place}: *{keyword}, {field}: {expected} was expected, '{found}' is there")]
    Field {
        /// Where.
        place: Place,
        /// The keyword of the block.
        keyword: String,
        /// Name of the field, as the manual has it.
        field: &'static str,
        /// What was expected.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// A card that belongs to an element or an entry is not there.
    #[error("{place}: *{keyword}: the block ends where {what} was expected")]
    CardMissing {
        /// The last line of the block.
        place: Place,
        /// The keyword of the block.
        keyword: String,
        /// What was expected.
        what: &'static str,
    },
    /// `&name` without a definition before it.
    #[error("{place}: *{keyword}: the parameter '&{name}' has no definition before this line")]
    Parameter {
        /// Where.
        place: Place,
        /// The keyword of the block.
        keyword: String,
        /// The parameter's name.
        name: String,
    },
    /// An expression that cannot be evaluated.
    #[error("{place}: *{keyword}: the expression '{text}': {what}")]
    Expression {
        /// Where.
        place: Place,
        /// The keyword of the block.
        keyword: String,
        /// The expression.
        text: String,
        /// What is wrong.
        what: String,
    },
    /// Includes go round in a circle.
    #[error("{place}: *INCLUDE of {}, which is being read already: {}", last_of(.chain), arrows(.chain))]
    IncludesItself {
        /// The include that closes the circle.
        place: Place,
        /// The files from the first to the same one again.
        chain: Vec<PathBuf>,
    },
    /// More includes than any deck has.
    #[error("{place}: more than {most} includes")]
    TooManyIncludes {
        /// Where the limit was passed.
        place: Place,
        /// The limit.
        most: usize,
    },
    /// The file system says no.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

fn last_of(files: &[PathBuf]) -> String {
    files.last().map(|file| file.display().to_string()).unwrap_or_default()
}

fn arrows(files: &[PathBuf]) -> String {
    files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(" → ")
}

impl Error {
    /// What to do about it, where there is something to do.
    pub fn remedy(&self) -> Option<&'static str> {
        Some(match self {
            Self::NotFound { .. } | Self::Io { .. } | Self::TooManyIncludes { .. } => return None,
            Self::Folder { .. } => "give the main file of the deck (.k, .key, .dyn)",
            Self::Empty { .. } => "copy the file again",
            Self::NotADeck { .. } | Self::LineTooLong { .. } => {
                "give the main file of the deck, plain text with a keyword (*KEYWORD, *NODE, …) at the start of its first data line"
            }
            Self::Packed { .. } => "unpack it, or save it as plain text (ASCII, UTF-8, Latin-1)",
            Self::Field { .. } => {
                "mend the card; if its columns are shifted, look whether the deck needs LONG=Y or I10=Y on *KEYWORD"
            }
            Self::CardMissing { .. } => "the deck is cut or a card is lost; write it again",
            Self::Parameter { .. } => "define it with *PARAMETER before it is used, or include the file that does",
            Self::Expression { .. } => "mend the expression",
            Self::IncludesItself { .. } => "take the *INCLUDE out that closes the circle",
        })
    }
}
