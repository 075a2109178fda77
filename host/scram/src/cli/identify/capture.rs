//! What a motion capture's files do not say themselves, as options.

use std::path::Path;

use ::identify::capture::{Capture, Options, Up, read};
use clap::{Args, ValueEnum};
use miette::Report;

/// How a motion capture's files are read.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Motion capture")]
pub struct CaptureArgs {
    #[command(flatten)]
    pub shape: CaptureShape,
    /// Frames a second, for files without times
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,
    /// A column of a table by another name: t_s=Time, angle_z_deg=Bend, … ; may be given several times
    #[arg(long = "map", value_name = "NAME=COLUMN", value_parser = column)]
    pub columns: Vec<(String, String)>,
}

/// What is looked at, and its units and axes.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Motion capture")]
pub struct CaptureShape {
    /// The rigid body that is looked at, where a file has several
    #[arg(long, value_name = "NAME")]
    pub body: Option<String>,
    /// Millimetres to a unit of the file, for pixels and tables without units
    #[arg(long, value_name = "MM")]
    mm_per_unit: Option<f64>,
    /// The axis that points up in the file: y in Motive's, z in all others, unless said here
    #[arg(long, value_enum)]
    up: Option<UpArg>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum UpArg {
    Y,
    Z,
}

/// A column by another name, from words as t_s=Time.
pub fn column(words: &str) -> Result<(String, String), String> {
    let (name, column) = words.split_once('=').ok_or("NAME=COLUMN is expected, as t_s=Time")?;
    Ok((name.to_owned(), column.to_owned()))
}

impl CaptureArgs {
    /// As the library takes them.
    pub fn options(&self) -> Options {
        Options {
            rate_hz: self.rate,
            metres: self.shape.mm_per_unit.map(|mm| 1e-3 * mm),
            up: self.shape.up.map(|up| match up {
                UpArg::Y => Up::Y,
                UpArg::Z => Up::Z,
            }),
            columns: self.columns.clone(),
        }
    }

    /// Reads a file.
    pub fn read(&self, path: &Path) -> Result<Capture, Report> {
        Ok(read(path, &self.options())?)
    }
}
