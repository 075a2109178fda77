//! The firmware's tasks ([`shell`]) on simulated parts ([`hal_sim`]): robots, a dongle, a serial line, the air between.
//!
//! A [`bench::Bench`] runs them in virtual time ([`time`]): a minute in a fraction of a second, the same each time. A
//! [`realtime::Simulation`] puts the same bench behind a pseudo-terminal, where any program finds a serial device.
//!
//! ```
//! # fn run(file: &robot_file::Robot) -> Result<(), testbed::setup::SetupError> {
//! use testbed::bench::Bench;
//! use testbed::injected_event::InjectedEvent;
//! use testbed::setup::Setup;
//!
//! let mut bench = Bench::new(Setup::new(file, 2, 1)?);
//! bench.at(500_000, InjectedEvent::Fault(0, hal_sim::Fault::SensorOpen));
//! bench.run_until(1_000_000);
//! println!("{:?}, {:?}", bench.robots[0].state(), bench.robots[1].truth());
//! # Ok(())
//! # }
//! ```

pub mod air;
pub mod bench;
pub mod broken;
pub mod console;
pub mod dongle;
pub mod event_log;
pub mod flash;
pub mod host_end;
pub mod injected_event;
pub mod parts;
pub mod peers;
pub mod power;
pub mod realtime;
pub mod robot;
pub mod serial;
pub mod setup;
pub mod simulated;
pub mod time;
