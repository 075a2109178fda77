//! From the world to the picture.

use crate::walk::map::corners;

type Vector = [f64; 3];

/// From where it looks: below the horizontal and against +x, rad.
const DOWN: f64 = 0.75;
const ASIDE: f64 = -1.05;
/// Distance from the middle, in how far from it the farthest point is that is to be seen.
const DISTANCE: f64 = 5.5;
/// Part of the picture that is filled.
const FILLED: f64 = 0.94;

/// What is to be seen.
pub(super) struct View {
    /// What the camera looks at, m.
    pub middle: Vector,
    /// What has to be in the picture, m.
    pub points: Vec<Vector>,
    /// Whether the middle is in the picture's middle: else the points fill the picture.
    pub keeps_middle: bool,
}

impl View {
    /// How far from the middle the farthest point is, m.
    pub fn reach(&self) -> f64 {
        let off = |point: &Vector| [0, 1, 2].map(|axis| point[axis] - self.middle[axis]);
        self.points.iter().map(off).map(|off| dot(off, off).sqrt()).fold(0.0, f64::max)
    }
}

/// A camera with perspective, upright.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    place: Vector,
    right: Vector,
    up: Vector,
    ahead: Vector,
    /// Pixels for a tangent of 1.
    focal: f64,
    /// Where straight ahead is in the picture, pixels.
    centre: [f64; 2],
    distance: f64,
}

impl Camera {
    /// All of a view's points are in the picture, with a margin.
    pub fn new(view: &View, [width, height]: [u32; 2]) -> Self {
        let ((sin, cos), (aside_sin, aside_cos)) = (DOWN.sin_cos(), ASIDE.sin_cos());
        let ahead = [-cos * aside_cos, -cos * aside_sin, -sin];
        let right = [-aside_sin, aside_cos, 0.0];
        let up = [-sin * aside_cos, -sin * aside_sin, cos];
        let distance = DISTANCE * view.reach();
        let place = [0, 1, 2].map(|axis| view.middle[axis] - distance * ahead[axis]);
        let centre = [0.5 * f64::from(width), 0.5 * f64::from(height)];
        let mut camera = Self { place, right, up, ahead, focal: 1.0, centre, distance };
        let directions = view.points.iter().map(|point| {
            let [x, y, ahead] = camera.seen(*point);
            [x / ahead, -y / ahead]
        });
        let (low, high) = corners(directions);
        let middle = [0, 1].map(|axis| if view.keeps_middle { 0.0 } else { 0.5 * (low[axis] + high[axis]) });
        let half = |axis: usize| (high[axis] - middle[axis]).max(middle[axis] - low[axis]);
        camera.focal = FILLED * (centre[0] / half(0)).min(centre[1] / half(1));
        camera.centre = [0, 1].map(|axis| centre[axis] - camera.focal * middle[axis]);
        camera
    }

    /// To the right, upwards and ahead of the camera, m.
    fn seen(&self, point: Vector) -> Vector {
        let off = [0, 1, 2].map(|axis| point[axis] - self.place[axis]);
        [self.right, self.up, self.ahead].map(|axis| dot(axis, off))
    }

    /// Pixels from the left and from the top; none behind the camera.
    pub fn project(&self, point: Vector) -> Option<[f32; 2]> {
        let [x, y, ahead] = self.seen(point);
        let scale = self.focal / ahead;
        let pixel = [self.centre[0] + scale * x, self.centre[1] - scale * y];
        (ahead > 0.01 * self.distance && pixel.iter().all(|p| p.is_finite())).then(|| pixel.map(|p| p as f32))
    }

    /// How far a point is from the camera, m.
    pub fn distance(&self, point: Vector) -> f64 {
        let off = [0, 1, 2].map(|axis| point[axis] - self.place[axis]);
        dot(off, off).sqrt()
    }

    /// Whether a face with this outward normal shows its outside.
    pub fn faces(&self, point: Vector, normal: Vector) -> bool {
        dot(normal, [0, 1, 2].map(|axis| self.place[axis] - point[axis])) > 0.0
    }

    /// A point to the right of another and above it, as the camera sees them.
    pub fn beside(&self, point: Vector, [right, up]: [f64; 2]) -> Vector {
        [0, 1, 2].map(|axis| point[axis] + right * self.right[axis] + up * self.up[axis])
    }

    /// Direction from a point to the camera.
    pub fn towards(&self, point: Vector) -> Vector {
        let distance = self.distance(point);
        [0, 1, 2].map(|axis| (self.place[axis] - point[axis]) / distance)
    }

    /// A length in the middle of the picture, pixels.
    pub fn pixels(&self, length_m: f64) -> f32 {
        (self.focal * length_m / self.distance) as f32
    }
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
