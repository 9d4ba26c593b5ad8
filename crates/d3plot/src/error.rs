//! Why a family cannot be read or written: what is wrong, where, what was expected, and what to do about it.

use std::io;
use std::path::{Path, PathBuf};

/// Everything that can go wrong with a family. `Display` says what is wrong, where, and what was expected;
/// [`Error::remedy`] what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is nothing at this path.
    #[error("{path}: no such file or folder")]
    NotFound {
        /// The path that was given.
        path: PathBuf,
    },
    /// The folder holds no root of a family.
    #[error("{folder}: no d3plot family in this folder{}", refused_names(.refused))]
    NoFamily {
        /// The folder.
        folder: PathBuf,
        /// Files in it that are d3plots by name but not by content.
        refused: Vec<PathBuf>,
    },
    /// The folder holds several families, and which one is meant cannot be told.
    #[error("{folder}: {} d3plot families in this folder ({}), one was expected", .roots.len(), names(.roots))]
    SeveralFamilies {
        /// The folder.
        folder: PathBuf,
        /// The roots, sorted by name.
        roots: Vec<PathBuf>,
    },
    /// The file has no bytes.
    #[error("{path}: the file is empty, a d3plot root of at least 256 bytes was expected")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The content is not the control block of an LS-DYNA binary database.
    #[error("{path}: not a d3plot: {looks}")]
    NotD3plot {
        /// The file.
        path: PathBuf,
        /// What it looks like instead.
        looks: LooksLike,
    },
    /// The file is a later member of a family, not its root.
    #[error("{path}: a state file of the family {}, not its root", name(.root))]
    NotRoot {
        /// The file.
        path: PathBuf,
        /// The root it belongs to.
        root: PathBuf,
    },
    /// The family is compressed with FEMZIP.
    #[error("{path}: FEMZIP-compressed, only the closed FEMZIP library can read it")]
    Femzip {
        /// The file.
        path: PathBuf,
    },
    /// Another kind of LS-DYNA database.
    #[error(
        "{path}: file type {number} ({name}) at byte {offset}, d3plot (1), d3drlf (2), d3part (5) or d3eigv (11) was expected"
    )]
    FileType {
        /// The file.
        path: PathBuf,
        /// INUM, without sign and the 1000 of 8-byte numbers.
        number: i64,
        /// The usual name of that type.
        name: &'static str,
        /// Where INUM stands.
        offset: u64,
    },
    /// A kind of content whose place in the file cannot be told with certainty.
    #[error("{path}: {what}: not supported")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not supported, with the word that says so.
        what: String,
    },
    /// The file ends inside a section.
    #[error("{path}: {section} at byte {offset}: {need} bytes expected, {left} left in the file")]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Name of the section.
        section: &'static str,
        /// Byte at which the section starts.
        offset: u64,
        /// Bytes the section has.
        need: u64,
        /// Bytes left from its start to the end of the file.
        left: u64,
    },
    /// A word of the control block that no file of this size can have.
    #[error("{path}: {name} = {value} at byte {offset}, {expected} was expected")]
    Count {
        /// The file.
        path: PathBuf,
        /// Name of the word in the format's description.
        name: &'static str,
        /// Its value.
        value: i64,
        /// Where it stands.
        offset: u64,
        /// What would have been right.
        expected: String,
    },
    /// The geometry contradicts itself: cut, overwritten, or not laid out as the control block says.
    #[error("{path}: {section} at byte {offset}: {found} found, {expected} expected")]
    Geometry {
        /// The file.
        path: PathBuf,
        /// Name of the section.
        section: &'static str,
        /// Byte at which the section starts.
        offset: u64,
        /// What stands there.
        found: String,
        /// What should.
        expected: String,
    },
    /// A state that the family does not have.
    #[error("{path}: state {state} (counted from 0) asked for, the family has {states} whole states")]
    NoSuchState {
        /// The root.
        path: PathBuf,
        /// The state asked for, from 0.
        state: usize,
        /// States there are.
        states: usize,
    },
    /// A row that a field does not have.
    #[error("{path}: row {row} (counted from 0) of '{field}' asked for, it has {rows}")]
    NoSuchRow {
        /// The root.
        path: PathBuf,
        /// The field.
        field: &'static str,
        /// The row asked for, from 0.
        row: u64,
        /// Rows there are.
        rows: u64,
    },
    /// A named layer that the states do not have.
    #[error("{path}: {what} asked for, but with {layers} points an element the file does not say which point that is")]
    Layer {
        /// The root.
        path: PathBuf,
        /// The layer asked for.
        what: &'static str,
        /// Points an element that the states hold.
        layers: u64,
    },
    /// The file became shorter after the family was opened.
    #[error("{path}: {expected} bytes when the family was opened, now it ends at byte {found}")]
    Changed {
        /// The file.
        path: PathBuf,
        /// Bytes when it was opened.
        expected: u64,
        /// Bytes found now.
        found: u64,
    },
    /// A family that is to be written would overwrite a file, or take one of another run for its own.
    #[error("{path}: already there; nothing is overwritten")]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// What is to be written does not fit the format, or what was said about the family before.
    #[error("{path}: cannot be written: {what}")]
    Content {
        /// The file that was to be written.
        path: PathBuf,
        /// What is wrong, and what was expected.
        what: String,
    },
    /// The operating system refused.
    #[error("{path}: {action}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was being done.
        action: &'static str,
        /// The system's own words.
        source: io::Error,
    },
}

