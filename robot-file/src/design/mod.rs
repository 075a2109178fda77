//! Controller design from a robot file: LQR and Kalman gains (thesis 4.3–4.6) on the exact discretisation, poles, margins,
//! the blind arc's covariance, and with them everything that [`control`] runs on.

mod fill;
mod kalman;
pub mod margins;
pub mod model;
mod numbers;
pub mod riccati;
mod sensor;

use std::f64::consts::TAU;

use control::Parameters;
use nalgebra::{Complex, DMatrix, DVector};

pub use self::kalman::Filter;
use effects::{BatterySag, States};

use self::margins::{Margins, System};
use self::model::{Continuous, Discrete, MotorValues};
use self::numbers::Numbers;
use self::riccati::RiccatiError;
use crate::robot::Robot;

/// Why no controller can be designed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The rig is only diagnosed.
    #[error("robot `{robot}` has no [controller] table: add one to design a controller for it")]
    NoController {
        /// The robot's name.
        robot: String,
    },
    /// A number is missing.
    #[error("{field} is missing: add `{} = {{ value = …, low = …, high = …, source = \"…\" }}`", field.rsplit('.').next().unwrap_or_default())]
    Missing {
        /// Dotted path in the robot file.
        field: String,
    },
    /// A number is out of its range.
    #[error("{field} is {value}, allowed are {low:e} … {high:e}")]
    OutOfRange {
        /// Dotted path in the robot file.
        field: String,
        /// Value in the file.
        value: f64,
        /// Lower limit, in the key's unit.
        low: f64,
        /// Upper limit, in the key's unit.
        high: f64,
    },
    /// Too many or unpaired harmonics.
    #[error("sensor.correction has {cos} cosine and {sin} sine amplitudes: as many of each are needed, at most {most}")]
    Harmonics {
        /// Length of `cos_deg`.
        cos: usize,
        /// Length of `sin_deg`.
        sin: usize,
        /// Most allowed.
        most: usize,
    },
    /// No stabilising gain.
    #[error("no {what} exists for this motor and these weights: {source}")]
    NotStabilisable {
        /// Regulator or filter.
        what: &'static str,
        /// What the Riccati equation said.
        source: RiccatiError,
    },
    /// What came out is refused by the controller.
    #[error("the design is refused by the controller: {0}")]
    Refused(#[from] control::ParameterError),
}

/// How the angle's uncertainty grows while the shaft crosses the blind arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlindCrossing {
    /// Shaft frequency, Hz.
    pub frequency_hz: f64,
    /// Time in the arc and its margins, s.
    pub time_s: f64,
    /// Standard deviation of the angle at the far edge, rad.
    pub angle: f64,
}

/// A designed controller.
#[derive(Clone, Debug)]
pub struct Design {
    /// What [`control::Controller::new`] takes.
    pub parameters: Parameters,
    /// The motor's values as the design used them.
    pub motor: MotorValues,
    /// The continuous model.
    pub continuous: Continuous,
    /// Its exact discretisation.
    pub discrete: Discrete,
    /// LQR gain on [θ, ω, i]: V/rad, V·s/rad, V/A.
    pub gain: [f64; 3],
    /// Poles of the regulator in z.
    pub regulator_poles: Vec<Complex<f64>>,
    /// Poles of the filter in z.
    pub filter_poles: Vec<Complex<f64>>,
    /// Filter in the reliable zone while holding a speed.
    pub filter: Filter,
    /// Margins with the whole state known.
    pub regulator_margins: Margins,
    /// Margins of the loop with the filter in it.
    pub loop_margins: Margins,
    /// Crossing of the blind arc at 6, 7 and 8 Hz; empty without an arc.
    pub crossings: Vec<BlindCrossing>,
    /// Highest speed that the supply can hold, rad/s.
    pub ceiling: f64,
    /// Relative residuals of the two Riccati equations: regulator, filter.
    pub residuals: [f64; 2],
}

/// The gains, and what they were worked out from.
struct Gains {
    parameters: Parameters,
    gain: [f64; 3],
    motor: MotorValues,
    continuous: Continuous,
    discrete: Discrete,
    filter: Filter,
    /// Of the two Riccati equations.
    residuals: [f64; 2],
}

/// What the firmware runs with: [`design`] without poles and margins, which take most of its time.
///
/// # Errors
/// As for [`design`].
pub fn parameters(robot: &Robot) -> Result<Parameters, DesignError> {
    Ok(gains(robot)?.parameters)
}

