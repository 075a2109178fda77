//! The robot as `robot.toml` describes it. One struct a table, one field a key; the unit is in the name.

mod body;
mod checks;
mod controller;
mod effects;
mod radio;
mod sensor;

use std::path::Path;

use serde::Serialize;

pub use self::effects::Effects;
pub use body::{
    Backbone, Body, Eccentric, Feet, FootNumbers, Ground, Module, ModuleKind, ModuleNumbers, OwnModule, Side,
};
pub use controller::Controller;
pub use radio::Radio;
pub use sensor::{Adc, Correction, Encoder, InGap, Potentiometer, SecondPotentiometer, Sensor};

use crate::error::{Problem, RobotFileError};
use crate::parts::Pairs;
use crate::schema::{Reader, TomlTable, table};
use crate::tree;

/// A physical number with where it comes from and how sure it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// The nominal value, in the unit that the key's name ends with.
    pub value: f64,
    /// Lower end of the plausible range, same unit.
    pub low: f64,
    /// Upper end of the plausible range, same unit.
    pub high: f64,
    /// Data sheet, paper, measurement or "estimate".
    pub source: String,
}

table! {
    /// A whole robot file.
    pub struct Robot {
        /// Short name, e.g. `scram-26`.
        name: String,
        /// One line for people.
        summary: String,
        /// The gearmotor, referred to the output shaft.
        motor: Motor,
        /// What turns with the shaft.
        load: Load,
        /// The H-bridge and its PWM.
        driver: Driver,
        /// What feeds the bridge.
        supply: Supply,
        /// The angle sensor.
        sensor: Sensor,
        /// The radio link, as it is simulated; missing where no link is.
        radio: Option<Radio>,
        /// The modules; missing for a motor on a bench.
        body: Option<Body>,
        /// The soft backbones between the modules.
        backbone: Option<Backbone>,
        /// The eccentric on the shaft.
        eccentric: Option<Eccentric>,
        /// The feet of the modules.
        feet: Option<Feet>,
        /// What the feet stand on.
        ground: Option<Ground>,
        /// Controller design and limits; missing for a rig that is only diagnosed.
        controller: Option<Controller>,
        /// The effects that the model has.
        effects: Effects,
    }
}

table! {
    /// `[motor]`
    pub struct Motor {
        /// Winding resistance.
        resistance_ohm: Quantity = 0.01..=1000.0,
        /// Winding inductance.
        inductance_h: Quantity = 1e-7..=1.0,
        /// Kt = Ke at the output shaft.
        torque_constant_nm_per_a: Quantity = 1e-4..=100.0,
        /// Rotor and gears reflected to the output shaft.
        rotor_inertia_kg_m2: Quantity = 1e-9..=1.0,
        /// Viscous damping at the output shaft.
        viscous_nm_s_per_rad: Quantity = 0.0..=1.0,
        /// Gear ratio, motor turns per shaft turn.
        gear_ratio: Quantity = 0.1..=10_000.0,
        /// Highest current that it bears for long.
        continuous_current_a: Quantity = 0.001..=100.0,
        /// How fast the winding warms and cools against its housing: the first, shorter time constant.
        thermal_time_constant_s: Quantity = 0.01..=1000.0,
    }
}

table! {
    /// `[load]`
    pub struct Load {
        /// The eccentric (or the pendulum) about the shaft; with an `[eccentric]`, what follows from it.
        inertia_kg_m2: Quantity = 0.0..=1.0,
    }
}

table! {
    /// `[driver]`
    pub struct Driver {
        /// PWM frequency.
        pwm_frequency_hz: Quantity = 10.0..=1e6,
        /// Duty steps from 0 to 1; 0 for a continuous (ideal) driver.
        pwm_steps: Quantity = 0.0..=1e6,
        /// Time per PWM period in which the bridge does not follow the command (turn-on minus turn-off delay, dead time).
        dead_time_s: Quantity = 0.0..=1e-3,
    }
}

table! {
    /// `[supply]`
    pub struct Supply {
        /// The bridge's supply with no load.
        rail_v: Quantity = 0.5..=60.0,
        /// The cell behind the regulator; missing for a bench supply.
        battery: Option<Battery>,
    }
}

table! {
    /// `[supply.battery]`
    pub struct Battery {
        /// Charge when full.
        capacity_ah: Quantity = 0.001..=100.0,
        /// Internal resistance of the cell.
        resistance_ohm: Quantity = 1e-4..=10.0,
        /// Open-circuit voltage against charge: `[charge 0..1, volt]` pairs, charge increasing.
        open_circuit_v: Vec<[f64; 2]> = Pairs {
            bounds: [0.0..=1.0, 0.5..=60.0],
            units: ["1", "V"],
            rule: "charge 0 … 1 and voltage, both increasing, from charge 0 to charge 1",
        },
        /// State of charge at the start of a run, 0 … 1.
        charge: Quantity = 0.0..=1.0,
        /// Boost converter's efficiency, 0 … 1.
        boost_efficiency: Quantity = 0.1..=1.0,
        /// Highest output current of the boost converter.
        boost_limit_a: Quantity = 0.01..=100.0,
        /// What the electronics draw from the rail beside the motor.
        logic_current_a: Quantity = 0.0..=10.0,
        /// Share of the cell's voltage that the divider hands to the ADC.
        divider: Quantity = 0.001..=1.0,
    }
}

impl Robot {
    /// Reads a robot file, with its base when it has one.
    ///
    /// # Errors
    /// The file cannot be read, is no TOML, or is no robot: everything that is wrong, with file, line and field.
    pub fn load(path: &Path) -> Result<Self, RobotFileError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| {
            let (message, help) = if error.kind() == std::io::ErrorKind::NotFound {
                ("no such file".into(), Some("name a robot file, e.g. robot.toml or one of robots/".into()))
            } else {
                (format!("cannot be read: {error}"), None)
            };
            RobotFileError::new(vec![Problem::without_text(&name, message, help)])
        })?;
        Self::parse(&text, &name)
    }

    /// The file and line (from 1) in which a field stands, by its dotted path, e.g. `motor.resistance_ohm`: of a field that a base
    /// has, the base's. `None` where there is none, or no file.
    #[must_use]
    pub fn line_of(path: &Path, field: &str) -> Option<(String, usize)> {
        let table = tree::grow(&std::fs::read_to_string(path).ok()?, &path.display().to_string()).ok()?;
        let problem = table.find(field)?.key.problem(field, "");
        Some((problem.file, problem.line?))
    }

    /// Reads a robot from the text of its file. The name is for messages, and a `base` is looked for beside it.
    ///
    /// # Errors
    /// The text is no TOML or no robot: everything that is wrong, with file, line and field.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, RobotFileError> {
        let table = tree::grow(text, file_name).map_err(RobotFileError::new)?;
        let mut reader = Reader::default();
        let robot = Self::read_table(&mut reader, &table, "");
        if let Some(robot) = &robot {
            checks::check(robot, &table, &mut reader);
        }
        match robot {
            Some(robot) if reader.problems.is_empty() => Ok(robot),
            _ => Err(RobotFileError::new(reader.problems)),
        }
    }
}