impl Error {
    /// What to do about it, in one sentence; `None` where there is nothing sensible to say.
    pub fn remedy(&self) -> Option<String> {
        Some(match self {
            Error::NotFound { .. } => "check the spelling of the path".to_owned(),
            Error::NoFamily { refused, .. } if !refused.is_empty() => {
                format!("open {} by name to see why it is not one", name(&refused[0]))
            }
            Error::NoFamily { .. } => "name the folder of one run, or the root file itself (usually d3plot)".to_owned(),
            Error::SeveralFamilies { roots, .. } => {
                format!("name one of the root files, such as {}", roots[0].display())
            }
            Error::Empty { .. } => "copy the file again, or run the simulation again".to_owned(),
            Error::NotD3plot { looks, .. } => looks.remedy()?.to_owned(),
            Error::NotRoot { root, .. } => format!("open {}", root.display()),
            Error::Femzip { .. } => "expand it with FEMZIP first".to_owned(),
            Error::FileType { .. } => "open the d3plot of the same run".to_owned(),
            Error::Unsupported { .. } => "write the run again without this option, or report the file".to_owned(),
            Error::Truncated { .. } => "no state can be read without it; copy the file again".to_owned(),
            Error::Count { .. } | Error::Geometry { .. } => {
                "the file is damaged or of an unknown layout; copy it again, or report it if other programs read it"
                    .to_owned()
            }
            Error::NoSuchState { states: 0, .. } => {
                "the family has no whole state; was the run stopped early?".to_owned()
            }
            Error::NoSuchState { states, .. } => format!("ask for a state from 0 to {}", states - 1),
            Error::NoSuchRow { .. } => "ask for nodes and elements of this family's geometry".to_owned(),
            Error::Layer { .. } => "ask for the maximum, minimum or mean, or for all points".to_owned(),
            Error::Changed { .. } => "open the family again when nothing writes to it any more".to_owned(),
            Error::Exists { .. } => "name another file or folder, or remove the old family first".to_owned(),
            Error::Content { .. } => return None,
            Error::Io { source, .. } => match source.kind() {
                io::ErrorKind::PermissionDenied => "ask for the right to read it".to_owned(),
                _ => return None,
            },
        })
    }

    /// The file or folder the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Error::NoFamily { folder, .. } | Error::SeveralFamilies { folder, .. } => folder,
            Error::NotFound { path }
            | Error::Empty { path }
            | Error::NotD3plot { path, .. }
            | Error::NotRoot { path, .. }
            | Error::Femzip { path }
            | Error::FileType { path, .. }
            | Error::Unsupported { path, .. }
            | Error::Truncated { path, .. }
            | Error::Count { path, .. }
            | Error::Geometry { path, .. }
            | Error::NoSuchState { path, .. }
            | Error::NoSuchRow { path, .. }
            | Error::Layer { path, .. }
            | Error::Changed { path, .. }
            | Error::Exists { path }
            | Error::Content { path, .. }
            | Error::Io { path, .. } => path,
        }
    }

    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Error {
        let path = path.to_owned();
        move |source| match source.kind() {
            io::ErrorKind::NotFound => Error::NotFound { path },
            _ => Error::Io { path, action, source },
        }
    }
}

