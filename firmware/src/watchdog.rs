//! The RTC's watchdog: without food it resets the whole chip, pins included, and the bridge's pull-down opens the bridge.
//!
//! It runs from the RTC's own oscillator, so that a stopped main clock cannot stop it.

use core::cell::RefCell;

use critical_section::Mutex;
use esp_hal::peripherals::RTC_TIMER;
use esp_hal::rtc_cntl::{Rtc, Rwdt, RwdtStage};
use esp_hal::time::Duration;
use shell::board;

/// A hundred ticks without one that ended: nothing that the motor can do in that time harms it.
const PERIOD: Duration = Duration::from_millis(100);
/// While the bridge is off for a reason that takes longer: starting the radio, printing the cause of a panic, or erasing
/// flash, for which the chip stands still (W25Q32JV data sheet: 45 ms a sector, at most 400 ms; mending the store takes six).
const LONG_PERIOD: Duration = Duration::from_millis(5000);

struct Armed {
    timer: Rwdt,
    long: bool,
}

static ARMED: Mutex<RefCell<Option<Armed>>> = Mutex::new(RefCell::new(None));

/// What the control loop feeds.
pub struct Watchdog(());

/// Arms it, with the long period until it is fed for the first time.
#[must_use]
pub fn arm(timer: RTC_TIMER<'static>) -> Watchdog {
    let mut timer = Rtc::new(timer).rwdt;
    timer.set_timeout(RwdtStage::Stage0, LONG_PERIOD);
    timer.enable();
    timer.feed();
    critical_section::with(|cs| ARMED.borrow_ref_mut(cs).replace(Armed { timer, long: true }));
    Watchdog(())
}

/// Makes its end come later, once: the next feed makes the period short again. Only with the bridge off.
pub(crate) fn lengthen() {
    critical_section::with(|cs| {
        if let Some(armed) = ARMED.borrow_ref_mut(cs).as_mut() {
            armed.timer.set_timeout(RwdtStage::Stage0, LONG_PERIOD);
            armed.long = true;
        }
    });
}

/// A last meal, long enough to print the cause of a panic. Only after the bridge was cut for good. A panic in the middle of
/// a feed leaves the period as it is: then the cause may be cut off.
pub(crate) fn feed_once_more() {
    critical_section::with(|cs| {
        if let Ok(mut armed) = ARMED.borrow(cs).try_borrow_mut()
            && let Some(armed) = armed.as_mut()
        {
            armed.timer.set_timeout(RwdtStage::Stage0, LONG_PERIOD);
            armed.timer.feed();
        }
    });
}

impl board::Watchdog for Watchdog {
    fn feed(&mut self) {
        critical_section::with(|cs| {
            if let Some(armed) = ARMED.borrow_ref_mut(cs).as_mut() {
                armed.timer.feed();
                if armed.long {
                    armed.timer.set_timeout(RwdtStage::Stage0, PERIOD);
                    armed.long = false;
                }
            }
        });
    }
}
