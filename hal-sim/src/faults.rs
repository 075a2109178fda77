//! What can break, and when.

use crate::random::Stream;

/// A fault of the robot's hardware.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The wiper's lead is broken: the input floats as it does in the gap. A digital sensor reads all ones.
    SensorOpen,
    /// The wiper is shorted to ground.
    SensorShortLow,
    /// The wiper is shorted to the element's supply.
    SensorShortHigh,
    /// The converter repeats its last code.
    SensorFrozen,
    /// The wiper's contact is bad: it bounces for longer than the conversions of a tick, so that all of them read it wrong
    /// together.
    SensorNoisy {
        /// Standard deviation, share of the scale.
        share: f64,
    },
    /// The wiper's reading drifts: its line leaks, or its fastening slips.
    SensorDrifting {
        /// Share of the scale in a second.
        share_per_s: f64,
    },
    /// The element's supply is too high: every voltage of the wiper is greater by this factor, and the upper ones are above
    /// the converter's range.
    AdcSaturated {
        /// Supply against what it should be.
        factor: f64,
    },
    /// Something happens to the second sensor's line. Nothing where there is none.
    SecondSensor(Line),
    /// The shaft is blocked where it stands.
    Stalled,
    /// The motor's leads are swapped: every correction makes it worse (runaway).
    MotorReversed,
    /// A motor lead is broken: no current flows.
    MotorOpen,
    /// The cell is empty: its open-circuit voltage, V.
    BatteryLow {
        /// Open-circuit voltage, V.
        open_circuit_v: f64,
    },
    /// The bridge's rail has collapsed to this no-load voltage, V.
    RailLow {
        /// No-load voltage, V.
        rail_v: f64,
    },
}

impl Fault {
    /// Every fault of a robot with one sensor. Supplies have values that any LiPo robot must refuse to drive on; a bad contact is noisy by three times
    /// what the reading of a healthy sensor is wrong by, a drift is a tenth of the scale in a second (estimates); the
    /// element of a saturated converter is fed with 5 V instead of 3.3 V.
    pub const ALL: [Self; 12] = [
        Self::SensorOpen,
        Self::SensorShortLow,
        Self::SensorShortHigh,
        Self::SensorFrozen,
        Self::SensorNoisy { share: 0.03 },
        Self::SensorDrifting { share_per_s: 0.1 },
        Self::AdcSaturated { factor: 5.0 / 3.3 },
        Self::Stalled,
        Self::MotorReversed,
        Self::MotorOpen,
        Self::BatteryLow { open_circuit_v: 2.9 },
        Self::RailLow { rail_v: 2.0 },
    ];

    /// What can happen to the second sensor, as severe as to the first one.
    pub const SECOND: [Self; 7] = [
        Self::SecondSensor(Line::Open),
        Self::SecondSensor(Line::Low),
        Self::SecondSensor(Line::High),
        Self::SecondSensor(Line::Frozen),
        Self::SecondSensor(Line::Noisy(0.03)),
        Self::SecondSensor(Line::Drifting(0.1)),
        Self::SecondSensor(Line::Scaled(5.0 / 3.3)),
    ];

    /// The name that people type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SensorOpen => "sensor-open",
            Self::SensorShortLow => "sensor-short-low",
            Self::SensorShortHigh => "sensor-short-high",
            Self::SensorFrozen => "sensor-frozen",
            Self::SensorNoisy { .. } => "sensor-noisy",
            Self::SensorDrifting { .. } => "sensor-drifting",
            Self::AdcSaturated { .. } => "adc-saturated",
            Self::SecondSensor(Line::Open) => "second-sensor-open",
            Self::SecondSensor(Line::Low) => "second-sensor-short-low",
            Self::SecondSensor(Line::High) => "second-sensor-short-high",
            Self::SecondSensor(Line::Frozen) => "second-sensor-frozen",
            Self::SecondSensor(Line::Noisy(_)) => "second-sensor-noisy",
            Self::SecondSensor(Line::Drifting(_)) => "second-sensor-drifting",
            Self::SecondSensor(Line::Scaled(_)) => "second-adc-saturated",
            Self::Stalled => "stalled",
            Self::MotorReversed => "motor-reversed",
            Self::MotorOpen => "motor-open",
            Self::BatteryLow { .. } => "battery-low",
            Self::RailLow { .. } => "rail-low",
        }
    }

    /// The fault of a name, as in [`Fault::ALL`] and [`Fault::SECOND`].
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().chain(Self::SECOND).find(|fault| fault.name() == name)
    }
}

