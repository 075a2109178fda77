//! MuJoCo with what its contacts leave out put back (`tests/mujoco/corrected.py`): why its speeds depend on the module
//! that carries the free joint, and how near ours are to Coulomb's friction as it solves it.
//!
//! The robot is symmetric, so frequencies of one sign say all.

use mjcf::Options;
use serde_json::json;

use super::Bench;
use super::judge::{percent, rms_over_largest};
use super::peer::{Peer, PeerError, not_compared};
use super::reference::{ALPHAS_DEG, Condition, at_step, plan, speeds};
use super::walking::{MOST, Printed, STEP_S};
use crate::row::Row;

/// What two roots may differ by in a program that leaves nothing out; MuJoCo's step alone makes 2 %.
const ROOTS_MOST: f64 = 0.05;
/// Of MuJoCo's contacts where ours are compared, s: a contact comes to rest within it, whatever it carries. The shorter,
/// the nearer to a hard one.
const TIME_CONSTANT_S: f64 = 1e-3;
/// With that, s.
const FINE_STEP_S: f64 = 5e-5;

/// What is run: every angle (degrees) at every frequency (Hz, counter-clockwise).
#[derive(Clone, Copy)]
struct Conditions {
    alphas_deg: &'static [f64],
    frequencies_hz: &'static [f64],
}

const FEW: Conditions = Conditions { alphas_deg: &[60.0, 90.0], frequencies_hz: &[7.0] };
const ALL: Conditions = Conditions { alphas_deg: &ALPHAS_DEG, frequencies_hz: &[6.0, 7.0, 8.0] };

impl Conditions {
    fn list(self) -> Vec<Condition> {
        let at = |alpha_deg: f64| self.frequencies_hz.iter().map(move |f| Condition { alpha_deg, frequency_hz: *f });
        self.alphas_deg.iter().flat_map(|alpha| at(*alpha)).collect()
    }

    /// MuJoCo's speeds with the free joint on a module (from 0).
    fn simulated(
        self,
        (bench, peer): (&Bench, &Peer),
        root: usize,
        script: &'static str,
        words: &[String],
    ) -> Result<Vec<[f64; 3]>, PeerError> {
        let options = Options { root: Some(root), ..Options::default() };
        let export =
            |alpha: &f64| peer.export(&format!("alpha{alpha}-root{root}"), &plan(&bench.robot, *alpha), &options);
        let models: Vec<_> = self.alphas_deg.iter().map(export).collect();
        let words = [&[Peer::frequencies(self.frequencies_hz)], words].concat();
        peer.run(script, &words, &models).map(|printed: Printed| printed.speeds)
    }
}

/// The row of the few conditions that are quick.
#[must_use]
pub fn quick_rows(bench: &Bench) -> Vec<Row> {
    vec![roots(bench, FEW, "MuJoCo's root module 1 against 2, α 60 and 90°, 7 Hz: with the velocity term, vx/vy/yaw")]
}

/// The rows of all conditions.
#[must_use]
pub fn rows(bench: &Bench) -> Vec<Row> {
    vec![
        roots(bench, ALL, "MuJoCo's root module 1 against 2, 12 speeds: with the velocity term, vx/vy/yaw"),
        ours(bench),
    ]
}

/// MuJoCo against itself.
fn roots(bench: &Bench, conditions: Conditions, what: &str) -> Row {
    let required = format!("{:.0} %", 100.0 * ROOTS_MOST);
    compared(bench, what, &required, |peer| {
        let off = |script, words: &[String]| -> Result<[f64; 3], PeerError> {
            let [front, second] = [0, 1].map(|root| conditions.simulated((bench, peer), root, script, words));
            Ok(rms_over_largest(&front?, &second?))
        };
        let plain = off("speeds.py", &[format!("--step={STEP_S}")])?;
        let corrected = off("corrected.py", &["--velocity-term".into(), format!("--step={STEP_S}")])?;
        Ok(Row::new(
            what,
            &required,
            format!("{}; plain {}", percent(corrected), percent(plain)),
            corrected.iter().all(|share| *share <= ROOTS_MOST),
            json!({ "rms_over_largest": corrected, "plain": plain }),
        ))
    })
}

/// Ours against MuJoCo with Coulomb's friction.
fn ours(bench: &Bench) -> Row {
    let what = "12 speeds on the ground against MuJoCo with velocity term and Coulomb's friction, contacts of 1 ms: RMS \
                difference over the largest, vx/vy/yaw";
    let required = "16/7/10 %";
    compared(bench, what, required, |peer| {
        let words = |more: &[String]| [&["--velocity-term".into(), "--coulomb".into()], more].concat();
        let stiff = words(&[format!("--time-constant={TIME_CONSTANT_S}"), format!("--step={FINE_STEP_S}")]);
        let stiff = ALL.simulated((bench, peer), 1, "corrected.py", &stiff)?;
        let usual = ALL.simulated((bench, peer), 1, "corrected.py", &words(&[format!("--step={STEP_S}")]))?;
        let lifted = ALL.simulated((bench, peer), 1, "speeds.py", &[format!("--step={STEP_S}")])?;
        let ours = speeds(&bench.robot, &ALL.list(), at_step(STEP_S), 2);
        let off = rms_over_largest(&ours, &stiff);
        let (of_time, of_lift) = (rms_over_largest(&usual, &stiff), rms_over_largest(&lifted, &usual));
        Ok(Row::new(
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
fn compared(bench: &Bench, what: &str, required: &str, row: impl Fn(&Peer) -> Result<Row, PeerError>) -> Row {
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
