//! Where the readings do not say how the body pulls at the shaft.
//!
//! A parametric bootstrap (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6): readings are drawn anew about the
//! motion that a model follows, the body is moved by what each draw is followed as, and rollouts under the torques that come of it are
//! compared with those under the first one's. Where a gait repeats they differ by less than the noise; where it does not, by far more.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use robot_file::robot::Robot;

use super::super::DiagnoseError;
use super::super::model::Plant;
use super::super::rollout;
use super::super::track::{Cut, Track};
use super::motion::follow;
#[cfg(test)]
use super::motion::ShaftMotion;
use super::torque;

/// Times that the readings are drawn anew.
const DRAWS: u64 = 6;
/// A rollout that the unknown part of the torque moves by more than this share of the noise's variance is left out.
const MOST: f64 = 0.1;
/// Readings whose parabola is the first guess of a rollout's start, as a share of its length.
const GUESS: f64 = 0.25;
/// Times that starts are refined.
const REFINED: usize = 3;

/// Marks the rollouts of a length (s), in those runs on the ground whose torque [`super::pull`] has worked out, that another draw of
/// readings with that mean square noise (rad²) would leave elsewhere; [`Track::cut`] then leaves them out.
///
/// # Errors
/// As [`super::pull`].
pub fn leave_out_unknown(
    robot: &Robot,
    plant: &Plant,
    tracks: &mut [Track],
    horizon_s: f64,
    noise: f64,
) -> Result<(), DiagnoseError> {
    tracks.par_iter_mut().try_for_each(|track| {
        let Some(pose) = track.first_pose else { return Ok(()) };
        let mut known = Track { unknown: Vec::new(), ..track.clone() };
        known.cut(Cut { horizon_s, most_segments: usize::MAX });
        let mut starts = rollout::guess(&known, GUESS * horizon_s);
        let (rolled, _) = rollout::refine(plant, &known, &mut starts, &[], REFINED);
        let followed = follow(plant, track).readings;
        let mut moved = vec![0.0; known.segments.len()];
        for draw in 0..DRAWS {
            let drawn = drawn(track, &followed, noise, draw);
            let other = torque(robot, track, pose, &follow(plant, &drawn).motion)?;
            for (sum, one) in moved.iter_mut().zip(differences(plant, &known, &rolled.readings, &starts, other)) {
                *sum += one / DRAWS as f64;
            }
        }
        track.unknown = vec![false; track.t.len()];
        for (segment, moved) in known.segments.iter().zip(moved) {
            if moved > MOST * noise * known.read(segment) {
                track.unknown[segment.first..segment.last].fill(true);
            }
        }
        Ok(())
    })
}

/// The run with its readings drawn anew about what they are followed as.
fn drawn(track: &Track, followed: &[f64], noise: f64, draw: u64) -> Track {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(track.place as u64 * DRAWS + draw);
    let mut scatter = || Normal::new(0.0, noise.sqrt()).map_or(0.0, |normal| normal.sample(&mut random));
    let angle = |(read, followed): (&f64, &f64)| if read.is_nan() { f64::NAN } else { followed + scatter() };
    Track { angle: track.angle.iter().zip(followed).map(angle).collect(), ..track.clone() }
}

/// Sum of squares by which each rollout under another torque of the body misses readings, rad², its start refitted to them.
fn differences(plant: &Plant, known: &Track, readings: &[f64], starts: &[[f64; 2]], load_torque: Vec<f64>) -> Vec<f64> {
    let mut other = Track { load_torque, ..known.clone() };
    let mut place = 0;
    for segment in &known.segments {
        let length = segment.last - segment.first;
        other.angle[segment.first..segment.last].copy_from_slice(&readings[place..place + length]);
        place += length;
    }
    rollout::refine(plant, &other, &mut starts.to_vec(), &[], REFINED).1
}

#[cfg(test)]
pub fn scratch(plant: &Plant, track: &Track, noise: f64) -> (Vec<ShaftMotion>, Vec<ShaftMotion>) {
    let followed = follow(plant, track);
    let drawn = drawn(track, &followed.readings, noise, 1);
    (followed.motion, follow(plant, &drawn).motion)
}

#[cfg(test)]
pub fn scratch_torque(robot: &Robot, track: &Track, motion: &[ShaftMotion]) -> Vec<f64> {
    torque(robot, track, track.first_pose.unwrap(), motion).unwrap()
}
