//! docs/figures.md has every section, and its table on control is the campaign's.

use system_tests::figures::CAMPAIGNS;
use system_tests::figures::run::DesignedRobot;
use system_tests::page::{SECTIONS, parsed, path, section};

fn document() -> String {
    std::fs::read_to_string(path()).unwrap_or_else(|error| panic!("{}: {error}", path().display()))
}

#[test]
fn every_section_is_there_once_and_has_something() {
    let document = document();
    for name in SECTIONS {
        let text = section(&document, name).unwrap_or_else(|marker| panic!("docs/figures.md: `{marker}`"));
        assert!(!text.trim().is_empty(), "section {name} is empty");
    }
    let marked = document.lines().filter(|line| line.starts_with("<!-- figures: ")).count();
    assert_eq!(marked, SECTIONS.len(), "a section that no command writes");
}

#[test]
fn the_table_on_control_has_the_campaigns_rows() {
    let document = document();
    let written = parsed(section(&document, "control").expect("checked by the other test"));
    let bench = DesignedRobot::new();
    let measured: Vec<_> = CAMPAIGNS.iter().flat_map(|(_, campaign)| campaign(&bench, 1)).collect();
    let names: Vec<&str> = measured.iter().map(|row| row.what.trim()).collect();
    let written_names: Vec<&str> = written.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(written_names, names, "run `cargo figures --write`");
    for ([what, required, value, holds], row) in written.iter().zip(&measured) {
        assert!(!value.is_empty(), "{what} has no measured value");
        assert_eq!(holds.is_empty(), row.holds.is_none(), "{what}");
        assert_eq!(required.is_empty(), row.required.is_empty(), "{what}");
        assert_ne!(holds, "**no**", "{what} does not hold");
    }
}
