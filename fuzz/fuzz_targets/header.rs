//! Any control block in front of a sound geometry: the first byte chooses the family, then follow pairs of a word's place
//! and its new value.
#![no_main]

use d3plot_fuzz::{base, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((&choice, changes)) = bytes.split_first() else { return };
    let mut files = base(choice);
    let word = d3plot_fuzz::word_size(choice);
    for change in changes.chunks_exact(1 + word).take(40) {
        let at = (usize::from(change[0]) % 128) * word;
        if let Some(place) = files[0].get_mut(at..at + word) {
            place.copy_from_slice(&change[1..]);
        }
    }
    read(files);
});
