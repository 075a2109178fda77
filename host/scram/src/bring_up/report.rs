//! The report to send in.

use std::fmt::Write;

use serde::Serialize;

use super::step::{Check, Checked, Chip, StepResult};

/// Results of all steps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Name from the robot file.
    pub robot: String,
    /// ESP-NOW (MAC) address, as colon-separated hexadecimal bytes.
    pub address: String,
    /// Its chip, as it was told.
    pub chip: Chip,
    /// It was simulated: this says nothing about a board.
    pub simulated: bool,
    /// Its image makes faults on request.
    pub injectable: bool,
    /// Version of this program.
    pub program: &'static str,
    /// Version of the messages.
    pub messages: String,
    /// Steps that passed.
    pub passed: usize,
    /// Steps that failed.
    pub failed: usize,
    /// Steps that nobody looked at, or not at all of it.
    pub not_checked: usize,
    /// The steps, in the order of their numbers.
    pub steps: Vec<Checked>,
}

impl Report {
    /// How many steps have a verdict.
    #[must_use]
    pub fn count(&self, verdict: StepResult) -> usize {
        self.steps.iter().filter(|step| step.verdict == verdict).count()
    }

    /// The numbers of the steps with a verdict.
    #[must_use]
    pub fn numbers(&self, verdict: StepResult) -> String {
        let numbers = self.steps.iter().filter(|step| step.verdict == verdict).map(|step| step.number.to_string());
        numbers.collect::<Vec<_>>().join(", ")
    }

    /// For people, and to be sent in.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = format!("# Bring-up of {} ({})\n\n", self.robot, self.chip.name());
        if self.simulated {
            text += "**Simulated: this says nothing about a board.**\n\n";
        }
        let injection = if self.injectable { "yes" } else { "no" };
        // A String takes everything.
        let _ = writeln!(
            text,
            "Radio address {}, fault injection built in: {injection}, scram {}, messages {}.\n",
            self.address, self.program, self.messages
        );
        let _ = writeln!(
            text,
            "{} passed, {} failed, {} not checked. Numbers are those of firmware/UNVERIFIED.md.\n",
            self.passed, self.failed, self.not_checked
        );
        text += "| step | | |\n|---:|---|---|\n";
        for step in &self.steps {
            let _ = writeln!(text, "| {} | {} | {} |", step.number, step.title, step.verdict.word());
        }
        for (verdict, heading) in
            [(StepResult::Failed, "Failed"), (StepResult::NotChecked, "Not checked"), (StepResult::Passed, "Passed")]
        {
            let _ = writeln!(text, "\n## {heading}");
            let mut steps = self.steps.iter().filter(|step| step.verdict == verdict).peekable();
            if steps.peek().is_none() {
                text += "\nnone\n";
            }
            steps.for_each(|step| text += &details(step));
        }
        text
    }
}

fn details(step: &Checked) -> String {
    let mut text = format!("\n### {} {}\n", step.number, step.title);
    if !step.needs.is_empty() {
        let _ = writeln!(text, "\nNeeds {}.", step.needs);
    }
    text += "\n| what | found | expected | |\n|---|---|---|---|\n";
    for Check { what, found, expected, verdict } in &step.checks {
        let cells = [what, found, expected].map(|cell| cell.replace('|', "\\|"));
        let _ = writeln!(text, "| {} | {} |", cells.join(" | "), verdict.word());
    }
    text
}

/// What made a step fail, or what was not looked at, in a line each.
#[must_use]
pub fn lines(step: &Checked) -> Vec<String> {
    let of_interest =
        step.checks.iter().filter(|check| check.verdict == step.verdict && check.verdict != StepResult::Passed);
    let line = |check: &Check| match check.verdict {
        StepResult::NotChecked => format!("{}: {}", check.what, check.found),
        _ => format!("{}: {}; expected: {}", check.what, check.found, check.expected),
    };
    of_interest.map(line).collect()
}
