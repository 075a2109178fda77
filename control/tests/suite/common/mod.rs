//! A small world for the controller's own tests: the thesis's motor with Coulomb friction, Euler steps of 20 µs, and a
//! potentiometer with a gap. It shares no code with `hal-sim`.

#![allow(dead_code, reason = "the bench uses its part")]

use control::gait::Name;
use control::parameters::*;
use control::sensor::{HARMONICS, Harmonic, KNOTS, Knot, SensorMap};
use control::{Actuation, AdcCode, Command, Controller, Gait, Sample};

/// A 26:1 gearmotor behind a bridge with drop, at 1 kHz.
pub fn parameters() -> Parameters {
    let watch = |limit, persistence, bound| FaultLimit { limit, persistence, bound };
    let mut knots = [Knot { code: 4095.0, angle: 6.0214 }; KNOTS];
    knots[0] = Knot { code: 0.0, angle: 0.2618 };
    let (r, k, j, b) = (15.89f32, 0.0209f32, 1.5e-6f32, 1.12e-6f32);
    let rate = (k * k / r + b) / j;
    let decay = (-rate * 1e-3).exp();
    let area = (1.0 - decay) / rate;
    let lag = (1e-3 - area) / rate;
    Parameters {
        tick: 1e-3,
        motor: Motor {
            resistance: r,
            torque_constant: k,
            inertia: j,
            viscous: b,
            drag: 2.24e-3,
            drag_limit: 6.7e-3,
            continuous_current: 0.1,
            thermal_time_constant: 3.0,
        },
        transition: Transition {
            angle_speed: area,
            angle_current: 0.0,
            speed_speed: decay,
            speed_current: 0.0,
            current_speed: -k / r * decay,
            current_current: 0.0,
            angle_voltage: lag * k / (r * j),
            speed_voltage: area * k / (r * j),
            current_voltage: 1.0 / r - k / r * area * k / (r * j),
            angle_torque: lag / j,
            speed_torque: area / j,
            current_torque: -k / r * area / j,
        },
        bridge: Bridge {
            rail: 5.0,
            rail_resistance: 0.0,
            drop: 2.07,
            dead_duty: 0.0,
            deadband: 0.0,
            fade_current: 5e-3,
        },
        battery: Battery { volt_per_code: 1.6e-3, volt_at_zero: 0.18 },
        sensor: SensorMap {
            knots,
            harmonics: [Harmonic::default(); HARMONICS],
            harmonic_count: 0,
            lowest_code: 40,
            highest_code: 4050,
            blind_from: -0.33,
            blind_to: 0.33,
            edge_margin: 0.08,
            half_play: 0.0,
        },
        second: None,
        estimator: Estimator {
            speed: Tuning { reading: 0.1, speed: 0.01, drag: 5e-7 },
            stroke: Tuning { reading: 0.05, speed: 0.15, drag: 2e-5 },
            blind_reading: 5.0,
            gate: 4.0,
            rejected_limit: 15,
            handling: BlindArcHandling::Full,
            initial_angle: 0.05,
            initial_speed: 5.0,
            initial_drag: 5e-4,
            reading_age: 0.0,
            sensor_persistence: 0.1,
        },
        acquisition: Acquisition { samples: 12, residual: 0.035, least_speed: 8.0, speed: 60.0, patience: 0.1 },
        speed: Speed {
            angle_gain: 0.8,
            speed_gain: 0.13,
            current_gain: 0.1,
            law: SpeedLaw::Refined,
            phase_reset_error: 1.0,
            saturation_hold: 0.5,
        },
        position: Position {
            proportional: 12.0,
            integral: 0.0,
            derivative: 0.0,
            average: 4,
            tolerance: 0.035,
            drag_share: 0.9,
            source: AngleSource::Estimate,
        },
        oscillator: Oscillator { brake_share: 0.85, proportional: 12.0, switch_margin: 0.17 },
        supervisor: Supervisor {
            stall: watch(4.0, 0.2, 0.5),
            stall_window: 0.175,
            runaway: watch(80.0, 0.08, 0.5),
            sensor_open: watch(5.0, 0.3, 0.8),
            sensor_shorted: watch(5.0, 0.3, 0.5),
            sensor_frozen: watch(1.0, 0.1, 0.3),
            supply_low: watch(3.3, 0.05, 0.1),
            supply_high: 4.4,
            slow_after: 0.25,
            command_old: watch(0.5, 0.0, 0.55),
            clock: watch(0.02, 0.05, 0.1),
            loop_starved: watch(0.05, 0.0, 0.2),
            starved_share: 0.1,
            overheated: watch(2.7, 0.0, 0.05),
            driven_duty: 0.6,
            driven_current: 0.01,
            rest_least: 0.2,
            rest_most: 100.0,
        },
        limits: Limits { speed: 75.0, least_speed: 6.0, least_stroke: 0.3 },
    }
}

