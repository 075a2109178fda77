//! The predicates on made-up robots.

use hal_sim::body::Plan;

use super::*;
use crate::measure::Measures;
use crate::table::Condition;

/// The thesis's robot's, 140 mm long.
fn plan() -> Plan {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
    Plan::new(&robot_file::Robot::load(&file).unwrap()).unwrap()
}

/// A robot for which every claim holds.
fn speeds(modules: f64, alpha: f64, f: f64, factor: f64) -> Measures {
    let size = f.abs();
    // Nothing below 4.5 Hz.
    let walks = (size - 4.5).max(0.0) / 3.5;
    // Rolled backbones turn it.
    let bend = alpha / 120.0;
    let long = (modules - 4.0) / 2.0;
    let at = |a: f64| if alpha == a { 1.0 } else { 0.0 };
    let best = if alpha == 90.0 && size == 7.0 { 2.5 } else { 1.0 };
    // Backwards at 0° and −6 Hz.
    let back = if alpha == 0.0 && f == -6.0 { -1.0 } else { 1.0 };
    let vx = back * 10.0 * walks * best * (1.0 - 0.4 * long);
    let vy = -f.signum() * 2.0 * walks * walks * (1.0 + at(90.0) + at(120.0)) * best * (1.0 - 0.4 * long);
    let yaw = f.signum() * 12.0 * walks * bend;
    // At 90° and +8 Hz friction matters most.
    let most = if alpha == 90.0 && f == 8.0 { 0.5 } else { 0.05 };
    let change = 1.0 - most * (factor - 1.0) / 0.1;
    let fast = if alpha == 90.0 && f == 8.0 { 2.0 } else { 1.0 };
    // Sideways and turning it matters most at 0° and 6 Hz.
    let aside = if alpha == 0.0 && size == 6.0 { 0.5 } else { 0.05 };
    let turned = if alpha == 60.0 && size == 6.0 { 0.5 } else { 0.05 };
    Measures {
        vx: Some(vx * fast * change),
        vy: Some(vy * (1.0 - aside * (factor - 1.0) / 0.1)),
        yaw: Some(yaw * (1.0 - turned * (factor - 1.0) / 0.1)),
        front: Some(20.0),
        rear: Some(15.0 - 8.0 * long),
        roundness: Some(0.8 - 0.5 * bend),
        ..Measures::default()
    }
}

fn conditions(change: impl Fn(&[f64], &mut Measures)) -> Conditions {
    let design = design(vec![0]);
    let axes = design.axes.iter().map(|axis| axis.what.clone()).collect();
    let condition = |point: &Vec<f64>| {
        let mut measures = speeds(point[0], point[1], point[2], point[3]);
        if point[4] != 0.0 {
            // A quarter turn in three seconds, and half of half of its length.
            measures = Measures { vx: Some(35.0 / 3.0), vy: Some(0.0), yaw: Some(-0.3 * point[4]), ..measures };
        }
        change(point, &mut measures);
        Condition { point: point.clone(), repeats: vec![measures] }
    };
    Conditions { axes, conditions: design.points.iter().map(condition).collect() }
}

/// Names of the claims that do not hold.
fn broken(change: impl Fn(&[f64], &mut Measures)) -> Vec<&'static str> {
    evaluate(&conditions(change), &plan()).iter().filter(|v| v.holds != Some(true)).map(|v| v.claim).collect()
}

fn scale(value: &mut Option<f64>, factor: f64) {
    *value = value.map(|value| value * factor);
}

#[test]
fn every_claim_can_hold() {
    let verdicts = evaluate(&conditions(|_, _| {}), &plan());
    for verdict in &verdicts {
        assert_eq!(verdict.holds, Some(true), "{verdict:?}");
    }
    assert_eq!(verdicts.len(), 12);
}

