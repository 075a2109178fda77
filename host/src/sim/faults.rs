//! What breaks during a run: `sensor-open@1.0,stall@1.5`.

use description::robot::{Robot, Sensor};
use hal_sim::Fault;

/// What can break.
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
    /// What breaks.
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
    /// An unknown name or a time that is none.
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
                names: Fault::ALL.iter().map(|fault| fault.name()).chain([LINK_LOST]).collect::<Vec<_>>().join(", "),
            }),
            _ => Ok(()),
        }
    }

    fn parse(text: &str) -> Result<Self, FaultError> {
        let wrong = |problem: String| {
            let mut names: Vec<&str> = Fault::ALL.iter().chain(&Fault::SECOND).map(|fault| fault.name()).collect();
            names.push(LINK_LOST);
            FaultError { text: text.to_owned(), problem, names: names.join(", ") }
        };
        let (name, at) = text.split_once('@').ok_or_else(|| wrong("no `@SECONDS`".into()))?;
        let what = Break::from_name(name.trim()).ok_or_else(|| wrong(format!("no fault `{}`", name.trim())))?;
        match at.trim().parse::<f64>() {
            Ok(at_s) if at_s.is_finite() && at_s >= 0.0 => Ok(Self { at_s, what }),
            _ => Err(wrong(format!("`{}` is not a time in seconds", at.trim()))),
        }
    }
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
}
