//! Whether a run was safe.

use control::Fault as Cause;

use super::broken::Broken;
use super::run::{Conditions, Outcome};
use crate::link::assessment::bound;

/// Assessment of a run of the safety campaign.
#[derive(Clone, Debug)]
pub struct SafetyAssessment {
    /// What was not safe, for people.
    pub unsafe_: Vec<String>,
    /// For how long the bridge drove a current after the trouble began, s; nothing where the robot had stopped before.
    pub driven_s: Option<f64>,
    /// The fault that the robot named.
    pub fault: Option<Cause>,
    /// Largest heat in the winding.
    pub heat: f64,
}

/// The controller's model of the current is good to so much (`cargo safety-figures` prints the largest heat).
const HEAT_MARGIN: f64 = 1.15;
/// A starved loop is found within this, s.
const STARVED_S: f64 = 0.2;
/// A tick of rounding, and one for the command to come, s.
const ROUNDING_S: f64 = 2e-3;

/// Judges a run.
#[must_use]
pub fn assess(conditions: &Conditions, outcome: &Outcome) -> SafetyAssessment {
    let p = &conditions.parameters;
    let mut unsafe_ = Vec::new();
    let driven_s = outcome.driven as f64 * 1e-3;
    let heat_limit = f64::from(p.supervisor.overheated.limit) * HEAT_MARGIN;
    if outcome.heat > heat_limit {
        unsafe_.push(format!("heat {:.2} of {heat_limit:.2}", outcome.heat));
    }
    if outcome.on_in_fault > 0 {
        unsafe_.push(format!("on for {} ms in Fault", outcome.on_in_fault));
    }
    if let (Broken::Found(causes), false) = (conditions.broken, outcome.fault_before) {
        let named = outcome.fault.and_then(|fault| bound(p, fault)).unwrap_or_default();
        let is = causes.iter().take(1).filter_map(|cause| bound(p, *cause)).fold(named, f64::max);
        let most = if conditions.starved.is_some() { is.max(STARVED_S) } else { is };
        if driven_s > most + ROUNDING_S {
            unsafe_.push(format!(
                "driven for {driven_s:.3} s of {most:.3} s as {:?}: {}",
                outcome.fault,
                conditions.said()
            ));
        }
    }
    let driven_s = (!outcome.fault_before).then_some(driven_s);
    // What may go on has no time of its own.
    let driven_s = driven_s.filter(|_| conditions.broken != Broken::Borne);
    SafetyAssessment { unsafe_, driven_s, fault: outcome.fault, heat: outcome.heat }
}
