//! Everything the controller needs to know about its robot. Filled by `scram design` from a robot file, checked here.
//!
//! SI units and radians, motor values at the output shaft.

use serde::{Deserialize, Serialize};

use crate::sensor::SensorMap;

/// Why a set of parameters is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterError {
    /// Not a finite number.
    NonFinite {
        /// The parameter, as `group.name`.
        name: &'static str,
    },
    /// Must be greater than zero.
    NonPositive {
        /// The parameter, as `group.name`.
        name: &'static str,
        /// What was given.
        value: f32,
    },
    /// Must lie within bounds.
    OutOfRange {
        /// The parameter, as `group.name`.
        name: &'static str,
        /// What was given.
        value: f32,
        /// Lowest allowed value.
        low: f32,
        /// Highest allowed value.
        high: f32,
    },
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NonFinite { name } => write!(f, "{name} must be a finite number"),
            Self::NonPositive { name, value } => write!(f, "{name} must be positive, not {value}"),
            Self::OutOfRange { name, value, low, high } => {
                write!(f, "{name} must be from {low} to {high}, not {value}")
            }
        }
    }
}

impl core::error::Error for ParameterError {}

/// The motor with what turns on its shaft, thesis (4.1) and (4.2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motor {
    /// Winding and the bridge's slope together, Ω.
    pub resistance: f32,
    /// Kt = Ke, N·m/A = V·s/rad.
    pub torque_constant: f32,
    /// Rotor, gears and load, kg·m².
    pub inertia: f32,
    /// Viscous damping, N·m·s/rad.
    pub viscous: f32,
    /// Expected drag torque (gearbox and sensor friction at speed), N·m.
    pub drag: f32,
    /// The estimator keeps its drag torque from `−drag_limit / 4` to this, N·m.
    pub drag_limit: f32,
}

/// One control period of the motor, exactly discretised with voltage and torque held (zero-order hold):
/// `x' = Φ x + Γ v − H τ` with x = [θ, ω, i]. θ feeds nothing back, so its column of Φ is [1, 0, 0].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transition {
    /// Φ(θ, ω), s.
    pub angle_speed: f32,
    /// Φ(θ, i), rad/A.
    pub angle_current: f32,
    /// Φ(ω, ω).
    pub speed_speed: f32,
    /// Φ(ω, i), rad/s/A.
    pub speed_current: f32,
    /// Φ(i, ω), A·s/rad.
    pub current_speed: f32,
    /// Φ(i, i).
    pub current_current: f32,
    /// Γ(θ), rad/V.
    pub angle_voltage: f32,
    /// Γ(ω), rad/s/V.
    pub speed_voltage: f32,
    /// Γ(i), A/V.
    pub current_voltage: f32,
    /// H(θ): angle lost to a drag torque, rad/(N·m).
    pub angle_torque: f32,
    /// H(ω): speed lost, rad/s/(N·m).
    pub speed_torque: f32,
    /// H(i): current gained because the shaft turns slower, negative, A/(N·m).
    pub current_torque: f32,
}

/// The bridge and its supply.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bridge {
    /// Supply with no load, V.
    pub rail: f32,
    /// How much the supply falls per ampere drawn from it, Ω.
    pub rail_resistance: f32,
    /// Voltage lost in the bridge at zero current, V. (Its slope is in [`Motor::resistance`].)
    pub drop: f32,
    /// Share of a PWM period that dead time takes from every |duty| below 1.
    pub dead_duty: f32,
    /// |duty| up to which nothing comes out; beyond it the output is less by this.
    pub deadband: f32,
    /// Current below which the inverted drop fades out instead of jumping, A.
    pub fade_current: f32,
}

/// The battery's divider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Battery {
    /// Cell voltage per code, V; 0 when the cell is not measured.
    pub volt_per_code: f32,
    /// Cell voltage at code 0, V.
    pub volt_at_zero: f32,
}

/// How much the filter believes model and reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// Standard deviation of a reading in the reliable zone, rad. Holds the linearity error, not only the noise.
    pub reading: f32,
    /// Speed disturbance in one tick, standard deviation, rad/s.
    pub speed: f32,
    /// Change of the drag torque in one tick, standard deviation, N·m.
    pub drag: f32,
}

/// What the filter does about the blind arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum BlindArcHandling {
    /// Switched noise, innovation gate, code check.
    #[default]
    Full,
    /// None of the three: every reading counts as any other. For comparison only.
    None,
}

