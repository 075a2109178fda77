//! The forward model: the simulator's own plant ([`hal_sim::plant`]: driver, supply, shaft, wiper, every effect's law) rolled
//! out freely over one segment of a run.

use effects::{Acts, Id, Laws, States};
use hal_sim::heat::Heat;
use hal_sim::plant::{Plant as FilePlant, dragged};
use hal_sim::shaft::{Shaft, ShaftState, Stepper, Terminals};
use hal_sim::supply::Supply;

use super::converter::ConverterError;
use super::probe::{Follows, Moment, Probe};
use super::track::{Segment, Track};

/// What no sensor sees and what one rollout hands to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hidden {
    /// Normalised bristle deflection, −1 … 1.
    pub bristle: f64,
    /// Winding current, A.
    pub current: f64,
    /// How far the wiper is behind the shaft, rad.
    pub wiper_behind: f64,
    /// How far the motor is ahead of a load behind a spring, rad, and how much faster, rad/s.
    pub twist: [f64; 2],
    /// How far a reading of which some repeat the one before is behind, rad.
    pub held_behind: f64,
    /// What the effects carry.
    pub states: States,
}

/// Where a rollout ends, and the next one begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Boundary {
    /// What no sensor sees.
    pub hidden: Hidden,
    /// Angle (rad, not wrapped) and speed (rad/s) of the shaft.
    pub shaft: [f64; 2],
}

/// The plant with its numbers set, ready for rollouts.
#[derive(Clone, Debug)]
pub struct Plant {
    /// Driven by a duty.
    shaft: Shaft,
    /// Driven at its terminals: what lies before the point where the voltage was measured is left out.
    terminals: Shaft,
    supply: Supply,
    /// The rail is the same whatever the bridge draws.
    stiff_supply: bool,
    /// Some effect acts on the duty.
    shapes_duty: bool,
    converter: Option<ConverterError>,
    half_play: f64,
    /// Age of the reading against the drive that was commanded, s; and against the terminals' voltage.
    delay_s: [f64; 2],
    /// By how much either grows in a second of the run, s/s.
    ageing: f64,
    /// Share of the readings that repeat the one before.
    held: f64,
    /// Some effect acts between shaft and reading.
    bent: bool,
    /// The reading follows the wiper with a memory.
    follows: bool,
    /// What turns into heat changes some effect.
    warms: bool,
    /// Half of the play between motor and load, rad.
    half_gap: f64,
    longest_step: f64,
    /// A term that no effect has, while a misfit is looked at.
    probe: Option<Probe>,
}

/// A shaft that is faster than this where a run begins has been turning, rad/s: readings alone do not show a slower one.
const TURNS: f64 = 5.0;
/// The same of teeth, rad/s.
const SLIDES: f64 = 0.5;
/// A span of more than this many mean spans of its segment is a hole. No segment has one inside.
const LONGEST_SPAN: f64 = 10.0;

/// Laws without some of the effects.
fn without(laws: &Laws, left_out: impl Fn(&Id) -> bool) -> Laws {
    let mut left = *laws;
    for id in laws.listed().filter(left_out) {
        id.put(&mut left, None);
    }
    left
}

/// Whether an effect acts before the motor's terminals.
fn before_terminals(id: &Id) -> bool {
    matches!(id.spec().acts, Acts::Command | Acts::Bridge | Acts::Supply)
}

/// Whether it bends the readings and leaves the motion, and what follows it, alone.
fn bends(id: &Id) -> bool {
    id.spec().acts == Acts::Sensor && !id.carries_state()
}

fn any(laws: &Laws, acts: Acts) -> bool {
    laws.listed().any(|id: Id| id.spec().acts == acts)
}

impl Plant {
    /// Whether teeth between motor and load meet and part.
    #[must_use]
    pub fn has_play(&self) -> bool {
        self.half_gap > 0.0
    }

