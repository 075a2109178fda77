//! On recordings of rigs whose numbers are not the file's, with effects that the file may not have, and with mistakes made on
//! purpose. Every right one must be passed, every mistake be said.

use std::f64::consts::TAU;
use std::path::Path;

use control::Actuation;
use effects::{CoulombFriction, DriverDrop, GravityTilt, StribeckFriction};
use hal_sim::SimulatedRobot;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use recording::{AngleReading, Drive, Recording};
use robot_file::robot::{Quantity, Robot, Sensor};

use super::*;

/// Robot files that the sets are made for.
const FILES: [&str; 4] = ["bench-linear", "motor-136", "bench-xl330", "../robot"];

fn file(name: &str) -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../robots/{name}.toml"))).unwrap()
}

/// A rig to be recorded, and how.
struct Rig {
    robot: Robot,
    rate_hz: f64,
    /// Readings of the file's own sensor, or of one of this many bits with noise (rad), its colour (1: white) and blind arc.
    sensor: Option<Reading>,
    kind: usize,
    runs: usize,
    seconds: f64,
}

#[derive(Clone, Copy, Debug)]
struct Reading {
    bits: i32,
    noise: f64,
    colour: f64,
    blind: f64,
    wrapped: bool,
}

const FINE: Reading = Reading { bits: 14, noise: 1e-3, colour: 1.0, blind: 0.0, wrapped: false };

impl Rig {
    fn of(robot: Robot) -> Self {
        Self { robot, rate_hz: 1000.0, sensor: Some(FINE), kind: 1, runs: 3, seconds: 8.0 }
    }

    /// Runs in which the shaft turns for a third of the time, at 3 % of its highest speed or more: one that its friction
    /// holds is no recording of a motor.
    fn record(&self, seed: u64) -> Vec<Recording> {
        let highest = self.robot.supply.rail_v.value / self.robot.motor.torque_constant_nm_per_a.value;
        let turns = |run: &Recording, truth: &[f64]| {
            let step = run.t_s[1] - run.t_s[0];
            let moving = truth.windows(2).filter(|pair| (pair[1] - pair[0]).abs() > 0.03 * highest * step).count();
            3 * moving > truth.len()
        };
        let mut runs = Vec::new();
        for attempt in 0..8 {
            let (run, truth) = self.run(seed * 100 + attempt);
            runs.extend(Some(run).filter(|run| turns(run, &truth)));
            if runs.len() == self.runs {
                break;
            }
        }
        runs
    }

    fn run(&self, seed: u64) -> (Recording, Vec<f64>) {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut robot = self.robot.clone();
        let tick_s = (1.0 / self.rate_hz).min(1e-3);
        let every = (1.0 / self.rate_hz / tick_s).round() as usize;
        match &mut robot.controller {
            Some(controller) => controller.tick_s.value = tick_s,
            None => assert!(every as f64 * tick_s <= 1.0 / self.rate_hz + 1e-9),
        }
        let mut world = SimulatedRobot::new(&robot, seed);
        let tick_s = world.tick_s();
        let drive = Excitation::new(self.kind, least_duty(&self.robot), &mut random);
        let mut reader = Reader { reading: self.sensor, coloured: 0.0 };
        let mut out = Recording::default();
        let (mut duties, mut angles, mut codes, mut truths) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for row in 0..(self.seconds * self.rate_hz) as usize {
            let t_s = row as f64 * every as f64 * tick_s;
            let truth = world.truth();
            let (duty, enable) = drive.at(t_s, truth.angle);
            out.t_s.push(t_s);
            truths.push(truth.angle);
            out.enable.push(enable);
            duties.push(duty);
            angles.push(reader.read(truth.angle, &mut random));
            codes.push(Some(world.sample().angle.0));
            for tick in 0..every {
                if tick > 0 {
                    let _ = world.sample();
                }
                world.advance(Actuation { duty: duty as f32, enable });
            }
        }
        let has_codes = self.sensor.is_none() && matches!(robot.sensor, Sensor::Potentiometer(_));
        out.angle = if has_codes { AngleReading::Adc(codes) } else { AngleReading::Angle(angles) };
        out.drive = Drive::Duty(duties);
        (out, truths)
    }
}

struct Reader {
    reading: Option<Reading>,
    coloured: f64,
}

