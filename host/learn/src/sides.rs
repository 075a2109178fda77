//! Robots that are driven by +F and −F alone: what one turns to the left the other one turns to the right.

use sweep::VariantBuilder;
use tasks::{Definition, Environments, Task, Turn};

use super::LearnError;
use super::{gait, seeds};

/// The action that turns the shaft with +F, and the one with −F.
pub const FORWARD: usize = 0;
/// See [`FORWARD`].
pub const BACKWARD: usize = 1;

/// How long, s.
const TRIED_S: f64 = 10.0;

/// The environments of a task in which there is nothing to choose but +F and −F, Hz, each for `interval_s`.
#[must_use]
pub fn definition(task: Task, frequency_hz: f64, interval_s: f64, alpha_deg: Option<f64>) -> Definition {
    Definition { frequencies_hz: vec![frequency_hz, -frequency_hz], interval_s, alpha_deg, ..Definition::new(task) }
}

/// The action that turns the file's robot to the left in the open, and the one that turns it to the right, driven as in these environments.
///
/// # Errors
/// The environments'.
pub fn sides(
    robot: &VariantBuilder,
    environments: &Definition,
    threads: Option<usize>,
) -> Result<[usize; 2], LearnError> {
    let task = Task::Turn(Turn::default());
    let mut open = Definition { task, episode_s: TRIED_S, ..environments.clone() };
    open.randomization.share = 0.0;
    let gaits = gait::constants(0..2);
    let mut environments = Environments::with_threads(robot.clone(), open, gaits.len(), threads)?;
    let played = gait::play(&mut environments, &gaits, &[seeds::FILES_ROBOT; 2], &|_| false)?;
    Ok(if played[0].turned >= played[1].turned { [FORWARD, BACKWARD] } else { [BACKWARD, FORWARD] })
}
