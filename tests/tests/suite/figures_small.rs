//! The figures on control with a few seeds each: every row that requires something must hold. The whole campaign is
//! `cargo run -p system-tests --bin figures`.

use system_tests::figures::run::DesignedRobot;
use system_tests::figures::{CAMPAIGNS, Campaign, FigureRow};

/// Seeds of a small campaign.
const SEEDS: u64 = 6;

fn campaign(name: &str) -> Vec<FigureRow> {
    let found: Option<&Campaign> = CAMPAIGNS.iter().find(|campaign| campaign.0 == name);
    found.expect("a campaign of that name").1(&DesignedRobot::new(), SEEDS)
}

fn assert_holds(name: &str) {
    for row in campaign(name) {
        assert!(row.holds != Some(false), "{}: required {}, measured {}", row.what, row.required, row.measured);
    }
}

#[test]
fn holds_its_frequencies() {
    assert_holds("speed");
}

#[test]
fn calibration_pays() {
    assert_holds("calibrated");
}

#[test]
fn reaches_the_supplys_ceiling() {
    assert_holds("ceiling");
}

#[test]
fn oscillates_between_its_bounds() {
    assert_holds("oscillation");
}

#[test]
fn bears_motors_that_differ() {
    assert_holds("mismatch");
}

#[test]
fn every_fault_ends_with_the_bridge_off() {
    assert_holds("faults");
}

#[test]
fn goes_on_with_the_other_sensor() {
    assert_holds("two-sensors");
}

#[test]
fn the_thesis_way_is_worse_where_it_is_said_to_be() {
    let rows = campaign("comparison");
    let number = |row: &FigureRow, name: &str| row.numbers[name].as_f64().unwrap_or(f64::INFINITY);
    let ours = &campaign("oscillation")[0];
    for row in &rows[..2] {
        assert!(number(row, "worst_deg") > 2.0 * number(ours, "worst_deg"), "{}: {}", row.what, row.measured);
    }
    assert!(number(&rows[2], "estimate_deg") > 3.0 * number(&rows[2], "estimate_ours_deg"), "{}", rows[2].measured);
}
