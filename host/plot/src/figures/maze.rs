//! A robot on its way through a maze, in frames as the thesis's Fig. 5.5.

use hal_sim::body::Track;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{Area, Drawn, FigureError, INK, font, sheet};
use crate::Exit;
use crate::picture::outlines;
use crate::walk::map::corners;

const TRAIL: RGBColor = RGBColor(33, 102, 172);
const MODULE: RGBColor = RGBColor(150, 158, 170);
const FIRST_MODULE: RGBColor = RGBColor(214, 96, 20);
const EXIT: RGBColor = RGBColor(205, 232, 212);
/// Frames beside one another.
const ACROSS: usize = 3;
/// Longer side of a maze, pixels.
const SIDE: f64 = 300.0;
/// Round each frame, pixels.
const MARGIN: i32 = 16;
/// Over each frame, pixels.
const HEAD: i32 = 26;
/// Over everything, pixels.
const TITLE: i32 = 44;

/// Draws the walls, the exit, the robot's modules (the first one, with the eccentric, orange) and its way so far, seen from above, at so many
/// even times of a walk.
///
/// # Errors
/// The drawing library refuses.
pub fn maze_svg(title: &str, track: &Track, exit: Exit, frames: usize) -> Result<String, FigureError> {
    let map = Map::of(track);
    let cell = (map.size.0 + 2 * MARGIN, map.size.1 + HEAD + MARGIN);
    let down = frames.div_ceil(ACROSS).max(1) as i32;
    sheet(title, ((cell.0 * ACROSS as i32) as u32, (TITLE + cell.1 * down) as u32), |root| {
        root.draw(&Text::new(title.to_owned(), (MARGIN, 12), font(20)))?;
        for frame in 0..frames {
            let place = frame * track.snapshots.len().saturating_sub(1) / frames.saturating_sub(1).max(1);
            let (column, row) = ((frame % ACROSS) as i32, (frame / ACROSS) as i32);
            let area = root.clone().shrink((column * cell.0 + MARGIN, TITLE + row * cell.1), cell);
            draw_frame(&area, &map, (track, exit), place)?;
        }
        Ok(())
    })
}

fn draw_frame(area: &Area<'_>, map: &Map, (track, exit): (&Track, Exit), place: usize) -> Drawn {
    let Some(snapshot) = track.snapshots.get(place) else { return Ok(()) };
    area.draw(&Text::new(format!("{:.0} s", snapshot.time_s), (0, 4), font(15)))?;
    draw_exit(area, map, exit)?;
    let mut trail: Vec<_> = track.snapshots[..=place].iter().map(|snapshot| map.pixel(snapshot.centroid())).collect();
    trail.dedup();
    area.draw(&PathElement::new(trail, TRAIL.stroke_width(1)))?;
    for (index, outline) in outlines(&track.plan, snapshot).enumerate() {
        let colour = if index == 0 { FIRST_MODULE } else { MODULE };
        let [a, b, c, d] = outline.map(|corner| map.pixel(corner));
        area.draw(&Polygon::new([a, b, c, d], colour.filled()))?;
        area.draw(&PathElement::new([a, b, c, d, a], INK))?;
    }
    for wall in &track.plan.walls {
        let ends = [wall.from, wall.to].map(|[x, y]| map.pixel([x, y, 0.0]));
        area.draw(&PathElement::new(ends, INK.stroke_width(3)))?;
    }
    Ok(())
}

/// Under everything else: the robot ends in it.
fn draw_exit(area: &Area<'_>, map: &Map, exit: Exit) -> Drawn {
    let [low, _, high, _] = exit.corners().map(|[x, y]| map.pixel([x, y, 0.0]));
    area.draw(&Rectangle::new([low, high], EXIT.filled()))?;
    let size = (0.35 * exit.edge_m * map.pixels_per_m).min(15.0) as i32;
    let word = font(size).pos(Pos::new(HPos::Center, VPos::Center));
    area.draw(&Text::new("EXIT", map.pixel([exit.centre[0], exit.centre[1], 0.0]), word))?;
    Ok(())
}

/// From metres to a frame's pixels.
struct Map {
    low: [f64; 2],
    high: [f64; 2],
    pixels_per_m: f64,
    size: (i32, i32),
}

impl Map {
    /// All walls are in it, and the whole way.
    fn of(track: &Track) -> Self {
        let walls = track.plan.walls.iter().flat_map(|wall| [wall.from, wall.to]);
        let way = track.snapshots.iter().map(|snapshot| snapshot.centroid()).map(|[x, y, _]| [x, y]);
        let (low, high) = corners(walls.chain(way));
        let extent = [0, 1].map(|axis| (high[axis] - low[axis]).max(1e-3));
        let pixels_per_m = SIDE / extent[0].max(extent[1]);
        let pixels = |extent: f64| (extent * pixels_per_m).ceil() as i32;
        Self { low, high, pixels_per_m, size: (pixels(extent[0]), pixels(extent[1])) }
    }

    fn pixel(&self, [x, y, _]: [f64; 3]) -> (i32, i32) {
        let pixels = |length: f64| (length * self.pixels_per_m).round() as i32;
        (pixels(x - self.low[0]), HEAD + pixels(self.high[1] - y))
    }
}

#[cfg(test)]
mod tests {
    use hal_sim::body::{Plan, Wall};

    use super::*;
    use crate::view::synthetic;

    #[test]
    fn every_frame_has_its_time_its_walls_and_its_modules() {
        let robot = robot_file::Robot::load(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml").as_ref()).unwrap();
        let plan = Plan::new(&robot).unwrap();
        let walls = vec![Wall { from: [-0.3, -0.2], to: [0.5, -0.2] }, Wall { from: [0.5, -0.2], to: [0.5, 0.2] }];
        let track = synthetic::track(&Plan { walls, ..plan }, 8.0, 0.1);
        let drawn = maze_svg("a maze", &track, Exit { centre: [0.4, -0.1], edge_m: 0.2 }, 9).unwrap();
        let document = roxmltree::Document::parse(&drawn).unwrap();
        let count = |tag: &str| document.descendants().filter(|node| node.has_tag_name(tag)).count();
        let texts: Vec<&str> =
            document.descendants().filter(|node| node.has_tag_name("text")).filter_map(|node| node.text()).collect();
        for words in ["a maze", "0 s", "4 s", "8 s"] {
            assert!(texts.iter().any(|text| text.trim() == words), "{words}: {texts:?}");
        }
        assert_eq!(count("polygon"), 9 * track.plan.modules.len());
        assert_eq!(texts.iter().filter(|text| text.trim() == "EXIT").count(), 9);
    }
}
