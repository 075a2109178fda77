//! What the robot can learn: to turn in place, to walk straight, to find its way through a maze.
//!
//! A [`Definition`] says everything about an environment: the task with its reward, the actions, the time between two of them, what is
//! observed, how an episode begins and ends. [`Environments`] advances many of them, eight bodies to a group as they stand in a register's
//! lanes, the groups over threads. What an environment does depends on its seed alone, not on how many there are or in which threads.
//!
//! ```
//! use robot_file::edit::Document;
//! use sweep::VariantBuilder;
//! use tasks::{Definition, Environments, Task, Turn};
//!
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml");
//! let document = Document::load(file.as_ref())?;
//! let robot = document.robot()?;
//! let definition = Definition { episode_s: 0.2, ..Definition::new(Task::Turn(Turn::default())) };
//! let mut environments = Environments::new(VariantBuilder::new(document, robot)?, definition, 3)?;
//! for i in 0..3 {
//!     environments.reset(i, Some(i as u64))?;
//! }
//! let steps = environments.step(&[0, 4, 9])?;
//! assert_eq!(steps.observations.len(), 3 * environments.definition().observation_size());
//! assert!(steps.rewards.iter().all(|reward| *reward <= 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It learns nothing: it is what a learner acts on.
//! * It draws nothing and knows no Python.
//!
//! SI units, angles counter-clockwise, frequencies in hertz and clockwise as in the thesis. Its chapter 5.3 is the source of the
//! observation, the actions and the reward of [`Turn`].

mod definition;
mod environments;
mod episode;
mod error;
mod group;
mod maze;
mod observation;
mod shaft;
mod specimen;
mod task;

pub use definition::{Definition, DriveKind, Start, thesis_frequencies_hz};
pub use environments::{Environments, Reset, Steps};
pub use error::TaskError;
pub use maze::{Cell, Maze, Side};
pub use observation::{Part, RAYS, observed_pose};
pub use shaft::RampedShaft;
pub use specimen::{RANDOMIZED, Randomization};
pub use task::{MazeRun, Pose, Straight, Task, Turn};
