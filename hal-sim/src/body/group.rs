//! As many bodies as fit into the lanes.

use std::fmt::Debug;

use fearless_simd::Simd;

use super::coordinates::Coordinates;
use super::drive::Drive;
use super::lanes::{Kind, Store};
use super::model::{BodyState, Model, RotorState, State};
use super::plan::Plan;
use super::rotor::RotorStep;
use super::skeleton::{Skeleton, Vector};
use super::step::{Scratch, advance};

/// Bodies that share the lanes of one register.
pub(super) trait Group: Debug + Send + Sync {
    /// A copy.
    fn boxed_clone(&self) -> Box<dyn Group>;
    /// Advances all bodies by `steps` steps.
    fn advance(&mut self, steps: usize, drives: &[Drive]);
    /// Where a body is.
    fn coordinates(&self, body: usize) -> Coordinates;
    /// Puts a body somewhere.
    fn put(&mut self, body: usize, coordinates: &Coordinates);
    /// All that a body has.
    fn state(&self, body: usize) -> BodyState;
    /// Makes a body what one of the same shape is.
    fn set_state(&mut self, body: usize, to: &BodyState);
    /// Sets another body in the place of one, at rest in its nominal pose; `plans` are all bodies', the new one's in its place.
    fn replace(&mut self, body: usize, plans: &[Plan]);
    /// A body's eccentric.
    fn rotor(&self, body: usize) -> RotorState;
    /// Forces on a body's feet, module by module, left and right, N.
    fn foot_forces(&self, body: usize) -> Vec<[Vector; 2]>;
    /// Steps since the start.
    fn steps(&self) -> u64;
    /// A body's skeleton.
    fn skeleton(&self, body: usize) -> &Skeleton;
}

/// See [`Group`].
#[derive(Clone, Debug)]
pub(super) struct Lanewise<K: Kind, S> {
    model: Model<K>,
    state: State<K>,
    scratch: Scratch<K>,
    rotor: RotorStep<K::Store>,
    skeletons: Vec<Skeleton>,
    simd: S,
}

impl<K: Kind, S: Simd> Lanewise<K, S> {
    /// Up to `K::BODIES` plans.
    pub fn new(simd: S, plans: &[Plan], step: f64) -> Self {
        let model = Model::new(plans, step);
        let skeletons: Vec<_> = plans.iter().map(Skeleton::new).collect();
        let coordinates: Vec<_> = plans.iter().map(Coordinates::nominal).collect();
        let state = State::new(&model, &skeletons, &coordinates);
        let scratch = Scratch::new(&model);
        Self { model, state, scratch, rotor: RotorStep::still(), skeletons, simd }
    }

    /// Advances every body by `steps` steps.
    #[inline(always)]
    fn run(&mut self, steps: usize, drives: &[Drive]) {
        for _ in 0..steps {
            self.tell(drives);
            advance(self.simd, &self.model, &mut self.state, &mut self.scratch, &mut self.rotor);
            self.turn(drives);
        }
    }

    /// The eccentrics' motion in the middle of the coming step.
    #[inline(always)]
    fn tell(&mut self, drives: &[Drive]) {
        let (step, half) = (self.model.step, 0.5 * self.model.step);
        let start = self.state.steps as f64 * step;
        for (body, rotor) in self.state.rotors.iter_mut().enumerate() {
            let lane = 2 * body;
            let told = prescribed_motion(&drives[body.min(drives.len() - 1)], rotor, start, half);
            let (sin, cos) = told.angle.sin_cos();
            self.rotor.direction[0].set(lane, cos);
            self.rotor.direction[1].set(lane, sin);
            self.rotor.speed.set(lane, told.speed);
            self.rotor.acceleration.set(lane, told.acceleration);
            self.rotor.torque.set(lane, told.torque);
            self.rotor.damping.set(lane, told.damping);
            self.rotor.free.set(lane, f64::from(u8::from(told.free)));
            self.rotor.rotor_inertia.set(lane, told.rotor_inertia);
        }
    }

    /// What came of the step for the eccentrics.
    #[inline(always)]
    fn turn(&mut self, drives: &[Drive]) {
        let step = self.model.step;
        let end = self.state.steps as f64 * step;
        for (body, rotor) in self.state.rotors.iter_mut().enumerate() {
            let lane = 2 * body;
            rotor.acceleration = self.rotor.found.get(lane);
            rotor.torque = self.rotor.found_torque.get(lane);
            rotor.load_torque = self.rotor.load_torque.get(lane);
            match drives[body.min(drives.len() - 1)] {
                Drive::Phase { speed } => (rotor.angle, rotor.speed) = (speed * end, speed),
                Drive::Servo { .. } => {
                    let before = rotor.speed;
                    rotor.speed += step * rotor.acceleration;
                    rotor.angle += 0.5 * step * (before + rotor.speed);
                }
                Drive::Motor { angle, speed, acceleration, .. } => {
                    rotor.angle = angle + 0.5 * step * speed;
                    rotor.speed = speed + 0.5 * step * acceleration;
                }
            }
        }
    }
}

