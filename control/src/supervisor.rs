//! The safety state machine: one table says what every command and every fault does in every state, another what is
//! watched for. A fault ends with the bridge off and stays until `ClearFault`, and only once its cause is gone.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::parameters::{FaultLimit, Supervisor as Limits};

/// State of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub enum State {
    /// Bridge off, ready.
    #[default]
    Idle,
    /// Closed loop: holds a speed.
    Speed,
    /// Swings between two angles.
    Oscillate,
    /// Goes to an angle.
    Position,
    /// Open loop: a commanded duty. Watched like every other driving state: no trigger needs a controller that acts. So a
    /// sensor fault cuts the bridge where it would while a speed is held, and so does what looks like one: a shaft that
    /// is driven hard and stands, or that shuttles within the blind arc for longer than the persistence.
    Duty,
    /// Bridge off, the shaft turns out.
    Coast,
    /// Bridge off until cleared.
    Fault,
    /// Closed loop: plays the stored gait, a speed after the other.
    Gait,
}

/// Cause of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Fault {
    /// Driven, and the shaft does not turn.
    Stall,
    /// Faster than allowed, or turning against the drive.
    Runaway,
    /// No reading fits the motion: the wiper's wire is open.
    SensorOpen,
    /// The wiper is shorted to one end.
    SensorShorted,
    /// The reading does not change although the shaft should turn, outside the blind arc.
    SensorFrozen,
    /// The cell is below its limit.
    SupplyLow,
    /// No command for too long.
    CommandTooOld,
    /// The samples' time stands still, goes backwards or leaps.
    ClockFault,
    /// The processor has started: what drove before, and what is commanded since, was not meant for now. The only fault
    /// without a trigger: see [`Controller::restarted`](crate::Controller::restarted).
    Restarted,
    /// The winding holds more heat than it may: whatever was commanded, and whatever no other trigger saw.
    Overheated,
    /// The control loop misses its periods: nobody watches between two samples.
    LoopStarved,
}

/// What can happen to the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Command `Idle`.
    Idle,
    /// Command `Coast`.
    Coast,
    /// Command `Speed`.
    Speed,
    /// Command `Oscillate`.
    Oscillate,
    /// Command `Position`.
    Position,
    /// Command `Duty`.
    Duty,
    /// Command `ClearFault`, cause gone.
    Clear,
    /// A fault was found.
    Fault,
    /// Command `Gait`.
    Gait,
}

impl Event {
    /// Whether it asks for a state in which the bridge may drive.
    #[must_use]
    pub fn drives(self) -> bool {
        matches!(outcome(State::Idle, self), Outcome::To(state) if state.is_driving())
    }
}

/// Entry of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Go to (or stay in) a state.
    To(State),
    /// Not in this state.
    Refused,
}

/// Every state, in the order of [`TABLE`]'s rows.
pub const STATES: [State; 8] = [
    State::Idle,
    State::Speed,
    State::Oscillate,
    State::Position,
    State::Duty,
    State::Coast,
    State::Fault,
    State::Gait,
];
/// Every event, in the order of [`TABLE`]'s columns.
pub const EVENTS: [Event; 9] = [
    Event::Idle,
    Event::Coast,
    Event::Speed,
    Event::Oscillate,
    Event::Position,
    Event::Duty,
    Event::Clear,
    Event::Fault,
    Event::Gait,
];
/// Every fault.
pub const FAULTS: [Fault; 11] = [
    Fault::Stall,
    Fault::Runaway,
    Fault::SensorOpen,
    Fault::SensorShorted,
    Fault::SensorFrozen,
    Fault::SupplyLow,
    Fault::CommandTooOld,
    Fault::ClockFault,
    Fault::Restarted,
    Fault::Overheated,
    Fault::LoopStarved,
];

const NO: Outcome = Outcome::Refused;
const IDLE: Outcome = Outcome::To(State::Idle);
const COAST: Outcome = Outcome::To(State::Coast);
const SPEED: Outcome = Outcome::To(State::Speed);
const OSCILLATE: Outcome = Outcome::To(State::Oscillate);
const POSITION: Outcome = Outcome::To(State::Position);
const DUTY: Outcome = Outcome::To(State::Duty);
const FAULT: Outcome = Outcome::To(State::Fault);
const GAIT: Outcome = Outcome::To(State::Gait);

