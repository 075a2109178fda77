//! The robot at an instant as pixels: for frames of a video and for whoever learns from pictures. The page of [`crate::view`] is what
//! people turn around.

mod camera;
mod letters;
mod solids;

use hal_sim::body::{Plan, Snapshot};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

use crate::Exit;
use crate::walk::map::corners;
use camera::{Camera, View};
pub(crate) use solids::outlines;
use solids::{Face, WALL_M, faces, shadows};

/// Around the robot, m: what the camera shows without walls.
const AROUND_M: f64 = 0.13;
/// Distance of the lines on the ground, m.
const GRID_M: f64 = 0.02;
/// How far the lines go from what the camera looks at, in its radii.
const GRID_REACH: f64 = 2.6;

/// A robot, where it has been (m), its walls and the exit of its maze, seen from above and aside: rows of red, green and blue, from the top.
///
/// Without walls the camera follows the robot, else it shows all of them.
///
/// # Panics
/// If width or height is 0 or more than 8000.
#[must_use]
pub fn picture(
    plan: &Plan,
    snapshot: &Snapshot,
    trail: &[[f64; 2]],
    exit: Option<Exit>,
    [width, height]: [u32; 2],
) -> Vec<u8> {
    assert!((1..=8000).contains(&width) && (1..=8000).contains(&height), "{width} by {height} pixels");
    let view = shown(plan, snapshot);
    let camera = Camera::new(&view, [width, height]);
    let Some(mut canvas) = Pixmap::new(width, height) else { return vec![] };
    canvas.fill(color(GROUND));
    let mut draw = Draw { canvas: &mut canvas, camera: &camera };
    draw.grid(view.middle, view.reach());
    if let Some(exit) = exit {
        draw.exit(exit);
    }
    for shadow in shadows(plan, snapshot) {
        draw.fill(&shadow, SHADOW);
    }
    draw.line(&trail.iter().map(|[x, y]| [*x, *y, 0.0]).collect::<Vec<_>>(), TRAIL, 0.0016);
    let mut faces = faces(plan, snapshot, &camera);
    // The farthest first.
    faces.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    for Face { corners, colour, .. } in &faces {
        draw.fill(corners, *colour);
    }
    canvas.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect()
}

/// Red, green, blue and opacity, 0 … 1. They are those of the 3D page.
type Colour = [f32; 4];
const GROUND: Colour = [0.914, 0.925, 0.941, 1.0];
const GRID: Colour = [0.706, 0.745, 0.788, 1.0];
const SHADOW: Colour = [0.086, 0.125, 0.169, 0.18];
const TRAIL: Colour = [0.761, 0.255, 0.047, 0.9];
const EXIT: Colour = [0.745, 0.886, 0.784, 1.0];
const EXIT_WORD: Colour = [0.102, 0.400, 0.243, 1.0];

fn color([red, green, blue, alpha]: Colour) -> Color {
    Color::from_rgba(red, green, blue, alpha).unwrap_or(Color::BLACK)
}

/// Without walls a circle about the robot, else all walls and the robot.
fn shown(plan: &Plan, snapshot: &Snapshot) -> View {
    if plan.walls.is_empty() {
        let [x, y, _] = snapshot.centroid();
        let around = (0..24).map(|k| (f64::from(k) * std::f64::consts::TAU / 24.0).sin_cos());
        let circle = around.map(|(sin, cos)| [x + AROUND_M * cos, y + AROUND_M * sin, 0.012]);
        return View { middle: [x, y, 0.012], points: circle.collect(), keeps_middle: true };
    }
    let ends = plan.walls.iter().flat_map(|wall| [wall.from, wall.to]);
    let robot = outlines(plan, snapshot).flatten().map(|[x, y, _]| [x, y]);
    let all: Vec<[f64; 2]> = ends.chain(robot).collect();
    let (low, high) = corners(all.iter().copied());
    let top = top_m(plan).max(WALL_M);
    let points = all.iter().flat_map(|[x, y]| [[*x, *y, 0.0], [*x, *y, top]]).collect();
    let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.0];
    View { middle, points, keeps_middle: false }
}

/// How high a robot is that stands, m: the same at every instant, so that the camera does not shake.
fn top_m(plan: &Plan) -> f64 {
    let Some(first) = plan.modules.first() else { return 0.0 };
    let bolt = plan.eccentric.map_or(0.0, |eccentric| eccentric.height + 0.5 * eccentric.bolt[1]);
    first.centre_height + bolt.max(0.5 * first.size[2])
}

struct Draw<'a> {
    canvas: &'a mut Pixmap,
    camera: &'a Camera,
}

