//! A sound root, any bytes as the other members; the first byte chooses the family.
#![no_main]

use d3plot_fuzz::{base, read, split};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((&choice, rest)) = bytes.split_first() else { return };
    let mut files = base(choice);
    files.truncate(1);
    files.extend(split(rest));
    read(files);
});
