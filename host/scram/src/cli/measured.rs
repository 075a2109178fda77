//! Measured walks: tables of speeds, or of what shows the runs.

use std::path::{Path, PathBuf};

use ::identify::robot::{Held, Placement, Run, speeds};
use clap::Args;
use miette::{Report, miette};
use sweep::Measured;

use super::identify::capture::CaptureArgs;

/// Integration step where nothing is said, s.
const STEP_S: f64 = 2e-4;

/// Which walks were measured, and how they are simulated.
#[derive(Args)]
#[command(next_help_heading = "Measured walks")]
pub struct MeasuredArgs {
    /// Tables of measured runs
    #[arg(long, num_args = 1.., value_name = "CSV")]
    pub measured: Vec<PathBuf>,
    /// Speeds are those between these times after the start, s
    #[arg(long, value_name = "FROM,TO", value_parser = window, default_value = "1,2")]
    pub window: (f64, f64),
    /// Integration step, s
    #[arg(long, default_value_t = STEP_S, value_name = "SECONDS")]
    pub step: f64,
    /// Threads [default: one a core]
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    pub threads: usize,
    /// A second body or point, behind --body: the robot's front lies from there to the first
    #[arg(long, value_name = "NAME")]
    rear: Option<String>,
    /// From the body's x axis to the robot's front, counter-clockwise seen from above, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    ahead: f64,
}

fn pair(words: &str) -> Option<(f64, f64)> {
    let (a, b) = words.split_once(',')?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    Some((number(a)?, number(b)?))
}

/// A condition, from words as 7,60.
pub fn condition(words: &str) -> Result<(f64, f64), String> {
    pair(words).ok_or_else(|| "frequency in Hz and α in degrees are expected, as 7,60".into())
}

fn window(words: &str) -> Result<(f64, f64), String> {
    let found = pair(words).filter(|window_s| Run::new(*window_s, STEP_S).is_ok());
    found.ok_or_else(|| "two times in s are expected, the second one later, as 1,2".into())
}

impl MeasuredArgs {
    /// All tables as one.
    pub fn table(&self, capture: &CaptureArgs) -> Result<Measured, Report> {
        let filmed = |file: &Path| -> Result<[f64; 3], Report> {
            let read = capture.read(file)?;
            let body = read.body(capture.shape.body.as_deref())?;
            let rear = self.rear.as_deref().map(|name| read.body(Some(name))).transpose()?;
            let placement = Placement { ahead_rad: self.ahead.to_radians() };
            speeds(body, rear, placement, self.window.0, self.window.1).ok_or_else(|| {
                miette!(
                    help = "name a rigid body with --body, or two points with --body and --rear; --window says which times count",
                    "{}: `{}` is not seen with a heading from {} s to {} s",
                    file.display(),
                    body.name,
                    self.window.0,
                    self.window.1
                )
            })
        };
        let mut all: Option<Measured> = None;
        for path in &self.measured {
            let table = Measured::read_with(path, filmed)?;
            all = Some(match all {
                Some(before) => before.and(table),
                None => table,
            });
        }
        all.ok_or_else(|| miette!("no table was named"))
    }
}

/// Conditions that are held out: those that were named, if they were measured and leave enough to fit.
pub fn held_out(named: &[(f64, f64)], measured: &Measured) -> Result<Held, Report> {
    Held::named(named, measured).map_err(|error| miette!("--holdout {error}"))
}

/// Where what was simulated is kept until a result is written: beside its directory.
pub fn kept_beside(out: &Path) -> PathBuf {
    out.parent().filter(|parent| parent.is_dir()).unwrap_or(Path::new(".")).to_owned()
}
