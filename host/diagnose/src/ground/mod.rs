//! A robot on the ground: the body that its shaft shakes pulls at the shaft.
//!
//! A recording with a pose is of a robot that walks. The file's body is moved by the shaft's own motion, as a model of the shaft
//! follows the readings, from rest in the recording's first pose; the torque that this takes goes into the model of the shaft as a known
//! one, sample by sample. A body that is another than the file's is a misfit like any other.
//!
//! How the body pulls and what the shaft's numbers are is found in turns ([`turns`]).
//!
//! Some gaits never repeat: two motions of the shaft that no sensor tells apart are soon two walks. So many bodies are moved, those that
//! the readings speak for are followed ([`particles`]), and where bodies that nobody guides come to pull otherwise, rollouts take no
//! part in fits and judgements.

mod body;
mod motion;
mod particles;
#[cfg(test)]
mod tests;
mod turns;

use hal_sim::body::plan::PlanError;
use rayon::prelude::*;
use robot_file::robot::Robot;

use super::DiagnoseError;
use super::model::Plant;
use super::track::Track;
use particles::{MOST_SPREAD, Pull};
pub use turns::{find_body, follow_anew};

/// Whether bodies that the readings do not tell apart differ by as much as is left over the noise (mean squares, rad²).
#[must_use]
pub fn is_left_by_the_body(noise: f64, left: f64) -> bool {
    left <= (1.0 + MOST_SPREAD) * noise
}

/// Works out anew how the body pulls at the shaft in those runs that are on the ground, whose rollouts have a length (s) and whose readings
/// each a mean square noise (rad²), by the model of the shaft that was fitted and some that may as well be it. Each `round` tries other
/// bodies.
///
/// # Errors
/// The file has no body, or one that cannot be built.
fn update_pull<'a>(
    robot: &Robot,
    plants: &[Plant],
    runs: impl Iterator<Item = (&'a mut Track, f64)>,
    horizon_s: f64,
    round: u64,
) -> Result<(), DiagnoseError> {
    let runs: Vec<(&mut Track, f64)> = runs.collect();
    runs.into_par_iter().try_for_each(|(track, noise)| {
        let Some(pose) = track.first_pose else { return Ok(()) };
        let refused = |error: PlanError| DiagnoseError::Recording {
            run: track.name.clone(),
            problem: format!("it has a pose, and the file's body cannot be simulated: {error}"),
            help: "give the file a [body], or leave the columns x_m, y_m and yaw_rad out for a shaft on a bench"
                .to_owned(),
        };
        let seed = round << 32 | track.place as u64;
        let Pull { torque, unknown } =
            particles::estimate(robot, plants, track, pose, (horizon_s, noise), seed).map_err(refused)?;
        (track.load_torque, track.pull_unknown) = (torque, unknown);
        Ok(())
    })
}