/// What a file that is no d3plot looks like, by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LooksLike {
    /// Fewer bytes than the 64 words of a control block.
    TooShort,
    /// gzip.
    Gzip,
    /// zip.
    Zip,
    /// LSDA: binout and its like.
    Lsda,
    /// A keyword deck.
    Deck,
    /// LS-DYNA's listing (d3hsp, messag).
    Listing,
    /// Some other text.
    Text,
    /// An animation file of OpenRadioss.
    RadiossAnimation,
    /// HDF5.
    Hdf5,
    /// Nothing but zero bytes.
    Zeros,
    /// None of these.
    Unknown,
}

impl LooksLike {
    /// Judges the first bytes of a file.
    pub(crate) fn of(head: &[u8]) -> LooksLike {
        let text = head.iter().all(|&byte| byte >= 32 || matches!(byte, b'\t' | b'\n' | b'\r' | 12));
        let has = |word: &str| head.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word.as_bytes()));
        match head {
            [0x1f, 0x8b, ..] => LooksLike::Gzip,
            [b'P', b'K', 3, 4, ..] => LooksLike::Zip,
            [8, 4 | 8, 4 | 8, 1, 1..=8, ..] => LooksLike::Lsda,
            [0x89, b'H', b'D', b'F', ..] => LooksLike::Hdf5,
            [0, 0, 0x54, 0x20..=0x2c, ..] => LooksLike::RadiossAnimation,
            _ if text && (has("*KEYWORD") || head.first() == Some(&b'$') || has("*NODE") || has("\n*")) => {
                LooksLike::Deck
            }
            _ if text && (has("LS-DYNA") || has("ls-dyna") || has("Livermore")) => LooksLike::Listing,
            _ if text => LooksLike::Text,
            _ if head.iter().all(|&byte| byte == 0) => LooksLike::Zeros,
            _ if head.len() < 256 => LooksLike::TooShort,
            _ => LooksLike::Unknown,
        }
    }

    fn remedy(self) -> Option<&'static str> {
        Some(match self {
            LooksLike::Gzip => "expand it with gunzip first",
            LooksLike::Zip => "unpack it first",
            LooksLike::Lsda => "shapes are in the d3plot of the same run, not in the binout",
            LooksLike::Deck => "run the simulation, then open its d3plot",
            LooksLike::Listing => "open the d3plot of the same run",
            LooksLike::RadiossAnimation => "convert it to d3plot first (Vortex-Radioss does)",
            LooksLike::TooShort | LooksLike::Zeros => {
                "copy the file again; the copy or the run stopped before anything was written"
            }
            LooksLike::Text | LooksLike::Hdf5 | LooksLike::Unknown => "name the root file of a d3plot family",
        })
    }
}

impl std::fmt::Display for LooksLike {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            LooksLike::TooShort => "shorter than the 64 words of its control block",
            LooksLike::Gzip => "its first bytes are those of gzip",
            LooksLike::Zip => "its first bytes are those of a zip archive",
            LooksLike::Lsda => "its first bytes are those of LSDA (binout)",
            LooksLike::Deck => "it looks like a keyword deck",
            LooksLike::Listing => "it looks like a listing of LS-DYNA (d3hsp)",
            LooksLike::Text => "it looks like text",
            LooksLike::RadiossAnimation => "its first bytes are those of an OpenRadioss animation",
            LooksLike::Hdf5 => "its first bytes are those of HDF5",
            LooksLike::Zeros => "it starts with nothing but zeros",
            LooksLike::Unknown => "no word size and byte order makes a control block of its first 64 words",
        })
    }
}

/// The last part of a path, for sentences that have named the folder already.
pub(crate) fn name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

fn names(paths: &[PathBuf]) -> String {
    const SHOWN: usize = 5;
    let mut list: Vec<String> = paths.iter().take(SHOWN).map(|path| name(path)).collect();
    if paths.len() > SHOWN {
        list.push(format!("and {} more", paths.len() - SHOWN));
    }
    list.join(", ")
}

fn refused_names(refused: &[PathBuf]) -> String {
    match refused {
        [] => String::new(),
        some => format!(" ({} is one by name only)", names(some)),
    }
}
