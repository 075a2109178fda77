//! Tab: what could be meant.

use control::parameters::table;
use robot_file::gait::GaitFile;

use super::command::{HELP, first_word};

/// What a part of a line could become.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Completion {
    /// `line[start..cursor]` is replaced.
    pub start: usize,
    /// By one of these.
    pub candidates: Vec<Candidate>,
}

/// One possibility.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// What it becomes.
    pub text: String,
    /// What that is.
    pub help: String,
}

/// What could be meant at a byte of a line.
pub(super) fn complete<'a>(line: &str, cursor: usize, robots: impl Iterator<Item = &'a str>) -> Completion {
    let cursor = (0..=cursor.min(line.len())).rev().find(|at| line.is_char_boundary(*at)).unwrap_or(0);
    let before = &line[..cursor];
    // Only the last command of the line counts.
    let command = before.rfind(';').map_or(0, |at| at + 1);
    let command = command + (before[command..].len() - before[command..].trim_start().len());
    let typed = &before[command..];
    let Some((word, _)) = typed.split_once(char::is_whitespace) else {
        let fits = HELP.iter().filter(|(form, _)| first_word(form).starts_with(typed));
        let candidates = fits.map(|(form, help)| Candidate {
            text: if form.contains(' ') { format!("{} ", first_word(form)) } else { (*form).to_owned() },
            help: format!("{form}: {help}"),
        });
        return Completion { start: command, candidates: candidates.collect() };
    };
    let start = before.rfind(char::is_whitespace).map_or(0, |at| at + 1);
    let part = &before[start..];
    let first_argument = typed[..start - command].split_whitespace().count() == 1;
    let candidates = match word {
        "get" | "set" if first_argument => parameters(part, word == "set"),
        "params" if first_argument => parameters(part, false),
        "stop" => fixed(part, &[("all", "every robot")]),
        "oscillate" => fixed(part, &[("proportional", "the thesis's stroke")]),
        "robot" => robots
            .filter(|name| name.starts_with(part))
            .map(|name| Candidate { text: name.to_owned(), help: String::new() })
            .collect(),
        "gait" if first_argument => gaits(part),
        "policy" | "script" => files(part),
        _ => Vec::new(),
    };
    Completion { start, candidates }
}

fn fixed(part: &str, words: &[(&str, &str)]) -> Vec<Candidate> {
    let fits = words.iter().filter(|(word, _)| word.starts_with(part));
    fits.map(|(word, help)| Candidate { text: (*word).to_owned(), help: (*help).to_owned() }).collect()
}

/// Parameters whose names begin with what was typed, or else have it in them.
fn parameters(part: &str, with_space: bool) -> Vec<Candidate> {
    let space = if with_space { " " } else { "" };
    let candidate = |entry: &table::Entry| Candidate {
        text: format!("{}{space}", entry.name),
        help: format!("{} to {} {}", entry.low, entry.high, entry.unit).trim_end().to_owned(),
    };
    let begin: Vec<_> = table::TABLE.iter().filter(|entry| entry.name.starts_with(part)).map(candidate).collect();
    if begin.is_empty() {
        table::TABLE.iter().filter(|entry| entry.name.contains(part)).map(candidate).collect()
    } else {
        begin
    }
}

/// Gaits of `robots/gaits` by their names, and files.
fn gaits(part: &str) -> Vec<Candidate> {
    let named = GaitFile::known().into_iter().filter(|name| name.starts_with(part));
    let named = named.map(|name| Candidate { text: name, help: "a gait of robots/gaits".to_owned() });
    named.chain(files(part)).collect()
}

fn files(part: &str) -> Vec<Candidate> {
    let (directory, name) = part.rsplit_once('/').map_or(("", part), |(directory, name)| (directory, name));
    let listed = std::fs::read_dir(if directory.is_empty() { "." } else { directory });
    let mut found: Vec<Candidate> = listed
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| {
            let file = entry.file_name().into_string().ok().filter(|file| file.starts_with(name))?;
            let end = if entry.file_type().is_ok_and(|kind| kind.is_dir()) { "/" } else { "" };
            let text = if directory.is_empty() { format!("{file}{end}") } else { format!("{directory}/{file}{end}") };
            Some(Candidate { text, help: String::new() })
        })
        .collect();
    found.sort_by(|a, b| a.text.cmp(&b.text));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(line: &str) -> (usize, Vec<String>) {
        let completion = complete(line, line.len(), ["one", "other"].into_iter());
        (completion.start, completion.candidates.into_iter().map(|candidate| candidate.text).collect())
    }

    #[test]
    fn commands_parameters_and_robots() {
        assert_eq!(texts("fr"), (0, vec!["freq ".into()]));
        assert_eq!(texts("freq 7; sto"), (8, vec!["stop".into()]));
        assert_eq!(texts("stop a"), (5, vec!["all".into()]));
        assert_eq!(texts("robot o"), (6, vec!["one".into(), "other".into()]));
        assert_eq!(texts("get controller.limits.freq"), (4, vec!["controller.limits.frequency_hz".into()]));
        assert_eq!(texts("set limits.freq"), (4, vec!["controller.limits.frequency_hz ".into()]));
        assert_eq!(texts("set controller.limits.frequency_hz 9").1, Vec::<String>::new());
        assert_eq!(texts("").1.len(), HELP.len());
    }

    #[test]
    fn a_gait_is_one_of_the_project_or_a_file() {
        // The tests run beside the crate's own files.
        let (start, files) = texts("gait Car");
        assert_eq!((start, files), (5, vec!["Cargo.toml".into()]));
        assert_eq!(texts("gait Cargo.toml x").1, Vec::<String>::new());
        assert_eq!(texts("gai"), (0, vec!["gait ".into()]));
    }

    #[test]
    fn any_cursor_in_any_text_is_borne() {
        for line in ["é;ü get ä", "set", "  ;;  ", "script /nowhere/at/all"] {
            for cursor in 0..=line.len() + 2 {
                let _ = complete(line, cursor, std::iter::empty());
            }
        }
    }
}
