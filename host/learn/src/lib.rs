//! Learning to walk by trial: proximal policy optimisation on the environments of the crate `tasks`.
//!
//! [`Hyperparameters`] are those of the thesis's Table 5.1, [`Learner`] acts and improves, [`Checkpoint`] lets a training go on that was
//! stopped, [`Policy`] is what comes of it. The same seed gives the same policy, in every bit, stopped in between or not.
//!
//! What it does not do:
//!
//! * It simulates nothing: [`Environments`] is what it acts on.
//! * It draws nothing and prints nothing: [`Progress`] says how an update went.

mod adam;
mod checkpoint;
pub mod design;
mod environment;
mod episodes;
mod error;
mod front;
pub mod gait;
mod hyperparameters;
mod learner;
mod loss;
pub mod maze;
mod network;
mod policy;
mod policy_file;
mod rollout;
mod seeds;
mod settings;
mod sides;
pub mod straight;
pub mod terrain;
#[cfg(test)]
mod tests;
mod training;
pub mod turning;
mod variant;
mod way;

pub use checkpoint::Checkpoint;
pub use environment::Environments;
pub use error::LearnError;
pub use gait::{Gait, Played};
pub use hyperparameters::Hyperparameters;
pub use learner::{Learner, Progress};
pub use policy::Policy;
pub use policy_file::{PolicyFile, PolicyPlayer};
pub use rollout::{Rollout, Worth};
pub use settings::{
    DesignSettings, Direction, Drive, MazeSettings, Observed, Settings, SettingsError, Straightness, TerrainSettings,
    Turning,
};
pub use sides::sides;
pub use training::{Saved, Training};
pub use way::Way;
