//! Which numbers of a robot file are looked for, and what is believed of each.

use effects::Id;
use hal_sim::body::Plan;
use robot_file::edit::Document;
use robot_file::robot::Quantity;
use sweep::{AxisError, VariantBuilder};

use super::RobotError;
use crate::Z90;

/// Numbers of the file that a walk depends on and nobody knows: in the order of what they are of. Those of the effects that act on the
/// ground come on top.
const OF_THE_FILE: [&str; 15] = [
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
    // What the motor lets the body do to its shaft within a turn.
    "eccentric.servo_nm_per_rad",
    "eccentric.servo_nm_s_per_rad",
];
/// Effects that make a robot uneven.
const UNEVEN: [&str; 2] = ["payload_offset", "foot_friction"];

/// How a number varies.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// Its logarithm.
    Logarithmic,
    /// Itself.
    Linear,
    /// Upwards alone from an effect's absence: either sign of the coordinate means the same.
    OneSided,
}

/// A number and what is believed of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// Dotted path in the robot file.
    pub path: String,
    /// The file's value.
    pub file: f64,
    scale: Scale,
    /// Deviation of what is believed, in the logarithm or the number itself.
    deviation: f64,
    /// What an effect's key allows.
    allowed: (f64, f64),
}

impl Number {
    fn new(path: &str, quantity: &Quantity) -> Option<Self> {
        let Quantity { value, low, high, .. } = *quantity;
        let (scale, half) = if low > 0.0 && value > 0.0 {
            (Scale::Logarithmic, 0.5 * (high / low).ln())
        } else if low == 0.0 && value == 0.0 {
            (Scale::OneSided, high)
        } else {
            (Scale::Linear, 0.5 * (high - low))
        };
        let allowed = allowed(path).unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        (half > 0.0).then(|| Self { path: path.to_owned(), file: value, scale, deviation: half / Z90, allowed })
    }

    /// At a coordinate: deviations of the belief from the file's value.
    #[must_use]
    pub fn at(&self, coordinate: f64) -> f64 {
        let moved = coordinate * self.deviation;
        match self.scale {
            Scale::Logarithmic => self.file * moved.exp(),
            Scale::Linear => self.file + moved,
            Scale::OneSided => self.file + moved.abs(),
        }
    }

    /// Between a number of deviations of its own below a coordinate and as many above, as far as the catalogue allows it.
    #[must_use]
    pub fn interval(&self, coordinate: f64, half_width: f64) -> (f64, f64) {
        let (low, high) = match self.scale {
            Scale::OneSided => {
                let size = coordinate.abs();
                (self.at((size - half_width).max(0.0)), self.at(size + half_width))
            }
            _ => (self.at(coordinate - half_width), self.at(coordinate + half_width)),
        };
        (low.max(self.allowed.0), high.min(self.allowed.1))
    }

    /// Whether it is 0 where an effect is absent and can only grow from there: then a coordinate and its negative mean the same.
    #[must_use]
    pub fn is_one_sided(&self) -> bool {
        self.scale == Scale::OneSided
    }

    /// Whether an effect's table has it.
    #[must_use]
    pub fn is_of(&self, effect: Id) -> bool {
        let table = self.path.strip_prefix("effects.").and_then(|rest| rest.split_once('.'));
        table.is_some_and(|(name, _)| name == effect.name())
    }
}

/// What the catalogue allows of an effect's key.
fn allowed(path: &str) -> Option<(f64, f64)> {
    let (effect, key) = path.strip_prefix("effects.")?.split_once('.')?;
    let key = Id::of(effect)?.spec().parameters.iter().find(|one| one.key == key)?;
    Some((key.low, key.high))
}

/// A robot file with the numbers that are looked for in it.
pub struct Numbers {
    builder: VariantBuilder,
    /// The numbers: the file's, those of its effects on the ground, those of the effects that were added.
    pub all: Vec<Number>,
}

impl Numbers {
    /// Of a robot file, with the effects that make a robot uneven if they are wanted.
    ///
    /// # Errors
    /// The file has no body, or what it has cannot be varied.
    pub fn new(document: &Document, uneven: bool) -> Result<Self, RobotError> {
        let effects: Vec<Id> = if uneven { UNEVEN.into_iter().filter_map(Id::of).collect() } else { Vec::new() };
        Self::with_effects(document, &effects)
    }

    /// Of a robot file, with effects that act on the ground: one that the file has not is believed to be as large as the catalogue says.
    ///
    /// # Errors
    /// The file has no body, or what it has cannot be varied.
    pub fn with_effects(document: &Document, effects: &[Id]) -> Result<Self, RobotError> {
        let mut document = document.clone();
        let robot = document.robot().map_err(|error| refused(&error))?;
        for id in effects.iter().filter(|id| robot.effects.listed().all(|listed| listed != **id)) {
            let belief = |key: &effects::Parameter| {
                let [value, low, high] = key.belief.unwrap_or([0.0; 3]);
                (key.key, Quantity { value, low, high, source: "what is believed before anything is measured".into() })
            };
            let quantities: Vec<_> = id.spec().parameters.iter().map(belief).collect();
            document.set_effect(id.name(), &quantities).map_err(|error| refused(&error))?;
        }
        let robot = document.robot().map_err(|error| refused(&error))?;
        let on_the_ground: Vec<Id> = robot.effects.listed().filter(|id| id.spec().acts.on_the_ground()).collect();
        let builder = VariantBuilder::new(document, robot)?;
        let of_the_file = OF_THE_FILE.iter().filter_map(|path| Number::new(path, builder.quantity(path)?));
        let of_effects = builder.quantities().iter().filter_map(|(path, quantity)| Number::new(path, quantity));
        let of_effects = of_effects.filter(|number| on_the_ground.iter().any(|id| number.is_of(*id)));
        Ok(Self { all: of_the_file.chain(of_effects).collect(), builder })
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

#[cfg(test)]
mod tests {
    use super::*;

    fn number(path: &str, [value, low, high]: [f64; 3]) -> Number {
        Number::new(path, &Quantity { value, low, high, source: String::new() }).unwrap()
    }

    #[test]
    fn an_interval_has_its_value_in_it_and_no_more_than_is_allowed() {
        let share = number("effects.foot_hertz_contact.share", [0.0, 0.0, 1.0]);
        assert!(share.is_one_sided() && (share.at(-0.5) - 0.5 / Z90).abs() < 1e-12 && share.at(0.5) == share.at(-0.5));
        for coordinate in [-1.4, -0.1, 0.0, 0.2, 1.6] {
            let (low, high) = share.interval(coordinate, 0.7);
            assert!(0.0 <= low && low <= share.at(coordinate) && share.at(coordinate) <= high && high <= 1.0);
        }
        let friction = number("ground.friction", [0.8, 0.4, 1.6]);
        let (low, high) = friction.interval(0.0, Z90);
        assert!((low - 0.4).abs() < 1e-12 && (high - 1.6).abs() < 1e-12, "{low} {high}");
        assert!(
            Number::new(
                "effects.payload_offset.z_m",
                &Quantity { value: 0.0, low: 0.0, high: 0.0, source: String::new() }
            )
            .is_none(),
            "held"
        );
    }
}
