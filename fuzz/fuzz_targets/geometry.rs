//! A sound control block, any bytes behind it.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| d3plot_fuzz::geometry(bytes));
