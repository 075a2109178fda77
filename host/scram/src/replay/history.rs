//! What a run looked like, collected in bounded memory while its entries pass.

use control::{Command, Fault, State, Telemetry};
use robot_file::Robot;
use robot_file::angle_code::{AngleScale, angle_scale};

use super::decide::command;
use super::trail::Trail;
use common::conventions::{degrees, frequency_from_omega};
use common::wrap;
use recording::{FullRow, LinkQuality, RecordedEvent, SessionEvent};

/// Span over which the speed is taken from the angle where nobody estimated it, s.
const SPEED_OVER_S: f64 = 0.05;
/// Spans and marks that are kept: more cannot be told apart.
const MOST_MARKS: usize = 2000;

/// A state from one time to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Held {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) state: State,
    pub(super) fault: Option<Fault>,
}

/// Why a moment is marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    Command,
    Fault,
    Link,
    Note,
}

/// The lines of one side.
#[derive(Default)]
pub(super) struct Side {
    pub(super) frequency_hz: Trail,
    pub(super) angle_deg: Trail,
    pub(super) duty: Trail,
    pub(super) states: Vec<Held>,
    last_angle: Option<f64>,
}

/// Everything that is drawn.
pub(super) struct History {
    scale: AngleScale,
    pub(super) x: (f64, f64),
    pub(super) recorded: Side,
    pub(super) replayed: Side,
    pub(super) speed_from_angle: Trail,
    pub(super) reading_deg: Trail,
    pub(super) phase_deg: Trail,
    pub(super) voltage_v: Trail,
    pub(super) supply_v: Trail,
    pub(super) battery_v: Trail,
    pub(super) rate_hz: Trail,
    pub(super) loss_percent: Trail,
    pub(super) latency_ms: Trail,
    pub(super) rssi_dbm: Trail,
    /// What is asked for from a time on: frequency (Hz), and one or two angles (degrees).
    pub(super) targets: Vec<(f64, Option<f64>, [Option<f64>; 2])>,
    pub(super) marks: Vec<(f64, String, Why)>,
    /// Angle turned since, and at when, for the speed.
    turned: Option<(f64, f64, f64)>,
    last_reading: Option<f64>,
}

impl History {
    pub(super) fn new(robot: &Robot) -> Self {
        Self {
            scale: angle_scale(&robot.sensor),
            x: (f64::INFINITY, f64::NEG_INFINITY),
            recorded: Side::default(),
            replayed: Side::default(),
            speed_from_angle: Trail::default(),
            reading_deg: Trail::default(),
            phase_deg: Trail::default(),
            voltage_v: Trail::default(),
            supply_v: Trail::default(),
            battery_v: Trail::default(),
            rate_hz: Trail::default(),
            loss_percent: Trail::default(),
            latency_ms: Trail::default(),
            rssi_dbm: Trail::default(),
            targets: Vec::new(),
            marks: Vec::new(),
            turned: None,
            last_reading: None,
        }
    }

    pub(super) fn row(&mut self, row: &FullRow, now: Option<&Telemetry>) {
        let t = row.t_s;
        self.x = (self.x.0.min(t), self.x.1.max(t));
        let is_on = row.enable != Some(0.0);
        self.recorded.duty.push(t, row.duty.filter(|_| is_on));
        self.voltage_v.push(t, row.voltage_v.filter(|_| is_on));
        let is_tracking = row.stated.is_none_or(|stated| stated.tracking);
        let estimate = |value: Option<f64>| value.filter(|_| is_tracking);
        self.recorded.frequency_hz.push(t, estimate(row.estimate_speed_rad_per_s).map(frequency_from_omega));
        self.recorded.angle(t, estimate(row.estimate_angle_rad));
        if let Some(stated) = row.stated {
            let begins = self.recorded.states.last().is_none_or(|held| held.fault != stated.fault);
            if let Some(fault) = stated.fault.filter(|_| begins) {
                self.mark(t, format!("{fault:?}"), Why::Fault);
            }
            self.recorded.holds(t, stated.state, stated.fault);
        }
        let held = row.stated.is_some_and(|stated| stated.state == State::Speed && stated.tracking);
        let phase = row.reference_angle_rad.zip(row.estimate_angle_rad).filter(|_| held);
        self.phase_deg.push(t, phase.map(|(reference, angle)| degrees(wrap(reference - angle))));
        self.supply_v.push(t, row.supply_v.or(row.truth_bridge_supply_v));
        self.battery_v.push(t, row.battery_v);
        self.reading(t, row);
        if let Some(now) = now {
            let tracked = |value: f32| now.tracking.then_some(f64::from(value));
            self.replayed.duty.push(t, now.actuation.enable.then(|| f64::from(now.actuation.duty)));
            self.replayed.frequency_hz.push(t, tracked(now.speed).map(frequency_from_omega));
            self.replayed.angle(t, tracked(now.angle));
            self.replayed.holds(t, now.state, now.fault);
        }
    }

