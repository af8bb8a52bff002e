#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = bristle_fuzz::checkpoint(bytes);
});
