//! Uneven robots in the air, shaken by their eccentrics, beside MuJoCo: no ground, no weight, nothing that hides a wrong
//! mass or stiffness.

use hal_sim::body::{Ensemble, Plan};
use mjcf::Options;
use rayon::prelude::*;
use serde_json::json;

use super::PeerSetup;
use super::multibody::{Multibody, Path3, Run};
use super::peer::{Peer, PeerError, not_compared};
use super::reference::{at_step, plan, servo};
use super::uneven::{ROBOTS, robot};
use crate::row::FigureRow;

/// Our step, s.
const STEP_S: f64 = 1e-4;
/// MuJoCo's coarser step, s; the other one is half of it.
const COARSE_S: f64 = 2e-5;
/// Length of a run, s.
const LENGTH_S: f64 = 0.5;
/// Time between two points, s.
const SAMPLE_S: f64 = 1e-3;
/// α (degrees) and counter-clockwise frequency (Hz) of every run.
const CONDITION: (f64, f64) = (75.0, 7.5);
/// What the paths may differ by, as a share of the largest excursion.
const MOST: f64 = 0.001;

/// Runs the campaign; the table has one row.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let what = "six uneven robots in the air, shaken for 0.5 s: paths of all modules against MuJoCo's limit of small steps, \
                largest distance over the largest excursion";
    let required = "0.1 %";
    let compared = bench.peer.as_ref().map(differences);
    let off = match compared {
        Ok(Ok(off)) => off,
        Ok(Err(why)) => return vec![not_compared(what, required, &why)],
        Err(why) => return vec![not_compared(what, required, why)],
    };
    let worst = off.iter().copied().fold(0.0, f64::max);
    let each: Vec<_> = ROBOTS.iter().zip(&off).map(|(name, off)| format!("{name} {:.3} %", 100.0 * off)).collect();
    let numbers = json!({ "over_excursion": off });
    vec![FigureRow::new(what, required, each.join(", "), worst <= MOST, numbers)]
}

fn differences(peer: &Peer) -> Result<Vec<f64>, PeerError> {
    let multibody = Multibody::build(peer)?;
    let (alpha_deg, frequency_hz) = CONDITION;
    let one = |name: &&str| {
        let plan = Plan { gravity: [0.0; 3], ..plan(&robot(name), alpha_deg) };
        let model = peer.export(&format!("air-{name}"), &plan, &Options::default());
        let run = Run { model: &model, frequency_hz, length_s: LENGTH_S, sample_s: SAMPLE_S, law: None };
        let theirs = multibody.limit(run, COARSE_S)?;
        Ok(difference(&own(&plan, frequency_hz), &theirs))
    };
    ROBOTS.par_iter().map(one).collect()
}

fn own(plan: &Plan, frequency_hz: f64) -> Path3 {
    let plan = Plan { contact: None, ..plan.clone() };
    let mut body = Ensemble::new(&[plan], at_step(STEP_S)).unwrap_or_else(|error| panic!("{error}"));
    let (drive, every) = ([servo(frequency_hz)], (SAMPLE_S / STEP_S).round() as usize);
    let at = |body: &Ensemble| body.snapshot(0).modules.iter().map(|pose| pose.position).collect();
    let mut path = vec![at(&body)];
    for _ in 0..(LENGTH_S / SAMPLE_S).round() as usize {
        body.advance(every, &drive);
        path.push(at(&body));
    }
    path
}

/// Largest distance of a module from where it is in the other path, over the largest distance that any has come from its
/// start. Infinite where a number is missing.
fn difference(ours: &[Vec<[f64; 3]>], theirs: &[Vec<[f64; 3]>]) -> f64 {
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt();
    let furthest = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let all = a.iter().zip(b).map(|(a, b)| distance(a, b));
        if a.len() == b.len() {
            all.fold(0.0, |most, one| if one > most || one.is_nan() { one } else { most })
        } else {
            f64::NAN
        }
    };
    let over = |pairs: &mut dyn Iterator<Item = f64>| {
        pairs.fold(0.0, |most: f64, one| if one.is_nan() { f64::NAN } else { most.max(one) })
    };
    if ours.len() != theirs.len() || ours.is_empty() {
        return f64::INFINITY;
    }
    let off = over(&mut ours.iter().zip(theirs).map(|(a, b)| furthest(a, b)));
    let excursion = over(&mut theirs.iter().map(|now| furthest(now, &theirs[0])));
    let share = off / excursion;
    if share.is_finite() { share } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_without_numbers_is_infinitely_wrong() {
        let path = vec![vec![[0.0; 3]; 2], vec![[0.0, 0.0, 3.0], [0.0, 4.0, 0.0]]];
        assert_eq!(difference(&path, &path), 0.0);
        let mut other = path.clone();
        other[1][0][0] = 1.0;
        assert_eq!(difference(&other, &path), 0.25);
        other[1][0][0] = f64::NAN;
        for (ours, theirs) in [(&other, &path), (&path, &other), (&path, &path[..1].to_vec()), (&vec![], &vec![])] {
            assert_eq!(difference(ours, theirs), f64::INFINITY);
        }
    }
}
