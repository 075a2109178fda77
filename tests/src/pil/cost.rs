//! What a tick costs: scenarios, each with a budget a little above what was measured when it was set. What is required
//! of them all is 40 000 instructions, a quarter of 1 ms at the ESP32-C3's 160 MHz if each took one cycle.

use control::{Parameters, State, Stroke};
use hal_sim::Fault;
use robot_file::design::design;
use robot_file::gait::{GaitFile, GaitStep};
use robot_file::robot::Robot;
use scram::hil::{HilError, Qemu, Remote};
use simulation::{Break, DriveCommand, Plan, Scheduled};

use super::course::{Course, Disturbance, Outcome, Ran, run};
use crate::figures::calibration::calibrate;
use crate::figures::run::{DesignedRobot, plan, swing};

/// What a scenario may cost, instructions.
pub struct Scenario {
    /// What is done.
    pub what: &'static str,
    /// Most that a tick may take.
    pub budget: u32,
    courses: fn(&Robots) -> Vec<Course>,
    /// The ticks that it is about.
    counts: fn(&Ran) -> bool,
}

/// The default robot and what its controller may know about it.
pub struct Robots {
    /// The robot.
    pub robot: Robot,
    /// Designed from the file as it is.
    pub uncalibrated: Parameters,
    /// Designed from the file with an identified correction of the sensor.
    pub calibrated: Parameters,
}

impl Robots {
    /// From the project's robot.toml.
    ///
    /// # Panics
    /// When the robot of that file cannot be calibrated.
    #[must_use]
    pub fn new() -> Self {
        let bench = DesignedRobot::new();
        let (calibrated, _) = calibrate(&bench, 1).expect("seed 1 can be calibrated");
        let calibrated = design(&calibrated).unwrap_or_else(|error| panic!("{error}")).parameters;
        Self { robot: bench.robot, uncalibrated: bench.parameters, calibrated }
    }
}

impl Default for Robots {
    fn default() -> Self {
        Self::new()
    }
}

/// A row of the table.
#[derive(Clone, Debug)]
pub struct Cost {
    /// What was done.
    pub what: &'static str,
    /// Ticks that count.
    pub ticks: usize,
    /// Instructions in the middle; `None` where ticks of every kind are among them.
    pub median: Option<u32>,
    /// Most instructions.
    pub worst: u32,
    /// Most that is allowed.
    pub budget: u32,
    /// Deepest stack, bytes.
    pub stack: u32,
}

impl Cost {
    /// Whether it was measured and is within its budget.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.ticks > 0 && self.worst <= self.budget
    }
}

/// Most that any tick may take that a search finds, instructions.
pub const SEARCH_BUDGET: u32 = 35_000;
/// Most stack of a tick, bytes. Two sensors' readings and what they say of each other go through a tick.
pub const STACK_BUDGET: u32 = 560;
/// Most RAM of a controller, bytes: 256 of them are the map of a second sensor, which a robot with one has room for, too, and
/// what is known of the two; 64 what the supervisor remembers of heat, progress, missed periods and the check at rest; 240 the gait
/// and where it is played.
pub const RAM_BUDGET: u32 = 1776;

const SEED: u64 = 1;

fn course(parameters: &Parameters, plan: Plan) -> Course {
    Course { parameters: *parameters, plan, seed: SEED, disturbances: Vec::new() }
}

fn tracking(ran: &Ran) -> bool {
    ran.telemetry.tracking && ran.missed == 0
}

/// A gait of these frequencies (Hz) or other steps, each for so long, s.
///
/// # Panics
/// When they are no gait.
#[must_use]
pub fn gait<S: Into<GaitStep> + Copy>(interval_s: f64, steps: &[S], repeat: bool) -> DriveCommand {
    let file = GaitFile::new("pil", interval_s, repeat, steps).unwrap_or_else(|error| panic!("{error}"));
    DriveCommand::Gait(*file.gait())
}

/// A fault for every one that the supervisor knows, in the middle of speed and of oscillation.
fn faults(robots: &Robots) -> Vec<Course> {
    let breaks = Fault::ALL.iter().map(|fault| Break::Robot(*fault)).chain([Break::Link]);
    let commands = [DriveCommand::Freq { hz: 8.0 }, swing(Stroke::BangBang), gait(0.04, &[8.0, 8.0, -8.0], true)];
    breaks
        .flat_map(|what| commands.map(|command| (what, command)))
        .map(|(what, command)| {
            let plan = Plan { faults: vec![Scheduled { at_s: 0.5, what }], ..plan(command, 1.5) };
            course(&robots.calibrated, plan)
        })
        .collect()
}