impl Draw<'_> {
    fn path(&self, points: &[[f64; 3]], closed: bool) -> Option<Path> {
        let mut path = PathBuilder::new();
        for (k, point) in points.iter().enumerate() {
            let [x, y] = self.camera.project(*point)?;
            if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if closed {
            path.close();
        }
        path.finish()
    }

    fn fill(&mut self, corners: &[[f64; 3]], colour: Colour) {
        let Some(path) = self.path(corners, true) else { return };
        self.canvas.fill_path(&path, &paint(colour), FillRule::Winding, Transform::identity(), None);
    }

    /// `width` in m, at the middle of the picture.
    fn line(&mut self, points: &[[f64; 3]], colour: Colour, width: f64) {
        let Some(path) = self.path(points, false) else { return };
        let stroke = Stroke {
            width: self.camera.pixels(width).max(1.0),
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        self.canvas.stroke_path(&path, &paint(colour), &stroke, Transform::identity(), None);
    }

    /// Its cell on the ground, and the word in it, upright as the camera sees it.
    fn exit(&mut self, exit: Exit) {
        self.fill(&exit.corners().map(|[x, y]| [x, y, 0.0]), EXIT);
        let [x, y] = exit.centre;
        for stroke in letters::exit() {
            let place = |at: &[f64; 2]| self.camera.beside([x, y, 0.0], at.map(|share| share * exit.edge_m));
            self.line(&stroke.iter().map(place).collect::<Vec<_>>(), EXIT_WORD, 0.02 * exit.edge_m);
        }
    }

    /// Lines on the ground, a heavier one every fifth, paler towards their ends.
    fn grid(&mut self, middle: [f64; 3], reach: f64) {
        let spacing = if reach > 4.0 * AROUND_M { 5.0 * GRID_M } else { GRID_M };
        let radius = GRID_REACH * reach;
        for axis in 0..2 {
            let first = ((middle[axis] - radius) / spacing).ceil() as i64;
            let last = ((middle[axis] + radius) / spacing).floor() as i64;
            for line in first..=last {
                let at = line as f64 * spacing;
                let half = (radius * radius - (at - middle[axis]).powi(2)).max(0.0).sqrt();
                let strong = line.rem_euclid(5) == 0;
                for piece in 0..24 {
                    let along = |k: i32| middle[1 - axis] + half * (f64::from(k) / 12.0 - 1.0);
                    let point = |along: f64| if axis == 0 { [at, along, 0.0] } else { [along, at, 0.0] };
                    let far = ((along(piece) - middle[1 - axis]).hypot(at - middle[axis]) / radius).min(1.0);
                    let [red, green, blue, _] = GRID;
                    let colour = [red, green, blue, (1.0 - far.powi(2)) as f32 * if strong { 1.0 } else { 0.55 }];
                    self.line(
                        &[point(along(piece)), point(along(piece + 1))],
                        colour,
                        if strong { 8e-4 } else { 4e-4 },
                    );
                }
            }
        }
    }
}

fn paint(colour: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(color(colour));
    paint
}

#[cfg(test)]
mod tests {
    use hal_sim::body::{Ensemble, Settings, Wall};

    use super::*;

    fn robot() -> (Plan, Snapshot) {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let plan = Plan::new(&robot_file::Robot::load(&file).unwrap()).unwrap();
        let snapshot = Ensemble::new(std::slice::from_ref(&plan), Settings::default()).unwrap().snapshot(0);
        (plan, snapshot)
    }

    #[test]
    fn the_robot_is_in_the_middle_of_its_picture() {
        let (plan, snapshot) = robot();
        let size = [320, 240];
        let drawn = picture(&plan, &snapshot, &[], None, size);
        assert_eq!(drawn.len(), 320 * 240 * 3);
        // What the robot covers is what changes when it is not there.
        let nobody = Snapshot { modules: vec![], segments: vec![], feet: vec![], rotor: None, ..snapshot.clone() };
        let empty = Plan { modules: vec![], backbones: vec![], ..plan.clone() };
        let view = shown(&plan, &snapshot);
        let camera = Camera::new(&view, size);
        let mut background = Pixmap::new(320, 240).unwrap();
        background.fill(color(GROUND));
        Draw { canvas: &mut background, camera: &camera }.grid(view.middle, view.reach());
        assert!(faces(&empty, &nobody, &camera).is_empty());
        let changed: Vec<usize> = (0..320 * 240)
            .filter(|k| {
                let pixel = background.pixels()[*k];
                drawn[3 * k..3 * k + 3] != [pixel.red(), pixel.green(), pixel.blue()]
            })
            .collect();
        assert!((5000..40_000).contains(&changed.len()), "{} pixels", changed.len());
        let mean =
            |of: &dyn Fn(usize) -> usize| changed.iter().map(|k| of(*k) as f64).sum::<f64>() / changed.len() as f64;
        let (x, y) = (mean(&|k| k % 320), mean(&|k| k / 320));
        assert!((x - 160.0).abs() < 30.0 && (y - 120.0).abs() < 30.0, "its middle is at {x}, {y}");
    }

    #[test]
    fn a_trail_and_walls_are_seen() {
        let (mut plan, snapshot) = robot();
        let plain = picture(&plan, &snapshot, &[], None, [200, 150]);
        let trail = picture(&plan, &snapshot, &[[-0.12, -0.05], [0.0, -0.06]], None, [200, 150]);
        assert_ne!(plain, trail);
        plan.walls = vec![Wall { from: [-0.3, 0.1], to: [0.1, 0.1] }, Wall { from: [-0.3, -0.1], to: [0.1, -0.1] }];
        assert_ne!(picture(&plan, &snapshot, &[], None, [200, 150]), plain);
    }

    /// The robot in the corner of a maze of so many cells.
    fn in_a_maze([columns, rows]: [f64; 2]) -> (Plan, Snapshot, Exit) {
        let (mut plan, snapshot) = robot();
        let edge_m = 0.18;
        let [x, y] = [columns, rows].map(|cells| (cells - 0.5) * edge_m);
        let low = -0.5 * edge_m;
        let square = [[low, low], [x, low], [x, y], [low, y], [low, low]];
        plan.walls = square.windows(2).map(|ends| Wall { from: ends[0], to: ends[1] }).collect();
        (plan, snapshot, Exit { centre: [columns - 1.0, rows - 1.0].map(|cells| cells * edge_m), edge_m })
    }

    #[test]
    fn a_whole_maze_and_its_robot_are_in_pictures_of_every_size() {
        for cells in [[4.0, 4.0], [5.0, 3.0], [1.0, 12.0], [12.0, 2.0]] {
            let (plan, snapshot, _) = in_a_maze(cells);
            for size in [[64, 48], [640, 480], [1280, 960], [1920, 400], [300, 900]] {
                let camera = Camera::new(&shown(&plan, &snapshot), size);
                let mut filled = [0.0_f32; 2];
                for corner in faces(&plan, &snapshot, &camera).iter().flat_map(|face| &face.corners) {
                    let pixel = camera.project(*corner).unwrap();
                    for axis in 0..2 {
                        let off = (2.0 * pixel[axis] / size[axis] as f32 - 1.0).abs();
                        assert!(off < 0.99, "{cells:?} cells, {size:?} pixels: a corner at {pixel:?}");
                        filled[axis] = filled[axis].max(off);
                    }
                }
                // It is no dot in the middle either.
                assert!(filled[0].max(filled[1]) > 0.9, "{cells:?} cells, {size:?} pixels: {filled:?}");
            }
        }
    }

    #[test]
    fn the_exit_of_a_maze_is_marked_and_named() {
        let (plan, snapshot, exit) = in_a_maze([4.0, 4.0]);
        let size = [1280, 960];
        let camera = Camera::new(&shown(&plan, &snapshot), size);
        let drawn = picture(&plan, &snapshot, &[], Some(exit), size);
        let at = |place: [f64; 3]| {
            let [x, y] = camera.project(place).unwrap();
            let first = 3 * (y as usize * size[0] as usize + x as usize);
            [0, 1, 2].map(|k| f32::from(drawn[first + k]) / 255.0)
        };
        let is = |found: [f32; 3], colour: Colour| (0..3).all(|k| (found[k] - colour[k]).abs() < 0.01);
        let [x, y] = exit.centre;
        let off = 0.3 * exit.edge_m;
        for place in [[x - off, y + off], [x + off, y - off]] {
            assert!(is(at([place[0], place[1], 0.0]), EXIT), "{:?}", at([place[0], place[1], 0.0]));
        }
        assert!(!is(at([x - exit.edge_m, y, 0.0]), EXIT), "the cell beside it");
        // The upright of the last letter, below its bar.
        let [low, _] = letters::exit().last().unwrap().as_slice().try_into().unwrap_or([[0.0; 2]; 2]);
        let word = camera.beside([x, y, 0.0], low.map(|share| share * exit.edge_m));
        assert!(is(at(word), EXIT_WORD), "{:?}", at(word));
    }
}