    /// From the simulator's plant and the converter's own error, with the longest step of the integrator (s).
    #[must_use]
    pub fn new(file: FilePlant, converter: Option<ConverterError>, longest_step: f64) -> Self {
        let FilePlant { supply, shaft, half_play, .. } = file;
        Self {
            terminals: Shaft { laws: without(&shaft.laws, before_terminals), ..shaft },
            stiff_supply: supply.cell.is_none() && !any(&shaft.laws, Acts::Supply),
            shapes_duty: any(&shaft.laws, Acts::Command),
            bent: any(&shaft.laws, Acts::Sensor),
            follows: shaft.laws.follows(),
            warms: shaft.laws.warms(),
            half_gap: shaft.laws.coupling().map_or(0.0, |coupling| coupling.half_gap),
            delay_s: [shaft.laws.reading_age() + shaft.laws.command_age(), shaft.laws.reading_age()],
            ageing: shaft.laws.ageing(),
            held: shaft.laws.held(),
            shaft,
            supply,
            converter,
            half_play,
            longest_step,
            probe: None,
        }
    }

    /// The same with a term that no effect has.
    #[must_use]
    pub fn with_probe(&self, probe: Probe) -> Self {
        Self { probe: Some(probe), ..self.clone() }
    }

    /// The same with a sensor that shows where the shaft is.
    #[must_use]
    pub fn with_ideal_sensor(&self) -> Self {
        Self { half_play: 0.0, held: 0.0, follows: false, bent: false, converter: None, ..self.clone() }
    }

    /// What the sensor shows where the wiper stands at an angle, rad.
    #[inline]
    #[must_use]
    pub fn reading(&self, wiper: f64) -> f64 {
        let own = self.converter.as_ref().map_or(0.0, |converter| converter.error(wiper));
        let own = own + self.probe.as_ref().map_or(0.0, |probe| probe.reading_error(wiper));
        if self.bent { wiper + (self.shaft.laws.reading_error(wiper) + own) } else { wiper + own }
    }

    /// Whether another plant moves alike, so that only its readings differ.
    #[must_use]
    pub fn moves_like(&self, other: &Self) -> bool {
        let motion = |plant: &Self| Shaft { laws: without(&plant.shaft.laws, bends), ..plant.shaft };
        let moves = |plant: &Self| plant.probe.as_ref().is_some_and(|probe| probe.shape.follows != Follows::Reading);
        motion(self) == motion(other)
            && self.delay_s == other.delay_s
            && self.ageing == other.ageing
            && self.held == other.held
            && self.half_play == other.half_play
            && !moves(self)
            && !moves(other)
    }

    /// How what no sensor sees may stand at the start of a run or after a hole in it: dragged along with a shaft that turns, −1 or 1;
    /// of one that rests, anything from dragged backwards to dragged forwards, where something remembers which way that was or teeth
    /// stand somewhere in their play.
    #[must_use]
    pub fn beginnings(&self, speed: f64) -> Vec<f64> {
        let remembers =
            self.shaft.laws.presliding().is_some() || self.half_play > 0.0 || self.half_gap > 0.0 || self.follows;
        if !remembers {
            vec![(speed / SLIDES).clamp(-1.0, 1.0)]
        } else if speed.abs() > TURNS {
            vec![speed.signum()]
        } else {
            vec![0.0, -1.0, 1.0, -0.5, 0.5]
        }
    }

    /// By how much the shaft is ahead of what the sensor shows, rad.
    #[must_use]
    pub fn ahead(&self, hidden: &Hidden) -> f64 {
        hidden.wiper_behind + if self.follows { self.shaft.laws.behind(&hidden.states) } else { 0.0 }
    }

    /// What no sensor sees at the start of a run or after a hole in it, as far as it is dragged along, from the speed there, the time
    /// between samples (s) and what was carried before the hole.
    #[must_use]
    pub fn hidden_at_start(&self, dragging: f64, speed: f64, span: f64, before: &States) -> Hidden {
        let mut states = self.shaft.laws.lasting(before);
        self.shaft.laws.settle(&mut states, speed, dragging);
        Hidden {
            bristle: dragging,
            wiper_behind: self.half_play * dragging,
            twist: [self.half_gap * dragging, 0.0],
            held_behind: speed * span * self.held / (1.0 - self.held),
            states,
            ..Hidden::default()
        }
    }

    /// What no sensor sees, as this plant has it where another has it: teeth that touch still touch.
    #[must_use]
    pub fn take_over(&self, hidden: &Hidden, other: &Self) -> Hidden {
        let [twist, rate] = hidden.twist;
        let wider = if other.half_gap > 0.0 { self.half_gap / other.half_gap } else { 1.0 };
        Hidden { twist: [wider * twist, rate], ..*hidden }
    }

