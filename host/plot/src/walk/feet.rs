//! The traces of the feet, as in the thesis's figures 2.1 and 5.3: from the side and from above, against the mean motion
//! of the module.

use std::f64::consts::TAU;

use hal_sim::body::{Snapshot, Track};
use plotters::prelude::*;

use super::map::{self, Margins, Words};
use super::{foot_name, mm};
use crate::panel::{INK, PlotError, picture};

/// A view of a foot, pixels.
const VIEW: (u32, u32) = (280, 230);
const TITLE: u32 = 40;
const MARGINS: Margins = Margins { left: 62, right: 10, top: 30, bottom: 38 };
/// The last part of the run is shown, s: as many whole turns of the eccentric as go into it, or all of it without one.
const SHOWN_S: f64 = 0.5;
/// What a view shows at least, mm: a foot that stands still is a dot.
const LEAST_MM: f64 = 0.5;
const AIR: RGBColor = RGBColor(86, 180, 233);
const GROUND: RGBColor = RGBColor(213, 94, 0);

/// A foot's trace, mm: ahead, to the left, and height of its lowest point; and whether it touches.
struct Trace {
    points: Vec<([f64; 3], bool)>,
}

/// A row a module: left foot and right foot, each from the side and from above. One scale a row.
pub fn draw(track: &Track) -> Result<String, PlotError> {
    let modules = track.plan.modules.len().max(1);
    let height = TITLE + VIEW.1 * u32::try_from(modules).unwrap_or(1);
    picture("feet", (4 * VIEW.0, height), |root| {
        let shown = last_part(&track.snapshots);
        let feet = shown.first().map_or(0, |s| s.feet.len());
        let traces: Vec<Trace> = (0..feet).map(|foot| trace(track, shown, foot)).collect();
        let (title, below) = root.split_vertically(TITLE);
        let seconds = shown.last().map_or(0.0, |s| s.time_s) - shown.first().map_or(0.0, |s| s.time_s);
        let text = format!("Feet against the mean motion of their modules, the last {seconds:.2} s");
        title.draw(&Text::new(text, (14, 10), ("sans-serif", 18).into_font().color(&INK)))?;
        let mut x = 640;
        for (name, colour) in [("on the ground", GROUND), ("in the air", AIR)] {
            title.draw(&PathElement::new(vec![(x, 19), (x + 28, 19)], colour.stroke_width(3)))?;
            title.draw(&Text::new(name, (x + 34, 12), ("sans-serif", 15).into_font().color(&INK)))?;
            x += 170;
        }
        let areas = below.split_evenly((modules, 4));
        for (foot, trace) in traces.iter().enumerate() {
            // The same spans in all views of a module, so that its feet compare; the middle is each one's own.
            let row = &traces[foot / 2 * 2..][..2];
            let span = |axis: usize| row.iter().map(|t| t.range(axis)).map(|(a, b)| b - a).fold(LEAST_MM, f64::max);
            let spans = [span(0), span(1), span(2)];
            for (view, (up, direction)) in [(2, "z / mm"), (1, "y / mm")].into_iter().enumerate() {
                let area = &areas[4 * (foot / 2) + 2 * (foot % 2) + view];
                let middle = [0, up].map(|axis| 0.5 * (trace.range(axis).0 + trace.range(axis).1));
                let half = [0.5 * spans[0], 0.5 * spans[1].max(spans[2])];
                let reach = ([0, 1].map(|i| middle[i] - half[i]), [0, 1].map(|i| middle[i] + half[i]));
                let title = format!("{}, from {}", foot_name(foot), if view == 0 { "the right" } else { "above" });
                let words = Words { title: &title, x: "x / mm", y: direction };
                let mut chart = map::axes(area, MARGINS, map::ranges(area, MARGINS, reach, 0.08), words)?;
                for pair in trace.points.windows(2) {
                    let colour = if pair[1].1 { GROUND } else { AIR };
                    let points = [pair[0].0, pair[1].0].map(|p| [p[0], p[up]]);
                    map::line(&mut chart, &points, colour.stroke_width(2))?;
                }
            }
        }
        Ok(())
    })
}

fn last_part(snapshots: &[Snapshot]) -> &[Snapshot] {
    let end = snapshots.last().map_or(0.0, |s| s.time_s);
    let shown = &snapshots[snapshots.partition_point(|s| s.time_s < end - SHOWN_S - 1e-9)..];
    let angle = |s: &Snapshot| s.rotor.map_or(0.0, |rotor| rotor.angle);
    let Some(last) = shown.last().map(angle) else { return shown };
    let whole = shown.first().map_or(0.0, |s| ((last - angle(s)).abs() / TAU).floor());
    if whole == 0.0 {
        return shown;
    }
    let from = shown.iter().rposition(|s| (last - angle(s)).abs() >= whole * TAU).unwrap_or(0);
    &shown[from..]
}

/// In a frame that moves evenly with the module's centre, ahead along the mean heading.
fn trace(track: &Track, shown: &[Snapshot], foot: usize) -> Trace {
    let centre = |axis: usize| even_motion(shown, move |s| s.modules[foot / 2].position[axis]);
    let (x, y) = (centre(0), centre(1));
    // The heading hardly turns in half a second; its mean as a vector cannot wrap.
    let (sin, cos) = shown.iter().map(|s| s.heading().sin_cos()).fold((0.0, 0.0), |sum, h| (sum.0 + h.0, sum.1 + h.1));
    let length = sin.hypot(cos).max(f64::MIN_POSITIVE);
    let (sin, cos) = (sin / length, cos / length);
    let radius = track.plan.contact.as_ref().map_or(0.0, |contact| contact.foot_radius);
    let points = shown.iter().map(|s| {
        let foot = &s.feet[foot];
        let (dx, dy) = (foot.position[0] - x(s.time_s), foot.position[1] - y(s.time_s));
        ([mm(cos * dx + sin * dy), mm(cos * dy - sin * dx), mm(foot.position[2] - radius)], foot.touches())
    });
    Trace { points: points.collect() }
}

/// Even motion through a coordinate's mean, by its change from begin to end: over whole turns that is the walk without the
/// shaking.
fn even_motion(shown: &[Snapshot], value: impl Fn(&Snapshot) -> f64) -> impl Fn(f64) -> f64 {
    let count = shown.len().max(1) as f64;
    let time = shown.iter().map(|s| s.time_s).sum::<f64>() / count;
    let mean = shown.iter().map(&value).sum::<f64>() / count;
    let slope = match shown {
        [first, .., last] => (value(last) - value(first)) / (last.time_s - first.time_s),
        _ => 0.0,
    };
    move |at| mean + slope * (at - time)
}

impl Trace {
    fn range(&self, axis: usize) -> (f64, f64) {
        let values = self.points.iter().map(|(point, _)| point[axis]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    }
}