/// A gait that turns round every 40 ms, again and again: what the world's robot has.
pub fn gait() -> Gait {
    Gait::new(Name::new("to-and-fro").expect("a name"), &[44.0, -44.0], &[], &[0, 1], 40, true).expect("sound")
}

/// Controller and shaft.
pub struct World {
    /// The controller.
    pub controller: Controller,
    /// Time, µs.
    pub time_us: u64,
    /// True angle, rad, not wrapped.
    pub angle: f64,
    /// True speed, rad/s.
    pub speed: f64,
    /// The shaft cannot move.
    pub blocked: bool,
    /// The motor's leads are swapped.
    pub reversed: bool,
    /// Heat in the winding, as a multiple of what 0.1 A keeps there, with a time constant of 3 s.
    pub heat: f64,
    actuation: Actuation,
    noise: u32,
}

impl World {
    /// At rest at 2 rad.
    pub fn new() -> Self {
        let mut controller = Controller::new(&parameters()).expect("valid");
        controller.keep_gait(&gait()).expect("within the limits");
        Self {
            controller,
            time_us: 0,
            angle: 2.0,
            speed: 0.0,
            blocked: false,
            reversed: false,
            heat: 0.0,
            actuation: Actuation::OFF,
            noise: 1,
        }
    }

    /// Code of the present angle with a few codes of noise; anything in the gap.
    pub fn code(&mut self) -> u16 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let turn = self.angle.rem_euclid(std::f64::consts::TAU);
        let code = (turn - 0.2618) / (6.0214 - 0.2618) * 4095.0;
        if !(0.0..=4095.0).contains(&code) {
            return (self.noise >> 20) as u16;
        }
        (code + f64::from(self.noise >> 28) - 8.0).clamp(0.0, 4095.0) as u16
    }

    /// Runs ticks with a command that is repeated in every one.
    pub fn run(&mut self, command: Command, ticks: u32) {
        for _ in 0..ticks {
            let _ = self.controller.command(command, self.time_us);
            self.tick();
        }
    }

    /// One control period.
    pub fn tick(&mut self) -> Actuation {
        self.tick_with(|sample| sample)
    }

    /// One control period with the sample changed on its way.
    pub fn tick_with(&mut self, change: impl Fn(Sample) -> Sample) -> Actuation {
        let sample =
            Sample { time_us: self.time_us, angle: AdcCode(self.code()), second: None, battery: AdcCode(2400) };
        self.actuation = self.controller.tick(&change(sample));
        self.pass(1);
        self.actuation
    }

    /// So many ms without a tick: the bridge goes on with what it was told.
    pub fn pass(&mut self, ms: u64) {
        self.time_us += 1000 * ms;
        for _ in 0..50 * ms {
            self.step(self.actuation, 20e-6);
        }
    }

    fn step(&mut self, actuation: Actuation, h: f64) {
        if self.blocked {
            self.speed = 0.0;
        }
        let (r, k, j, b, drag) = (15.89f64, 0.0209, 1.5e-6, 1.12e-6, 2.24e-3f64);
        let direction = if self.reversed { -1.0 } else { 1.0 };
        let net = direction * 5.0 * f64::from(actuation.duty) - k * self.speed;
        let excess = (net.abs() - 2.07).max(0.0);
        let current = if actuation.enable { excess.copysign(net) / r } else { 0.0 };
        self.heat += h / 3.0 * ((current / 0.1).powi(2) - self.heat);
        if self.blocked {
            return;
        }
        let torque = k * current - b * self.speed;
        let before = self.speed;
        let sliding = if before == 0.0 { torque } else { before };
        let friction = if before == 0.0 { drag.min(torque.abs()) } else { drag };
        self.speed += h * (torque - friction.copysign(sliding)) / j;
        if before * self.speed < 0.0 {
            self.speed = 0.0;
        }
        self.angle += h * self.speed;
    }
}
