//! Bodies that are moved by motions of their shafts.

use hal_sim::body::plan::PlanError;
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings, rotor_inertia};
use robot_file::robot::Robot;

use super::motion::ShaftMotion;

/// Bodies of one robot whose shafts are moved.
pub struct DrivenBodies<'a> {
    bodies: Ensemble,
    /// When samples were taken, s.
    t: &'a [f64],
    /// See [`rotor_inertia`], kg·m².
    rotor_inertia: f64,
    /// Steps that were taken.
    steps: u32,
    /// Sample that they have come to.
    at: usize,
    /// Torque of each body on the shaft in its last step, N·m.
    torques: Vec<f64>,
}

impl<'a> DrivenBodies<'a> {
    /// So many bodies, straight and at rest in a pose, where a run begins.
    ///
    /// # Errors
    /// The file has no body, or one that cannot be built.
    pub fn new(robot: &Robot, t: &'a [f64], pose: [f64; 3], count: usize) -> Result<Self, PlanError> {
        // Twice as fast where the processor has the registers for it; three sets of walks were left as near to their noise as in double.
        let settings = Settings { precision: Precision::Single, ..Settings::default() };
        let mut bodies = Ensemble::new(&vec![Plan::new(robot)?; count], settings)?;
        for i in 0..count {
            put(&mut bodies, i, pose);
        }
        Ok(Self { bodies, t, rotor_inertia: rotor_inertia(&robot.motor), steps: 0, at: 0, torques: vec![0.0; count] })
    }

    /// Moves them on to a sample by motions of their shafts, by sample; each body's mean torque on the shaft over each span between samples
    /// until there, N·m.
    pub fn advance(&mut self, sample: usize, motions: &[Vec<ShaftMotion>]) -> Vec<Vec<f64>> {
        let step = self.bodies.step_s();
        let mut means = vec![Vec::with_capacity(sample.saturating_sub(self.at)); motions.len()];
        while self.at < sample.min(self.t.len() - 1) {
            let (from, to) = (self.t[self.at], self.t[self.at + 1]);
            let (mut sums, mut count) = (vec![0.0; motions.len()], 0.0);
            loop {
                let time = self.t[0] + (f64::from(self.steps) + 0.5) * step;
                if time >= to {
                    break;
                }
                let now = |motion: &Vec<ShaftMotion>| between(&motion[self.at..self.at + 2], to - from, time - from);
                let now: Vec<ShaftMotion> = motions.iter().map(now).collect();
                self.step(&now);
                sums.iter_mut().zip(&self.torques).for_each(|(sum, torque)| *sum += torque);
                count += 1.0;
            }
            for (i, mean) in means.iter_mut().enumerate() {
                // A span shorter than a step has none of its own.
                mean.push(if count > 0.0 { sums[i] / count } else { self.torques[i] });
            }
            self.at += 1;
        }
        means
    }

    fn step(&mut self, motions: &[ShaftMotion]) {
        let drive = |motion: &ShaftMotion| Drive::Motor {
            angle: motion.angle,
            speed: motion.speed,
            acceleration: motion.acceleration,
            rotor_inertia: self.rotor_inertia,
        };
        let drives: Vec<Drive> = motions.iter().map(drive).collect();
        self.bodies.advance(1, &drives);
        self.steps += 1;
        for (i, torque) in self.torques.iter_mut().enumerate() {
            *torque = -self.bodies.load_torque(i);
        }
    }

    /// Each body goes on as another one, which goes on as itself.
    pub fn go_on_from(&mut self, others: &[usize]) {
        for (i, &other) in others.iter().enumerate().filter(|(i, other)| i != *other) {
            self.bodies.copy(i, other);
            self.torques[i] = self.torques[other];
        }
    }
}

/// Puts a body in its nominal pose where it has another one: x and y, m, and heading, rad.
fn put(bodies: &mut Ensemble, body: usize, pose: [f64; 3]) {
    let ([x, y, heading], nominal) = (pose, bodies.snapshot(body));
    let turn = heading - nominal.heading();
    let carried = bodies.coordinates(body).carried(turn, nominal.displacement_to([x, y], turn));
    bodies.put(body, &carried);
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

    use common::wrap;

    use super::super::motion::differentiated;
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
        let nominal = Ensemble::new(&[Plan::new(&robot).unwrap()], Settings::default()).unwrap().snapshot(0);
        let [x, y, _] = nominal.centroid();
        let motions = [differentiated(&t, &angles)];
        let mut body = DrivenBodies::new(&robot, &t, [x, y, nominal.heading()], 1).unwrap();
        let again = body.advance(t.len() - 1, &motions).swap_remove(0);
        // Where a foot lands the torque jumps within a tick, of which the simulation shows the end and this the mean.
        let mut off: Vec<f64> =
            (1..again.len()).map(|k| (again[k] - 0.5 * (torques[k] + torques[k - 1])).abs()).collect();
        let size = (torques.iter().map(|torque| torque * torque).sum::<f64>() / torques.len() as f64).sqrt();
        let usual = common::median(&mut off).unwrap();
        assert!(size > 5e-4 && usual < 0.02 * size, "{usual} of {size}");
    }

    #[test]
    fn a_body_begins_in_the_recordings_first_pose() {
        let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
        let mut body = Ensemble::new(&[Plan::new(&robot).unwrap()], Settings::default()).unwrap();
        put(&mut body, 0, [0.3, -0.2, 2.0]);
        let begun = body.snapshot(0);
        let [x, y, _] = begun.centroid();
        let off = [x - 0.3, y + 0.2, wrap(begun.heading() - 2.0)];
        assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
    }
}
