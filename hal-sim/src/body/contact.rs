//! Feet on the ground.
//!
//! Along the normal, Hunt and Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", 1975:
//! `F = k δ (1 + χ dδ/dt)`, never pulling; k grows with the root of δ as far as a foot carries like a sphere. Along the ground, a spring and damper that slide when together they would exceed
//! `µ F` (Cundall and Strack 1979): the force is continuous in everything, also where a foot lands, lifts, sticks or slides.
//! That keeps the second order of the step; a force with jumps would not. (On steps it is not: the normal turns by 90° in an
//! inner corner.)
//!
//! The damping is implicit: of the contact point's acceleration `a`, `−h/2·D·(a − a_last)` enters the equations of motion,
//! `a_last` being in the predicted velocity already.

use super::algebra::{Mat3, Sym3, Vec3};
use super::lanes::{Lanes, Store};
use super::model::{ContactRow, FeetRow, FootState};
use super::plan::Contact;

/// A link's motion, world frame, origin at its hinges, accelerations without those that are to be found.
#[derive(Clone, Copy)]
pub struct Motion<L> {
    /// Columns: its axes.
    pub axes: Mat3<L>,
    /// Of the origin, m.
    pub position: Vec3<L>,
    /// Of the origin, m/s.
    pub velocity: Vec3<L>,
    /// Angular velocity, world frame, rad/s.
    pub angular_velocity: Vec3<L>,
    /// Of the origin, m/s².
    pub acceleration: Vec3<L>,
    /// Angular acceleration, world frame, rad/s².
    pub angular_acceleration: Vec3<L>,
}

/// What a contact adds to its link: force `force − (g·1 + e·n·nᵀ)·a`, `a` of the point that touches.
#[derive(Clone, Copy, Debug)]
pub struct Touch<T> {
    /// From the link's origin to the point, m.
    pub arm: [T; 3],
    /// Normal of the ground.
    pub normal: [T; 3],
    /// Implicit damping of the shear, as an equivalent mass at the point of contact, kg.
    pub grip: T,
    /// Equivalent mass along the normal beyond `grip`, kg.
    pub excess: T,
    /// Acceleration of the point without what is to be found, m/s².
    pub acceleration: [T; 3],
    /// Force without what is to be found, N.
    pub force: [T; 3],
}

/// Foot `side` of a pair of modules: its force, its new shear, and what it adds to its link.
#[inline(always)]
pub fn touch<L: Lanes>(
    token: L::Token,
    (row, side): (&FeetRow<L::Store>, usize),
    contact: &ContactRow<L::Store>,
    special: Option<&[Option<Contact>]>,
    motion: &Motion<L>,
    half_step: L,
    (state, touch): (&mut FootState<L::Store>, &mut Touch<L::Store>),
) {
    let load = |store: &L::Store| L::load(token, store);
    let (zero, one) = (L::splat(token, 0.0), L::splat(token, 1.0));
    let there = load(&row.there[side]);
    let radius = load(&contact.radius);
    let centre = motion.axes.times(Vec3::load(token, &row.centres[side]));
    let height = motion.position.0[2] + centre.0[2];
    let up = Vec3([zero, zero, one]);
    let (depth, normal) = match special {
        None => (radius - height, up),
        Some(special) => uneven::<L>(token, special, radius, motion.position + centre),
    };
    let depth = depth.max(zero) * there;

    let arm = normal.fma(-radius, centre);
    let velocity = motion.angular_velocity.cross_add(arm, motion.velocity);
    let closing = -velocity.dot(normal);
    let linear = load(&contact.normal_stiffness) * depth;
    let stiffness = match &contact.sphere {
        None => linear,
        Some([share, per_depth]) => {
            let stiffer = (load(per_depth) * depth).sqrt() - one;
            linear * load(share).fma(stiffer, one)
        }
    };
    let rate = load(&contact.normal_damping) * stiffness;
    let pressed = rate.fma(closing, stiffness).max(zero);
    let normal_damping = pressed.if_positive(rate, zero);

    // Sheared by what the point moved between the middles of the last step and this one.
    let along = |v: Vec3<L>| normal.fma(-v.dot(normal), v);
    let moved = along((velocity + Vec3::load(token, &state.velocity)).scale(half_step));
    let before = along(Vec3::load(token, &state.shear));
    let shear = before + moved;
    let damping = load(&contact.shear_damping);
    let sliding = along(velocity);
    let wanted = -sliding.fma(damping, shear.scale(load(&contact.shear_stiffness)));
    let friction = match special {
        None => load(&contact.friction),
        Some(special) => {
            coefficient::<L>(token, special, &contact.friction, motion.position + centre, sliding, pressed)
        }
    } * load(&row.friction_shares[side]);
    let stretched = match &contact.lateral_excess {
        None => wanted,
        Some(excess) => {
            let across = along(motion.axes.times(Vec3::load(token, &row.across)));
            across.fma(load(excess) * wanted.dot(across), wanted)
        }
    };
    // A floor of 1e-9 N: a foot that carries nothing grips nothing.
    let size = stretched.dot(stretched).max(L::splat(token, 1e-18)).sqrt();
    let share = (friction * pressed / size).min(one);
    let gripped = wanted.scale(share);
    let touching = |v: L| depth.if_positive(v, zero);
    // While it slides, the rubber creeps to the shear that bears the friction, `d ds/dt = −f − k s`: by the trapezoidal rule,
    // which agrees with `moved` where it begins to slide.
    let stiffness = load(&contact.shear_stiffness);
    let last = along(Vec3::load(token, &state.force));
    let creep = one / stiffness.fma(half_step, damping);
    let kept = before.scale((-stiffness).fma(half_step, damping));
    let yielded = (gripped + last).fma(-half_step, kept).scale(creep);
    let slides = one - share;
    let keep = |yielded: L, held: L| touching(slides.if_positive(yielded, held));
    let kept = [keep(yielded.0[0], shear.0[0]), keep(yielded.0[1], shear.0[1]), keep(yielded.0[2], shear.0[2])];
    state.shear = Vec3(kept).store();
    state.velocity = velocity.store();

    let grip = touching(half_step * damping * share);
    let excess = half_step.fma(normal_damping, -grip);
    let force = normal.fma(pressed, gripped);
    let force = Vec3([touching(force.0[0]), touching(force.0[1]), touching(force.0[2])]);
    state.force = force.store();
    let spun = motion.angular_velocity.cross(arm);
    let acceleration =
        motion.angular_velocity.cross_add(spun, motion.angular_acceleration.cross_add(arm, motion.acceleration));
    let ahead = acceleration - Vec3::load(token, &state.acceleration);
    let damped = normal.fma(excess * ahead.dot(normal), ahead.scale(grip));
    // Field by field: as a whole it would be made beside its place, and copied.
    touch.arm = arm.store();
    touch.normal = normal.store();
    touch.grip = grip.store();
    touch.excess = excess.store();
    touch.acceleration = acceleration.store();
    touch.force = (force - damped).store();
}

