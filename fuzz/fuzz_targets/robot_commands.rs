//! [`fuzz_cases::robot_commands`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_cases::robot_commands(data));
