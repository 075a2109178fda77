//! Oscillations of a backbone, measured and simulated.

use identify::backbone::Track;
use plotters::style::RGBColor;

use crate::panel::{Line, Panel, PlotError, Size, render};

const SIZE: Size = Size { width: 900, height: 210 };
const MEASURED: RGBColor = RGBColor(150, 150, 150);
const SIMULATED: [RGBColor; 3] = [RGBColor(200, 90, 30), RGBColor(30, 130, 80), RGBColor(40, 90, 190)];
const AXES: [&str; 3] = ["x (torsion)", "y (stiff)", "z (soft)"];
/// An axis that turns by less than this share of the run's largest swing has no line.
const SHOWN: f64 = 0.05;

/// A panel a run: angles of the backbone's end over the time since its release, measured (grey) and simulated.
///
/// # Errors
/// The drawing library refuses.
pub fn oscillation_svg(tracks: &[Track]) -> Result<String, PlotError> {
    let panels: Vec<Panel> = tracks.iter().map(panel).collect();
    render(&panels, SIZE)
}

fn panel(track: &Track) -> Panel {
    let of = |angles: &[[f64; 3]], axis: usize| -> Vec<(f64, Option<f64>)> {
        let deg = |angle: f64| Some(angle.to_degrees()).filter(|deg| deg.is_finite());
        track.t_s.iter().zip(angles).map(|(t, angles)| (*t, deg(angles[axis]))).collect()
    };
    let swing = |axis: usize| track.simulated.iter().map(|angles| angles[axis].abs()).fold(0.0, f64::max);
    let largest = (0..3).map(swing).fold(0.0, f64::max);
    let axes: Vec<usize> = (0..3).filter(|axis| swing(*axis) > SHOWN * largest).collect();
    let line =
        |label: &str, colour, width, points| Line { label: label.to_owned(), colour, dashed: false, width, points };
    // One line for all that was measured, broken between the axes: one entry in the legend.
    let measured = axes.iter().flat_map(|&axis| of(&track.measured, axis).into_iter().chain([(0.0, None)]));
    let mut lines = vec![line("measured", MEASURED, 3, measured.collect())];
    lines.extend(axes.iter().map(|&axis| line(AXES[axis], SIMULATED[axis], 1, of(&track.simulated, axis))));
    let role = if track.held_out { "held out" } else { "fitted" };
    Panel {
        title: format!("{} ({role})", track.run),
        y_label: "angle of the end, °".into(),
        x: (0.0, track.t_s.last().copied().unwrap_or(1.0)),
        y: None,
        band: None,
        lines,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_has_its_panel_and_only_the_axes_that_swing() {
        let track = Track {
            run: "release-1".into(),
            t_s: vec![0.0, 0.1, 0.2],
            measured: vec![[0.0, 0.1, f64::NAN], [0.0, -0.1, 0.0], [0.0, 0.05, 0.0]],
            simulated: vec![[0.0, 0.1, 0.0], [0.0, -0.1, 0.0], [0.001, 0.05, 0.0]],
            held_out: true,
        };
        let svg = oscillation_svg(&[track]).unwrap();
        assert!(svg.contains("release-1 (held out)") && svg.contains("y (stiff)"), "{svg}");
        assert!(!svg.contains("torsion"), "{svg}");
    }
}
