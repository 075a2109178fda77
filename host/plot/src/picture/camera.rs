//! From the world to the picture.

type Vector = [f64; 3];

/// From where it looks: below the horizontal and against +x, rad.
const DOWN: f64 = 0.75;
const ASIDE: f64 = -1.05;
/// Distance from the middle, in how far from it the farthest point is that is to be seen.
const DISTANCE: f64 = 5.5;
/// Part of the picture that is filled.
const FILLED: f64 = 0.94;

/// A camera with perspective, upright.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    place: Vector,
    right: Vector,
    up: Vector,
    ahead: Vector,
    /// Pixels for a tangent of 1.
    focal: f64,
    /// Of the picture, pixels.
    centre: [f64; 2],
    distance: f64,
}

impl Camera {
    /// Looks at the middle; all of the points are in the picture, with a margin.
    pub fn new(middle: Vector, points: &[Vector], [width, height]: [u32; 2]) -> Self {
        let ((sin, cos), (aside_sin, aside_cos)) = (DOWN.sin_cos(), ASIDE.sin_cos());
        let ahead = [-cos * aside_cos, -cos * aside_sin, -sin];
        let right = [-aside_sin, aside_cos, 0.0];
        let up = [-sin * aside_cos, -sin * aside_sin, cos];
        let distance = DISTANCE * reach(middle, points);
        let place = [0, 1, 2].map(|axis| middle[axis] - distance * ahead[axis]);
        let centre = [0.5 * f64::from(width), 0.5 * f64::from(height)];
        let mut camera = Self { place, right, up, ahead, focal: 1.0, centre, distance };
        let fits = points.iter().map(|point| {
            let seen = camera.seen(*point);
            (centre[0] * seen[2] / seen[0].abs()).min(centre[1] * seen[2] / seen[1].abs())
        });
        camera.focal = FILLED * fits.fold(f64::INFINITY, f64::min);
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

/// How far from the middle the farthest point is, m.
pub(super) fn reach(middle: Vector, points: &[Vector]) -> f64 {
    let off = |point: &Vector| [0, 1, 2].map(|axis| point[axis] - middle[axis]);
    points.iter().map(off).map(|off| dot(off, off).sqrt()).fold(0.0, f64::max)
}
