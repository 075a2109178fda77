//! What a viewer draws of a run: frames that move, shapes fixed in them, the robot's pose, its feet and the forces on them.
//!
//! Lengths in m, forces in N. Frames are right-handed, z up; the root is [`WORLD`], whose ground is z = 0.

use std::path::Path;

use super::RecordingError;

/// The frame that does not move.
pub const WORLD: &str = "world";

/// A run as viewers draw it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// What stands still in [`WORLD`].
    pub ground: Vec<Shape>,
    /// Frames that move.
    pub frames: Vec<SceneFrame>,
    /// Length of the arrow of a force, m/N.
    pub arrow_m_per_n: f64,
    /// Increasing in time.
    pub states: Vec<SceneState>,
}

/// A frame and what is fixed in it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFrame {
    /// Letters, digits and `_`; one frame's only.
    pub name: String,
    /// [`WORLD`], or a frame before this one.
    pub parent: String,
    /// What is drawn of it.
    pub shapes: Vec<Shape>,
}

/// A body of one colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Its form.
    pub form: Form,
    /// In its frame.
    pub pose: ScenePose,
    /// Red, green, blue, opacity: 0 … 1, sRGB.
    pub colour: [f64; 4],
}

/// A form, centred at its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// Lengths along x, y, z, m.
    Box([f64; 3]),
    /// About z.
    Cylinder {
        /// m.
        radius: f64,
        /// m.
        length: f64,
    },
    /// Radius, m.
    Sphere(f64),
}

/// Position and orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenePose {
    /// m.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z.
    pub orientation: [f64; 4],
}

impl ScenePose {
    /// At a position (m), not turned.
    #[must_use]
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, orientation: [1.0, 0.0, 0.0, 0.0] }
    }

    /// Turned about z by an angle (rad, counter-clockwise).
    #[must_use]
    pub fn turned(self, angle: f64) -> Self {
        let (sin, cos) = (0.5 * angle).sin_cos();
        Self { orientation: [cos, 0.0, 0.0, sin], ..self }
    }
}

/// A scene at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneState {
    /// s, on the samples' clock.
    pub t_s: f64,
    /// Of each of [`Scene::frames`], in its parent.
    pub poses: Vec<ScenePose>,
    /// Of the robot over the ground; none where it has no body.
    pub robot: Option<ScenePose>,
    /// In [`WORLD`].
    pub feet: Vec<SceneFoot>,
}

/// A foot at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneFoot {
    /// m.
    pub position: [f64; 3],
    /// From the ground on the foot, N; zero in the air.
    pub force: [f64; 3],
}

impl Scene {
    /// Fails unless every state has a pose a frame, in increasing time, and every frame a place.
    pub(super) fn check(&self, path: &Path) -> Result<(), RecordingError> {
        let is_name = |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let placed = self.frames.iter().enumerate().all(|(index, frame)| {
            let before = || self.frames[..index].iter().map(|frame| frame.name.as_str()).chain([WORLD]);
            is_name(&frame.name) && before().all(|name| name != frame.name) && before().any(|name| name == frame.parent)
        });
        let increasing = self.states.windows(2).all(|pair| pair[0].t_s < pair[1].t_s);
        if placed && increasing && self.states.iter().all(|state| state.poses.len() == self.frames.len()) {
            return Ok(());
        }
        Err(RecordingError::Format {
            path: path.to_owned(),
            problem: "not written: the scene's frames and states do not fit each other".into(),
            help: "give every frame a name of its own and a parent before it, every state a pose a frame, in increasing time"
                .into(),
        })
    }
}
