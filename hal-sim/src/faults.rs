//! What can break, and when.

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
    /// Every fault, those with a parameter at a value that any LiPo robot must refuse to drive on.
    pub const ALL: [Self; 9] = [
        Self::SensorOpen,
        Self::SensorShortLow,
        Self::SensorShortHigh,
        Self::SensorFrozen,
        Self::Stalled,
        Self::MotorReversed,
        Self::MotorOpen,
        Self::BatteryLow { open_circuit_v: 2.9 },
        Self::RailLow { rail_v: 2.0 },
    ];

    /// The name that people type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SensorOpen => "sensor-open",
            Self::SensorShortLow => "sensor-short-low",
            Self::SensorShortHigh => "sensor-short-high",
            Self::SensorFrozen => "sensor-frozen",
            Self::Stalled => "stalled",
            Self::MotorReversed => "motor-reversed",
            Self::MotorOpen => "motor-open",
            Self::BatteryLow { .. } => "battery-low",
            Self::RailLow { .. } => "rail-low",
        }
    }

    /// The fault of a name, as in [`Fault::ALL`].
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.name() == name)
    }
}

/// What has happened to the angle sensor's line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    Open,
    Low,
    High,
    Frozen,
}

/// The faults in force, and those still to come.
#[derive(Clone, Debug, PartialEq, Default)]
pub(crate) struct Faults {
    pub line: Option<Line>,
    pub stalled: bool,
    pub reversed: bool,
    pub motor_open: bool,
    pub open_circuit_v: Option<f64>,
    pub rail_v: Option<f64>,
    /// Start time (s) and fault.
    coming: Vec<(f64, Fault)>,
}

impl Faults {
    /// From now on.
    pub fn set(&mut self, fault: Fault) {
        match fault {
            Fault::SensorOpen => self.line = Some(Line::Open),
            Fault::SensorShortLow => self.line = Some(Line::Low),
            Fault::SensorShortHigh => self.line = Some(Line::High),
            Fault::SensorFrozen => self.line = Some(Line::Frozen),
            Fault::Stalled => self.stalled = true,
            Fault::MotorReversed => self.reversed = true,
            Fault::MotorOpen => self.motor_open = true,
            Fault::BatteryLow { open_circuit_v } => self.open_circuit_v = Some(open_circuit_v),
            Fault::RailLow { rail_v } => self.rail_v = Some(rail_v),
        }
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
