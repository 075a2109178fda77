//! The path from above: the robot where it starts and ends, and the way of its centroid.

use std::ops::Range;

use hal_sim::body::snapshot::Pose;
use hal_sim::body::{Plan, Snapshot, Track};
use plotters::prelude::*;

use super::map::{self, Chart, Margins, Words};
use super::mm;
use crate::panel::{Area, Drawn, INK, PlotError, picture};

const SIZE: (u32, u32) = (1100, 480);
const MARGINS: Margins = Margins { left: 70, right: 20, top: 34, bottom: 46 };
const START: RGBColor = RGBColor(150, 150, 150);
const END: RGBColor = RGBColor(0, 114, 178);
const PATH: RGBColor = RGBColor(213, 94, 0);
/// Radius of the dots at the path's ends, pixels.
const DOT: i32 = 5;
/// Size of their names, pixels.
const FONT: i32 = 14;
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
        name_ends(&chart, &right, &path)
    })
}

/// A dot where the path starts and one where it ends, each with its name where the path is not.
fn name_ends(chart: &Chart<'_, '_>, area: &Area<'_>, path: &[[f64; 2]]) -> Drawn {
    let ground = chart.plotting_area();
    let pixels: Vec<Pixel> = path.iter().map(|point| ground.map_coordinate(&(point[0], point[1]))).collect();
    let (across, down) = ground.get_pixel_range();
    let (left, top) = area.get_base_pixel();
    let mut taken = Taken { pixels: along(&pixels), across, down };
    let label = ("sans-serif", FONT).into_font().color(&INK);
    for (at, name, colour) in [(pixels[0], "start", START), (pixels[pixels.len() - 1], "end", END)] {
        // 8 pixels a character are more than the mean width of the font at this size.
        let size = (8 * name.len() as i32, FONT);
        let corner = taken.beside(at, size);
        taken.pixels.extend(along(&[corner, (corner.0 + size.0, corner.1 + size.1)]));
        area.draw(&Circle::new((at.0 - left, at.1 - top), DOT, colour.filled()))?;
        area.draw(&Text::new(name, (corner.0 - left, corner.1 - top), label.clone()))?;
    }
    Ok(())
}

type Pixel = (i32, i32);

/// The pixels of a line, every second one or so.
fn along(points: &[Pixel]) -> Vec<Pixel> {
    let between = |pair: &[Pixel]| {
        let ([from, to], steps) =
            ([pair[0], pair[1]], (pair[1].0 - pair[0].0).abs().max((pair[1].1 - pair[0].1).abs()) / 2);
        (0..=steps).map(move |k| {
            let at = |a: i32, b: i32| a + (b - a) * k / steps.max(1);
            (at(from.0, to.0), at(from.1, to.1))
        })
    };
    points.windows(2).flat_map(between).collect()
}

/// What is drawn already, and the ground that a name may lie on.
struct Taken {
    pixels: Vec<Pixel>,
    across: Range<i32>,
    down: Range<i32>,
}

impl Taken {
    /// The upper left corner of a name that covers the least of what is drawn, as near a point as that allows.
    fn beside(&self, (x, y): Pixel, (width, height): (i32, i32)) -> Pixel {
        let places = [DOT + 5, 24, 44, 70].into_iter().flat_map(|gap| {
            let (left, right) = (x - gap - width, x + gap);
            let (above, below) = (y - gap - height, y + gap);
            let (centre, middle) = (x - width / 2, y - height / 2);
            [(right, middle), (left, middle), (centre, above), (centre, below)].into_iter().chain([
                (right, above),
                (right, below),
                (left, above),
                (left, below),
            ])
        });
        let covered = |&(left, top): &Pixel| {
            const CLEAR: i32 = 3;
            let inside = left >= self.across.start
                && left + width <= self.across.end
                && top >= self.down.start
                && top + height <= self.down.end;
            let across = left - CLEAR..=left + width + CLEAR;
            let down = top - CLEAR..=top + height + CLEAR;
            let over = self.pixels.iter().filter(|(x, y)| across.contains(x) && down.contains(y)).count();
            if inside { over } else { usize::MAX }
        };
        places.min_by_key(covered).unwrap_or((x, y))
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::synthetic;

    fn numbers(text: &str) -> Vec<f64> {
        text.split([',', ' ']).filter_map(|number| number.parse().ok()).collect()
    }

    #[test]
    fn the_names_of_the_ends_are_beside_the_path() {
        let robot = robot_file::Robot::load(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml").as_ref()).unwrap();
        let track = synthetic::track(&Plan::new(&robot).unwrap(), 3.0, 0.005);
        let drawn = draw(&track).unwrap();
        let document = roxmltree::Document::parse(&drawn).unwrap();
        let lines = || document.descendants().filter(|node| node.has_tag_name("polyline"));
        let lengths = lines().map(|line| numbers(line.attribute("points").unwrap()).len());
        let longest = lengths.max().unwrap();
        // The centroid's path, the longest line, is drawn in the right view last.
        let path = lines().rfind(|line| numbers(line.attribute("points").unwrap()).len() == longest).unwrap();
        let path = numbers(path.attribute("points").unwrap());
        for name in ["start", "end"] {
            let texts = document.descendants().filter(|node| node.has_tag_name("text"));
            let label = texts.clone().find(|node| node.text().is_some_and(|text| text.trim() == name)).unwrap();
            let [x, y] = ["x", "y"].map(|key| label.attribute(key).unwrap().parse::<f64>().unwrap());
            let width = 7.0 * name.len() as f64;
            let over = path.chunks(2).filter(|p| (x..x + width).contains(&p[0]) && (y..y + 14.0).contains(&p[1]));
            assert_eq!(over.count(), 0, "{name} at {x}, {y}");
            assert!(x > f64::from(SIZE.0) * 0.55 && x + width < f64::from(SIZE.0) && y + 14.0 < f64::from(SIZE.1));
        }
        // No paper over the path: the background is the only rectangle without a line.
        let over = document.descendants().filter(|node| node.has_tag_name("rect")).count();
        assert_eq!(over, 1);
    }

    #[test]
    fn a_name_finds_the_side_where_nothing_is_drawn() {
        let beside =
            |line: &[Pixel]| Taken { pixels: along(line), across: 0..400, down: 0..400 }.beside((200, 200), (40, 14));
        assert_eq!(beside(&[(0, 200), (200, 200)]), (210, 193));
        assert_eq!(beside(&[(200, 200), (400, 200)]), (150, 193));
        assert_eq!(beside(&[(0, 200), (400, 200)]), (180, 176));
    }
}