    fn cold(&self, track: &Track) -> &Shaft {
        if track.terminals_measured { &self.terminals } else { &self.shaft }
    }

    /// For the rollouts of a track.
    #[must_use]
    pub fn stepper(&self, track: &Track) -> Stepper {
        self.cold(track).stepper(self.longest_step)
    }

    /// Rolls out one segment from an angle and a speed at its first sample (at the time the sensor shows there, so a
    /// late reading is a late start), with the track's [`Self::stepper`]. Writes where the wiper stands at each sample, and
    /// the current where asked; returns what the next segment starts with.
    pub fn rollout(
        &self,
        track: &Track,
        segment: &Segment,
        from: Boundary,
        stepper: &mut Stepper,
        wipers: &mut [f64],
        currents: Option<&mut [f64]>,
    ) -> Boundary {
        let Boundary { hidden, shaft: [angle, speed] } = from;
        let cold = self.cold(track);
        if self.warms {
            stepper.warm(cold, &hidden.states);
        }
        let [twist, twist_rate] = hidden.twist;
        let mut motion = Motion {
            state: ShaftState { angle, speed, current: hidden.current, bristle: hidden.bristle, twist, twist_rate },
            wiper: angle - hidden.wiper_behind,
            states: hidden.states,
            slipped: 0.0,
            drawn_as: 0.0,
            heat: Heat::default(),
        };
        let delay = self.delay_s[usize::from(track.terminals_measured)];
        let aged = |k: usize| delay + self.ageing * (track.t[k] - track.t[0]);
        let mut drive = DriveCursor::new(track, segment.first, aged(segment.first));
        let (mut shown, mut held_behind) = (self.shown(&motion), hidden.held_behind);
        let (mut known_span, mut steps) = (f64::INFINITY, 1);
        wipers[0] = shown - held_behind;
        // The last sample leads on to the next segment. Where a hole in the recording lies between, nothing is carried
        // over it, and it may be hours long.
        let samples = segment.last - segment.first;
        let usual_span = if samples > 1 {
            (track.t[segment.last - 1] - track.t[segment.first]) / (samples - 1) as f64
        } else {
            f64::INFINITY
        };
        let longest_span = LONGEST_SPAN * usual_span;
        let last = segment.last.min(track.t.len() - 1);
        // Where the reading is late and the current is not, the last currents were measured when the sensor did not show the shaft yet.
        let late = if currents.is_some() { self.delay_s[1] / usual_span } else { 0.0 };
        let until = (last + late.ceil() as usize).min(track.t.len() - 1);
        let mut means = Vec::with_capacity(if currents.is_some() { until - segment.first } else { 0 });
        let mut reached = None;
        for k in segment.first..until {
            // Between two readings the shaft moves on by the time between their instants, not between their stamps.
            let span = (track.t[k + 1] - track.t[k]).min(longest_span) * (1.0 - self.ageing);
            drive.delay = aged(k);
            if (span - known_span).abs() >= 1e-7 {
                let parts = (span / self.longest_step - 1e-3).ceil().max(1.0);
                stepper.set_step(span / parts);
                (known_span, steps) = (span, parts as usize);
            }
            let mut current = 0.0;
            for j in 0..steps {
                let (step, from) = (stepper.step(), track.t[k] + j as f64 * stepper.step());
                // A late drive switches the bridge inside a step: the step is cut there, for no mean stands for both.
                let Some(first) = drive.switch_within(track, from, step) else {
                    let drive = drive.over(track, k, from, step);
                    current += self.advance(track, k, stepper, &mut motion, drive);
                    continue;
                };
                for (from, part) in [(from, first), (from + first, step - first)] {
                    let drive = drive.over(track, k, from, part);
                    stepper.set_step(part);
                    current += self.advance(track, k, stepper, &mut motion, drive) * part / step;
                }
                stepper.set_step(step);
            }
            // What the supply remembers advances with the mean current, as in a control period of the simulation.
            cold.laws.draw(&mut motion.states, motion.drawn_as / span, span);
            motion.drawn_as = 0.0;
            if self.warms {
                motion.heat.warm(&cold.laws, &mut motion.states, span);
                stepper.warm(cold, &motion.states);
            }
            let before = shown;
            shown = self.shown(&motion);
            held_behind = self.held * (held_behind + (shown - before));
            if k + 1 < segment.last {
                wipers[k + 1 - segment.first] = shown - held_behind;
            }
            if currents.is_some() {
                means.push(current / steps as f64);
            }
            if k + 1 == last {
                reached = Some(motion.boundary(held_behind));
            }
        }
        if let Some(currents) = currents {
            take_later(&means, late, currents);
        }
        reached.unwrap_or_else(|| motion.boundary(held_behind))
    }

