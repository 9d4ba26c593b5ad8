//! A sound control block, any bytes behind it: the first byte chooses the family, the next two where the bytes go.
#![no_main]

use d3plot_fuzz::{base, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let [choice, low, high, rest @ ..] = bytes else { return };
    let mut files = base(*choice);
    let root = &mut files[0];
    let at = usize::from(u16::from_le_bytes([*low, *high])).min(root.len());
    root.truncate(at.max(64 * d3plot_fuzz::word_size(*choice)));
    root.extend(rest);
    read(files);
});
