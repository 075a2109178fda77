//! What really is at an instant, in the world's frame, for people and tests.

/// Position and orientation of a rigid part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Of the centre, m.
    pub position: [f64; 3],
    /// Unit quaternion (w, x, y, z): from the part's frame, which is the world's in the nominal pose, to the world's.
    pub orientation: [f64; 4],
}

/// A foot's sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Of the sphere's centre, m.
    pub position: [f64; 3],
    /// Of the sphere's centre, m/s.
    pub velocity: [f64; 3],
    /// From the ground on the foot during the last step, N; zero where it does not touch.
    pub force: [f64; 3],
}

impl Foot {
    /// Whether the ground carries it.
    #[must_use]
    pub fn touches(&self) -> bool {
        self.force[2] > 0.0
    }
}

/// The eccentric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotor {
    /// Against the module, from its x axis, counter-clockwise seen from above, rad, not wrapped.
    pub angle: f64,
    /// Speed of the shaft against its module, rad/s.
    pub speed: f64,
    /// Of the bolt's centre, m.
    pub bolt: [f64; 3],
    /// What the drive gives the shaft, N·m.
    pub torque: f64,
}

/// A body at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Since the start, s.
    pub time_s: f64,
    /// Front to rear, of the boxes' centres.
    pub modules: Vec<Pose>,
    /// Front to rear, of the boxes' centres, backbone after backbone; rolled as the backbone is.
    pub segments: Vec<Pose>,
    /// Of module 0 left and right, module 1 left and right, …
    pub feet: Vec<Foot>,
    /// None without an eccentric.
    pub rotor: Option<Rotor>,
}

impl Snapshot {
    /// Mean of the modules' centres, m.
    #[must_use]
    pub fn centroid(&self) -> [f64; 3] {
        let count = self.modules.len() as f64;
        [0, 1, 2].map(|axis| self.modules.iter().map(|pose| pose.position[axis]).sum::<f64>() / count)
    }

    /// Heading, rad in −π … π: of the line from the last module to the first.
    #[must_use]
    pub fn heading(&self) -> f64 {
        let (first, last) = (&self.modules[0].position, &self.modules[self.modules.len() - 1].position);
        (first[1] - last[1]).atan2(first[0] - last[0])
    }

    /// What brings the centroid to a place on the ground (m), after the body was turned by `turn` (rad, counter-clockwise) about the
    /// world's origin, m.
    #[must_use]
    pub fn displacement_to(&self, place: [f64; 2], turn: f64) -> [f64; 2] {
        let ([x, y, _], (sin, cos)) = (self.centroid(), turn.sin_cos());
        [place[0] - (cos * x - sin * y), place[1] - (sin * x + cos * y)]
    }
}
