//! A robot that turns in place: what its shaft was to do, and where it went, as the thesis's Fig. 5.4.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use robot_file::gait::GaitStep;

use super::{Area, Drawn, FigureError, Margins, Scale, axes, font, sheet};

/// One way of turning.
#[derive(Clone, Debug, PartialEq)]
pub struct TurningRun {
    /// What it is called.
    pub title: String,
    /// What the shaft was to do, each from its time on, s, to that of the next one.
    pub orders: Vec<(f64, GaitStep)>,
    /// Its end, s.
    pub seconds: f64,
    /// Forward and to the left of the start, mm, and the heading there, rad, at even times.
    pub path: Vec<[f64; 3]>,
}

const LINE: RGBColor = RGBColor(33, 102, 172);
const ARROW: RGBColor = RGBColor(214, 96, 20);
/// Inside of the trajectory, pixels.
const SIDE: i32 = 320;
/// Height of what the shaft was to do, pixels.
const PROFILE: i32 = 190;
const MARGINS: Margins = Margins { left: 74, right: 20, top: 40, bottom: 50 };
/// Over everything.
const TITLE: i32 = 40;
/// Points of a path that are drawn, about.
const POINTS: usize = 500;
/// Changes of what a shaft is to do that can still be told apart side by side.
const CHANGES: usize = 40;
/// What is held for this share of the time has room for its name.
const NAMED: f64 = 0.2;
/// Arrows along a path, about, and their length as a share of the side.
const ARROWS: usize = 12;
const ARROW_LENGTH: f64 = 0.07;

/// Draws runs side by side, all to one scale: above where each went, with arrows ahead; below what it was given.
///
/// # Errors
/// The drawing library refuses.
pub fn turning_svg(title: &str, runs: &[TurningRun]) -> Result<String, FigureError> {
    let cell = (MARGINS.left + SIDE + MARGINS.right, MARGINS.top + SIDE + MARGINS.bottom);
    let size = ((cell.0 * runs.len().max(1) as i32) as u32, (TITLE + cell.1 + PROFILE) as u32);
    let (middle, half) = extent(runs);
    sheet(title, size, |root| {
        root.draw(&Text::new(title.to_owned(), (20, 12), font(20)))?;
        for (index, run) in runs.iter().enumerate() {
            let left = index as i32 * cell.0;
            draw_path(&root.clone().shrink((left, TITLE), cell), run, middle, half)?;
            draw_profile(&root.clone().shrink((left, TITLE + cell.1), (cell.0, PROFILE)), run)?;
        }
        Ok(())
    })
}

fn draw_path(area: &Area<'_>, run: &TurningRun, [x, y]: [f64; 2], half: f64) -> Drawn {
    area.draw(&Text::new(run.title.clone(), (MARGINS.left, 14), font(16)))?;
    let x = Scale { range: (x - half, x + half), words: "forward / mm", marks: 7 };
    let y = Scale { range: (y - half, y + half), words: "to the left / mm", marks: 7 };
    let mut chart = axes(area, MARGINS, &x, &y)?;
    let drawn = run.path.iter().step_by(run.path.len().div_ceil(POINTS).max(1)).chain(run.path.last());
    chart.draw_series(LineSeries::new(drawn.map(|p| (p[0], p[1])), LINE.stroke_width(2)))?;
    let every = run.path.len().div_ceil(ARROWS).max(1);
    for [x, y, heading] in run.path.iter().step_by(every) {
        let (sin, cos) = heading.sin_cos();
        let length = 2.0 * half * ARROW_LENGTH;
        let tip = (x + length * cos, y + length * sin);
        chart.draw_series([PathElement::new(vec![(*x, *y), tip], ARROW.stroke_width(2))])?;
        chart.draw_series([Circle::new(tip, 3, ARROW.filled())])?;
    }
    if let Some([x, y, _]) = run.path.first() {
        chart.draw_series([Circle::new((*x, *y), 4, LINE.filled())])?;
    }
    Ok(())
}

