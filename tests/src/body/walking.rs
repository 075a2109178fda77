//! The 24 speeds on the ground beside MuJoCo's, whose free joint is on module 2 and whose cones are elliptic.

use std::fmt::Write as _;
use std::path::PathBuf;

use mjcf::Options;
use robot_file::Robot;
use serde::Deserialize;
use serde_json::json;

use super::PeerSetup;
use super::error_measures::{largest, percent, rms_over_largest, same_signs};
use super::peer::{Peer, PeerError, not_compared};
use super::reference::{ALPHAS_DEG, FREQUENCIES_HZ, at_step, conditions, plan, speeds};
use crate::row::FigureRow;

/// Both steps, s.
pub(super) const STEP_S: f64 = 1e-4;
/// What MuJoCo's own speeds change by when the free joint is on module 1 instead of 2.
pub(super) const MOST: [f64; 3] = [0.16, 0.07, 0.10];
/// Smaller speeds, as shares of the largest, may have any sign.
const SMALL: f64 = 0.15;
/// What the row of the differences tells. Neither contact is the truth, so that nothing is required of it: what is, is that the
/// same law of the feet gives the same speeds ([`super::own_law`]).
const DIFFERENCE: &str = "beside it: the same speeds, RMS difference over the largest, vx/vy/yaw, for information";
/// Where all speeds are written to.
pub const FILE: &str = "mujoco-speeds.csv";

/// What the script prints.
#[derive(Deserialize)]
pub(super) struct Printed {
    /// vx, vy (m/s) and yaw (rad/s), the frequencies of a model together.
    pub speeds: Vec<[f64; 3]>,
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let what =
        "24 speeds on the ground against MuJoCo (root module 2, elliptic): signs, where above 15 % of the largest";
    let required = "22 of 24";
    let theirs = match bench.peer.as_ref().map(|peer| simulated(peer, &bench.robot)) {
        Ok(Ok(theirs)) => theirs,
        Ok(Err(why)) => return vec![not_compared(what, required, &why)],
        Err(why) => return vec![not_compared(what, required, why)],
    };
    let ours = speeds(&bench.robot, &conditions(), at_step(STEP_S), 2);
    let path = bench.out.join(FILE);
    let written = std::fs::create_dir_all(&bench.out).and_then(|()| std::fs::write(&path, table(&ours, &theirs)));
    let told = written.map_or_else(|error| error.to_string(), |()| format!("all in {}", path.display()));
    let (signs, off) = (same_signs(&ours, &theirs, SMALL), rms_over_largest(&ours, &theirs));
    let [x, y, yaw] = largest(&theirs);
    let numbers = json!({ "ours": ours, "mujoco": theirs });
    vec![
        FigureRow::new(what, required, format!("{signs} of {}; {told}", theirs.len()), signs >= 22, numbers),
        FigureRow::beside(
            DIFFERENCE,
            format!(
                "{}; its largest {:.1} mm/s, {:.1} mm/s, {:.1} °/s",
                percent(off),
                1e3 * x,
                1e3 * y,
                yaw.to_degrees()
            ),
            json!({ "rms_over_largest": off }),
        ),
    ]
}

/// Models of all angles, with the free joint on module 2.
#[must_use]
pub fn models(peer: &Peer, robot: &Robot) -> Vec<PathBuf> {
    let export = |alpha: &f64| peer.export(&format!("alpha{alpha}"), &plan(robot, *alpha), &Options::default());
    ALPHAS_DEG.iter().map(export).collect()
}

fn simulated(peer: &Peer, robot: &Robot) -> Result<Vec<[f64; 3]>, PeerError> {
    let words = [Peer::frequencies(&FREQUENCIES_HZ), format!("--step={STEP_S}")];
    peer.run("speeds.py", &words, &models(peer, robot)).map(|printed: Printed| printed.speeds)
}

/// All speeds side by side.
fn table(ours: &[[f64; 3]], theirs: &[[f64; 3]]) -> String {
    let mut text = String::from(
        "alpha_deg,f_counter_clockwise_hz,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s,\
         mujoco_vx_mm_per_s,mujoco_vy_mm_per_s,mujoco_yaw_deg_per_s\n",
    );
    for (at, (a, b)) in conditions().iter().zip(ours.iter().zip(theirs)) {
        let _ = write!(text, "{},{}", at.alpha_deg, at.frequency_hz);
        for [x, y, yaw] in [a, b] {
            let _ = write!(text, ",{:.3},{:.3},{:.3}", 1e3 * x, 1e3 * y, yaw.to_degrees());
        }
        text.push('\n');
    }
    text
}
