//! What must be in order before the bridge is switched on, as far as a robot at rest can tell.
//!
//! At rest every reading of the wiper may be right, an end of its range included: the wiper may lie on insulation. But a
//! converter that works never repeats a code for long, and readings that jump about one place come from a bad contact.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::parameters::{Parameters, table};
use crate::sample::{AdcCode, Sample};
use crate::sensor::Reading;

/// Why the bridge is not switched on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Unready {
    /// The check after the start has not ended: it takes [`BLOCK`] control periods.
    Checking,
    /// The angle sensor's code does not change.
    SensorStill,
    /// The angle sensor's code jumps by this from reading to reading, counts.
    SensorNoisy(f32),
    /// The cell is below the limit under which it must not be driven on: its voltage.
    SupplyLow(f32),
    /// The cell is above what a charged one has: its voltage.
    SupplyHigh(f32),
    /// A parameter, by its index in [`table::TABLE`], is a weaker failsafe than the factory's.
    WeakFailsafe(u16),
    /// The control loop misses periods: their time that has not been made up for, s.
    LoopStarved(f32),
}

impl core::fmt::Display for Unready {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Checking => f.write_str("it is still checking itself: try again in a second"),
            Self::SensorStill => f.write_str(
                "its angle sensor repeats one code at rest, without the noise of a converter that works: check the converter and its \
                 connection",
            ),
            Self::SensorNoisy(counts) => write!(
                f,
                "its angle sensor jumps by {counts:.0} counts from reading to reading at rest: check the wiper's contact and plug"
            ),
            Self::SupplyLow(volt) => write!(f, "its cell is at {volt:.2} V, too low to drive: charge it"),
            Self::SupplyHigh(volt) => {
                write!(f, "its cell is at {volt:.2} V, more than one cell has: check the battery and its divider")
            }
            Self::WeakFailsafe(index) => {
                let name = table::TABLE.get(usize::from(*index)).map_or("a parameter", |entry| entry.name);
                write!(f, "its {name} is a weaker failsafe than the factory's: set it back, or take the factory's set")
            }
            Self::LoopStarved(missed) => {
                write!(f, "its control loop has just missed {:.0} ms of its periods: try again in a second, and restart the robot if it stays", missed * 1e3)
            }
        }
    }
}

/// Readings that are judged together.
pub const BLOCK: u16 = 64;
/// Mean change from reading to reading beyond which the wiper may as well lie on insulation, counts: readings anywhere in the
/// converter's 4096 differ by a third of them in the mean, by a quarter after the median of three.
const INSULATED: f32 = 512.0;

/// Watches the inputs while the bridge is off.
#[derive(Clone, Copy, Debug)]
pub struct SelfCheck {
    finding: Option<Unready>,
    count: u16,
    last_code: u16,
    /// Sum of the changes of the wiper's code, counts.
    changes: u32,
    /// Sum of the battery's codes.
    battery: u32,
    /// A reading came from the blind arc, where none can be judged.
    was_blind: bool,
}

impl SelfCheck {
    /// A robot that has been at rest and in order.
    #[must_use]
    pub fn passed() -> Self {
        Self { finding: None, count: 0, last_code: 0, changes: 0, battery: 0, was_blind: false }
    }

    /// A robot that has just started: not ready until it has been checked.
    #[must_use]
    pub fn pending() -> Self {
        Self { finding: Some(Unready::Checking), ..Self::passed() }
    }

    /// What the last whole block found.
    #[must_use]
    pub fn finding(&self) -> Option<Unready> {
        self.finding
    }

    /// Takes in a sample. While the bridge drives, nothing is at rest: what was begun is forgotten.
    pub fn update(&mut self, p: &Parameters, sample: &Sample, reading: Reading, is_driving: bool) {
        if is_driving {
            self.count = 0;
            return;
        }
        if self.count == 0 {
            *self = Self { finding: self.finding, last_code: sample.angle.0, ..Self::passed() };
        }
        self.count = self.count.saturating_add(1);
        self.changes = self.changes.saturating_add(u32::from(sample.angle.0.abs_diff(self.last_code)));
        self.last_code = sample.angle.0;
        self.battery = self.battery.saturating_add(u32::from(sample.battery.0));
        self.was_blind |= match reading {
            Reading::Angle(angle) => p.sensor.is_blind(angle),
            Reading::LowEnd | Reading::HighEnd => true,
        };
        if self.count >= BLOCK {
            self.finding = self.evaluate(p);
            self.count = 0;
        }
    }

    fn evaluate(&self, p: &Parameters) -> Option<Unready> {
        let limits = &p.supervisor;
        if let Some(volt) = p.battery.volt(self.mean_battery()) {
            if volt < limits.supply_low.limit {
                return Some(Unready::SupplyLow(volt));
            }
            if volt > limits.supply_high {
                return Some(Unready::SupplyHigh(volt));
            }
        }
        let change = whole(self.changes) / f32::from(BLOCK);
        if self.was_blind {
            None
        } else if change < limits.rest_least {
            Some(Unready::SensorStill)
        } else if change > limits.rest_most && change < INSULATED {
            Some(Unready::SensorNoisy(change))
        } else {
            None
        }
    }

    fn mean_battery(&self) -> AdcCode {
        AdcCode(u16::try_from(self.battery / u32::from(BLOCK)).unwrap_or(u16::MAX))
    }
}

#[expect(clippy::cast_precision_loss, reason = "a sum of changes is compared with a limit of two digits")]
fn whole(sum: u32) -> f32 {
    sum as f32
}
