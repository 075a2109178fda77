//! ESP32-C3: the lock of the analogue part's internal bus ("regi2c").
//!
//! The radio's PHY and the converter's driver write to blocks on the same two-wire bus, through the same master. A transaction
//! that interrupts another one reads or writes a wrong register of the analogue part. The PHY's library brackets each of its own by
//! `phy_i2c_enter_critical` and `phy_i2c_exit_critical`, also those that others order through the ROM. Both are weak in the library
//! and do nothing; ESP-IDF overrides them by a spin lock (components/esp_phy/src/phy_override.c), and here is what takes its place:
//! a critical section, which the converter's driver takes, too. `cargo images` fails where the linked image has the weak ones.
//!
//! The control loop converts above the radio's priority. So it is the PHY's transaction that has to be whole, and interrupts wait
//! for the one transaction, some microseconds.

use core::cell::Cell;

use critical_section::{CriticalSection, Mutex, RestoreState};
use esp_hal::ram;

struct Held {
    /// How often it was entered and not left.
    depth: Cell<u32>,
    /// What the outermost one found.
    outermost: Cell<RestoreState>,
}

static HELD: Mutex<Held> = Mutex::new(Held { depth: Cell::new(0), outermost: Cell::new(RestoreState::invalid()) });

/// Uses the bus alone. Must be short: nothing interrupts it.
pub(crate) fn alone<R>(transactions: impl FnOnce() -> R) -> R {
    // What the ROM brackets by the two below is nested in this.
    critical_section::with(|_| transactions())
}

/// The PHY's library calls it before a transaction, in interrupts and tasks, while the flash may be busy. One can be nested in
/// another.
// SAFETY: the library defines it weak with this signature (void of void), and no other item has the name.
#[unsafe(no_mangle)]
#[ram]
extern "C" fn phy_i2c_enter_critical() {
    // SAFETY: the outermost is released by the exit that belongs to it, every other one at once, in the reverse order.
    let found = unsafe { critical_section::acquire() };
    // SAFETY: it was acquired.
    let held = HELD.borrow(unsafe { CriticalSection::new() });
    if held.depth.get() == 0 {
        held.outermost.set(found);
    } else {
        // SAFETY: acquired above. The outermost one still holds.
        unsafe { critical_section::release(found) };
    }
    held.depth.set(held.depth.get().saturating_add(1));
}

/// The PHY's library calls it after a transaction.
// SAFETY: as above.
#[unsafe(no_mangle)]
#[ram]
extern "C" fn phy_i2c_exit_critical() {
    // SAFETY: the enter that belongs to this has acquired it, and nobody has released it.
    let held = HELD.borrow(unsafe { CriticalSection::new() });
    match held.depth.get() {
        // Without an enter there is nothing to release.
        0 => {}
        1 => {
            held.depth.set(0);
            // SAFETY: the outermost enter's, released once.
            unsafe { critical_section::release(held.outermost.get()) };
        }
        depth => held.depth.set(depth - 1),
    }
}
