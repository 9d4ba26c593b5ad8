//! A bundle: the runs below some folders, each with its id.
//!
//! A run's id is its path below the folder given, without the root file's name where a folder holds one family:
//! `bundle/run_007/d3plot` is `run_007` when `bundle` was given, and also when `bundle/run_007` was.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use crate::Error;
use crate::deck;
use crate::error::io;

/// A result file that was found, with the id it will have in a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The id.
    pub id: String,
    /// Path of the root file.
    pub path: PathBuf,
    /// Why it cannot be a run although its name says so; such files are reported, not passed over.
    pub fault: Option<Fault>,
}

/// Why a file cannot be a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// What is wrong, with the file's path.
    pub what: String,
    /// What to do about it.
    pub remedy: Option<String>,
}

/// Folders deeper than this below the one given are not searched.
const DEPTH_MAX: usize = 32;

/// Finds the runs at or below `paths`, sorted by id.
///
/// # Errors
/// [`Error::NoSuchPath`], [`Error::NoRuns`] for a folder without any, [`Error::SameId`], [`Error::Read`] for a file
/// that is given by name and is no result file.
pub fn find(paths: &[PathBuf]) -> Result<Vec<Found>, Error> {
    let mut by_id: BTreeMap<String, Found> = BTreeMap::new();
    let mut seen = HashSet::new();
    for path in paths {
        let found = if path.is_dir() {
            below(path)?
        } else if path.exists() {
            vec![by_name(path)?]
        } else {
            return Err(Error::NoSuchPath(path.clone()));
        };
        for run in found {
            // A file that is reached twice is one run, under the id it had first.
            if !seen.insert(run.path.canonicalize().map_err(io("read", &run.path))?) {
                continue;
            }
            if let Some(first) = by_id.get(&run.id) {
                return Err(Error::SameId { id: run.id, first: first.path.clone(), second: run.path });
            }
            by_id.insert(run.id.clone(), run);
        }
    }
    Ok(by_id.into_values().collect())
}

/// A file that is given by name.
fn by_name(path: &Path) -> Result<Found, Error> {
    let absolute = path.canonicalize().map_err(io("read", path))?;
    if deck::is_deck(path) {
        let name = absolute.file_name().unwrap_or_default().to_string_lossy().into_owned();
        return Ok(Found { id: name, path: path.to_owned(), fault: None });
    }
    let folder = absolute.parent().unwrap_or(Path::new("/"));
    let roots = d3plot::roots(folder)?;
    if !roots.families.iter().any(|root| root.path.file_name() == absolute.file_name()) {
        // Says what it is instead, or opens what only its owner knows to be a result file.
        d3plot::Family::open(path)?;
    }
    let name = if alone(&roots) { folder.file_name() } else { absolute.file_name() };
    let id = name.map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned());
    Ok(Found { id, path: path.to_owned(), fault: None })
}

/// Whether a folder holds one run, so that the run can be called after it.
fn alone(roots: &d3plot::Roots) -> bool {
    roots.families.len() + roots.refused.len() == 1
}

fn below(folder: &Path) -> Result<Vec<Found>, Error> {
    let mut search = Search { top: folder, found: Vec::new(), files: 0, seen: HashSet::new() };
    search.visit(folder, 0)?;
    let Search { mut found, files, .. } = search;
    if found.is_empty() {
        return Err(Error::NoRuns { folder: folder.to_owned(), files });
    }
    if let [only] = &mut found[..]
        && only.id.is_empty()
    {
        // The folder given is the run itself.
        let absolute = folder.canonicalize().map_err(io("read", folder))?;
        only.id = absolute.file_name().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned());
    }
    for run in &mut found {
        if run.id.is_empty() {
            run.id = run.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        }
    }
    Ok(found)
}

struct Search<'a> {
    top: &'a Path,
    found: Vec<Found>,
    files: usize,
    /// Folders already visited: links may lead in circles.
    seen: HashSet<PathBuf>,
}

impl Search<'_> {
    fn visit(&mut self, folder: &Path, depth: usize) -> Result<(), Error> {
        if depth > DEPTH_MAX || !self.seen.insert(folder.canonicalize().map_err(io("read the folder", folder))?) {
            return Ok(());
        }
        let mut subfolders = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(io("read the folder", folder))? {
            let path = entry.map_err(io("read the folder", folder))?.path();
            if path.is_dir() {
                subfolders.push(path);
            } else {
                self.files += 1;
            }
        }
        let roots = d3plot::roots(folder)?;
        let here = folder.strip_prefix(self.top).unwrap_or(Path::new(""));
        let alone = alone(&roots);
        let id = |root: &Path| {
            let path = if alone { here.to_owned() } else { here.join(root.file_name().unwrap_or_default()) };
            path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
        };
        self.found.extend(roots.families.iter().map(|root| Found {
            id: id(&root.path),
            path: root.path.clone(),
            fault: None,
        }));
        self.found.extend(roots.refused.iter().map(|refused| Found {
            id: id(&refused.path),
            path: refused.path.clone(),
            fault: Some(Fault { what: refused.error.to_string(), remedy: refused.error.remedy() }),
        }));
        subfolders.sort();
        subfolders.iter().try_for_each(|folder| self.visit(folder, depth + 1))
    }
}
