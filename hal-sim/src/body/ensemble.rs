//! Many bodies of one shape, advanced side by side.

use super::coordinates::{Balance, Coordinates};
use super::drive::Drive;
use super::group::{Group, Lanewise};
use super::lanes::{EightSingle, FourDouble, FourSingle, Kind, OneDouble, TwoDouble};
use super::plan::{Plan, PlanError};
use super::snapshot::{Foot, Rotor, Snapshot};
use super::stability;
use fearless_simd::{Level, Simd};

/// With how many digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Precision {
    /// 53 bits.
    #[default]
    Double,
    /// 24 bits: twice as fast in a batch, for sweeps.
    Single,
}

/// How bodies are advanced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Integration step, s.
    pub step_s: f64,
    /// With how many digits.
    pub precision: Precision,
}

impl Default for Settings {
    /// The thesis's 0.1 ms.
    fn default() -> Self {
        Self { step_s: 1e-4, precision: Precision::Double }
    }
}

/// Bodies of one shape (the same modules, segments and clamp; everything else may differ). A value: cloned and sent to
/// threads freely; what a body does depends neither on the others nor on how many there are.
#[derive(Debug)]
pub struct Ensemble {
    plans: Vec<Plan>,
    groups: Vec<Box<dyn Group>>,
    /// Bodies in every group but the last.
    together: usize,
    step_s: f64,
    /// Whether a servo's eccentric has been brought to its speed: the reference's runs begin so.
    started: bool,
}

impl Clone for Ensemble {
    fn clone(&self) -> Self {
        Self {
            plans: self.plans.clone(),
            groups: self.groups.iter().map(|group| group.boxed_clone()).collect(),
            ..*self
        }
    }
}

impl Ensemble {
    /// Bodies at rest in their nominal poses, the eccentric at angle 0 (and, with a servo, at its speed from the start).
    ///
    /// # Errors
    /// There is no plan, one is no body, they differ in shape, or the step is too long for a spring of one of them.
    pub fn new(plans: &[Plan], settings: Settings) -> Result<Self, PlanError> {
        plans.iter().try_for_each(Plan::check)?;
        same_shape(plans.iter())?;
        plans.iter().try_for_each(|plan| stability::check(plan, settings.step_s))?;
        let (groups, together) = groups(plans, settings);
        Ok(Self { plans: plans.to_vec(), groups, together, step_s: settings.step_s, started: false })
    }

    /// How many bodies.
    #[must_use]
    pub fn len(&self) -> usize {
        self.plans.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.plans.is_empty()
    }

    /// What they are made of.
    #[must_use]
    pub fn plans(&self) -> &[Plan] {
        &self.plans
    }

