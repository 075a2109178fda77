//! MuJoCo with what its contacts leave out put back (`tests/mujoco/corrected.py`): why its speeds depend on the module
//! that carries the free joint, and how near ours are to Coulomb's friction as it solves it.
//!
//! The robot is symmetric, so frequencies of one sign say all.

use mjcf::Options;
use robot_file::Robot;
use serde_json::json;

use super::PeerSetup;
use super::error_measures::{percent, rms_over_largest};
use super::peer::{Peer, PeerError, not_compared};
use super::reference::{ALPHAS_DEG, Condition, at_step, plan, speeds};
use super::walking::{MOST, Printed, STEP_S};
use crate::row::FigureRow;

/// What two roots may differ by in a program that leaves nothing out; MuJoCo's step alone makes 2 %.
const ROOTS_MOST: f64 = 0.05;
/// Of MuJoCo's contacts where ours are compared, s: a contact comes to rest within it, whatever it carries. The shorter,
/// the nearer to a hard one.
const TIME_CONSTANT_S: f64 = 1e-3;
/// With that, s.
const FINE_STEP_S: f64 = 5e-5;

/// What is run: every number of modules, with every angle (degrees) at every frequency (Hz, counter-clockwise).
#[derive(Clone, Copy)]
struct Conditions {
    modules: &'static [usize],
    alphas_deg: &'static [f64],
    frequencies_hz: &'static [f64],
}

const FEW: Conditions = Conditions { modules: &[4], alphas_deg: &[60.0, 90.0], frequencies_hz: &[7.0] };
/// Those that the feet were fitted to.
const ALL: Conditions = Conditions { modules: &[4], alphas_deg: &ALPHAS_DEG, frequencies_hz: &[6.0, 7.0, 8.0] };
/// None of these angles, frequencies and numbers of modules was looked at when the feet were fitted.
const HELD_OUT: Conditions =
    Conditions { modules: &[3, 5], alphas_deg: &[30.0, 75.0, 105.0], frequencies_hz: &[6.5, 7.5] };
const HELD_OUT_FEW: Conditions = Conditions { modules: &[3, 5], alphas_deg: &[30.0, 75.0], frequencies_hz: &[6.5] };

impl Conditions {
    fn list(self) -> Vec<Condition> {
        let at = |alpha_deg: f64| self.frequencies_hz.iter().map(move |f| Condition { alpha_deg, frequency_hz: *f });
        self.alphas_deg.iter().flat_map(|alpha| at(*alpha)).collect()
    }

    /// Ours, in the order of MuJoCo's.
    fn ours(self, bench: &PeerSetup) -> Vec<[f64; 3]> {
        let of = |modules: &usize| speeds(&with_modules(&bench.robot, *modules), &self.list(), at_step(STEP_S), 2);
        self.modules.iter().flat_map(of).collect()
    }

    /// MuJoCo's speeds with the free joint on a module (from 0).
    fn simulated(
        self,
        (bench, peer): (&PeerSetup, &Peer),
        root: usize,
        script: &'static str,
        words: &[String],
    ) -> Result<Vec<[f64; 3]>, PeerError> {
        let options = Options { root: Some(root), ..Options::default() };
        let export = |modules: usize, alpha: f64| {
            let plan = plan(&with_modules(&bench.robot, modules), alpha);
            peer.export(&format!("modules{modules}-alpha{alpha}-root{root}"), &plan, &options)
        };
        let of = |modules: usize| self.alphas_deg.iter().map(move |alpha| (modules, *alpha));
        let all = self.modules.iter().copied().flat_map(of);
        let models: Vec<_> = all.map(|(modules, alpha)| export(modules, alpha)).collect();
        let words = [&[Peer::frequencies(self.frequencies_hz)], words].concat();
        peer.run(script, &words, &models).map(|printed: Printed| printed.speeds)
    }
}

/// The robot file's robot with so many modules: fewer from the rear, or more like the last.
fn with_modules(robot: &Robot, modules: usize) -> Robot {
    let mut robot = robot.clone();
    if let Some(body) = &mut robot.body
        && let Some(last) = body.modules.last().copied()
    {
        body.modules.resize(modules, last);
    }
    robot
}

/// The row of the few conditions that are quick.
#[must_use]
pub fn quick_rows(bench: &PeerSetup) -> Vec<FigureRow> {
    vec![
        roots(bench, FEW, "MuJoCo's root module 1 against 2, α 60 and 90°, 7 Hz: with the velocity term, vx/vy/yaw"),
        ours(bench, HELD_OUT_FEW, HELD_OUT_FEW_WHAT),
    ]
}

/// The rows of all conditions.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    vec![
        roots(bench, ALL, "MuJoCo's root module 1 against 2, 12 speeds: with the velocity term, vx/vy/yaw"),
        ours(bench, ALL, FITTED_WHAT),
        ours(bench, HELD_OUT, HELD_OUT_WHAT),
    ]
}

