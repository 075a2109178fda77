//! What a person types: one command, or several with `;` between.

use std::path::PathBuf;
use std::time::Duration;

use control::parameters::table;

use simulation::DriveCommand;

/// Command of the console, parsed from what a person typed.
#[derive(Clone, Debug, PartialEq)]
pub enum ConsoleCommand {
    /// Command for the controller.
    Drive(DriveCommand),
    /// Play a gait, by its name or the path of its file; sent first if the robot does not have it.
    Gait(String),
    /// Let a policy drive by the robot's poses; the path of its file.
    Policy(String),
    /// Stop the selected robot.
    Stop,
    /// Stop every robot.
    StopAll,
    /// Tell a parameter, by its place in the table.
    Get(u16),
    /// Change a parameter, to a value in its unit.
    Set(u16, f32),
    /// Keep the parameters over the next boot.
    Save,
    /// Back to the factory's parameters.
    Factory,
    /// Take the last `set` back.
    Undo,
    /// List the parameters whose names contain this.
    Parameters(String),
    /// Tell how the robot is.
    Status,
    /// List the robots.
    List,
    /// Pick a robot: by its number from 1, its name or its address.
    Robot(String),
    /// Wait before the next command.
    Wait(Duration),
    /// Run a file of commands.
    Script(PathBuf),
    /// Write something into the recording.
    Note(String),
    /// List the commands.
    Help,
    /// Stop every robot and leave the console.
    Quit,
}

impl ConsoleCommand {
    /// Whether it says what a robot's motor does from then on; `stop` comes before all of these.
    pub fn drives(&self) -> bool {
        matches!(self, Self::Drive(_) | Self::Gait(_) | Self::Policy(_)) && *self != Self::Drive(DriveCommand::Clear)
    }
}

/// Every command: how it is typed, and what it does.
pub const HELP: &[(&str, &str)] = &[
    ("freq HZ", "hold an actuation frequency; positive is clockwise from above"),
    ("oscillate FROM TO", "swing between two angles, deg; `proportional` behind it: the thesis's stroke"),
    ("position DEG", "go to an angle and stay"),
    ("duty SHARE", "open loop, -1 to 1; positive is counter-clockwise"),
    (
        "gait NAME",
        "play a gait of robots/gaits, or of a file; sent first, with the bridge off, if the robot has another",
    ),
    ("policy FILE", "let a learned policy drive by the robot's poses: `--poses`"),
    ("coast", "bridge off, the shaft turns out"),
    ("idle", "bridge off"),
    ("stop", "bridge off, before everything else; `stop all`: every robot"),
    ("clear", "leave the fault state"),
    ("get NAME", "tell a parameter"),
    ("set NAME VALUE", "change a parameter until the next boot"),
    ("undo", "take the last `set` back"),
    ("save", "keep the parameters over the next boot"),
    ("factory", "back to the parameters that were built in"),
    ("params PART", "list the parameters whose names contain PART"),
    ("status", "tell how the robot is"),
    ("list", "list the robots"),
    ("robot WHICH", "pick a robot by number, name or address"),
    ("wait 2s", "let time pass before the next command"),
    ("script FILE", "run commands from a file, one or more a line"),
    ("note TEXT", "write something into the recording"),
    ("help", "list the commands"),
    ("quit", "stop every robot and leave"),
];

/// Reads a line: its commands in order.
///
/// # Errors
/// What is wrong, and what was expected.
pub fn parse(line: &str) -> Result<Vec<ConsoleCommand>, String> {
    let parts = line.split(';').map(str::trim).filter(|part| !part.is_empty());
    let commands: Vec<ConsoleCommand> = parts.map(one).collect::<Result<_, _>>()?;
    if commands.len() > 1 && commands.iter().any(|command| matches!(command, ConsoleCommand::Script(_))) {
        return Err("`script` stands alone: put the other commands into the file".into());
    }
    Ok(commands)
}