impl Reader {
    fn read(&mut self, angle: f64, random: &mut Pcg64Mcg) -> Option<f64> {
        let one = self.reading.unwrap_or(FINE);
        let white: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
        let innovation = one.noise * (2.0 * one.colour - one.colour * one.colour).sqrt();
        self.coloured += innovation * white - one.colour * self.coloured;
        let step = TAU / f64::from(one.bits).exp2();
        let read = ((angle + self.coloured) / step).round() * step;
        let blind = common::wrap(angle).abs() < 0.5 * one.blind;
        (!blind).then_some(if one.wrapped { common::wrap(read) } else { read })
    }
}

/// How a rig is driven.
struct Excitation {
    kind: usize,
    levels: Vec<f64>,
    phases: Vec<f64>,
    hold_s: f64,
    size: f64,
    /// Whoever records a rig drives it so that it turns.
    least: f64,
}

/// Duty at which friction and driver let a shaft turn.
fn least_duty(robot: &Robot) -> f64 {
    let motor = &robot.motor;
    let friction = robot.effects.get::<CoulombFriction>().map_or(0.0, |friction| friction.torque_nm);
    let drop = robot.effects.get::<DriverDrop>().map_or(0.0, |drop| drop.drop_v);
    let volts = drop + friction * motor.resistance_ohm.value / motor.torque_constant_nm_per_a.value;
    (1.1 * volts / robot.supply.rail_v.value).min(0.9)
}

impl Excitation {
    fn new(kind: usize, least: f64, random: &mut Pcg64Mcg) -> Self {
        Self {
            kind,
            levels: (0..400).map(|_| random.random_range(-1.0..1.0)).collect(),
            phases: (0..4).map(|_| random.random_range(0.0..TAU)).collect(),
            hold_s: random.random_range(0.1..0.6),
            size: random.random_range(0.8..1.0),
            least,
        }
    }

    /// Duty, and whether the bridge drives.
    fn at(&self, t: f64, angle: f64) -> (f64, bool) {
        let place = (t / self.hold_s) as usize % self.levels.len();
        let level = self.levels[place];
        let duty = match self.kind {
            0 => (0..4).map(|i| 0.35 * (TAU * [0.3, 0.9, 2.1, 4.3][i] * t + self.phases[i]).sin()).sum::<f64>(),
            1 | 2 => self.size * level,
            3 => self.size * (TAU * (0.2 + 0.4 * t) * t).sin(),
            // Steps of the duty that leave the driver's drop behind by little.
            5 => 0.35 * level,
            // A servo that is told where to go.
            _ => 2.0 * (4.0 * level - angle),
        };
        let duty = duty.clamp(-1.0, 1.0);
        let duty = (self.least + (1.0 - self.least) * duty.abs()).copysign(duty);
        (duty, self.kind != 2 || self.levels[place + 1 - 2 * (place % 2)] > -0.5)
    }
}

fn number(value: f64) -> Quantity {
    Quantity { value, low: 0.5 * value, high: 2.0 * value, source: "test".into() }
}

fn scale(quantity: &mut Quantity, factor: f64) {
    quantity.value *= factor;
}

/// The file's rig with its numbers off by up to a share, and an effect that the file may not have.
fn off(file: &Robot, share: f64, random: &mut Pcg64Mcg) -> Robot {
    let mut robot = file.clone();
    let mut factor = || 1.0 + share * random.random_range(-1.0..1.0);
    let motor = &mut robot.motor;
    scale(&mut motor.torque_constant_nm_per_a, factor());
    scale(&mut motor.resistance_ohm, factor());
    let inertia = factor();
    scale(&mut motor.rotor_inertia_kg_m2, inertia);
    scale(&mut robot.load.inertia_kg_m2, inertia);
    scale(&mut motor.viscous_nm_s_per_rad, factor());
    let stall =
        robot.motor.torque_constant_nm_per_a.value / robot.motor.resistance_ohm.value * robot.supply.rail_v.value;
    let has_friction = robot.effects.listed().any(|id| id.name().ends_with("friction"));
    match random.random_range(0..5) {
        0 if !has_friction => robot.effects.insert::<CoulombFriction>(vec![number(0.1 * stall), number(0.3)]),
        1 if !has_friction => {
            let quantities = vec![number(0.08 * stall), number(0.08 * stall), number(3.0), number(0.3)];
            robot.effects.insert::<StribeckFriction>(quantities);
        }
        2 => robot.effects.insert::<GravityTilt>(vec![number(0.1 * stall), number(40.0)]),
        3 if robot.effects.get::<DriverDrop>().is_none() => {
            robot.effects.insert::<DriverDrop>(vec![number(0.1 * robot.supply.rail_v.value), number(0.0), number(0.3)]);
        }
        _ => {}
    }
    robot
}

