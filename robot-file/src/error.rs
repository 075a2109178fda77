//! What is wrong with a robot file: file, line, field, what is allowed, what to do.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file as it was named.
    pub file: String,
    /// Line, from 1; `None` where there is no text to point at (a file that cannot be read).
    pub line: Option<usize>,
    /// The field or table, e.g. `motor.resistance_ohm.value`; empty for the file as a whole.
    pub field: String,
    /// What is wrong and what is allowed.
    pub message: String,
    /// Advice: what to change, where.
    pub help: Option<String>,
    span: Range<usize>,
    text: Arc<str>,
}

impl Problem {
    pub(crate) fn new(file: &str, text: &Arc<str>, span: Range<usize>, field: String, message: String) -> Self {
        let line = 1 + text.as_bytes().iter().take(span.start).filter(|&&byte| byte == b'\n').count();
        Self { file: file.into(), line: Some(line), field, message, help: None, span, text: text.clone() }
    }

    pub(crate) fn without_text(file: &str, message: String, help: Option<String>) -> Self {
        Self { file: file.into(), line: None, field: String::new(), message, help, span: 0..0, text: "".into() }
    }

    pub(crate) fn at(&self) -> (&str, usize) {
        (&self.file, self.span.start)
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if !self.field.is_empty() {
            write!(f, ": {}", self.field)?;
        }
        write!(f, ": {}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, "; {help}")?;
        }
        Ok(())
    }
}

/// Problems that a person is shown: a file of another kind has one in every line.
const SHOWN: usize = 20;

/// A robot file that cannot be used, with everything that is wrong with it in the order of the text. `Display` has the first
/// twenty, a line a problem, and how many others there are; as a [`Diagnostic`] it also shows the lines that it speaks of.
#[derive(Clone, thiserror::Error)]
pub struct RobotFileError {
    problems: Vec<Problem>,
    source_code: Option<NamedSource<Arc<str>>>,
}

impl RobotFileError {
    /// From at least one problem.
    pub(crate) fn new(mut problems: Vec<Problem>) -> Self {
        problems.sort_by(|a, b| a.at().cmp(&b.at()));
        let source_code = problems
            .iter()
            .find(|problem| problem.line.is_some())
            .map(|problem| NamedSource::new(&problem.file, problem.text.clone()));
        Self { problems, source_code }
    }

    /// Everything that is wrong.
    #[must_use]
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }
}

/// As `Display`: the whole text of the file would bury the problem in a failed `unwrap`.
impl fmt::Debug for RobotFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for RobotFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().take(SHOWN).enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{problem}")?;
        }
        match self.problems.len().saturating_sub(SHOWN) {
            0 => Ok(()),
            others => write!(f, "\n… and {others} other mistakes: is this a robot file?"),
        }
    }
}

impl Diagnostic for RobotFileError {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source_code.as_ref().map(|source| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let shown = self.source_code.as_ref()?.name();
        let here = move |problem: &&Problem| problem.line.is_some() && problem.file == shown;
        Some(Box::new(self.problems.iter().take(SHOWN).filter(here).map(|problem| {
            let label = if problem.field.is_empty() { "here" } else { &problem.field };
            LabeledSpan::new_with_span(Some(label.into()), problem.span.clone())
        })))
    }
}
