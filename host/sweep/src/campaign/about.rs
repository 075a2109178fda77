//! What a table is of.

use toml::{Table, Value};

use super::Campaign;
use crate::axis::Axis;
use crate::design::Design;
use crate::journal::PHYSICS;
use crate::trial::{DriveKind, RunSettings, simulate};

/// Time that the run takes whose end says which physics a table is of, s.
const PROBE_S: f64 = 0.05;
/// Layout of the tables.
const FORMAT: i64 = 2;

impl Campaign {
    /// Everything that the table depends on: the design, the robot, and what a moment of its first run measures here.
    #[must_use]
    pub fn about(&self) -> Table {
        let numbers = |values: &[f64]| Value::Array(values.iter().map(|value| Value::Float(*value)).collect());
        let mut about = Table::new();
        about.insert("format".into(), Value::Integer(FORMAT));
        about.insert("drive".into(), Value::String(drive_name(self.settings.drive)));
        about.insert("seconds".into(), Value::Float(self.settings.seconds));
        about.insert("step_s".into(), Value::Float(self.settings.step_s));
        about.insert("precision".into(), Value::String(format!("{:?}", self.settings.precision).to_lowercase()));
        let seeds = self.design.seeds.iter().map(|seed| Value::Integer(i64::from_ne_bytes(seed.to_ne_bytes())));
        about.insert("seeds".into(), Value::Array(seeds.collect()));
        about.insert("runs_a_robot".into(), Value::Integer(self.design.runs_a_robot as i64));
        about.insert(PHYSICS.into(), numbers(&self.probe()));
        if Design::count(&self.design.axes, 1) != self.design.points.len() {
            // Not every combination: which ones.
            about
                .insert("points".into(), Value::Array(self.design.points.iter().map(|point| numbers(point)).collect()));
        }
        let axis = |axis: &Axis| (axis.what.column(), numbers(&axis.values));
        about.insert("axes".into(), Value::Table(self.design.axes.iter().map(axis).collect()));
        let robot = serde_json::to_value(self.builder.robot()).unwrap_or_default();
        about.insert("robot".into(), to_toml(&robot).unwrap_or(Value::Table(Table::new())));
        about
    }

    /// What is measured of a moment of the first run: another program's table differs in it.
    fn probe(&self) -> Vec<f64> {
        let settings = RunSettings { seconds: PROBE_S, ..self.settings };
        // A body that cannot be has a note in its row, and no physics.
        let outcomes = self.trial(0).ok().and_then(|trial| simulate(&[trial], &settings).ok()).unwrap_or_default();
        outcomes.iter().flat_map(|outcome| outcome.measures.values()).flatten().collect()
    }
}

/// As `--drive` spells it, with the numbers that it has.
fn drive_name(drive: DriveKind) -> String {
    match drive {
        DriveKind::Motor => "motor".into(),
        DriveKind::Ideal { phase_noise } => format!("ideal, phase error {} rad", phase_noise),
        DriveKind::Exact => "exact".into(),
    }
}

/// TOML has no null: what a file leaves out is left out.
fn to_toml(value: &serde_json::Value) -> Option<Value> {
    use serde_json::Value as Json;
    Some(match value {
        Json::Null => return None,
        Json::Bool(value) => Value::Boolean(*value),
        Json::Number(number) => Value::Float(number.as_f64()?),
        Json::String(text) => Value::String(text.clone()),
        Json::Array(items) => Value::Array(items.iter().filter_map(to_toml).collect()),
        Json::Object(table) => {
            Value::Table(table.iter().filter_map(|(key, value)| Some((key.clone(), to_toml(value)?))).collect())
        }
    })
}
