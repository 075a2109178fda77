//! The little XML that a model needs: elements with attributes, nested, indented.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Below this a number of the model is rounding left over from a sine or cosine.
const NOTHING: f64 = 1e-15;

/// A text that grows element by element.
#[derive(Default)]
pub(super) struct Xml {
    text: String,
    open: Vec<&'static str>,
}

impl Xml {
    /// An element that is complete.
    pub(super) fn element(&mut self, tag: &'static str, attributes: &[(&str, Cow<'_, str>)]) {
        self.start(tag, attributes);
        self.text.push_str("/>\n");
    }

    /// An element that holds others, until [`Xml::close`].
    pub(super) fn open(&mut self, tag: &'static str, attributes: &[(&str, Cow<'_, str>)]) {
        self.start(tag, attributes);
        self.text.push_str(">\n");
        self.open.push(tag);
    }

    /// Ends the element that was opened last.
    pub(super) fn close(&mut self) {
        if let Some(tag) = self.open.pop() {
            self.indent();
            let _ = writeln!(self.text, "</{tag}>");
        }
    }

    /// A comment on lines of its own.
    pub(super) fn comment(&mut self, lines: &str) {
        // A comment may not hold two hyphens in a row.
        let _ = writeln!(self.text, "<!--\n{}\n-->", lines.replace("--", "- -"));
    }

    /// The text, all elements ended.
    pub(super) fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.text
    }

    fn start(&mut self, tag: &str, attributes: &[(&str, Cow<'_, str>)]) {
        self.indent();
        let _ = write!(self.text, "<{tag}");
        for (name, value) in attributes {
            let value = value.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
            let _ = write!(self.text, " {name}=\"{value}\"");
        }
    }

    fn indent(&mut self) {
        self.text.extend(std::iter::repeat_n(' ', self.open.len()));
    }
}

/// Numbers as an attribute's value, to 12 digits: what is a nanometre in 10 m, and easy to read.
pub(super) fn numbers<'a>(values: &[f64]) -> Cow<'a, str> {
    let words: Vec<String> = values.iter().map(|value| number(*value)).collect();
    words.join(" ").into()
}

fn number(value: f64) -> String {
    if value.abs() < NOTHING {
        return "0".into();
    }
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    if rounded.abs() < 1e-4 { format!("{rounded:e}") } else { rounded.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_exact() {
        let shown = numbers(&[0.1 + 0.2, -0.07 + 1e-17, (0.5 * std::f64::consts::PI).cos(), 3.2e-5, -9.81]);
        assert_eq!(shown, "0.3 -0.07 0 3.2e-5 -9.81");
    }

    #[test]
    fn names_cannot_break_out_of_their_attribute() {
        let mut xml = Xml::default();
        xml.comment("a -- b");
        xml.open("mujoco", &[("model", "\"<&>".into())]);
        let text = xml.finish();
        let document = roxmltree::Document::parse(&text).expect("well-formed");
        assert_eq!(document.root_element().attribute("model"), Some("\"<&>"));
    }
}
