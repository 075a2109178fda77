//! Whoever stands at the board: does what a program cannot do over the link, and reads instruments.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use miette::{IntoDiagnostic, Report, WrapErr, miette};
use toml::Value;

use super::step::{Check, Step, StepResult};
use link::LinkError;

/// Keeps the session with the robot alive meanwhile.
pub type Keep<'k> = dyn FnMut() -> Result<(), LinkError> + 'k;

/// Something to do at the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act {
    /// The supply off for a second.
    PowerCycle,
    /// A short press of the reset button.
    ResetButton,
    /// The reset button held for a second.
    HoldReset,
    /// A reset by the computer over the chip's USB.
    UsbReset,
    /// The processor halted from outside.
    Halt,
    /// The supply lowered until the chip resets, and raised again.
    BrownOut,
    /// The motor plugged in, or out.
    Motor(bool),
    /// A voltage on the wiper's pin, V, or the wiper again.
    Wiper(Option<f64>),
    /// The eccentric mass held, or let go.
    HoldShaft(bool),
    /// The wiper's lead pulled, or put back.
    WiperLead(bool),
    /// The cell's supply lowered to a voltage, V, or back where it was.
    Cell(Option<f64>),
}

impl Act {
    /// Phrase for the operator.
    #[must_use]
    pub fn words(self) -> String {
        match self {
            Self::PowerCycle => "Take the robot's supply away for a second, and put it back.".into(),
            Self::ResetButton => "Press the robot's reset button.".into(),
            Self::HoldReset => "Hold the robot's reset button for a second.".into(),
            Self::UsbReset => "Reset the robot over its USB: espflash reset --port PORT.".into(),
            Self::Halt => "Halt the processor by JTAG (openocd: halt).".into(),
            Self::BrownOut => "Lower the 3.3 V slowly until the LED goes out, then raise it again.".into(),
            Self::Motor(true) => "Plug the motor in, shaft free to turn, hands away.".into(),
            Self::Motor(false) => "Unplug the motor.".into(),
            Self::Wiper(Some(volt)) => format!("Put {volt:.2} V on the wiper's pin, in place of the wiper."),
            Self::Wiper(None) => "Put the potentiometer's wiper back on its pin.".into(),
            Self::HoldShaft(true) => "Hold the mass so that the shaft stands still.".into(),
            Self::HoldShaft(false) => "Let the mass go.".into(),
            Self::WiperLead(false) => "Pull the wiper's lead off.".into(),
            Self::WiperLead(true) => "Put the wiper's lead back.".into(),
            Self::Cell(Some(volt)) => format!("Lower the cell's supply to {volt:.1} V."),
            Self::Cell(None) => "Raise the cell's supply to 3.8 V again.".into(),
        }
    }
}

/// An input of the bridge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// PWM here turns the shaft counter-clockwise.
    In1,
    /// PWM here turns it clockwise.
    In2,
}

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// From the LED's falling edge, where a fault begins, to EN's last falling edge, ms.
    EnableAfterMark,
    /// EN never high since the instrument was armed.
    EnableLow,
    /// The bridge's inputs never high since then.
    InputsLow,
    /// Longest time that EN was high since then, s.
    EnablePulse,
    /// Share of the period that an input is high, %.
    Share(Input),
    /// How often the LED flashes before its pause.
    Flashes,
    /// The shaft turns counter-clockwise.
    CounterClockwise,
    /// The cell, V.
    Cell,
    /// One conversion, µs.
    Conversion,
    /// Something else.
    Other,
}

/// What is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// The operator answers "yes".
    Yes,
    /// A number from one to another.
    Between(f64, f64, &'static str),
    /// A number to be noted.
    Number(&'static str),
}

impl Expected {
    fn words(self) -> String {
        match self {
            Self::Yes => "yes".into(),
            Self::Between(low, high, unit) => format!("{low} … {high} {unit}").trim_end().to_owned(),
            Self::Number(unit) => format!("noted, {unit}"),
        }
    }
}

/// A question to whoever reads the instruments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Its key in a file of answers.
    pub key: &'static str,
    /// For people.
    pub text: &'static str,
    /// What is looked at.
    pub signal: Signal,
    /// What is expected.
    pub expected: Expected,
}

