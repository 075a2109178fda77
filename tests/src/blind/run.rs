//! One run of a world behind a sensor.

use std::iter::repeat_n;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::files::Run;
use super::noise::Source;
use super::sensing::{Sensor, follow};
use super::world::{Drive, State, World};

/// The longest integration step, s. A sliding bristle's rate is speed over presliding length, up to 1e5 1/s, and
/// Runge–Kutta is stable to 2.8 over that.
const STEP_S: f64 = 16e-6;
const STEP_BRISTLE_S: f64 = 10e-6;
/// What a sensor looks back on is kept so often, s.
const KEPT_S: f64 = 62.5e-6;

/// One run of a world behind a sensor, its drives so many a second.
#[must_use]
pub fn simulate(world: &World, sensor: &Sensor, drives: &[Drive], per_s: f64, start: f64, rng: &mut Pcg64) -> Run {
    simulate_with(world, sensor, drives, per_s, start, rng, 1.0)
}

/// The same with the integration step scaled, for the step-halving test.
#[must_use]
pub fn simulate_with(
    world: &World,
    sensor: &Sensor,
    drives: &[Drive],
    per_s: f64,
    start: f64,
    rng: &mut Pcg64,
    finer: f64,
) -> Run {
    let t_s = sensor.instants(drives.len(), per_s, rng);
    let mut motion = Motion::new(world, sensor, start, finer);
    motion.run(&t_s, drives, &arrivals(world, &t_s, rng));
    read(sensor, &motion, t_s, drives, rng)
}

/// When each drive comes into effect, s.
fn arrivals(world: &World, t_s: &[f64], rng: &mut Pcg64) -> Vec<f64> {
    let Some(latency) = world.latency else { return t_s.to_vec() };
    let mut rng = Pcg64::seed_from_u64(rng.random());
    let mut last = 0.0f64;
    let late = |time: &f64| {
        let normal: f64 = StandardNormal.sample(&mut rng);
        // No command overtakes another.
        last = last.max(time + latency.time_s * (1.0 + latency.jitter * normal).max(0.0));
        last
    };
    t_s.iter().map(late).collect()
}

/// How the shaft moved.
struct Motion<'a> {
    world: &'a World,
    sensor: &'a Sensor,
    longest: f64,
    state: State,
    /// A wiper for every play, rad.
    wipers: Vec<f64>,
    /// At every reading's instant: shown angle, shaft speed, current.
    at_readings: Vec<(f64, f64, f64)>,
    /// Time, shown angle and its speed in between, for sensors that look back.
    past: Vec<(f64, f64, f64)>,
}

impl<'a> Motion<'a> {
    fn new(world: &'a World, sensor: &'a Sensor, start: f64, finer: f64) -> Self {
        Self {
            world,
            sensor,
            longest: finer * if world.has_friction() { STEP_BRISTLE_S } else { STEP_S },
            state: world.rest(start),
            wipers: vec![start; sensor.plays.len()],
            at_readings: Vec::new(),
            past: vec![(0.0, start, 0.0)],
        }
    }

    /// Runs through the drives; a clock that is fast sees a little of what comes after the last one.
    fn run(&mut self, t_s: &[f64], drives: &[Drive], arrivals: &[f64]) {
        let end = t_s[t_s.len() - 1];
        let mut applied = Drive { duty: 0.0, enable: drives[0].enable && arrivals[0] <= 0.0 };
        let (mut drive, mut next) = (applied, 0);
        let beyond = (end - self.sensor.age(end)).max(end);
        for (&now, until) in t_s.iter().zip(t_s[1..].iter().chain(std::iter::once(&beyond))) {
            self.at_readings.push((self.shown(), self.world.shaft_speed(&self.state), self.state.current));
            let mut at = now;
            while at < *until {
                while arrivals.get(next).is_some_and(|arrival| *arrival <= at) {
                    drive = drives[next];
                    next += 1;
                }
                let to = arrivals.get(next).map_or(*until, |arrival| arrival.min(*until));
                let jumped = applied.enable != drive.enable || (applied.duty - drive.duty).abs() > 0.02;
                self.hold(drive, jumped, at, to);
                applied = drive;
                at = to;
            }
        }
    }

