//! The body of a run, of many that the readings allow: a particle filter (Gordon, Salmond and Smith, Novel approach to
//! nonlinear/non-Gaussian Bayesian state estimation, 1993).
//!
//! Each particle is a body that is moved by what the readings, drawn anew, are followed as by one of the models of the shaft that a fit
//! allows: an error of the sensor's curve is in no scatter of readings. After each rollout the torques of all particles are compared by how
//! well a model of the shaft then meets the readings, and those that meet them worse go on from where the better ones are. Bodies that always
//! go on from where they are tell how well the readings determine the walk at all.

use hal_sim::body::plan::PlanError;
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use robot_file::robot::Robot;

use super::super::model::{Hidden, Plant};
use super::super::rollout::{self, Normal2};
use super::super::track::{Cut, GAP, Segment, Track};
use super::body::DrivenBodies;
use super::motion::{Followed, ShaftMotion, follow};
use common::wrap;

/// Bodies that are moved: twice as many left as much unexplained of three sets of walks.
pub const PARTICLES: usize = 12;
/// Bodies beside them that nobody tells how well they do: enough to tell a spread.
const UNGUIDED: usize = 6;
/// A rollout that these move by more than this share of the noise's variance is left out, and that much of the others may be the body's.
pub const MOST_SPREAD: f64 = 0.1;
/// A gap in time that the shaft is followed through at most, s: in a longer one it turns by a third and more.
const LONGEST_GAP_S: f64 = 0.05;
/// Readings are drawn with this many times their noise, for particles must be where the body is for one to be kept. Three times was about
/// as good.
const INFLATION: f64 = 2.0;
/// Readings whose parabola is the first guess of a rollout's start, as a share of its length.
const GUESS: f64 = 0.25;
/// Times that starts are refined.
const REFINED: usize = 3;

/// How the body pulls at the shaft of a run.
pub struct Pull {
    /// Over each span between samples, N·m.
    pub torque: Vec<f64>,
    /// At which samples the readings hardly say, or were not asked.
    pub unknown: Vec<bool>,
}

/// The pull of the file's body in a run that begins at rest in a pose. The first model of the shaft follows the readings and tells, over
/// rollouts of a length (s) and with the readings' mean square noise (rad²), the particles apart; each of the others moves one by readings
/// that are drawn anew. Where the torque that the run has already suits a rollout better than every particle's, it stays: `seed` draws
/// others each time.
///
/// # Errors
/// The file has no body, or one that cannot be built.
pub fn estimate(
    robot: &Robot,
    plants: &[Plant],
    track: &Track,
    pose: [f64; 3],
    (horizon_s, noise): (f64, f64),
    seed: u64,
) -> Result<Pull, PlanError> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let followed = follow(&plants[0], track);
    let redrawn = |plant| follow(plant, &drawn(track, &followed, noise, &mut random)).motion;
    let mut motions: Vec<Vec<ShaftMotion>> = plants[1..].iter().map(redrawn).collect();
    motions.push(followed.motion);
    let (guided, unguided) = (motions.as_slice(), &motions[..UNGUIDED]);
    let mut particles = DrivenBodies::new(robot, &track.t, pose, guided.len())?;
    let mut free = DrivenBodies::new(robot, &track.t, pose, unguided.len())?;
    let mut rollouts = Rollouts::new(&plants[0], track, horizon_s, noise);
    let mut pull = Pull { torque: Vec::with_capacity(track.t.len()), unknown: vec![true; track.t.len()] };
    // The last one follows the readings as they are.
    let (mut best, end) = (guided.len() - 1, position_lost_at(track));
    for window in 0..rollouts.windows.len() {
        let Segment { first, last, .. } = rollouts.windows[window];
        if last > end {
            break;
        }
        pull.torque.append(&mut particles.advance(first, guided).swap_remove(best));
        let _ = free.advance(first, unguided);
        let torques = particles.advance(last.min(end - 1), guided);
        let misfits: Vec<f64> = torques.iter().map(|torque| rollouts.misfit(window, torque)).collect();
        best = (0..misfits.len()).min_by(|&a, &b| misfits[a].total_cmp(&misfits[b])).unwrap_or(0);
        let known = track.load_torque.get(first..last);
        let known = known.filter(|known| rollouts.misfit(window, known) < misfits[best]);
        pull.torque.extend_from_slice(known.unwrap_or(&torques[best]));
        let torques = free.advance(last.min(end - 1), unguided);
        let left: Vec<DVector<f64>> = torques.iter().map(|torque| rollouts.residuals(window, torque)).collect();
        let is_known = spread(&left) <= MOST_SPREAD * rollouts.track.read(&rollouts.windows[window]);
        pull.unknown[first..last].fill(!is_known);
        particles.go_on_from(&resampled(&misfits, misfits[best], random.random()));
    }
    pull.torque.append(&mut particles.advance(end - 1, guided).swap_remove(best));
    pull.torque.resize(track.t.len(), 0.0);
    Ok(pull)
}

/// The sample from which nothing says where the body is: after a gap in time through which the shaft is not followed.
fn position_lost_at(track: &Track) -> usize {
    let longest = LONGEST_GAP_S.max(GAP * track.usual_step());
    let gap = |k: &usize| track.t[*k] - track.t[k - 1] > longest;
    (1..track.t.len()).find(gap).unwrap_or(track.t.len())
}

