//! What several tests need.

#![allow(dead_code, reason = "each of the two programs of tests uses its part")]

#[path = "../../../link/tests/common/bench.rs"]
pub mod bench;
pub mod command;
pub mod csv;
pub mod pil;
pub mod policy;
#[cfg(unix)]
pub mod tty;

use std::path::{Path, PathBuf};

use robot_file::Robot;

/// The project's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The robot file of the project.
pub fn robot_file() -> PathBuf {
    root().join("robot.toml")
}

pub fn robot() -> Robot {
    Robot::load(&robot_file()).expect("robot.toml")
}

/// That a command which is done has removed from a directory what it would have gone on from.
pub fn assert_nothing_kept(at: &Path) {
    let kept = |entry: std::fs::DirEntry| entry.path().extension().is_some_and(|extension| extension == "part");
    assert!(!std::fs::read_dir(at).expect("a directory").flatten().any(kept), "what was kept to go on from is removed");
}
