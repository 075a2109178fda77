//! ESP32: who needs the power of the converters ("SAR").
//!
//! The converter's driver switches it on once. The radio's PHY switches it on while it measures its own transmitter with the second
//! converter, and off afterwards, by `set_xpd_sar`: weak in its library, where it clears the bits that the driver has set. ESP-IDF
//! overrides it by a count of users (components/esp_phy/src/phy_override.c, sar_periph_ctrl.c), and here is what takes its place.

use core::cell::Cell;

use critical_section::{CriticalSection, Mutex};
use esp_hal::peripherals::SENS;
use esp_hal::ram;

struct Users {
    converter: Cell<bool>,
    radio: Cell<bool>,
}

static USERS: Mutex<Users> = Mutex::new(Users { converter: Cell::new(false), radio: Cell::new(false) });

/// Powered by software (technical reference manual, `SENS_FORCE_XPD_SAR`).
const ON: u8 = 0b11;
/// Left to the state machine, which nobody runs: off.
const OFF: u8 = 0b00;

impl Users {
    #[ram]
    fn apply(&self, _: CriticalSection<'_>) {
        let power = if self.converter.get() || self.radio.get() { ON } else { OFF };
        // SAFETY: both are values of this field of two bits.
        SENS::regs().sar_meas_wait2().modify(|_, w| unsafe { w.force_xpd_sar().bits(power) });
    }
}

/// The converter needs the power from now on, for good.
pub(crate) fn keep_for_the_converter() {
    critical_section::with(|cs| {
        let users = USERS.borrow(cs);
        users.converter.set(true);
        users.apply(cs);
    });
}

/// The PHY's library says whether it needs the power.
// SAFETY: the library defines it weak, void of a C `bool` of which it reads the lowest byte, and no other item has the name.
#[unsafe(no_mangle)]
#[ram]
extern "C" fn set_xpd_sar(needed: u8) {
    critical_section::with(|cs| {
        let users = USERS.borrow(cs);
        users.radio.set(needed != 0);
        users.apply(cs);
    });
}
