//! Tables of speeds, made by MuJoCo's multibody.

use std::fmt::Write as _;
use std::path::PathBuf;

use hal_sim::body::Plan;
use identify::robot::rolled;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sweep::{ALPHAS, FREQUENCIES};

use super::truth::Truth;
use crate::body::error_measures::largest;
use crate::body::multibody::{Multibody, OtherLaw};
use crate::body::peer::{Peer, PeerError, root};

/// One repeat scatters by this share of the largest speed.
const SCATTER: f64 = 0.03;
pub(super) const REPEATS: usize = 3;
/// MuJoCo's coarser step, s; the other one is half of it.
const COARSE_S: f64 = 1e-4;

/// The file of a robot's speeds.
#[must_use]
pub fn table(number: u64) -> PathBuf {
    root().join("tests/walks").join(format!("{number}.csv"))
}

/// Makes the table of a robot.
///
/// # Errors
/// MuJoCo fails.
///
/// # Panics
/// When the table cannot be written.
pub fn make(peer: &Peer, multibody: &Multibody, truth: &Truth) -> Result<(), PeerError> {
    let mut random = truth.random();
    let (robot, law) = truth.robot(&mut random);
    let robot = robot.robot().unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&robot).unwrap_or_else(|error| panic!("robot {}: {error}", truth.number));
    let speeds = walked((peer, multibody), &format!("walk {}", truth.number), &plan, &law, COARSE_S)?;
    let mut text = String::from("f_hz,alpha_deg,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s\n");
    for ((f_hz, alpha_deg), [vx, vy, yaw]) in repeated(&mut random, &speeds) {
        let _ = writeln!(text, "{f_hz},{alpha_deg},{vx:.4},{vy:.4},{yaw:.4}");
    }
    let path = table(truth.number);
    std::fs::write(&path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Ok(())
}

/// The thesis's conditions: f in Hz, positive clockwise, and α in degrees.
#[must_use]
pub fn conditions() -> Vec<(f64, f64)> {
    ALPHAS.iter().flat_map(|alpha| FREQUENCIES.map(|f| (f, *alpha))).collect()
}

/// Speeds of MuJoCo's multibody under every condition: mm/s, mm/s, °/s. `name` is that of its models.
///
/// # Errors
/// MuJoCo fails.
pub fn walked(
    (peer, multibody): (&Peer, &Multibody),
    name: &str,
    plan: &Plan,
    law: OtherLaw<'_>,
    step_s: f64,
) -> Result<Vec<[f64; 3]>, PeerError> {
    let one = |(place, (f_hz, alpha_deg)): (usize, &(f64, f64))| -> Result<[f64; 3], PeerError> {
        let plan = rolled(plan, *alpha_deg);
        let model = peer.export(&format!("{name} {place}"), &plan, &mjcf::Options::default());
        // The program counts counter-clockwise.
        let [vx, vy, yaw] = multibody.speeds_under(law, (&plan, &model), -f_hz, step_s)?;
        Ok([1e3 * vx, 1e3 * vy, yaw.to_degrees()])
    };
    conditions().par_iter().enumerate().map(one).collect()
}

/// What a mean over the repeats is known to, by the largest speed.
#[must_use]
pub fn sigma(largest: f64) -> f64 {
    SCATTER * largest / (REPEATS as f64).sqrt()
}

/// Three repeats of every condition, which scatter.
pub fn repeated(random: &mut Pcg64, speeds: &[[f64; 3]]) -> Vec<((f64, f64), [f64; 3])> {
    let largest = largest(speeds);
    let mut seen = |one: &[f64; 3]| {
        [0, 1, 2].map(|part| {
            let normal: f64 = StandardNormal.sample(random);
            one[part] + SCATTER * largest[part] * normal
        })
    };
    (0..REPEATS).flat_map(|_| conditions()).zip(speeds.iter().cycle()).map(|(at, one)| (at, seen(one))).collect()
}
