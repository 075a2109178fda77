//! The figures on the body that are quick and need no clock: every row that requires something must hold. All of them are
//! `cargo body-figures`. What needs MuJoCo is skipped, and says so, where `.ci/tools` has not brought it; with
//! SCRAM_ALL_PEERS=1 that is a failure.

use system_tests::body::{CAMPAIGNS, Campaign, PeerSetup};
use testbed::peers::skip;

#[track_caller]
fn assert_holds(name: &str) {
    let found: Option<&Campaign> = CAMPAIGNS.iter().find(|campaign| campaign.0 == name);
    let out = tempfile::tempdir().expect("a directory");
    let rows = found.expect("a campaign of that name").1(&PeerSetup::new(out.path().to_owned()));
    assert!(!rows.is_empty());
    for row in rows {
        assert!(row.holds != Some(false), "{}: required {}, measured {}", row.what, row.required, row.measured);
        match row.measured.strip_prefix("skipped: ") {
            Some(why) => skip(&format!("{}: {why}", row.what)),
            None if row.holds.is_none() => eprintln!("{}: {}", row.what, row.measured),
            None => {}
        }
    }
}

#[test]
fn a_backbone_oscillates_as_in_mujoco() {
    assert_holds("oscillation");
}

#[test]
fn a_foot_goes_where_it_goes_in_mujoco() {
    assert_holds("paths");
}

#[test]
fn the_other_way_round_it_walks_its_mirror_image() {
    assert_holds("mirror");
}

#[test]
fn clones_and_threads_change_no_bit() {
    assert_holds("bits");
}

#[test]
fn the_motor_reaches_on_the_ground_what_the_thesis_says() {
    assert_holds("highest");
}
