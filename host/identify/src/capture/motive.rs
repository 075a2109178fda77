//! Motive's (OptiTrack's) CSV: pairs of settings in the first line, five or six lines of headings, then frames.

use super::cells::Cells;
use super::{Body, CaptureError};

/// Reads the rigid bodies; markers are left out.
pub fn bodies(cells: &Cells) -> Result<Vec<Body>, CaptureError> {
    let header =
        cells.beginning_with("Frame").ok_or_else(|| cells.wrong(0, "", "there is no line `Frame,Time …`".into()))?;
    let setting = |name: &str| {
        let pairs = cells.row(0);
        pairs.iter().position(|cell| cell == name).and_then(|place| pairs.get(place + 1)).map(String::as_str)
    };
    let metres = match setting("Length Units") {
        None | Some("Meters") => 1.0,
        Some("Centimeters") => 1e-2,
        Some("Millimeters") => 1e-3,
        Some(other) => {
            return Err(cells.wrong(
                0,
                "",
                format!("Length Units `{other}`: meters, centimeters or millimeters are read"),
            ));
        }
    };
    if let Some(other) = setting("Rotation Type").filter(|kind| *kind != "Quaternion") {
        return Err(cells.wrong(0, "", format!("Rotation Type `{other}`: export rotations as quaternions")));
    }
    // From the headings upwards: what is measured, then (in newer files) parents, identifiers, names, types.
    let measured = header - 1;
    let heading = |has: &dyn Fn(&str) -> bool| (1..measured).find(|&k| cells.row(k).iter().any(|cell| has(cell)));
    let types = heading(&|cell| cell == "Rigid Body");
    let Some(types) = types else { return Ok(Vec::new()) };
    let names = types + 1;
    let mut found: Vec<(String, [Option<usize>; 7])> = Vec::new();
    for (column, kind) in cells.row(types).iter().enumerate() {
        let cell = |row: usize| cells.row(row).get(column).map_or("", String::as_str);
        let place = match (cell(measured), cell(header)) {
            ("Rotation", "W") => 0,
            ("Rotation", "X") => 1,
            ("Rotation", "Y") => 2,
            ("Rotation", "Z") => 3,
            ("Position", "X") => 4,
            ("Position", "Y") => 5,
            ("Position", "Z") => 6,
            _ => continue,
        };
        if kind != "Rigid Body" {
            continue;
        }
        let name = cell(names);
        if found.last().is_none_or(|(last, _)| last != name) {
            found.push((name.to_owned(), [None; 7]));
        }
        if let Some((_, columns)) = found.last_mut() {
            columns[place] = Some(column);
        }
    }
    found.into_iter().map(|(name, columns)| body(cells, header, metres, name, columns)).collect()
}

fn body(
    cells: &Cells,
    header: usize,
    metres: f64,
    name: String,
    columns: [Option<usize>; 7],
) -> Result<Body, CaptureError> {
    let mut body = Body::named(name);
    for (row, _) in cells.from(header + 1) {
        let t = cells.number(row, 1, "Time (Seconds)")?;
        let read = |place: usize| match columns[place] {
            Some(column) => cells.number(row, column, &body.name),
            None => Ok(f64::NAN),
        };
        let quaternion = [read(0)?, read(1)?, read(2)?, read(3)?];
        let position = [read(4)? * metres, read(5)? * metres, read(6)? * metres];
        body.push(t, position, Some(quaternion));
    }
    Ok(body)
}
