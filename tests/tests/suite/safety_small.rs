//! The figures on safety, small: every row must hold. The whole campaign is `cargo safety-figures`.

use system_tests::figures::run::DesignedRobot;
use system_tests::safety::broken::KINDS;
use system_tests::safety::run::weakest;
use system_tests::safety::{Options, rows};

#[test]
fn whatever_is_ordered_while_something_is_broken_ends_in_time() {
    let options = Options { runs: 20 * KINDS.len() as u64, seed: 500_000, only: None };
    let rows = rows(&DesignedRobot::new(), &options);
    assert!(rows.len() > KINDS.len(), "a row a kind, and those on heat");
    for row in &rows {
        assert_eq!(row.holds, Some(true), "{}: required {}, measured {}", row.what, row.required, row.measured);
    }
    for row in &rows[..KINDS.len()] {
        assert_eq!(row.numbers["runs"], 20, "{}", row.what);
    }
}

#[test]
fn the_weakest_failsafes_are_weaker_than_the_factorys_and_stand_in_the_campaign() {
    let factory = DesignedRobot::new().parameters;
    let weak = weakest(&factory);
    assert!(weak.weaker_than(&factory).is_some() && factory.weaker_than(&weak).is_none());
    assert!(weak.supervisor.stall.persistence > factory.supervisor.stall.persistence);
    assert!(weak.supervisor.command_old.limit > factory.supervisor.command_old.limit);
}