/// The table: a row a state, a column an event.
#[rustfmt::skip]
pub const TABLE: [(State, [(Event, Outcome); 9]); 8] = [
    (State::Idle,      [(Event::Idle, IDLE), (Event::Coast, COAST), (Event::Speed, SPEED), (Event::Oscillate, OSCILLATE), (Event::Position, POSITION), (Event::Duty, DUTY), (Event::Clear, IDLE),      (Event::Fault, FAULT), (Event::Gait, GAIT)]),
    (State::Speed,     [(Event::Idle, IDLE), (Event::Coast, COAST), (Event::Speed, SPEED), (Event::Oscillate, OSCILLATE), (Event::Position, POSITION), (Event::Duty, DUTY), (Event::Clear, SPEED),     (Event::Fault, FAULT), (Event::Gait, GAIT)]),
    (State::Oscillate, [(Event::Idle, IDLE), (Event::Coast, COAST), (Event::Speed, SPEED), (Event::Oscillate, OSCILLATE), (Event::Position, POSITION), (Event::Duty, DUTY), (Event::Clear, OSCILLATE), (Event::Fault, FAULT), (Event::Gait, GAIT)]),
    (State::Position,  [(Event::Idle, IDLE), (Event::Coast, COAST), (Event::Speed, SPEED), (Event::Oscillate, OSCILLATE), (Event::Position, POSITION), (Event::Duty, DUTY), (Event::Clear, POSITION),  (Event::Fault, FAULT), (Event::Gait, GAIT)]),
    (State::Duty,      [(Event::Idle, IDLE), (Event::Coast, COAST), (Event::Speed, SPEED), (Event::Oscillate, OSCILLATE), (Event::Position, POSITION), (Event::Duty, DUTY), (Event::Clear, DUTY),      (Event::Fault, FAULT), (Event::Gait, GAIT)]),
    (State::Coast,     [(Event::Idle, IDLE), (Event::Coast, COAST), (Event::Speed, SPEED), (Event::Oscillate, OSCILLATE), (Event::Position, POSITION), (Event::Duty, DUTY), (Event::Clear, COAST),     (Event::Fault, FAULT), (Event::Gait, GAIT)]),
    (State::Fault,     [(Event::Idle, NO),   (Event::Coast, NO),    (Event::Speed, NO),    (Event::Oscillate, NO),        (Event::Position, NO),       (Event::Duty, NO),   (Event::Clear, IDLE),      (Event::Fault, FAULT), (Event::Gait, NO)]),
    (State::Gait,      [(Event::Idle, IDLE), (Event::Coast, COAST), (Event::Speed, SPEED), (Event::Oscillate, OSCILLATE), (Event::Position, POSITION), (Event::Duty, DUTY), (Event::Clear, GAIT),      (Event::Fault, FAULT), (Event::Gait, GAIT)]),
];

/// Looks an event up.
#[must_use]
pub fn outcome(state: State, event: Event) -> Outcome {
    for (row, columns) in &TABLE {
        if *row == state {
            for (column, outcome) in columns {
                if *column == event {
                    return *outcome;
                }
            }
        }
    }
    // Not reached: the table is complete (tested for every pair). The bridge would be off.
    FAULT
}

impl State {
    /// Whether the bridge may drive.
    #[must_use]
    pub fn is_driving(self) -> bool {
        matches!(self, Self::Speed | Self::Oscillate | Self::Position | Self::Duty | Self::Gait)
    }
}

/// One row of what is watched.
#[derive(Clone, Copy)]
pub struct Trigger {
    /// The fault that it raises.
    pub fault: Fault,
    /// Unit of its limit.
    pub unit: &'static str,
    /// Its limit, persistence and bound among the parameters.
    pub limit: fn(&Limits) -> &FaultLimit,
}

/// What is watched while the bridge drives. Earlier rows win where several are due at once.
pub const TRIGGERS: [Trigger; 10] = [
    Trigger { fault: Fault::SupplyLow, unit: "V", limit: |limits| &limits.supply_low },
    Trigger { fault: Fault::CommandTooOld, unit: "s", limit: |limits| &limits.command_old },
    Trigger { fault: Fault::LoopStarved, unit: "s", limit: |limits| &limits.loop_starved },
    Trigger { fault: Fault::ClockFault, unit: "s", limit: |limits| &limits.clock },
    Trigger { fault: Fault::SensorShorted, unit: "rad/s", limit: |limits| &limits.sensor_shorted },
    Trigger { fault: Fault::SensorFrozen, unit: "codes", limit: |limits| &limits.sensor_frozen },
    Trigger { fault: Fault::Runaway, unit: "rad/s", limit: |limits| &limits.runaway },
    Trigger { fault: Fault::Stall, unit: "rad/s", limit: |limits| &limits.stall },
    Trigger { fault: Fault::SensorOpen, unit: "rad/s", limit: |limits| &limits.sensor_open },
    Trigger { fault: Fault::Overheated, unit: "", limit: |limits| &limits.overheated },
];

