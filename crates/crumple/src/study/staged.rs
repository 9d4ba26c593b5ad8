//! A study that is being made: a folder beside its place, renamed when everything is in it.

use std::path::{Path, PathBuf};

use super::{Error, LOCK, store};
use crate::error::io;

/// A folder that is being filled under a temporary name, removed unless it was renamed.
pub(super) struct StagedFolder {
    pub(super) path: PathBuf,
    /// Held as long as the folder is being filled: tells the folder of a killed process from that of a live one.
    _lock: store::Lock,
}

impl StagedFolder {
    pub(super) fn beside(folder: &Path) -> Result<Self, Error> {
        let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent).map_err(io("make the folder", parent))?;
        for path in store::temporaries(parent, &folder.file_name().unwrap_or_default().to_string_lossy()) {
            if path.is_dir() && matches!(store::Lock::try_exclusive(&path.join(LOCK)), Ok(Some(_))) {
                // Left by a killed process; if it cannot be removed it is in nobody's way.
                let _ = std::fs::remove_dir_all(&path);
            }
        }
        let path = store::temporary_name(folder);
        std::fs::create_dir(&path).map_err(io("make the folder", folder))?;
        let lock = store::Lock::exclusive(&path.join(LOCK))?;
        Ok(Self { path, _lock: lock })
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
        // The failure that led here is what the user hears of.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}
