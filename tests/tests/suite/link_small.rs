//! The figures on the link, small: every row that requires something must hold. The whole campaign is `cargo link-figures`.

use system_tests::figures::run::DesignedRobot;
use system_tests::link::fault::CASES;
use system_tests::link::{CAMPAIGNS, Campaign, Options};
use system_tests::row::FigureRow;

fn campaign(name: &str, runs: u64, fault: Option<&str>) -> Vec<FigureRow> {
    let found: Option<&Campaign> = CAMPAIGNS.iter().find(|campaign| campaign.0 == name);
    let options = Options { runs, seed: None, fault: fault.map(str::to_owned) };
    found.expect("a campaign of that name").1(&DesignedRobot::new(), &options)
}

fn assert_holds(rows: &[FigureRow]) {
    assert!(!rows.is_empty());
    for row in rows {
        assert!(row.holds != Some(false), "{}: required {}, measured {}", row.what, row.required, row.measured);
    }
}

#[test]
fn every_fault_in_every_mode_ends_safely() {
    let rows = campaign("faults", 1, None);
    assert_eq!(rows.len(), CASES.len() + 1, "a row a fault, and one without any");
    assert_holds(&rows);
    for row in &rows {
        assert_eq!(row.numbers["runs"], 8, "{}: one of each mode", row.what);
    }
}

#[test]
fn no_frame_of_somebody_else_is_obeyed() {
    assert_holds(&campaign("attacks", 500, None));
}

#[test]
fn every_order_is_answered_within_a_second() {
    assert_holds(&campaign("orders", 1000, None));
}

#[test]
fn stop_is_quick() {
    for row in campaign("stop", 400, None).iter().filter(|row| row.holds.is_some()) {
        let median_s = row.numbers["median_s"].as_f64().expect("a number");
        let worst_s = row.numbers["worst_s"].as_f64().expect("a number");
        // The worst of a few stops says little: that it comes.
        assert!(median_s < 0.015 && worst_s < 0.2, "{}: {}", row.what, row.measured);
    }
}

#[test]
fn a_hundredth_of_a_day_leaves_memory_flat() {
    let rows = campaign("day", 1, None);
    let numbers = &rows[0].numbers;
    assert_eq!(numbers["rows"], numbers["told"]);
    assert_eq!(numbers["missing"], numbers["lost"]);
    assert!(numbers["lost"].as_u64().is_some_and(|lost| lost > 100));
}
