//! The robot at an instant as pixels: for frames of a video and for whoever learns from pictures. The page of [`crate::view`] is what
//! people turn around.

mod camera;
mod solids;

use hal_sim::body::{Plan, Snapshot};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

use camera::Camera;
pub(crate) use solids::outlines;
use solids::{Face, faces, shadows};

/// Around the robot, m: what the camera shows without walls.
const AROUND_M: f64 = 0.13;
/// Distance of the lines on the ground, m.
const GRID_M: f64 = 0.02;
/// How far the lines go from what the camera looks at, in its radii.
const GRID_REACH: f64 = 2.6;

/// A robot, where it has been (m) and its walls, seen from above and aside: rows of red, green and blue, from the top.
///
/// Without walls the camera follows the robot, else it shows all of them.
///
/// # Panics
/// If width or height is 0 or more than 8000.
#[must_use]
pub fn picture(plan: &Plan, snapshot: &Snapshot, trail: &[[f64; 2]], [width, height]: [u32; 2]) -> Vec<u8> {
    assert!((1..=8000).contains(&width) && (1..=8000).contains(&height), "{width} by {height} pixels");
    let (middle, reach) = shown(plan, snapshot);
    let camera = Camera::new(middle, reach, [width, height]);
    let Some(mut canvas) = Pixmap::new(width, height) else { return vec![] };
    canvas.fill(color(GROUND));
    let mut draw = Draw { canvas: &mut canvas, camera: &camera };
    draw.grid(middle, reach);
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

fn color([red, green, blue, alpha]: Colour) -> Color {
    Color::from_rgba(red, green, blue, alpha).unwrap_or(Color::BLACK)
}

/// What the camera looks at: the middle, and how far around it, m.
fn shown(plan: &Plan, snapshot: &Snapshot) -> ([f64; 3], f64) {
    let ends = || plan.walls.iter().flat_map(|wall| [wall.from, wall.to]);
    let bounds = |axis: usize| {
        let all = ends().map(|end| end[axis]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    if plan.walls.is_empty() {
        let [x, y, _] = snapshot.centroid();
        return ([x, y, 0.012], AROUND_M);
    }
    let [[left, right], [near, far]] = [bounds(0), bounds(1)];
    ([0.5 * (left + right), 0.5 * (near + far), 0.0], 0.5 * (right - left).max(far - near))
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
        let drawn = picture(&plan, &snapshot, &[], size);
        assert_eq!(drawn.len(), 320 * 240 * 3);
        // What the robot covers is what changes when it is not there.
        let nobody = Snapshot { modules: vec![], segments: vec![], feet: vec![], rotor: None, ..snapshot.clone() };
        let empty = Plan { modules: vec![], backbones: vec![], ..plan.clone() };
        let camera = Camera::new([snapshot.centroid()[0], snapshot.centroid()[1], 0.012], AROUND_M, size);
        let mut background = Pixmap::new(320, 240).unwrap();
        background.fill(color(GROUND));
        Draw { canvas: &mut background, camera: &camera }.grid(shown(&plan, &snapshot).0, AROUND_M);
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
        let plain = picture(&plan, &snapshot, &[], [200, 150]);
        let trail = picture(&plan, &snapshot, &[[-0.12, -0.05], [0.0, -0.06]], [200, 150]);
        assert_ne!(plain, trail);
        plan.walls = vec![Wall { from: [-0.3, 0.1], to: [0.1, 0.1] }, Wall { from: [-0.3, -0.1], to: [0.1, -0.1] }];
        assert_ne!(picture(&plan, &snapshot, &[], [200, 150]), plain);
    }
}
