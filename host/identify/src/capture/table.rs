//! Any table with a header line.
//!
//! Columns are found by these names, or by others that [`Options::columns`] puts in their place:
//!
//! | column | what |
//! |---|---|
//! | `t_s` or `t_ms` | time; without it, [`Options::rate_hz`] |
//! | `x_m y_m z_m` or `x_mm …` | position |
//! | `qw qx qy qz` | orientation, unit quaternion |
//! | `angle_x_rad angle_y_rad angle_z_rad` or `…_deg` | orientation as a rotation vector; one alone is enough |
//! | `yaw_rad` or `yaw_deg` | heading alone |

use std::f64::consts::PI;

use super::cells::Cells;
use super::pose::of_rotation_vector;
use super::{Body, CaptureError, Options};

/// Where something is and in what unit.
struct Column {
    place: usize,
    name: String,
    unit: f64,
}

/// Reads the one body of a table.
pub(super) fn body(cells: &Cells, options: &Options) -> Result<Body, CaptureError> {
    for (name, column) in &options.columns {
        if !cells.row(0).contains(column) {
            return Err(cells.wrong(0, column, format!("there is no such column, which {name} is to be taken from")));
        }
    }
    let find = |units: &[(&str, f64)]| {
        units.iter().find_map(|(name, unit)| {
            let wanted =
                options.columns.iter().find(|(own, _)| own == name).map_or(*name, |(_, column)| column.as_str());
            let place = cells.row(0).iter().position(|cell| cell == wanted)?;
            Some(Column { place, name: wanted.to_owned(), unit: *unit })
        })
    };
    let degrees = PI / 180.0;
    let time = find(&[("t_s", 1.0), ("t_ms", 1e-3)]);
    let axis = |name: &str| find(&[(&format!("{name}_m"), 1.0), (&format!("{name}_mm"), 1e-3)]);
    let turn = |name: &str| find(&[(&format!("{name}_rad"), 1.0), (&format!("{name}_deg"), degrees)]);
    let positions = ["x", "y", "z"].map(axis);
    let quaternion = ["qw", "qx", "qy", "qz"].map(|name| find(&[(name, 1.0)]));
    let vector = ["angle_x", "angle_y", "angle_z"].map(turn);
    let yaw = turn("yaw");
    let angles = quaternion.iter().all(Option::is_some) || vector.iter().any(Option::is_some) || yaw.is_some();
    if !angles && positions.iter().all(Option::is_none) {
        return Err(cells.wrong(
            0,
            "",
            "no column of a pose: x_m, y_m and yaw_rad, or angle_x_rad, or qw to qz".into(),
        ));
    }
    if time.is_none() && options.rate_hz.is_none() {
        return Err(cells.wrong(
            0,
            "t_s",
            "there is no time: name its column (--map t_s=COLUMN) or say --rate, in Python rate_hz".into(),
        ));
    }
    let mut body = Body::named(String::new());
    for (index, (row, _)) in cells.from(1).enumerate() {
        let value = |column: &Option<Column>, missing: f64| match column {
            Some(column) => cells.number(row, column.place, &column.name).map(|number| number * column.unit),
            None => Ok(missing),
        };
        let t = match (&time, options.rate_hz) {
            (None, Some(rate)) => index as f64 / rate,
            _ => value(&time, f64::NAN)?,
        };
        let no_z = if positions[2].is_none() { 0.0 } else { f64::NAN };
        let position = [value(&positions[0], f64::NAN)?, value(&positions[1], f64::NAN)?, value(&positions[2], no_z)?];
        let turned = if quaternion.iter().all(Option::is_some) {
            let [w, x, y, z] = &quaternion;
            Some([value(w, 0.0)?, value(x, 0.0)?, value(y, 0.0)?, value(z, 0.0)?])
        } else if vector.iter().any(Option::is_some) {
            let [x, y, z] = &vector;
            Some(of_rotation_vector([value(x, 0.0)?, value(y, 0.0)?, value(z, 0.0)?]))
        } else if yaw.is_some() {
            Some(of_rotation_vector([0.0, 0.0, value(&yaw, 0.0)?]))
        } else {
            None
        };
        body.push(t, position, turned);
    }
    Ok(body)
}
