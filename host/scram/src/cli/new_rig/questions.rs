//! Questions on the terminal, one a line. An option answers a question before it is asked; answers may also come through a pipe.

use std::io::{BufRead, IsTerminal};

use miette::miette;

use super::super::{Failure, ask, say};

/// A question.
pub struct Question {
    /// The option that answers it, without dashes.
    pub option: &'static str,
    /// What is asked, with its unit.
    pub text: &'static str,
    /// For example.
    pub example: &'static str,
    /// What an empty answer means; a question without one must be answered.
    pub default: Option<&'static str>,
}

/// Who asks.
pub struct Asker {
    is_terminal: bool,
}

impl Asker {
    pub fn new() -> Self {
        Self { is_terminal: std::io::stdin().is_terminal() }
    }

    /// The answer to a question, read by `read`, which says what is wrong with it. A person may try again.
    pub fn answer<T>(
        &mut self,
        question: &Question,
        given: Option<&str>,
        read: impl Fn(&str) -> Result<T, String>,
    ) -> Result<T, Failure> {
        let wrong = |problem: String| {
            let help = format!("for example --{} {}", question.option, question.example);
            Failure::Usage(miette!(help = help, "--{}: {problem}", question.option))
        };
        if let Some(given) = given {
            return read(given.trim()).map_err(wrong);
        }
        loop {
            let Some(line) = self.line(question)? else {
                // Nobody is there to ask.
                let default = question.default.ok_or_else(|| missing(question))?;
                return read(default).map_err(wrong);
            };
            let answer = match (line.trim(), question.default) {
                ("", Some(default)) => default,
                (answer, _) => answer,
            };
            match read(answer) {
                Err(problem) if self.is_terminal => say(&format!("  {problem}")),
                done => return done.map_err(wrong),
            }
        }
    }

    /// A line of stdin; `None` at its end.
    fn line(&mut self, question: &Question) -> Result<Option<String>, Failure> {
        if self.is_terminal {
            let default = question.default.map_or_else(String::new, |default| format!(" [{default}]"));
            ask(&format!("{} (for example {}){default}: ", question.text, question.example));
        }
        let mut line = String::new();
        match std::io::stdin().lock().read_line(&mut line) {
            Ok(0) => Ok(None),
            Ok(_) => Ok(Some(line)),
            Err(error) => Err(miette!("stdin: {error}").into()),
        }
    }
}

fn missing(question: &Question) -> Failure {
    let help = format!("say --{} {}", question.option, question.example);
    Failure::Usage(miette!(help = help, "{}: nobody answers, and --{} is missing", question.text, question.option))
}

/// A positive number, in decimal point or comma, with or without this unit behind it; `None` for "unknown".
pub fn number(text: &str, unit: &str) -> Result<Option<f64>, String> {
    if is_unknown(text) {
        return Ok(None);
    }
    let bare = text.strip_suffix(unit).unwrap_or(text).trim();
    // 1,200 is a thousand and two hundred to some and a little over one to others.
    if bare
        .split_once(',')
        .is_some_and(|(_, behind)| behind.len() == 3 && behind.bytes().all(|one| one.is_ascii_digit()))
    {
        return Err(format!("`{text}` may mean two numbers: write it with a point or without thousands' separators"));
    }
    match bare.replace(',', ".").parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(Some(value)),
        Ok(value) => Err(format!("{value} is not a positive number")),
        Err(_) if unit.is_empty() => Err(format!("`{text}` is no number")),
        Err(_) => Err(format!("`{text}` is no number in {unit}")),
    }
}

/// Whether somebody does not know.
pub fn is_unknown(text: &str) -> bool {
    matches!(text.to_ascii_lowercase().as_str(), "unknown" | "?")
}