fn gains(robot: &Robot) -> Result<Gains, DesignError> {
    let Some(controller) = &robot.controller else {
        return Err(DesignError::NoController { robot: robot.name.clone() });
    };
    let numbers = Numbers(controller);
    let motor = MotorValues::new(robot);
    let continuous = motor.continuous();
    let discrete = continuous.discretise(controller.tick_s.value);

    let regulator = regulator(&discrete, &numbers)?;
    let gain = [regulator.gain[(0, 0)], regulator.gain[(0, 1)], regulator.gain[(0, 2)]];
    let parameters = fill::parameters(robot, &numbers, &motor, &discrete, gain)?;
    parameters.check()?;
    let filter = filter(&discrete, &parameters, &numbers, &motor)?;
    let residuals = [regulator.residual, filter.residual];
    Ok(Gains { parameters, gain, motor, continuous, discrete, filter, residuals })
}

/// Designs the controller of a robot.
///
/// # Errors
/// No `[controller]` table, a number missing or out of range, or nothing that stabilises.
pub fn design(robot: &Robot) -> Result<Design, DesignError> {
    let Gains { parameters, gain, motor, continuous, discrete, filter, residuals } = gains(robot)?;
    let phi = DMatrix::from_column_slice(3, 3, discrete.phi.as_slice());
    let gamma = DMatrix::from_column_slice(3, 1, discrete.gamma.as_slice());
    let k = DMatrix::from_row_slice(1, 3, &gain);
    let state_loop = System { a: phi.clone(), b: gamma.clone(), c: k.clone(), d: 0.0 };
    let period = discrete.period;
    let regulator_margins = margins::margins(|z| state_loop.response(z), period);
    let (plant, compensator) = loop_parts(&discrete, &filter, &k);
    // What is read is as old as it is: z^(−age/T).
    let late = -reading_age(robot) / period;
    let loop_margins = margins::margins(|z| Some(plant.response(z)? * compensator.response(z)? * z.powf(late)), period);
    Ok(Design {
        gain,
        regulator_poles: (&phi - &gamma * &k).complex_eigenvalues().iter().copied().collect(),
        filter_poles: filter.error_dynamics().complex_eigenvalues().iter().copied().collect(),
        regulator_margins,
        loop_margins,
        crossings: crossings(&parameters, &filter, period),
        ceiling: ceiling(robot),
        residuals,
        parameters,
        motor,
        continuous,
        discrete,
        filter,
    })
}

/// The highest speed (rad/s) that the supply can hold against drag, drop and back-EMF, in closed form: at full duty
/// `rail − r_s i − drop − R i − K ω = 0` with `K i = τ + b ω`. Zero when it cannot move the shaft.
#[must_use]
pub fn ceiling(robot: &Robot) -> f64 {
    let motor = MotorValues::new(robot);
    let effects = &robot.effects;
    let sag = effects.get::<BatterySag>().map_or(0.0, |sag| sag.resistance_ohm + sag.relaxation_ohm);
    // A full duty does not switch and loses no dead time.
    let drop = effects.laws().bridge().drop_v;
    let share = 1.0 - deadband(robot);
    let rail = robot.supply.rail_v.value * share;
    let resistance = motor.resistance + sag * share * share;
    let k = motor.torque_constant;
    let left = rail - drop - resistance * motor.drag / k;
    (left / (k + resistance * motor.viscous / k)).max(0.0)
}

/// What the bridge takes against the current, V: its drop, and what a switching bridge loses to dead time.
fn drop(robot: &Robot) -> f64 {
    let taken = robot.effects.laws().bridge();
    taken.drop_v + taken.of_supply * robot.supply.rail_v.value
}

/// What the bridge takes from the command, as a share of the supply.
fn deadband(robot: &Robot) -> f64 {
    let laws = robot.effects.laws();
    1.0 - laws.duty(1.0) + laws.bridge().of_command_v / robot.supply.rail_v.value
}

/// How old a reading is, s. One that lags is late by its lag as long as the speed changes slowly against it.
fn reading_age(robot: &Robot) -> f64 {
    let laws = robot.effects.laws();
    let mut turning = States::default();
    laws.settle(&mut turning, 1.0, 0.0);
    laws.reading_age() + laws.behind(&turning)
}

