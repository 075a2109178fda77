//! Runs in memory and as CSV files in the exchange format (`docs/recordings.md`), written by hand so that a mistake in
//! the library's own writer cannot cancel one in its reader.

use super::world::Drive;
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

/// Decimals of the numbers in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimals {
    /// Of the time in s.
    pub time: usize,
    /// Of the angle in rad.
    pub angle: usize,
    /// Of the current in A.
    pub current: usize,
}

impl Decimals {
    /// Far below the noise.
    pub const FULL: Self = Self { time: 7, angle: 7, current: 4 };
    /// Still a tenth of the noise, for files that are kept.
    pub const FEW: Self = Self { time: 6, angle: 4, current: 4 };
}

/// How the columns are written; as by default they are right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Of the time in a second.
    pub time: f64,
    /// Turns of what the sensor sits on to one of the shaft.
    pub gear: f64,
    /// Of the angle in a turn.
    pub turn: f64,
    /// The angle is in whole numbers, of a wrapped reading from 0.
    pub counts: bool,
    /// Of the duty at full drive.
    pub duty: f64,
    /// The duty is in whole numbers.
    pub whole_duty: bool,
}

impl Default for Units {
    fn default() -> Self {
        Self { time: 1.0, gear: 1.0, turn: TAU, counts: false, duty: 1.0, whole_duty: false }
    }
}

impl Units {
    /// An angle in rad as the column has it.
    fn angle(&self, angle: f64, wrapped: bool) -> f64 {
        let from = if self.counts { 0.0 } else { -PI };
        let angle = self.gear * angle;
        let shown = if wrapped { (angle - from).rem_euclid(TAU) + from } else { angle } * (self.turn / TAU);
        if self.counts { shown.round() } else { shown }
    }

    /// A duty as the column has it.
    fn duty(&self, duty: f64) -> f64 {
        if self.whole_duty { (self.duty * duty).round() } else { self.duty * duty }
    }
}

/// One run with what the diagnosing side never sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Sampling instants, s.
    pub t_s: Vec<f64>,
    /// Commands, each held from its instant to the next.
    pub drive: Vec<Drive>,
    /// Readings, rad, not wrapped.
    pub reading: Vec<f64>,
    /// The same without noise and quantisation, rad.
    pub clean: Vec<f64>,
    /// Whether the reading is missing.
    pub blind: Vec<bool>,
    /// Current readings, A, where measured.
    pub current: Option<Vec<f64>>,
}

impl Run {
    /// The file's text.
    #[must_use]
    pub fn csv(&self, wrapped: bool, decimals: Decimals) -> String {
        self.csv_in(&Units::default(), wrapped, decimals)
    }

    /// The same with its columns in some units.
    #[must_use]
    pub fn csv_in(&self, units: &Units, wrapped: bool, decimals: Decimals) -> String {
        let Decimals { time, angle: of_angle, current: of_current } = decimals;
        let mut text = String::with_capacity(self.t_s.len() * 40);
        text.push_str("t_s,enable,duty,angle_rad");
        text.push_str(if self.current.is_some() { ",current_a\n" } else { "\n" });
        for n in 0..self.t_s.len() {
            let Drive { duty, enable } = self.drive[n];
            // Writing to a String cannot fail.
            let _ = write!(text, "{:.time$},{},{:.5},", units.time * self.t_s[n], u8::from(enable), units.duty(duty));
            if !self.blind[n] {
                let _ = write!(text, "{:.of_angle$}", units.angle(self.reading[n], wrapped));
            }
            if let Some(current) = &self.current {
                let _ = write!(text, ",{:.of_current$}", current[n]);
            }
            text.push('\n');
        }
        text
    }
}

/// Paths of a data set's files.
#[derive(Clone, Debug)]
pub struct Paths {
    /// The robot file.
    pub robot: PathBuf,
    /// Runs to fit on.
    pub fit: Vec<PathBuf>,
    /// Runs held out.
    pub held_out: Vec<PathBuf>,
}

/// Writes `robot.toml`, `fit-1.csv` …, `held-1.csv` … into a directory.
///
/// # Errors
/// What the system says about the first file that cannot be written.
pub fn write(
    directory: &Path,
    robot: &str,
    runs: &[Run],
    fit: usize,
    wrapped: bool,
    (decimals, units): (Decimals, &Units),
) -> io::Result<Paths> {
    std::fs::create_dir_all(directory)?;
    let mut paths = Paths { robot: directory.join("robot.toml"), fit: Vec::new(), held_out: Vec::new() };
    std::fs::write(&paths.robot, robot)?;
    for (n, run) in runs.iter().enumerate() {
        let (list, name) = if n < fit {
            (&mut paths.fit, format!("fit-{}.csv", n + 1))
        } else {
            (&mut paths.held_out, format!("held-{}.csv", n + 1 - fit))
        };
        let path = directory.join(name);
        std::fs::write(&path, run.csv_in(units, wrapped, decimals))?;
        list.push(path);
    }
    Ok(paths)
}
