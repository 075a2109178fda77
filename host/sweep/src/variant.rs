//! Robots that differ from the file in what a sweep varies.

use hal_sim::body::Plan;
use robot_file::edit::Document;
use robot_file::robot::{ModuleKind, Quantity};
use robot_file::{Robot, RobotFileError};
use serde_json::Value;

use super::axis::{Axis, AxisError, Factor};

/// Modules that a chain may have.
const MOST_MODULES: f64 = 64.0;
/// Inertia of what the shaft turns.
pub(super) const LOAD: &str = "load.inertia_kg_m2";
/// Quantities that must be whole numbers.
pub(super) const WHOLE: [&str; 1] = ["backbone.segments"];

/// A robot as one condition has it.
#[derive(Clone, Debug)]
pub struct Variant {
    /// The robot.
    pub robot: Robot,
    /// Its body, with the factor on the friction in it.
    pub plan: Plan,
}

/// The robot file that variants are made from.
#[derive(Clone, Debug)]
pub struct VariantBuilder {
    document: Document,
    robot: Robot,
    quantities: Vec<(String, Quantity)>,
}

impl VariantBuilder {
    /// From a robot file.
    ///
    /// # Errors
    /// The file has no body.
    pub fn new(document: Document, robot: Robot) -> Result<Self, AxisError> {
        if let Err(error) = Plan::new(&robot) {
            return Err(AxisError::NoBody(error.to_string()));
        }
        Ok(Self::of_any(document, robot))
    }

    /// From a robot file, with a body or without: for [`Self::quantity`] and [`Self::edited`].
    #[must_use]
    pub fn of_any(document: Document, robot: Robot) -> Self {
        let mut quantities = Vec::new();
        collect(&serde_json::to_value(&robot).unwrap_or_default(), "", &mut quantities);
        for (path, _) in &mut quantities {
            // The controller's struct has a part more than its file.
            *path = path.replace("controller.numbers.", "controller.");
        }
        Self { document, robot, quantities }
    }

    /// The robot as the file has it.
    #[must_use]
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// The robot file.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Every quantity by its dotted path.
    #[must_use]
    pub fn quantities(&self) -> &[(String, Quantity)] {
        &self.quantities
    }