/// By how much what particles leave differs from its mean: the mean sum of squares.
fn spread(left: &[DVector<f64>]) -> f64 {
    let count = left.len() as f64;
    let mean = left.iter().sum::<DVector<f64>>() / count;
    left.iter().map(|one| (one - &mean).norm_squared()).sum::<f64>() / count
}

/// The run with its readings drawn anew about what they are followed as, on the turn that each was read on.
fn drawn(track: &Track, followed: &Followed, noise: f64, random: &mut Pcg64Mcg) -> Track {
    let deviation = INFLATION * noise.sqrt();
    let mut scatter = || deviation * Distribution::<f64>::sample(&StandardNormal, random);
    let angle = |(read, followed): (&f64, &f64)| read + wrap(followed - read) + scatter();
    Track { angle: track.angle.iter().zip(&followed.readings).map(angle).collect(), ..track.clone() }
}

/// Which particle each one goes on from, by misfits in units of the noise's variance: systematic resampling (Kitagawa, Monte Carlo filter
/// and smoother, 1996) from a number in 0 to 1, in which those that are taken stay where they are.
fn resampled(misfits: &[f64], least: f64, from: f64) -> Vec<usize> {
    let weights: Vec<f64> = misfits.iter().map(|misfit| (-0.5 * (misfit - least)).exp()).collect();
    let share = weights.iter().sum::<f64>() / weights.len() as f64;
    let upto = |sum: f64| (sum / share - from).ceil().max(0.0) as usize;
    let mut sum = 0.0;
    let taken: Vec<usize> = weights
        .iter()
        .map(|weight| {
            let before = upto(sum);
            sum += weight;
            upto(sum) - before
        })
        .collect();
    let mut spare = taken.iter().enumerate().flat_map(|(i, &count)| std::iter::repeat_n(i, count.saturating_sub(1)));
    taken.iter().enumerate().map(|(i, &count)| if count > 0 { i } else { spare.next().unwrap_or(i) }).collect()
}

/// How well rollouts meet the readings under a torque of the body.
struct Rollouts<'a> {
    plant: &'a Plant,
    /// Mean square of the readings' noise, rad².
    noise: f64,
    /// With one rollout.
    track: Track,
    windows: Vec<Segment>,
    /// As the torque that was known before has them.
    starts: Vec<[f64; 2]>,
    hidden: Vec<Hidden>,
    /// Sensitivity of the readings to the starts, windows end to end: it hardly hangs on the torque.
    columns: [Vec<f64>; 2],
    /// Where each window begins in them.
    places: Vec<usize>,
}

impl<'a> Rollouts<'a> {
    fn new(plant: &'a Plant, track: &Track, horizon_s: f64, noise: f64) -> Self {
        let mut track = Track { pull_unknown: Vec::new(), ..track.clone() };
        track.cut(Cut { horizon_s, most_segments: usize::MAX });
        track.load_torque.resize(track.t.len(), 0.0);
        let mut starts = rollout::guess(&track, GUESS * horizon_s);
        let (rolled, _) = rollout::refine(plant, &track, &mut starts, &[], REFINED);
        let columns = rollout::start_sensitivity(plant, &track, &starts, &rolled);
        let windows = std::mem::take(&mut track.segments);
        let ends = windows.iter().scan(0, |end, window| {
            *end += window.last - window.first;
            Some(*end)
        });
        let places = std::iter::once(0).chain(ends).collect();
        Self { plant, noise, track, windows, starts, hidden: rolled.hidden, columns, places }
    }

    /// Sum of squares that a rollout leaves of the readings under a torque over its samples, in units of the noise's variance.
    fn misfit(&mut self, window: usize, torque: &[f64]) -> f64 {
        let misfit = self.residuals(window, torque).norm_squared();
        // A body that has blown up suits no readings.
        if misfit.is_finite() { misfit } else { f64::MAX }
    }

    /// What a rollout leaves of the readings under a torque over its samples, its start refitted, in standard deviations of the noise.
    fn residuals(&mut self, window: usize, torque: &[f64]) -> DVector<f64> {
        let segment = self.windows[window];
        let track = &mut self.track;
        track.load_torque[segment.first..segment.first + torque.len()].copy_from_slice(torque);
        track.segments = vec![segment];
        let (start, hidden) = ([self.starts[window]], [self.hidden[window]]);
        let rolled = rollout::rollout(self.plant, track, &start, Some(&hidden), false);
        let place = self.places[window];
        let columns = [0, 1].map(|axis| &self.columns[axis][place..place + segment.last - segment.first]);
        let mut left = DVector::from_fn(segment.last - segment.first, |i, _| {
            rollout::residual(track, &segment, segment.first + i, rolled.readings[i])
        });
        let mut normal = Normal2::default();
        let read: Vec<usize> = (0..left.len()).filter(|i| track.weight[segment.first + i] > 0.0).collect();
        for &i in &read {
            normal.add(columns[0][i], columns[1][i], left[i]);
        }
        let step = normal.solve(normal.gradient);
        for &i in &read {
            left[i] -= step[0] * columns[0][i] + step[1] * columns[1][i];
        }
        left / self.noise.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::resampled;

    #[test]
    fn those_that_meet_the_readings_go_on() {
        let alike = resampled(&[7.0; 5], 7.0, 0.3);
        let one = resampled(&[900.0, 400.0, 3.0, 800.0], 3.0, 0.3);
        let half = resampled(&[2.0, 900.0, 2.0, 900.0], 2.0, 0.3);
        assert_eq!((alike, one, half), (vec![0, 1, 2, 3, 4], vec![2; 4], vec![0, 0, 2, 2]));
    }
}