/// An eccentric's motion in the middle of a step.
struct PrescribedMotion {
    angle: f64,
    speed: f64,
    acceleration: f64,
    torque: f64,
    damping: f64,
    free: bool,
    rotor_inertia: f64,
}

/// `start` is the step's, s; `half` is half of it, s.
#[inline(always)]
fn prescribed_motion(drive: &Drive, rotor: &RotorState, start: f64, half: f64) -> PrescribedMotion {
    let at_rest = PrescribedMotion {
        angle: 0.0,
        speed: 0.0,
        acceleration: 0.0,
        torque: 0.0,
        damping: 0.0,
        free: false,
        rotor_inertia: 0.0,
    };
    match *drive {
        Drive::Phase { speed } => PrescribedMotion { angle: speed * (start + half), speed, ..at_rest },
        Drive::Servo { speed, stiffness, damping } => {
            let angle = rotor.angle + half * rotor.speed;
            PrescribedMotion {
                angle,
                speed: rotor.speed + half * rotor.acceleration,
                torque: stiffness * (speed * (start + half) - angle) + damping * (speed - rotor.speed),
                damping: half * damping,
                free: true,
                ..at_rest
            }
        }
        Drive::Motor { angle, speed, acceleration, rotor_inertia } => {
            PrescribedMotion { angle, speed, acceleration, rotor_inertia, ..at_rest }
        }
    }
}

impl<K: Kind, S: Simd> Group for Lanewise<K, S> {
    fn boxed_clone(&self) -> Box<dyn Group> {
        Box::new(self.clone())
    }

    fn advance(&mut self, steps: usize, drives: &[Drive]) {
        self.simd.vectorize(
            #[inline(always)]
            || self.run(steps, drives),
        );
    }

    fn coordinates(&self, body: usize) -> Coordinates {
        self.state.coordinates(body, &self.skeletons[body])
    }

    fn put(&mut self, body: usize, coordinates: &Coordinates) {
        self.state.put(body, &self.skeletons[body], coordinates);
    }

    fn state(&self, body: usize) -> BodyState {
        self.state.body(body)
    }

    fn set_state(&mut self, body: usize, to: &BodyState) {
        self.state.set_body(body, to);
    }

    fn replace(&mut self, body: usize, plans: &[Plan]) {
        // Constants stand in rows over all lanes: they are made anew, for the others as they were.
        let fresh = Self::new(self.simd, plans, self.model.step);
        // Lanes that are left over repeat the last body.
        let lanes = 2 * body..if body + 1 == plans.len() { K::Store::WIDTH } else { 2 * body + 2 };
        let mut state = self.state.clone();
        state.take_lanes(&fresh.state, lanes);
        *self = Self { state, ..fresh };
    }

    fn rotor(&self, body: usize) -> RotorState {
        self.state.rotors[body]
    }

    fn foot_forces(&self, body: usize) -> Vec<[Vector; 2]> {
        let skeleton = &self.skeletons[body];
        let mut forces = vec![[[0.0; 3]; 2]; modules(skeleton)];
        let mut take = |set: Option<usize>, module: Option<(usize, Vector)>, lane: usize| {
            let (Some(set), Some((index, _))) = (set, module) else { return };
            forces[index] = self.state.feet[set].map(|foot| [0, 1, 2].map(|axis| foot.force[axis].get(lane)));
        };
        take(self.model.base.feet, skeleton.base.module, 2 * body);
        for (side, arm) in skeleton.arms.iter().enumerate() {
            for (link, index) in arm.iter().zip(&self.model.arm) {
                take(self.model.links[*index].feet, link.module, 2 * body + side);
            }
        }
        forces
    }

    fn steps(&self) -> u64 {
        self.state.steps
    }

    fn skeleton(&self, body: usize) -> &Skeleton {
        &self.skeletons[body]
    }
}

fn modules(skeleton: &Skeleton) -> usize {
    let links = skeleton.arms.iter().flatten().chain([&skeleton.base]);
    links.filter_map(|link| link.module.map(|(index, _)| index + 1)).max().unwrap_or(0)
}