/// The estimator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimator {
    /// While holding a speed.
    pub speed: Tuning,
    /// While oscillating and positioning.
    pub stroke: Tuning,
    /// Standard deviation of a reading in the blind arc, rad.
    pub blind_reading: f32,
    /// Innovations beyond this many standard deviations are rejected.
    pub gate: f32,
    /// So many rejected samples in a row, outside the arc: the estimate is lost.
    pub rejected_limit: u16,
    /// Blind-arc handling.
    pub handling: BlindArcHandling,
    /// Initial standard deviation of the angle after acquisition, rad.
    pub initial_angle: f32,
    /// Initial standard deviation of the speed after acquisition, rad/s.
    pub initial_speed: f32,
    /// Initial standard deviation of the drag torque, N·m.
    pub initial_drag: f32,
}

/// Acquisition of an unknown angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Acquisition {
    /// Samples of the line fit, 6 … 16.
    pub samples: u16,
    /// RMS residual of the line that is accepted, rad.
    pub residual: f32,
    /// Least speed that is accepted: at rest no reading is trusted, rad/s.
    pub least_speed: f32,
    /// Speed aimed at, at least, to find an angle, rad/s.
    pub speed: f32,
    /// After so long without an angle the bridge drives fully, s.
    pub patience: f32,
}

/// Which law holds a speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum SpeedLaw {
    /// Thesis (4.5) with the estimated drag fed forward and the phase reference re-anchored when it is out of reach.
    #[default]
    Refined,
    /// Thesis (4.5) to the letter: `u = K(r − x̂)`, the phase reference runs from the command on.
    Thesis,
}

/// LQG speed control.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Speed {
    /// LQR gain on the phase, V/rad.
    pub angle_gain: f32,
    /// LQR gain on the speed, V·s/rad.
    pub speed_gain: f32,
    /// LQR gain on the current, V/A.
    pub current_gain: f32,
    /// The law.
    pub law: SpeedLaw,
    /// Phase error beyond which the reference is re-anchored, rad.
    pub anchor: f32,
    /// Phase error that is kept through a momentary saturation, rad.
    pub slack: f32,
}

/// Where position control takes its angle from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum AngleSource {
    /// The estimator's angle, also in the blind arc.
    #[default]
    Estimate,
    /// The thesis: a moving average of the readings and nothing else, no drop inverted. For comparison.
    MovingAverage,
}

/// Position control, thesis (4.7) and (4.8).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// Kp, V/rad.
    pub proportional: f32,
    /// Ki, V/(rad·s); 0 in the thesis.
    pub integral: f32,
    /// Kd, V·s/rad; 0 in the thesis.
    pub derivative: f32,
    /// Length of the moving average, samples, 1 … 16.
    pub average: u16,
    /// Errors up to this are left alone, rad.
    pub tolerance: f32,
    /// Share of the estimated drag that is fed forward toward the target.
    pub drag_share: f32,
    /// Angle source.
    pub source: AngleSource,
}

/// The oscillator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Oscillator {
    /// Share of the full braking torque that the prediction counts on; the rest corrects on the way.
    pub brake_share: f32,
    /// Kp of the proportional stroke, V/rad.
    pub proportional: f32,
    /// The proportional stroke turns round this far before its bound, rad.
    pub switch_margin: f32,
}

/// A fault trigger: what counts, for how long, and when at the latest the bridge is off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Watch {
    /// Limit, in the unit of the trigger.
    pub limit: f32,
    /// The evidence must last so long, s.
    pub persistence: f32,
    /// From the cause to the bridge being off at most, s.
    pub bound: f32,
}

/// The supervisor's limits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Supervisor {
    /// Driven hard and slower than this, rad/s.
    pub stall: Watch,
    /// Faster than this, or driven hard and turning the other way, rad/s.
    pub runaway: Watch,
    /// No believable reading while the shaft should turn faster than this, rad/s.
    pub sensor_open: Watch,
    /// Only codes of one end while the shaft should turn faster than this, rad/s.
    pub sensor_shorted: Watch,
    /// The same code within this many counts while the shaft should turn or is driven hard.
    pub sensor_frozen: Watch,
    /// Cell below this, V.
    pub supply_low: Watch,
    /// Command older than this, s. Its bound counts from the last command, so it holds the age and the persistence.
    pub command_old: Watch,
    /// Samples further apart than this, or whose time stands still, goes backwards or leaps, s.
    pub clock: Watch,
    /// |duty| from which on the shaft counts as driven hard.
    pub driven_duty: f32,
}

/// What may be commanded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Highest |speed|, rad/s.
    pub speed: f32,
    /// Lowest |speed| other than by `Idle`, rad/s.
    pub least_speed: f32,
    /// Shortest stroke, rad.
    pub least_stroke: f32,
}

