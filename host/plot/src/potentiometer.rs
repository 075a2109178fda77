//! The residual over the angle as a picture.

use crate::report::svg::{Chart, STYLE, fixed, number, range};
use identify::potentiometer::{PotentiometerFit, ResidualBin};

/// Of the picture, pixels.
const SIZE: (f64, f64) = (720.0, 320.0);

/// Error of the reading over the shaft angle before and after, the blind arc shaded: a self-contained SVG file.
#[must_use]
pub fn residual_svg(fit: &PotentiometerFit) -> String {
    let all = fit.bins.iter().flat_map(|b| [b.before_deg, b.after_deg]).chain([-0.5, 0.5]);
    let y = range(all).unwrap_or((-1.0, 1.0));
    let mut chart = Chart::new("residual", SIZE, (-180.0, 180.0), y);
    let (from, to) = (fit.correction.blind_from_deg, fit.correction.blind_to_deg);
    chart.shade(from, to);
    chart.level(0.0, "floor");
    chart.note(
        0.5 * (from + to),
        y.1 - 0.07 * (y.1 - y.0),
        "middle",
        &format!("blind arc {}°…{}°", number(from.round()), number(to.round())),
    );
    // The line breaks across the arc.
    let broken = |value: fn(&ResidualBin) -> f64| {
        let mut points = Vec::new();
        let mut last = f64::NEG_INFINITY;
        for bin in &fit.bins {
            if bin.angle_deg - last > 12.0 {
                points.push((f64::NAN, f64::NAN));
            }
            last = bin.angle_deg;
            points.push((bin.angle_deg, value(bin)));
        }
        points
    };
    chart.line(broken(|b| b.before_deg), "before");
    chart.line(broken(|b| b.after_deg), "after");
    chart.dots(broken(|b| b.after_deg), 2.0, "after fill");
    let title = format!(
        "Angle error of the reading: before {}° RMS (orange), after {}° RMS (blue)",
        number((fit.before_rms_deg * 100.0).round() / 100.0),
        number((fit.after_rms_deg * 1000.0).round() / 1000.0)
    );
    let svg = chart.finish(&title, "shaft angle, °", "error, °", &title);
    // A style sheet of its own, so that the file stands alone; a page's would do for an inlined one.
    let paper = "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>";
    let svg = svg.replacen("<svg ", &format!("<svg width=\"{}\" height=\"{}\" ", SIZE.0, SIZE.1), 1);
    svg.replacen("<defs>", &format!("<style>{}</style>{paper}<defs>", fixed(STYLE)), 1)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use identify::potentiometer::potentiometer;
    use robot_file::Robot;
    use simulation::{Drive, Plan, recording, run};

    use super::*;

    #[test]
    fn the_picture_stands_alone() {
        let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
        let plan = Plan { drive: Drive::parse("duty:1").unwrap(), seconds: 2.5, faults: Vec::new() };
        let trace = run(&robot, 3, &hal_sim::Settings::default(), &plan).unwrap();
        let fit = potentiometer(&robot, &recording(&trace, &robot)).unwrap();
        let svg = residual_svg(&fit);
        roxmltree::Document::parse(&svg).unwrap();
        let titled = crate::under_title("scram-26, run.mcap", &svg);
        assert!(titled.contains(">scram-26, run.mcap</text>") && titled.contains("height=\"354\""), "{titled}");
        // Programs other than browsers show what they do not know in black.
        assert!(!svg.contains("var(") && svg.contains("stroke:#c8500a") && svg.contains("stroke:#0a63c9"), "{svg}");
        if let Ok(folder) = std::env::var("SCRAM_REPORT_SAMPLES") {
            std::fs::write(format!("{folder}/potentiometer.svg"), &svg).unwrap();
        }
    }
}