/// Every number of missed ticks that is caught up with, and one more.
fn missing(robots: &Robots) -> Vec<Course> {
    let commands = [
        DriveCommand::Freq { hz: 8.0 },
        DriveCommand::Freq { hz: -8.0 },
        swing(Stroke::BangBang),
        DriveCommand::Position { deg: 90.0 },
        gait(0.04, &[8.0, 8.0, 8.0, -8.0], true),
    ];
    commands
        .into_iter()
        .map(|command| {
            let disturbances = (1..=20).flat_map(|ticks: u16| {
                (0..5).map(move |again| (500 + 57 * (5 * usize::from(ticks) + again), Disturbance::Miss(ticks)))
            });
            let plan = plan(command, 7.0);
            Course { disturbances: disturbances.collect(), ..course(&robots.calibrated, plan) }
        })
        .collect()
}

/// The scenarios. Heat, progress and the second sensor's absence have added 1300 to 2200 instructions to a tick; a quarter of the
/// period would be 40 000.
pub const SCENARIOS: [Scenario; 12] = [
    Scenario {
        what: "idle",
        budget: 14_500,
        courses: |r| vec![course(&r.calibrated, plan(DriveCommand::Idle, 1.0))],
        counts: |_| true,
    },
    Scenario {
        what: "speed, sensor as it comes",
        budget: 23_000,
        courses: |r| vec![course(&r.uncalibrated, plan(DriveCommand::Freq { hz: 7.0 }, 2.0))],
        counts: tracking,
    },
    Scenario {
        what: "speed, sensor calibrated",
        budget: 27_500,
        courses: |r| vec![course(&r.calibrated, plan(DriveCommand::Freq { hz: 7.0 }, 2.0))],
        counts: tracking,
    },
    Scenario {
        what: "a gait, turned round every 40 ms",
        budget: 28_500,
        courses: |r| {
            let alternating: Vec<f64> = (0..50).map(|step| if step % 2 == 0 { 8.0 } else { -8.0 }).collect();
            [&alternating[..], &[7.0; 50]]
                .map(|steps_hz| course(&r.calibrated, plan(gait(0.04, steps_hz, false), 2.0)))
                .to_vec()
        },
        counts: tracking,
    },
    Scenario {
        what: "a gait of oscillations, another one every 250 ms",
        budget: 30_500,
        courses: |r| {
            let swings = [[-45.0, 105.0], [60.0, 180.0]].map(GaitStep::Oscillation);
            vec![course(&r.calibrated, plan(gait(0.25, &swings, true), 3.0))]
        },
        counts: tracking,
    },
    Scenario {
        what: "oscillator, full voltage",
        budget: 29_500,
        courses: |r| vec![course(&r.calibrated, plan(swing(Stroke::BangBang), 3.0))],
        counts: tracking,
    },
    Scenario {
        what: "oscillator, proportional",
        budget: 27_500,
        courses: |r| vec![course(&r.calibrated, plan(swing(Stroke::Proportional), 3.0))],
        counts: tracking,
    },
    Scenario {
        what: "position",
        budget: 29_000,
        courses: |r| vec![course(&r.calibrated, plan(DriveCommand::Position { deg: 90.0 }, 2.0))],
        counts: tracking,
    },
    Scenario {
        what: "open loop",
        budget: 24_000,
        courses: |r| vec![course(&r.calibrated, plan(DriveCommand::Duty { duty: 0.9 }, 2.0))],
        counts: tracking,
    },
    Scenario {
        what: "acquisition of the angle",
        budget: 23_500,
        courses: |r| {
            let commands = [DriveCommand::Freq { hz: 7.0 }, DriveCommand::Freq { hz: -7.0 }, swing(Stroke::BangBang)];
            commands.map(|command| course(&r.calibrated, plan(command, 0.3))).to_vec()
        },
        counts: |ran| ran.telemetry.state != State::Idle && !ran.telemetry.tracking,
    },
    Scenario { what: "every fault", budget: 29_500, courses: faults, counts: |ran| ran.telemetry.state != State::Idle },
    Scenario { what: "1 … 20 ticks missed", budget: 32_500, courses: missing, counts: |ran| ran.missed > 0 },
];

/// Measures a scenario; every tick of it is compared with the host's, too.
///
/// # Errors
/// The link to the chip fails.
pub fn measure(
    scenario: &Scenario,
    robots: &Robots,
    chip: &mut Remote<Qemu>,
) -> Result<(Cost, Vec<Outcome>), HilError> {
    let mut outcomes = Vec::new();
    for course in (scenario.courses)(robots) {
        outcomes.push(run(&robots.robot, &course, chip)?);
    }
    let ticks = outcomes.iter().flat_map(|outcome| &outcome.ticks).filter(|ran| (scenario.counts)(ran));
    let mut costs: Vec<u32> = ticks.map(|ran| ran.cost).collect();
    costs.sort_unstable();
    let cost = Cost {
        what: scenario.what,
        ticks: costs.len(),
        median: costs.get(costs.len() / 2).copied(),
        worst: costs.last().copied().unwrap_or(0),
        budget: scenario.budget,
        stack: outcomes.iter().map(|outcome| outcome.stack).max().unwrap_or(0),
    };
    Ok((cost, outcomes))
}
