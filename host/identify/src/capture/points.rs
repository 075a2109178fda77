//! Points in a picture: Tracker's tables of masses, and DeepLabCut's body parts.

use super::cells::Cells;
use super::{Body, CaptureError, Options};

/// A body part that DeepLabCut is less sure of is lost.
const SURE: f64 = 0.6;

/// Tracker: names of the masses in the first line, `t,x,y` of each in the second.
pub fn is_tracker(cells: &Cells) -> bool {
    let headings = cells.row(1);
    headings.first().is_some_and(|cell| cell == "t") && headings.iter().any(|cell| cell == "x")
}

/// Reads Tracker's table: seconds, and the length unit of its calibration stick, metres unless said otherwise.
pub fn tracker(cells: &Cells, options: &Options) -> Result<Vec<Body>, CaptureError> {
    let (metres, headings) = (options.metres.unwrap_or(1.0), cells.row(1));
    let mut bodies = Vec::new();
    for column in (0..headings.len()).filter(|&k| headings[k] == "x" && headings.get(k + 1).is_some_and(|y| y == "y")) {
        let name = (0..=column).rev().find_map(|k| cells.row(0).get(k).filter(|cell| !cell.is_empty()));
        let mut body = Body::named(name.cloned().unwrap_or_else(|| format!("mass {}", bodies.len() + 1)));
        for (row, _) in cells.from(2) {
            let at = |k: usize| cells.number(row, k, &headings[k]);
            body.push(at(0)?, [at(column)? * metres, at(column + 1)? * metres, 0.0], None);
        }
        bodies.push(body);
    }
    Ok(bodies)
}

/// Reads DeepLabCut's CSV: pixels, y downwards, frames without times.
pub fn deep_lab_cut(cells: &Cells, options: &Options) -> Result<Vec<Body>, CaptureError> {
    let Some(rate) = options.rate_hz.filter(|rate| *rate > 0.0) else {
        return Err(cells.wrong(
            0,
            "",
            "DeepLabCut's files have no times: say the frame rate with --rate, in Python rate_hz".into(),
        ));
    };
    let Some(metres) = options.metres.filter(|scale| *scale > 0.0) else {
        return Err(cells.wrong(
            0,
            "",
            "DeepLabCut's files are in pixels: say how many mm one is with --mm-per-unit, in Python mm_per_unit".into(),
        ));
    };
    let (names, headings) = (cells.row(1), cells.row(2));
    let mut bodies = Vec::new();
    for column in (1..headings.len()).filter(|&k| headings[k] == "x") {
        let mut body = Body::named(names.get(column).cloned().unwrap_or_default());
        for (row, _) in cells.from(3) {
            let at = |k: usize| cells.number(row, k, &body.name);
            let (frame, x, y, sure) = (at(0)?, at(column)?, at(column + 1)?, at(column + 2)?);
            // NaN for a likelihood that is not there is no reason to doubt.
            let seen = if sure < SURE { f64::NAN } else { 1.0 };
            body.push(frame / rate, [seen * x * metres, -seen * y * metres, 0.0], None);
        }
        bodies.push(body);
    }
    Ok(bodies)
}