fn one(text: &str) -> Result<ConsoleCommand, String> {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    let rest = rest.trim();
    let bare = |command| if rest.is_empty() { Ok(command) } else { Err(format!("`{word}` takes nothing after it")) };
    let named = |what: &str| if rest.is_empty() { Err(format!("`{word}` needs {what}")) } else { Ok(rest.to_owned()) };
    match word {
        "gait" => named("the name of a gait or its file").map(ConsoleCommand::Gait),
        "policy" => named("the file of a policy").map(ConsoleCommand::Policy),
        "stop" if rest == "all" => Ok(ConsoleCommand::StopAll),
        "stop" => bare(ConsoleCommand::Stop),
        "get" => Ok(ConsoleCommand::Get(parameter(rest)?)),
        "set" => set(rest),
        "save" => bare(ConsoleCommand::Save),
        "factory" => bare(ConsoleCommand::Factory),
        "undo" => bare(ConsoleCommand::Undo),
        "params" => Ok(ConsoleCommand::Parameters(rest.to_owned())),
        "status" => bare(ConsoleCommand::Status),
        "list" => bare(ConsoleCommand::List),
        "robot" => named("a number, a name or an address").map(ConsoleCommand::Robot),
        "wait" => duration(rest).map(ConsoleCommand::Wait),
        "script" => named("a file").map(|file| ConsoleCommand::Script(PathBuf::from(file))),
        "note" => named("a text").map(ConsoleCommand::Note),
        "help" => bare(ConsoleCommand::Help),
        "quit" | "exit" => bare(ConsoleCommand::Quit),
        _ => DriveCommand::parse(word, rest)
            .map(ConsoleCommand::Drive)
            .map_err(|problem| if problem.starts_with("no order") { unknown(word) } else { problem }),
    }
}

fn unknown(word: &str) -> String {
    let known = HELP.iter().map(|(form, _)| first_word(form));
    let near = known.filter(|name| distance(name, word) <= 2).min_by_key(|name| distance(name, word));
    match near {
        Some(near) => format!("there is no command `{word}`; did you mean `{near}`?"),
        None => format!("there is no command `{word}`; `help` lists them"),
    }
}

/// `freq` of `freq HZ`.
pub(super) fn first_word(form: &str) -> &str {
    form.split_whitespace().next().unwrap_or_default()
}

fn set(rest: &str) -> Result<ConsoleCommand, String> {
    let Some((name, value)) = rest.split_once(char::is_whitespace) else {
        return Err("`set` needs a parameter and a value, e.g. `set controller.limits.frequency_hz 9`".into());
    };
    let index = parameter(name)?;
    let value: f32 = value.trim().parse().map_err(|_| format!("`{}` is not a number", value.trim()))?;
    let entry = &table::TABLE[usize::from(index)];
    if !(entry.low..=entry.high).contains(&value) {
        return Err(format!("{} must be from {} to {} {}", entry.name, entry.low, entry.high, entry.unit)
            .trim_end()
            .to_owned());
    }
    Ok(ConsoleCommand::Set(index, value))
}

/// A parameter by its name, or by the end of it where no other has that end.
fn parameter(name: &str) -> Result<u16, String> {
    if name.is_empty() {
        return Err("which parameter? `params` lists them".into());
    }
    if let Some(index) = table::find(name) {
        return Ok(index);
    }
    let ends: Vec<(usize, &str)> =
        table::TABLE.iter().map(|entry| entry.name).enumerate().filter(|(_, full)| ends_with(full, name)).collect();
    match ends.as_slice() {
        [(index, _)] => u16::try_from(*index).map_err(|_| "there is no such parameter".into()),
        [] => Err(match nearest(name) {
            Some(near) => format!("there is no parameter `{name}`; did you mean `{near}`?"),
            None => format!("there is no parameter `{name}`; `params` lists them"),
        }),
        several => {
            let names: Vec<&str> = several.iter().map(|(_, full)| *full).collect();
            Err(format!("`{name}` is the end of {}", names.join(" and ")))
        }
    }
}

