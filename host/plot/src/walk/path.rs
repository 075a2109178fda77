//! The path from above: the robot where it starts and ends, and the way of its centroid.

use hal_sim::body::snapshot::Pose;
use hal_sim::body::{Plan, Snapshot, Track};
use plotters::prelude::*;

use super::map::{self, Chart, Margins, Words};
use super::mm;
use crate::panel::{Drawn, INK, PlotError, picture};

const SIZE: (u32, u32) = (1100, 480);
const MARGINS: Margins = Margins { left: 70, right: 20, top: 34, bottom: 46 };
const START: RGBColor = RGBColor(150, 150, 150);
const END: RGBColor = RGBColor(0, 114, 178);
const PATH: RGBColor = RGBColor(213, 94, 0);
/// Points that a line keeps at most.
const MOST_POINTS: usize = 4000;

/// Two views of one scale each: the whole robot, and the centroid's path alone.
pub fn draw(track: &Track) -> Result<String, PlotError> {
    picture("path", SIZE, |root| {
        let (Some(first), Some(last)) = (track.snapshots.first(), track.snapshots.last()) else { return Ok(()) };
        let step = track.snapshots.len().div_ceil(MOST_POINTS).max(1);
        let mut path: Vec<[f64; 2]> = track.snapshots.iter().step_by(step).map(centroid).collect();
        path.push(centroid(last));
        let (left, right) = root.split_horizontally(SIZE.0 * 11 / 20);

        let outlines = [first, last].map(|s| outlines(&track.plan, s));
        let reach = map::corners(outlines.iter().flatten().flatten().chain(&path).copied());
        let words = Words {
            title: "From above: start grey, end blue; dot: the eccentric, thick edge: the front",
            x: "x / mm, ahead",
            y: "y / mm, to the left",
        };
        let ranges = map::ranges(&left, MARGINS, reach, 0.06);
        let mut chart = map::axes(&left, MARGINS, ranges, words)?;
        for (snapshot, boxes, colour) in [(first, &outlines[0], START), (last, &outlines[1], END)] {
            robot(&mut chart, snapshot, boxes, colour)?;
        }
        map::line(&mut chart, &path, PATH.stroke_width(2))?;

        let words = Words { title: "Path of the modules' centroid", x: "x / mm", y: "y / mm" };
        let ranges = map::ranges(&right, MARGINS, map::corners(path.iter().copied()), 0.12);
        let mut chart = map::axes(&right, MARGINS, ranges, words)?;
        map::line(&mut chart, &path, PATH.stroke_width(1))?;
        let label = ("sans-serif", 14).into_font().color(&INK);
        for (at, name, colour) in [(path[0], "start", START), (path[path.len() - 1], "end", END)] {
            // The path may go on behind its name.
            let paper = WHITE.mix(0.8).filled();
            let mark = EmptyElement::at((at[0], at[1]))
                + Rectangle::new([(7, -9), (12 + 8 * name.len() as i32, 9)], paper)
                + Circle::new((0, 0), 5, colour.filled())
                + Text::new(name, (9, -6), label.clone());
            chart.draw_series(std::iter::once(mark))?;
        }
        Ok(())
    })
}

fn centroid(snapshot: &Snapshot) -> [f64; 2] {
    let [x, y, _] = snapshot.centroid();
    [mm(x), mm(y)]
}

/// The modules' outlines from above, closed, mm.
fn outlines(plan: &Plan, snapshot: &Snapshot) -> Vec<Vec<[f64; 2]>> {
    let boxes = plan.modules.iter().zip(&snapshot.modules);
    boxes
        .map(|(module, pose)| {
            let (x, y) = (0.5 * module.size[0], 0.5 * module.size[1]);
            [[x, y], [-x, y], [-x, -y], [x, -y], [x, y]].iter().map(|corner| above(pose, *corner)).collect()
        })
        .collect()
}

/// A point of a part's middle plane from above, mm.
fn above(pose: &Pose, [x, y]: [f64; 2]) -> [f64; 2] {
    let [w, i, j, k] = pose.orientation;
    let ahead = [1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j + w * k)];
    let aside = [2.0 * (i * j - w * k), 1.0 - 2.0 * (i * i + k * k)];
    [0, 1].map(|axis| mm(pose.position[axis] + ahead[axis] * x + aside[axis] * y))
}

/// Modules with a mark at the front of the first, backbones, and the bolt.
fn robot(chart: &mut Chart<'_, '_>, snapshot: &Snapshot, boxes: &[Vec<[f64; 2]>], colour: RGBColor) -> Drawn {
    for outline in boxes {
        let corners: Vec<(f64, f64)> = outline.iter().map(|p| (p[0], p[1])).collect();
        chart.draw_series(std::iter::once(Polygon::new(corners, colour.mix(0.15).filled())))?;
        map::line(chart, outline, colour.stroke_width(2))?;
    }
    let per_backbone = snapshot.segments.len() / (snapshot.modules.len() - 1).max(1);
    for backbone in snapshot.segments.chunks(per_backbone.max(1)) {
        let points: Vec<[f64; 2]> = backbone.iter().map(|pose| above(pose, [0.0, 0.0])).collect();
        map::line(chart, &points, colour.stroke_width(3))?;
    }
    if let (Some(rotor), Some(outline)) = (&snapshot.rotor, boxes.first()) {
        let bolt = (mm(rotor.bolt[0]), mm(rotor.bolt[1]));
        chart.draw_series(std::iter::once(Circle::new(bolt, 4, colour.filled())))?;
        // The front edge of the first module.
        map::line(chart, &[outline[0], outline[3]], colour.stroke_width(5))?;
    }
    Ok(())
}