    /// One step of driver, supply, shaft and wiper from sample `k` on; returns the mean current, A.
    #[inline]
    fn advance(&self, track: &Track, k: usize, stepper: &Stepper, motion: &mut Motion, drive: (f64, bool)) -> f64 {
        let shaft = stepper.shaft();
        let (command, enabled) = drive;
        let measured_rail = track.supply_v.get(k).copied();
        let mut duty = 0.0;
        let terminals = if !enabled {
            Terminals::Open
        } else if track.terminals_measured {
            Terminals::Driven { voltage: command }
        } else {
            duty = if self.shapes_duty { shaft.laws.duty(command) } else { command };
            let rail = if let Some(measured) = measured_rail {
                measured
            } else if self.stiff_supply {
                self.supply.rail_v
            } else {
                let fallen = shaft.laws.supply_fallen(&motion.states);
                self.supply.rail(shaft, duty, stepper.motor_speed(&motion.state), fallen)
            };
            stepper.terminals(duty, rail)
        };
        let body = track.load_torque.get(k).copied().unwrap_or(0.0);
        let torque = self.probe.as_ref().map_or(body, |probe| {
            let at = moment(track, k, &motion.state, terminals);
            motion.slipped += probe.slip(at) * stepper.step();
            body + probe.torque(at)
        });
        let means = stepper.advance_under(&mut motion.state, terminals, torque);
        motion.drawn_as += duty * means.current * stepper.step();
        let before = motion.wiper;
        motion.wiper = dragged(before, self.half_play, motion.state.angle);
        if self.follows {
            shaft.laws.follow(&mut motion.states, motion.wiper - before, stepper.step());
        }
        if self.warms {
            motion.heat.add(shaft, &means, stepper.step());
        }
        means.current
    }

    /// Where the sensor sees the wiper, rad.
    #[inline]
    fn shown(&self, motion: &Motion) -> f64 {
        let wiper = motion.wiper + motion.slipped;
        if self.follows { wiper - self.shaft.laws.behind(&motion.states) } else { wiper }
    }
}

/// A shaft at a sample of a track.
fn moment(track: &Track, k: usize, state: &ShaftState, terminals: Terminals) -> Moment {
    let voltage = match terminals {
        Terminals::Driven { voltage } | Terminals::Switched { voltage, .. } => voltage,
        Terminals::Open => 0.0,
    };
    Moment {
        angle: state.angle,
        speed: state.speed,
        voltage,
        current: state.current,
        time: track.t[k] - track.t[0],
        since_reversal: track.since_reversal[k],
        run: track.place,
    }
}

/// What moves in a rollout.
struct Motion {
    state: ShaftState,
    /// Where the wiper stands, rad.
    wiper: f64,
    states: States,
    /// How far the sensor has gained on the shaft, rad.
    slipped: f64,
    /// Charge that the bridge has drawn since the last sample, A·s.
    drawn_as: f64,
    /// Since the last sample.
    heat: Heat,
}

impl Motion {
    /// What the next segment starts with, with the last reading so far behind the wiper (rad).
    fn boundary(&self, held_behind: f64) -> Boundary {
        let hidden = Hidden {
            bristle: self.state.bristle,
            current: self.state.current,
            wiper_behind: self.state.angle - self.wiper,
            twist: [self.state.twist, self.state.twist_rate],
            held_behind,
            states: self.states,
        };
        Boundary { hidden, shaft: [self.state.angle, self.state.speed] }
    }
}

/// Means over intervals that lie later by so many of them as those that are given. Beyond the end of a recording the last one stands.
fn take_later(means: &[f64], later: f64, out: &mut [f64]) {
    let whole = later.floor();
    let at = |place: usize| means.get(place).or(means.last()).copied().unwrap_or(0.0);
    for (place, value) in out.iter_mut().enumerate() {
        let [now, next] = [0, 1].map(|ahead| at(place + whole as usize + ahead));
        *value = now + (later - whole) * (next - now);
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
