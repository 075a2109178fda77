//! The catalogue as a document for people: docs/effects.md.

use std::fmt::Write;

use crate::catalogue::Id;
use crate::spec::{Parameter, Spec};

/// Every effect with its law, source, parameters and what it is mistaken for, as Markdown.
#[must_use]
pub fn markdown() -> String {
    let mut text = String::new();
    for id in Id::all() {
        write_effect(&mut text, id);
    }
    text
}

// Writing into a String cannot fail.
fn write_effect(text: &mut String, id: Id) {
    let spec = id.spec();
    let mut title = spec.title.chars();
    let title = title.next().map_or_else(String::new, |first| first.to_uppercase().chain(title).collect());
    let _ = write!(text, "## {title}: `{}`\n\n", spec.name);
    let _ = write!(text, "{}: {}. It acts {}.\n\n", title, spec.clause, spec.acts.words());
    let _ = writeln!(text, "* Law: {}", cell(spec.law));
    let _ = writeln!(text, "* Source: {}", spec.source);
    if !spec.acts.on_the_ground() {
        let _ = writeln!(text, "* Its misfit shows in `{}`.", spec.shows_in.name());
    }
    if !spec.candidate {
        let _ =
            writeln!(text, "* The diagnosis tries it where the file lacks it only if asked to: `--try {}`.", spec.name);
    }
    for contained in spec.contains {
        let _ = writeln!(text, "* It contains `{contained}` and takes its place.");
    }
    write_keys(text, spec);
    if !spec.mistaken_for.is_empty() {
        text.push_str("\n| mistaken for | when | what tells them apart |\n|---|---|---|\n");
    }
    for other in spec.mistaken_for {
        let _ = writeln!(text, "| `{}` | {} | {} |", other.with, other.when, other.experiment);
    }
    text.push('\n');
}

/// The table of keys; on the ground with what is believed of each where a file lacks the effect.
// Writing into a String cannot fail.
fn write_keys(text: &mut String, spec: &Spec) {
    let believed = spec.acts.on_the_ground();
    let (title, rule) = if believed { (" before anything is measured |", "---|") } else { ("", "") };
    let _ = write!(text, "\n| key | allowed |{title} meaning |\n|---|---|{rule}---|\n");
    for Parameter { key, meaning, low, high, belief, .. } in spec.parameters {
        let belief = match belief.filter(|_| believed) {
            Some([value, low, high]) if low == high => format!(" {value}, held |"),
            Some([value, low, high]) => format!(" {value} ({low} … {high}) |"),
            None => String::new(),
        };
        let _ = writeln!(text, "| `{key}` | {low} … {high} |{belief} {} |", cell(meaning));
    }
}

/// A bar would end the cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
