//! The world around the firmware: winding, gearbox with friction, driver, supply, angle sensor and its converter.
//!
//! A [`SimulatedRobot`] is a value: cloned, sent to threads, and the same bits from the same seed. It hands out
//! [`control::Sample`]s and takes [`control::Actuation`]s, one a control period. SI units and radians, angles
//! counter-clockwise positive, shaft angle 0 in the middle of the potentiometer's gap, motor values at the output shaft.
//! A [`radio::Air`] carries frames between robots and a console. Nothing in here may touch a clock, a file, global state or
//! randomness that does not come from the seed.
//!
//! ```
//! # fn run(file: &robot_file::robot::Robot) {
//! let mut robot = hal_sim::SimulatedRobot::new(file, 1);
//! for _ in 0..1000 {
//!     let sample = robot.sample();
//!     robot.advance(control::Actuation { duty: if sample.angle.0 > 2048 { 1.0 } else { -1.0 }, enable: true });
//! }
//! println!("{} rad", robot.truth().angle);
//! # }
//! ```

pub mod adc;
pub mod body;
pub mod digital;
pub mod driver;
pub mod faults;
pub mod heat;
mod history;
pub mod linearity;
pub mod plant;
pub mod potentiometer;
pub mod radio;
pub mod random;
pub mod robot;
mod second_sensor;
pub mod shaft;
pub mod supply;
pub mod variation;

pub use faults::Fault;
pub use robot::{SampleTime, Settings, SimulatedRobot, Truth};