fn regulator(discrete: &Discrete, numbers: &Numbers<'_>) -> Result<riccati::Solution, DesignError> {
    // Bryson's rule: one over the square of the largest tolerated value. Scaled by these values, Q is the identity.
    let tolerated = [
        numbers.positive_angle("lqg.phase_deg")?,
        numbers.positive("lqg.speed_rad_per_s")?,
        numbers.positive("lqg.current_a")?,
    ];
    let voltage = numbers.positive("lqg.voltage_v")?;
    let d = DMatrix::from_diagonal(&DVector::from_row_slice(&tolerated));
    let inverse = DMatrix::from_diagonal(&DVector::from_row_slice(&tolerated).map(|value| 1.0 / value));
    let phi = DMatrix::from_column_slice(3, 3, discrete.phi.as_slice());
    let gamma = DMatrix::from_column_slice(3, 1, discrete.gamma.as_slice());
    let mut solution = riccati::solve(
        &(&inverse * phi * &d),
        &(&inverse * gamma),
        &DMatrix::identity(3, 3),
        &DMatrix::from_element(1, 1, voltage.powi(-2)),
    )
    .map_err(|source| DesignError::NotStabilisable { what: "regulator", source })?;
    solution.gain = &solution.gain * &inverse;
    solution.x = &inverse * &solution.x * &inverse;
    Ok(solution)
}

fn filter(
    discrete: &Discrete,
    parameters: &Parameters,
    numbers: &Numbers<'_>,
    motor: &MotorValues,
) -> Result<Filter, DesignError> {
    let drag = motor.drag.max(0.01 * motor.torque_per_volt());
    let scale = [
        numbers.positive_angle("lqg.phase_deg")?,
        numbers.positive("lqg.speed_rad_per_s")?,
        numbers.positive("lqg.current_a")?,
        drag,
    ];
    let age = f64::from(parameters.estimator.reading_age);
    kalman::steady(discrete, &parameters.estimator.speed, age, &DVector::from_row_slice(&scale))
        .map_err(|source| DesignError::NotStabilisable { what: "filter", source })
}

/// Plant from voltage to angle, and compensator from angle to (negative) voltage: the filter with the gain, the drag's
/// feed-forward `R/K τ̂` included.
fn loop_parts(discrete: &Discrete, filter: &Filter, k: &DMatrix<f64>) -> (System, System) {
    let phi = DMatrix::from_column_slice(3, 3, discrete.phi.as_slice());
    let gamma = DMatrix::from_column_slice(3, 1, discrete.gamma.as_slice());
    let reading = DMatrix::from_row_slice(1, 3, &[1.0, 0.0, 0.0]);
    let plant = System { a: phi, b: gamma.clone(), c: reading, d: 0.0 };

    // u = −K₄ x̂, x̂ = x̂⁻ + L (y − C x̂⁻), x̂⁻⁺ = Φ x̂ + Γ u. At rest of the loop Γ·u = H·τ̂ holds the drag off.
    let mut k4 = DMatrix::zeros(1, 4);
    k4.view_mut((0, 0), (1, 3)).copy_from(k);
    k4[(0, 3)] = -discrete.eta[1] / discrete.gamma[1];
    let mut gamma4 = DMatrix::zeros(4, 1);
    gamma4.view_mut((0, 0), (3, 1)).copy_from(&gamma);
    let keep = filter.keep();
    let l = DMatrix::from_column_slice(4, 1, filter.gain.as_slice());
    let closed = &filter.phi - &gamma4 * &k4;
    let compensator = System { a: &closed * &keep, b: &closed * &l, c: &k4 * &keep, d: (&k4 * &l)[(0, 0)] };
    (plant, compensator)
}

fn crossings(parameters: &Parameters, filter: &Filter, period: f64) -> Vec<BlindCrossing> {
    let sensor = &parameters.sensor;
    if !sensor.has_arc() {
        return Vec::new();
    }
    let width = f64::from(sensor.arc_width() + 2.0 * sensor.edge_margin);
    [6.0, 7.0, 8.0]
        .into_iter()
        .map(|frequency_hz| {
            let time_s = width / (TAU * frequency_hz);
            let ticks = (time_s / period).ceil() as usize;
            BlindCrossing { frequency_hz, time_s, angle: filter.blind_angle(ticks) }
        })
        .collect()
}

#[cfg(test)]
mod tests;