/// What is done to a right set.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mistake {
    Reversed,
    Degrees,
    Turns,
    Counts,
    Milliseconds,
    Microseconds,
    Percent,
    Pwm,
    Volts,
    VoltageIsDuty,
    MillisecondsAndDegrees,
    Supply,
    OtherMotor,
    OtherLoad,
}

const MISTAKES: [Mistake; 14] = [
    Mistake::Reversed,
    Mistake::Degrees,
    Mistake::Turns,
    Mistake::Counts,
    Mistake::Milliseconds,
    Mistake::Microseconds,
    Mistake::Percent,
    Mistake::Pwm,
    Mistake::Volts,
    Mistake::VoltageIsDuty,
    Mistake::MillisecondsAndDegrees,
    Mistake::Supply,
    Mistake::OtherMotor,
    Mistake::OtherLoad,
];

fn turn_angles(run: &mut Recording, change: impl Fn(f64) -> f64) {
    let AngleReading::Angle(cells) = &mut run.angle else { panic!("angles") };
    cells.iter_mut().for_each(|cell| *cell = cell.map(&change));
}

fn turn_drive(run: &mut Recording, change: impl Fn(f64) -> f64) {
    let Drive::Duty(duty) = &mut run.drive else { panic!("duty") };
    duty.iter_mut().for_each(|duty| *duty = change(*duty));
}

impl Mistake {
    /// Done to the rig before it is recorded.
    fn to_rig(self, rig: &mut Rig) {
        let robot = &mut rig.robot;
        match self {
            // 12 V in place of 3.3: less than twice is what a torque constant makes that is half of the file's.
            Self::Supply => robot.supply.rail_v.value *= 12.0 / 3.3,
            // The rig of another file.
            Self::OtherMotor => {
                let other =
                    if matches!(robot.name.as_str(), "scram-136" | "bench-xl330") { FILES[0] } else { FILES[1] };
                *robot = off(&file(other), 0.3, &mut Pcg64Mcg::seed_from_u64(rig.kind as u64));
            }
            Self::OtherLoad => {
                scale(&mut robot.motor.rotor_inertia_kg_m2, 40.0);
                scale(&mut robot.load.inertia_kg_m2, 40.0);
            }
            _ => {}
        }
    }

    /// Done to its recordings.
    fn to_runs(self, file: &Robot, runs: &mut [Recording]) {
        let rail_v = file.supply.rail_v.value;
        let counts = match &file.sensor {
            Sensor::Encoder(encoder) => encoder.counts_per_turn.value,
            _ => 4096.0,
        };
        for run in runs {
            let times = |run: &mut Recording, factor: f64| run.t_s.iter_mut().for_each(|t| *t *= factor);
            match self {
                Self::Reversed => turn_angles(run, |angle| -angle),
                Self::Degrees => turn_angles(run, f64::to_degrees),
                Self::Turns => turn_angles(run, |angle| angle / TAU),
                Self::Counts => turn_angles(run, |angle| (angle / TAU * counts).round()),
                Self::Milliseconds => times(run, 1e3),
                Self::Microseconds => times(run, 1e6),
                Self::Percent => turn_drive(run, |duty| 100.0 * duty),
                Self::Pwm => turn_drive(run, |duty| (255.0 * duty).round()),
                Self::Volts => turn_drive(run, |duty| rail_v * duty),
                Self::VoltageIsDuty => {
                    let Drive::Duty(duty) = std::mem::take(&mut run.drive) else { panic!("duty") };
                    run.drive = Drive::Voltage(duty);
                }
                Self::MillisecondsAndDegrees => {
                    turn_angles(run, f64::to_degrees);
                    times(run, 1e3);
                }
                Self::Supply | Self::OtherMotor | Self::OtherLoad => {}
            }
        }
    }

    /// What a file's own ranges explain is no mistake: of the XL330 R is 2 … 6 Ω, J 5 … 14 g·m² and b up to 0.1, which make a
    /// shaft that is six times slower, or three times faster.
    fn is_within_spread_of(self, file: &Robot) -> bool {
        file.name == "bench-xl330" && matches!(self, Self::Turns | Self::Supply)
    }