impl<T: Store> Touch<T> {
    /// Adds itself to a link's inertia about its origin (`moment` = J, `coupling` = H, `mass` = M) and its force there.
    #[inline(always)]
    pub fn add_to<L: Lanes<Store = T>>(
        &self,
        token: L::Token,
        (moment, coupling, mass): (&mut Sym3<L>, &mut Mat3<L>, &mut Sym3<L>),
        (torque, force): (&mut Vec3<L>, &mut Vec3<L>),
    ) {
        let (arm, normal) = (Vec3::<L>::load(token, &self.arm), Vec3::<L>::load(token, &self.normal));
        let (grip, excess) = (L::load(token, &self.grip), L::load(token, &self.excess));
        let pull = Vec3::<L>::load(token, &self.force);
        *torque = *torque - arm.cross(pull);
        *force = *force - pull;
        add_point_mass(grip, arm, moment, coupling, mass);
        let turned = arm.cross(normal);
        *moment = moment.add_outer(excess, turned);
        *mass = mass.add_outer(excess, normal);
        *coupling = coupling.add_outer(turned, normal.scale(excess));
    }

    /// Keeps the acceleration that was found: of the link's origin and of its spin.
    #[inline(always)]
    pub fn keep<L: Lanes<Store = T>>(
        &self,
        token: L::Token,
        acceleration: Vec3<L>,
        angular_acceleration: Vec3<L>,
        state: &mut FootState<T>,
    ) {
        let arm = Vec3::<L>::load(token, &self.arm);
        let found = angular_acceleration.cross_add(arm, acceleration) + Vec3::load(token, &self.acceleration);
        state.acceleration = found.store();
    }
}

/// A point mass at `arm` from the origin.
#[inline(always)]
pub fn add_point_mass<L: Lanes>(
    point: L,
    arm: Vec3<L>,
    moment: &mut Sym3<L>,
    coupling: &mut Mat3<L>,
    mass: &mut Sym3<L>,
) {
    *mass = mass.add_diagonal(point);
    let m = arm.scale(point);
    *moment = moment.add_diagonal(m.dot(arm)).add_outer(-point, arm);
    *coupling = coupling.plus_cross(m);
}

/// Depth and normal where some body's ground is not even.
#[inline(always)]
fn uneven<L: Lanes>(token: L::Token, special: &[Option<Contact>], radius: L, centre: Vec3<L>) -> (L, Vec3<L>) {
    let (radius, centre) = (radius.store(), centre.store());
    let mut normal = [L::Store::splat(0.0), L::Store::splat(0.0), L::Store::splat(1.0)];
    let depth = L::Store::from_fn(|lane| {
        let (x, z) = (centre[0].get(lane), centre[2].get(lane));
        let Some(contact) = &special[lane / 2] else { return radius.get(lane) - z };
        let meeting = contact.meeting(radius.get(lane), x, z);
        normal[0].set(lane, meeting.normal[0]);
        normal[2].set(lane, meeting.normal[1]);
        meeting.depth
    });
    (L::load(token, &depth), Vec3::load(token, &normal))
}

/// Coefficient of friction where some body's law is not Coulomb's.
#[inline(always)]
fn coefficient<L: Lanes>(
    token: L::Token,
    special: &[Option<Contact>],
    plain: &L::Store,
    centre: Vec3<L>,
    sliding: Vec3<L>,
    pressed: L,
) -> L {
    let (x, pressed, square) = (centre.0[0].store(), pressed.store(), sliding.dot(sliding).store());
    let all = L::Store::from_fn(|lane| match &special[lane / 2] {
        None => plain.get(lane),
        Some(contact) => contact.coefficient(x.get(lane), square.get(lane).sqrt(), pressed.get(lane)),
    });
    L::load(token, &all)
}
