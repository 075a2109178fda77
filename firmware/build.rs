//! The linker script, and the robot: its file is read, checked and designed here, by the code that `scram design` runs.

use std::env;
use std::fs;
use std::path::PathBuf;

use miette::{Context, IntoDiagnostic};
use robot_file::Robot;
use robot_file::image;
use shell::image::Image;

/// Where the robot file is named; without it, the project's own.
const ROBOT: &str = "SCRAM_ROBOT";

fn main() -> miette::Result<()> {
    println!("cargo::rustc-link-arg-bins=-Tlinkall.x");
    if env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|architecture| architecture == "xtensa") {
        // Espressif's linker is a C compiler.
        println!("cargo::rustc-link-arg-bins=-nostartfiles");
    }
    println!("cargo::rerun-if-env-changed={ROBOT}");
    let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    // A name from the command line counts from where it was typed; cargo runs this in the package's folder.
    let path = env::var_os(ROBOT).map_or_else(|| folder.join("../robot.toml"), PathBuf::from);
    for file in image::files(&path) {
        println!("cargo::rerun-if-changed={}", file.display());
    }
    let robot = Robot::load(&path)?;
    let does_not_fit = || format!("{} does not fit the firmware", path.display());
    let bytes = postcard::to_stdvec(&image::Image::of(&robot).wrap_err_with(does_not_fit)?).into_diagnostic()?;
    // What the firmware refuses at boot fails here already.
    let image = Image::read(&bytes).into_diagnostic().wrap_err("description and shell differ about the image")?;
    image.settings.check().into_diagnostic().wrap_err_with(does_not_fit)?;
    let target = PathBuf::from(env::var_os("OUT_DIR").expect("set by cargo")).join("robot.postcard");
    fs::write(target, bytes).into_diagnostic()
}
