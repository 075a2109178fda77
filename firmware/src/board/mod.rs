//! One file a board: its pins and peripherals, and whatever else differs between the chips.

#[cfg(all(feature = "esp32", feature = "esp32c3"))]
compile_error!("one chip at a time: for the ESP32 add --no-default-features");
#[cfg(not(any(feature = "esp32", feature = "esp32c3")))]
compile_error!("name the chip: --features esp32 or --features esp32c3");

#[cfg(feature = "esp32")]
#[path = "esp32.rs"]
mod chip;
#[cfg(feature = "esp32c3")]
#[path = "esp32c3.rs"]
mod chip;

use esp_hal::gpio::{AnyPin, Pin};
use esp_hal::peripherals::{
    ADC1, FLASH, FROM_CPU_INTR0, FROM_CPU_INTR2, LEDC, Peripherals, RTC_TIMER, TIMG0, TIMG1, WIFI,
};

pub use chip::{
    Calibration, Cell, NAME, SecondWiper, SerialReceiver, SerialSender, TARGET, Wiper, cycles, lockstep_serial,
    start_cycles,
};
pub(crate) use chip::{convert_step, driver, power_the_converter, special_reset};

/// The pins of the analogue inputs, and their converter.
pub struct Analog {
    /// The converter that works beside the radio.
    pub adc: ADC1<'static>,
    /// The potentiometer's wiper.
    pub wiper: Wiper,
    /// The second potentiometer's wiper.
    pub second: SecondWiper,
    /// The battery's divider.
    pub cell: Cell,
}

/// The pins of the H-bridge, and its PWM.
pub struct BridgePins {
    /// The PWM peripheral.
    pub ledc: LEDC<'static>,
    /// PWM here turns the shaft counter-clockwise.
    pub in1: AnyPin<'static>,
    /// PWM here turns it clockwise.
    pub in2: AnyPin<'static>,
    /// High lets the bridge drive; held low by a resistor while no program runs.
    pub enable: AnyPin<'static>,
}

/// What esp-rtos runs on.
pub struct Scheduler {
    /// Its timer.
    pub timer: TIMG0<'static>,
    /// Its interrupt.
    pub interrupt: FROM_CPU_INTR0<'static>,
}

/// What the robot's program uses of a board.
pub struct Robot {
    /// The sensors.
    pub analog: Analog,
    /// The motor.
    pub bridge: BridgePins,
    /// The status LED's pin.
    pub led: AnyPin<'static>,
    /// The radio.
    pub radio: WIFI<'static>,
    /// To a computer, receiving half.
    pub serial_receiver: SerialReceiver,
    /// To a computer, sending half. The console's text is printed on the same line.
    pub serial_sender: SerialSender,
    /// The flash, with the parameters and the pairing.
    pub flash: FLASH<'static>,
    /// The watchdog's timer.
    pub watchdog: RTC_TIMER<'static>,
    /// For the async tasks.
    pub scheduler: Scheduler,
    /// For the control loop alone.
    pub loop_interrupt: FROM_CPU_INTR2<'static>,
    /// For the control loop alone.
    pub loop_timer: TIMG1<'static>,
}

impl Robot {
    /// Hands the chip's peripherals out, and arms the brown-out detector.
    #[must_use]
    pub fn new(peripherals: Peripherals) -> Self {
        chip::arm_brown_out_reset();
        let robot = chip::robot(peripherals);
        // `cut_bridge` knows the pin by its number.
        assert_eq!(robot.bridge.enable.number(), chip::ENABLE, "board file: ENABLE is not the bridge's pin");
        robot
    }
}

/// What the dongle's program uses of a board.
pub struct Dongle {
    /// To the host, receiving half.
    pub serial_receiver: SerialReceiver,
    /// To the host, sending half.
    pub serial_sender: SerialSender,
    /// The radio.
    pub radio: WIFI<'static>,
    /// The watchdog's timer.
    pub watchdog: RTC_TIMER<'static>,
    /// For the async tasks.
    pub scheduler: Scheduler,
}

impl Dongle {
    /// Hands the chip's peripherals out.
    #[must_use]
    pub fn new(peripherals: Peripherals) -> Self {
        chip::dongle(peripherals)
    }
}

/// Opens the bridge by one write to the pin's register: whatever state the rest of the program is in.
#[inline(always)]
pub fn cut_bridge() {
    esp_hal::peripherals::GPIO::regs().out_w1tc().write(|w| {
        // SAFETY: any bits may be written; each one set makes its pin low, and this is the bridge's.
        unsafe { w.bits(1 << chip::ENABLE) }
    });
}

/// Whether the bridge is open.
#[must_use]
pub fn bridge_is_off() -> bool {
    esp_hal::peripherals::GPIO::regs().out().read().bits() & (1 << chip::ENABLE) == 0
}