/// Everything. Check with [`Parameters::check`]; [`crate::Controller::new`] does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Control period, s.
    pub tick: f32,
    /// Motor and load.
    pub motor: Motor,
    /// One control period of them.
    pub transition: Transition,
    /// Bridge and supply.
    pub bridge: Bridge,
    /// Battery measurement.
    pub battery: Battery,
    /// Angle sensor.
    pub sensor: SensorMap,
    /// Estimator.
    pub estimator: Estimator,
    /// Acquisition.
    pub acquisition: Acquisition,
    /// Speed control.
    pub speed: Speed,
    /// Position control.
    pub position: Position,
    /// Oscillator.
    pub oscillator: Oscillator,
    /// Supervisor.
    pub supervisor: Supervisor,
    /// Command limits.
    pub limits: Limits,
}

/// Longest moving average and line fit, samples.
pub const WINDOW: usize = 16;

fn within(name: &'static str, value: f32, low: f32, high: f32) -> Result<(), ParameterError> {
    if !value.is_finite() {
        Err(ParameterError::NonFinite { name })
    } else if value < low || value > high {
        Err(ParameterError::OutOfRange { name, value, low, high })
    } else {
        Ok(())
    }
}

fn positive(name: &'static str, value: f32, high: f32) -> Result<(), ParameterError> {
    if !value.is_finite() {
        Err(ParameterError::NonFinite { name })
    } else if value <= 0.0 {
        Err(ParameterError::NonPositive { name, value })
    } else if value > high {
        Err(ParameterError::OutOfRange { name, value, low: 0.0, high })
    } else {
        Ok(())
    }
}

impl Parameters {
    /// Refuses what no controller can run on.
    ///
    /// # Errors
    /// The first parameter that is not finite, not positive or out of its range, by name.
    pub fn check(&self) -> Result<(), ParameterError> {
        within("tick", self.tick, 1e-4, 1e-2)?;
        self.motor.check()?;
        self.transition.check()?;
        self.bridge.check()?;
        within("battery.volt_per_code", self.battery.volt_per_code, 0.0, 1.0)?;
        within("battery.volt_at_zero", self.battery.volt_at_zero, -10.0, 10.0)?;
        self.sensor.check()?;
        self.estimator.check()?;
        self.acquisition.check()?;
        within("speed.angle_gain", self.speed.angle_gain, 0.0, 1e4)?;
        within("speed.speed_gain", self.speed.speed_gain, 0.0, 1e4)?;
        within("speed.current_gain", self.speed.current_gain, -1e4, 1e4)?;
        positive("speed.anchor", self.speed.anchor, 3.0)?;
        within("speed.slack", self.speed.slack, 0.0, self.speed.anchor)?;
        self.position.check()?;
        positive("oscillator.brake_share", self.oscillator.brake_share, 1.0)?;
        positive("oscillator.proportional", self.oscillator.proportional, 1e4)?;
        within("oscillator.switch_margin", self.oscillator.switch_margin, 0.0, 1.0)?;
        self.supervisor.check()?;
        positive("limits.speed", self.limits.speed, 1e3)?;
        within("limits.least_speed", self.limits.least_speed, 0.0, self.limits.speed)?;
        // What may be commanded must not count as running away.
        let runaway = self.supervisor.runaway.limit;
        if runaway <= self.limits.speed {
            return Err(ParameterError::OutOfRange {
                name: "supervisor.runaway.limit",
                value: runaway,
                low: self.limits.speed,
                high: 1e4,
            });
        }
        positive("limits.least_stroke", self.limits.least_stroke, 6.0)
    }
}

impl Motor {
    fn check(&self) -> Result<(), ParameterError> {
        positive("motor.resistance", self.resistance, 1e4)?;
        positive("motor.torque_constant", self.torque_constant, 1e3)?;
        positive("motor.inertia", self.inertia, 1e3)?;
        within("motor.viscous", self.viscous, 0.0, 1e3)?;
        within("motor.drag", self.drag, 0.0, 1e3)?;
        within("motor.drag_limit", self.drag_limit, self.drag, 1e4)
    }
}

impl Transition {
    /// Some of these periods as one. The initial current counts as in the first, the final one as in the last of them.
    #[must_use]
    pub fn over(&self, ticks: u16) -> Self {
        // With ω' = b ω + …: bⁿ, Σ bᵏ, and the sum of those sums, k < n.
        let (mut power, mut sum, mut sum_of_sums) = (1.0, 0.0, 0.0);
        for _ in 0..ticks {
            sum_of_sums += sum;
            sum += power;
            power *= self.speed_speed;
        }
        let travel = self.angle_speed * sum_of_sums;
        let count = f32::from(ticks);
        Self {
            angle_speed: self.angle_speed * sum,
            speed_speed: power,
            angle_voltage: count * self.angle_voltage + travel * self.speed_voltage,
            speed_voltage: sum * self.speed_voltage,
            angle_torque: count * self.angle_torque + travel * self.speed_torque,
            speed_torque: sum * self.speed_torque,
            ..*self
        }
    }

