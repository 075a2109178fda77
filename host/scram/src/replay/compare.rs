//! Recorded against replayed, quantity by quantity.

use control::protocol::radio::PackedTick;
use control::{AdcCode, Telemetry};
use serde::Serialize;

use common::wrap;
use recording::FullRow;

/// How one quantity compares over the run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// Name of the quantity.
    pub name: &'static str,
    /// Of values and differences; empty for words.
    pub unit: &'static str,
    /// What the robot does, not what the controller believes.
    pub is_decision: bool,
    /// Ticks in which both have it.
    pub compared: u64,
    /// Of them, those that differ.
    pub different: u64,
    /// Their share, 0 … 1.
    pub share: f64,
    /// The first difference.
    pub first: Option<First>,
    /// Of replayed less recorded over all compared ticks; null for words.
    pub rms: Option<f64>,
    /// The largest; null for words and where nothing differs.
    pub worst: Option<Worst>,
}

/// Where two runs part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct First {
    /// Time in the recording, s.
    pub t_s: f64,
    /// Value in the recording.
    pub recorded: Shown,
    /// Value of the replay.
    pub replayed: Shown,
}

/// Value of a quantity, as printed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Shown {
    /// In the quantity's unit.
    Number(f64),
    /// A state, a fault, yes or no.
    Word(String),
}

impl std::fmt::Display for Shown {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(value) => write!(f, "{value:.5}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

/// The largest difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Time in the recording, s.
    pub t_s: f64,
    /// Replayed less recorded.
    pub difference: f64,
}

#[derive(Default)]
struct Tally {
    compared: u64,
    different: u64,
    first: Option<First>,
    squares: f64,
    worst: Option<Worst>,
}

impl Tally {
    /// Two numbers that are the same where they differ by `step` or less.
    fn number(&mut self, t_s: f64, recorded: f64, replayed: f64, difference: f64, step: f64) {
        self.compared += 1;
        self.squares += difference * difference;
        // Written so that a difference that is NaN counts.
        if difference.abs() <= step {
            return;
        }
        self.differs(t_s, || (Shown::Number(recorded), Shown::Number(replayed)));
        if self.worst.as_ref().is_none_or(|worst| difference.abs() > worst.difference.abs()) {
            self.worst = Some(Worst { t_s, difference });
        }
    }

    fn word<T: PartialEq>(&mut self, t_s: f64, recorded: &T, replayed: &T, shown: impl Fn(&T) -> String) {
        self.compared += 1;
        if recorded != replayed {
            self.differs(t_s, || (Shown::Word(shown(recorded)), Shown::Word(shown(replayed))));
        }
    }

    fn differs(&mut self, t_s: f64, values: impl FnOnce() -> (Shown, Shown)) {
        self.different += 1;
        self.first.get_or_insert_with(|| {
            let (recorded, replayed) = values();
            First { t_s, recorded, replayed }
        });
    }

    fn quantity(self, name: &'static str, unit: &'static str, is_decision: bool) -> Quantity {
        let compared = self.compared.max(1) as f64;
        Quantity {
            name,
            unit,
            is_decision,
            compared: self.compared,
            different: self.different,
            share: self.different as f64 / compared,
            first: self.first,
            rms: (!unit.is_empty()).then(|| (self.squares / compared).sqrt()),
            worst: self.worst,
        }
    }
}

/// Tallies of every quantity.
#[derive(Default)]
pub(super) struct Comparison {
    enable: Tally,
    duty: Tally,
    state: Tally,
    fault: Tally,
    tracking: Tally,
    angle: Tally,
    speed: Tally,
}

/// A value so far from a step of the radio, in steps, may have been rounded to it: half, and the replay's own last bits.
const ROUNDING: f64 = 0.55;

/// Replayed duty, angle and speed as the recording would hold them, and up to which difference they are the same.
struct AsRecorded {
    duty: (f64, f64),
    angle: (f64, f64),
    speed: (f64, f64),
}

impl AsRecorded {
    fn of(row: &FullRow, now: &Telemetry) -> Self {
        if !row.is_radio {
            let exact = |value: f32| (f64::from(value), 0.0);
            return Self { duty: exact(now.actuation.duty), angle: exact(now.angle), speed: exact(now.speed) };
        }
        let told = PackedTick::new(AdcCode::default(), now);
        let step = PackedTick { duty: Some(1), angle: 1, speed: 1, ..PackedTick::default() };
        // Both are on the radio's steps: half a step tells one from the next. A value near the middle between two steps may be
        // rounded to either, for the last bits of the replayed one hang on where the recording begins.
        let pair = |value: f32, rounded: f32, recorded: Option<f64>, step: f32| {
            let (value, rounded, step) = (f64::from(value), f64::from(rounded), f64::from(step));
            let is_same = |recorded: &f64| (value - recorded).abs() <= ROUNDING * step;
            (recorded.filter(is_same).unwrap_or(rounded), 0.5 * step)
        };
        let duty = if now.actuation.enable { now.actuation.duty } else { 0.0 };
        Self {
            duty: pair(duty, told.duty().unwrap_or(0.0), row.duty, step.duty().unwrap_or(0.0)),
            angle: pair(now.angle, told.angle(), row.estimate_angle_rad, step.angle()),
            speed: pair(now.speed, told.speed(), row.estimate_speed_rad_per_s, step.speed()),
        }
    }
}

impl Comparison {
    pub(super) fn take(&mut self, row: &FullRow, now: &Telemetry) {
        let t_s = row.t_s;
        let replayed = AsRecorded::of(row, now);
        let yes = |yes: &bool| if *yes { "on" } else { "off" }.to_owned();
        self.enable.word(t_s, &(row.enable != Some(0.0)), &now.actuation.enable, yes);
        if let Some(duty) = row.duty {
            let (now, step) = replayed.duty;
            self.duty.number(t_s, duty, now, now - duty, step);
        }
        if let Some(then) = row.stated {
            self.state.word(t_s, &then.state, &now.state, |state| format!("{state:?}"));
            let cause = |fault: &Option<_>| fault.map_or_else(|| "none".to_owned(), |fault| format!("{fault:?}"));
            self.fault.word(t_s, &then.fault, &now.fault, cause);
            self.tracking
                .word(t_s, &then.tracking, &now.tracking, |known| if *known { "known" } else { "unknown" }.into());
        }
        // Where one of the two has no angle, that is the difference.
        if !now.tracking || row.stated.is_some_and(|then| !then.tracking) {
            return;
        }
        if let Some(angle) = row.estimate_angle_rad {
            let (now, step) = replayed.angle;
            let difference = if now == angle { 0.0 } else { wrap(now - angle) };
            self.angle.number(t_s, angle, now, difference, step);
        }
        if let Some(speed) = row.estimate_speed_rad_per_s {
            let (now, step) = replayed.speed;
            self.speed.number(t_s, speed, now, now - speed, step);
        }
    }

