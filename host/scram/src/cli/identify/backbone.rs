//! `scram identify backbone`

use std::path::{Path, PathBuf};

use ::identify::backbone::{BackboneFit, FIELDS, Gravity, Method, Options, Oscillation, Search, Section, identify};
use clap::{Args, ValueEnum};
use miette::{Report, miette};
use plot::{oscillation_svg, under_title};
use robot_file::edit::Document;
use robot_file::robot::Robot;
use serde::Serialize;

use super::super::run_directory::IDENTIFIED;
use super::super::{Common, Done, Failure, print, print_json, say, table, write};
use super::capture::CaptureArgs;
use super::{ROBOT, short};

/// Find a backbone's stiffness and damping from its free oscillations (thesis section 3.1)
///
/// A backbone is held fast at one end, the module at its other end is pulled aside and let go, and cameras record how it turns. The
/// runs may show one axis each or all at once. Neither the angle nor the time of the release need be known. Writes a copy of the
/// robot file with [backbone] and a plot of every run into a directory of its own, out/identify-0001 and so on.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(IDENTIFIED.numbered)))]
#[command(
    after_help = "Files are exports of Motive, Nexus or QTM, or tables with the columns t_s and angle_x_rad, angle_y_rad, \
    angle_z_rad (or _deg; one is enough) or qw, qx, qy, qz. x points along the backbone, z up where it lies level with its roll at 0.\n\n\
    Examples:\n  \
    scram identify backbone examples/backbone/release-*.csv\n  \
    scram identify backbone take1.csv take2.csv --holdout take3.csv --body tip --base clamp\n  \
    scram identify backbone swing.csv --map t_s=Time --map angle_z_deg=Bend --gravity hanging\n  \
    scram identify backbone release-*.csv --section 4,6,1.5,1 --modulus 2.4\n  \
    scram identify backbone release-*.csv --method bayes --evaluations 200\n\n\
    docs/identify-backbone.md describes the rig, the files and the method."
)]
pub struct Backbone {
    /// Recordings to fit; with two or more and no --holdout, the last is held out
    #[arg(required = true)]
    runs: Vec<PathBuf>,
    /// Recordings to judge by
    #[arg(long, value_name = "RUN", num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// The body that holds the fast end, where it moves, too
    #[arg(long, value_name = "NAME")]
    base: Option<String>,
    /// Which of the robot's modules is at the end, from 1: its mass and size are what the backbone swings [default: the last]
    #[arg(long, value_name = "N")]
    module: Option<usize>,
    /// How the backbone stands in the room
    #[arg(long, value_enum, default_value_t)]
    gravity: GravityArg,
    /// How the six numbers are looked for
    #[arg(long, value_enum, default_value_t)]
    method: MethodArg,
    /// Sets of the six numbers that --method bayes tries [default: 120]
    #[arg(long, value_name = "N")]
    evaluations: Option<usize>,
    /// Section to compare with: WIDTH,HEIGHT,FLANGE,WEB in mm
    #[arg(long, value_name = "MM,MM,MM,MM", value_delimiter = ',', num_args = 1, requires = "modulus")]
    section: Vec<f64>,
    /// Young's modulus of the material, MPa
    #[arg(long, value_name = "MPA", requires = "section")]
    modulus: Option<f64>,
    #[command(flatten)]
    capture: CaptureArgs,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum GravityArg {
    /// It lies level, its z axis up
    #[default]
    Level,
    /// It hangs from its fast end
    Hanging,
    /// Left out
    None,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, ValueEnum)]
enum MethodArg {
    /// Levenberg and Marquardt on everything at once, with intervals
    #[default]
    LeastSquares,
    /// Bayesian optimisation of (3.1), as in the thesis: no intervals
    Bayes,
}

#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    fit: &'a BackboneFit,
    /// What the section predicts of the three stiffnesses, N·m/rad.
    section_nm_per_rad: Option<[f64; 3]>,
    files: &'a [PathBuf],
}

impl Backbone {
    pub fn run(&self) -> Done {
        let common = &self.common;
        let robot = common.robot()?;
        let section = self.section(&robot)?;
        common.keeps_robot_file(&common.out.join(ROBOT))?;
        IDENTIFIED.refuse(&common.out, self.overwrite)?;
        let (fit, held_out) = self.split();
        let read = |paths: &[PathBuf]| paths.iter().map(|path| self.oscillation(path)).collect::<Result<Vec<_>, _>>();
        let options = Options {
            module: self.module,
            gravity: match self.gravity {
                GravityArg::Level => Gravity::Level,
                GravityArg::Hanging => Gravity::Hanging,
                GravityArg::None => Gravity::None,
            },
            method: self.method()?,
        };
        let found = identify(&robot, &read(&fit)?, &read(&held_out)?, options).map_err(Report::from)?;
        let files = IDENTIFIED.fill(&common.out, self.overwrite, |out| self.save(&robot, &found, out))?;
        if common.json {
            print_json(&Output { fit: &found, section_nm_per_rad: section, files: &files })?;
            return Ok(());
        }
        print(&numbers(&found, section));
        print(&facts(&found));
        for hinge in found.hinges.iter().filter(|hinge| !hinge.told) {
            say(&format!(
                "these runs do not tell {}: the file's is kept; let the backbone swing about that axis",
                hinge.field
            ));
        }
        if found.evaluations.is_some() {
            say(
                "Bayesian optimisation gives no intervals: the file's spreads are kept; --method least-squares has them",
            );
        }
        print(&format!("written: {}, {}", files[0].display(), files[1].display()));
        print(&format!("use it: scram sim --robot {}", files[0].display()));
        Ok(())
    }

