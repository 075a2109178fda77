//! The same for the chips' target, where there are no shared libraries: a program that keeps every function.
#![no_std]
#![no_main]

use core::hint::black_box;

use no_panic as roots;

/// Where the linker begins to look for what is needed.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    black_box(roots::make as *const ());
    black_box(roots::set_parameter as *const ());
    black_box(roots::command as *const ());
    black_box(roots::tick as *const ());
    black_box(roots::lockstep as *const ());
    black_box(roots::lockstep_reply as *const ());
    black_box(roots::dongle_request as *const ());
    black_box(roots::dongle_answer as *const ());
    black_box(roots::ear_hears as *const ());
    black_box(roots::session_receiver_and_sealer as *const ());
    black_box(roots::robot_tells as *const ());
    black_box(roots::console_downlink as *const ());
    black_box(roots::console_orders_all as *const ());
    black_box(roots::robot_notices as *const ());
    black_box(roots::console_calls as *const ());
    black_box(roots::console_is_welcomed as *const ());
    black_box(roots::console_opens as *const ());
    black_box(roots::pairing_request as *const ());
    black_box(roots::pairing_answer as *const ());
    black_box(roots::pairing_host as *const ());
    black_box(roots::radio_row as *const ());
    loop {}
}
