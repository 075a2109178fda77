//! [`fuzz_cases::air_robot`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_cases::air_robot(data));