/// What was seen.
#[derive(Clone, Debug, PartialEq)]
pub enum Seen {
    /// Yes or no.
    Is(bool),
    /// Reading of an instrument, in the question's unit.
    Value(f64),
    /// Nobody looked, and why.
    Nothing(String),
}

impl Observation {
    /// What it says about the step.
    #[must_use]
    pub fn evaluate(&self, seen: &Seen) -> Check {
        let (found, good) = match (seen, self.expected) {
            (Seen::Nothing(why), _) => (why.clone(), None),
            (Seen::Is(is), Expected::Yes) => (if *is { "yes" } else { "no" }.to_owned(), Some(*is)),
            (Seen::Value(value), Expected::Between(low, high, unit)) => {
                (number(*value, unit), Some((low..=high).contains(value)))
            }
            (Seen::Value(value), Expected::Number(unit)) => (number(*value, unit), Some(true)),
            _ => ("an answer of another kind".to_owned(), None),
        };
        let verdict = match good {
            Some(true) => StepResult::Passed,
            Some(false) => StepResult::Failed,
            None => StepResult::NotChecked,
        };
        Check { what: self.text.to_owned(), found, expected: self.expected.words(), verdict }
    }
}

/// A number that people read, with its unit.
#[must_use]
pub fn number(value: f64, unit: &str) -> String {
    let digits = if value.abs() >= 100.0 { 0 } else { 2 };
    format!("{value:.digits$} {unit}").trim_end().to_owned()
}

/// Whoever stands at the board.
pub trait Operator {
    /// A step is about to begin: whether it shall.
    ///
    /// # Errors
    /// The link broke meanwhile.
    fn begin(&mut self, step: &Step, keep: &mut Keep) -> Result<bool, LinkError>;

    /// Does something; false where nobody does. `at_once` asks for something while the motor runs: nobody waits for a word
    /// that it was done, because the robot tells.
    ///
    /// # Errors
    /// The link broke meanwhile.
    fn act(&mut self, act: Act, at_once: bool, keep: &mut Keep) -> Result<bool, LinkError>;

    /// From now on counts what the instruments see.
    fn arm(&mut self);

    /// Reads an instrument.
    ///
    /// # Errors
    /// The link broke meanwhile.
    fn observe(&mut self, step: u16, observation: &Observation, keep: &mut Keep) -> Result<Seen, LinkError>;

    /// Lets time pass in which the robot hears nothing.
    fn silence(&mut self, time: Duration);

    /// A step has ended.
    fn ended(&mut self, step: &super::step::Checked);
}

/// Nobody at the board: what was noted earlier, or nothing.
pub struct Absent<'e> {
    answers: Answers,
    asked: BTreeSet<(u16, &'static str)>,
    ended: &'e mut dyn FnMut(&super::step::Checked),
}

/// Answers by step and key.
#[derive(Clone, Debug, Default)]
pub struct Answers(BTreeMap<u16, BTreeMap<String, Seen>>);

impl Answers {
    /// Reads a file of answers: a table a step, a line a question.
    ///
    /// # Errors
    /// It cannot be read, or something in it is no answer.
    pub fn load(path: &Path) -> Result<Self, Report> {
        let text = std::fs::read_to_string(path)
            .into_diagnostic()
            .wrap_err_with(|| format!("{} cannot be read", path.display()))?;
        Self::parse(&text).wrap_err_with(|| format!("{} is no file of answers", path.display()))
    }

