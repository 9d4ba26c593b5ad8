//! Any bytes as the files of a family.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| d3plot_fuzz::family(bytes));