    fn check(&self) -> Result<(), ParameterError> {
        positive("transition.angle_speed", self.angle_speed, 1.0)?;
        within("transition.angle_current", self.angle_current, -1e6, 1e6)?;
        within("transition.speed_speed", self.speed_speed, 0.0, 1.0)?;
        within("transition.speed_current", self.speed_current, -1e6, 1e6)?;
        within("transition.current_speed", self.current_speed, -1e6, 1e6)?;
        within("transition.current_current", self.current_current, -1.0, 1.0)?;
        within("transition.angle_voltage", self.angle_voltage, 0.0, 1e6)?;
        positive("transition.speed_voltage", self.speed_voltage, 1e6)?;
        within("transition.current_voltage", self.current_voltage, 0.0, 1e6)?;
        within("transition.angle_torque", self.angle_torque, 0.0, 1e9)?;
        positive("transition.speed_torque", self.speed_torque, 1e9)?;
        within("transition.current_torque", self.current_torque, -1e9, 1e9)
    }
}

impl Bridge {
    fn check(&self) -> Result<(), ParameterError> {
        positive("bridge.rail", self.rail, 100.0)?;
        within("bridge.rail_resistance", self.rail_resistance, 0.0, 100.0)?;
        within("bridge.drop", self.drop, 0.0, self.rail)?;
        within("bridge.dead_duty", self.dead_duty, 0.0, 0.5)?;
        within("bridge.deadband", self.deadband, 0.0, 0.9)?;
        positive("bridge.fade_current", self.fade_current, 100.0)
    }
}

impl Estimator {
    fn check(&self) -> Result<(), ParameterError> {
        self.speed.check()?;
        self.stroke.check()?;
        positive("estimator.blind_reading", self.blind_reading, 100.0)?;
        positive("estimator.gate", self.gate, 100.0)?;
        within("estimator.rejected_limit", f32::from(self.rejected_limit), 2.0, 10_000.0)?;
        positive("estimator.initial_angle", self.initial_angle, 3.2)?;
        positive("estimator.initial_speed", self.initial_speed, 1e3)?;
        positive("estimator.initial_drag", self.initial_drag, 1e3)
    }
}

impl Tuning {
    fn check(&self) -> Result<(), ParameterError> {
        positive("estimator.reading", self.reading, 3.2)?;
        positive("estimator.speed", self.speed, 1e3)?;
        positive("estimator.drag", self.drag, 1e3)
    }
}

impl Acquisition {
    fn check(&self) -> Result<(), ParameterError> {
        within("acquisition.samples", f32::from(self.samples), 6.0, 16.0)?;
        positive("acquisition.residual", self.residual, 1.0)?;
        positive("acquisition.least_speed", self.least_speed, 1e3)?;
        positive("acquisition.speed", self.speed, 1e3)?;
        positive("acquisition.patience", self.patience, 10.0)
    }
}

impl Position {
    fn check(&self) -> Result<(), ParameterError> {
        positive("position.proportional", self.proportional, 1e4)?;
        within("position.integral", self.integral, 0.0, 1e6)?;
        within("position.derivative", self.derivative, 0.0, 1e4)?;
        within("position.average", f32::from(self.average), 1.0, 16.0)?;
        within("position.tolerance", self.tolerance, 0.0, 1.0)?;
        within("position.drag_share", self.drag_share, 0.0, 2.0)
    }
}

impl Supervisor {
    fn check(&self) -> Result<(), ParameterError> {
        self.stall.check()?;
        self.runaway.check()?;
        self.sensor_open.check()?;
        self.sensor_shorted.check()?;
        self.sensor_frozen.check()?;
        self.supply_low.check()?;
        self.command_old.check()?;
        let old = &self.command_old;
        within("supervisor.command_old.bound", old.bound, old.limit + old.persistence, 80.0)?;
        self.clock.check()?;
        positive("supervisor.driven_duty", self.driven_duty, 1.0)
    }
}

impl Watch {
    fn check(&self) -> Result<(), ParameterError> {
        within("supervisor.limit", self.limit, 0.0, 1e4)?;
        within("supervisor.persistence", self.persistence, 0.0, 10.0)?;
        within("supervisor.bound", self.bound, self.persistence, 20.0)
    }
}
