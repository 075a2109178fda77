//! [`fuzz_cases::air_console`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_cases::air_console(data));