    /// Holds a drive, and keeps what is passed where the sensor looks back.
    fn hold(&mut self, drive: Drive, jumped: bool, from: f64, to: f64) {
        if !self.sensor.looks_back() {
            self.world.hold(&mut self.state, drive, jumped, to - from, self.longest);
            return;
        }
        let pieces = ((to - from) / KEPT_S).ceil().max(1.0);
        let length = (to - from) / pieces;
        for (piece, length) in repeat_n(length, pieces as usize).enumerate() {
            let before = self.shown();
            self.world.hold(&mut self.state, drive, jumped && piece == 0, length, self.longest);
            let shaft = self.world.shown_angle(&self.state);
            for (wiper, width) in self.wipers.iter_mut().zip(&self.sensor.plays) {
                *wiper = follow(*wiper, shaft, *width);
            }
            let plain = self.wipers.is_empty() && self.world.lag.is_none();
            let speed = if plain { self.world.shaft_speed(&self.state) } else { (self.shown() - before) / length };
            self.past.push((from + (piece + 1) as f64 * length, self.shown(), speed));
        }
    }

    /// What the sensor's wiper is at, rad.
    fn shown(&self) -> f64 {
        if self.wipers.is_empty() {
            return self.world.shown_angle(&self.state);
        }
        self.wipers.iter().sum::<f64>() / self.wipers.len() as f64
    }

    /// The shown angle at another time: cubic Hermite between what was kept; before the start, the start.
    fn at(&self, time: f64) -> f64 {
        let after = self.past.partition_point(|(t, ..)| *t <= time);
        match (after.checked_sub(1).and_then(|n| self.past.get(n)), self.past.get(after)) {
            (Some(&(t0, a0, w0)), Some(&(t1, a1, w1))) => {
                let h = t1 - t0;
                let s = (time - t0) / h;
                let (s2, s3) = (s * s, s * s * s);
                a0 * (2.0 * s3 - 3.0 * s2 + 1.0)
                    + w0 * h * (s3 - 2.0 * s2 + s)
                    + a1 * (3.0 * s2 - 2.0 * s3)
                    + w1 * h * (s3 - s2)
            }
            (Some(&(_, a, _)), None) | (None, Some(&(_, a, _))) => a,
            (None, None) => 0.0,
        }
    }
}

/// What the recording holds of a motion.
fn read(sensor: &Sensor, motion: &Motion, t_s: Vec<f64>, drives: &[Drive], rng: &mut Pcg64) -> Run {
    let mut noise = Source::new(sensor.kind);
    let mut run = Run {
        drive: drives.to_vec(),
        reading: Vec::with_capacity(t_s.len()),
        clean: Vec::with_capacity(t_s.len()),
        blind: Vec::with_capacity(t_s.len()),
        current: sensor.current_noise.map(|_| Vec::with_capacity(t_s.len())),
        t_s,
    };
    let (mut lost, mut holds) = (0.0, false);
    for (tick, &(shown_now, speed, current)) in motion.at_readings.iter().enumerate() {
        let now = run.t_s[tick];
        let dt = if tick == 0 { 0.0 } else { now - run.t_s[tick - 1] };
        let jitter: f64 = StandardNormal.sample(rng);
        let (shown, expected) = if sensor.delay > 0.0 || sensor.drift != 0.0 {
            let age = sensor.age(now);
            (motion.at(now - (age + sensor.delay_jitter * jitter)), motion.at(now - age))
        } else {
            (shown_now, shown_now)
        };
        if let Some(skip) = sensor.skip
            && speed.abs() > skip.above
            && rng.random_range(0.0..1.0) < skip.per_s * dt
        {
            lost += skip.rad.copysign(speed);
        }
        let bent = |angle: f64| angle - lost + sensor.nonlinearity(angle);
        let (mut reading, mut clean) = (sensor.read(bent(shown), noise.next(dt, speed, rng)), bent(expected));
        if let (Some(held), Some(&before), Some(&clean_before)) = (sensor.held, run.reading.last(), run.clean.last()) {
            let chance = if holds { 1.0 - 1.0 / held.burst } else { held.share / (held.burst * (1.0 - held.share)) };
            holds = rng.random_range(0.0..1.0) < if held.burst == 1.0 { held.share } else { chance };
            reading = if holds { before } else { reading };
            // What is read on average, whichever reading it is that repeats.
            clean = (1.0 - held.share) * clean + held.share * clean_before;
        }
        run.reading.push(reading);
        run.clean.push(clean);
        run.blind.push(sensor.blind(expected));
        if let (Some(list), Some(noise)) = (&mut run.current, sensor.current_noise) {
            let draw: f64 = StandardNormal.sample(rng);
            list.push(((current + noise * draw) * 1e4).round() / 1e4);
        }
    }
    run
}
