//! Everything the controller needs to know about its robot. Filled by `scram design` from a robot file, checked here.
//!
//! SI units and radians, motor values at the output shaft. [`table`] has those by name that a person may change while the
//! robot runs, in the units of robot.toml.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::sample::AdcCode;
use crate::second_sensor::SecondSensor;
use crate::sensor::SensorMap;

mod check;
pub mod table;

pub use crate::error::ParameterError;
pub use table::SetError;

/// The motor with what turns on its shaft, thesis (4.1) and (4.2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
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
    /// Current that the winding bears for ever, A.
    pub continuous_current: f32,
    /// How fast the winding warms and cools, s.
    pub thermal_time_constant: f32,
}

/// One control period of the motor, exactly discretised with voltage and torque held (zero-order hold):
/// `x' = Φ x + Γ v − H τ` with x = [θ, ω, i]. θ feeds nothing back, so its column of Φ is [1, 0, 0].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
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
}

/// The bridge and its supply.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
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

/// Voltage divider in front of the battery's ADC input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Battery {
    /// Cell voltage per code, V; 0 when the cell is not measured.
    pub volt_per_code: f32,
    /// Cell voltage at code 0, V.
    pub volt_at_zero: f32,
}

impl Battery {
    /// Voltage of the cell from its code; nothing where it is not measured.
    #[must_use]
    pub fn volt(&self, code: AdcCode) -> Option<f32> {
        (self.volt_per_code > 0.0).then(|| self.volt_at_zero + self.volt_per_code * f32::from(code.0))
    }
}

/// How much the filter believes model and reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Tuning {
    /// Standard deviation of a reading in the reliable zone, rad. Holds the linearity error, not only the noise.
    pub reading: f32,
    /// Speed disturbance in one tick, standard deviation, rad/s.
    pub speed: f32,
    /// Change of the drag torque in one tick, standard deviation, N·m.
    pub drag: f32,
}

/// What the filter does about the blind arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub enum BlindArcHandling {
    /// Switched noise, innovation gate, code check.
    #[default]
    Full,
    /// None of the three: every reading counts as any other. For comparison only.
    None,
}

/// Parameters of the Kalman filter and of its innovation gate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
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
    /// Time after which a sensor that contradicts the other has failed, s.
    pub sensor_persistence: f32,
    /// A reading is this old when it is converted, s.
    pub reading_age: f32,
}

/// Acquisition of an unknown angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Acquisition {
    /// Samples of the line fit, 6 … 16.
    pub samples: u16,
    /// RMS residual of the line that is accepted, rad.
    pub residual: f32,
    /// Least speed that is accepted: at rest no reading is trusted, rad/s.
    pub least_speed: f32,
    /// Speed aimed at, at least, to find an angle, rad/s.
    pub speed: f32,
    /// Time without an angle after which the bridge drives at full voltage, s.
    pub patience: f32,
}

/// Which law holds a speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub enum SpeedLaw {
    /// Thesis (4.5) with the estimated drag fed forward and the phase reference re-anchored when it is out of reach.
    #[default]
    Refined,
    /// Thesis (4.5) to the letter: `u = K(r − x̂)`, the phase reference runs from the command on.
    Thesis,
}

/// LQG speed control.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Speed {
    /// LQR gain on the phase, V/rad.
    pub angle_gain: f32,
    /// LQR gain on the speed, V·s/rad.
    pub speed_gain: f32,
    /// LQR gain on the current, V/A.
    pub current_gain: f32,
    /// Control law.
    pub law: SpeedLaw,
    /// Phase error beyond which the reference is re-anchored, rad.
    pub phase_reset_error: f32,
    /// Phase error that is kept through a momentary saturation, rad.
    pub saturation_hold: f32,
}

/// Where position control takes its angle from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub enum AngleSource {
    /// The estimator's angle, also in the blind arc.
    #[default]
    Estimate,
    /// The thesis: a moving average of the readings and nothing else, no drop inverted. For comparison.
    MovingAverage,
}

/// Position control, thesis (4.7) and (4.8).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
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
    /// Angle that the position controller acts on.
    pub source: AngleSource,
}

/// Parameters of the oscillation between two angles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Oscillator {
    /// Share of the full braking torque that the prediction counts on; the rest corrects on the way.
    pub brake_share: f32,
    /// Kp of the proportional stroke, V/rad.
    pub proportional: f32,
    /// The proportional stroke turns round this far before its bound, rad.
    pub switch_margin: f32,
}

/// A fault trigger: what counts, for how long, and when at the latest the bridge is off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct FaultLimit {
    /// Limit, in the unit of the trigger.
    pub limit: f32,
    /// Persistence: time that the evidence must last, s.
    pub persistence: f32,
    /// From the cause to the bridge being off at most, s.
    pub bound: f32,
}

/// The supervisor's limits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Supervisor {
    /// Driven and slower than this, rad/s.
    pub stall: FaultLimit,
    /// A shaft turns when its reading leaves this far behind within the time that the limit of `stall` takes, rad.
    pub stall_window: f32,
    /// Faster than this, or driven hard and turning the other way, rad/s.
    pub runaway: FaultLimit,
    /// No believable reading while the shaft should turn faster than this, rad/s.
    pub sensor_open: FaultLimit,
    /// Only codes of one end while the shaft should turn faster than this, rad/s.
    pub sensor_shorted: FaultLimit,
    /// The same code within this many counts while the shaft should turn or is driven hard.
    pub sensor_frozen: FaultLimit,
    /// Cell below this, V.
    pub supply_low: FaultLimit,
    /// Cell above this, V: no drive begins.
    pub supply_high: f32,
    /// No sign of life for longer than this, s: the duty fades to zero until `command_old`.
    pub slow_after: f32,
    /// Command older than this, s. Its bound counts from the last command, so it holds the age and the persistence.
    pub command_old: FaultLimit,
    /// Samples further apart than this, or whose time stands still, goes backwards or leaps, s.
    pub clock: FaultLimit,
    /// Control periods missed for longer than this in all, s, less `starved_share` of the time.
    pub loop_starved: FaultLimit,
    /// Share of the control periods that may be missed for ever.
    pub starved_share: f32,
    /// The winding holds more heat than this, as a multiple of what the continuous current keeps in it.
    pub overheated: FaultLimit,
    /// |duty| from which on the shaft counts as driven hard.
    pub driven_duty: f32,
    /// Current through a motor at rest from which on the shaft counts as driven, A.
    pub driven_current: f32,
    /// Mean change of the wiper's code from reading to reading at rest: less is no converter that works, counts.
    pub rest_least: f32,
    /// The same: more is no sound contact, counts.
    pub rest_most: f32,
}

/// What may be commanded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Limits {
    /// Highest |speed|, rad/s.
    pub speed: f32,
    /// Lowest |speed| other than by `Idle`, rad/s.
    pub least_speed: f32,
    /// Shortest stroke, rad.
    pub least_stroke: f32,
}

/// Everything. Check with [`Parameters::check`]; [`crate::Controller::new`] does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
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
    /// The second angle sensor, where there is one.
    pub second: Option<SecondSensor>,
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
