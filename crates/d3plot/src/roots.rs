//! Which families lie in a folder: told by the content of the files, not by their names.

use std::path::{Path, PathBuf};

use crate::detect::{FileType, glance};
use crate::error::{Error, LooksLike};
use crate::members::{files_in, is_level, read_head};

/// What a folder holds.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct Roots {
    /// Roots of families that [`Family::open`](crate::Family::open) can try, sorted by name.
    pub families: Vec<Root>,
    /// Further levels of adaptive meshes (`d3plotaa` beside `d3plot`): each can be opened by name.
    pub levels: Vec<Root>,
    /// Files that are d3plots by their name but cannot be read as such, and compressed families under any name.
    pub refused: Vec<Refused>,
}

/// The root of a family, looked at but not opened.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Root {
    /// The file.
    pub path: PathBuf,
    /// Which database it is.
    pub file_type: FileType,
    /// Title of the run in the control block.
    pub title: String,
}

/// A file that cannot be read although its name or content says d3plot.
#[derive(Debug)]
#[non_exhaustive]
pub struct Refused {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub error: Error,
}

/// Looks at the first words of every file directly in `folder`. Later members of a family, databases of other types and
/// files of other programs are passed over, unless their name says d3plot: `d3plot`, `*.d3plot`, `*.ptf`, `*.fz`.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Io`] if the folder cannot be listed.
pub fn roots(folder: &Path) -> Result<Roots, Error> {
    let mut found = Roots::default();
    for (path, bytes) in files_in(folder, |_| true)? {
        match look(&path, bytes) {
            Ok(Some(root)) => found.families.push(root),
            Ok(None) => {}
            Err(error) => found.refused.push(Refused { path, error }),
        }
    }
    let is_base = |path: &Path, of: &Path| {
        let suffix = of.as_os_str().as_encoded_bytes().strip_prefix(path.as_os_str().as_encoded_bytes());
        suffix.is_some_and(is_level)
    };
    let paths: Vec<PathBuf> = found.families.iter().map(|root| root.path.clone()).collect();
    let (levels, families) =
        found.families.into_iter().partition(|root| paths.iter().any(|path| is_base(path, &root.path)));
    Ok(Roots { families, levels, refused: found.refused })
}

/// Whether a file is a root; an error only for files that ought to be one.
fn look(path: &Path, bytes: u64) -> Result<Option<Root>, Error> {
    let named = is_named_d3plot(path);
    let glance = match glance(path, bytes) {
        Ok(glance) => glance,
        Err(error) => return if named { Err(error) } else { Ok(None) },
    };
    let path = path.to_owned();
    match glance {
        Some(glance) if glance.femzip => Err(Error::Femzip { path }),
        Some(glance) => match glance.file_type() {
            Some(file_type) => Ok(Some(Root { path, file_type, title: glance.title })),
            None if named => Err(glance.wrong_type(&path)),
            None => Ok(None),
        },
        None if named && bytes == 0 => Err(Error::Empty { path }),
        None if named => {
            let looks = LooksLike::of(&read_head(&path, 512)?);
            Err(Error::NotD3plot { path, looks })
        }
        None => Ok(None),
    }
}

/// Whether people and programs call such a file a d3plot.
fn is_named_d3plot(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name == "d3plot" || [".d3plot", ".ptf", ".fz", ".fz8"].iter().any(|end| name.ends_with(end))
}
