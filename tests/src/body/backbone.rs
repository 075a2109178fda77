//! `scram identify backbone` on oscillations that MuJoCo made: other backbones than the file's, pulled aside at their ends and let
//! go, seen as a motion capture system would see them. The seeds decide everything and were not looked at.

use hal_sim::body::Plan;
use identify::backbone::{BackboneFit, Gravity, Options, Oscillation, identify};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use robot_file::Robot;
use serde::Deserialize;
use serde_json::json;

use super::PeerSetup;
use super::peer::{Peer, PeerError, not_compared};
use super::reference::pair;
use crate::row::FigureRow;

/// Where the seeds begin.
const FIRST_SEED: u64 = 71_000;
/// Sets of the quick campaign, and of the whole.
const FEW: u64 = 2;
const ALL: u64 = 100;
/// What a number may be off by: stiffness, damping.
const BARS: [f64; 2] = [0.02, 0.05];
/// How many of the 90 % intervals must hold the truth.
const COVERAGE: std::ops::RangeInclusive<f64> = 0.85..=0.95;
/// How long a run is, s.
const LENGTH_S: f64 = 1.2;

/// What the script prints.
#[derive(Deserialize)]
struct Printed {
    sample_s: f64,
    runs: Vec<Vec<[f64; 3]>>,
}

/// One backbone and its recordings.
struct Set {
    truth: [f64; 6],
    fit: Vec<Oscillation>,
    held_out: Vec<Oscillation>,
    kind: &'static str,
}

/// A set's truth and what was found.
struct Found {
    seed: u64,
    kind: &'static str,
    truth: [f64; 6],
    fit: BackboneFit,
}

/// A few sets.
#[must_use]
pub fn quick_rows(bench: &PeerSetup) -> Vec<FigureRow> {
    rows_of(bench, FEW)
}

/// A hundred sets, with how many intervals hold the truth.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    rows_of(bench, ALL)
}

fn rows_of(bench: &PeerSetup, sets: u64) -> Vec<FigureRow> {
    let what = format!(
        "{sets} backbones identified from oscillations that MuJoCo made: largest error of stiffness, of damping"
    );
    let required = "2 %, 5 %";
    let found: Result<Vec<Found>, PeerError> = match &bench.peer {
        Ok(peer) => (FIRST_SEED..FIRST_SEED + sets).into_par_iter().map(|seed| one(peer, &bench.robot, seed)).collect(),
        Err(why) => return vec![not_compared(&what, required, why)],
    };
    match found {
        Ok(found) => vec![errors(&what, required, &found), coverage(&found), held_out(&found)],
        Err(why) => vec![not_compared(&what, required, &why)],
    }
}

fn one(peer: &Peer, robot: &Robot, seed: u64) -> Result<Found, PeerError> {
    let set = made(peer, robot, seed)?;
    let options = Options { module: None, gravity: Gravity::Level, ..Options::default() };
    let fit = identify(robot, &set.fit, &set.held_out, options).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
    Ok(Found { seed, kind: set.kind, truth: set.truth, fit })
}

/// Draws a backbone and how it is pulled and seen, and has MuJoCo move it.
fn made(peer: &Peer, robot: &Robot, seed: u64) -> Result<Set, PeerError> {
    let mut random = Pcg64::seed_from_u64(seed);
    let passive = pair(robot, 0.0);
    let mut plan = Plan { clamped: Some(0), eccentric: None, contact: None, ..passive };
    plan.modules[0] = plan.modules[1];
    let backbone = &mut plan.backbones[0];
    for axis in 0..3 {
        backbone.stiffness[axis] *= log_uniform(&mut random, 0.4, 2.2);
        backbone.damping[axis] *= log_uniform(&mut random, 0.25, 1.2);
    }
    let ([kx, ky, kz], [dx, dy, dz]) = (backbone.stiffness, backbone.damping);
    let per_rad = backbone.stiffness.map(|k| k / backbone.segments as f64);
    let together = random.random_bool(0.5);
    let runs = if together { 3 } else { 6 };
    let mut words = vec![format!("--seconds={LENGTH_S}")];
    for run in 0..runs {
        let mut wrench = [0.0; 6];
        for (axis, per_rad) in per_rad.iter().enumerate() {
            if together || run % 3 == axis {
                let angle = random.random_range(0.12..0.3) * if random.random_bool(0.5) { 1.0 } else { -1.0 };
                wrench[3 + axis] = per_rad * angle * random.random_range(0.3..0.9);
                // The rest by a force across: at y it turns about z, at z about −y.
                let arm = 0.5 * plan.backbones[0].length + 0.5 * plan.modules[1].size[0];
                match axis {
                    1 => wrench[2] = per_rad * angle * 0.3 / arm,
                    2 => wrench[1] = -per_rad * angle * 0.3 / arm,
                    _ => {}
                }
            }
        }
        words.push(format!("--wrench={}", wrench.map(|x| x.to_string()).join(",")));
    }
    let model = peer.export(&format!("backbone {seed}"), &plan, &mjcf::Options::default());
    let printed: Printed = peer.run("release.py", &words, &[model])?;
    let noise = random.random_range(0.5e-3..3e-3);
    let rate = random.random_range(100.0..240.0);
    let mut seen: Vec<Oscillation> = printed
        .runs
        .iter()
        .enumerate()
        .map(|(run, angles)| as_seen(&mut random, angles, printed.sample_s, noise, rate, run))
        .collect();
    let held_out = seen.split_off(if together { 2 } else { 3 });
    let kind = if together { "all axes at once" } else { "one axis after the other" };
    Ok(Set { truth: [kx, ky, kz, dx, dy, dz], fit: seen, held_out, kind })
}

