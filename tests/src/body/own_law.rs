//! The decisive comparison on the ground: MuJoCo's multibody, without its contacts, under this project's law of the feet,
//! which `tests/mujoco/feet.c` computes for itself. What is left of a difference is neither the law nor MuJoCo's contact.

use std::fmt::Write as _;

use hal_sim::body::Ensemble;
use mjcf::Options;
use rayon::prelude::*;
use serde_json::json;

use super::PeerSetup;
use super::error_measures::{largest, percent, rms_over_largest, worst};
use super::multibody::Multibody;
use super::peer::{Peer, PeerError, not_compared};
use super::reference::{at_step, servo, speeds_of};
use super::uneven::{CONDITIONS, UnevenCondition};
use super::walking::{Printed, STEP_S};
use crate::row::FigureRow;

/// MuJoCo's coarser step, s; the other one is half of it. It converges with the first order: both give its limit.
const COARSE_S: f64 = 5e-5;
/// What the two may differ by, as a share of the largest speed.
const MOST: f64 = 0.01;
/// A condition that is further off is named, as a share of the largest speed.
const OUTLIER: f64 = 0.02;
/// Conditions that are quick: three robots and the one that was an outlier once.
const FEW: usize = 4;
/// Where all speeds are written to.
pub const FILE: &str = "own-law-speeds.csv";
const REQUIRED: &str = "1 %";

/// The row of the few conditions that are quick.
#[must_use]
pub fn quick_rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let what = "4 uneven robots on the ground against MuJoCo's multibody under the same law of the feet, computed by itself: \
                RMS difference over the largest speed, vx/vy/yaw";
    rows_of(bench, what, &CONDITIONS[..FEW])
}

/// The rows of all conditions: against the same law, and beside it against MuJoCo's own contact.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let what = "12 conditions that nothing was fitted to, on six uneven robots, against MuJoCo's multibody under the same law \
                of the feet, computed by itself: RMS difference over the largest speed, vx/vy/yaw";
    let mut rows = rows_of(bench, what, &CONDITIONS);
    if let Ok(peer) = &bench.peer {
        rows.push(plain_row(peer));
    }
    rows
}

fn rows_of(bench: &PeerSetup, what: &str, conditions: &[UnevenCondition]) -> Vec<FigureRow> {
    let compared = bench.peer.as_ref().map(|peer| simulated(peer, conditions));
    let theirs = match compared {
        Ok(Ok(theirs)) => theirs,
        Ok(Err(why)) => return vec![not_compared(what, REQUIRED, &why)],
        Err(why) => return vec![not_compared(what, REQUIRED, why)],
    };
    let ours = own(conditions);
    let path = bench.out.join(FILE);
    let text = table(conditions, &ours, &theirs);
    let written = std::fs::create_dir_all(&bench.out).and_then(|()| std::fs::write(&path, text));
    let told = written.map_or_else(|error| error.to_string(), |()| format!("all in {}", path.display()));
    let (off, top) = (rms_over_largest(&ours, &theirs), largest(&theirs));
    let numbers = json!({ "rms_over_largest": off, "ours": ours, "mujoco": theirs });
    vec![FigureRow::new(
        what,
        REQUIRED,
        format!(
            "{}; its largest {:.1} mm/s, {:.1} mm/s, {:.1} °/s; {}; {told}",
            percent(off),
            1e3 * top[0],
            1e3 * top[1],
            top[2].to_degrees(),
            outliers(conditions, &ours, &theirs)
        ),
        worst(off) <= MOST,
        numbers,
    )]
}

/// Ours at the usual step.
fn own(conditions: &[UnevenCondition]) -> Vec<[f64; 3]> {
    let one = |condition: &UnevenCondition| {
        let made = Ensemble::new(&[condition.plan()], at_step(STEP_S));
        speeds_of(made.unwrap_or_else(|error| panic!("{error}")), &[servo(condition.frequency_hz)])[0]
    };
    conditions.par_iter().map(one).collect()
}

/// MuJoCo's multibody in the limit of small steps. Two runs at a time: there are two processors.
fn simulated(peer: &Peer, conditions: &[UnevenCondition]) -> Result<Vec<[f64; 3]>, PeerError> {
    let multibody = Multibody::build(peer)?;
    let one = |condition: &UnevenCondition| {
        let plan = condition.plan();
        let model = peer.export(&condition.text(), &plan, &Options::default());
        multibody.speeds((&plan, &model), condition.frequency_hz, COARSE_S)
    };
    conditions.par_iter().map(one).collect()
}

/// Beside it: MuJoCo's own contact on the same robots.
fn plain_row(peer: &Peer) -> FigureRow {
    let what = "beside it: the same against plain MuJoCo with its own contact, for information";
    let one = |condition: &UnevenCondition| {
        let model = peer.export(&format!("plain {}", condition.text()), &condition.plan(), &Options::default());
        let words =
            [Peer::frequencies(&[condition.frequency_hz]), format!("--step={STEP_S}"), "--threads=1".to_owned()];
        peer.run("speeds.py", &words, &[model]).map(|printed: Printed| printed.speeds[0])
    };
    match CONDITIONS.par_iter().map(one).collect::<Result<Vec<_>, _>>() {
        Err(why) => FigureRow::beside(what, why.to_string(), json!(null)),
        Ok(theirs) => {
            let off = rms_over_largest(&own(&CONDITIONS), &theirs);
            FigureRow::beside(what, percent(off), json!({ "rms_over_largest": off, "mujoco": theirs }))
        }
    }
}

/// Conditions in which a speed is further off than an outlier may be, or the one that is furthest off.
fn outliers(conditions: &[UnevenCondition], ours: &[[f64; 3]], theirs: &[[f64; 3]]) -> String {
    let top = largest(theirs);
    let shares = |(a, b): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|part| (a[part] - b[part]).abs() / top[part]);
    let off: Vec<[f64; 3]> = ours.iter().zip(theirs).map(shares).collect();
    let furthest = off.iter().map(|shares| worst(*shares)).fold(0.0, f64::max);
    let named: Vec<String> = off
        .iter()
        .zip(conditions)
        .filter(|(shares, _)| worst(**shares) > OUTLIER || worst(**shares) == furthest)
        .map(|(shares, condition)| format!("{} at {}", percent(*shares), condition.text()))
        .collect();
    format!("furthest off: {}", named.join("; "))
}

/// All speeds side by side.
fn table(conditions: &[UnevenCondition], ours: &[[f64; 3]], theirs: &[[f64; 3]]) -> String {
    let mut text = String::from(
        "robot,alpha_deg,f_counter_clockwise_hz,friction,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s,\
         mujoco_vx_mm_per_s,mujoco_vy_mm_per_s,mujoco_yaw_deg_per_s\n",
    );
    for (at, (a, b)) in conditions.iter().zip(ours.iter().zip(theirs)) {
        let _ = write!(text, "{},{},{},{}", at.robot, at.alpha_deg, at.frequency_hz, at.friction);
        for [x, y, yaw] in [a, b] {
            let _ = write!(text, ",{:.4},{:.4},{:.4}", 1e3 * x, 1e3 * y, yaw.to_degrees());
        }
        text.push('\n');
    }
    text
}