    /// The step, s.
    #[must_use]
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Since the start, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.groups.first().map_or(0.0, |group| group.steps() as f64 * self.step_s)
    }

    /// Advances every body by `steps` steps with its own drive.
    ///
    /// # Panics
    /// If there are not as many drives as bodies.
    pub fn advance(&mut self, steps: usize, drives: &[Drive]) {
        assert_eq!(drives.len(), self.plans.len(), "a drive for each body");
        if !self.started {
            self.started = true;
            self.spin_up(drives);
        }
        for (group, drives) in self.groups.iter_mut().zip(drives.chunks(self.together)) {
            group.advance(steps, drives);
        }
    }

    /// A servo's eccentric starts at its speed: one that starts from rest kicks.
    fn spin_up(&mut self, drives: &[Drive]) {
        for (body, drive) in drives.iter().enumerate() {
            if let Drive::Servo { speed, .. } = drive {
                let mut coordinates = self.coordinates(body);
                coordinates.rotor_speed = *speed;
                self.put(body, &coordinates);
            }
        }
    }

    /// Torque that the shaft must give the eccentric of body `i` for its present motion, without what the shaft's own
    /// acceleration takes, N·m: what a motor feels of the body.
    #[must_use]
    pub fn load_torque(&self, i: usize) -> f64 {
        self.groups[i / self.together].rotor(i % self.together).load_torque
    }

    /// Where body `i` is and how it moves.
    #[must_use]
    pub fn coordinates(&self, i: usize) -> Coordinates {
        self.groups[i / self.together].coordinates(i % self.together)
    }

    /// Puts body `i` somewhere.
    pub fn put(&mut self, i: usize, coordinates: &Coordinates) {
        self.groups[i / self.together].put(i % self.together, coordinates);
    }

    /// Makes body `i` what body `other` is, of the same plan: where it is, how it moves, and how its feet hold.
    pub fn copy(&mut self, i: usize, other: usize) {
        let state = self.groups[other / self.together].state(other % self.together);
        self.groups[i / self.together].set_state(i % self.together, &state);
    }

    /// Sets another body in the place of body `i`, at rest in its nominal pose, the eccentric at angle 0. What the others do does
    /// not change in a bit.
    ///
    /// # Errors
    /// The plan is no body, differs from the others in shape or in whether there is contact, or the step is too long for one of its springs.
    pub fn replace(&mut self, i: usize, plan: Plan) -> Result<(), PlanError> {
        plan.check()?;
        same_shape([&self.plans[0], &plan])?;
        if plan.contact.is_some() != self.plans[i].contact.is_some() {
            let what = "a body that takes another's place needs contact where that had it".into();
            return Err(PlanError::Field { field: "feet", what });
        }
        stability::check(&plan, self.step_s)?;
        self.plans[i] = plan;
        let group = i / self.together;
        let first = group * self.together;
        let last = self.plans.len().min(first + self.together);
        self.groups[group].replace(i - first, &self.plans[first..last]);
        Ok(())
    }

    /// Energies and momenta of body `i`.
    #[must_use]
    pub fn balance(&self, i: usize) -> Balance {
        let group = &self.groups[i / self.together];
        self.coordinates(i).balance(&self.plans[i], group.skeleton(i % self.together))
    }

    /// What really is with body `i`.
    #[must_use]
    pub fn snapshot(&self, i: usize) -> Snapshot {
        let (group, body) = (&self.groups[i / self.together], i % self.together);
        let plan = &self.plans[i];
        let coordinates = group.coordinates(body);
        let parts = coordinates.parts(plan, group.skeleton(body));
        let forces = group.foot_forces(body);
        let feet = parts.modules.iter().zip(&plan.modules).zip(&forces).flat_map(|((moving, module), forces)| {
            [0, 1].map(|side| {
                let centre = moving.point(module.feet[side]);
                Foot { position: centre.position, velocity: centre.velocity, force: forces[side] }
            })
        });
        let rotor = parts.bolt.map(|bolt| Rotor {
            angle: coordinates.rotor_angle,
            speed: coordinates.rotor_speed,
            bolt: bolt.position,
            torque: group.rotor(body).torque,
        });
        Snapshot {
            time_s: self.time_s(),
            modules: parts.modules.iter().map(super::coordinates::Moving::pose).collect(),
            segments: parts.segments.iter().map(super::coordinates::Moving::pose).collect(),
            feet: feet.collect(),
            rotor,
        }
    }
}

/// The bodies in groups as wide as this processor's registers, and how many are in one.
fn groups(plans: &[Plan], settings: Settings) -> (Vec<Box<dyn Group>>, usize) {
    let step = settings.step_s;
    #[cfg(target_arch = "x86_64")]
    {
        use Precision::{Double, Single};
        let (level, many) = (Level::new(), plans.len() > 1);
        if let Some(simd) = level.as_avx512() {
            return match settings.precision {
                Single => grouped::<EightSingle, _>(simd, plans, step),
                Double if many => grouped::<FourDouble, _>(simd, plans, step),
                Double => grouped::<OneDouble, _>(simd, plans, step),
            };
        }
        if let Some(simd) = level.as_avx2() {
            return match settings.precision {
                Single => grouped::<FourSingle, _>(simd, plans, step),
                Double if many => grouped::<TwoDouble, _>(simd, plans, step),
                Double => grouped::<OneDouble, _>(simd, plans, step),
            };
        }
    }
    // Registers of 128 bits: in single precision nothing would be gained that is worth another copy of everything.
    fearless_simd::dispatch!(Level::baseline(), simd => grouped::<OneDouble, _>(simd, plans, step))
}

fn grouped<K: Kind, S: Simd>(simd: S, plans: &[Plan], step: f64) -> (Vec<Box<dyn Group>>, usize) {
    let group = |plans: &[Plan]| Box::new(Lanewise::<K, S>::new(simd, plans, step)) as Box<dyn Group>;
    (plans.chunks(K::BODIES).map(group).collect(), K::BODIES)
}

fn same_shape<'a>(plans: impl IntoIterator<Item = &'a Plan>) -> Result<(), PlanError> {
    let wrong = |field, what: &str| Err(PlanError::Field { field, what: what.into() });
    let mut plans = plans.into_iter();
    let Some(first) = plans.next() else { return wrong("body", "there is no body to advance") };
    for plan in plans {
        let segments = |plan: &Plan| plan.backbones.iter().map(|b| b.segments).collect::<Vec<_>>();
        if segments(plan) != segments(first) {
            return wrong(
                "backbone.segments",
                "bodies that are advanced together must have the same modules and segments",
            );
        }
        if plan.clamped != first.clamped {
            return wrong("body.clamped_module", "bodies that are advanced together must be clamped alike");
        }
        if plan.eccentric.is_some() != first.eccentric.is_some() {
            return wrong("eccentric", "of bodies that are advanced together all or none must have one");
        }
    }
    Ok(())
}
