//! Which foot touches when, as in the thesis's figures 2.2 and 5.3.

use hal_sim::body::{Snapshot, Track};
use plotters::prelude::*;

use super::foot_name;
use crate::panel::{INK, PlotError, decimals, picture, tick_label};

const WIDTH: u32 = 1100;
/// Left and right of the bars, pixels.
const LEFT: i32 = 92;
const RIGHT: i32 = 64;
const TOP: i32 = 62;
const BOTTOM: i32 = 48;
/// A foot's row and its bar, pixels.
const ROW: i32 = 30;
const BAR: i32 = 18;
/// The last part of the run is shown, s.
const SHOWN_S: f64 = 1.0;
const TOUCHES: RGBColor = RGBColor(0, 114, 178);
const LANE: RGBColor = RGBColor(238, 240, 243);
const TURN: RGBColor = RGBColor(213, 94, 0);

/// A row a foot, a bar where the ground carries it; a mark for every time the eccentric points ahead.
pub fn draw(track: &Track) -> Result<String, PlotError> {
    let end = track.snapshots.last().map_or(0.0, |s| s.time_s);
    let from = track.snapshots.partition_point(|s| s.time_s < end - SHOWN_S - 1e-9);
    let shown = &track.snapshots[from..];
    let feet = shown.first().map_or(0, |s| s.feet.len());
    let bottom = TOP + ROW * i32::try_from(feet).unwrap_or(0);
    picture("gait", (WIDTH, u32::try_from(bottom + BOTTOM).unwrap_or(400)), |root| {
        let (start, end) = (shown.first().map_or(0.0, |s| s.time_s), end);
        let right = i32::try_from(WIDTH)? - RIGHT;
        let pixel =
            |time: f64| LEFT + (f64::from(right - LEFT) * (time - start) / (end - start).max(1e-9)).round() as i32;
        let text = |size: i32| ("sans-serif", size).into_font().color(&INK);
        root.draw(&Text::new("Feet on the ground", (LEFT, 9), text(18)))?;
        let share = "share".to_owned();
        root.draw(&Text::new(share, (right + 12, TOP - 22), text(14)))?;
        for foot in 0..feet {
            let top = TOP + ROW * i32::try_from(foot)? + (ROW - BAR) / 2;
            root.draw(&Text::new(foot_name(foot), (20, top + 1), text(15)))?;
            root.draw(&Rectangle::new([(LEFT, top), (right, top + BAR)], LANE.filled()))?;
            for (on, off) in stances(shown, foot) {
                let ends = [(pixel(on), top), (pixel(off).max(pixel(on) + 1), top + BAR)];
                root.draw(&Rectangle::new(ends, TOUCHES.filled()))?;
            }
            let carried = shown.iter().filter(|s| s.feet[foot].touches()).count();
            let percent = format!("{:.0} %", 100.0 * carried as f64 / shown.len() as f64);
            root.draw(&Text::new(percent, (right + 12, top + 1), text(14)))?;
        }
        let turns = turns(shown);
        for at in &turns {
            let x = pixel(*at);
            root.draw(&PathElement::new(vec![(x, TOP - 4), (x, bottom)], TURN.stroke_width(1)))?;
        }
        if !turns.is_empty() {
            let x = LEFT + 190;
            root.draw(&PathElement::new(vec![(x, 10), (x, 26)], TURN.stroke_width(1)))?;
            root.draw(&Text::new("the eccentric points ahead", (x + 8, 11), text(15)))?;
        }
        time_axis(root, &pixel, (start, end), bottom)
    })
}

fn time_axis(
    root: &crate::panel::Area<'_>,
    pixel: &impl Fn(f64) -> i32,
    (start, end): (f64, f64),
    top: i32,
) -> crate::panel::Drawn {
    let text = |size: i32| ("sans-serif", size).into_font().color(&INK);
    root.draw(&PathElement::new(vec![(pixel(start), top), (pixel(end), top)], INK.stroke_width(1)))?;
    let every = 0.1 * (end - start).max(1e-9);
    let times: Vec<f64> = (0..=10).map(|mark| start + every * f64::from(mark)).collect();
    let digits = decimals(&times).min(2);
    for time in times {
        let x = pixel(time);
        root.draw(&PathElement::new(vec![(x, top), (x, top + 5)], INK.stroke_width(1)))?;
        let label = tick_label(time, digits);
        root.draw(&Text::new(label, (x - 9, top + 8), text(14)))?;
    }
    root.draw(&Text::new("time / s", ((pixel(start) + pixel(end)) / 2 - 25, top + 27), text(15)))?;
    Ok(())
}

/// From when to when the ground carries a foot, s.
fn stances(shown: &[Snapshot], foot: usize) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    let mut before = false;
    // A force is that of the last step before its snapshot.
    for pair in shown.windows(2) {
        let touches = pair[1].feet[foot].touches();
        match (touches, before, found.last_mut()) {
            (true, true, Some(stance)) => stance.1 = pair[1].time_s,
            (true, ..) => found.push((pair[0].time_s, pair[1].time_s)),
            _ => {}
        }
        before = touches;
    }
    found
}

/// When the eccentric goes through angle 0, either way round, s.
fn turns(shown: &[Snapshot]) -> Vec<f64> {
    let turn = |s: &Snapshot| s.rotor.map(|rotor| rotor.angle / std::f64::consts::TAU);
    let crossing = |pair: &[Snapshot]| {
        let (a, b) = (turn(&pair[0])?, turn(&pair[1])?);
        let through = a.max(b).floor();
        let crossed = through > a.min(b) && a != b;
        crossed.then(|| pair[0].time_s + (pair[1].time_s - pair[0].time_s) * (through - a) / (b - a))
    };
    shown.windows(2).filter_map(crossing).collect()
}
