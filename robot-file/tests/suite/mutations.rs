//! Whatever stands in a file: a robot or an error, never a panic.

use proptest::prelude::*;
use robot_file::Robot;

fn default_text() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../robot.toml")).unwrap()
}

/// Reads and renders what there is to render.
fn try_it(text: &str) {
    if let Err(error) = Robot::parse(text, "robot.toml") {
        assert!(!error.problems().is_empty());
        let mut shown = String::new();
        miette::GraphicalReportHandler::new().render_report(&mut shown, &error).unwrap();
        assert!(shown.contains("robot.toml"));
    }
}

/// A place in the text, moved down to a character's boundary.
fn place(text: &str, share: f64) -> usize {
    let mut at = (share * text.len() as f64) as usize;
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_truncated_file(share in 0.0..1.0f64) {
        let text = default_text();
        try_it(&text[..place(&text, share)]);
    }

    #[test]
    fn a_file_with_a_hole(from in 0.0..1.0f64, length in 0.0..0.05f64) {
        let text = default_text();
        let (from, to) = (place(&text, from), place(&text, (from + length).min(1.0)));
        try_it(&format!("{}{}", &text[..from], &text[to..]));
    }

    #[test]
    fn a_file_with_something_put_in(
        at in 0.0..1.0f64,
        what in prop_oneof![
            "[\\[\\]{}=\"'.,# \\n\\\\a-z0-9°é-]{1,8}",
            Just("nan".to_owned()),
            Just("1e999".to_owned()),
            Just("99999999999999999999".to_owned()),
            Just("[".repeat(200)),
            Just("{ value = { value = 1 } }".to_owned()),
            Just("1979-05-27".to_owned()),
        ],
        over in 0.0..0.01f64,
    ) {
        let text = default_text();
        let (from, to) = (place(&text, at), place(&text, (at + over).min(1.0)));
        try_it(&format!("{}{what}{}", &text[..from], &text[to..]));
    }

    #[test]
    fn any_text(text in "\\PC{0,200}") {
        try_it(&text);
    }

    #[test]
    fn any_value_at_a_key(
        key in prop_oneof!["[a-z_]{1,12}", Just("motor".to_owned()), Just("sensor".to_owned()), Just("base".to_owned())],
        value in prop_oneof![Just("1"), Just("\"x\""), Just("true"), Just("[1, \"x\", {}]"), Just("{}"), Just("[[]]"), Just("{ value = [] }")],
    ) {
        try_it(&format!("{key} = {value}\n"));
        try_it(&format!("[{key}]\nkind = {value}\nvalue = {value}\n"));
    }
}