/// With the hold before, the frame rate, noise, the cameras' zero and lost frames.
fn as_seen(random: &mut Pcg64, angles: &[[f64; 3]], sample_s: f64, noise: f64, rate: f64, run: usize) -> Oscillation {
    let normal = Normal::new(0.0, noise).unwrap_or_else(|error| panic!("{error}"));
    let held_s = random.random_range(0.0..0.4);
    let lost = random.random_range(0.0..0.1);
    let zero: [f64; 3] = std::array::from_fn(|_| random.random_range(-0.02..0.02));
    let mut out = Oscillation { name: format!("run {}", run + 1), t_s: Vec::new(), angles: Vec::new() };
    let end_s = held_s + sample_s * (angles.len() - 2) as f64;
    for frame in 0..(end_s * rate) as usize {
        let t = frame as f64 / rate;
        let place = ((t - held_s) / sample_s).max(0.0);
        let (k, part) = (place as usize, place.fract());
        let at: [f64; 3] = std::array::from_fn(|axis| {
            (1.0 - part) * angles[k][axis] + part * angles[k + 1][axis] + zero[axis] + normal.sample(random)
        });
        if !random.random_bool(lost) {
            out.t_s.push(t);
            out.angles.push(at);
        }
    }
    out
}

fn log_uniform(random: &mut Pcg64, low: f64, high: f64) -> f64 {
    random.random_range(low.ln()..high.ln()).exp()
}

fn errors(what: &str, required: &str, found: &[Found]) -> FigureRow {
    let off = |one: &Found, k: usize| (one.fit.hinges[k].value / one.truth[k] - 1.0).abs();
    let worst = |numbers: std::ops::Range<usize>| {
        let all = found.iter().flat_map(|one| numbers.clone().map(move |k| (off(one, k), one.seed, k, one.kind)));
        all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, 0, 0, ""))
    };
    let mut all: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    for one in found {
        (0..6).for_each(|k| all[k / 3].push(off(one, k)));
    }
    let medians = all.map(|mut list| common::median(&mut list).unwrap_or(f64::NAN));
    let ends = [worst(0..3), worst(3..6)];
    let told = ends.map(|(off, seed, k, kind)| {
        format!("{:.2} % ({}, seed {seed}, {kind})", 100.0 * off, identify::backbone::FIELDS[k])
    });
    FigureRow::new(
        what,
        required,
        format!("{}, {}; median {:.2} %, {:.2} %", told[0], told[1], 100.0 * medians[0], 100.0 * medians[1]),
        ends[0].0 <= BARS[0] && ends[1].0 <= BARS[1],
        json!({ "largest": [ends[0].0, ends[1].0], "median": medians }),
    )
}

fn coverage(found: &[Found]) -> FigureRow {
    let holds = |one: &Found, k: usize| {
        one.fit.hinges[k].interval.is_some_and(|interval| (interval.low..=interval.high).contains(&one.truth[k]))
    };
    let shares: Vec<f64> =
        (0..6).map(|k| found.iter().filter(|one| holds(one, k)).count() as f64 / found.len() as f64).collect();
    let words: Vec<String> = shares.iter().map(|share| format!("{:.0}", 100.0 * share)).collect();
    let measured = format!("{} % (torsion, stiff, soft: stiffness, then damping)", words.join("/"));
    let what = "their 90 % intervals hold the truth";
    let numbers = json!(shares);
    // Of a few sets a share says little.
    if found.len() < 50 {
        return FigureRow::beside(what, measured, numbers);
    }
    FigureRow::new(what, "85–95 % each", measured, shares.iter().all(|share| COVERAGE.contains(share)), numbers)
}

fn held_out(found: &[Found]) -> FigureRow {
    let ratio = |of: fn(&identify::backbone::HeldOut) -> f64| {
        let mut all: Vec<f64> =
            found.iter().flat_map(|one| one.fit.held_out.iter().map(move |run| of(run) / one.fit.floor_rad)).collect();
        (common::median(&mut all).unwrap_or(f64::NAN), all.iter().copied().fold(0.0, f64::max))
    };
    let (before, after) = (ratio(|run| run.before_rad), ratio(|run| run.after_rad));
    FigureRow::beside(
        "held-out oscillations, (3.1) over what the noise makes of it: with the file's numbers, with those found",
        format!("median {:.1}, then {:.3}, worst {:.3}", before.0, after.0, after.1),
        json!({ "before": before.0, "after": after.0, "worst_after": after.1 }),
    )
}