    /// Whether an explanation is this mistake.
    fn is(self, causes: &[Cause]) -> bool {
        let has = |wanted: &dyn Fn(&Cause) -> bool| causes.iter().any(wanted);
        let angle = |unit: &str| has(&|cause| matches!(cause, Cause::AngleUnit(name) if name.starts_with(unit)));
        let time = |unit: &str| has(&|cause| matches!(cause, Cause::TimeUnit(name) if name == unit));
        let only = causes.len() == 1;
        match self {
            Self::Reversed => has(&|cause| *cause == Cause::ReversedSign),
            Self::Degrees => only && angle("deg"),
            Self::Turns => only && angle("turns"),
            Self::Counts => only && angle("counts"),
            Self::Milliseconds => only && time("ms"),
            Self::Microseconds => only && time("us"),
            Self::Percent => only && has(&|cause| *cause == Cause::DutyFullScale(100.0)),
            Self::Pwm => only && has(&|cause| *cause == Cause::DutyFullScale(255.0)),
            Self::Volts => only && has(&|cause| *cause == Cause::DutyInVolts),
            Self::VoltageIsDuty => only && has(&|cause| *cause == Cause::VoltageIsDuty),
            Self::MillisecondsAndDegrees => angle("deg") && time("ms"),
            Self::Supply => only && has(&|cause| matches!(cause, Cause::Supply(_))),
            Self::OtherMotor => only && has(&|cause| matches!(cause, Cause::TorqueConstant(_))),
            Self::OtherLoad => only && has(&|cause| matches!(cause, Cause::TimeConstant(_))),
        }
    }
}

/// A rig that a file describes as well as people's files do, and recordings of it, made in one of many ways.
fn drawn(file: &Robot, mistake: Option<Mistake>, seed: u64, random: &mut Pcg64Mcg) -> (Rig, Vec<Recording>) {
    for _ in 0..20 {
        let mut rig = drawn_once(file, random);
        if let Some(mistake) = mistake {
            mistake.to_rig(&mut rig);
        }
        let runs = rig.record(seed);
        if runs.len() == rig.runs {
            return (rig, runs);
        }
    }
    panic!("no rig of {} turns", file.name)
}

fn drawn_once(file: &Robot, random: &mut Pcg64Mcg) -> Rig {
    let share = random.random_range(0.1..0.5);
    let mut rig = Rig::of(off(file, share, random));
    let with_controller = rig.robot.controller.is_some();
    rig.kind = random.random_range(0..5);
    let rates: &[f64] = if with_controller { &[100.0, 250.0, 1000.0, 5000.0] } else { &[100.0, 250.0, 1000.0] };
    rig.rate_hz = rates[random.random_range(0..rates.len())];
    let fast = rig.rate_hz >= 500.0;
    rig.sensor = Some(Reading {
        bits: [10, 12, 14][random.random_range(0..3)],
        noise: [1e-3, 5e-3, 2e-2][random.random_range(0..3)],
        colour: [1.0, 0.2][random.random_range(0..2)],
        blind: if fast { [0.0, 0.5][random.random_range(0..2)] } else { 0.0 },
        wrapped: fast && random.random_range(0..2) == 0,
    });
    rig
}

/// A set with a mistake, checked: the mistake, what is said, and whether it is among the mends.
fn wrong(seed: u64) -> (String, RigCheck, bool) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mistake = MISTAKES[seed as usize % MISTAKES.len()];
    let mut file = file(FILES[random.random_range(0..FILES.len())]);
    if mistake.is_within_spread_of(&file) {
        file = self::file(FILES[0]);
    }
    let (rig, mut runs) = drawn(&file, Some(mistake), seed, &mut random);
    mistake.to_runs(&file, &mut runs);
    let check = check_rig(&file, &runs);
    let said = check.findings.iter().flat_map(|finding| &finding.mends).any(|mend| mistake.is(&mend.causes));
    (format!("{mistake:?} on {} at {} Hz, kind {}", file.name, rig.rate_hz, rig.kind), check, said)
}

/// A right set, checked.
fn right(seed: u64) -> (String, RigCheck) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let file = file(FILES[random.random_range(0..FILES.len())]);
    let (rig, runs) = drawn(&file, None, seed, &mut random);
    let words = format!("{} at {} Hz, kind {}", file.name, rig.rate_hz, rig.kind);
    (words, check_rig(&file, &runs))
}

fn words(check: &RigCheck) -> String {
    let one = |finding: &Finding| {
        let mends: Vec<String> = finding.mends.iter().map(|mend| format!("{:?}", mend.causes)).collect();
        format!("{}: {} → {}", finding.problem, finding.evidence, mends.join(" | "))
    };
    let said: Vec<String> = check.findings.iter().map(one).collect();
    format!("{} [unchecked: {}]", said.join(" // "), check.unchecked.join(", "))
}