    /// Ticks compared.
    pub(super) fn rows(&self) -> u64 {
        self.enable.compared
    }

    /// The figures, and which quantities the recording does not have.
    pub(super) fn quantities(self) -> (Vec<Quantity>, Vec<String>) {
        let all = [
            self.enable.quantity("bridge", "", true),
            self.duty.quantity("duty", "of 1", true),
            self.state.quantity("state", "", true),
            self.fault.quantity("fault", "", true),
            self.tracking.quantity("angle known", "", false),
            self.angle.quantity("estimated angle", "rad", false),
            self.speed.quantity("estimated speed", "rad/s", false),
        ];
        let (there, missing): (Vec<_>, Vec<_>) = all.into_iter().partition(|quantity| quantity.compared > 0);
        let missing = missing.iter().map(|q| format!("{}: not recorded, or never known in both", q.name)).collect();
        (there, missing)
    }
}

#[cfg(test)]
mod tests {
    use control::{Actuation, State};

    use super::*;
    use recording::Stated;

    fn row(is_radio: bool, duty: f32, angle: f32, speed: f32) -> FullRow {
        FullRow {
            t_s: 1.5,
            enable: Some(1.0),
            duty: Some(f64::from(duty)),
            estimate_angle_rad: Some(f64::from(angle)),
            estimate_speed_rad_per_s: Some(f64::from(speed)),
            stated: Some(Stated { state: State::Speed, fault: None, tracking: true, failed_sensor: None }),
            is_radio,
            ..FullRow::default()
        }
    }

    fn told(duty: f32, angle: f32, speed: f32) -> Telemetry {
        let actuation = Actuation { duty, enable: true };
        Telemetry { state: State::Speed, tracking: true, angle, speed, actuation, ..Telemetry::default() }
    }

    fn different(row: &FullRow, now: &Telemetry) -> Vec<&'static str> {
        let mut comparison = Comparison::default();
        comparison.take(row, now);
        let (quantities, missing) = comparison.quantities();
        assert_eq!((quantities.len(), missing.len()), (7, 0));
        quantities.iter().filter(|q| q.different > 0).map(|q| q.name).collect()
    }

    #[test]
    fn telemetry_is_compared_to_its_step_and_a_simulation_to_the_bit() {
        let now = told(0.3, -3.1, 44.0);
        let said = PackedTick::new(AdcCode(0), &now);
        let (duty, angle, speed) = (said.duty().unwrap(), said.angle(), said.speed());
        assert!(different(&row(true, duty, angle, speed), &now).is_empty());
        assert_eq!(different(&row(false, duty, angle, speed), &now), ["duty", "estimated angle"]);
        let other = told(0.3 + 1.6 / 32767.0, -3.1, 44.0 + 1.1 / 256.0);
        assert_eq!(different(&row(true, duty, angle, speed), &other), ["duty", "estimated speed"]);
        assert!(different(&row(false, 0.3, -3.1, 44.0), &now).is_empty());
    }

    #[test]
    fn a_turn_is_no_difference_and_no_number_is_one() {
        let mut tally = Tally::default();
        tally.number(0.0, 1.0, f64::NAN, f64::NAN, 0.0);
        assert_eq!(tally.different, 1);
        let mut comparison = Comparison::default();
        let almost = std::f32::consts::PI - 1e-3;
        comparison.take(&row(false, 0.0, almost, 0.0), &told(0.0, -almost, 0.0));
        let angle = comparison.quantities().0.remove(5);
        assert!(angle.rms.unwrap() < 4e-3, "{angle:?}");
    }
}
