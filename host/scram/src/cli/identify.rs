//! `scram identify`

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use diagnose::identify::{PotentiometerFit, SecondFit, potentiometer, second_potentiometer};
use miette::Report;
use plot::residual_svg;
use recording::ReadOptions;
use robot_file::edit::Document;
use scram::progress::bar;
use serde::Serialize;

use super::{Common, Done, print, print_json, table};

/// Find parameters from recordings
#[derive(Subcommand)]
pub enum Identify {
    Potentiometer(Potentiometer),
}

/// Find the angle sensor's correction and blind arc from one run at constant voltage
///
/// Writes a copy of the robot file with [sensor.correction] and a plot of what is left into --out.
#[derive(Args)]
#[command(after_help = "Example:\n  \
    scram sim --drive duty:1 --seconds 2.5\n  \
    scram identify potentiometer out/latest/run.mcap\n  \
    scram identify potentiometer out/latest/run.mcap --sensor second --robot robots/two-sensors.toml\n  \
    scram sim --robot out/robot.toml")]
pub struct Potentiometer {
    /// The recording: raw codes at constant voltage, 2.5 s or more
    run: PathBuf,
    /// Which of two sensors
    #[arg(long, value_enum, default_value_t)]
    sensor: Which,
    #[command(flatten)]
    common: Common,
}

/// Which of a robot's two potentiometers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Which {
    /// [sensor]
    #[default]
    First,
    /// [sensor.second]
    Second,
}

#[derive(Serialize)]
struct Output<'a, F> {
    #[serde(flatten)]
    fit: &'a F,
    files: &'a [PathBuf],
}

impl Identify {
    pub fn run(&self) -> Done {
        match self {
            Self::Potentiometer(command) => command.run(),
        }
    }
}

impl Potentiometer {
    fn run(&self) -> Done {
        let common = &self.common;
        let robot = common.robot()?;
        let loaded =
            common.recording(&self.run, &robot, &ReadOptions { progress: Some(bar), ..ReadOptions::default() })?;
        match self.sensor {
            Which::First => {
                let fit = potentiometer(&robot, &loaded.recording).map_err(Report::from)?;
                told(common, &fit, &fit, &write(common, &fit)?)
            }
            Which::Second => {
                let fit = second_potentiometer(&robot, &loaded.recording).map_err(Report::from)?;
                told(common, &fit, &fit.own, &write_second(common, &fit)?)
            }
        }
    }
}

/// Says what was found and written.
fn told(common: &Common, whole: &impl Serialize, fit: &PotentiometerFit, files: &[PathBuf; 2]) -> Done {
    if common.json {
        print_json(&Output { fit: whole, files })?;
        return Ok(());
    }
    print(&facts(fit));
    print(&format!("written: {}, {}", files[0].display(), files[1].display()));
    print(&format!("use it: scram sim --robot {}", files[0].display()));
    Ok(())
}

/// Writes the corrected robot file and the plot of what is left into `--out`.
pub(super) fn write(common: &Common, fit: &PotentiometerFit) -> Result<[PathBuf; 2], Report> {
    let mut document = Document::load(&common.robot)?;
    document.set_correction(&fit.correction)?;
    save(common, &document, fit)
}

fn write_second(common: &Common, fit: &SecondFit) -> Result<[PathBuf; 2], Report> {
    let mut document = Document::load(&common.robot)?;
    document.set_second_correction(&fit.own.correction)?;
    document.set("sensor.second.offset_deg", &fit.offset)?;
    save(common, &document, &fit.own)
}

fn save(common: &Common, document: &Document, fit: &PotentiometerFit) -> Result<[PathBuf; 2], Report> {
    let file = common.out.join("robot.toml");
    common.save(document, &file)?;
    let picture = common.write("potentiometer.svg", &residual_svg(fit))?;
    Ok([file, picture])
}

/// The table.
pub(super) fn facts(fit: &PotentiometerFit) -> String {
    let correction = &fit.correction;
    let hz = fit.speed_rad_per_s.abs() / std::f64::consts::TAU;
    table::facts([
        ("used", format!("{:.0} turns at {hz:.2} Hz, {} samples", fit.turns, fit.samples)),
        ("error before, RMS / peak", format!("{:.2}° / {:.2}°", fit.before_rms_deg, fit.before_peak_deg)),
        ("error left, RMS / peak", format!("{:.3}° / {:.3}°", fit.after_rms_deg, fit.after_peak_deg)),
        ("noise of one reading", format!("{:.2}°", fit.noise_deg)),
        ("blind arc", format!("{:.1}° … {:.1}°", correction.blind_from_deg, correction.blind_to_deg)),
        ("zero moved by", format!("{:.2}° ± {:.2}°", fit.zero_shift_deg, fit.zero_uncertainty_deg)),
    ])
}
