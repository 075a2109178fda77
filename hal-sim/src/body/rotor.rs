//! The eccentric on its module: one hinge about the module's vertical axis, turned by a torque or as told.

use super::algebra::{Sym3, Vec3};
use super::contact::{Motion, add_point_mass};
use super::lanes::{Lanes, Store};
use super::model::RotorRow;
use super::step::Articulated;

/// What turns the eccentrics during a step, and what came of it. Odd lanes do not matter: they have no mass.
#[derive(Clone, Debug)]
pub struct RotorStep<T> {
    /// Cosine and sine of the angle in the step's middle.
    pub direction: [T; 2],
    /// In the step's middle, rad/s.
    pub speed: T,
    /// Given, rad/s².
    pub acceleration: T,
    /// Given, N·m.
    pub torque: T,
    /// Of the torque against the acceleration that is found, kg·m².
    pub damping: T,
    /// 1 where the torque turns it, 0 where it turns as told.
    pub free: T,
    /// Angular momentum of what spins in the gearmotor over `speed`, kg·m².
    pub rotor_inertia: T,
    /// Found, rad/s².
    pub found: T,
    /// On the eccentric, N·m.
    pub found_torque: T,
    /// What the body's motion asks of the shaft: `found_torque` without what the eccentric's own acceleration takes, and
    /// what the spin of the module asks of what spins in the gearmotor, N·m.
    pub load_torque: T,
}

impl<T: Store> RotorStep<T> {
    /// All zero.
    pub fn still() -> Self {
        let zero = T::splat(0.0);
        Self {
            direction: [T::splat(1.0), zero],
            speed: zero,
            acceleration: zero,
            torque: zero,
            damping: zero,
            free: zero,
            rotor_inertia: zero,
            found: zero,
            found_torque: zero,
            load_torque: zero,
        }
    }
}

/// What an eccentric hangs on its link, and how it answers to the link's accelerations.
#[derive(Clone, Copy)]
pub(super) struct Joined<L> {
    /// About the link's origin.
    pub on_link: Articulated<L>,
    /// From the link's origin to the pivot, m.
    pivot: Vec3<L>,
    /// Torque about the shaft for a spin rate of the module, and for an acceleration of the pivot.
    lever: [Vec3<L>; 2],
    /// 1/(inertia and damping), or 0 where it turns as told.
    mobility: L,
    /// Torque about the shaft that the given motion takes.
    needed: L,
    /// Inertia about the shaft.
    inertia: L,
    /// What spins in the gearmotor: torque on the shaft for a spin rate of the module, and that of the given motion.
    gear: Vec3<L>,
    geared: L,
}

impl<L: Lanes> Joined<L> {
    /// No eccentric.
    #[inline(always)]
    pub fn none(zero: L) -> Self {
        let none = Vec3::splat(zero);
        Self {
            on_link: Articulated::nothing(zero),
            pivot: none,
            lever: [none; 2],
            mobility: zero,
            needed: zero,
            inertia: zero,
            gear: none,
            geared: zero,
        }
    }

    /// The eccentric of a link that moves so.
    #[inline(always)]
    pub fn new(token: L::Token, row: &RotorRow<L::Store>, told: &RotorStep<L::Store>, motion: &Motion<L>) -> Self {
        let load = |store: &L::Store| L::load(token, store);
        let (mass, across, axial) = (load(&row.mass), load(&row.across), load(&row.axial));
        let axis = motion.axes.times(Vec3::load(token, &row.axis));
        let zero_angle = motion.axes.times(Vec3::load(token, &row.zero));
        let quarter = axis.cross(zero_angle);
        let [cos, sin] = [load(&told.direction[0]), load(&told.direction[1])];
        let radius = load(&row.radius);
        let arm = zero_angle.fma(radius * cos, quarter.scale(radius * sin));
        let pivot = motion.axes.times(Vec3::load(token, &row.pivot));

        let spun = motion.angular_velocity.cross(pivot);
        let acceleration =
            motion.angular_velocity.cross_add(spun, motion.angular_acceleration.cross_add(pivot, motion.acceleration));
        let (speed, given) = (load(&told.speed), load(&told.acceleration));
        let turning = axis.scale(speed);
        let angular_velocity = motion.angular_velocity + turning;
        let angular_acceleration =
            motion.angular_velocity.cross_add(turning, axis.fma(given, motion.angular_acceleration));
        let swing =
            angular_velocity.cross_add(angular_velocity.cross(arm), angular_acceleration.cross_add(arm, acceleration));
        let force = swing.scale(mass);
        let own = Sym3::splat(L::splat(token, 0.0)).add_diagonal(across).add_outer(axial - across, axis);
        let torque = arm
            .cross_add(force, angular_velocity.cross_add(own.times(angular_velocity), own.times(angular_acceleration)));

        let mut rotor = Articulated::nothing(L::splat(token, 0.0));
        rotor.moment = own;
        add_point_mass(mass, arm, &mut rotor.moment, &mut rotor.coupling, &mut rotor.mass);
        let inertia = (mass * radius).fma(radius, axial);
        let lever = [axis.scale(inertia), axis.cross(arm).scale(mass)];
        let needed = axis.dot(torque);
        let one = L::splat(token, 1.0);
        // Odd lanes have no inertia: 1 instead of 0 in a denominator whose quotient is not used.
        let resisting = inertia + load(&told.damping);
        let mobility = load(&told.free) / resisting.if_positive(resisting, one);
        let answer = (load(&told.torque) - needed) * mobility;
        rotor.moment = rotor.moment.add_outer(-mobility, lever[0]);
        rotor.mass = rotor.mass.add_outer(-mobility, lever[1]);
        rotor.coupling = rotor.coupling.add_outer(lever[0], lever[1].scale(-mobility));
        rotor.torque = lever[0].fma(answer, torque);
        rotor.force = lever[1].fma(answer, force);
        // What spins in the gearmotor takes its torque from the module.
        let inside = turning.scale(load(&told.rotor_inertia));
        let inside_rate = axis.scale(given * load(&told.rotor_inertia));
        let mut on_link = rotor.shifted(pivot);
        on_link.torque = on_link.torque + motion.angular_velocity.cross_add(inside, inside_rate);
        let gear = axis.scale(load(&told.rotor_inertia));
        let geared = gear.dot(motion.angular_acceleration);
        Self { on_link, pivot, lever, mobility, needed, inertia, gear, geared }
    }

    /// Writes what the eccentric does, the link's accelerations being found.
    #[inline(always)]
    pub fn respond(
        &self,
        token: L::Token,
        acceleration: Vec3<L>,
        angular_acceleration: Vec3<L>,
        step: &mut RotorStep<L::Store>,
    ) {
        let load = |store: &L::Store| L::load(token, store);
        let at_pivot = angular_acceleration.cross_add(self.pivot, acceleration);
        let shaken = self.lever[0].dot(angular_acceleration) + self.lever[1].dot(at_pivot);
        let given = load(&step.acceleration);
        let gained = (load(&step.torque) - self.needed - shaken) * self.mobility;
        let (found, torque) = (given + gained, self.inertia.fma(gained, self.needed + shaken));
        step.found = found.store();
        step.found_torque = torque.store();
        step.load_torque = (torque - self.inertia * found + self.geared + self.gear.dot(angular_acceleration)).store();
    }
}
