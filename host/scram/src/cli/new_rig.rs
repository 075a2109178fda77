//! `scram new-rig`: a robot file from what a motor's label says, and the check of recordings against a robot file.

mod check;
mod label;
mod questions;
mod text;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::{Report, miette};
use robot_file::edit::Document;

use super::import::{MappingArgs, WindowArgs};
use super::{Failure, print, say};
use label::Rig;
use questions::Asker;

/// Something was found by `--check`.
const FOUND: u8 = 3;

/// Describe a motor rig by what its label says, and check recordings against a robot file
///
/// Asks for what is not given as an option and writes a robot file whose every number says where it comes from and how far it may
/// be off. Where the label says nothing, `unknown` leaves it to an estimate. Such a rig is diagnosed; to be driven by this
/// firmware it needs a [controller], as robot.toml has one.
///
/// --check compares recordings with a robot file: signs, units, time base, supply, another motor; each finding with what to
/// change. Exit code 0: nothing is wrong; 3: something is; 1: it could not be done; 2: wrong usage.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    scram new-rig\n  \
    scram new-rig --supply-v 12 --no-load-rpm 300 --stall-a 2.5 --load disc:0.2:0.04 --sensor encoder:1024 --out rig.toml\n  \
    scram new-rig --check rig.toml runs/*.csv\n  \
    scram new-rig --check rig.toml log.csv --map time=Time:ms --map angle=Pos:deg --map duty=PWM:255\n\n\
    docs/new-rig.md says what the numbers are estimated from, and what the check sees.")]
pub struct NewRig {
    #[command(flatten)]
    answers: Answers,
    /// The robot file to write
    #[arg(long, value_name = "FILE", default_value = "rig.toml")]
    out: PathBuf,
    /// Write over a file that is there already
    #[arg(long)]
    force: bool,
    /// Check recordings: of the robot file that is named first, or where none is, of the one that is written
    #[arg(long, value_name = "ROBOT.toml|RUN", num_args = 1..)]
    check: Vec<PathBuf>,
    #[command(flatten)]
    mapping: MappingArgs,
    #[command(flatten)]
    window: WindowArgs,
    /// What --check finds as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// What is known of the rig; `unknown` is an answer, too.
#[derive(Args)]
pub struct Answers {
    /// Name of the rig [default: the file's name]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Supply of the bridge, V
    #[arg(long, value_name = "V")]
    supply_v: Option<String>,
    /// Voltage for which the label's numbers hold, V [default: the supply]
    #[arg(long, value_name = "V")]
    label_v: Option<String>,
    /// Speed without load, rpm
    #[arg(long, value_name = "RPM", conflicts_with = "no_load_rad_per_s")]
    no_load_rpm: Option<String>,
    /// Speed without load, rad/s
    #[arg(long, value_name = "RAD_PER_S")]
    no_load_rad_per_s: Option<String>,
    /// Current of the blocked motor, A
    #[arg(long, value_name = "A")]
    stall_a: Option<String>,
    /// Resistance of the winding, Ω
    #[arg(long, value_name = "OHM")]
    resistance_ohm: Option<String>,
    /// Torque of the blocked motor, N·m
    #[arg(long, value_name = "NM")]
    stall_torque_nm: Option<String>,
    /// Current without load, A
    #[arg(long, value_name = "A")]
    no_load_a: Option<String>,
    /// Gear ratio, motor turns per turn of the output shaft [default: 1]
    #[arg(long, value_name = "N")]
    gear_ratio: Option<String>,
    /// Where the label's speed and torque hold: shaft (behind the gears) or motor [default: shaft]
    #[arg(long, value_name = "WHERE")]
    numbers_at: Option<String>,
    /// What turns with the shaft: an inertia in kg·m², disc:KG:M (mass and radius), none or unknown
    #[arg(long, value_name = "LOAD")]
    load: Option<String>,
    /// Angle sensor on the output shaft: encoder:COUNTS a turn, potentiometer:BITS:DEG (converter and travel), or ideal
    #[arg(long, value_name = "SENSOR")]
    sensor: Option<String>,
    /// Sampling period, s: to say whether it shows the motor's answer
    #[arg(long, value_name = "S")]
    sampling_s: Option<String>,
    /// The bridge: mosfet, bipolar (L293, L298) or unknown [default: unknown]
    #[arg(long, value_name = "KIND")]
    driver: Option<String>,
    /// PWM frequency, Hz [default: unknown]
    #[arg(long, value_name = "HZ")]
    pwm_hz: Option<String>,
}

impl NewRig {
    pub fn run(&self) -> Result<ExitCode, Failure> {
        let is_robot_file = |path: &PathBuf| path.extension().is_some_and(|end| end == "toml");
        match self.check.split_first() {
            Some((robot, runs)) if is_robot_file(robot) => self.check(robot, runs),
            _ => {
                let written = self.write()?;
                if self.check.is_empty() { Ok(ExitCode::SUCCESS) } else { self.check(&written, &self.check) }
            }
        }
    }

    /// Asks, and writes the file.
    fn write(&self) -> Result<PathBuf, Failure> {
        // Nobody answers twenty questions for a file that is then not written.
        if self.out.exists() && !self.force {
            let help = "name another file with --out, or say --force";
            return Err(miette!(help = help, "{} is there already; it is not written over", self.out.display()).into());
        }
        let stem = self.out.file_stem().map_or_else(|| "rig".to_owned(), |stem| stem.to_string_lossy().into_owned());
        let rig = Rig::asked(&self.answers, &stem, &mut Asker::new())?;
        let document = Document::parse(&text::of(&rig), &self.out.display().to_string()).map_err(Report::from)?;
        document.save(&self.out).map_err(Report::from)?;
        for line in rig.remarks() {
            say(&line);
        }
        if !self.json {
            print(&format!("written: {}", self.out.display()));
        }
        Ok(self.out.clone())
    }

    fn check(&self, robot: &Path, runs: &[PathBuf]) -> Result<ExitCode, Failure> {
        if runs.is_empty() {
            let help = "scram new-rig --check ROBOT.toml RUN...";
            return Err(Failure::Usage(miette!(help = help, "--check {}: no recording is named", robot.display())));
        }
        let found = check::check(robot, runs, &self.mapping, &self.window)?;
        found.tell(robot, runs.len(), self.json)?;
        Ok(if found.is_right() { ExitCode::SUCCESS } else { ExitCode::from(FOUND) })
    }
}