    /// The quantity at a dotted path.
    #[must_use]
    pub fn quantity(&self, path: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|(known, _)| known == path).map(|(_, quantity)| quantity)
    }

    /// Checks that every value of every axis can be reached on its own; says which lie outside the file's spread.
    ///
    /// # Errors
    /// The first that cannot.
    pub fn check(&self, axes: &[Axis]) -> Result<Vec<String>, AxisError> {
        let mut warnings = Vec::new();
        for axis in axes {
            for value in &axis.values {
                self.variant(std::slice::from_ref(axis), &[*value])?;
            }
            if let Some((path, quantity)) = self.spread(&axis.what) {
                let outside = axis.values.iter().filter(|&&value| value < quantity.low || value > quantity.high);
                let outside: Vec<String> = outside.map(f64::to_string).collect();
                if !outside.is_empty() {
                    warnings.push(format!(
                        "axis `{path}`: {} outside the {} … {} that the robot file thinks plausible",
                        outside.join(", "),
                        quantity.low,
                        quantity.high
                    ));
                }
            }
        }
        Ok(warnings)
    }

    /// The plausible range of what an axis changes. α is a choice of the builder, not an uncertain number.
    fn spread<'a>(&'a self, what: &'a Factor) -> Option<(&'a str, &'a Quantity)> {
        match what {
            Factor::Quantity(path) => self.quantity(path).map(|quantity| (path.as_str(), quantity)),
            _ => None,
        }
    }

    /// The robot with a value for every axis. The frequency is none of its properties.
    ///
    /// # Errors
    /// It cannot be brought there.
    pub fn variant(&self, axes: &[Axis], point: &[f64]) -> Result<Variant, AxisError> {
        let values = || axes.iter().map(|axis| &axis.what).zip(point.iter().copied());
        let mut robot = self.with_quantities(values())?;
        // The number of modules first: it says which backbones there are.
        for (what, value) in values() {
            if *what == Factor::Modules {
                set_modules(&mut robot, value)?;
            }
        }
        for (what, value) in values() {
            if *what == Factor::Alpha {
                set_alpha(&mut robot, value)?;
            }
        }
        for (what, value) in values() {
            if let Factor::Roll(backbone) = what {
                set_roll(&mut robot, *backbone, value)?;
            }
        }
        let named: Vec<String> = values().map(|(what, value)| format!("{}={value}", what.path())).collect();
        let mut plan = Plan::new(&robot)
            .map_err(|error| unreachable(&named.join(", "), error.to_string(), "choose other values"))?;
        for (what, value) in values() {
            if let (Factor::FrictionFactor, Some(contact)) = (what, &mut plan.contact) {
                contact.friction *= value;
            }
        }
        Ok(Variant { robot, plan })
    }

    fn with_quantities<'a>(&self, values: impl Iterator<Item = (&'a Factor, f64)>) -> Result<Robot, AxisError> {
        let set: Vec<(&str, f64)> = values
            .filter_map(
                |(what, value)| if let Factor::Quantity(path) = what { Some((path.as_str(), value)) } else { None },
            )
            .collect();
        if set.is_empty() {
            return Ok(self.robot.clone());
        }
        let changed = self.edited(&set)?;
        changed.robot().map_err(|error| unreachable(set[0].0, error.to_string(), "look at the robot file and its base"))
    }

    /// The robot file with other values of some quantities; where one lies outside the file's spread the spread grows.
    ///
    /// # Errors
    /// A path is no quantity, or a value is not allowed.
    pub fn edited(&self, values: &[(&str, f64)]) -> Result<Document, AxisError> {
        let mut quantities = Vec::with_capacity(values.len() + 1);
        for &(path, value) in values {
            let Some(old) = self.quantity(path) else { return Err(self.unknown(path)) };
            if WHOLE.contains(&path) && value.fract() != 0.0 {
                let axis = format!("{path}={value}");
                return Err(unreachable(&axis, "must be a whole number".into(), "leave the fraction out"));
            }
            quantities.push((path, moved(old, value)));
        }
        quantities.extend(self.load(values));
        let mut document = self.document.clone();
        document.set_all(&quantities).map_err(|error| self.refused(values, &error))?;
        Ok(document)
    }

    /// What the shaft carries follows from the eccentric, unless it is varied itself.
    fn load(&self, values: &[(&str, f64)]) -> Option<(&'static str, Quantity)> {
        let eccentric = values.iter().any(|(path, _)| path.starts_with("eccentric."));
        if !eccentric || values.iter().any(|(path, _)| *path == LOAD) {
            return None;
        }
        let mut changed = self.robot.eccentric.clone()?;
        for &(path, value) in values {
            match path {
                "eccentric.mass_kg" => changed.mass_kg.value = value,
                "eccentric.radius_m" => changed.radius_m.value = value,
                "eccentric.bolt_radius_m" => changed.bolt_radius_m.value = value,
                _ => {}
            }
        }
        Some((LOAD, moved(self.quantity(LOAD)?, changed.inertia_kg_m2())))
    }

    /// The first problem of an edit, with the value that it is about.
    fn refused(&self, values: &[(&str, f64)], error: &RobotFileError) -> AxisError {
        let problem = error.problems().first();
        let field = problem.map_or("", |problem| problem.field.as_str());
        let own = values.iter().find(|(path, _)| field.starts_with(path));
        let about = own.or(values.first());
        let axis = about.map_or(String::new(), |(path, value)| format!("{path}={value}"));
        let message = problem.map_or("", |problem| problem.message.as_str());
        let said = if own.is_some() { message.to_owned() } else { format!("{field}: {message}") };
        let spread = about.and_then(|(path, _)| self.quantity(path));
        let help =
            spread.map_or(String::new(), |old| format!("the robot file thinks {} … {} plausible", old.low, old.high));
        unreachable(&axis, said, &help)
    }

    fn unknown(&self, path: &str) -> AxisError {
        let table = path.rsplit_once('.').map_or("", |(table, _)| table);
        let beside: Vec<&str> = self
            .quantities
            .iter()
            .map(|(known, _)| known.as_str())
            .filter(|known| known.rsplit_once('.').is_some_and(|(of, _)| of == table))
            .collect();
        let help = if beside.is_empty() {
            let mut tables: Vec<&str> = self
                .quantities
                .iter()
                .filter_map(|(known, _)| known.rsplit_once('.'))
                .map(|(table, _)| table)
                .collect();
            tables.dedup();
            format!(
                "an axis is f, alpha, body.modules, backbone.roll_deg[N], or a quantity of one of the file's tables: {}; \
                 an effect's table must be in the file",
                tables.join(", ")
            )
        } else {
            format!("[{table}] has {}", beside.join(", "))
        };
        unreachable(path, format!("`{}` has no such quantity", self.robot.name), &help)
    }
}

