//! What the robot is told during a run, as a person types it: hertz and degrees.
//!
//! `freq:7`, `oscillate:-100..100`, `position:30`, `duty:0.6`, `gait:NAME`, or `script:FILE` with one order a line; the format is
//! in `docs/recordings.md`.

use std::path::{Path, PathBuf};

use control::{Command, Gait, Stroke};
use robot_file::gait::{GaitFile, GaitStep};

use common::conventions::{omega_from_frequency, radians};

/// Command of a drive, in the units in which a person types it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveCommand {
    /// Hold an actuation frequency, Hz, the thesis's sign.
    Freq {
        /// Frequency, Hz, positive clockwise.
        hz: f64,
    },
    /// Swing between two angles.
    Oscillate {
        /// Lower turning point, degrees, counter-clockwise from the middle of the gap.
        from_deg: f64,
        /// Upper turning point, degrees, counter-clockwise from the middle of the gap.
        to_deg: f64,
        /// How a stroke is driven.
        style: Stroke,
    },
    /// Go to an angle.
    Position {
        /// Target angle, degrees, counter-clockwise from the middle of the gap.
        deg: f64,
    },
    /// Open loop: the bridge gets this duty and the controller only watches, for recordings to identify from.
    Duty {
        /// −1 … 1, positive counter-clockwise.
        duty: f64,
    },
    /// Let the robot keep this gait, and play it.
    Gait(Gait),
    /// Bridge off, the shaft turns out.
    Coast,
    /// Bridge off.
    Idle,
    /// Leave the fault state.
    Clear,
}

impl DriveCommand {
    /// The controller's command, in SI units and with the internal sign.
    #[must_use]
    pub fn to_control(self) -> Command {
        match self {
            Self::Freq { hz } => Command::Speed { omega: omega_from_frequency(hz) as f32 },
            Self::Oscillate { from_deg, to_deg, style } => {
                Command::Oscillate { from: radians(from_deg) as f32, to: radians(to_deg) as f32, style }
            }
            Self::Position { deg } => Command::Position { angle: radians(deg) as f32 },
            Self::Coast => Command::Coast,
            Self::Idle => Command::Idle,
            Self::Duty { duty } => Command::Duty { duty: duty as f32 },
            Self::Clear => Command::ClearFault,
            Self::Gait(gait) => Command::Gait { id: gait.id() },
        }
    }

    /// The gait that it plays, if it plays one.
    #[must_use]
    pub fn gait(self) -> Option<Gait> {
        if let Self::Gait(gait) = self { Some(gait) } else { None }
    }

    /// The kind of order, as it is typed.
    #[must_use]
    pub fn kind(self) -> &'static str {
        match self {
            Self::Freq { .. } => "freq",
            Self::Oscillate { .. } => "oscillate",
            Self::Position { .. } => "position",
            Self::Duty { .. } => "duty",
            Self::Coast => "coast",
            Self::Idle => "idle",
            Self::Clear => "clear",
            Self::Gait(_) => "gait",
        }
    }
}

impl From<GaitStep> for DriveCommand {
    fn from(step: GaitStep) -> Self {
        match step {
            GaitStep::Frequency(hz) => Self::Freq { hz },
            GaitStep::Oscillation([from_deg, to_deg]) => Self::Oscillate { from_deg, to_deg, style: Stroke::BangBang },
        }
    }
}

impl std::fmt::Display for DriveCommand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = self.kind();
        match self {
            Self::Freq { hz } => write!(f, "{kind} {hz}"),
            Self::Oscillate { from_deg, to_deg, style: Stroke::BangBang } => write!(f, "{kind} {from_deg}..{to_deg}"),
            Self::Oscillate { from_deg, to_deg, style: Stroke::Proportional } => {
                write!(f, "{kind} {from_deg}..{to_deg} proportional")
            }
            Self::Position { deg } => write!(f, "{kind} {deg}"),
            Self::Duty { duty } => write!(f, "{kind} {duty}"),
            Self::Gait(gait) => write!(f, "{kind} {}", gait.name()),
            Self::Coast | Self::Idle | Self::Clear => f.write_str(kind),
        }
    }
}

/// Command and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Seconds since the start.
    pub at_s: f64,
    /// Command that is given then.
    pub command: DriveCommand,
}

/// The orders of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// In the order of their times.
    pub steps: Vec<Step>,
    /// When a script ends, or a gait for the first time, s.
    pub end_s: Option<f64>,
}

