//! examples/hidden-effect: the files are what the generator makes, and the diagnosis names what it hid.

use std::path::{Path, PathBuf};

use description::Robot;
use diagnose::{Options, diagnose};
use recording::{Loaded, ReadOptions, load_with};
use system_tests::blind::case::{self, Category};
use system_tests::blind::files::Decimals;
use system_tests::blind::hidden::Effect;
use system_tests::blind::rig;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/hidden-effect")
}
