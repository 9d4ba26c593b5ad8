//! Where the bytes of a deck and of its includes come from: the disk, or memory (tests, archives).

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// A set of files by path.
pub trait Files {
    /// Opens a file for reading.
    ///
    /// # Errors
    /// Whatever the place says; [`io::ErrorKind::NotFound`] where there is no such file.
    fn open(&self, path: &Path) -> io::Result<Box<dyn Read + '_>>;

    /// Whether a file is there.
    fn exists(&self, path: &Path) -> bool;

    /// The same path for the same file, whatever way leads to it: circles of includes are found by it.
    fn identity(&self, path: &Path) -> PathBuf;
}

/// The file system.
#[derive(Debug, Clone, Copy, Default)]
pub struct Disk;

impl Files for Disk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn Read + '_>> {
        Ok(Box::new(File::open(path)?))
    }

    fn exists(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn identity(&self, path: &Path) -> PathBuf {
        path.canonicalize().unwrap_or_else(|_| path.to_owned())
    }
}

/// Files in memory.
#[derive(Debug, Clone, Default)]
pub struct Memory(pub HashMap<PathBuf, Vec<u8>>);

impl Files for Memory {
    fn open(&self, path: &Path) -> io::Result<Box<dyn Read + '_>> {
        match self.0.get(&self.identity(path)) {
            Some(bytes) => Ok(Box::new(&bytes[..])),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn exists(&self, path: &Path) -> bool {
        self.0.contains_key(&self.identity(path))
    }

    /// The path without `.` and with `..` resolved by name.
    fn identity(&self, path: &Path) -> PathBuf {
        let mut plain = PathBuf::new();
        for part in path.components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir => {
                    plain.pop();
                }
                other => plain.push(other),
            }
        }
        plain
    }
}
