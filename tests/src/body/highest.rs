//! The highest frequency at which the motor turns the eccentric of a robot that walks.

use control::Actuation;
use hal_sim::Settings;
use hal_sim::body::plan::PlanError;
use hal_sim::body::{Precision, Walker, WalkingRobots};
use robot_file::Robot;
use serde_json::json;

use super::PeerSetup;
use super::reference::{ALPHAS_DEG, plan};
use crate::row::FigureRow;

/// Thesis section 5.1: experiments at up to 8 Hz; "its maximum stable frequency is around 9 Hz".
const BOUNDS_HZ: [f64; 2] = [8.0, 9.5];
/// Until the speed is steady, s.
const WARM_UP_S: f64 = 2.0;
/// What is averaged over, s.
const MEAN_S: f64 = 2.0;

/// Runs the campaign; the table has one row.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let what = "highest frequency on the ground, at full voltage, α = 0, 60, 90, 120°, both ways round";
    let required = format!("{}–{} Hz: 8 is held, about 9 is the thesis's highest", BOUNDS_HZ[0], BOUNDS_HZ[1]);
    let (measured, holds, numbers) = match frequencies(&bench.robot) {
        Ok(all) => {
            let least = all.iter().copied().fold(f64::INFINITY, f64::min);
            let most = all.iter().copied().fold(0.0, f64::max);
            let holds = all.iter().all(|hz| (BOUNDS_HZ[0]..=BOUNDS_HZ[1]).contains(hz));
            (format!("{least:.2} … {most:.2} Hz"), holds, json!(all))
        }
        Err(why) => (why.to_string(), false, json!(null)),
    };
    vec![FigureRow::new(what, &required, measured, holds, numbers)]
}

/// Mean frequency of each angle, counter-clockwise and clockwise, Hz, positive.
fn frequencies(robot: &Robot) -> Result<Vec<f64>, PlanError> {
    let mut walkers = Vec::new();
    for alpha in ALPHAS_DEG {
        for seed in [1, 2] {
            let mut walker = Walker::new(robot, seed, &Settings::default())?;
            walker.plan = plan(robot, alpha);
            walkers.push(walker);
        }
    }
    let mut robots = WalkingRobots::new(walkers, Precision::Double)?;
    let drives: Vec<Actuation> =
        (0..robots.len()).map(|i| Actuation { duty: if i % 2 == 0 { 1.0 } else { -1.0 }, enable: true }).collect();
    let ticks = |seconds: f64| (seconds / robots.tick_s()).round() as usize;
    let (warm_up, all) = (ticks(WARM_UP_S), ticks(WARM_UP_S + MEAN_S));
    let mut turned = vec![0.0; robots.len()];
    for tick in 0..all {
        robots.advance(&drives);
        if tick >= warm_up {
            turned.iter_mut().enumerate().for_each(|(i, sum)| *sum += robots.truth(i).speed * robots.tick_s());
        }
    }
    Ok(turned.iter().map(|angle| angle.abs() / std::f64::consts::TAU / MEAN_S).collect())
}
