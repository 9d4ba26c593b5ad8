//! A study that is being made: a folder beside its place, renamed when everything is in it.

use std::path::{Path, PathBuf};

use super::{Error, store};
use crate::error::io;

const LOCKED: &str = "lock";

/// A folder that is being filled under a temporary name, removed unless it was renamed. A locked file beside it tells
/// the folder of a live process from that of a killed one.
pub(super) struct StagedFolder {
    pub(super) path: PathBuf,
    lock: store::Lock,
}

impl StagedFolder {
    pub(super) fn beside(folder: &Path) -> Result<Self, Error> {
        let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent).map_err(io("make the folder", parent))?;
        clear_dead(parent, &folder.file_name().unwrap_or_default().to_string_lossy());
        loop {
            let path = store::temporary_name(folder);
            let lock = store::Lock::exclusive(&lock_of(&path))?;
            // Between making the file and locking it, somebody may have taken it for a dead one and removed it.
            if !lock_of(&path).exists() {
                continue;
            }
            let staged = Self { path, lock };
            std::fs::create_dir(&staged.path).map_err(io("make the folder", folder))?;
            return Ok(staged);
        }
    }

    pub(super) fn rename_to(self, folder: &Path) -> Result<(), Error> {
        // What is renamed is no longer at the old path, and nothing is there for `drop` to remove.
        if let Err(error) = std::fs::rename(&self.path, folder) {
            use std::io::ErrorKind::{AlreadyExists, DirectoryNotEmpty};
            return Err(match error.kind() {
                // Another process made a study here meanwhile.
                AlreadyExists | DirectoryNotEmpty => {
                    Error::StudyExists { folder: folder.to_owned(), what: "a study is here already".into() }
                }
                _ => io("write", folder)(error),
            });
        }
        store::sync_folder(folder.parent().unwrap_or(Path::new(".")));
        Ok(())
    }
}

impl Drop for StagedFolder {
    fn drop(&mut self) {
        // The failure that led here is what the user hears of. The lock is held until both are gone.
        let _held = &self.lock;
        let _ = std::fs::remove_dir_all(&self.path);
        let _ = std::fs::remove_file(lock_of(&self.path));
    }
}

/// The file that is locked as long as the folder is being filled.
fn lock_of(path: &Path) -> PathBuf {
    path.with_file_name(format!("{}.{LOCKED}", path.file_name().unwrap_or_default().to_string_lossy()))
}

/// Removes what killed processes left; what cannot be removed is in nobody's way.
fn clear_dead(parent: &Path, name: &str) {
    for left in store::temporaries(parent, name) {
        let folder = if left.extension().is_some_and(|end| end == LOCKED) { left.with_extension("") } else { left };
        if let Ok(Some(_dead)) = store::Lock::try_exclusive(&lock_of(&folder)) {
            let _ = std::fs::remove_dir_all(&folder);
            let _ = std::fs::remove_file(lock_of(&folder));
        }
    }
}
