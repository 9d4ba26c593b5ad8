//! Files that are whole at every moment: written beside, synced, renamed; and the locks of a study.

use std::fs::File;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::Error;
use crate::error::io;

/// Writes a file under a temporary name in the same folder, syncs it and renames it over `path`. A reader sees the
/// old file or the new one, never a part of either; when anything fails the old one stays and nothing is left behind.
///
/// # Errors
/// [`Error::Io`] naming `path`, or what `write` returns.
pub(crate) fn write_whole<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<T, Error>,
) -> Result<T, Error> {
    if path.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        // A device or a pipe is written to, never replaced.
        let mut writer = BufWriter::new(File::options().write(true).open(path).map_err(io("write", path))?);
        let value = write(&mut writer)?;
        writer.flush().map_err(io("write", path))?;
        return Ok(value);
    }
    let staged = Staged::beside(path);
    let mut writer = BufWriter::new(staged.create(path)?);
    let value = write(&mut writer)?;
    let file = writer.into_inner().map_err(|error| io("write", path)(error.into_error()))?;
    file.sync_all().map_err(io("write", path))?;
    staged.rename_to(path)?;
    Ok(value)
}

/// [`write_whole`] for bytes that are ready.
///
/// # Errors
/// [`Error::Io`] naming `path`.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_whole(path, |writer| writer.write_all(bytes).map_err(io("write", path)))
}

/// Marks temporary names: `.NAME.tmp-RANDOM`.
const MARK: &str = ".tmp-";

/// A name beside `path` for something that is not whole yet.
pub(crate) fn temporary_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Random, not the process id: writers on several hosts may share it.
    let nonce = RandomState::new().build_hasher().finish();
    path.with_file_name(format!(".{name}{MARK}{nonce:016x}"))
}

/// What stands in `folder` under a temporary name for `name`, or for any name where it is empty.
pub(crate) fn temporaries(folder: &Path, name: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let temporary = |entry: &std::fs::DirEntry| {
        let entry = entry.file_name().to_string_lossy().into_owned();
        let stands_for =
            entry.strip_prefix('.').and_then(|rest| rest.rsplit_once(MARK)).map(|(stands_for, _)| stands_for);
        stands_for.is_some_and(|stands_for| name.is_empty() || stands_for == name)
    };
    entries.filter(temporary).map(|entry| entry.path()).collect()
}

/// A temporary file that is removed unless it was renamed.
pub(crate) struct Staged {
    /// Where it is.
    pub(crate) path: PathBuf,
}

impl Staged {
    pub(crate) fn beside(path: &Path) -> Self {
        Self { path: temporary_name(path) }
    }

    /// Makes the file; `path`, the one it stands for, is named in the error.
    pub(crate) fn create(&self, path: &Path) -> Result<File, Error> {
        File::create_new(&self.path).map_err(io("write", path))
    }

    pub(crate) fn rename_to(self, path: &Path) -> Result<(), Error> {
        std::fs::rename(&self.path, path).map_err(io("write", path))?;
        sync_folder(path.parent().unwrap_or(Path::new(".")));
        std::mem::forget(self);
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // The failure that led here is what the user hears of.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Makes a rename last through a power cut, where the system can; elsewhere it is as lasting as its files are.
pub(crate) fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// A lock file of a study, held until dropped.
pub(crate) struct Lock(#[expect(dead_code, reason = "the lock lives as long as the open file")] File);

impl Lock {
    /// Waits until nobody else holds it.
    pub(crate) fn exclusive(path: &Path) -> Result<Self, Error> {
        let file = Self::open(path)?;
        file.lock().map_err(io("lock", path))?;
        Ok(Self(file))
    }

    /// Waits until nobody holds it exclusively.
    pub(crate) fn shared(path: &Path) -> Result<Self, Error> {
        let file = Self::open(path)?;
        file.lock_shared().map_err(io("lock", path))?;
        Ok(Self(file))
    }

    /// The exclusive lock if nobody holds it now.
    pub(crate) fn try_exclusive(path: &Path) -> Result<Option<Self>, Error> {
        let file = Self::open(path)?;
        Ok(file.try_lock().is_ok().then_some(Self(file)))
    }

    fn open(path: &Path) -> Result<File, Error> {
        File::options().create(true).truncate(false).write(true).open(path).map_err(io("write", path))
    }
}
