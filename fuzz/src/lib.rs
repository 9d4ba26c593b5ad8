//! The fuzz targets, and what they share: reading everything a family has, and a limit on the memory that this may take.
//!
//! The limit is the promise of the crate: no more than twice the files' size at any moment, and a megabyte for what does
//! not grow with the files. The files themselves are in memory here and are not counted.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use d3plot::{Error, Family, Layers, Rows};

/// Bytes that do not grow with the files.
const FIXED: usize = 1 << 20;

/// The system's allocator, counting.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Relaxed) + layout.size();
        MOST.fetch_max(now, Relaxed);
        // SAFETY: the caller's promise is handed on
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promise is handed on
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Opens a family of these files, reads all of it, and checks what must be true of any bytes.
fn read(files: Vec<Vec<u8>>) {
    let size: usize = files.iter().map(Vec::len).sum();
    let name =
        |number: usize| PathBuf::from(if number == 0 { "d3plot".to_owned() } else { format!("d3plot{number:02}") });
    let files: Vec<(PathBuf, Vec<u8>)> = files.into_iter().enumerate().map(|(n, bytes)| (name(n), bytes)).collect();
    let before = NOW.load(Relaxed);
    MOST.store(before, Relaxed);
    match Family::of_bytes(files) {
        Ok(family) => {
            check_memory(before, size, "opening");
            if let Err(error) = everything(&family, before, size) {
                tell(&error);
            }
        }
        Err(error) => tell(&error),
    }
    check_memory(before, size, "reading");
}

/// Every error names a file and has something to say.
fn tell(error: &Error) {
    assert!(error.to_string().starts_with(&error.path().display().to_string()), "{error}");
    let _ = error.remedy();
}

fn check_memory(before: usize, size: usize, when: &str) {
    let most = MOST.load(Relaxed).saturating_sub(before);
    assert!(most <= 2 * size + FIXED, "{when} took {most} bytes for files of {size}");
}

fn everything(family: &Family, before: usize, size: usize) -> Result<(), Error> {
    let geometry = family.geometry();
    assert_eq!(geometry.coordinates.len(), family.header().nodes);
    assert!(family.times().is_sorted());
    for warning in family.warnings() {
        assert!(!warning.to_string().is_empty());
    }
    let parts: Vec<usize> = (0..family.parts().len().min(2)).collect();
    let names: Vec<&str> = family.fields().iter().map(|field| field.name).collect();
    let last = family.times().len().saturating_sub(1);
    for state in [0, 1, last].into_iter().filter(|&state| state < family.times().len()) {
        for name in &names {
            family.values(state, name)?;
            family.table(state, name)?;
            for layers in [Layers::Max, Layers::Mean, Layers::Outer] {
                match family.values_of_layer(state, name, layers) {
                    Ok(_) | Err(Error::Layer { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
            check_memory(before, size, name);
        }
        family.coordinates(state)?;
        family.deletion(state)?;
        family.ranges(state)?;
        check_memory(before, size, "ranges");
        for &part in &parts {
            let mut values: Vec<f32> = Vec::new();
            family.values_into(state, "coordinates", Rows::These(&family.nodes_of_part(part)), &mut values)?;
        }
    }
    Ok(())
}

/// Target `family`: any bytes as the files of a family.
pub fn family(bytes: &[u8]) {
    read(split(bytes));
}

/// Target `header`: any control block in front of a sound geometry. The first byte chooses the family, then follow pairs of
/// a word's place and its new value.
pub fn header(bytes: &[u8]) {
    let Some((&choice, changes)) = bytes.split_first() else { return };
    let mut files = base(choice);
    let word = word_size(choice);
    for change in changes.chunks_exact(1 + word).take(40) {
        let at = (usize::from(change[0]) % 128) * word;
        if let Some(place) = files[0].get_mut(at..at + word) {
            place.copy_from_slice(&change[1..]);
        }
    }
    read(files);
}

/// Target `geometry`: a sound control block, any bytes behind it. The first byte chooses the family, the next two where the
/// bytes go.
pub fn geometry(bytes: &[u8]) {
    let [choice, low, high, rest @ ..] = bytes else { return };
    let mut files = base(*choice);
    let root = &mut files[0];
    let at = usize::from(u16::from_le_bytes([*low, *high])).min(root.len());
    root.truncate(at.max(64 * word_size(*choice)));
    root.extend(rest);
    read(files);
}

/// Target `state`: a sound root, any bytes as the other members; the first byte chooses the family.
pub fn state(bytes: &[u8]) {
    let Some((&choice, rest)) = bytes.split_first() else { return };
    let mut files = base(choice);
    files.truncate(1);
    files.extend(split(rest));
    read(files);
}

/// Splits bytes into files at every four bytes `CUT!`.
fn split(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(4).position(|window| window == b"CUT!").filter(|_| files.len() < 40) {
        files.push(rest[..at].to_vec());
        rest = &rest[at + 4..];
    }
    files.push(rest.to_vec());
    files
}

/// Sound families of testdata, with the bytes of a word.
const BASES: [(usize, &[&[u8]]); 8] = [
    (
        4,
        &[
            include_bytes!("../../crates/d3plot/testdata/s01_shells_latin1/d3plot"),
            include_bytes!("../../crates/d3plot/testdata/s01_shells_latin1/d3plot01"),
        ],
    ),
    (
        8,
        &[
            include_bytes!("../../crates/d3plot/testdata/s02_double_solids/d3plot"),
            include_bytes!("../../crates/d3plot/testdata/s02_double_solids/d3plot01"),
        ],
    ),
    (
        4,
        &[
            include_bytes!("../../crates/d3plot/testdata/s03_big_endian_mix/d3plot"),
            include_bytes!("../../crates/d3plot/testdata/s03_big_endian_mix/d3plot01"),
        ],
    ),
    (
        4,
        &[
            include_bytes!("../../crates/d3plot/testdata/s06_extra_penout/d3plot"),
            include_bytes!("../../crates/d3plot/testdata/s06_extra_penout/d3plot01"),
        ],
    ),
    (
        4,
        &[
            include_bytes!("../../crates/d3plot/testdata/s08_rigid_shells/d3plot"),
            include_bytes!("../../crates/d3plot/testdata/s08_rigid_shells/d3plot01"),
        ],
    ),
    (
        4,
        &[
            include_bytes!("../../crates/d3plot/testdata/x03_rigid_nodes/d3plot"),
            include_bytes!("../../crates/d3plot/testdata/x03_rigid_nodes/d3plot01"),
        ],
    ),
    (
        4,
        &[
            include_bytes!("../../crates/d3plot/testdata/x07_particles/d3plot"),
            include_bytes!("../../crates/d3plot/testdata/x07_particles/d3plot01"),
        ],
    ),
    (8, &[include_bytes!("../../crates/d3plot/testdata/x10_states_in_root/d3plot")]),
];

/// A sound family, as its files.
fn base(choice: u8) -> Vec<Vec<u8>> {
    BASES[usize::from(choice) % BASES.len()].1.iter().map(|file| file.to_vec()).collect()
}

/// Bytes of its words.
fn word_size(choice: u8) -> usize {
    BASES[usize::from(choice) % BASES.len()].0
}
