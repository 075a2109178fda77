//! The forward model: the simulator's own shaft (`hal_sim::shaft`) with driver, supply and sensor around it, rolled out
//! freely over one segment of a run.

use hal_sim::shaft::{BridgeDrop, Friction, Gravity, Shaft, ShaftState, Stepper, Terminals};

use super::library::{Numbers, Slot};
use super::track::{Segment, Track};

/// What no sensor sees and what one rollout hands to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hidden {
    /// Normalised bristle deflection, −1 … 1.
    pub bristle: f64,
    /// Winding current, A.
    pub current: f64,
    /// Current drawn from the bridge's supply, A.
    pub supply_current: f64,
    /// The same behind the battery's relaxation, A.
    pub relaxed_current: f64,
}

/// The model with its numbers set.
#[derive(Clone, Debug)]
pub struct Plant {
    shaft: Shaft,
    rail_v: f64,
    deadband: f64,
    sag_ohm: f64,
    relaxation_ohm: f64,
    relaxation_s: f64,
    delay_s: f64,
    harmonics: [f64; 4],
    bent: bool,
    longest_step: f64,
}

/// A span of more than this many mean spans of its segment is a hole. No segment has one inside.
const LONGEST_SPAN: f64 = 10.0;

impl Plant {
    /// From numbers in SI units.
    #[must_use]
    pub fn new(numbers: &Numbers, inductance_h: f64, rail_v: f64, longest_step: f64) -> Self {
        let get = |slot: Slot| numbers[slot as usize];
        let harmonics = [get(Slot::Cos1), get(Slot::Sin1), get(Slot::Cos2), get(Slot::Sin2)];
        let (east, north) = (get(Slot::GravityCos), get(Slot::GravitySin));
        Self {
            shaft: Shaft {
                resistance_ohm: get(Slot::Resistance),
                inductance_h,
                torque_constant: get(Slot::TorqueConstant),
                inertia_kg_m2: get(Slot::Inertia),
                viscous: get(Slot::Viscous),
                friction: Friction {
                    coulomb_nm: get(Slot::Coulomb),
                    breakaway_excess_nm: get(Slot::BreakawayExcess),
                    stribeck_speed_rad_per_s: get(Slot::StribeckSpeed),
                    load_coefficient: get(Slot::LoadCoefficient),
                    presliding_rad: get(Slot::Presliding),
                },
                gravity: Gravity { torque_nm: east.hypot(north), direction_rad: north.atan2(east) },
                bridge: BridgeDrop { drop_v: get(Slot::DropVolts), slope_ohm: get(Slot::DropSlope) },
            },
            rail_v,
            deadband: get(Slot::Deadband),
            sag_ohm: get(Slot::SagOhm),
            relaxation_ohm: get(Slot::RelaxationOhm),
            relaxation_s: get(Slot::RelaxationTime),
            delay_s: get(Slot::Delay),
            bent: harmonics.iter().any(|&amplitude| amplitude != 0.0),
            harmonics,
            longest_step,
        }
    }

    /// What the sensor shows at an angle, rad.
    #[inline]
    #[must_use]
    pub fn reading(&self, angle: f64) -> f64 {
        if !self.bent {
            return angle;
        }
        let (sin, cos) = angle.sin_cos();
        let [cos1, sin1, cos2, sin2] = self.harmonics;
        angle + cos1 * cos + sin1 * sin + cos2 * (cos * cos - sin * sin) + sin2 * 2.0 * sin * cos
    }

    /// What no sensor sees at the start of a run, from the speed there.
    #[must_use]
    pub fn hidden_at_start(&self, speed: f64) -> Hidden {
        // A shaft that turns slides; one that does not is taken as relaxed.
        Hidden { bristle: (speed / 0.5).clamp(-1.0, 1.0), ..Hidden::default() }
    }