    fn parse(text: &str) -> Result<Self, Report> {
        let tables: BTreeMap<String, BTreeMap<String, Value>> = toml::from_str(text)
            .map_err(|error| miette!(help = "a table a step: [6], then KEY = true, false or a number", "{error}"))?;
        let mut answers = BTreeMap::new();
        for (name, table) in tables {
            let step: u16 = name
                .parse()
                .map_err(|_| miette!(help = "it is a number in firmware/UNVERIFIED.md", "[{name}] is no step"))?;
            let mut of_step = BTreeMap::new();
            for (key, value) in table {
                let seen = match value {
                    Value::Boolean(is) => Seen::Is(is),
                    Value::Integer(whole) => Seen::Value(whole as f64),
                    Value::Float(value) => Seen::Value(value),
                    other => {
                        return Err(miette!(
                            help = "true, false or a number; leave out what was not looked at",
                            "[{name}] {key} = {other} is no answer"
                        ));
                    }
                };
                of_step.insert(key, seen);
            }
            answers.insert(step, of_step);
        }
        Ok(Self(answers))
    }
}

impl<'e> Absent<'e> {
    /// With what was noted earlier; `ended` hears of every step.
    pub fn new(answers: Answers, ended: &'e mut dyn FnMut(&super::step::Checked)) -> Self {
        Self { answers, asked: BTreeSet::new(), ended }
    }

    /// Answers to what nobody asked.
    #[must_use]
    pub fn unused(&self) -> Vec<String> {
        let keys = self.answers.0.iter().flat_map(|(step, table)| table.keys().map(move |key| (*step, key.as_str())));
        keys.filter(|key| !self.asked.contains(key)).map(|(step, key)| format!("[{step}] {key}")).collect()
    }
}

impl Operator for Absent<'_> {
    fn begin(&mut self, _: &Step, _: &mut Keep) -> Result<bool, LinkError> {
        Ok(true)
    }

    fn act(&mut self, _: Act, _: bool, _: &mut Keep) -> Result<bool, LinkError> {
        Ok(false)
    }

    fn arm(&mut self) {}

    fn observe(&mut self, step: u16, observation: &Observation, _: &mut Keep) -> Result<Seen, LinkError> {
        self.asked.insert((step, observation.key));
        let seen = self.answers.0.get(&step).and_then(|table| table.get(observation.key));
        Ok(seen
            .cloned()
            .unwrap_or_else(|| Seen::Nothing(format!("nobody looked; [{step}] {} in --answers", observation.key))))
    }

    fn silence(&mut self, time: Duration) {
        std::thread::sleep(time);
    }

    fn ended(&mut self, step: &super::step::Checked) {
        (self.ended)(step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_read_and_what_is_none_is_named() {
        let answers = Answers::parse("[6]\nen-falls = 0.4\nen-stays-low = true\n[20]\nhz = 20").expect("answers");
        assert_eq!(answers.0[&6]["en-falls"], Seen::Value(0.4));
        assert_eq!(answers.0[&6]["en-stays-low"], Seen::Is(true));
        assert_eq!(answers.0[&20]["hz"], Seen::Value(20.0));
        let mut ended = |_: &super::super::step::Checked| {};
        assert_eq!(Absent::new(answers, &mut ended).unused(), ["[6] en-falls", "[6] en-stays-low", "[20] hz"]);
        for (wrong, says) in [("[six]\na = 1", "[six] is no step"), ("[6]\na = \"yes\"", "[6] a"), ("[6]\na", "line 2")]
        {
            let error = Answers::parse(wrong).expect_err(wrong);
            assert!(format!("{error:?}").contains(says), "{error:?}");
        }
    }

    #[test]
    fn a_look_passes_within_its_range_only() {
        let observation = Observation {
            key: "en-falls",
            text: "EN",
            signal: Signal::EnableAfterMark,
            expected: Expected::Between(0.0, 1.0, "ms"),
        };
        let verdict = |seen| observation.evaluate(&seen).verdict;
        assert_eq!(verdict(Seen::Value(0.9)), StepResult::Passed);
        assert_eq!(verdict(Seen::Value(1.1)), StepResult::Failed);
        assert_eq!(verdict(Seen::Value(f64::NAN)), StepResult::Failed);
        assert_eq!(verdict(Seen::Is(true)), StepResult::NotChecked);
        assert_eq!(verdict(Seen::Nothing("x".into())), StepResult::NotChecked);
    }
}
