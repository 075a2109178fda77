//! [`fuzz_cases::recording_mcap`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_cases::recording_mcap(data));