    /// The angle as it was measured, and the speed from it.
    fn reading(&mut self, t: f64, row: &FullRow) {
        let code = row.adc.or(row.angle_code).map(|code| self.scale.angle(code));
        let Some(angle) = row.angle_rad.or(code).map(wrap) else {
            self.reading_deg.push(t, None);
            return;
        };
        let step = self.last_reading.replace(angle).map(|last| wrap(angle - last));
        if step.is_some_and(|step| step.abs() > 0.5) {
            self.reading_deg.push(t, None);
        }
        self.reading_deg.push(t, Some(degrees(angle)));
        let (since, turned, last_t) = self.turned.unwrap_or((t, 0.0, t));
        let turned = turned + step.unwrap_or(0.0);
        self.turned = Some((since, turned, t));
        if t - last_t > SPEED_OVER_S {
            self.turned = Some((t, 0.0, t));
        } else if t - since >= SPEED_OVER_S {
            self.speed_from_angle.push(0.5 * (since + t), Some(frequency_from_omega(turned / (t - since))));
            self.turned = Some((t, 0.0, t));
        }
    }

    /// Ticks are missing before a time.
    pub(super) fn gap(&mut self, t: f64) {
        let sides = [&mut self.recorded, &mut self.replayed];
        for side in sides {
            for trail in [&mut side.frequency_hz, &mut side.angle_deg, &mut side.duty] {
                trail.push(t, None);
            }
        }
        self.reading_deg.push(t, None);
    }

    pub(super) fn event(&mut self, event: &RecordedEvent) {
        let t = event.t_s;
        if let SessionEvent::Command { repeat: true, .. } = event.event {
            return;
        }
        if let Some(command) = command(&event.event) {
            self.target(t, command);
        }
        match &event.event {
            SessionEvent::Command { text, .. } => self.mark(t, text.clone(), Why::Command),
            SessionEvent::Stop => self.mark(t, "stop".into(), Why::Command),
            SessionEvent::LinkLost => self.mark(t, "link lost".into(), Why::Link),
            SessionEvent::LinkRegained => self.mark(t, "link back".into(), Why::Link),
            SessionEvent::Note { text } => self.mark(t, text.clone(), Why::Note),
            // The states show faults; answers are for the events' list.
            SessionEvent::Fault { .. } | SessionEvent::Answer { .. } => {}
        }
    }

    fn mark(&mut self, t: f64, text: String, why: Why) {
        if self.marks.len() < MOST_MARKS {
            self.marks.push((t, text, why));
        }
    }

    fn target(&mut self, t: f64, command: Command) {
        let deg = |rad: f32| Some(degrees(wrap(f64::from(rad))));
        let (hz, angles) = match command {
            Command::Speed { omega } => (Some(frequency_from_omega(f64::from(omega))), [None; 2]),
            Command::Oscillate { from, to, .. } => (None, [deg(from), deg(to)]),
            Command::Position { angle } => (None, [deg(angle), None]),
            _ => (None, [None; 2]),
        };
        if self.targets.len() < MOST_MARKS {
            self.targets.push((t, hz, angles));
        }
    }

    pub(super) fn link(&mut self, t: f64, quality: &LinkQuality) {
        let number = |value: f32| value.is_finite().then(|| f64::from(value));
        self.rate_hz.push(t, number(quality.rate_hz));
        self.loss_percent.push(t, number(quality.loss).map(|share| 100.0 * share));
        self.latency_ms.push(t, quality.latency_s.and_then(number).map(|s| 1e3 * s));
        self.rssi_dbm.push(t, quality.rssi_dbm.and_then(number));
    }
}

impl Side {
    /// Broken where it wraps.
    fn angle(&mut self, t: f64, angle: Option<f64>) {
        let wraps = self.last_angle.zip(angle).is_some_and(|(last, angle)| (angle - last).abs() > 3.0);
        if wraps {
            self.angle_deg.push(t, None);
        }
        self.last_angle = angle;
        self.angle_deg.push(t, angle.map(degrees));
    }

    fn holds(&mut self, t: f64, state: State, fault: Option<Fault>) {
        let count = self.states.len();
        match self.states.last_mut() {
            Some(held) if (held.state == state && held.fault == fault) || count >= MOST_MARKS => held.to = t,
            last => {
                if let Some(held) = last {
                    held.to = t;
                }
                self.states.push(Held { from: t, to: t, state, fault });
            }
        }
    }
}
