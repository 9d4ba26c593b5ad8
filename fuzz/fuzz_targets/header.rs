//! Any control block in front of a sound geometry.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| d3plot_fuzz::header(bytes));