/// What has happened to an angle sensor's line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// The wiper's lead is broken.
    Open,
    /// Shorted to ground.
    Low,
    /// Shorted to the element's supply.
    High,
    /// The converter repeats its last code.
    Frozen,
    /// Standard deviation, share of the scale.
    Noisy(f64),
    /// Share of the scale in a second.
    Drifting(f64),
    /// Voltages against what they should be.
    Scaled(f64),
}

/// The fault of one sensor's line.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct LineFault {
    pub line: Option<Line>,
    /// How far the reading has drifted, share of the scale.
    pub drifted: f64,
}

impl LineFault {
    fn set(&mut self, line: Line) {
        *self = Self { line: Some(line), drifted: 0.0 };
    }

    fn advance(&mut self, seconds: f64) {
        if let Some(Line::Drifting(share_per_s)) = self.line {
            self.drifted += share_per_s * seconds;
        }
    }

    /// The input floats.
    pub fn is_cut(&self) -> bool {
        self.line == Some(Line::Open)
    }

    /// What the wiper's share of the scale is multiplied with, and what is added to it.
    pub fn disturbance(&self, bad_contact: &mut Stream) -> (f64, f64) {
        match self.line {
            Some(Line::Noisy(share)) => (1.0, share * bad_contact.normal()),
            Some(Line::Drifting(_)) => (1.0, self.drifted),
            Some(Line::Scaled(factor)) => (factor, 0.0),
            _ => (1.0, 0.0),
        }
    }
}

/// The faults in force, and those still to come.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct Faults {
    /// Of the first sensor and of the second one.
    pub lines: [LineFault; 2],
    pub stalled: bool,
    pub reversed: bool,
    pub motor_open: bool,
    pub open_circuit_v: Option<f64>,
    pub rail_v: Option<f64>,
    /// Start time (s) and fault.
    coming: Vec<(f64, Fault)>,
}

impl Faults {
    /// Begins a fault now.
    pub fn set(&mut self, fault: Fault) {
        let [first, second] = &mut self.lines;
        match fault {
            Fault::SensorOpen => first.set(Line::Open),
            Fault::SensorShortLow => first.set(Line::Low),
            Fault::SensorShortHigh => first.set(Line::High),
            Fault::SensorFrozen => first.set(Line::Frozen),
            Fault::SensorNoisy { share } => first.set(Line::Noisy(share)),
            Fault::SensorDrifting { share_per_s } => first.set(Line::Drifting(share_per_s)),
            Fault::AdcSaturated { factor } => first.set(Line::Scaled(factor)),
            Fault::SecondSensor(line) => second.set(line),
            Fault::Stalled => self.stalled = true,
            Fault::MotorReversed => self.reversed = true,
            Fault::MotorOpen => self.motor_open = true,
            Fault::BatteryLow { open_circuit_v } => self.open_circuit_v = Some(open_circuit_v),
            Fault::RailLow { rail_v } => self.rail_v = Some(rail_v),
        }
    }

    /// Advances time by `seconds` and begins what is due.
    pub fn advance(&mut self, seconds: f64) {
        self.lines.iter_mut().for_each(|line| line.advance(seconds));
    }

    /// From a time (s) on.
    pub fn schedule(&mut self, fault: Fault, at_s: f64) {
        self.coming.push((at_s, fault));
    }

    /// Puts in force what is due; true when something was.
    pub fn due(&mut self, now_s: f64) -> bool {
        if self.coming.is_empty() {
            return false;
        }
        let mut any = false;
        let coming = std::mem::take(&mut self.coming);
        for (at_s, fault) in coming {
            if at_s <= now_s {
                self.set(fault);
                any = true;
            } else {
                self.coming.push((at_s, fault));
            }
        }
        any
    }
}
