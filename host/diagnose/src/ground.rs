//! A robot on the ground: the body that its shaft shakes pulls at the shaft.
//!
//! A recording with a pose is of a robot that walks. The file's body is moved by the shaft's own motion, as a model of the shaft
//! follows the readings, from rest in the recording's first pose; the torque that this takes goes into the model of the shaft as a known
//! one, sample by sample. A body that is another than the file's is a misfit like any other.

use std::f64::consts::TAU;

use hal_sim::body::plan::PlanError;
use hal_sim::body::{Drive, Ensemble, Plan, Settings};
use rayon::prelude::*;
use robot_file::robot::Robot;

use super::DiagnoseError;
use super::model::Plant;
use super::rollout;
use super::track::{Cut, Track};
use common::wrap;

/// Length of the rollouts that the motion is put together from, s.
const ROLLOUT_S: f64 = 0.1;
/// Readings whose parabola is the first guess of a rollout's start, s.
const GUESS_S: f64 = 0.025;
/// Times that the starts are refined.
const REFINED: usize = 3;

/// Works out anew how the body pulls at the shaft in those runs that are on the ground.
///
/// # Errors
/// The file has no body, or one that cannot be built.
pub fn pull(robot: &Robot, plant: &Plant, tracks: &mut [Track]) -> Result<(), DiagnoseError> {
    tracks.par_iter_mut().try_for_each(|track| {
        let Some(pose) = track.first_pose else { return Ok(()) };
        let refused = |error: PlanError| DiagnoseError::Recording {
            run: track.name.clone(),
            problem: format!("it has a pose, and the file's body cannot be simulated: {error}"),
            help: "give the file a [body], or leave the columns x_m, y_m and yaw_rad out for a shaft on a bench"
                .to_owned(),
        };
        let plan = Plan::new(robot).map_err(refused)?;
        let mut body = Ensemble::new(&[plan], Settings::default()).map_err(refused)?;
        let motion = motion(plant, track);
        put(&mut body, pose, motion[0].angle);
        let rotor_inertia = robot.motor.rotor_inertia_kg_m2.value / robot.motor.gear_ratio.value;
        track.load_torque = shaken(&mut body, &track.t, &motion, rotor_inertia);
        Ok(())
    })
}

/// The shaft at a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ShaftMotion {
    /// Angle, rad, not wrapped.
    angle: f64,
    /// Speed, rad/s.
    speed: f64,
    /// Acceleration, rad/s².
    acceleration: f64,
}

/// How the shaft moves through a whole run: rollouts of a model, from starts that suit the readings, end to end.
fn motion(plant: &Plant, track: &Track) -> Vec<ShaftMotion> {
    let mut whole = track.clone();
    whole.cut(Cut { horizon_s: ROLLOUT_S, most_segments: usize::MAX });
    let mut starts = vec![rollout::guess(&whole, GUESS_S)];
    let tracks = [whole];
    let rolled = rollout::refine_all(plant, &tracks, &mut starts, &[], REFINED);
    let (whole, rolled) = (&tracks[0], &rolled[0].0);
    let mut angles = vec![f64::NAN; whole.t.len()];
    let mut first = 0;
    let mut reached: Option<f64> = None;
    for (segment, end) in whole.segments.iter().zip(&rolled.ends) {
        let length = segment.last - segment.first;
        let from = rolled.wipers[first];
        // Readings tell an angle but for whole turns.
        let turns = reached.map_or(0.0, |reached| TAU * ((reached - from) / TAU).round());
        for (k, wiper) in (segment.first..segment.last).zip(&rolled.wipers[first..]) {
            angles[k] = wiper + turns;
        }
        reached = Some(end[0] + turns);
        first += length;
    }
    level_joints(&mut angles, whole);
    fill(&mut angles, &whole.t);
    differentiated(&whole.t, &angles)
}

/// Leads each rollout's end to where the next one begins: they are off by what their starts are uncertain.
fn level_joints(angles: &mut [f64], track: &Track) {
    for pair in track.segments.windows(2).filter(|pair| pair[1].linked && pair[1].first >= 2) {
        let (first, last) = (pair[0].first, pair[1].first);
        // Where the rollout would be at the next one's first sample, at its last speed.
        let led_to = 2.0 * angles[last - 1] - angles[last - 2];
        let off = wrap(angles[last] - led_to);
        for (i, angle) in angles[first..last].iter_mut().enumerate() {
            *angle += off * i as f64 / (last - first) as f64;
        }
    }
}

/// Fills holes at constant speed; before the first rollout and after the last one the shaft stands.
fn fill(angles: &mut [f64], t: &[f64]) {
    let known: Vec<usize> = (0..angles.len()).filter(|&k| angles[k].is_finite()).collect();
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else {
        angles.fill(0.0);
        return;
    };
    let [begins, ends] = [angles[first], angles[last]];
    angles[..first].fill(begins);
    angles[last..].fill(ends);
    for pair in known.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        for k in from + 1..to {
            let share = (t[k] - t[from]) / (t[to] - t[from]);
            angles[k] = angles[from] + share * (angles[to] - angles[from]);
        }
    }
}

/// Speeds and accelerations by differences over the two neighbours.
fn differentiated(t: &[f64], angles: &[f64]) -> Vec<ShaftMotion> {
    let slope = |values: &[f64], k: usize| {
        let (from, to) = (k.saturating_sub(1), (k + 1).min(t.len() - 1));
        (values[to] - values[from]) / (t[to] - t[from])
    };
    let speeds: Vec<f64> = (0..t.len()).map(|k| slope(angles, k)).collect();
    let at = |k: usize| ShaftMotion { angle: angles[k], speed: speeds[k], acceleration: slope(&speeds, k) };
    (0..t.len()).map(at).collect()
}

