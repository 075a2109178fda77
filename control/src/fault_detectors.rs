//! What a tick says about each fault: the evidence that the supervisor weighs.
//!
//! Where a healthy shaft looks the same for a while (in the blind arc, while it reverses), the persistence in the
//! parameters is longer than that while.

use crate::acquire::Line;
use crate::angle::wrap;
use crate::estimator::GateOutcome;
use crate::parameters::Parameters;
use crate::sample::{Actuation, AdcCode};
use crate::scalar::sign;
use crate::sensor::Reading;
use crate::supervisor::{Detections, Evidence, Fault, TRIGGERS};

/// Inputs of the fault detectors in one tick.
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// ADC code of the wiper.
    pub code: AdcCode,
    /// Reading that the sensor's map gives for the code.
    pub reading: Reading,
    /// What the filter made of it; `None` while no angle is acquired.
    pub gate: Option<GateOutcome>,
    /// Line through the last readings, if they are in a row and straight.
    pub line: Option<Line>,
    /// Modelled or estimated speed, rad/s.
    pub speed: f32,
    /// What the bridge was told in the past tick.
    pub actuation: Actuation,
    /// Cell voltage, V; `None` where it is not measured.
    pub battery: Option<f32>,
    /// Age of the command, s.
    pub age: f32,
    /// Time since the last sample, s.
    pub since_sample: f32,
    /// The samples' time stood still, went backwards or leapt.
    pub clock_invalid: bool,
    /// Time of the control periods that were missed, s: see [`crate::loop_health`].
    pub missed: f32,
    /// The bridge would drive a significant current through a motor at rest.
    pub has_current: bool,
    /// Heat in the winding, as a multiple of what the continuous current keeps in it.
    pub heat: f32,
}

/// Fault detectors with the state that they carry from tick to tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaultDetectors {
    /// Accepted readings in a row.
    accepted_run: u16,
    /// The end that the last reading showed: −1 low, +1 high, 0 neither.
    end: f32,
    /// The code that the reading may be frozen at.
    frozen_code: u16,
    progress: Progress,
}

/// Whether the readings move on. Of the readings alone: an estimate may turn on while the shaft is blocked, and commands that
/// reverse the drive repeatedly keep it turning.
#[derive(Clone, Copy, Debug, Default)]
struct Progress {
    /// The reading that the later ones have stayed about, rad; nothing before the first.
    place: Option<f32>,
    /// For how long, s.
    lasted: f32,
    /// So many places in a row were left as soon as a turning shaft leaves them.
    left: u16,
}

/// A reading that is far off for once leaves a place and comes back: that makes one.
const MOVING: u16 = 2;

impl Progress {
    /// Takes in a reading after a time (s): whether the shaft turns as fast as it must. A reading of the blind arc says nothing.
    fn update(&mut self, p: &Parameters, reading: Reading, elapsed: f32) -> Option<bool> {
        let Reading::Angle(angle) = reading else { return None };
        if p.sensor.is_blind(angle) {
            return None;
        }
        self.lasted += elapsed;
        let window = p.supervisor.stall_window;
        let is_late = self.lasted * p.supervisor.stall.limit > window;
        if self.place.is_none_or(|place| wrap(angle - place).abs() > window) {
            let left = if is_late || self.place.is_none() { 0 } else { self.left.saturating_add(1) };
            *self = Self { place: Some(angle), lasted: 0.0, left };
            return Some(left >= MOVING);
        }
        Some(self.left >= MOVING && !is_late)
    }
}

/// So many accepted readings in a row are no coincidence of garbage within the gate.
const BELIEVABLE_RUN: u16 = 8;

fn if_so(condition: bool) -> Evidence {
    if condition { Evidence::Present } else { Evidence::Absent }
}