#[test]
fn each_claim_falls_by_what_it_is_about() {
    // Walks at 3 Hz already.
    let slow = |point: &[f64], m: &mut Measures| {
        if point[2] <= 5.0 && point[2] > 0.0 && point[4] == 0.0 {
            m.vx = Some(8.0);
        }
    };
    assert_eq!(broken(slow), ["onset"]);
    let ahead = |_: &[f64], m: &mut Measures| m.vx = m.vx.map(f64::abs);
    assert_eq!(broken(ahead), ["both signs"]);
    // What a swing does: goes too far, or turns to one side only.
    let swinging = |change: fn(f64, &mut Measures)| {
        move |point: &[f64], m: &mut Measures| {
            if point[4] != 0.0 {
                change(point[4], m)
            }
        }
    };
    assert_eq!(broken(swinging(|_, m| scale(&mut m.vx, 2.5))), ["in place"]);
    assert_eq!(broken(swinging(|_, m| m.yaw = Some(30.0))), ["in place"]);
    let other_way_round = swinging(|swing, m| m.yaw = Some(30.0 * swing.signum()));
    assert!(broken(other_way_round).is_empty(), "the thesis does not say which way its angle counts");
    // Turns right at 60° and +7 Hz.
    let wrong = |point: &[f64], m: &mut Measures| {
        if point[1] == 60.0 && point[2] == 7.0 {
            scale(&mut m.yaw, -1.0);
        }
    };
    assert_eq!(broken(wrong), ["turns"]);
    // Turns more at 60° than at 90 and 120°, at 8 Hz.
    let early = |point: &[f64], m: &mut Measures| {
        if point[1] == 60.0 && point[2].abs() == 8.0 {
            scale(&mut m.yaw, 1.8);
        }
    };
    assert_eq!(broken(early), ["bias"]);
    let flat = |point: &[f64], m: &mut Measures| {
        if point[1] == 0.0 {
            m.roundness = Some(0.3);
        }
    };
    assert_eq!(broken(flat), ["round"]);
    // At 8 Hz nothing sideways.
    let straight = |point: &[f64], m: &mut Measures| {
        if point[2].abs() == 8.0 {
            scale(&mut m.vy, 0.3);
        }
    };
    assert_eq!(broken(straight), ["lateral |f|"]);
    let zero_best = |point: &[f64], m: &mut Measures| {
        if point[1] == 0.0 {
            scale(&mut m.vy, 2.5);
        }
    };
    assert_eq!(broken(zero_best), ["lateral α"]);
    // Friction takes the rotation at 120°.
    let slippery = |point: &[f64], m: &mut Measures| {
        if point[1] == 120.0 && point[3] > 1.0 {
            scale(&mut m.yaw, 0.1);
        }
    };
    assert_eq!(broken(slippery), ["rotation"]);
    let other_best = |point: &[f64], m: &mut Measures| {
        if point[0] == 4.0 && point[1] == 120.0 && point[2].abs() == 6.0 {
            scale(&mut m.vx, 8.0);
        }
    };
    assert!(broken(other_best).contains(&"all-round"));
    let robust = |point: &[f64], m: &mut Measures| {
        if point[1] == 90.0 && point[2] == 8.0 && point[3] > 1.0 {
            m.vx = speeds(point[0], 90.0, 8.0, 1.0).vx;
        }
        if point[1] == 0.0 && point[2] == 6.0 && point[3] > 1.0 {
            scale(&mut m.vx, 0.5);
        }
    };
    assert!(broken(robust).contains(&"7 to 8 Hz"));
    let straighter = |point: &[f64], m: &mut Measures| {
        if point[0] == 6.0 {
            scale(&mut m.yaw, 0.1);
        }
    };
    assert_eq!(broken(straighter), ["modules"]);
}

#[test]
fn a_slow_turn_the_wrong_way_is_one() {
    let nearly = |share: f64| {
        move |point: &[f64], m: &mut Measures| {
            if point[1] == 60.0 && point[2] == -6.0 {
                m.yaw = Some(share * 12.0);
            }
        }
    };
    assert!(broken(nearly(0.01)).contains(&"turns") && broken(nearly(0.0)).contains(&"turns"));
    assert!(!broken(nearly(-0.01)).contains(&"turns"));
    let margin = |share: f64| evaluate(&conditions(nearly(share)), &plan())[2].margin.unwrap();
    assert!((margin(0.02) + 0.02).abs() < 0.005, "a share of the largest rate: {}", margin(0.02));
}

#[test]
fn a_tie_does_not_count_for_a_claim() {
    // A symmetric robot: 60° does at f what 120° does at −f.
    let mirrored = |point: &[f64], m: &mut Measures| {
        if point[1] == 120.0 {
            m.yaw = speeds(point[0], 90.0, point[2], point[3]).yaw;
        }
        if point[1] == 60.0 {
            m.yaw = speeds(point[0], 90.0, point[2], point[3]).yaw;
        }
    };
    assert!(broken(mirrored).contains(&"rotation") && broken(mirrored).contains(&"bias"));
}

#[test]
fn a_missing_run_is_no_verdict() {
    let missing = |point: &[f64], m: &mut Measures| {
        if point[1] == 90.0 && point[2] == 7.0 && point[3] == 1.0 && point[0] == 4.0 {
            *m = Measures::default();
        }
    };
    let verdicts = evaluate(&conditions(missing), &plan());
    let unjudged: Vec<&str> = verdicts.iter().filter(|v| v.holds.is_none()).map(|v| v.claim).collect();
    assert_eq!(
        unjudged,
        [
            "onset",
            "both signs",
            "turns",
            "bias",
            "round",
            "lateral |f|",
            "lateral α",
            "rotation",
            "all-round",
            "7 to 8 Hz",
            "modules",
            "in place"
        ]
    );
}

#[test]
fn the_design_has_what_the_claims_need_and_nothing_twice() {
    let design = design(vec![1, 2]);
    assert_eq!(design.points.len(), 4 * (6 * 2 + 3) + 2 * 4 + 2);
    for (index, point) in design.points.iter().enumerate() {
        assert!(!design.points[..index].contains(point), "{point:?}");
    }
}