/// Sets of a campaign, from a first seed. Of 84 wrong and 84 right ones from 271828182 on, which nothing was tuned with, all are said
/// and all pass; of those from 1000 on, which it was tuned with, 82 and 84.
fn campaign(first: u64, count: u64) -> (u64, u64, u64, u64) {
    let (mut found, mut named, mut silent, mut unchecked) = (0, 0, 0, 0);
    for seed in first..first + count {
        let (what, check, is_named) = wrong(seed);
        found += u64::from(!check.findings.is_empty());
        named += u64::from(is_named);
        if !is_named {
            eprintln!("seed {seed}, {what}: {}", words(&check));
        }
        let (what, check) = right(seed);
        silent += u64::from(check.findings.is_empty());
        unchecked += u64::from(!check.unchecked.is_empty());
        if !check.findings.is_empty() {
            eprintln!("seed {seed}, right, {what}: {}", words(&check));
        }
    }
    eprintln!(
        "seeds {first}…: of {count} wrong sets {found} are found, {named} with the mend; of {count} right ones {silent} pass, {unchecked} of them in part"
    );
    (found, named, silent, unchecked)
}

#[test]
fn mistakes_are_said_with_their_mend_and_right_sets_pass() {
    let first = std::env::var("RIG_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(271_828_182);
    let count = std::env::var("RIG_COUNT").ok().and_then(|count| count.parse().ok()).unwrap_or(42);
    let (found, named, silent, _) = campaign(first, count);
    assert_eq!((found, named, silent), (count, count, count));
}

/// The set of a mistake on a rig whose numbers are up to a fifth off.
fn said(file_name: &str, mistake: Mistake) -> RigCheck {
    let file = file(file_name);
    let mut rig = Rig::of(off(&file, 0.2, &mut Pcg64Mcg::seed_from_u64(4)));
    mistake.to_rig(&mut rig);
    let mut runs = rig.record(5);
    assert_eq!(runs.len(), 3, "{file_name}, {mistake:?}: the shaft turns");
    mistake.to_runs(&file, &mut runs);
    check_rig(&file, &runs)
}

/// [`mistakes_are_said_with_their_mend_and_right_sets_pass`] makes them with the bench's motor.
#[test]
#[ignore = "two minutes: .ci/long"]
fn every_mistake_is_said_of_another_motor_too() {
    for mistake in MISTAKES {
        let check = said("motor-136", mistake);
        let is_said = check.findings.iter().flat_map(|finding| &finding.mends).any(|mend| mistake.is(&mend.causes));
        assert!(is_said, "{mistake:?}: {}", words(&check));
        assert!(check.findings.iter().all(|finding| !finding.evidence.is_empty()), "{}", words(&check));
    }
}

#[test]
fn mends_name_the_line_and_the_value() {
    let check = said("bench-linear", Mistake::Reversed);
    assert!(check.findings[0].mend().contains("--map angle=-COLUMN:UNIT"), "{}", check.findings[0].mend());
    let check = said("bench-linear", Mistake::Degrees);
    assert!(check.findings[0].mend().contains("--map angle=COLUMN:deg"), "{}", check.findings[0].mend());
    let check = said("bench-linear", Mistake::Milliseconds);
    assert!(check.findings[0].mend().contains("--map time=COLUMN:ms"), "{}", check.findings[0].mend());
    // The rig of another file: its torque constant is 0.105 N·m/A, up to a third off.
    let check = said("bench-linear", Mistake::OtherMotor);
    let mends = check.findings.iter().flat_map(|finding| &finding.mends);
    let constants: Vec<f64> = mends
        .filter_map(|mend| match mend.causes[..] {
            [Cause::TorqueConstant(k)] => {
                assert_eq!(mend.field.as_deref(), Some("motor.torque_constant_nm_per_a"));
                Some(k)
            }
            _ => None,
        })
        .collect();
    assert!(constants.len() == 1 && (0.05..0.22).contains(&constants[0]), "{constants:?}");
    let check = said("bench-linear", Mistake::Supply);
    let supply = check.findings[0].mends.iter().find(|mend| mend.field.as_deref() == Some("supply.rail_v"));
    let supply = supply.expect("a line for the supply");
    // 5 V · 12/3.3, seen by a torque constant that is up to a fifth off.
    let [Cause::Supply(volts)] = supply.causes[..] else { panic!("{supply:?}") };
    assert!((volts / 18.2 - 1.0).abs() < 0.25, "{volts} V");
    assert!(supply.change.contains(&format!("supply.rail_v = {{ value = {volts:.1}, … }}")), "{}", supply.change);
}

#[test]
fn a_reading_that_is_wrapped_names_its_unit() {
    for (turn, unit) in [(360.0, "deg"), (1.0, "turns"), (4096.0, "counts/4096")] {
        let file = file("bench-linear");
        let mut rig = Rig::of(off(&file, 0.2, &mut Pcg64Mcg::seed_from_u64(4)));
        rig.sensor = Some(Reading { wrapped: true, ..FINE });
        let mut runs = rig.record(6);
        runs.iter_mut().for_each(|run| turn_angles(run, |angle| angle / TAU * turn));
        let check = check_rig(&file, &runs);
        let causes = &check.findings[0].mends[0].causes;
        assert_eq!(causes, &[Cause::AngleUnit(unit.to_owned())], "{}", words(&check));
    }
}

#[test]
fn a_measured_supply_that_the_file_does_not_have_is_said_once() {
    let file = file("bench-linear");
    let mut runs = Rig::of(file.clone()).record(7);
    runs.iter_mut().for_each(|run| run.supply_v = vec![12.0; run.t_s.len()]);
    let check = check_rig(&file, &runs);
    assert_eq!(check.findings[0].mends[0].causes, [Cause::Supply(12.0)]);
    assert_eq!(check.findings.iter().filter(|finding| finding.problem.contains("measured supply")).count(), 1);
}

/// While the drive is within a drop of the back EMF no current flows, and the shaft coasts: it looks like one with a heavier load.
#[test]
fn a_driver_that_takes_volts_is_no_heavier_load() {
    let file = file("bench-linear");
    let mut robot = file.clone();
    robot.effects.insert::<DriverDrop>(vec![number(0.8), number(0.0), number(0.0)]);
    let sensor = Some(Reading { noise: 8e-3, bits: 12, ..FINE });
    let rig = Rig { kind: 5, runs: 2, sensor, ..Rig::of(robot) };
    for seed in 1..=40 {
        let check = check_rig(&file, &rig.record(seed));
        assert_eq!(check.findings, [], "seed {seed}: {}", words(&check));
    }
}

/// The firmware in the loop, on a rig that is not the file's: steady speeds, swings, an uncalibrated potentiometer.
#[test]
fn closed_loops_of_another_specimen_pass() {
    use simulation::{Drive as Orders, Plan, recording, run};
    for (name, drives) in [
        ("../robot", ["freq:7", "oscillate:-100..100", "duty:0.9"]),
        ("motor-136", ["freq:3", "oscillate:-100..100", "duty:-1"]),
        ("bench-linear", ["freq:7", "oscillate:-60..60", "duty:0.5"]),
    ] {
        let file = file(name);
        let mut rig = file.clone();
        scale(&mut rig.motor.torque_constant_nm_per_a, 0.75);
        scale(&mut rig.motor.rotor_inertia_kg_m2, 1.4);
        for drive in drives {
            let plan = Plan { drive: Orders::parse(drive).unwrap(), seconds: 4.0, faults: Vec::new() };
            let trace = run(&rig, 3, &hal_sim::Settings::default(), &plan).unwrap();
            let check = check_rig(&file, &[recording(&trace, &rig)]);
            assert_eq!(check.findings, [], "{name}, {drive}: {}", words(&check));
        }
    }
}

#[test]
fn what_no_motion_can_be_read_from_is_unchecked_and_no_finding() {
    let file = file("bench-linear");
    let mut runs = Rig::of(file.clone()).record(8);
    runs.iter_mut().for_each(|run| run.enable.truncate(3));
    let check = check_rig(&file, &runs);
    assert_eq!((check.findings.len(), check.unchecked.len(), check.unreadable.len()), (0, 0, runs.len()), "{check:?}");
    assert!(check.unreadable.iter().all(|one| one.contains("different lengths")), "{check:?}");
    assert_eq!(check_rig(&file, &[]), RigCheck::default());
    let still = Recording {
        t_s: (0..500).map(|row| f64::from(row) * 1e-3).collect(),
        enable: vec![true; 500],
        drive: Drive::Duty(vec![0.0; 500]),
        angle: AngleReading::Angle(vec![Some(0.3); 500]),
        ..Recording::default()
    };
    let check = check_rig(&file, &[still]);
    assert_eq!((check.findings.len(), check.unchecked.len()), (0, 2), "{}", words(&check));
}