    /// Rolls out one segment from an angle and a speed at its first sample (at the time the sensor shows there, so a
    /// late reading is a late start). Writes the reading at each sample, and the current where asked; returns what the
    /// next segment starts with.
    pub fn roll(
        &self,
        track: &Track,
        segment: &Segment,
        start: [f64; 2],
        hidden: Hidden,
        readings: &mut [f64],
        currents: Option<&mut [f64]>,
    ) -> Hidden {
        let mut state =
            ShaftState { angle: start[0], speed: start[1], current: hidden.current, bristle: hidden.bristle };
        let mut supply = (hidden.supply_current, hidden.relaxed_current);
        let mut drive = DriveCursor::new(track, segment.first, self.delay_s);
        let mut stepper: Option<(Stepper, usize, f64)> = None;
        let mut currents = currents;
        readings[0] = self.reading(state.angle);
        // The last sample leads on to the next segment. Where a hole in the recording lies between, nothing is carried
        // over it, and it may be hours long.
        let samples = segment.last - segment.first;
        let longest_span = if samples > 1 {
            LONGEST_SPAN * (track.t[segment.last - 1] - track.t[segment.first]) / (samples - 1) as f64
        } else {
            f64::INFINITY
        };
        for k in segment.first..segment.last.min(track.t.len() - 1) {
            let span = (track.t[k + 1] - track.t[k]).min(longest_span);
            let (stepper, steps) = match &stepper {
                Some((known, steps, known_span)) if (span - known_span).abs() < 1e-7 => (*known, *steps),
                _ => {
                    let steps = (span / self.longest_step - 1e-3).ceil().max(1.0);
                    let made = self.shaft.stepper(span / steps);
                    stepper = Some((made, steps as usize, span));
                    (made, steps as usize)
                }
            };
            let mut current = 0.0;
            for j in 0..steps {
                let (step, from) = (stepper.step(), track.t[k] + j as f64 * stepper.step());
                // A late drive switches the bridge inside a step: the step is cut there, for no mean stands for both.
                let Some(first) = drive.switch_within(track, from, step) else {
                    let (command, enabled) = drive.over(track, k, from, step);
                    current += self.advance(track, &stepper, &mut state, &mut supply, command, enabled);
                    continue;
                };
                for (from, part) in [(from, first), (from + first, step - first)] {
                    let (command, enabled) = drive.over(track, k, from, part);
                    let part_stepper = self.shaft.stepper(part);
                    let mean = self.advance(track, &part_stepper, &mut state, &mut supply, command, enabled);
                    current += mean * part / step;
                }
            }
            let place = k + 1 - segment.first;
            if k + 1 < segment.last {
                readings[place] = self.reading(state.angle);
            }
            if let Some(currents) = currents.as_deref_mut() {
                currents[place - 1] = current / steps as f64;
            }
        }
        Hidden { bristle: state.bristle, current: state.current, supply_current: supply.0, relaxed_current: supply.1 }
    }

    /// One step of driver, supply and shaft; returns the mean current.
    #[inline]
    fn advance(
        &self,
        track: &Track,
        stepper: &Stepper,
        state: &mut ShaftState,
        supply: &mut (f64, f64),
        command: f64,
        enabled: bool,
    ) -> f64 {
        let terminals = if enabled {
            let voltage = if track.drive_is_volts {
                self.past_deadband(command, self.rail_v)
            } else {
                let sag = self.sag_ohm * supply.0 + self.relaxation_ohm * supply.1;
                self.past_deadband(command, 1.0) * (self.rail_v - sag)
            };
            Terminals::Driven { voltage }
        } else {
            Terminals::Open
        };
        let means = stepper.advance(state, terminals);
        supply.0 = if enabled && !track.drive_is_volts { command * means.current } else { 0.0 };
        if self.relaxation_ohm != 0.0 {
            supply.1 += (supply.0 - supply.1) * (stepper.step() / self.relaxation_s).min(1.0);
        }
        means.current
    }

    #[inline]
    fn past_deadband(&self, command: f64, full: f64) -> f64 {
        let width = self.deadband * full;
        if width == 0.0 {
            command
        } else if command.abs() <= width {
            0.0
        } else {
            command - width.copysign(command)
        }
    }
}

/// Parts of a step shorter than this share of it are not worth a step of their own.
const SHORTEST_PART: f64 = 1e-3;

/// The drive's mean over a step, `delay` before the sensor's time.
struct DriveCursor {
    delay: f64,
    at: usize,
}

impl DriveCursor {
    fn new(track: &Track, first: usize, delay: f64) -> Self {
        let mut cursor = Self { delay, at: first };
        if delay != 0.0 {
            let from = track.t[first] - delay;
            while cursor.at > 0 && track.t[cursor.at] > from {
                cursor.at -= 1;
            }
        }
        cursor
    }

    /// How long after `from` (s) the delayed bridge is switched on or off, if that is within the step.
    #[inline]
    fn switch_within(&mut self, track: &Track, from: f64, step: f64) -> Option<f64> {
        if self.delay == 0.0 {
            return None;
        }
        let from = from - self.delay;
        self.seek(track, from);
        let before = track.enable[self.at];
        let later = self.at + 1..track.t.len();
        let switched = later.take_while(|&i| track.t[i] < from + step).find(|&i| track.enable[i] != before)?;
        let first = track.t[switched] - from;
        (first > SHORTEST_PART * step && first < (1.0 - SHORTEST_PART) * step).then_some(first)
    }

    /// Mean command over a step that begins at `from` (s), and whether the bridge drives.
    #[inline]
    fn over(&mut self, track: &Track, k: usize, from: f64, step: f64) -> (f64, bool) {
        if self.delay == 0.0 {
            return (track.drive[k], track.enable[k]);
        }
        let from = from - self.delay;
        let start = self.integral(track, from);
        let middle = from + 0.5 * step;
        self.seek(track, middle);
        let enabled = track.enable[self.at];
        let end = self.integral(track, from + step);
        ((end - start) / step, enabled)
    }

    #[inline]
    fn seek(&mut self, track: &Track, time: f64) {
        while self.at + 1 < track.t.len() && track.t[self.at + 1] <= time {
            self.at += 1;
        }
        while self.at > 0 && track.t[self.at] > time {
            self.at -= 1;
        }
    }

    #[inline]
    fn integral(&mut self, track: &Track, time: f64) -> f64 {
        self.seek(track, time);
        track.drive_integral[self.at] + track.drive[self.at] * (time - track.t[self.at])
    }
}
