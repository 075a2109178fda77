//! The H-bridge on the LEDC peripheral: slow decay, that is PWM on one input with the other low, `enable` high.
//!
//! A duty is latched by the peripheral at the end of the running PWM period, so that every pulse is whole. When the
//! direction changes, the two inputs may latch one period (50 µs at 20 kHz) apart: for so long the motor is braked or
//! driven the old way. The bridge's own logic keeps a half-bridge from shorting the supply.

use control::Actuation;
use esp_hal::gpio::{DriveMode, Level, Output, OutputConfig};
use esp_hal::ledc::channel::{self, Channel, ChannelHW, ChannelIFace};
use esp_hal::ledc::timer::{self, LSClockSource, Timer, TimerIFace};
use esp_hal::ledc::{LSGlobalClkSource, Ledc, LowSpeed};
use esp_hal::time::Rate;
use shell::board::Bridge;
use shell::image::Pwm;
use shell::pwm::{Wires, slow_decay};
use static_cell::StaticCell;

use crate::board;

/// The bridge's three wires.
pub struct PwmBridge {
    enable: Output<'static>,
    in1: Channel<'static, LowSpeed>,
    in2: Channel<'static, LowSpeed>,
    /// Duty 1.
    steps: u16,
}

/// The peripheral cannot make a PWM. The build refuses robot files that ask for one.
#[derive(Debug, thiserror::Error)]
#[error("the chip has no PWM of {hz} Hz with {bits} bits: check [driver] in the robot file")]
pub struct NoSuchPwm {
    hz: u32,
    bits: u8,
}

impl PwmBridge {
    /// Off.
    ///
    /// # Errors
    /// The peripheral cannot make this PWM.
    pub fn new(pins: board::BridgePins, pwm: &Pwm) -> Result<Self, NoSuchPwm> {
        Self::set_up(pins, pwm).ok_or(NoSuchPwm { hz: pwm.hz, bits: pwm.bits })
    }

    fn set_up(pins: board::BridgePins, pwm: &Pwm) -> Option<Self> {
        static TIMER: StaticCell<Timer<'static, LowSpeed>> = StaticCell::new();

        let enable = Output::new(pins.enable, Level::Low, OutputConfig::default());
        let mut ledc = Ledc::new(pins.ledc);
        ledc.set_global_slow_clock(LSGlobalClkSource::APBClk);
        let mut timer = ledc.timer(timer::Number::Timer0);
        timer
            .configure(timer::config::Config {
                duty: u32::from(pwm.bits).try_into().ok()?,
                clock_source: LSClockSource::APBClk,
                frequency: Rate::from_hz(pwm.hz),
            })
            .ok()?;
        let timer = TIMER.init(timer);
        let config = channel::config::Config { timer: &*timer, duty_pct: 0, drive_mode: DriveMode::PushPull };
        let mut in1 = ledc.channel(channel::Number::Channel0, pins.in1);
        let mut in2 = ledc.channel(channel::Number::Channel1, pins.in2);
        in1.configure(config).ok()?;
        in2.configure(config).ok()?;
        Some(Self { enable, in1, in2, steps: 1 << pwm.bits })
    }
}

impl Bridge for PwmBridge {
    fn apply(&mut self, actuation: Actuation) {
        let Wires { enable, in1, in2 } = slow_decay(actuation, self.steps);
        if !enable {
            self.enable.set_low();
        }
        // First the input that becomes low.
        if in1 == 0 {
            self.in1.set_duty_hw(0);
            self.in2.set_duty_hw(in2.into());
        } else {
            self.in2.set_duty_hw(0);
            self.in1.set_duty_hw(in1.into());
        }
        if enable {
            self.enable.set_high();
        }
    }
}
