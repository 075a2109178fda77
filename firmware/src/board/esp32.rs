//! ESP32-WROOM-32, the thesis's own. Strapping pins 0, 2, 5, 12 and 15 stay free. Sensors are on ADC1 (GPIO32 to 39): ADC2
//! fails beside the radio.

use control::protocol::frame::BAUD;
use control::protocol::lockstep::Target;
use control::protocol::radio::Reset;
use esp_hal::analog::adc::AdcCalLine;
use esp_hal::peripherals::{ADC1, GPIO1, GPIO3, GPIO33, GPIO34, GPIO35, LPWR, Peripherals, UART0};
use esp_hal::rtc_cntl::SocResetReason;
use esp_hal::uart::{Config, Uart, UartRx, UartTx};
use esp_hal::xtensa_lx_rt::xtensa_lx::timer::get_cycle_count;
use esp_hal::{Async, Blocking};

use super::{Analog, BridgePins, Dongle, Robot, Scheduler};

/// The radio's library, of which esp-radio does not hand everything on.
pub(crate) use esp_wifi_sys_esp32::include as driver;

/// The chip, for people.
pub const NAME: &str = "ESP32";
/// The chip, for `scram hil`.
pub const TARGET: Target = Target::Esp32;

/// ADC1 channel 6. The pin has no output driver.
pub type Wiper = GPIO34<'static>;
/// ADC1 channel 5.
pub type SecondWiper = GPIO33<'static>;
/// ADC1 channel 7. The pin has no output driver.
pub type Cell = GPIO35<'static>;
/// The line of the chip's eFuses (two points, or the reference voltage) and above 2.9 V Espressif's table: mV. This chip has no
/// other.
pub type Calibration = AdcCalLine<ADC1<'static>>;

/// The converter begins: the radio does not switch it off any more.
pub(crate) fn power_the_converter() {
    crate::analog_power::keep_for_the_converter();
}

/// A step of a conversion: it shares no bus with the radio.
pub(crate) fn convert_step<R>(step: impl FnOnce() -> R) -> R {
    step()
}

/// The bridge's enable pin.
pub(super) const ENABLE: u8 = 27;

pub(super) fn robot(p: Peripherals) -> Robot {
    let (serial_receiver, serial_sender) = serial(p.UART0, p.GPIO3, p.GPIO1).into_async().split();
    Robot {
        analog: Analog { adc: p.ADC1, wiper: p.GPIO34, second: p.GPIO33, cell: p.GPIO35 },
        bridge: BridgePins { ledc: p.LEDC, in1: p.GPIO25.into(), in2: p.GPIO26.into(), enable: p.GPIO27.into() },
        led: p.GPIO23.into(),
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
    let (serial_receiver, serial_sender) = serial(p.UART0, p.GPIO3, p.GPIO1).into_async().split();
    let scheduler = Scheduler { timer: p.TIMG0, interrupt: p.FROM_CPU_INTR0 };
    Dongle { serial_receiver, serial_sender, radio: p.WIFI, watchdog: p.RTC_TIMER, scheduler }
}

/// From the host.
pub type SerialReceiver = UartRx<'static, Async>;
/// To the host.
pub type SerialSender = UartTx<'static, Async>;

/// The line to the host for `scram hil`.
#[must_use]
pub fn lockstep_serial(p: Peripherals) -> Uart<'static, Blocking> {
    serial(p.UART0, p.GPIO3, p.GPIO1)
}

/// The line to the board's USB bridge.
fn serial(uart: UART0<'static>, rx: GPIO3<'static>, tx: GPIO1<'static>) -> Uart<'static, Blocking> {
    let uart = Uart::new(uart, Config::default().with_baudrate(BAUD)).expect("the chip has this baud rate");
    uart.with_rx(rx).with_tx(tx)
}

/// Reset reasons that only this chip has.
pub(crate) fn special_reset(reason: SocResetReason) -> Reset {
    match reason {
        SocResetReason::CpuMwdt0 => Reset::Watchdog,
        _ => Reset::Other,
    }
}

/// Resets when the supply falls below 2.43 V, ESP-IDF's default. After power-up the detector is off, and neither the
/// bootloader nor esp-hal changes that.
pub(super) fn arm_brown_out_reset() {
    LPWR::regs().brown_out().modify(|_, w| {
        // SAFETY: every value of these three bits is a threshold.
        unsafe { w.dbrown_out_thres().bits(0) };
        w.rst_ena().set_bit();
        w.ena().set_bit()
    });
}

/// The cycle counter always runs.
pub fn start_cycles() {}

/// Processor cycles, wrapping.
#[must_use]
#[inline(always)]
pub fn cycles() -> u32 {
    get_cycle_count()
}
