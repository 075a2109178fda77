//! A mistake that people make, in the files of a data set in which nothing else is wrong: a sensor the other way round, units,
//! gears, the supply, the file of another rig.
//!
//! Some are in the rig before it is recorded, some in the columns of its recordings, one in the robot file.

use std::path::Path;

use rand::RngExt;
use rand_pcg::Pcg64;

use super::files::Units;
use super::rig::{self, Rig, RigError};

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mistake {
    /// The sensor counts against the motor.
    ReversedSensor,
    /// The motor's leads are swapped.
    ReversedDrive,
    /// The angle is in degrees.
    Degrees,
    /// The angle is in turns.
    Turns,
    /// The angle is in counts, so many a turn.
    Counts(f64),
    /// The angle is the motor's, so many times the shaft's.
    MotorSide(f64),
    /// The time is in ms.
    Milliseconds,
    /// The duty is in percent.
    Percent,
    /// The duty is −255 … 255.
    Pwm,
    /// The file's motor sits behind gears of so many times the file's ratio.
    OtherGears(f64),
    /// The bridge has so many times the file's supply.
    Supply(f64),
    /// The robot file is this one of `robots/`.
    OtherRig(&'static str),
}

/// How many kinds there are.
pub const KINDS: u64 = 12;
/// The gears of 136:1 that the file's motor of 26:1 is sold with, too (`robots/motor-136.toml`), over the file's.
const GEARS: f64 = 136.02 / 26.449;
/// What laboratories have in place of 5 V, over that. Less than some three times is what a torque constant makes that is half of
/// the file's: recordings without a measured supply are then those of another motor, and of a right set.
const SUPPLIES: [f64; 3] = [18.0 / 5.0, 4.0, 24.0 / 5.0];
/// Files of other rigs.
const OTHERS: [&str; 2] = ["motor-136", "bench-xl330"];
/// A wrapped reading that goes further from one sample to the next, rad, is none: which way it went is not in it.
const FARTHEST: f64 = 2.0;

impl Mistake {
    /// A seed's: forty consecutive seeds have every kind; which gears, supply or file is drawn.
    ///
    /// # Errors
    /// The robot file lacks its gear ratio.
    pub fn of(seed: u64, bits: u32, robot_file: &str, rng: &mut Pcg64) -> Result<Self, RigError> {
        let gear_ratio = rig::number(&robot_file.parse()?, "motor.gear_ratio")?;
        Ok(match seed % KINDS {
            0 => Self::ReversedSensor,
            1 => Self::ReversedDrive,
            2 => Self::Degrees,
            3 => Self::Turns,
            4 => Self::Counts(f64::from(1u32 << bits)),
            5 => Self::MotorSide(gear_ratio),
            6 => Self::Milliseconds,
            7 => Self::Percent,
            8 => Self::Pwm,
            9 => Self::OtherGears(GEARS),
            10 => Self::Supply(SUPPLIES[rng.random_range(0..SUPPLIES.len())]),
            _ => Self::OtherRig(OTHERS[rng.random_range(0..OTHERS.len())]),
        })
    }

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ReversedSensor => "sensor reversed",
            Self::ReversedDrive => "drive reversed",
            Self::Degrees => "angle in degrees",
            Self::Turns => "angle in turns",
            Self::Counts(_) => "angle in counts",
            Self::MotorSide(_) => "angle of the motor",
            Self::Milliseconds => "time in ms",
            Self::Percent => "duty in percent",
            Self::Pwm => "duty of 255",
            Self::OtherGears(_) => "other gears",
            Self::Supply(_) => "other supply",
            Self::OtherRig(_) => "another rig's file",
        }
    }

    /// The specimen with it.
    ///
    /// # Errors
    /// The robot file lacks an inertia.
    pub fn rig(self, specimen: Rig, robot_file: &str) -> Result<Rig, RigError> {
        let mut rig = specimen;
        match self {
            Self::OtherGears(ratio) => {
                let root = robot_file.parse()?;
                let rotor = rig::number(&root, "motor.rotor_inertia_kg_m2")?;
                let rotor = rotor / (rotor + rig::number(&root, "load.inertia_kg_m2")?);
                // Seen at the output, a torque grows with the ratio, an inertia and a damping of the motor's with its square.
                rig.torque_constant *= ratio;
                rig.viscous *= ratio * ratio;
                rig.inertia_kg_m2 *= rotor * ratio * ratio + 1.0 - rotor;
            }
            Self::Supply(factor) => rig.rail_v *= factor,
            _ => {}
        }
        Ok(rig)
    }

    /// The robot file with it.
    ///
    /// # Errors
    /// The other rig's file cannot be read.
    pub fn robot_file(self, right: &str) -> Result<String, RigError> {
        match self {
            Self::OtherRig(name) => {
                let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
                rig::flatten(&robots.join(format!("{name}.toml")))
            }
            _ => Ok(right.to_owned()),
        }
    }

    /// The columns with it.
    #[must_use]
    pub fn units(self) -> Units {
        let right = Units::default();
        match self {
            Self::ReversedSensor => Units { gear: -1.0, ..right },
            Self::ReversedDrive => Units { duty: -1.0, ..right },
            Self::Degrees => Units { turn: 360.0, ..right },
            Self::Turns => Units { turn: 1.0, ..right },
            Self::Counts(turn) => Units { turn, counts: true, ..right },
            Self::MotorSide(gear) => Units { gear, ..right },
            Self::Milliseconds => Units { time: 1e3, ..right },
            Self::Percent => Units { duty: 100.0, ..right },
            Self::Pwm => Units { duty: 255.0, whole_duty: true, ..right },
            Self::OtherGears(_) | Self::Supply(_) | Self::OtherRig(_) => right,
        }
    }

    /// Whether a reading can be wrapped at this mistake's turn, of a rig that is recorded so many times a second.
    #[must_use]
    pub fn can_be_wrapped(self, rig: &Rig, per_s: f64) -> bool {
        self.units().gear.abs() * rig.free_speed() / per_s < FARTHEST
    }
}
