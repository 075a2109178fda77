//! What a motion capture system exports: bodies that move, frame by frame.
//!
//! Read are the text exports of Motive (OptiTrack), Nexus (Vicon) and QTM (Qualisys), points of Tracker (Open Source Physics) and
//! DeepLabCut, and any table with a header ([`table`] says which columns). Which of them a file is, its first lines say. Layouts
//! are as their makers describe them:
//! [Motive](https://docs.optitrack.com/motive/data-export/data-export-csv),
//! [QTM](https://docs.qualisys.com/qtm/), [DeepLabCut](https://deeplabcut.github.io/DeepLabCut/).
//!
//! Everything comes out in metres, radians and seconds with z up; Motive's y is up unless its user chose otherwise, which
//! [`Options::up`] says.

mod cells;
mod error;
mod motive;
mod nexus;
mod points;
mod pose;
mod qtm;
pub mod table;

use std::path::Path;

use cells::Cells;

use crate::backbone::Oscillation;
pub use error::CaptureError;

/// A capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// What it was read as, for people.
    pub format: &'static str,
    /// In the file's order; at least one.
    pub bodies: Vec<Body>,
}

/// A body, or a point without an orientation.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// As the file calls it.
    pub name: String,
    /// Increasing, s.
    pub t_s: Vec<f64>,
    /// Where it is, m; NaN where it was lost, and in files that hold angles alone.
    pub position: Vec<[f64; 3]>,
    /// Rotation from its own frame to the room's, unit quaternion (w, x, y, z); none where it was lost.
    pub orientation: Vec<Option<[f64; 4]>>,
}

/// The axis that points up in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// Motive's own.
    Y,
    /// Everyone else's.
    Z,
}

/// What a file does not say itself.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Frames a second, for a file without times.
    pub rate_hz: Option<f64>,
    /// Metres to a unit of the file, for pixels and for tables without units.
    pub metres: Option<f64>,
    /// The axis that points up; none for the system's usual one.
    pub up: Option<Up>,
    /// Columns of a table by our names: `t_s` = `Time`.
    pub columns: Vec<(String, String)>,
}

/// Reads an export.
///
/// # Errors
/// The file cannot be read, is of no known kind, or breaks its own layout.
pub fn read(path: &Path, options: &Options) -> Result<Capture, CaptureError> {
    let cells = Cells::read(path)?;
    let first = cells.row(0).first().cloned().unwrap_or_default();
    let second = |k: usize| cells.row(k).first().cloned().unwrap_or_default();
    let (format, usual, bodies) = if first == "Format Version" {
        ("Motive", Up::Y, motive::bodies(&cells)?)
    } else if nexus::SECTIONS.contains(&first.as_str()) {
        ("Nexus", Up::Z, nexus::bodies(&cells)?)
    } else if first == "NO_OF_FRAMES" {
        ("QTM", Up::Z, qtm::bodies(&cells, options)?)
    } else if first == "scorer" && second(1) == "bodyparts" {
        ("DeepLabCut", Up::Z, points::deep_lab_cut(&cells, options)?)
    } else if points::is_tracker(&cells) {
        ("Tracker", Up::Z, points::tracker(&cells, options)?)
    } else {
        ("table", Up::Z, vec![table::body(&cells, options)?])
    };
    let mut capture = Capture { format, bodies };
    for body in &mut capture.bodies {
        body.check(&cells)?;
        if options.up.unwrap_or(usual) == Up::Y {
            body.stand_up();
        }
    }
    if capture.bodies.is_empty() {
        return Err(cells.wrong(0, "", "no rigid body in it: export rigid bodies, not markers".into()));
    }
    Ok(capture)
}

impl Oscillation {
    /// How a body turns in a file after it is let go, against what holds the fast end where that moves, too. Bodies by their names; of a
    /// file with one body it need not be named.
    ///
    /// # Errors
    /// As [`read`]; there is no such body, or it has no orientation.
    pub fn read(path: &Path, options: &Options, body: Option<&str>, base: Option<&str>) -> Result<Self, CaptureError> {
        let capture = read(path, options)?;
        let body = capture.body(body)?;
        let base = base.map(|name| capture.body(Some(name))).transpose()?;
        let name =
            path.file_stem().map_or_else(|| path.display().to_string(), |stem| stem.to_string_lossy().into_owned());
        let oscillation = body.oscillation(&name, base);
        if oscillation.angles.iter().flatten().all(|angle| !angle.is_finite()) {
            return Err(CaptureError::NoOrientation { path: path.to_owned(), body: body.name.clone() });
        }
        Ok(oscillation)
    }
}

impl Capture {
    /// The body of a name; without a name, the only one.
    ///
    /// # Errors
    /// There is none of this name, or several and no name.
    pub fn body(&self, name: Option<&str>) -> Result<&Body, CaptureError> {
        let names: Vec<&str> = self.bodies.iter().map(|body| body.name.as_str()).collect();
        match name {
            Some(name) => self
                .bodies
                .iter()
                .find(|body| body.name == name)
                .ok_or_else(|| CaptureError::NoBody { name: name.to_owned(), names: names.join(", ") }),
            None if self.bodies.len() == 1 => Ok(&self.bodies[0]),
            None => Err(CaptureError::WhichBody { names: names.join(", ") }),
        }
    }
}

#[cfg(test)]
mod tests;
