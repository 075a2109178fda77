//! A track as a table: `track.csv`, see `docs/recordings.md`.

use std::fmt::Write as _;

use hal_sim::body::{Snapshot, Track};

/// One row a snapshot, lines end with a line feed. Metres, radians, newtons; world frame.
#[must_use]
pub fn track_csv(track: &Track) -> String {
    let mut text = header(track);
    let mut heading = None;
    for (index, snapshot) in track.snapshots.iter().enumerate() {
        let now = snapshot.heading();
        let unwrapped = heading.map_or(now, |last: f64| last + common::wrap(now - last));
        heading = Some(unwrapped);
        row(&mut text, snapshot, unwrapped, track.energy_j.get(index).copied());
    }
    text
}

fn header(track: &Track) -> String {
    let mut names: Vec<String> = ["t_s", "x_m", "y_m", "z_m", "yaw_rad"].map(String::from).into();
    if track.plan.eccentric.is_some() {
        names.push("rotor_angle_rad".into());
    }
    if !track.energy_j.is_empty() {
        names.push("energy_j".into());
    }
    for module in 1..=track.plan.modules.len() {
        let of_module = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"];
        names.extend(of_module.map(|name| format!("module{module}_{name}")));
    }
    let of_foot = ["x_m", "y_m", "z_m", "fx_n", "fy_n", "fz_n"];
    for (module, side) in (1..=track.plan.modules.len()).flat_map(|module| [(module, "left"), (module, "right")]) {
        names.extend(of_foot.map(|name| format!("foot{module}_{side}_{name}")));
    }
    names.join(",") + "\n"
}

/// Positions to 0.1 µm, orientations to 1e-7, forces to 10 µN.
fn row(text: &mut String, snapshot: &Snapshot, heading: f64, energy_j: Option<f64>) {
    let _ = write!(text, "{}", rounded(snapshot.time_s, 6));
    let mut cells = |values: &[f64], decimals: usize| {
        for value in values {
            let _ = write!(text, ",{}", rounded(*value, decimals));
        }
    };
    cells(&snapshot.centroid(), 7);
    cells(&[heading], 7);
    if let Some(rotor) = &snapshot.rotor {
        cells(&[rotor.angle], 6);
    }
    cells(energy_j.as_slice(), 6);
    for module in &snapshot.modules {
        cells(&module.position, 7);
        cells(&module.orientation, 7);
    }
    for foot in &snapshot.feet {
        cells(&foot.position, 7);
        cells(&foot.force, 5);
    }
    text.push('\n');
}

/// The shortest number that is the value to so many decimals.
fn rounded(value: f64, decimals: usize) -> f64 {
    let scale = 10f64.powi(i32::try_from(decimals).unwrap_or(0));
    // Not −0.
    (value * scale).round() / scale + 0.0
}