/// Whether a name ends with whole parts, e.g. `limits.frequency_hz`.
fn ends_with(full: &str, end: &str) -> bool {
    full.strip_suffix(end).is_some_and(|start| start.ends_with('.'))
}

fn nearest(name: &str) -> Option<&'static str> {
    let last = |full: &'static str| full.rsplit('.').next().unwrap_or(full);
    let wanted = name.rsplit('.').next().unwrap_or(name);
    let names = table::TABLE.iter().map(|entry| entry.name);
    let near = names.min_by_key(|full| distance(last(full), wanted))?;
    (distance(last(near), wanted) <= 3 || near.contains(wanted)).then_some(near)
}

/// Edits from one word to another (Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (index, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = index + 1;
        for (column, to) in b.iter().enumerate() {
            let changed = diagonal + usize::from(from != *to);
            diagonal = row[column + 1];
            row[column + 1] = changed.min(row[column] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// `2s`, `0.5`, `200ms`, `1min`.
fn duration(text: &str) -> Result<Duration, String> {
    let digits = text.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let scale = match text[digits.len()..].trim() {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "min" => 60.0,
        unit => return Err(format!("`{unit}` is no unit of time: s, ms or min")),
    };
    let seconds = digits.trim().parse::<f64>().map(|value| value * scale);
    match seconds {
        Ok(seconds) if (0.0..=86_400.0).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err(format!("`{text}` is no time, e.g. `wait 2s`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_commands() {
        let expected = vec![
            ConsoleCommand::Drive(DriveCommand::Freq { hz: 7.0 }),
            ConsoleCommand::Wait(Duration::from_millis(2500)),
            ConsoleCommand::StopAll,
            ConsoleCommand::Stop,
        ];
        assert_eq!(parse("freq 7; wait 2.5s;stop all; stop ;"), Ok(expected));
        assert_eq!(parse("  "), Ok(Vec::new()));
        assert_eq!(parse("wait 200ms"), Ok(vec![ConsoleCommand::Wait(Duration::from_millis(200))]));
        assert_eq!(parse("oscillate -100 100"), parse("oscillate -100..100"));
        assert_eq!(parse("gait turn-left"), Ok(vec![ConsoleCommand::Gait("turn-left".into())]));
        assert_eq!(parse("gait a folder/b.toml"), Ok(vec![ConsoleCommand::Gait("a folder/b.toml".into())]));
    }

    #[test]
    fn a_parameter_is_found_by_its_end() {
        let index = table::find("controller.limits.frequency_hz").expect("in the table");
        assert_eq!(parse("get limits.frequency_hz"), Ok(vec![ConsoleCommand::Get(index)]));
        assert_eq!(parse("set frequency_hz 9"), Ok(vec![ConsoleCommand::Set(index, 9.0)]));
        let error = parse("get proportional_v_per_rad").expect_err("two have that end");
        assert!(error.contains("position.") && error.contains("oscillator."), "{error}");
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (line, part) in [
            ("frek 7", "did you mean `freq`?"),
            ("spin 7", "`help` lists them"),
            ("freq", "a number is missing"),
            ("stop now", "takes nothing"),
            ("wait long", "s, ms or min"),
            ("wait -1s", "no time"),
            ("get", "which parameter"),
            ("get frequenzy_hz", "did you mean `controller.limits.frequency_hz`?"),
            ("set frequency_hz", "needs a parameter and a value"),
            ("set frequency_hz x", "`x` is not a number"),
            ("set frequency_hz nan", "must be from"),
            ("set frequency_hz 1e9", "must be from"),
            ("robot", "needs a number"),
            ("gait", "needs the name of a gait"),
            ("policy", "needs the file of a policy"),
            ("script gait.txt; stop", "stands alone"),
        ] {
            let error = parse(line).expect_err(line);
            assert!(error.contains(part), "{line}: {error}");
        }
    }
}
