//! docs/safety.md's table of faults says what the supervisor and robot.toml do.

use std::path::Path;

use control::supervisor::{FAULTS, TRIGGERS};
use system_tests::figures::run::DesignedRobot;

/// The rows of the table whose first cell is a fault's name in backquotes.
fn row<'t>(text: &'t str, name: &str) -> Vec<&'t str> {
    let begin = format!("| `{name}` |");
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with(&begin)).collect();
    assert_eq!(lines.len(), 1, "docs/safety.md has {} rows for {name}", lines.len());
    lines[0].split('|').map(str::trim).collect()
}

fn seconds(cell: &str) -> f32 {
    let number = cell.strip_suffix(" s").unwrap_or_else(|| panic!("`{cell}` is no time in seconds"));
    number.parse().unwrap_or_else(|error| panic!("`{cell}`: {error}"))
}

#[test]
fn every_fault_is_in_the_table_with_its_persistence_and_bound() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/safety.md");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let parameters = DesignedRobot::new().parameters;
    for fault in FAULTS {
        let row = row(&text, &format!("{fault:?}"));
        let Some(trigger) = TRIGGERS.iter().find(|trigger| trigger.fault == fault) else {
            assert_eq!(row[4], "at once", "{fault:?} has no trigger");
            continue;
        };
        let watch = (trigger.limit)(&parameters.supervisor);
        assert_eq!((seconds(row[3]), seconds(row[4])), (watch.persistence, watch.bound), "{fault:?}");
    }
}
