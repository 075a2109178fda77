//! Every decoder of the project as a function of any bytes: [`TARGETS`]. A function panics where the decoder did something
//! that it never may; it returns whatever the bytes are otherwise. What the bytes mean is said in each module: where random
//! ones would never get past a checksum, they are commands to somebody who makes frames or files.
//!
//! `fuzz/` hands them to libFuzzer, `tests/` feeds them a seeded minute without it.

mod air;
mod air_console;
mod air_robot;
mod bytes;
mod console;
mod flash;
mod import;
mod keys_file;
mod mcap;
mod recording;
mod robot_commands;
mod robot_file;
mod scratch;
mod scripted_peer;
mod serial;
mod session;
mod store;

pub use air_console::air_console;
pub use air_robot::air_robot;
pub use console::{console_line, script};
pub use import::import;
pub use keys_file::keys_file;
pub use recording::{recording_csv, recording_mcap};
pub use robot_commands::robot_commands;
pub use robot_file::robot_file;
pub use serial::serial;
pub use session::session;
pub use store::store;

/// Fuzz target: a decoder as a function of any bytes.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name here, in `fuzz_targets/` and in `corpus-seed/`.
    pub name: &'static str,
    /// Decodes bytes; panics where something is wrong.
    pub run: fn(&[u8]),
}

/// Every decoder.
pub const TARGETS: &[Target] = &[
    Target { name: "serial", run: serial },
    Target { name: "air_robot", run: air_robot },
    Target { name: "air_console", run: air_console },
    Target { name: "session", run: session },
    Target { name: "robot_commands", run: robot_commands },
    Target { name: "recording_mcap", run: recording_mcap },
    Target { name: "recording_csv", run: recording_csv },
    Target { name: "import", run: import },
    Target { name: "robot_file", run: robot_file },
    Target { name: "console_line", run: console_line },
    Target { name: "script", run: script },
    Target { name: "keys_file", run: keys_file },
    Target { name: "store", run: store },
];
