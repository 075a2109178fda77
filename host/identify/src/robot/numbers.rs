//! Which numbers of a robot file are looked for, and what is believed of each.

use effects::Id;
use hal_sim::body::Plan;
use robot_file::edit::Document;
use robot_file::robot::Quantity;
use sweep::{AxisError, VariantBuilder};

use super::RobotError;
use crate::Z90;

/// Numbers of the file that a walk depends on and nobody knows: in the order of what they are of.
const OF_THE_FILE: [&str; 13] = [
    "backbone.torsion_nm_per_rad",
    "backbone.stiff_nm_per_rad",
    "backbone.soft_nm_per_rad",
    "backbone.torsion_nm_s_per_rad",
    "backbone.stiff_nm_s_per_rad",
    "backbone.soft_nm_s_per_rad",
    "eccentric.mass_kg",
    "eccentric.height_m",
    "ground.friction",
    "feet.normal_n_per_m",
    "feet.normal_s_per_m",
    "feet.shear_n_per_m",
    "feet.shear_n_s_per_m",
];
/// Effects that make a robot uneven, with what is believed of them where the file has none: value, ends, of each key.
const UNEVEN: [(&str, [f64; 3]); 2] = [("payload_offset", [0.0, -0.003, 0.003]), ("foot_friction", [1.0, 0.85, 1.18])];
/// How high the courier's weight lies cannot be told from its tilting modules' stiffness: it is not looked for.
const LEFT_ALONE: &str = "effects.payload_offset.z_m";

/// A number and what is believed of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// Dotted path in the robot file.
    pub path: String,
    /// The file's value.
    pub file: f64,
    /// Whether its logarithm is what varies.
    logarithmic: bool,
    /// Deviation of what is believed, in the logarithm or the number itself.
    deviation: f64,
}

impl Number {
    fn new(path: &str, quantity: &Quantity) -> Option<Self> {
        let Quantity { value, low, high, .. } = *quantity;
        let logarithmic = low > 0.0 && value > 0.0;
        let width = if logarithmic { (high / low).ln() } else { high - low };
        (width > 0.0).then(|| Self { path: path.to_owned(), file: value, logarithmic, deviation: 0.5 * width / Z90 })
    }

    /// At a coordinate: deviations of the belief from the file's value.
    #[must_use]
    pub fn at(&self, coordinate: f64) -> f64 {
        let moved = coordinate * self.deviation;
        if self.logarithmic { self.file * moved.exp() } else { self.file + moved }
    }
}

/// A robot file with the numbers that are looked for in it.
pub struct Numbers {
    builder: VariantBuilder,
    /// The numbers.
    pub all: Vec<Number>,
}

impl Numbers {
    /// Of a robot file, with the effects that make a robot uneven if they are wanted.
    ///
    /// # Errors
    /// The file has no body, or what it has cannot be varied.
    pub fn new(document: &Document, uneven: bool) -> Result<Self, RobotError> {
        let mut document = document.clone();
        if uneven {
            let robot = document.robot().map_err(|error| refused(&error))?;
            for (effect, [value, low, high]) in UNEVEN {
                let Some(id) = Id::of(effect).filter(|id| robot.effects.listed().all(|listed| listed != *id)) else {
                    continue;
                };
                let source = "scram identify robot: what is believed before".to_owned();
                let quantity = Quantity { value, low, high, source };
                let keys = id.spec().parameters.iter().map(|parameter| parameter.key);
                let quantities: Vec<(&str, Quantity)> = keys.map(|key| (key, quantity.clone())).collect();
                document.set_effect(effect, &quantities).map_err(|error| refused(&error))?;
            }
        }
        let robot = document.robot().map_err(|error| refused(&error))?;
        let builder = VariantBuilder::new(document, robot)?;
        let of_effects =
            |path: &str| uneven && UNEVEN.iter().any(|(effect, ..)| path.starts_with(&format!("effects.{effect}.")));
        let wanted = |path: &str| (OF_THE_FILE.contains(&path) || of_effects(path)) && path != LEFT_ALONE;
        let all = builder
            .quantities()
            .iter()
            .filter(|(path, _)| wanted(path))
            .filter_map(|(path, quantity)| Number::new(path, quantity))
            .collect();
        Ok(Self { builder, all })
    }

    /// The robot file at some coordinates.
    ///
    /// # Errors
    /// It allows no such value.
    pub fn document(&self, coordinates: &[f64]) -> Result<Document, AxisError> {
        let values: Vec<(&str, f64)> =
            self.all.iter().zip(coordinates).map(|(number, at)| (number.path.as_str(), number.at(*at))).collect();
        self.builder.edited(&values)
    }

    /// The body at some coordinates.
    ///
    /// # Errors
    /// There is no such body, with the reason.
    pub fn plan(&self, coordinates: &[f64]) -> Result<Plan, String> {
        let document = self.document(coordinates).map_err(|error| error.to_string())?;
        let robot = document.robot().map_err(|error| error.to_string())?;
        Plan::new(&robot).map_err(|error| error.to_string())
    }
}

fn refused(error: &robot_file::RobotFileError) -> RobotError {
    RobotError::CannotRun(error.to_string())
}
