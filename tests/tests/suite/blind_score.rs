//! How verdicts are scored: a wrong name must never count, in any disguise.

use std::collections::BTreeMap;

use diagnose::{Cause, Detail, Diagnosis, Gain, Verdict};
use system_tests::blind::case::Category::{Hidden, Nothing, Outside, Two};
use system_tests::blind::score::{Mark, mark, mark_lowest, median_and_worst};

fn said(verdict: Verdict, causes: &[&[&str]]) -> Diagnosis {
    let cause = |names: &&[&str]| Cause {
        effect: names[0].to_owned(),
        also: names[1..].iter().map(|name| (*name).to_owned()).collect(),
        parameters: BTreeMap::new(),
    };
    Diagnosis {
        verdict,
        models: Vec::new(),
        limits: Vec::new(),
        causes: causes.iter().map(cause).collect(),
        noise_floor: 1e-3,
        before: 2e-3,
        after: 1e-3,
        after_cross_judged: 1e-3,
        gain: Gain::default(),
        left_over: None,
        missing_terms: Vec::new(),
        scale_free: std::collections::BTreeMap::new(),
        rig_doubts: Vec::new(),
        next_experiment: None,
        detail: Detail::default(),
    }
}

#[test]
fn a_hidden_effect_counts_under_its_name_or_in_a_small_stated_class() {
    let truth = "driver_drop";
    let of = |verdict, causes: &[&[&str]]| mark(Hidden, &[truth], &said(verdict, causes));
    assert_eq!(of(Verdict::Explained, &[&["driver_drop"]]), Mark::Right);
    assert_eq!(of(Verdict::Ambiguous, &[&["driver_drop", "battery_sag"]]), Mark::InClass);
    assert_eq!(of(Verdict::Ambiguous, &[&["battery_sag", "driver_drop"]]), Mark::InClass);
    assert_eq!(of(Verdict::Explained, &[&["battery_sag"]]), Mark::FalseName);
    assert_eq!(of(Verdict::Explained, &[&["driver_drop"], &["battery_sag"]]), Mark::FalseName);
    let vague: &[&str] = &["driver_drop", "battery_sag", "coulomb_friction", "load_friction"];
    assert_eq!(of(Verdict::Ambiguous, &[vague]), Mark::FalseName, "a class of half the library says nothing");
    assert_eq!(of(Verdict::Unexplained, &[&["driver_drop"]]), Mark::Missed);
    assert_eq!(of(Verdict::Nothing, &[]), Mark::Missed);
}

#[test]
fn the_least_error_alone_is_judged_by_the_same_rule() {
    let of = |lowest: &[&str]| mark_lowest(Hidden, &["driver_drop"], lowest);
    assert_eq!(of(&["driver_drop"]), Mark::Right);
    assert_eq!(of(&["battery_sag", "driver_drop"]), Mark::FalseName);
    assert_eq!(of(&[]), Mark::Missed);
    let both: &[&str] = &["battery_sag", "driver_drop"];
    assert_eq!(mark_lowest(Two, both, &["driver_drop"]), Mark::OneOfTwo);
    assert_eq!(mark_lowest(Two, both, both), Mark::Right);
    assert_eq!(mark_lowest(Outside, &["gear_mesh"], &["driver_drop"]), Mark::FalseName);
    assert_eq!(mark_lowest(Nothing, &[], &[]), Mark::Right);
}

#[test]
fn where_nothing_is_hidden_every_other_word_is_a_false_alarm() {
    assert_eq!(mark(Nothing, &[], &said(Verdict::Nothing, &[])), Mark::Right);
    assert_eq!(mark(Nothing, &[], &said(Verdict::Unexplained, &[])), Mark::Missed);
    assert_eq!(mark(Nothing, &[], &said(Verdict::Explained, &[&["driver_drop"]])), Mark::FalseName);
}

#[test]
fn an_effect_outside_the_library_must_be_left_unexplained() {
    assert_eq!(mark(Outside, &["gear_mesh"], &said(Verdict::Unexplained, &[])), Mark::Right);
    assert_eq!(mark(Outside, &["gear_mesh"], &said(Verdict::Nothing, &[])), Mark::Missed);
    assert_eq!(mark(Outside, &["gear_mesh"], &said(Verdict::Explained, &[&["sensor_delay"]])), Mark::FalseName);
    let pair: &[&[&str]] = &[&["sensor_delay"], &["coulomb_friction"]];
    assert_eq!(mark(Outside, &["gear_mesh"], &said(Verdict::Explained, pair)), Mark::FalseName);
}

#[test]
fn a_wrong_name_for_a_part_of_the_misfit_is_a_wrong_name() {
    let partial = |causes: &[&[&str]]| said(Verdict::Unexplained, causes);
    assert_eq!(mark(Outside, &["gear_mesh"], &partial(&[&["sensor_delay"]])), Mark::FalseName);
    assert_eq!(mark(Nothing, &[], &partial(&[&["sensor_delay"]])), Mark::FalseName);
    let of = |causes: &[&[&str]]| mark(Hidden, &["driver_drop"], &partial(causes));
    assert_eq!(of(&[&["sensor_delay"]]), Mark::FalseName);
    assert_eq!(of(&[&["driver_drop"], &["sensor_delay"]]), Mark::FalseName);
    assert_eq!(of(&[&["battery_sag", "driver_drop"]]), Mark::Missed, "not said, but not wrong");
    assert_eq!(of(&[]), Mark::Missed);
}

#[test]
fn median_and_worst_of_a_few_numbers() {
    assert_eq!(median_and_worst(vec![3.0, 1.0, 2.0]), Some((2.0, 3.0)));
    assert_eq!(median_and_worst(vec![4.0, 1.0, 2.0, 3.0]), Some((2.5, 4.0)));
    assert_eq!(median_and_worst(vec![]), None);
}
