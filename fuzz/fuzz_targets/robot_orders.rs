//! [`fuzz_cases::robot_orders`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz_cases::robot_orders(data));
