//! The body on the ground: modules on soft backbones, shaken by the eccentric, on compliant feet.

mod algebra;
mod contact;
pub mod coordinates;
pub mod drive;
pub mod ensemble;
mod ground;
mod group;
mod lanes;
mod model;
pub mod plan;
mod rotor;
pub mod skeleton;
pub mod snapshot;
mod stability;
mod step;
pub mod track;
pub mod walking;
mod walls;

pub use drive::Drive;
pub use ensemble::{Ensemble, Precision, Settings};
pub use ground::Stretch;
pub use plan::Plan;
pub use snapshot::{Pose, Snapshot};
pub use track::{Speeds, Track};
pub use walking::{Walker, WalkingRobots, rotor_inertia};
pub use walls::Wall;