/// A quantity at another value; its spread grows where it must.
fn moved(old: &Quantity, value: f64) -> Quantity {
    Quantity { value, low: old.low.min(value), high: old.high.max(value), source: old.source.clone() }
}

fn unreachable(axis: &str, problem: String, help: &str) -> AxisError {
    AxisError::Unreachable { axis: axis.into(), problem, help: help.into() }
}

/// Everything with value, low, high and source.
fn collect(value: &Value, path: &str, found: &mut Vec<(String, Quantity)>) {
    let Value::Object(table) = value else { return };
    let number = |key: &str| table.get(key).and_then(Value::as_f64);
    if let (Some(value), Some(low), Some(high), Some(source)) =
        (number("value"), number("low"), number("high"), table.get("source").and_then(Value::as_str))
    {
        found.push((path.into(), Quantity { value, low, high, source: source.into() }));
        return;
    }
    for (key, inner) in table {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        collect(inner, &path, found);
    }
}

fn set_modules(robot: &mut Robot, count: f64) -> Result<(), AxisError> {
    let axis = format!("body.modules={count}");
    if count.fract() != 0.0 || !(2.0..=MOST_MODULES).contains(&count) {
        let problem = "is no number of modules".to_owned();
        return Err(unreachable(&axis, problem, &format!("a chain has 2 to {MOST_MODULES} modules, a whole number")));
    }
    let kind = |index| match index {
        0 => ModuleKind::Actuator,
        1 => ModuleKind::Courier,
        _ => ModuleKind::Passive,
    };
    if let Some(body) = &mut robot.body {
        body.modules = (0..count as usize).map(kind).collect();
    }
    Ok(())
}

fn set_alpha(robot: &mut Robot, alpha: f64) -> Result<(), AxisError> {
    let Some(backbone) = &mut robot.backbone else { return Ok(()) };
    let axis = format!("alpha={alpha}");
    if backbone.roll_deg.is_some() {
        let problem = "changes nothing: backbone.roll_deg gives every backbone its own angle".to_owned();
        return Err(unreachable(&axis, problem, "remove roll_deg from the robot file, or vary backbone.roll_deg[N]"));
    }
    if !(-360.0..=360.0).contains(&alpha) {
        return Err(unreachable(&axis, "is outside the allowed range".into(), "α lies in -360 … 360°"));
    }
    backbone.alpha_deg.value = alpha;
    Ok(())
}

fn set_roll(robot: &mut Robot, index: usize, roll: f64) -> Result<(), AxisError> {
    let (Some(body), Some(backbone)) = (&robot.body, &mut robot.backbone) else { return Ok(()) };
    let count = body.modules.len().saturating_sub(1);
    let axis = format!("backbone.roll_deg[{}]={roll}", index + 1);
    if index >= count {
        let problem = format!("there is no backbone {}", index + 1);
        return Err(unreachable(&axis, problem, &format!("the robot has backbones 1 to {count}")));
    }
    if !(-1080.0..=1080.0).contains(&roll) {
        return Err(unreachable(&axis, "is outside the allowed range".into(), "a roll lies in -1080 … 1080°"));
    }
    let alpha = backbone.alpha_deg.value;
    let rolls = backbone.roll_deg.get_or_insert_with(|| (1..=count).map(|b| b as f64 * alpha).collect());
    if let Some(place) = rolls.get_mut(index) {
        *place = roll;
    }
    Ok(())
}