/// What a tick says about one fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Evidence {
    /// The cause is there.
    Present,
    /// The cause is not there.
    #[default]
    Absent,
    /// This tick cannot tell, e.g. in the blind arc.
    Unknown,
}

/// Absence takes back evidence so many times as fast as presence gathers it, but a sample speaks for one control period at
/// most, however long the pause before it: a single noisy tick must not hide a fault.
const FORGET: f32 = 4.0;

/// What a tick says about every fault, in the order of [`TRIGGERS`].
pub type Detections = [Evidence; TRIGGERS.len()];

/// The state machine with its timers.
///
/// Evidence outlives every command: what is commanded, and how often, takes back nothing of what was seen, and while the bridge is
/// off it waits. Only a sample that shows the contrary and a person's `ClearFault` do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Supervisor {
    state: State,
    fault: Option<Fault>,
    /// How long the evidence of each trigger has lasted, less what was taken back, s.
    lasted: [f32; TRIGGERS.len()],
}

impl Supervisor {
    /// Present state.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// Why it is in `State::Fault`; `None` elsewhere.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Tries an event that comes from a command: the state before, or `None` if refused.
    pub fn request(&mut self, event: Event) -> Option<State> {
        let before = self.state;
        match outcome(before, event) {
            Outcome::Refused => None,
            Outcome::To(state) => {
                if before == State::Fault && state != State::Fault {
                    self.lasted = [0.0; TRIGGERS.len()];
                }
                if state != State::Fault {
                    self.fault = None;
                }
                self.state = state;
                Some(before)
            }
        }
    }

    /// Raises a fault at once. The first one stays named.
    pub fn raise(&mut self, fault: Fault) {
        if self.state != State::Fault {
            self.fault = Some(fault);
        }
        self.request(Event::Fault);
    }

