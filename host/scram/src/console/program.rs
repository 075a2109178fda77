//! Commands one after the other: a typed line, or a script.
//!
//! A script has one or more commands a line, `#` begins a comment, and a number before a command is a time in s since its
//! beginning: what `scram sim --drive script:FILE` runs, the console runs too.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::command::{self, ConsoleCommand};

/// The next command is not due yet.
pub(super) struct Later;

struct Step {
    /// Since the beginning, where a time is given.
    at: Option<Duration>,
    command: ConsoleCommand,
    text: String,
    line: usize,
}

/// What is left to do.
pub(super) struct Program {
    path: Option<PathBuf>,
    /// The robot that its commands are for, whichever is looked at.
    pub robot: usize,
    begun: Duration,
    steps: VecDeque<Step>,
    /// No step before this.
    resume: Duration,
    text: String,
}

impl Program {
    /// What was typed in one line, each command with its text.
    pub fn typed(commands: impl Iterator<Item = (ConsoleCommand, String)>, robot: usize, now: Duration) -> Self {
        let steps = commands.map(|(command, text)| Step { at: None, text, command, line: 1 });
        Self { path: None, robot, begun: now, steps: steps.collect(), resume: now, text: String::new() }
    }

    /// Reads a script.
    pub fn load(path: &Path, robot: usize, now: Duration) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let steps = read(&text).map_err(|(line, problem)| format!("{}, line {line}: {problem}", path.display()))?;
        if steps.is_empty() {
            return Err(format!("{}: no command in it", path.display()));
        }
        Ok(Self { path: Some(path.to_owned()), robot, begun: now, steps, resume: now, text: String::new() })
    }

    /// The next command that is due; nothing at the end.
    pub fn next(&mut self, now: Duration) -> Option<Result<ConsoleCommand, Later>> {
        loop {
            let step = self.steps.front()?;
            let due = step.at.map_or(self.resume, |at| self.resume.max(self.begun + at));
            if now < due {
                return Some(Err(Later));
            }
            let step = self.steps.pop_front()?;
            if let ConsoleCommand::Wait(time) = step.command {
                self.resume = now + time;
                if self.steps.is_empty() {
                    // The end comes after the time, too.
                    self.steps.push_back(Step { command: ConsoleCommand::Wait(Duration::ZERO), at: None, ..step });
                    if time.is_zero() {
                        return None;
                    }
                }
                continue;
            }
            self.text = step.text;
            return Some(Ok(step.command));
        }
    }

    /// The command that came last, as it was written.
    pub fn text(&self) -> String {
        self.text.clone()
    }

    /// Whether it was typed: then what it picks is picked on the screen, too.
    pub fn is_typed(&self) -> bool {
        self.path.is_none()
    }

    /// The script and the line that is next.
    pub fn place(&self) -> Option<(PathBuf, usize)> {
        Some((self.path.clone()?, self.steps.front().map_or(0, |step| step.line)))
    }
}

fn read(text: &str) -> Result<VecDeque<Step>, (usize, String)> {
    let mut steps = VecDeque::new();
    let mut latest = Duration::ZERO;
    for (index, line) in text.lines().enumerate() {
        let wrong = |problem: String| (index + 1, problem);
        let line = line.split('#').next().unwrap_or_default().trim();
        let (first, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let (mut at, commands) = match first.parse::<f64>() {
            Ok(at_s) if !(0.0..=86_400.0).contains(&at_s) => {
                return Err(wrong(format!("time {at_s} is no time in a day")));
            }
            Ok(at_s) => (Some(Duration::from_secs_f64(at_s)), rest),
            Err(_) => (None, line),
        };
        if let Some(at) = at {
            if at < latest {
                return Err(wrong(format!("time {} is before {}", at.as_secs_f64(), latest.as_secs_f64())));
            }
            if commands.trim().is_empty() {
                return Err(wrong("a time without a command".into()));
            }
            latest = at;
        }
        for text in commands.split(';').map(str::trim).filter(|text| !text.is_empty()) {
            for command in command::parse(text).map_err(wrong)? {
                if matches!(command, ConsoleCommand::Script(_)) {
                    return Err(wrong("a script cannot run a script".into()));
                }
                steps.push_back(Step { at: at.take(), command, text: text.to_owned(), line: index + 1 });
            }
        }
    }
    Ok(steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(program: &mut Program, ms: u64) -> Option<String> {
        match program.next(Duration::from_millis(ms)) {
            Some(Ok(_)) => Some(program.text()),
            Some(Err(Later)) => None,
            None => Some("end".into()),
        }
    }

    fn program(text: &str) -> Program {
        let steps = read(text).unwrap_or_else(|error| panic!("{error:?}"));
        Program { path: None, robot: 0, begun: Duration::ZERO, steps, resume: Duration::ZERO, text: String::new() }
    }

    #[test]
    fn waits_and_times_are_kept_and_the_end_waits_too() {
        let mut program = program("freq 7 # go\nwait 0.5; freq -7\n2 coast\nwait 1s");
        assert_eq!(due(&mut program, 0).as_deref(), Some("freq 7"));
        assert_eq!(due(&mut program, 10), None);
        assert_eq!(due(&mut program, 509), None);
        assert_eq!(due(&mut program, 510).as_deref(), Some("freq -7"));
        assert_eq!(due(&mut program, 1999), None);
        assert_eq!(due(&mut program, 2000).as_deref(), Some("coast"));
        assert_eq!(due(&mut program, 2001), None);
        assert_eq!(due(&mut program, 3000), None);
        assert_eq!(due(&mut program, 3001).as_deref(), Some("end"));
    }

    #[test]
    fn a_wrong_line_is_named() {
        for (text, line) in
            [("freq 7\nfrek 8", 2), ("1 freq 7\n0.5 idle", 2), ("2", 1), ("script x", 1), ("-1 idle", 1)]
        {
            assert_eq!(read(text).err().map(|(line, _)| line), Some(line), "{text}");
        }
    }
}
