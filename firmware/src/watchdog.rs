//! The RTC's watchdog: without food it resets the whole chip, pins included, and the bridge's pull-down opens the bridge.
//!
//! It runs from the RTC's own oscillator, so that a stopped main clock cannot stop it.

use core::cell::RefCell;

use critical_section::Mutex;
use esp_hal::peripherals::RTC_TIMER;
use esp_hal::rtc_cntl::{Rtc, Rwdt, RwdtStage};
use esp_hal::time::Duration;
use shell::board::{self, WatchdogTimeout};

struct Armed {
    timer: Rwdt,
    patience: WatchdogTimeout,
}

impl Armed {
    fn expect(&mut self, patience: WatchdogTimeout) {
        if self.patience != patience {
            self.patience = patience;
            // First: it may have counted beyond a shorter end.
            self.timer.feed();
            self.timer.set_timeout(RwdtStage::Stage0, Duration::from_micros(patience.us()));
        }
    }
}

static ARMED: Mutex<RefCell<Option<Armed>>> = Mutex::new(RefCell::new(None));

/// What one task feeds.
pub struct Watchdog(());

/// Arms it, with all its patience.
#[must_use]
pub fn arm(timer: RTC_TIMER<'static>) -> Watchdog {
    let (mut timer, patience) = (Rtc::new(timer).rwdt, WatchdogTimeout::Starting);
    timer.set_timeout(RwdtStage::Stage0, Duration::from_micros(patience.us()));
    timer.enable();
    timer.feed();
    critical_section::with(|cs| ARMED.borrow_ref_mut(cs).replace(Armed { timer, patience }));
    Watchdog(())
}

/// A last meal, long enough to print the cause of a panic. Only after the bridge was cut for good. A panic in the middle of
/// a feed leaves things as they are: then the cause may be cut off.
pub(crate) fn feed_once_more() {
    critical_section::with(|cs| {
        if let Ok(mut armed) = ARMED.borrow(cs).try_borrow_mut()
            && let Some(armed) = armed.as_mut()
        {
            armed.expect(WatchdogTimeout::Starting);
            armed.timer.feed();
        }
    });
}

impl board::Watchdog for Watchdog {
    fn expect(&mut self, patience: WatchdogTimeout) {
        critical_section::with(|cs| {
            if let Some(armed) = ARMED.borrow_ref_mut(cs).as_mut() {
                armed.expect(patience);
            }
        });
    }

    fn feed(&mut self) {
        critical_section::with(|cs| {
            if let Some(armed) = ARMED.borrow_ref_mut(cs).as_mut() {
                armed.timer.feed();
            }
        });
    }
}