fn draw_profile(area: &Area<'_>, run: &TurningRun) -> Drawn {
    const ABOVE: Margins = Margins { top: 8, ..MARGINS };
    let (held, until) = held(run);
    let words = match until < run.seconds {
        true => format!("time / s, the beginning of {:.1} s", run.seconds),
        false => "time / s".to_owned(),
    };
    let x = Scale { range: (0.0, until), words: &words, marks: 7 };
    let swings: Vec<[f64; 2]> = held.iter().filter_map(|(_, _, what)| angles(what)).collect();
    if swings.is_empty() {
        let hz = |what: &GaitStep| if let GaitStep::Frequency(hz) = what { *hz } else { 0.0 };
        let fastest = held.iter().fold(1.0_f64, |fastest, (_, _, what)| fastest.max(hz(what).abs()));
        let y = Scale { range: (-1.15 * fastest, 1.15 * fastest), words: "frequency / Hz", marks: 5 };
        let line = held.iter().flat_map(|(from, to, what)| [(*from, hz(what)), (*to, hz(what))]);
        axes(area, ABOVE, &x, &y)?.draw_series(LineSeries::new(line, LINE.stroke_width(1)))?;
        return Ok(());
    }
    // Where the shaft swings, and where it turns round and round.
    let low = swings.iter().fold(-180.0_f64, |low, [from, _]| low.min(*from));
    let high = swings.iter().fold(180.0_f64, |high, [_, to]| high.max(*to));
    let edge = 0.05 * (high - low);
    let y = Scale { range: (low - edge, high + edge), words: "angle of the shaft / °", marks: 5 };
    let mut chart = axes(area, ABOVE, &x, &y)?;
    for (start, end, what) in &held {
        let ([from, to], colour) = angles(what).map_or(([low, high], ARROW), |angles| (angles, LINE));
        chart.draw_series([Rectangle::new([(*start, from), (*end, to)], colour.mix(0.35).filled())])?;
        if end - start >= NAMED * until {
            let middle = font(14).pos(Pos::new(HPos::Center, VPos::Center));
            chart.draw_series([Text::new(what.to_string(), (0.5 * (start + end), 0.5 * (from + to)), middle)])?;
        }
    }
    Ok(())
}

/// What the shaft was to do from when to when, one thing after the other, and where that ends: so early that each can be seen.
fn held(run: &TurningRun) -> (Vec<(f64, f64, GaitStep)>, f64) {
    let mut held: Vec<(f64, f64, GaitStep)> = Vec::new();
    let ends = run.orders.iter().skip(1).map(|(t, _)| *t).chain([run.seconds]);
    for ((from, what), end) in run.orders.iter().zip(ends) {
        if let Some((_, until, _)) = held.last_mut().filter(|(.., before)| before == what) {
            *until = end;
        } else if held.len() == CHANGES {
            break;
        } else {
            held.push((*from, end, *what));
        }
    }
    let until = held.last().map_or(run.seconds, |(_, until, _)| *until);
    (held, until)
}

/// Between which angles the shaft swings, degrees, if it does.
fn angles(what: &GaitStep) -> Option<[f64; 2]> {
    if let GaitStep::Oscillation(angles) = what { Some(*angles) } else { None }
}

/// The middle of all paths, and half of what is to be seen on either side of it.
fn extent(runs: &[TurningRun]) -> ([f64; 2], f64) {
    let points = || runs.iter().flat_map(|run| &run.path);
    let range = |axis: usize| {
        points().fold((0.0_f64, 0.0_f64), |(low, high), point| (low.min(point[axis]), high.max(point[axis])))
    };
    let (x, y) = (range(0), range(1));
    let widest = (x.1 - x.0).max(y.1 - y.0).max(1.0);
    ([0.5 * (x.0 + x.1), 0.5 * (y.0 + y.1)], 0.65 * widest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_on_is_one_thing_and_only_so_many_changes_are_shown() {
        let orders = |every: usize| {
            (0..1000).map(move |i| (0.01 * i as f64, if usize::is_multiple_of(i / every, 2) { 8.0 } else { -8.0 }))
        };
        let run = |every: usize| TurningRun {
            title: String::new(),
            orders: orders(every).map(|(t, hz)| (t, hz.into())).collect(),
            seconds: 10.0,
            path: vec![],
        };
        let (slow, until) = held(&run(500));
        assert_eq!((slow, until), (vec![(0.0, 5.0, 8.0.into()), (5.0, 10.0, (-8.0).into())], 10.0));
        let (fast, until) = held(&run(5));
        assert_eq!((fast.len(), fast[1]), (CHANGES, (0.05, 0.1, (-8.0).into())));
        assert!((until - 0.05 * CHANGES as f64).abs() < 1e-9, "{until}");
    }

    #[test]
    fn a_frequency_is_held_and_every_run_has_its_title() {
        let run = |title: &str| TurningRun {
            title: title.to_owned(),
            orders: vec![(0.0, 7.0.into()), (1.0, (-6.0).into())],
            seconds: 2.0,
            path: (0..40).map(|i| [f64::from(i), 0.5 * f64::from(i), 0.1 * f64::from(i)]).collect(),
        };
        let drawn = turning_svg("turning", &[run("learned"), run("constant 7 Hz")]).unwrap();
        let document = roxmltree::Document::parse(&drawn).unwrap();
        let texts: Vec<&str> =
            document.descendants().filter(|node| node.has_tag_name("text")).filter_map(|node| node.text()).collect();
        for title in ["turning", "learned", "constant 7 Hz"] {
            assert!(texts.iter().any(|text| text.trim() == title), "{title}: {texts:?}");
        }
    }
}