/// Why a drive is not understood.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum DriveError {
    /// Not one of the forms.
    #[error("drive `{text}`: {problem}")]
    #[diagnostic(help(
        "freq:HZ, oscillate:FROM..TO (degrees), position:DEG, duty:SHARE, gait:NAME or script:FILE, e.g. freq:7 or \
         oscillate:-100..100"
    ))]
    Drive {
        /// What was typed.
        text: String,
        /// Problem, as a clause that follows the name.
        problem: String,
    },
    /// A line of a script.
    #[error("{}, line {line}: {problem}", path.display())]
    #[diagnostic(help(
        "a line is `[SECONDS] ORDER`, e.g. `0.5 freq 7`, `oscillate -100..100`, `position 30`, `duty 0.6`, `gait NAME`, \
         `coast`, `idle`, `clear`, or `wait 0.5`; # begins a comment"
    ))]
    Script {
        /// Path of the file, as given.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Problem, as a clause that follows the name.
        problem: String,
    },
    /// The script cannot be read.
    #[error("{}: {source}", path.display())]
    #[diagnostic(help("check the name after script:"))]
    Io {
        /// Path of the file, as given.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// There is no such gait.
    #[error("no gait `{name}`: there is no {}", looked_for.join(" and no "))]
    #[diagnostic(help("name a gait's file{known}"))]
    NoGait {
        /// Its name or path, as given.
        name: String,
        /// The files that it might have been.
        looked_for: Vec<String>,
        /// What there is instead, as a clause.
        known: String,
    },
    /// A gait's file cannot be used.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Gait(#[from] robot_file::RobotFileError),
}

impl Drive {
    /// One order from the start on.
    #[must_use]
    pub fn constant(command: DriveCommand) -> Self {
        Self { steps: vec![Step { at_s: 0.0, command }], end_s: None }
    }

    /// What `--drive` takes.
    ///
    /// # Errors
    /// Not one of the forms, or the script has a wrong line.
    pub fn parse(text: &str) -> Result<Self, DriveError> {
        Self::parse_for(text, None)
    }

    /// The same for the robot of a file: a gait by its name may be beside that file, too ([`GaitFile::places`]).
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn parse_for(text: &str, robot_file: Option<&Path>) -> Result<Self, DriveError> {
        let (kind, argument) = text.split_once(':').unwrap_or((text, ""));
        if kind == "script" {
            return Self::load(Path::new(argument), robot_file);
        }
        if kind == "gait" && !argument.is_empty() {
            let file = gait_file(argument, robot_file)?;
            let drive = Self::constant(DriveCommand::Gait(*file.gait()));
            return Ok(Self { end_s: Some(file.length_s()), ..drive });
        }
        command(kind, argument)
            .map(Self::constant)
            .map_err(|problem| DriveError::Drive { text: text.to_owned(), problem })
    }

    fn load(path: &Path, robot_file: Option<&Path>) -> Result<Self, DriveError> {
        let text = std::fs::read_to_string(path).map_err(|source| DriveError::Io { path: path.to_owned(), source })?;
        Self::parse_lines(&text, path, &|argument| {
            let file = gait_file(argument, robot_file).map_err(|error| error.to_string())?;
            Ok(DriveCommand::Gait(*file.gait()))
        })
    }

    /// The text of a script; `path` is for messages. Nothing is read but the text: `gait` is refused.
    ///
    /// # Errors
    /// The first line that is wrong.
    pub fn parse_script(text: &str, path: &Path) -> Result<Self, DriveError> {
        Self::parse_lines(text, path, &|argument| command("gait", argument))
    }

    fn parse_lines(
        text: &str,
        path: &Path,
        gait: &dyn Fn(&str) -> Result<DriveCommand, String>,
    ) -> Result<Self, DriveError> {
        let mut clock_s = 0.0;
        let mut steps = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let wrong = |problem| DriveError::Script { path: path.to_owned(), line: index + 1, problem };
            let line = line.split('#').next().unwrap_or_default().trim();
            let Some((first, rest)) = split_word(line) else { continue };
            let (kind, argument) = match first.parse::<f64>() {
                Ok(at_s) => {
                    if !at_s.is_finite() || at_s < clock_s {
                        return Err(wrong(format!("time {at_s} is before {clock_s}")));
                    }
                    clock_s = at_s;
                    split_word(rest).ok_or_else(|| wrong("a time without an order".into()))?
                }
                Err(_) => (first, rest),
            };
            if kind == "wait" {
                let wait = number(argument).map_err(wrong)?;
                if wait < 0.0 {
                    return Err(wrong(format!("cannot wait {wait} s")));
                }
                clock_s += wait;
            } else {
                let command = if kind == "gait" { gait(argument.trim()) } else { command(kind, argument) };
                steps.push(Step { at_s: clock_s, command: command.map_err(wrong)? });
            }
        }
        if steps.is_empty() {
            return Err(DriveError::Script { path: path.to_owned(), line: 1, problem: "no order in it".into() });
        }
        Ok(Self { steps, end_s: (clock_s > 0.0).then_some(clock_s) })
    }
}

