//! Files mapped into memory, on the user's word alone.
//!
//! The one module of the crate with `unsafe`. A map of a file that another process cuts ends the program by a signal when a
//! page behind the new end is touched (SIGBUS), and bytes that another process changes change under a reference. Whoever
//! asks for maps (`ReadOptions::map`) takes that on; no other reading goes through here.

use std::fs::File;
use std::path::Path;

use memmap2::Mmap;

/// A file in memory.
#[derive(Debug)]
pub(crate) struct Map(Option<Mmap>);

impl Map {
    /// Maps the file, as long as it is now. An empty file cannot be mapped and has no bytes.
    pub(crate) fn of(path: &Path) -> std::io::Result<Map> {
        let file = File::open(path)?;
        if file.metadata()?.len() == 0 {
            return Ok(Map(None));
        }
        // SAFETY: sound as long as no process cuts or changes the file while the map lives. Nobody can hold the file system
        // to that; the caller was told so where maps are asked for, and all reading of d3plots by numbers of plain words
        // tolerates any value that such a change can bring.
        let map = unsafe { Mmap::map(&file)? };
        Ok(Map(Some(map)))
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        self.0.as_deref().unwrap_or_default()
    }
}
