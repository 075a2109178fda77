//! Held readings in a diagnosis: they are told by counting, not by a fit, and what the runs say without them is judged without them.

use effects::{Effect, HeldSamples};
use robot_file::robot::Robot;

use super::repeats::{self, Repeats};
use super::session::Session;
use super::track::Track;
use super::values;
use super::verdict::{CandidateEvidence, Cause, Diagnosis, FittedParameter, Gain, Verdict};

/// The effect's name.
pub const NAME: &str = HeldSamples::SPEC.name;

/// Adds held readings to a diagnosis that was made without them, where there are any and the file does not have them.
pub fn add(diagnosis: &mut Diagnosis, robot: &Robot, session: &Session) {
    let is_held = |track: &&Track| track.repeats.are_held();
    let found = repeats::of_all(session.fit.iter().chain(&session.held_out).filter(is_held));
    if found.held == 0 || robot.effects.listed().any(|id| id.name() == NAME) {
        return;
    }
    let (key, share) = (HeldSamples::SPEC.parameters[0].key, found.share());
    let parameter = values::parameter(robot, format!("effects.{NAME}.{key}"), share);
    let cause = Cause { effect: NAME.to_owned(), also: Vec::new(), parameters: [(key.to_owned(), share)].into() };
    let before = with_held(diagnosis.before, &session.held_out);
    let row = evidence(&found, before, diagnosis, parameter.clone());
    diagnosis.detail.candidates.insert(1, row);
    diagnosis.detail.candidates[0].held_out_rmse = before;
    diagnosis.detail.candidates[0].ratio_to_floor = before / diagnosis.noise_floor;
    diagnosis.detail.extended.push(parameter.clone());
    diagnosis.detail.rivals.iter_mut().for_each(|rival| rival.push(parameter.clone()));
    if diagnosis.models.is_empty() {
        diagnosis.models.push(Vec::new());
    }
    diagnosis.models.iter_mut().for_each(|model| model.push(NAME.to_owned()));
    diagnosis.limits.retain(|limit| limit.effect != NAME);
    diagnosis.causes.push(cause);
    diagnosis.before = before;
    diagnosis.gain = gain(diagnosis);
    if diagnosis.verdict == Verdict::Nothing {
        diagnosis.verdict = Verdict::Explained;
    }
}

/// The held-out error (rad) with the readings that were dropped.
fn with_held(without: f64, held_out: &[Track]) -> f64 {
    let sum = |of: fn(&Track) -> f64| held_out.iter().map(of).sum::<f64>();
    let (all, square) = (sum(|track| track.t.len() as f64), sum(|track| track.held_square));
    let share = sum(|track| track.repeats.stale.len() as f64) / all;
    ((1.0 - share) * without * without + square / all).sqrt()
}

/// What the causes remove of the excess; how much of it is the held readings' hangs on how many they are, which is known well.
fn gain(diagnosis: &Diagnosis) -> Gain {
    let [before, after, floor] = [diagnosis.before, diagnosis.after, diagnosis.noise_floor].map(|one| one * one);
    let percent = 100.0 * (1.0 - (after - floor).max(0.0) / (before - floor).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    let known = diagnosis.gain;
    let has_interval = known.high > known.low;
    let (low, high) = if has_interval { (known.low.min(percent), known.high.max(percent)) } else { (percent, percent) };
    Gain { percent_of_excess_removed: percent, low, high }
}

/// The row of the table of evidence.
fn evidence(found: &Repeats, before: f64, without: &Diagnosis, share: FittedParameter) -> CandidateEvidence {
    let removed = 100.0 * (1.0 - without.before / before);
    CandidateEvidence {
        effects: vec![NAME.to_owned()],
        held_out_rmse: without.before,
        ratio_to_floor: without.before / without.noise_floor,
        improvement_percent: [removed; 3],
        parameters: vec![share],
        speaks_for: vec![format!(
            "of {} readings taken while the shaft moved {} repeat the one before to the last digit; without them {removed:.0} % of the \
             held-out error is gone",
            found.moving, found.held
        )],
        speaks_against: Vec::new(),
        named: true,
    }
}
