//! The library under the `scram` command: the console ([`console`]), the bring-up of a board ([`bring_up`]), a chip in the
//! loop ([`hil`]), the console in a browser ([`live`]) and recordings seen again ([`replay`]).
//!
//! ```
//! // What is wrong with a line of the console, before anything is sent.
//! assert_eq!(scram::console::check("clear; freq 7; wait 2; stop"), Ok(()));
//! assert!(scram::console::check("freq seven").is_err());
//! ```
//!
//! What it does not do:
//!
//! * The command line itself is not in it: `src/cli/` is the binary's, one file a subcommand.
//! * It simulates, fits, draws and talks to robots through the other crates of `host/`: whoever needs one of these takes that
//!   crate.
//! * It is no stable interface for other programs: `--json` of the command is.

pub mod bring_up;
pub mod console;
pub mod hil;
pub mod live;
pub mod progress;
pub mod replay;
