//! Arbitrary text for the reader of expression graphs.

#![no_main]

mod reading;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| reading::check(text));
