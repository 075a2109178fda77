//! What a tick says about each fault: the evidence that the supervisor weighs.
//!
//! Where a healthy shaft looks the same for a while (in the blind arc, while it reverses), the persistence in the
//! parameters is longer than that while.

use crate::acquire::Line;
use crate::estimator::Verdict;
use crate::parameters::Parameters;
use crate::sample::{Actuation, AdcCode};
use crate::scalar::sign;
use crate::sensor::Reading;
use crate::supervisor::{Evidence, Fault, Findings, TRIGGERS};

/// What is known in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// The raw code.
    pub code: AdcCode,
    /// What it says.
    pub reading: Reading,
    /// What the filter made of it; `None` while no angle is acquired.
    pub verdict: Option<Verdict>,
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
    pub astray: bool,
}

/// Looks at the facts tick by tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watcher {
    /// Accepted readings in a row.
    accepted_run: u16,
    /// The end that the last reading showed: −1 low, +1 high, 0 neither.
    end: f32,
    /// The code that the reading may be frozen at.
    frozen_code: u16,
}

/// So many accepted readings in a row are no coincidence of garbage within the gate.
const BELIEVABLE_RUN: u16 = 8;

fn if_so(condition: bool) -> Evidence {
    if condition { Evidence::Present } else { Evidence::Absent }
}

impl Watcher {
    /// The evidence of a tick.
    pub fn look(&mut self, p: &Parameters, facts: &Facts) -> Findings {
        let end = match facts.reading {
            Reading::LowEnd => -1.0,
            Reading::HighEnd => 1.0,
            Reading::Angle(_) => 0.0,
        };
        let same_end = self.end * end > 0.0;
        self.end = end;
        let still = f32::from(facts.code.0.abs_diff(self.frozen_code)) <= p.supervisor.sensor_frozen.limit;
        if !still {
            self.frozen_code = facts.code.0;
        }
        self.accepted_run = match facts.verdict {
            Some(Verdict::Accepted) => self.accepted_run.saturating_add(1).min(BELIEVABLE_RUN),
            // A shaft that turns is out of the arc again long before the persistence; one that is blocked there is not.
            Some(Verdict::Blind) => self.accepted_run.saturating_sub(1),
            _ => 0,
        };
        let mut findings = Findings::default();
        for (trigger, finding) in TRIGGERS.iter().zip(&mut findings) {
            *finding = match trigger.fault {
                Fault::Stall => stall(p, facts),
                Fault::Runaway => runaway(p, facts),
                Fault::SensorOpen => self.open(p, facts),
                Fault::SensorShorted => {
                    if_so(same_end && facts.actuation.enable && facts.speed.abs() > p.supervisor.sensor_shorted.limit)
                }
                Fault::SensorFrozen => if_so(still && end.abs() < 0.5 && should_turn(p, facts)),
                Fault::SupplyLow => if_so(facts.battery.is_some_and(|volt| volt < p.supervisor.supply_low.limit)),
                Fault::CommandTooOld => if_so(facts.age > p.supervisor.command_old.limit),
                Fault::ClockFault => if_so(facts.astray || facts.since_sample > p.supervisor.clock.limit),
                // No sample tells.
                Fault::Restarted => Evidence::Absent,
            };
        }
        findings
    }

    /// No reading that fits, although the model's shaft turns or is driven so hard that it should: a blocked shaft whose
    /// wiper lies on insulation looks like an open sensor, and the model may hold it still with a drag that is not there.
    fn open(&self, p: &Parameters, facts: &Facts) -> Evidence {
        if self.accepted_run >= BELIEVABLE_RUN {
            Evidence::Absent
        } else if facts.actuation.enable && (is_driven(p, facts) || facts.speed.abs() > p.supervisor.sensor_open.limit)
        {
            Evidence::Present
        } else {
            Evidence::Unknown
        }
    }
}

fn is_driven(p: &Parameters, facts: &Facts) -> bool {
    facts.actuation.enable && facts.actuation.duty.abs() >= p.supervisor.driven_duty
}

fn stall(p: &Parameters, facts: &Facts) -> Evidence {
    let limit = p.supervisor.stall.limit;
    let slow = match (facts.line, facts.verdict) {
        (Some(line), _) => line.speed.abs() < limit,
        (None, Some(_)) => facts.speed.abs() < limit,
        (None, None) => return Evidence::Unknown,
    };
    if !slow {
        Evidence::Absent
    } else if is_driven(p, facts) {
        Evidence::Present
    } else {
        // At rest without being driven says nothing: a blocked shaft rests too when its target happens to be where it is.
        Evidence::Unknown
    }
}

fn runaway(p: &Parameters, facts: &Facts) -> Evidence {
    let limit = p.supervisor.runaway.limit;
    match facts.line {
        Some(line) => {
            // From the speed on that no longer counts as stalled: a line that is neither would go unseen.
            let against = is_driven(p, facts)
                && sign(line.speed) * sign(facts.actuation.duty) < 0.0
                && line.speed.abs() > p.supervisor.stall.limit;
            if_so(against || line.speed.abs() > limit)
        }
        None if facts.speed.abs() > limit => Evidence::Present,
        None => Evidence::Unknown,
    }
}

/// Whether the shaft turns or is driven so hard that it should.
fn should_turn(p: &Parameters, facts: &Facts) -> bool {
    is_driven(p, facts) || (facts.actuation.enable && facts.speed.abs() > p.acquisition.least_speed)
}
