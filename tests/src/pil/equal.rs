//! A minute of scripted drive in which everything happens.

use std::path::Path;

use control::gait::MOST_STEPS;
use control::parameters::{AngleSource, BlindArcHandling, SpeedLaw};
use control::{Command, Parameters, Stroke};
use hal_sim::Fault;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use robot_file::gait::GaitStep;
use scram::hil::{HilError, Qemu, Remote};
use simulation::{Break, Drive, DriveCommand, Plan, Scheduled, Step};

use super::bits::Compared;
use super::cost::{Robots, gait};
use super::course::{Course, Disturbance, run};

/// Rest, every frequency both ways, both strokes, positions, open loop, running out: 24 s.
const DRIVE: &str = "
idle
0.5 freq 6
2.5 freq -6
4.5 freq 7
6 freq -7
7.5 freq 8
9 freq -8
10.5 coast
11 oscillate -100..100
13.5 oscillate -100..100 proportional
16 oscillate 150..400
17.5 position 90
18.5 position -170
19.5 position 0
20.5 duty 0.8
21.5 duty -0.3
22.5 idle
23 freq 3
wait 1
";
/// What is driven while something breaks or garbage comes.
const DISTURBED: &str = "freq 8\n0.7 oscillate -100..100\nwait 0.8\n";

/// The minute: a healthy run, gaits, one with each fault, and garbage.
#[must_use]
pub fn minute(robots: &Robots) -> Vec<Course> {
    let drive = |text: &str| Drive::parse_script(text, Path::new("script")).unwrap_or_else(|error| panic!("{error}"));
    let healthy = Course {
        parameters: robots.calibrated,
        plan: Plan { drive: drive(DRIVE), seconds: 24.0, faults: Vec::new() },
        seed: 1,
        disturbances: Vec::new(),
    };
    let breaks = Fault::ALL.iter().map(|fault| Break::Robot(*fault)).chain([Break::Link]).cycle().take(16);
    let broken = breaks.enumerate().map(|(index, what)| Course {
        parameters: if index % 2 == 0 { robots.uncalibrated } else { robots.calibrated },
        plan: Plan {
            drive: drive(DISTURBED),
            seconds: 1.0,
            faults: vec![Scheduled { at_s: 0.25 + 0.03 * index as f64, what }],
        },
        seed: 2 + index as u64,
        // Its cause still there or not: cleared, and on.
        disturbances: vec![
            (850, Disturbance::Command(Command::ClearFault, 0)),
            (860, Disturbance::Command(Command::Speed { omega: -40.0 }, 0)),
        ],
    });
    // A gait of the most steps, whole and over its end, one that repeats, and the stored one again.
    let steps_hz: Vec<f64> = (0..MOST_STEPS).map(|step| [8.0, -7.0, 6.5, -6.0][step * step % 7 % 4]).collect();
    let (whole, repeats) = (gait(0.01, &steps_hz, false), gait(0.04, &[7.0, 7.0, -7.0], true));
    let swing = |from, to| GaitStep::Oscillation([from, to]);
    let swings = gait(0.25, &[swing(-45.0, 105.0), swing(60.0, 180.0), GaitStep::Frequency(-8.0)], true);
    let step = |at_s: f64, command: DriveCommand| Step { at_s, command };
    let gaits = Course {
        parameters: robots.calibrated,
        plan: Plan {
            drive: Drive {
                steps: vec![
                    step(0.1, whole),
                    step(3.0, repeats),
                    step(4.0, DriveCommand::Idle),
                    step(4.5, DriveCommand::Freq { hz: 7.0 }),
                    step(5.0, repeats),
                    step(5.5, whole),
                    step(6.0, DriveCommand::Idle),
                    step(6.1, swings),
                ],
                end_s: None,
            },
            seconds: 8.0,
            faults: Vec::new(),
        },
        seed: 50,
        disturbances: Vec::new(),
    };
    let garbage = (0..20).map(|index: u64| Course {
        parameters: unusual(robots, index),
        plan: Plan { drive: drive(DISTURBED), seconds: 1.0, faults: Vec::new() },
        seed: 100 + index,
        disturbances: garbage(&mut Pcg64::seed_from_u64(index), 1000),
    });
    [healthy, gaits].into_iter().chain(broken).chain(garbage).collect()
}

/// Every branch that parameters choose.
fn unusual(robots: &Robots, index: u64) -> Parameters {
    let mut parameters = if index.is_multiple_of(2) { robots.calibrated } else { robots.uncalibrated };
    match index % 5 {
        1 => parameters.speed.law = SpeedLaw::Thesis,
        2 => parameters.position.source = AngleSource::MovingAverage,
        3 => parameters.estimator.handling = BlindArcHandling::None,
        _ => {}
    }
    parameters
}

/// Codes, times, missed ticks and commands of any kind.
pub fn garbage(random: &mut Pcg64, ticks: usize) -> Vec<(usize, Disturbance)> {
    let mut disturbances = Vec::new();
    let mut tick = 0;
    loop {
        tick += random.random_range(1..20);
        if tick >= ticks {
            return disturbances;
        }
        disturbances.push((tick, any(random)));
    }
}

fn any(random: &mut Pcg64) -> Disturbance {
    match random.random_range(0..12) {
        0..=2 => Disturbance::Angle(random.random()),
        3 | 4 => Disturbance::Angle(random.random_range(0..4096)),
        5 => Disturbance::Battery(random.random()),
        6 => Disturbance::Late(random.random_range(-1500..1500)),
        7 | 8 => Disturbance::Miss(random.random_range(1..24)),
        9 => Disturbance::Time(match random.random_range(0..4) {
            0 => random.random(),
            1 => u64::MAX,
            2 => 0,
            _ => random.random_range(0..2_000_000),
        }),
        _ => Disturbance::Command(command(random), random.random_range(-300_000..300_000)),
    }
}

fn command(random: &mut Pcg64) -> Command {
    let mut number = |scale: f32| match random.random_range(0..8) {
        // Any bits: infinities, subnormal numbers and NaN with any payload among them.
        0 => f32::from_bits(random.next_u32()),
        1 => f32::NAN,
        _ => random.random_range(-scale..scale),
    };
    let (one, other) = (number(60.0), number(7.0));
    match random.random_range(0..9) {
        0 => Command::Idle,
        1 => Command::Coast,
        2 => Command::ClearFault,
        3 => Command::Position { angle: other },
        4 => Command::Duty { duty: number_within(random) },
        5 => Command::Oscillate { from: other, to: one / 10.0, style: Stroke::Proportional },
        7 => Command::Gait { id: random.next_u32() },
        6 => Command::Oscillate { from: -other.abs(), to: other.abs(), style: Stroke::BangBang },
        _ => Command::Speed { omega: one },
    }
}

fn number_within(random: &mut Pcg64) -> f32 {
    random.random_range(-1.2..1.2)
}

/// Runs the minute; what was compared.
///
/// # Errors
/// The link to the chip fails.
pub fn compare(robots: &Robots, chip: &mut Remote<Qemu>) -> Result<Compared, HilError> {
    let mut compared = Compared::default();
    for course in minute(robots) {
        compared.add(run(&robots.robot, &course, chip)?.compared);
    }
    Ok(compared)
}
