//! [`fuzz_cases::robot_file`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_cases::robot_file(data));
