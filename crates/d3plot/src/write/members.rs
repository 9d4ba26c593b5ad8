//! The files of a family that is being written: the next one is begun where a state does not fit into the one before.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::members::{files_in, folder_of, member_number};

/// The member that is open, and where the next byte goes.
#[derive(Debug)]
pub(super) struct Members {
    root: PathBuf,
    path: PathBuf,
    file: File,
    number: u32,
    /// Byte of the open member at which the next state starts.
    at: u64,
    /// The most bytes of a member, a whole number of blocks.
    limit: u64,
    /// Bytes of a block: members are padded to whole ones.
    block: u64,
}

impl Members {
    /// Creates the root. Nothing that exists is overwritten, and no member of another run may lie beside it.
    pub(super) fn create(root: &Path, limit: u64, block: u64) -> Result<Members, Error> {
        let name = root.file_name().unwrap_or_default().as_encoded_bytes();
        let is_member = |file: &[u8]| file.strip_prefix(name).is_some_and(|suffix| member_number(suffix).is_some());
        if let Some((path, _)) = files_in(folder_of(root), is_member)?.into_iter().next() {
            return Err(Error::Exists { path });
        }
        let file = create(root)?;
        let (root, path) = (root.to_owned(), root.to_owned());
        Ok(Members { root, path, file, number: 0, at: 0, limit: limit.max(block) / block * block, block })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn number(&self) -> u32 {
        self.number
    }

    /// Bytes left in the open member.
    pub(super) fn left(&self) -> u64 {
        self.limit.saturating_sub(self.at)
    }

    pub(super) fn is_fresh(&self) -> bool {
        self.at == 0
    }

    /// Writes bytes at the place of the next state; what does not fit runs on into further members.
    pub(super) fn put(&mut self, mut bytes: &[u8]) -> Result<(), Error> {
        while !bytes.is_empty() {
            if self.left() == 0 {
                self.begin_next()?;
            }
            let here = usize::try_from(self.left()).unwrap_or(usize::MAX).min(bytes.len());
            self.write_at(&bytes[..here])?;
            self.at += here as u64;
            bytes = &bytes[here..];
        }
        Ok(())
    }

    /// Writes a mark where the next state will overwrite it; a member that is exactly full has none.
    pub(super) fn mark(&mut self, mark: &[u8]) -> Result<(), Error> {
        if self.left() >= mark.len() as u64 { self.write_at(mark) } else { Ok(()) }
    }

    /// Pads the open member to whole blocks.
    pub(super) fn pad(&mut self) -> Result<(), Error> {
        let length = self.file.metadata().map_err(Error::io(&self.path, "looking at it"))?.len();
        self.file.set_len(length.next_multiple_of(self.block)).map_err(Error::io(&self.path, "writing"))
    }

    /// Pads the open member and begins the next.
    pub(super) fn begin_next(&mut self) -> Result<(), Error> {
        self.pad()?;
        self.number += 1;
        let mut name = self.root.file_name().unwrap_or_default().to_owned();
        name.push(format!("{:02}", self.number));
        self.path = self.root.with_file_name(name);
        self.file = create(&self.path)?;
        self.at = 0;
        Ok(())
    }

    /// Hands what is written to the disk.
    pub(super) fn sync(&self) -> Result<(), Error> {
        self.file.sync_data().map_err(Error::io(&self.path, "writing"))
    }

    fn write_at(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.file.seek(SeekFrom::Start(self.at)).map_err(Error::io(&self.path, "writing"))?;
        self.file.write_all(bytes).map_err(Error::io(&self.path, "writing"))
    }
}

fn create(path: &Path) -> Result<File, Error> {
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => Err(Error::Exists { path: path.to_owned() }),
        other => other.map_err(Error::io(path, "creating")),
    }
}