    /// Weighs the findings of a sample that came `elapsed` s after the one before, in a loop with the period `tick` s. A finding
    /// holds for the whole of that time, however long. Nothing is watched while the bridge is off; that it was on until this
    /// sample counts, too, for a command may have switched it off since.
    pub fn update(&mut self, limits: &Limits, detections: &Detections, elapsed: f32, tick: f32, was_on: bool) {
        if !self.state.is_driving() && !was_on {
            return;
        }
        let mut due = None;
        let forgotten = FORGET * tick;
        for ((trigger, detection), lasted) in TRIGGERS.iter().zip(detections).zip(&mut self.lasted) {
            match detection {
                Evidence::Present => *lasted += elapsed,
                Evidence::Absent if *lasted > forgotten => *lasted -= forgotten,
                Evidence::Absent => *lasted = 0.0,
                Evidence::Unknown => {}
            }
            if *detection == Evidence::Present && *lasted >= (trigger.limit)(limits).persistence && due.is_none() {
                due = Some(trigger.fault);
            }
        }
        if let Some(fault) = due {
            self.raise(fault);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: FaultLimit = FaultLimit { limit: 1.0, persistence: 0.1, bound: 0.2 };
    const LIMITS: Limits = Limits {
        stall: LIMIT,
        stall_window: 0.1,
        runaway: LIMIT,
        sensor_open: LIMIT,
        sensor_shorted: LIMIT,
        sensor_frozen: LIMIT,
        supply_low: LIMIT,
        supply_high: 5.0,
        slow_after: 0.5,
        command_old: LIMIT,
        clock: LIMIT,
        loop_starved: LIMIT,
        starved_share: 0.1,
        overheated: LIMIT,
        driven_duty: 0.5,
        driven_current: 0.01,
        rest_least: 0.2,
        rest_most: 100.0,
    };

    fn supervisor_in(state: State) -> Supervisor {
        let fault = (state == State::Fault).then_some(Fault::Stall);
        Supervisor { state, fault, lasted: [0.0; TRIGGERS.len()] }
    }

    #[test]
    fn the_table_has_every_pair_exactly_once() {
        for state in STATES {
            assert_eq!(TABLE.iter().filter(|row| row.0 == state).count(), 1);
            for event in EVENTS {
                let entries = TABLE.iter().filter(|row| row.0 == state).flat_map(|row| row.1.iter());
                assert_eq!(entries.filter(|entry| entry.0 == event).count(), 1, "{state:?} {event:?}");
            }
        }
    }

    #[test]
    fn every_event_in_every_state() {
        for state in STATES {
            for event in EVENTS {
                let mut supervisor = supervisor_in(state);
                let accepted = if event == Event::Fault {
                    supervisor.raise(Fault::Stall);
                    true
                } else {
                    supervisor.request(event).is_some()
                };
                let now = supervisor.state();
                if event == Event::Fault {
                    assert!(accepted && now == State::Fault, "{state:?}");
                } else if state == State::Fault {
                    assert_eq!(accepted, event == Event::Clear, "{event:?}");
                    assert_eq!(now == State::Idle, event == Event::Clear, "{event:?}");
                } else {
                    assert!(accepted && now != State::Fault, "{state:?} {event:?}");
                }
                assert_eq!(now == State::Fault, supervisor.fault().is_some());
            }
        }
    }

    #[test]
    fn a_fault_is_only_left_by_clear_and_keeps_its_first_name() {
        for first in FAULTS {
            let mut supervisor = supervisor_in(State::Speed);
            supervisor.raise(first);
            for event in EVENTS.iter().filter(|event| **event != Event::Clear) {
                supervisor.request(*event);
                assert_eq!(supervisor.state(), State::Fault, "{event:?}");
            }
            for second in FAULTS {
                supervisor.raise(second);
                assert_eq!(supervisor.fault(), Some(first));
            }
            supervisor.request(Event::Clear);
            assert_eq!((supervisor.state(), supervisor.fault()), (State::Idle, None));
        }
    }

    #[test]
    fn every_trigger_in_every_state_ends_with_the_bridge_off_after_its_persistence() {
        for state in STATES {
            for (index, trigger) in TRIGGERS.iter().enumerate() {
                let mut supervisor = supervisor_in(state);
                let mut detections = [Evidence::Absent; TRIGGERS.len()];
                detections[index] = Evidence::Present;
                for tick in 0..200 {
                    let off = !supervisor.state().is_driving();
                    assert!(off == (!state.is_driving() || tick >= 100), "{state:?} {:?} {tick}", trigger.fault);
                    supervisor.update(&LIMITS, &detections, 1.001e-3, 1e-3, false);
                }
                assert_eq!(
                    supervisor.fault() == Some(trigger.fault),
                    state.is_driving() || state == State::Fault && trigger.fault == Fault::Stall
                );
            }
        }
    }

    #[test]
    fn every_fault_but_a_restart_has_its_trigger() {
        for fault in FAULTS {
            let triggers = TRIGGERS.iter().filter(|trigger| trigger.fault == fault).count();
            assert_eq!(triggers, usize::from(fault != Fault::Restarted), "{fault:?}");
        }
    }

    #[test]
    fn evidence_that_is_unknown_waits_and_absence_takes_it_back() {
        let mut supervisor = supervisor_in(State::Speed);
        let with = |evidence| [evidence; TRIGGERS.len()];
        supervisor.update(&LIMITS, &with(Evidence::Present), 0.06, 1e-3, true);
        supervisor.update(&LIMITS, &with(Evidence::Unknown), 10.0, 1e-3, true);
        assert_eq!(supervisor.state(), State::Speed);
        // However long the pause, one sample takes back four periods.
        supervisor.update(&LIMITS, &with(Evidence::Absent), 10.0, 5e-3, true);
        supervisor.update(&LIMITS, &with(Evidence::Present), 0.05, 1e-3, true);
        assert_eq!(supervisor.state(), State::Speed);
        supervisor.update(&LIMITS, &with(Evidence::Present), 0.02, 1e-3, true);
        assert_eq!(supervisor.state(), State::Fault);
    }

    #[test]
    fn no_order_takes_back_evidence_but_clearing_a_fault_does() {
        let present = [Evidence::Present; TRIGGERS.len()];
        let orders = EVENTS.iter().filter(|event| !matches!(event, Event::Fault | Event::Clear));
        for first in orders.clone() {
            for second in orders.clone() {
                let mut supervisor = supervisor_in(State::Speed);
                let mut on = 0;
                for tick in 0..2000 {
                    supervisor.request(if tick % 2 == 0 { *first } else { *second });
                    let is_on = supervisor.state().is_driving();
                    on += u32::from(is_on);
                    supervisor.update(&LIMITS, &present, 1e-3, 1e-3, is_on);
                }
                assert!(on <= 101, "{first:?}, {second:?}: driven for {on} ms");
            }
        }
        let mut supervisor = supervisor_in(State::Speed);
        supervisor.update(&LIMITS, &present, 0.2, 1e-3, true);
        supervisor.request(Event::Clear);
        supervisor.request(Event::Speed);
        supervisor.update(&LIMITS, &present, 0.05, 1e-3, true);
        assert_eq!(supervisor.state(), State::Speed);
    }
}
