//! What breaks during a run: `sensor-open@1.0,stall@1.5`.

use hal_sim::Fault;
use robot_file::robot::{Robot, Sensor};

/// Reaction of the supervisor that is expected of a break. `cargo figures --only faults` measures each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExpectedReaction {
    /// It ends with the bridge off within the bound of its trigger.
    Found,
    /// A held speed goes on with an estimate that is good enough to drive with; swings and moves may end under the name of
    /// another fault.
    Borne,
    /// No trigger is made for it: the estimate is wrong while the bridge stays on, until another trigger ends it, if one
    /// does. The motor is no more loaded than by a command.
    NotFound,
}

/// What can be broken during a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Break {
    /// A part of the robot.
    Robot(Fault),
    /// The link: no command arrives any more.
    Link,
}

/// Names that people type beside those of [`Fault::name`].
const ALIASES: [(&str, Fault); 4] = [
    ("stall", Fault::Stalled),
    ("sensor-short", Fault::SensorShortLow),
    ("runaway", Fault::MotorReversed),
    ("frozen", Fault::SensorFrozen),
];

/// Name of the link's fault.
const LINK_LOST: &str = "link-lost";

/// A break and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheduled {
    /// Seconds since the start.
    pub at_s: f64,
    /// The break.
    pub what: Break,
}

/// Why a fault list is not understood.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("fault `{text}`: {problem}")]
#[diagnostic(help("write NAME@SECONDS, several with commas, e.g. sensor-open@1.0,stall@1.5; the names are {names}"))]
pub struct FaultError {
    text: String,
    problem: String,
    names: String,
}

impl Break {
    /// The name that people type.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Robot(fault) => fault.name(),
            Self::Link => LINK_LOST,
        }
    }

    /// Every break.
    pub fn all() -> impl Iterator<Item = Self> {
        Fault::ALL.into_iter().map(Self::Robot).chain([Self::Link])
    }

    /// What the supervisor makes of it.
    #[must_use]
    pub fn expected_reaction(self) -> ExpectedReaction {
        match self {
            // The robot goes on with the other sensor: docs/two-sensors.md.
            Self::Robot(Fault::SensorNoisy { .. } | Fault::SecondSensor(_)) => ExpectedReaction::Borne,
            Self::Robot(Fault::SensorDrifting { .. } | Fault::AdcSaturated { .. }) => ExpectedReaction::NotFound,
            Self::Robot(
                Fault::SensorOpen
                | Fault::SensorShortLow
                | Fault::SensorShortHigh
                | Fault::SensorFrozen
                | Fault::Stalled
                | Fault::MotorReversed
                | Fault::MotorOpen
                | Fault::BatteryLow { .. }
                | Fault::RailLow { .. },
            )
            | Self::Link => ExpectedReaction::Found,
        }
    }

    /// The names of every break with a promise.
    #[must_use]
    pub fn names(expected_reaction: ExpectedReaction) -> Vec<&'static str> {
        Self::all().filter(|what| what.expected_reaction() == expected_reaction).map(Self::name).collect()
    }

    fn from_name(name: &str) -> Option<Self> {
        if name == LINK_LOST {
            return Some(Self::Link);
        }
        let alias = ALIASES.iter().find(|(alias, _)| *alias == name).map(|(_, fault)| *fault);
        alias.or_else(|| Fault::from_name(name)).map(Self::Robot)
    }
}

impl Scheduled {
    /// What `--faults` takes.
    ///
    /// # Errors
    /// Unknown name, or a time that cannot be read.
    pub fn parse_list(text: &str) -> Result<Vec<Self>, FaultError> {
        text.split(',').map(str::trim).filter(|entry| !entry.is_empty()).map(Self::parse).collect()
    }

    /// Fails where a fault of the second sensor is to come to a robot with one.
    ///
    /// # Errors
    /// The first such fault.
    pub fn check_parts(list: &[Self], robot: &Robot) -> Result<(), FaultError> {
        let has_second = matches!(&robot.sensor, Sensor::Potentiometer(sensor) if sensor.second.is_some());
        let of_second = |fault: &&Self| matches!(fault.what, Break::Robot(Fault::SecondSensor(_)));
        match list.iter().find(of_second) {
            Some(fault) if !has_second => Err(FaultError {
                text: fault.what.name().to_owned(),
                problem: "the robot file has no [sensor.second]".into(),
                names: Break::all().map(Break::name).collect::<Vec<_>>().join(", "),
            }),
            _ => Ok(()),
        }
    }

    /// The same, for a run of so many seconds: what would break after its end is a mistake.
    ///
    /// # Errors
    /// As [`Scheduled::parse_list`], and a fault that never comes.
    pub fn parse_list_within(text: &str, seconds: f64) -> Result<Vec<Self>, FaultError> {
        let list = Self::parse_list(text)?;
        match list.iter().find(|scheduled| scheduled.at_s >= seconds) {
            None => Ok(list),
            Some(late) => Err(wrong(
                &format!("{}@{}", late.what.name(), late.at_s),
                format!(
                    "it would never come, for the run ends at {seconds} s: let it come earlier, or make the run longer"
                ),
            )),
        }
    }

    fn parse(text: &str) -> Result<Self, FaultError> {
        let (name, at) = text.split_once('@').ok_or_else(|| wrong(text, "no `@SECONDS`".into()))?;
        let what = Break::from_name(name.trim()).ok_or_else(|| wrong(text, format!("no fault `{}`", name.trim())))?;
        match at.trim().parse::<f64>() {
            Ok(at_s) if at_s.is_finite() && at_s >= 0.0 => Ok(Self { at_s, what }),
            _ => Err(wrong(text, format!("`{}` is not a time in seconds", at.trim()))),
        }
    }
}

fn wrong(text: &str, problem: String) -> FaultError {
    let second = Fault::SECOND.into_iter().map(Break::Robot);
    let names: Vec<&str> = Break::all().chain(second).map(Break::name).collect();
    FaultError { text: text.to_owned(), problem, names: names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_faults() {
        let list = Scheduled::parse_list("sensor-open@1.0, stall@1.5,link-lost@2").unwrap();
        let names: Vec<&str> = list.iter().map(|fault| fault.what.name()).collect();
        assert_eq!(names, ["sensor-open", "stalled", "link-lost"]);
        assert_eq!(list[1].at_s, 1.5);
        for fault in Fault::ALL.into_iter().chain(Fault::SECOND) {
            assert_eq!(Scheduled::parse_list(&format!("{}@1", fault.name())).unwrap()[0].what, Break::Robot(fault));
        }
        for wrong in ["stall", "stall@", "stall@x", "stall@-1", "fire@1"] {
            assert!(Scheduled::parse_list(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_fault_after_the_end_of_the_run_is_a_mistake() {
        assert_eq!(Scheduled::parse_list_within("stall@1.9,link-lost@0", 2.0).unwrap().len(), 2);
        for late in ["stall@2", "link-lost@0.5,stall@100"] {
            let said = Scheduled::parse_list_within(late, 2.0).unwrap_err().to_string();
            assert!(said.contains("fault `stalled@") && said.contains("the run ends at 2 s"), "{said}");
        }
    }

    #[test]
    fn every_break_is_promised_one_thing() {
        let expected = [ExpectedReaction::Found, ExpectedReaction::Borne, ExpectedReaction::NotFound].map(Break::names);
        assert_eq!(expected.iter().map(Vec::len).sum::<usize>(), Break::all().count());
        assert_eq!(expected[1..], [vec!["sensor-noisy"], vec!["sensor-drifting", "adc-saturated"]]);
    }
}