/// Puts a body at rest where a recording begins, straight.
fn put(body: &mut Ensemble, pose: [f64; 3], rotor_angle: f64) {
    let mut coordinates = body.coordinates(0);
    let nominal = body.snapshot(0);
    let [x, y, _] = nominal.centroid();
    let turned = pose[2] - nominal.heading();
    let (sin, cos) = turned.sin_cos();
    let [dx, dy] = [coordinates.position[0] - x, coordinates.position[1] - y];
    coordinates.position[0] = pose[0] + cos * dx - sin * dy;
    coordinates.position[1] = pose[1] + sin * dx + cos * dy;
    let ((s, c), [w, i, j, k]) = ((0.5 * turned).sin_cos(), coordinates.orientation);
    coordinates.orientation = [c * w - s * k, c * i - s * j, c * j + s * i, c * k + s * w];
    coordinates.rotor_angle = rotor_angle;
    body.put(0, &coordinates);
}

/// Moves a body by a shaft's motion at times (s); mean torque on the shaft over each span, N·m.
fn shaken(body: &mut Ensemble, t: &[f64], motion: &[ShaftMotion], rotor_inertia: f64) -> Vec<f64> {
    let step = body.step_s();
    let (mut sums, mut counts) = (vec![0.0; t.len()], vec![0.0_f64; t.len()]);
    let (mut k, mut last) = (0, 0.0);
    for i in 0.. {
        let at = t[0] + (f64::from(i) + 0.5) * step;
        while k + 1 < t.len() && at >= t[k + 1] {
            // A span shorter than a step has none of its own.
            if counts[k] == 0.0 {
                (sums[k], counts[k]) = (last, 1.0);
            }
            k += 1;
        }
        if k + 1 >= t.len() {
            break;
        }
        let ShaftMotion { angle, speed, acceleration } = between(&motion[k..k + 2], t[k + 1] - t[k], at - t[k]);
        body.advance(1, &[Drive::Motor { angle, speed, acceleration, rotor_inertia }]);
        last = -body.load_torque(0);
        sums[k] += last;
        counts[k] += 1.0;
    }
    sums.iter().zip(&counts).map(|(sum, count)| sum / count.max(1.0)).collect()
}

/// The motion between two samples: Hermite's cubic through angles and speeds, the acceleration in proportion.
fn between(ends: &[ShaftMotion], span: f64, into: f64) -> ShaftMotion {
    let (from, to, s) = (ends[0], ends[1], into / span);
    let [a, b] = [from.speed, to.speed].map(|speed| speed * span);
    let turned = to.angle - from.angle;
    let (square, cube) = (3.0 * turned - 2.0 * a - b, a + b - 2.0 * turned);
    ShaftMotion {
        angle: from.angle + s * (a + s * (square + s * cube)),
        speed: (a + s * (2.0 * square + 3.0 * s * cube)) / span,
        acceleration: from.acceleration + s * (to.acceleration - from.acceleration),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use control::Actuation;
    use hal_sim::body::WalkingRobots;

    use super::*;

    /// Times (s), shaft angles (rad), and torques of the body on the shaft at the ends of the ticks (N·m) of a walk at full drive.
    fn walked(robot: &Robot, seconds: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut walking = WalkingRobots::alone(robot, 1, &hal_sim::Settings::default()).unwrap();
        let tick = walking.tick_s();
        let (mut t, mut angles, mut torques) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..(seconds / tick) as usize {
            let _ = walking.sample(0);
            let angle = walking.truth(0).angle;
            t.push(f64::from(u32::try_from(i).unwrap()) * tick);
            angles.push(angles.last().map_or(angle, |last| last + wrap(angle - last)));
            walking.advance(&[Actuation { duty: -1.0, enable: true }]);
            torques.push(-walking.load_torque(0));
        }
        (t, angles, torques)
    }

    #[test]
    fn a_body_that_is_moved_as_it_moved_pulls_as_it_pulled() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let robot = Robot::load(&path).unwrap();
        let (t, angles, torques) = walked(&robot, 2.0);
        let mut body = Ensemble::new(&[Plan::new(&robot).unwrap()], Settings::default()).unwrap();
        let nominal = body.snapshot(0);
        let [x, y, _] = nominal.centroid();
        put(&mut body, [x, y, nominal.heading()], angles[0]);
        let rotor_inertia = robot.motor.rotor_inertia_kg_m2.value / robot.motor.gear_ratio.value;
        let again = shaken(&mut body, &t, &differentiated(&t, &angles), rotor_inertia);
        // Where a foot lands the torque jumps within a tick, of which the simulation shows the end and this the mean.
        let mut off: Vec<f64> = (1..t.len()).map(|k| (again[k] - 0.5 * (torques[k] + torques[k - 1])).abs()).collect();
        let size = (torques.iter().map(|torque| torque * torque).sum::<f64>() / torques.len() as f64).sqrt();
        let usual = common::median(&mut off).unwrap();
        assert!(size > 5e-4 && usual < 0.02 * size, "{usual} of {size}");
    }

    #[test]
    fn a_body_begins_in_the_recordings_first_pose() {
        let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
        let mut body = Ensemble::new(&[Plan::new(&robot).unwrap()], Settings::default()).unwrap();
        put(&mut body, [0.3, -0.2, 2.0], 1.0);
        let begun = body.snapshot(0);
        let [x, y, _] = begun.centroid();
        let off = [x - 0.3, y + 0.2, wrap(begun.heading() - 2.0), body.coordinates(0).rotor_angle - 1.0];
        assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
    }
}
