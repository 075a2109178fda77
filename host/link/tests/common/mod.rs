//! What the tests of the link need, and of what speaks over it.

pub mod bench;

use std::path::Path;

use robot_file::Robot;

/// The robot of the project.
pub fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).expect("robot.toml")
}
