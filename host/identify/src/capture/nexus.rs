//! Nexus's (Vicon's) CSV: a section's name, the frame rate, names, headings, units, then frames. Rotations are rotation vectors
//! ("helical angles") in degrees, positions in millimetres.

use super::cells::Cells;
use super::pose::of_rotation_vector;
use super::{Body, CaptureError};

/// The sections that hold rigid bodies.
pub const SECTIONS: [&str; 3] = ["Segments", "Objects", "Global Angle (Segments)"];

/// Reads the first section.
pub fn bodies(cells: &Cells) -> Result<Vec<Body>, CaptureError> {
    let rate = cells.number(1, 0, "")?;
    if !(rate.is_finite() && rate > 0.0) {
        return Err(cells.wrong(1, "", "the second line is the frame rate in Hz".into()));
    }
    let (names, headings, units) = (cells.row(2), cells.row(3), cells.row(4));
    let unit = |column: usize| units.get(column).map_or("", String::as_str);
    let firsts: Vec<usize> = (0..headings.len()).filter(|&k| headings[k] == "RX").collect();
    let mut bodies = Vec::new();
    for first in firsts {
        let expected = ["RX", "RY", "RZ", "TX", "TY", "TZ"];
        if !expected.iter().enumerate().all(|(k, word)| headings.get(first + k).is_some_and(|cell| cell == word)) {
            return Err(cells.wrong(3, "RX", "after RX come RY, RZ, TX, TY and TZ".into()));
        }
        let radians = match unit(first) {
            "rad" => 1.0,
            _ => std::f64::consts::PI / 180.0,
        };
        let metres = match unit(first + 3) {
            "m" => 1.0,
            "cm" => 1e-2,
            _ => 1e-3,
        };
        let mut body = Body::named(names.get(first).cloned().unwrap_or_default());
        let start = cells.number(5, 0, "Frame")?;
        for (row, cell) in cells.from(5) {
            // The next section begins with its name.
            if cell.first().is_some_and(|word| word.parse::<f64>().is_err()) {
                break;
            }
            let frame = cells.number(row, 0, "Frame")?;
            let mut read = [f64::NAN; 6];
            for (k, value) in read.iter_mut().enumerate() {
                *value = cells.number(row, first + k, expected[k])?;
            }
            let [rx, ry, rz, x, y, z] = read;
            let turned = of_rotation_vector([rx * radians, ry * radians, rz * radians]);
            body.push((frame - start) / rate, [x * metres, y * metres, z * metres], Some(turned));
        }
        bodies.push(body);
    }
    Ok(bodies)
}
