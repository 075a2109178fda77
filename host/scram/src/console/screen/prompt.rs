//! The command line: editing, completion, history.

use ratatui::crossterm::event::Event;
use tui_input::Input;
use tui_input::backend::crossterm::to_input_request;

use super::history::History;
use crate::console::{Candidate, Completion};

/// Longest line, characters: what is pasted by mistake shall not slow the console down.
const LONGEST: usize = 1000;

/// The command line.
#[derive(Debug, Default)]
pub struct Prompt {
    input: Input,
    /// What was typed before.
    pub history: History,
    menu: Option<Menu>,
}

/// Several things that could be meant.
#[derive(Debug)]
pub struct Menu {
    /// What stands before and behind the part that is completed.
    around: (String, String),
    /// The possibilities.
    pub candidates: Vec<Candidate>,
    /// The one that stands in the line.
    pub chosen: Option<usize>,
}

impl Prompt {
    /// With what was typed before.
    #[must_use]
    pub fn new(history: History) -> Self {
        Self { history, ..Self::default() }
    }

    /// The line.
    #[must_use]
    pub fn line(&self) -> &str {
        self.input.value()
    }

    /// The line with its cursor.
    #[must_use]
    pub fn input(&self) -> &Input {
        &self.input
    }

    /// The possibilities, while they are shown.
    #[must_use]
    pub fn menu(&self) -> Option<&Menu> {
        self.menu.as_ref()
    }

    /// Shows the possibilities no more; what was chosen stays.
    pub fn close_menu(&mut self) {
        self.menu = None;
    }

    /// A key for the line.
    pub fn edit(&mut self, event: &Event) {
        self.menu = None;
        if let Some(request) = to_input_request(event) {
            let grows = matches!(request, tui_input::InputRequest::InsertChar(_));
            if !grows || self.line().chars().count() < LONGEST {
                self.input.handle(request);
            }
        }
    }

    /// Something was pasted. Several lines become one, so that nothing is done before Enter.
    pub fn paste(&mut self, text: &str) {
        self.menu = None;
        let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let room = LONGEST.saturating_sub(self.line().chars().count());
        for c in lines.join("; ").chars().filter(|c| !c.is_control()).take(room) {
            self.input.handle(tui_input::InputRequest::InsertChar(c));
        }
    }

    /// Takes the line away; it can be had again from the history.
    pub fn take(&mut self) -> String {
        self.menu = None;
        let line = self.input.value_and_reset();
        self.history.push(&line);
        line
    }

    /// The line before.
    pub fn older(&mut self) {
        if let Some(line) = self.history.older(self.input.value()) {
            self.input = Input::new(line.to_owned());
        }
    }

    /// The line after.
    pub fn newer(&mut self) {
        if let Some(line) = self.history.newer() {
            self.input = Input::new(line.to_owned());
        }
    }

    /// Byte of the cursor.
    #[must_use]
    pub fn cursor(&self) -> usize {
        self.line().char_indices().nth(self.input.cursor()).map_or(self.line().len(), |(at, _)| at)
    }

    /// Writes what all possibilities have in common; several are shown. False if there are none.
    pub fn complete(&mut self, completion: Completion) -> bool {
        let Completion { start, candidates } = completion;
        let (line, cursor) = (self.line(), self.cursor());
        let (Some(head), Some(part), Some(tail)) = (line.get(..start), line.get(start..cursor), line.get(cursor..))
        else {
            return false;
        };
        let (part, around) = (part.to_owned(), (head.to_owned(), tail.to_owned()));
        let common = common_beginning(&candidates);
        // What was typed may stand in the middle of the possibilities: it stays then until one is chosen.
        if candidates.len() == 1 || common.len() > part.len() && common.starts_with(&part) {
            self.write(&around, &common);
        }
        let found = !candidates.is_empty();
        self.menu = (candidates.len() > 1).then_some(Menu { around, candidates, chosen: None });
        found
    }

    /// The next of the possibilities that are shown, or the one before.
    pub fn choose(&mut self, forward: bool) {
        let Some(menu) = &mut self.menu else { return };
        let count = menu.candidates.len();
        let chosen = match (menu.chosen, forward) {
            (None, true) => 0,
            (None, false) => count - 1,
            (Some(at), true) => (at + 1) % count,
            (Some(at), false) => (at + count - 1) % count,
        };
        menu.chosen = Some(chosen);
        let (around, text) = (menu.around.clone(), menu.candidates[chosen].text.clone());
        self.write(&around, &text);
    }

    fn write(&mut self, (head, tail): &(String, String), text: &str) {
        let cursor = head.chars().count() + text.chars().count();
        self.input = Input::new(format!("{head}{text}{tail}")).with_cursor(cursor);
    }
}

fn common_beginning(candidates: &[Candidate]) -> String {
    let Some((first, others)) = candidates.split_first() else { return String::new() };
    let agree = |(index, c): &(usize, char)| others.iter().all(|other| other.text.chars().nth(*index) == Some(*c));
    first.text.chars().enumerate().take_while(agree).map(|(_, c)| c).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn possible(start: usize, texts: &[&str]) -> Completion {
        let candidates = texts.iter().map(|text| Candidate { text: (*text).into(), help: String::new() });
        Completion { start, candidates: candidates.collect() }
    }

    #[test]
    fn completion_writes_what_is_common_and_then_goes_round() {
        let mut prompt = Prompt::default();
        prompt.paste("set con 5");
        prompt.input = prompt.input.clone().with_cursor(7);
        assert!(prompt.complete(possible(4, &["control.one", "control.other"])));
        assert_eq!((prompt.line(), prompt.cursor()), ("set control.o 5", 13));
        let mut seen = Vec::new();
        for forward in [true, true, true, false] {
            prompt.choose(forward);
            seen.push(prompt.line().to_owned());
        }
        assert_eq!(seen, ["set control.one 5", "set control.other 5", "set control.one 5", "set control.other 5"]);
        prompt.close_menu();
        prompt.choose(true);
        assert_eq!(prompt.line(), "set control.other 5");
        assert!(!prompt.complete(possible(0, &[])));
        assert_eq!(prompt.line(), "set control.other 5");
    }

    #[test]
    fn what_stands_in_the_middle_of_names_stays_until_one_is_chosen() {
        let mut prompt = Prompt::default();
        prompt.paste("get speed");
        assert!(prompt.complete(possible(4, &["control.speed.one", "control.speed.other"])));
        assert_eq!(prompt.line(), "get speed");
        assert!(prompt.complete(possible(4, &["control.speed"])));
        assert_eq!(prompt.line(), "get control.speed");
    }

    #[test]
    fn a_completion_that_does_not_fit_the_line_does_nothing() {
        let mut prompt = Prompt::default();
        prompt.paste("é");
        for start in [1, 3, 100] {
            assert!(!prompt.complete(possible(start, &["x"])));
        }
        assert_eq!(prompt.line(), "é");
    }

    #[test]
    fn what_is_pasted_waits_for_enter() {
        let mut prompt = Prompt::default();
        prompt.paste("freq 7\r\n\n  wait 2s\n\x1b[31mstop\n");
        assert_eq!(prompt.line(), "freq 7; wait 2s; [31mstop");
        prompt.paste(&"x".repeat(5000));
        assert_eq!(prompt.line().chars().count(), LONGEST);
    }
}
