//! QTM's (Qualisys's) TSV of six degrees of freedom: keys with values, a line of headings, then frames. Positions in millimetres; of the
//! rotation the matrix is taken, which stands column by column, because its angles depend on settings that are not in the file.

use hal_sim::body::coordinates::quaternion;

use super::cells::Cells;
use super::{Body, CaptureError, Options};

/// Columns of a body: X Y Z, Roll Pitch Yaw, Residual, Rot\[0\] … Rot\[8\].
const MATRIX: usize = 7;
const COLUMNS: usize = 16;

/// Reads the bodies.
pub fn bodies(cells: &Cells, options: &Options) -> Result<Vec<Body>, CaptureError> {
    let value = |key: &str| cells.beginning_with(key).and_then(|row| cells.row(row).get(1).cloned());
    let rate = value("FREQUENCY").and_then(|text| text.parse::<f64>().ok()).or(options.rate_hz);
    let Some(rate) = rate.filter(|rate| *rate > 0.0) else {
        return Err(cells.wrong(
            0,
            "",
            "there is no FREQUENCY: say the frame rate with --rate, in Python rate_hz".into(),
        ));
    };
    let Some(names) = cells.beginning_with("BODY_NAMES").map(|row| cells.row(row)[1..].to_vec()) else {
        return Err(cells.wrong(0, "", "there is no BODY_NAMES: export 6D data, not trajectories".into()));
    };
    let is_header = |row: &[String]| row.iter().any(|cell| cell == "X") && row.iter().any(|cell| cell == "Rot[0]");
    let Some((header, heading)) = cells.from(0).find(|(_, row)| is_header(row)) else {
        return Err(cells.wrong(0, "", "there is no line of headings with X and Rot[0]".into()));
    };
    let first = heading.iter().position(|cell| cell == "X").unwrap_or(0);
    let time = heading.iter().position(|cell| cell == "Time");
    let mut bodies: Vec<Body> = names.into_iter().map(Body::named).collect();
    for (index, (row, _)) in cells.from(header + 1).enumerate() {
        let t = match time {
            Some(column) => cells.number(row, column, "Time")?,
            None => index as f64 / rate,
        };
        for (k, body) in bodies.iter_mut().enumerate() {
            let mut read = [0.0; COLUMNS];
            for (column, value) in read.iter_mut().enumerate() {
                *value = cells.number(row, first + k * COLUMNS + column, &body.name)?;
            }
            let m = &read[MATRIX..];
            // A body that was lost is all zeros.
            let seen = m.iter().any(|value| *value != 0.0) && m.iter().all(|value| value.is_finite());
            let turned = seen.then(|| quaternion([[m[0], m[3], m[6]], [m[1], m[4], m[7]], [m[2], m[5], m[8]]]));
            let position = if seen { [0, 1, 2].map(|axis| 1e-3 * read[axis]) } else { [f64::NAN; 3] };
            body.push(t, position, turned);
        }
    }
    Ok(bodies)
}