    fn method(&self) -> Result<Method, Failure> {
        match self.method {
            MethodArg::LeastSquares if self.evaluations.is_some() => Err(Failure::Usage(miette!(
                help = "--method bayes --evaluations N",
                "--evaluations is for --method bayes: least squares ends by itself"
            ))),
            MethodArg::LeastSquares => Ok(Method::LeastSquares),
            MethodArg::Bayes => {
                let evaluations = self.evaluations.unwrap_or(Search::default().evaluations);
                Ok(Method::Bayes(Search { seed: self.common.seed, evaluations }))
            }
        }
    }

    /// Runs to fit and to judge by.
    fn split(&self) -> (Vec<PathBuf>, Vec<PathBuf>) {
        match self.runs.split_last() {
            Some((last, others)) if self.holdout.is_empty() && !others.is_empty() => {
                (others.to_vec(), vec![last.clone()])
            }
            _ => (self.runs.clone(), self.holdout.clone()),
        }
    }

    fn oscillation(&self, path: &Path) -> Result<Oscillation, Report> {
        let body = self.capture.shape.body.as_deref();
        Ok(Oscillation::read(path, &self.capture.options(), body, self.base.as_deref())?)
    }

    fn section(&self, robot: &Robot) -> Result<Option<[f64; 3]>, Report> {
        let (Some(modulus), Some(backbone)) = (self.modulus, &robot.backbone) else { return Ok(None) };
        let [width, height, flange, web] = self.section[..] else {
            return Err(miette!(
                help = "--section 4,6,1.5,1",
                "--section takes four lengths: width, height, flange, web"
            ));
        };
        let section = Section {
            width: 1e-3 * width,
            height: 1e-3 * height,
            flange: 1e-3 * flange,
            web: 1e-3 * web,
            modulus: 1e6 * modulus,
        };
        section.check()?;
        Ok(Some(section.hinges(backbone.length_m.value, backbone.segments.value as usize)))
    }

    fn save(&self, robot: &Robot, fit: &BackboneFit, out: &Path) -> Result<[PathBuf; 2], Report> {
        let mut document = Document::load(&self.common.robot)?;
        fit.write_into(&mut document)?;
        let (file, picture) = (out.join(ROBOT), out.join("backbone.svg"));
        self.common.save(&document, &file)?;
        let title = format!("{}, {}", robot.name, fit.fitted().join(", "));
        write(&picture, &under_title(&title, &oscillation_svg(&fit.tracks)?))?;
        Ok([file, picture])
    }
}

/// The six numbers.
fn numbers(fit: &BackboneFit, section: Option<[f64; 3]>) -> String {
    let mut header = vec!["", "found", "90 % interval", "file"];
    if section.is_some() {
        header.push("section");
    }
    let rows = fit.hinges.iter().zip(FIELDS).enumerate().map(|(k, (hinge, field))| {
        let found = if hinge.told { short(hinge.value) } else { "not told".to_owned() };
        let interval =
            hinge.interval.map_or_else(|| "–".to_owned(), |one| format!("{} … {}", short(one.low), short(one.high)));
        let mut row = vec![field.to_owned(), found, interval, short(hinge.file)];
        if let Some(section) = section {
            row.push(section.get(k).map_or_else(|| "–".to_owned(), |value| short(*value)));
        }
        row
    });
    table::columns(&header, rows)
}

fn simulated(fit: &BackboneFit) -> String {
    let tried = fit.evaluations.map_or_else(String::new, |sets| format!(", for {sets} sets of the six numbers"));
    format!("{} oscillations{tried}", fit.simulated)
}

fn facts(fit: &BackboneFit) -> String {
    let deg = |rad: f64| format!("{:.2}°", rad.to_degrees());
    let axes = fit
        .noise_rad
        .iter()
        .zip(["x", "y", "z"])
        .filter_map(|(noise, axis)| noise.map(|n| format!("{axis} {}", deg(n))));
    let noise = axes.collect::<Vec<_>>().join(", ");
    let error = match fit.evaluations {
        Some(_) => deg(fit.error_rad),
        None => format!("{}; the noise alone makes {}", deg(fit.error_rad), deg(fit.floor_rad)),
    };
    let mut rows = vec![
        (
            "used",
            format!("{} angles of {} runs", fit.samples, fit.tracks.iter().filter(|track| !track.held_out).count()),
        ),
        // What Bayesian optimisation leaves may be more than noise.
        (if fit.evaluations.is_some() { "left of one angle" } else { "noise of one angle" }, noise),
        ("error (3.1)", error),
    ];
    rows.push(("simulated", simulated(fit)));
    if fit.outliers > 0 {
        rows.push(("left out", format!("{} angles that lie far off", fit.outliers)));
    }
    for run in &fit.held_out {
        let told =
            format!("{}: {} with the file's numbers, {} with these", run.run, deg(run.before_rad), deg(run.after_rad));
        rows.push(("held out", told));
    }
    let [x, y, z] = fit.inertia_kg_m2.map(|inertia| format!("{:.3} g·cm²", 1e7 * inertia));
    rows.push(("stiffness is against", format!("{x}, {y}, {z} about x, y, z: check the end's mass and size")));
    table::facts(rows)
}