/// MuJoCo against itself.
fn roots(bench: &PeerSetup, conditions: Conditions, what: &str) -> FigureRow {
    let required = format!("{:.0} %", 100.0 * ROOTS_MOST);
    compared(bench, what, &required, |peer| {
        let off = |script, words: &[String]| -> Result<[f64; 3], PeerError> {
            let [front, second] = [0, 1].map(|root| conditions.simulated((bench, peer), root, script, words));
            Ok(rms_over_largest(&front?, &second?))
        };
        let plain = off("speeds.py", &[format!("--step={STEP_S}")])?;
        let corrected = off("corrected.py", &["--velocity-term".into(), format!("--step={STEP_S}")])?;
        Ok(FigureRow::new(
            what,
            &required,
            format!("{}; plain {}", percent(corrected), percent(plain)),
            corrected.iter().all(|share| *share <= ROOTS_MOST),
            json!({ "rms_over_largest": corrected, "plain": plain }),
        ))
    })
}

const FITTED_WHAT: &str = "12 speeds on the ground that the feet were fitted to, against MuJoCo with velocity term and \
                           Coulomb's friction, contacts of 1 ms: RMS difference over the largest, vx/vy/yaw";
const HELD_OUT_WHAT: &str = "12 speeds that nothing was fitted to (3 and 5 modules, α 30, 75, 105°, 6.5 and 7.5 Hz), against \
                             the same MuJoCo";
const HELD_OUT_FEW_WHAT: &str = "4 speeds that nothing was fitted to (3 and 5 modules, α 30 and 75°, 6.5 Hz), against MuJoCo \
                                 with velocity term and Coulomb's friction, contacts of 1 ms";

/// Ours against MuJoCo with Coulomb's friction.
fn ours(bench: &PeerSetup, conditions: Conditions, what: &str) -> FigureRow {
    let required = "16/7/10 %";
    compared(bench, what, required, |peer| {
        let words = |more: &[String]| [&["--velocity-term".into(), "--coulomb".into()], more].concat();
        let stiff = words(&[format!("--time-constant={TIME_CONSTANT_S}"), format!("--step={FINE_STEP_S}")]);
        let stiff = conditions.simulated((bench, peer), 1, "corrected.py", &stiff)?;
        let usual = conditions.simulated((bench, peer), 1, "corrected.py", &words(&[format!("--step={STEP_S}")]))?;
        let lifted = conditions.simulated((bench, peer), 1, "speeds.py", &[format!("--step={STEP_S}")])?;
        let ours = conditions.ours(bench);
        let off = rms_over_largest(&ours, &stiff);
        let (of_time, of_lift) = (rms_over_largest(&usual, &stiff), rms_over_largest(&lifted, &usual));
        Ok(FigureRow::new(
            what,
            required,
            format!(
                "{}; MuJoCo so with its contacts of 4 ms {}; plain MuJoCo against that {}",
                percent(off),
                percent(of_time),
                percent(of_lift)
            ),
            off.iter().zip(MOST).all(|(off, most)| *off <= most),
            json!({ "rms_over_largest": off, "time_constant": of_time, "lift": of_lift, "ours": ours, "mujoco": stiff }),
        ))
    })
}

/// A row that needs MuJoCo.
fn compared(
    bench: &PeerSetup,
    what: &str,
    required: &str,
    row: impl Fn(&Peer) -> Result<FigureRow, PeerError>,
) -> FigureRow {
    match &bench.peer {
        Err(why) => not_compared(what, required, why),
        Ok(peer) => row(peer).unwrap_or_else(|why| not_compared(what, required, &why)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::reference::conditions;
    use super::*;

    #[test]
    fn nothing_that_is_held_out_was_fitted_to() {
        for held_out in [HELD_OUT, HELD_OUT_FEW] {
            assert!(held_out.modules.iter().all(|modules| !ALL.modules.contains(modules)));
            // Mirrored, an angle is 180° less itself.
            let fitted = |alpha: &f64| ALL.alphas_deg.iter().any(|of| *of == *alpha || 180.0 - of == *alpha);
            assert!(!held_out.alphas_deg.iter().any(fitted));
            assert!(held_out.frequencies_hz.iter().all(|hz| !ALL.frequencies_hz.contains(hz)));
        }
    }

    #[test]
    fn the_fitted_robot_has_the_modules_that_are_said() {
        let robot = PeerSetup::new(std::env::temp_dir()).robot;
        let count = |robot: &Robot| plan(robot, 60.0).modules.len();
        assert_eq!(count(&robot), ALL.modules[0]);
        assert_eq!([3, 5].map(|modules| count(&with_modules(&robot, modules))), [3, 5]);
    }

    #[test]
    fn with_their_mirror_images_they_are_all_conditions() {
        let half = ALL.list();
        for condition in conditions() {
            let Condition { alpha_deg, frequency_hz } = condition.mirrored();
            // A robot whose backbones are rolled by 180° is one whose backbones are not rolled.
            let mirrored = Condition { alpha_deg: alpha_deg % 180.0, frequency_hz };
            assert!(half.contains(&condition) ^ half.contains(&mirrored), "{condition:?}");
        }
    }
}
