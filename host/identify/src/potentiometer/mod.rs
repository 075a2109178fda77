//! The angle sensor's correction and blind arc from one run at constant voltage.
//!
//! At constant voltage the shaft turns at (nearly) constant speed, so time itself is the reference: the true angle is a
//! straight line in time, and whatever the code does beside it is the sensor. In order:
//!
//! 1. `phase`: turns and speed from the codes that the nominal line can be trusted with, the steady stretch, the
//!    shaft's phase as a low polynomial in time (slow drift of the speed is allowed);
//! 2. `arc`: codes binned over the angle; the blind arc is where they stop following (clipped, or scattered);
//! 3. `curve`: on the rest, phase polynomial, straight line and harmonics are fitted together with a robust loss;
//! 4. `arc`: the gap inside the blind arc, and with its middle the absolute zero.
//!
//! # What separates the sensor's error from real ripple of the speed
//!
//! Nothing, at constant speed: a torque that depends on the angle (gravity on a tilted axis, a friction patch) makes
//! ripple at the same harmonics as the linearity error. A torque amplitude τ at harmonic k moves the shaft by
//! `τ / (J·kω·sqrt((kω)² + 1/T²))`, with the mechanical time constant `T = J·R/K²`: run with the axis upright and fast.
//! For the 26:1 motor with its eccentric at 8.7 turns/s, 0.1 mN·m is about 1.2°. The result carries this number
//! ([`PotentiometerFit::ripple_deg_per_mnm`]).
//!
//! # Absolute zero
//!
//! Shaft angle 0 is the middle of the gap. The gap cannot be seen in the codes where the converter is clipped, but the
//! jump between full scale and zero happens at one of its ends: at the end where the wiper leaves the track when the
//! open wiper is pulled to zero, at the other one when it holds its voltage; random codes show both ends. Which of the
//! three it was is decided by the codes and by where the jump lies against the nominal curve of the converter. The jump
//! is seen once a turn between two samples, and the intersection of those intervals over all turns is narrow. Where no
//! jump is seen, zero is where the nominal line of sensor and converter puts it, as uncertain as those numbers are.

mod arc;
mod curve;
mod error;
mod line;
mod phase;
mod second;
mod summary;

pub use arc::{GapBehaviour, ZeroSource};
pub use error::PotentiometerError;
pub use line::{potentiometer, require_potentiometer};
pub use second::{SecondFit, second_potentiometer};
pub use summary::{PotentiometerFit, ResidualBin};

#[cfg(test)]
mod tests;
