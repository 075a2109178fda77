//! `scram identify potentiometer`

use std::path::{Path, PathBuf};

use ::identify::potentiometer::{PotentiometerFit, SecondFit, potentiometer, second_potentiometer};
use clap::{Args, ValueEnum};
use miette::Report;
use plot::{residual_svg, under_title};
use recording::ReadOptions;
use robot_file::Robot;
use robot_file::edit::Document;
use scram::progress::bar;
use serde::Serialize;

use super::super::run_directory::IDENTIFIED;
use super::super::{Common, Done, print, print_json, table, write};
use super::ROBOT;

/// Find the angle sensor's correction and blind arc from one run at constant voltage
///
/// Writes a copy of the robot file with [sensor.correction] and a plot of what is left into a directory of
/// its own, out/identify-0001 and so on; out/latest-identify leads to the last.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(IDENTIFIED.numbered)))]
#[command(after_help = "Example:\n  \
    scram sim --drive duty:1 --seconds 2.5\n  \
    scram identify potentiometer out/latest/run.mcap\n  \
    scram identify potentiometer out/latest/run.mcap --sensor second --robot robots/two-sensors.toml\n  \
    scram sim --robot out/latest-identify/robot.toml")]
pub struct Potentiometer {
    /// The recording: raw codes at constant voltage, 2.5 s or more
    run: PathBuf,
    /// Which of two sensors
    #[arg(long, value_enum, default_value_t)]
    sensor: Which,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
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

impl Potentiometer {
    pub fn run(&self) -> Done {
        let common = &self.common;
        let robot = common.robot()?;
        common.keeps_robot_file(&common.out.join(ROBOT))?;
        IDENTIFIED.refuse(&common.out, self.overwrite)?;
        let loaded =
            common.recording(&self.run, &robot, &ReadOptions { progress: Some(bar), ..ReadOptions::default() })?;
        match self.sensor {
            Which::First => {
                let fit = potentiometer(&robot, &loaded.recording).map_err(Report::from)?;
                let files = self.fill(|out| save(common, &fit, &self.title(&robot, ""), out))?;
                told(common, &fit, &fit, &files)
            }
            Which::Second => {
                let fit = second_potentiometer(&robot, &loaded.recording).map_err(Report::from)?;
                let files = self.fill(|out| save_second(common, &fit, &self.title(&robot, ", second sensor"), out))?;
                told(common, &fit, &fit.own, &files)
            }
        }
    }

    /// Over the plot: whose sensor it is, and from which run.
    fn title(&self, robot: &Robot, which: &str) -> String {
        format!("{}{which}, {}", robot.name, self.run.display())
    }

    fn fill(&self, write: impl FnOnce(&Path) -> Result<[PathBuf; 2], Report>) -> Result<[PathBuf; 2], Report> {
        IDENTIFIED.fill(&self.common.out, self.overwrite, write)
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

/// Writes the corrected robot file and the plot of what is left into a directory.
pub fn save(common: &Common, fit: &PotentiometerFit, title: &str, out: &Path) -> Result<[PathBuf; 2], Report> {
    let mut document = Document::load(&common.robot)?;
    document.set_correction(&fit.correction)?;
    save_both(common, &document, fit, title, out)
}

fn save_second(common: &Common, fit: &SecondFit, title: &str, out: &Path) -> Result<[PathBuf; 2], Report> {
    let mut document = Document::load(&common.robot)?;
    document.set_second_correction(&fit.own.correction)?;
    document.set("sensor.second.offset_deg", &fit.offset)?;
    save_both(common, &document, &fit.own, title, out)
}

fn save_both(
    common: &Common,
    document: &Document,
    fit: &PotentiometerFit,
    title: &str,
    out: &Path,
) -> Result<[PathBuf; 2], Report> {
    let (file, picture) = (out.join(ROBOT), out.join("potentiometer.svg"));
    common.save(document, &file)?;
    write(&picture, &under_title(title, &residual_svg(fit)))?;
    Ok([file, picture])
}

/// The table.
pub fn facts(fit: &PotentiometerFit) -> String {
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
