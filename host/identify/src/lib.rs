//! A robot's parameters from measurements.
//!
//! * [`potentiometer`]: the angle sensor's correction and blind arc, from one run at constant voltage.
//! * [`backbone`]: stiffness and damping of a backbone about its three axes, from its free oscillations (thesis section 3.1).
//! * [`robot`]: what of the body decides how it walks, from its mean speeds over conditions (thesis section 3.3).
//! * [`capture`]: what a motion capture system exports, as rigid bodies over time.
//!
//! It draws nothing and knows no terminal.

pub mod backbone;
pub mod capture;
pub mod least_squares;
pub mod potentiometer;
pub mod robot;

/// Deviations to either end of a 90 % interval.
const Z90: f64 = 1.645;
