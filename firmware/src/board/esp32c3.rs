//! ESP32-C3 (ESP32-C3-DevKitM-1 and the like). Strapping pins 2, 8 and 9 stay free.

use control::protocol::lockstep::Target;
use control::protocol::radio::Reset;
use esp_hal::analog::adc::AdcCalCurve;
use esp_hal::peripherals::{ADC1, GPIO0, GPIO1, GPIO3, LPWR, Peripherals};
use esp_hal::rtc_cntl::SocResetReason;
use esp_hal::usb::usb_serial_jtag::{UsbSerialJtag, UsbSerialJtagRx, UsbSerialJtagTx};
use esp_hal::{Async, Blocking};

use super::{Analog, BridgePins, Dongle, Robot, Scheduler};

/// The radio's library, of which esp-radio does not hand everything on.
pub(crate) use esp_wifi_sys_esp32c3::include as driver;

/// The chip, for people.
pub const NAME: &str = "ESP32-C3";
/// The chip, for `scram hil`.
pub const TARGET: Target = Target::Esp32c3;

/// ADC1 channel 0.
pub type Wiper = GPIO0<'static>;
/// ADC1 channel 3.
pub type SecondWiper = GPIO3<'static>;
/// ADC1 channel 1.
pub type Cell = GPIO1<'static>;
/// One point and the polynomial of the data sheet, from the chip's eFuses: mV.
pub type Calibration = AdcCalCurve<ADC1<'static>>;

/// The converter begins: nothing to do, nobody else has a say in its power.
pub(crate) fn power_the_converter() {}

/// A step of a conversion, which is on the bus that the radio uses, too.
pub(crate) fn convert_step<R>(step: impl FnOnce() -> R) -> R {
    crate::analog_bus::alone(step)
}

/// The bridge's enable pin. Not one of GPIO4 to GPIO7: those are JTAG's after a reset, GPIO6 with a pull-up of its own.
pub(super) const ENABLE: u8 = 10;

pub(super) fn robot(p: Peripherals) -> Robot {
    // The chip's own USB, GPIO18 and GPIO19.
    let (serial_receiver, serial_sender) = UsbSerialJtag::new(p.USB_DEVICE).into_async().split();
    Robot {
        analog: Analog { adc: p.ADC1, wiper: p.GPIO0, second: p.GPIO3, cell: p.GPIO1 },
        bridge: BridgePins { ledc: p.LEDC, in1: p.GPIO4.into(), in2: p.GPIO5.into(), enable: p.GPIO10.into() },
        led: p.GPIO7.into(),
        serial_receiver,
        serial_sender,
        radio: p.WIFI,
        flash: p.FLASH,
        watchdog: p.RTC_TIMER,
        scheduler: Scheduler { timer: p.TIMG0, interrupt: p.FROM_CPU_INTR0 },
        loop_interrupt: p.FROM_CPU_INTR2,
        loop_timer: p.TIMG1,
    }
}

pub(super) fn dongle(p: Peripherals) -> Dongle {
    // The chip's own USB, GPIO18 and GPIO19.
    let (serial_receiver, serial_sender) = UsbSerialJtag::new(p.USB_DEVICE).into_async().split();
    let scheduler = Scheduler { timer: p.TIMG0, interrupt: p.FROM_CPU_INTR0 };
    Dongle { serial_receiver, serial_sender, radio: p.WIFI, watchdog: p.RTC_TIMER, scheduler }
}

/// From the host.
pub type SerialReceiver = UsbSerialJtagRx<'static, Async>;
/// To the host.
pub type SerialSender = UsbSerialJtagTx<'static, Async>;

/// The line to the host for `scram hil`.
#[must_use]
pub fn lockstep_serial(p: Peripherals) -> UsbSerialJtag<'static, Blocking> {
    UsbSerialJtag::new(p.USB_DEVICE)
}

/// Reset reasons that only this chip has.
pub(crate) fn special_reset(reason: SocResetReason) -> Reset {
    match reason {
        SocResetReason::SysSuperWdt => Reset::Watchdog,
        SocResetReason::CoreUsbUart | SocResetReason::CoreUsbJtag => Reset::External,
        _ => Reset::Other,
    }
}

/// Resets when the supply falls below the detector's threshold. After power-up the detector is on, but resets nothing, and
/// neither the bootloader nor esp-hal changes that. A system reset, for a reset of the whole chip would look like a
/// power-up.
pub(super) fn arm_brown_out_reset() {
    LPWR::regs().brown_out().modify(|_, w| {
        w.brown_out_rst_sel().clear_bit();
        w.brown_out_rst_ena().set_bit();
        w.brown_out_ena().set_bit()
    });
}

/// Starts the performance counter on processor cycles (technical reference manual, "Performance Counter CSRs").
pub fn start_cycles() {
    // SAFETY: these registers do nothing but count.
    unsafe {
        core::arch::asm!("csrw 0x7e0, {one}", "csrw 0x7e1, {one}", one = in(reg) 1);
    }
}

/// Processor cycles, wrapping.
#[must_use]
#[inline(always)]
pub fn cycles() -> u32 {
    let count;
    // SAFETY: reading the counter (mpccr) has no effect.
    unsafe { core::arch::asm!("csrr {count}, 0x7e2", count = out(reg) count) };
    count
}
