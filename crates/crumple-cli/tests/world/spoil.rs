//! Runs that are spoilt in a known way: copies of the example's d3plot families with a few bytes changed.
//!
//! The example is single precision, little endian. The control block starts with 64 words; word 16 is the number of
//! nodes, word 18 the number of global values of a state. A state is its time, the global values, then the
//! coordinates of all nodes.

use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};

use super::{copy, example_run};

/// A copy of a run of the example.
pub struct Spoilt {
    folder: PathBuf,
}

impl Spoilt {
    /// Copies `run` to `folder`.
    pub fn copy_of(run: &str, folder: &Path) -> Self {
        copy(&example_run(run), folder);
        Self { folder: folder.to_owned() }
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn word(&self, at: usize) -> usize {
        let bytes = fs::read(self.folder.join("d3plot")).unwrap();
        u32::from_le_bytes(bytes[4 * at..4 * at + 4].try_into().unwrap()) as usize
    }

    fn change(&self, file: &str, at: usize, bytes: &[u8]) {
        let path = self.folder.join(file);
        let mut content = fs::read(&path).unwrap();
        content[at..at + bytes.len()].copy_from_slice(bytes);
        fs::write(path, content).unwrap();
    }

    /// Another value for a word of the control block.
    pub fn poke(self, word: usize, value: i32) -> Self {
        self.change("d3plot", 4 * word, &value.to_le_bytes());
        self
    }

    /// Shortens a file of the family to `bytes`.
    pub fn cut(self, file: &str, bytes: u64) -> Self {
        let file = OpenOptions::new().write(true).open(self.folder.join(file)).unwrap();
        assert!(file.metadata().unwrap().len() > bytes, "the cut would lengthen the file");
        file.set_len(bytes).unwrap();
        self
    }

    /// Gives the first node of the hat, 1001, another number: another mesh with as many nodes.
    pub fn renumber(self, node: u32) -> Self {
        let bytes = fs::read(self.folder.join("d3plot")).unwrap();
        let list: Vec<u8> = [1001_u32, 1002, 1003, 1004].iter().flat_map(|id| id.to_le_bytes()).collect();
        let at = (0..bytes.len() - list.len()).step_by(4).find(|&at| bytes[at..].starts_with(&list));
        self.change("d3plot", at.expect("the node numbers are in the root file"), &node.to_le_bytes());
        self
    }

    /// Makes the x coordinate of node number `node` (counted from 0) in the first state of `file` NaN.
    pub fn break_coordinate(self, file: &str, node: usize) -> Self {
        self.move_node(file, node, f32::NAN)
    }

    /// Moves a node in the first state of `file`: the same mesh, another content.
    pub fn move_node(self, file: &str, node: usize, x: f32) -> Self {
        assert!(node < self.word(16));
        let coordinates = 1 + self.word(18);
        self.change(file, 4 * (coordinates + 3 * node), &x.to_le_bytes());
        self
    }
}

/// A folder with one file `d3plot` of the given bytes.
pub fn no_d3plot(folder: &Path, bytes: &[u8]) -> PathBuf {
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("d3plot"), bytes).unwrap();
    folder.to_owned()
}

/// Bytes without any order (xorshift), the same every time.
pub fn noise(count: usize) -> Vec<u8> {
    let mut state = 0x2545_F491_4F6C_DD1D_u64;
    std::iter::repeat_with(|| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as u8
    })
    .take(count)
    .collect()
}
