//! When nothing is known any more: the bridge is cut before anything else, then the cause is kept for the next boot and
//! printed, then the chip resets.
//!
//! A stack overflow (a write to the guard below a stack) and every exception of the processor end here, too: esp-hal's
//! handlers panic.

use esp_hal::ram;

use crate::{board, reset, watchdog};

// For the name: esp-backtrace has the panic handler.
use esp_backtrace as _;

/// Called by esp-backtrace before it prints anything.
// SAFETY: the name is esp-backtrace's, which declares it with this signature, and no other item has it.
#[unsafe(no_mangle)]
#[ram]
extern "Rust" fn custom_pre_backtrace() {
    board::cut_bridge();
    // The control loop is an interrupt, and would close the bridge again while the cause is printed.
    // SAFETY: interrupts are never enabled again, the chip resets.
    let _ = unsafe { critical_section::acquire() };
    board::cut_bridge();
    reset::mark_panic();
    watchdog::feed_once_more();
}

/// Called by esp-backtrace after it has printed the cause. Should printing hang, the watchdog resets: nobody feeds it now.
// SAFETY: the name is esp-backtrace's, which declares it with this signature, and no other item has it.
#[unsafe(no_mangle)]
extern "Rust" fn custom_halt() -> ! {
    esp_hal::system::software_reset()
}
