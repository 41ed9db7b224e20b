//! See the function of this name in `src/lib.rs`.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| isospectrum_fuzz::volumes(input));
