//! Where the families are that the tests read.
#![allow(dead_code, unreachable_pub)]

use std::path::{Path, PathBuf};

/// The families that come with the crate.
pub fn testdata() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata")
}

/// The larger families beside the repository; says so when they are not there.
pub fn shared_data() -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if data.is_dir() {
        return Some(data);
    }
    println!("skipped: ../shared is not there");
    None
}

/// A copy of a family of testdata that a test may damage.
pub struct Copy {
    folder: tempfile::TempDir,
}

impl Copy {
    pub fn of(family: &str) -> Copy {
        let copy = Copy { folder: tempfile::tempdir().unwrap() };
        for entry in std::fs::read_dir(testdata().join(family)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "json") {
                std::fs::copy(&path, copy.path(path.file_name().unwrap().to_str().unwrap())).unwrap();
            }
        }
        copy
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    pub fn root(&self) -> PathBuf {
        self.path("d3plot")
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    /// A word (4 bytes, little endian) of the root.
    pub fn word(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.read("d3plot")[at * 4..at * 4 + 4].try_into().unwrap())
    }

    /// Overwrites words (4 bytes, little endian) of the root's control block.
    pub fn poke(&self, words: &[(usize, i32)]) {
        let mut bytes = self.read("d3plot");
        for (at, value) in words {
            bytes[at * 4..at * 4 + 4].copy_from_slice(&value.to_le_bytes());
        }
        self.write("d3plot", &bytes);
    }

    /// Shortens or lengthens (with zeros) a file.
    pub fn set_length(&self, name: &str, bytes: u64) {
        std::fs::OpenOptions::new().write(true).open(self.path(name)).unwrap().set_len(bytes).unwrap();
    }
}

/// Reads everything a family has, for what it may do wrong; returns the number of states.
pub fn read_everything(family: &d3plot::Family) -> Result<usize, d3plot::Error> {
    use d3plot::Layers;
    for state in 0..family.times().len() {
        for field in family.fields() {
            family.table(state, field.name)?;
            family.values(state, field.name)?;
        }
        family.coordinates(state)?;
        family.velocity(state)?;
        family.acceleration(state)?;
        family.temperature(state)?;
        family.deletion(state)?;
        for layers in [Layers::Max, Layers::Min, Layers::Mean, Layers::Inner, Layers::Outer, Layers::Mid] {
            for result in [
                family.shell_plastic_strain(state, layers),
                family.solid_plastic_strain(state, layers),
                family.thick_shell_plastic_strain(state, layers),
            ] {
                match result {
                    Ok(_) | Err(d3plot::Error::Layer { .. } | d3plot::Error::Unsupported { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
        }
    }
    let _words: Vec<String> = family.warnings().iter().map(ToString::to_string).collect();
    Ok(family.times().len())
}