impl FaultDetectors {
    /// Evidence for and against every fault in one tick.
    pub fn update(&mut self, p: &Parameters, inputs: &Inputs) -> Detections {
        let end = match inputs.reading {
            Reading::LowEnd => -1.0,
            Reading::HighEnd => 1.0,
            Reading::Angle(_) => 0.0,
        };
        let same_end = self.end * end > 0.0;
        self.end = end;
        let still = f32::from(inputs.code.0.abs_diff(self.frozen_code)) <= p.supervisor.sensor_frozen.limit;
        if !still {
            self.frozen_code = inputs.code.0;
        }
        self.accepted_run = match inputs.gate {
            Some(GateOutcome::Accepted) => self.accepted_run.saturating_add(1).min(BELIEVABLE_RUN),
            // A shaft that turns is out of the arc again long before the persistence; one that is blocked there is not.
            Some(GateOutcome::Blind) => self.accepted_run.saturating_sub(1),
            _ => 0,
        };
        let moves = self.progress.update(p, inputs.reading, inputs.since_sample);
        let mut detections = Detections::default();
        for (trigger, detection) in TRIGGERS.iter().zip(&mut detections) {
            *detection = match trigger.fault {
                Fault::Stall => stall(inputs, moves),
                Fault::Runaway => runaway(p, inputs),
                Fault::SensorOpen => self.open(p, inputs),
                Fault::SensorShorted => {
                    let should_turn = inputs.speed.abs() > p.supervisor.sensor_shorted.limit || inputs.has_current;
                    if_so(same_end && inputs.actuation.enable && should_turn)
                }
                Fault::SensorFrozen => if_so(still && end.abs() < 0.5 && should_turn(p, inputs)),
                Fault::SupplyLow => if_so(inputs.battery.is_some_and(|volt| volt < p.supervisor.supply_low.limit)),
                Fault::CommandTooOld => if_so(inputs.age > p.supervisor.command_old.limit),
                Fault::ClockFault => if_so(inputs.clock_invalid || inputs.since_sample > p.supervisor.clock.limit),
                Fault::LoopStarved => if_so(inputs.missed > p.supervisor.loop_starved.limit),
                Fault::Overheated => if_so(inputs.heat > p.supervisor.overheated.limit),
                // No sample tells.
                Fault::Restarted => Evidence::Absent,
            };
        }
        detections
    }

    /// No reading that fits, although the model's shaft turns or is driven, however weakly: a blocked shaft whose wiper lies on
    /// insulation looks like an open sensor, and the model may hold it still with a drag that is not there.
    fn open(&self, p: &Parameters, inputs: &Inputs) -> Evidence {
        if self.accepted_run >= BELIEVABLE_RUN {
            Evidence::Absent
        } else if inputs.has_current || (inputs.actuation.enable && inputs.speed.abs() > p.supervisor.sensor_open.limit)
        {
            Evidence::Present
        } else {
            Evidence::Unknown
        }
    }
}

fn is_driven(p: &Parameters, inputs: &Inputs) -> bool {
    inputs.actuation.enable && inputs.actuation.duty.abs() >= p.supervisor.driven_duty
}

/// The readings stay where they are although a current drives the shaft, however weak.
fn stall(inputs: &Inputs, moves: Option<bool>) -> Evidence {
    match moves {
        Some(true) => Evidence::Absent,
        Some(false) if inputs.has_current => Evidence::Present,
        // At rest without being driven says nothing: a blocked shaft rests too when its target happens to be where it is.
        Some(false) | None => Evidence::Unknown,
    }
}

fn runaway(p: &Parameters, inputs: &Inputs) -> Evidence {
    let limit = p.supervisor.runaway.limit;
    match inputs.line {
        Some(line) => {
            // From the speed on that no longer counts as stalled: a line that is neither would go unseen.
            let against = is_driven(p, inputs)
                && sign(line.speed) * sign(inputs.actuation.duty) < 0.0
                && line.speed.abs() > p.supervisor.stall.limit;
            if_so(against || line.speed.abs() > limit)
        }
        None if inputs.speed.abs() > limit => Evidence::Present,
        None => Evidence::Unknown,
    }
}

/// Whether the shaft turns or is driven so hard that it should.
fn should_turn(p: &Parameters, inputs: &Inputs) -> bool {
    is_driven(p, inputs) || (inputs.actuation.enable && inputs.speed.abs() > p.acquisition.least_speed)
}
