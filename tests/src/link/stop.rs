//! From the stop key to the bridge off, at the figures of ESP-NOW as measured.

use std::time::Duration;

use common::quantile;
use link::RobotId;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::json;
use testbed::event_log::{Detail, actuations};

use super::Options;
use super::mode::Mode;
use super::rig::{Rig, Template};
use crate::figures::run::{DesignedRobot, for_seeds, median, worst};
use crate::row::FigureRow;

/// Stops in a session.
const IN_A_SESSION: u64 = 40;
/// Required, s.
const MEDIAN_S: f64 = 0.015;
/// Required, s.
const WORST_S: f64 = 0.060;
/// The rate at which the round trip was measured, bit/s.
const MEASURED_AT: f64 = 1e6;

/// The rows: robots on the air, at the measured rate and at the one that the firmware sets. At the measured one the telemetry
/// of two robots takes half of the channel, and that of five is more than it carries: these rows only inform.
#[must_use]
pub fn rows(bench: &DesignedRobot, options: &Options) -> Vec<FigureRow> {
    let set = bench.robot.radio.as_ref().map_or(MEASURED_AT, |radio| radio.unicast_bit_per_s.value);
    let sessions = (options.runs / 5).div_ceil(IN_A_SESSION).max(1);
    [(1, MEASURED_AT, true), (2, MEASURED_AT, false), (5, set, true), (5, MEASURED_AT, false)]
        .into_iter()
        .map(|(robots, bit_per_s, required)| {
            let row = row(bench, robots, bit_per_s, sessions);
            if required { row } else { FigureRow::beside(&row.what, row.measured, row.numbers) }
        })
        .collect()
}

fn row(bench: &DesignedRobot, robots: usize, bit_per_s: f64, sessions: u64) -> FigureRow {
    let stops: Vec<Option<f64>> =
        for_seeds(sessions, |seed| session(bench, robots, bit_per_s, seed)).into_iter().flatten().collect();
    let after_s: Vec<f64> = stops.iter().flatten().copied().collect();
    let off_before = stops.len() - after_s.len();
    let (median_s, worst_s) = (median(after_s.iter().copied()), worst(after_s.iter().copied()));
    let mut sorted = after_s.clone();
    let later = |limit_s: f64| after_s.iter().filter(|after_s| **after_s > limit_s).count();
    FigureRow::new(
        &format!("stop key to bridge off, {robots} on the air, {} Mb/s", bit_per_s / 1e6),
        "median 15 ms, worst 60 ms",
        format!(
            "{} stops: median {:.1} ms, 99 % {:.1} ms, worst {:.1} ms; {} later than 60 ms; {off_before} robots had \
             stopped by themselves before",
            after_s.len(),
            1e3 * median_s,
            1e3 * quantile(&mut sorted, 0.99).unwrap_or(f64::INFINITY),
            1e3 * worst_s,
            later(WORST_S)
        ),
        off_before == 0 && median_s <= MEDIAN_S && worst_s <= WORST_S,
        json!({ "stops": after_s.len(), "median_s": median_s, "worst_s": worst_s, "late": later(WORST_S), "off_before": off_before }),
    )
}

fn session(bench: &DesignedRobot, robots: usize, bit_per_s: f64, seed: u64) -> Vec<Option<f64>> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut file = bench.robot.clone();
    if let Some(radio) = &mut file.radio {
        radio.unicast_bit_per_s.value = bit_per_s;
        let loss = &mut radio.loss_share;
        // 0.1 to 3 %, as often of each size.
        loss.value = (loss.low.ln() + random.random_range(0.0..1.0) * (loss.high / loss.low).ln()).exp();
    }
    let mut rig = Rig::new(Template::new(&file, robots, Detail::Bridge).seeded(seed));
    rig.meet();
    (0..robots).for_each(|robot| rig.order(robot, Mode::Forward.command(0)));
    (0..IN_A_SESSION)
        .map(|_| {
            let robot = random.random_range(0..robots);
            // Until a moment between two polls.
            rig.run(Duration::from_micros(random.random_range(30_000..100_000)));
            let after_s = stop(&mut rig, robot);
            while !rig.state(robot).is_some_and(|state| Mode::Forward.leads_to(state)) {
                rig.meet();
                rig.order(robot, Mode::Forward.command(0));
            }
            after_s
        })
        .collect()
}

/// From the key to the bridge off, s; nothing where it was off already.
fn stop(rig: &mut Rig, robot: usize) -> Option<f64> {
    if !rig.end.bench().robots[robot].actuation().enable {
        return None;
    }
    let start = rig.session.now();
    let _ = rig.end.bench().robots[robot].event_log.take();
    rig.session.stop(RobotId(robot)).expect("a healthy line");
    rig.wait_for_stop(robot);
    let bench = rig.end.bench();
    let events = bench.robots[robot].event_log.events();
    let off_us = actuations(&events).find(|(_, told)| !told.enable).map(|(at_us, _)| at_us);
    Some(off_us.map_or(f64::INFINITY, |off_us| off_us as f64 * 1e-6 - start.as_secs_f64()))
}
