//! [`fuzz_cases::script`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_cases::script(data));