/// The gait that a person means.
fn gait_file(name: &str, robot_file: Option<&Path>) -> Result<GaitFile, DriveError> {
    let places = GaitFile::places(name, robot_file);
    if let Some(file) = places.iter().find(|place| place.exists()) {
        return Ok(GaitFile::load(file)?);
    }
    let folders = places.iter().filter_map(|place| place.parent());
    let known = folders.map(GaitFile::known_in).find(|names| !names.is_empty()).unwrap_or_else(GaitFile::known);
    let known = if known.is_empty() { String::new() } else { format!(", or one of {}", known.join(", ")) };
    let looked_for = places.iter().map(|place| place.display().to_string()).collect();
    Err(DriveError::NoGait { name: name.to_owned(), looked_for, known })
}

/// The first word and what comes after it.
fn split_word(text: &str) -> Option<(&str, &str)> {
    let text = text.trim();
    if text.is_empty() {
        return None;
    }
    Some(text.split_once(char::is_whitespace).unwrap_or((text, "")))
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ if text.trim().is_empty() => Err("a number is missing".into()),
        _ => Err(format!("`{}` is not a number", text.trim())),
    }
}

impl DriveCommand {
    /// Reads a command: its kind, and what comes after it. Reads no file: `gait` is refused.
    ///
    /// # Errors
    /// What is wrong, for a person.
    pub fn parse(kind: &str, argument: &str) -> Result<Self, String> {
        command(kind, argument)
    }
}

fn command(kind: &str, argument: &str) -> Result<DriveCommand, String> {
    let argument = argument.trim();
    let bare =
        |command| if argument.is_empty() { Ok(command) } else { Err(format!("`{kind}` takes nothing after it")) };
    match kind {
        "freq" => Ok(DriveCommand::Freq { hz: number(argument)? }),
        "oscillate" => {
            let (range, style) = match argument.strip_suffix("proportional") {
                Some(range) => (range.trim_end(), Stroke::Proportional),
                None => (argument, Stroke::BangBang),
            };
            let apart = range.split_once("..").or_else(|| range.split_once(char::is_whitespace));
            let (from, to) = apart.ok_or_else(|| format!("`{range}` is not FROM..TO"))?;
            let (from_deg, to_deg) = (number(from)?, number(to)?);
            if from_deg >= to_deg {
                return Err(format!("{from_deg}° must be below {to_deg}°"));
            }
            Ok(DriveCommand::Oscillate { from_deg, to_deg, style })
        }
        "position" => Ok(DriveCommand::Position { deg: number(argument)? }),
        "duty" => {
            let duty = number(argument)?;
            if duty.abs() > 1.0 {
                return Err(format!("duty {duty} is outside −1 … 1"));
            }
            Ok(DriveCommand::Duty { duty })
        }
        "coast" => bare(DriveCommand::Coast),
        "idle" => bare(DriveCommand::Idle),
        "clear" => bare(DriveCommand::Clear),
        "gait" if argument.is_empty() => Err("a gait's name or file is missing".into()),
        "gait" => Err("a gait is read from a file, which cannot be done here".into()),
        other => Err(format!("no order `{other}`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_forms_of_drive() {
        let drive = Drive::parse("oscillate:-100..100").unwrap();
        let style = Stroke::BangBang;
        assert_eq!(drive, Drive::constant(DriveCommand::Oscillate { from_deg: -100.0, to_deg: 100.0, style }));
        assert_eq!(Drive::parse("freq:-7").unwrap(), Drive::constant(DriveCommand::Freq { hz: -7.0 }));
        for wrong in [
            "",
            "freq",
            "freq:",
            "freq:x",
            "freq:inf",
            "freq:nan",
            "oscillate:5",
            "oscillate:5..-5",
            "duty:2",
            "position:",
            "spin:3",
            "coast:3",
        ] {
            assert!(matches!(Drive::parse(wrong), Err(DriveError::Drive { .. })), "{wrong}");
        }
        assert!(matches!(Drive::parse("script:/nowhere/at/all"), Err(DriveError::Io { .. })));
    }

    #[test]
    fn a_script_has_a_clock() {
        let text =
            "# warm up\nfreq 7\nwait 0.5   # turning\nfreq -7\n2 oscillate -100..100 proportional\nwait 1\n\ncoast\n";
        let drive = Drive::parse_script(text, Path::new("s")).unwrap();
        let at: Vec<f64> = drive.steps.iter().map(|step| step.at_s).collect();
        assert_eq!(at, [0.0, 0.5, 2.0, 3.0]);
        assert_eq!(drive.end_s, Some(3.0));
        assert_eq!(drive.steps[2].command.to_string(), "oscillate -100..100 proportional");
        for (wrong, line) in [("freq 7\n-1 freq 3", 2), ("1 freq 7\n0.5 idle", 2), ("wait x", 1), ("", 1), ("2", 1)] {
            match Drive::parse_script(wrong, Path::new("s")) {
                Err(DriveError::Script { line: found, .. }) => assert_eq!(found, line, "{wrong}"),
                other => panic!("{wrong}: {other:?}"),
            }
        }
    }
}
