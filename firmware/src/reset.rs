//! Why the processor started, and how it is made to start again.

use control::protocol::radio::Reset;
use esp_hal::ram;
use esp_hal::rtc_cntl::SocResetReason;
use portable_atomic::{AtomicU32, Ordering};
use shell::board::Restart;

use crate::board;

/// Keeps its value through every reset but that of a power-up.
#[ram(unstable(rtc_fast, persistent))]
static MARK: AtomicU32 = AtomicU32::new(0);

/// No numbers that memory holds by chance.
const PANICKED: u32 = 0xB41D_6E0F;
const RADIO: u32 = 0x5EAD_0A17;

/// The reset to come is a panic's.
#[ram]
pub fn mark_panic() {
    MARK.store(PANICKED, Ordering::Relaxed);
}

/// Why the processor started. Clears the mark: call it once.
#[must_use]
pub fn reason() -> Reset {
    match MARK.swap(0, Ordering::Relaxed) {
        // A panic may end by the watchdog, when printing its cause takes too long.
        PANICKED => Reset::Panic,
        RADIO => Reset::Radio,
        _ => esp_hal::system::reset_reason().map_or(Reset::Other, plain),
    }
}

/// A reset button on the chip's enable pin looks like a power-up to both chips, and is told as one.
fn plain(reason: SocResetReason) -> Reset {
    match reason {
        SocResetReason::ChipPowerOn => Reset::PowerOn,
        SocResetReason::CoreSw | SocResetReason::Cpu0Sw => Reset::Software,
        SocResetReason::CoreMwdt0
        | SocResetReason::CoreMwdt1
        | SocResetReason::CoreRtcWdt
        | SocResetReason::Cpu0RtcWdt
        | SocResetReason::SysRtcWdt => Reset::Watchdog,
        SocResetReason::SysBrownOut => Reset::BrownOut,
        other => board::special_reset(other),
    }
}

/// A reset that firmware asks for.
pub struct SoftwareReset;

impl Restart for SoftwareReset {
    fn restart(&mut self, why: Reset) -> ! {
        board::cut_bridge();
        if why == Reset::Radio {
            MARK.store(RADIO, Ordering::Relaxed);
        }
        // The control loop is an interrupt, and could close the bridge again.
        // SAFETY: interrupts are never enabled again, the chip resets.
        let _ = unsafe { critical_section::acquire() };
        board::cut_bridge();
        esp_hal::system::software_reset()
    }
}
