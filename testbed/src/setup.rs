//! What is put on a bench.

use control::protocol::pairing::Pairing;
use control::protocol::radio::Reset;
use control::protocol::secure::Key;
use hal_sim::SimulatedRobot;
use hal_sim::body::plan::PlanError;
use hal_sim::body::{Precision, Walker, WalkingRobots};
use robot_file::design::{DesignError, design};
use robot_file::robot::{Radio, Sensor};
use shell::board::Address;
use shell::dongle::Identity;
use shell::robot::Settings;

use crate::event_log::Detail;
use crate::parts::SeededEntropy;
use crate::robot::Member;
use crate::simulated::Simulated;

/// The dongle's address where nobody gives another.
pub const DONGLE: Address = [0x24, 0x6f, 0x28, 0, 0, 1];
/// A conversion's duration where the robot file has no converter, µs.
const CONVERSION_US: u64 = 37;
/// A conversion farther than this from the tick's median is an outlier, LSB.
const OUTLIER_LSB: u16 = 100;

/// Address of the robot of an index.
#[must_use]
pub fn address(index: usize) -> Address {
    let [high, low] = (index as u16).to_be_bytes();
    [0x7c, 0xdf, 0xa1, 0, high, low]
}

/// Keys from a seed for the robot of an index: for tests. Keys that somebody shall rely on come from a source that nobody
/// can guess.
#[must_use]
pub fn pairing(console: Address, seed: u64, index: usize) -> Pairing {
    let primary = SeededEntropy::new(seed).bytes();
    let own = SeededEntropy::new(seed.wrapping_add(1 + index as u64));
    Pairing { console, primary, local: own.bytes(), key: Key(own.bytes()) }
}

/// A bench before anything runs.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Of the air and of everybody's randomness.
    pub seed: u64,
    /// The air's figures.
    pub radio: Radio,
    /// The dongle; without one the place is free for a [`Console`](crate::console::Console).
    pub dongle: Option<Identity>,
    /// The robots.
    pub robots: Vec<Member>,
    /// What the robots' journals keep.
    pub detail: Detail,
}

/// Why a robot file makes no bench.
#[derive(Debug)]
pub enum SetupError {
    /// No controller can be designed.
    Design(DesignError),
    /// It has no table `[radio]`.
    NoRadio,
    /// A name is too long for the protocol.
    Name(String),
    /// There is no body to set on the ground.
    Body(PlanError),
}

impl std::fmt::Display for SetupError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Design(error) => error.fmt(f),
            Self::Body(error) => error.fmt(f),
            Self::NoRadio => f.write_str(
                "radio: missing, and without it there is no link to simulate: copy the table from robot.toml",
            ),
            Self::Name(name) => {
                write!(f, "name: {name:?} is too long: at most {} bytes", control::protocol::radio::NAME)
            }
        }
    }
}

impl std::error::Error for SetupError {}

impl Setup {
    /// A dongle and so many robots of a file, a metre apart, each paired with keys from the seed. The first has the file's
    /// name, the others a number behind it; their draws come from the seed.
    ///
    /// # Errors
    /// See [`SetupError`].
    pub fn new(file: &robot_file::Robot, robots: usize, seed: u64) -> Result<Self, SetupError> {
        let radio = file.radio.clone().ok_or(SetupError::NoRadio)?;
        let dongle = Identity { address: DONGLE, channel: radio.channel.value as u8 };
        let robots = (0..robots).map(|index| member(file, index, seed)).collect::<Result<_, _>>()?;
        Ok(Self { seed, radio, dongle: Some(dongle), robots, detail: Detail::default() })
    }

    /// The same robots with their bodies, on the ground: one cannot be on another's way.
    ///
    /// # Errors
    /// The file has no body, or one that cannot be built.
    pub fn on_ground(mut self, file: &robot_file::Robot) -> Result<Self, SetupError> {
        for (index, member) in (0..).zip(&mut self.robots) {
            member.simulated = fine_on_ground(file, self.seed.wrapping_add(index)).map_err(SetupError::Body)?;
        }
        Ok(self)
    }
}

/// A robot's motor in steps that are finer than its ticks, so that what comes late or early acts then: the same integration
/// steps as in [`SimulatedRobot::new`], and as many draws.
#[must_use]
pub fn fine(file: &robot_file::Robot, seed: u64) -> SimulatedRobot {
    let (file, settings) = fine_steps(file);
    SimulatedRobot::with(&file, seed, &settings)
}

/// The same with the robot's body, at rest on the ground.
///
/// # Errors
/// The file has no body, or one that cannot be built.
pub fn fine_on_ground(file: &robot_file::Robot, seed: u64) -> Result<Simulated, PlanError> {
    let (file, settings) = fine_steps(file);
    let walker = Walker::new(&file, seed, &settings)?;
    Ok(Simulated::Ground(Box::new(WalkingRobots::new(vec![walker], Precision::Double)?)))
}

/// A tick an integration step.
fn fine_steps(file: &robot_file::Robot) -> (robot_file::Robot, hal_sim::Settings) {
    let mut file = file.clone();
    let usual = hal_sim::Settings::default();
    if let Some(controller) = &mut file.controller {
        controller.tick_s.value /= usual.steps_per_tick as f64;
    }
    (file, hal_sim::Settings { steps_per_tick: 1, ..usual })
}

fn member(file: &robot_file::Robot, index: usize, seed: u64) -> Result<Member, SetupError> {
    let parameters = design(file).map_err(SetupError::Design)?.parameters;
    let name = if index == 0 { file.name.clone() } else { format!("{}-{}", file.name, index + 1) };
    let (conversions, conversion_us) = match &file.sensor {
        Sensor::Potentiometer(sensor) => {
            (sensor.adc.conversions.value as u8, (sensor.adc.conversion_s.value * 1e6).round() as u64)
        }
        Sensor::Ideal | Sensor::Encoder(_) => (1, CONVERSION_US),
    };
    let settings = Settings {
        name: name.as_str().try_into().map_err(|_| SetupError::Name(name.clone()))?,
        parameters,
        conversions,
        outlier_lsb: OUTLIER_LSB,
    };
    Ok(Member {
        address: address(index),
        pairing: Some(pairing(DONGLE, seed, index)),
        settings,
        stored: None,
        simulated: fine(file, seed.wrapping_add(index as u64)).into(),
        conversion_us,
        position_m: 1.0 + index as f64,
        reset: Reset::PowerOn,
        injectable: false,
        broken: Vec::new(),
    })
}
