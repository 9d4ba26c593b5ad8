//! A sound root, any bytes as the other members.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| d3plot_fuzz::state(bytes));
