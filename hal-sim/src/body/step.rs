//! One step of many bodies: Featherstone's articulated-body algorithm on two arms at once.
//!
//! R. Featherstone, "The calculation of robot dynamics using articulated-body inertias", 1983; *Rigid Body Dynamics
//! Algorithms*, 2008, chapter 7. Everything is in the world's axes with the origin at each link's hinges, so that passing
//! from link to link is a shift without a rotation; every triple of hinges is one joint of three degrees of freedom.
//!
//! Three passes. Outwards: where the links are, how they move, and which forces they need if no hinge accelerates.
//! Inwards: articulated inertias. Outwards: accelerations.
//!
//! Of an articulated link, `[torque; force] = [J H; Hᵀ M]·[spin rate; acceleration] + [n; f]`. A triple with axes E
//! (columns) and rates q̇ bears the torque `t − C·x`, `x` being the relative spin rate: `t = E⁻ᵀ(−K q − D q̇)`, and
//! `C = E⁻ᵀ h D E⁻¹` what the damping gains over the step. With `X = (J + C)⁻¹` the inner
//! link sees `J' = C − C X C`, `H' = C X H`, `M' = M − Hᵀ X H`: where C is small against J, as at the modules, nothing cancels.
//!
//! In time, the leapfrog: positions drift for half a step, forces act in the middle, positions drift on. Springs and
//! gravity see the middle's position, and what depends on velocity sees the velocity extrapolated to the middle by the last
//! step's acceleration: second order, one evaluation a step. The hinges' damping needs more: the segments are so light that
//! a step is hundreds of their damping times. It acts on `q̇ − h/2·q̈_last + h·q̈`, which is the middle's velocity to second
//! order, and in the stiff limit shrinks a motion by 0.71 a step.

use fearless_simd::Simd;

use super::algebra::{Mat3, Sym3, Vec3};
use super::contact::{Motion, Touch, touch};
use super::lanes::{Kind, Lanes, Store, cos_sin};
use super::model::{HingeState, LinkRow, Model, State};
use super::rotor::{Joined, RotorStep};

/// What the passes hand on, depth by depth.
#[derive(Clone, Debug)]
pub struct Scratch<K: Kind> {
    links: Vec<Handed<K::Store>>,
    touches: Vec<[Touch<K::Store>; 2]>,
}

/// See [`Scratch`].
#[derive(Clone, Debug)]
struct Handed<T> {
    /// E⁻ᵀ by columns: the dual axes.
    dual: [[T; 3]; 3],
    /// From the inner link's origin, m.
    from: [T; 3],
    /// J about the own origin, kg·m².
    moment: [T; 6],
    /// Mass times centre, kg·m: H = [·]×.
    moved: [T; 3],
    /// n and f.
    needs: [[T; 3]; 2],
    /// t.
    spring: [T; 3],
    /// X (t − n).
    response: [T; 3],
    /// X C.
    damped: [[T; 3]; 3],
    /// X H.
    coupled: [[T; 3]; 3],
}

impl<K: Kind> Scratch<K> {
    /// For a model.
    pub fn new(model: &Model<K>) -> Self {
        let zero = K::Store::splat(0.0);
        let handed = Handed {
            dual: [[zero; 3]; 3],
            from: [zero; 3],
            moment: [zero; 6],
            moved: [zero; 3],
            needs: [[zero; 3]; 2],
            spring: [zero; 3],
            response: [zero; 3],
            damped: [[zero; 3]; 3],
            coupled: [[zero; 3]; 3],
        };
        let touch = Touch {
            arm: [zero; 3],
            normal: [zero; 3],
            grip: zero,
            excess: zero,
            acceleration: [zero; 3],
            force: [zero; 3],
        };
        Self { links: vec![handed; model.arm.len()], touches: vec![[touch; 2]; model.feet.len()] }
    }
}

/// An articulated link: J, H, M, n, f.
#[derive(Clone, Copy)]
pub(super) struct Articulated<L> {
    pub moment: Sym3<L>,
    pub coupling: Mat3<L>,
    pub mass: Sym3<L>,
    pub torque: Vec3<L>,
    pub force: Vec3<L>,
}

impl<L: Lanes> Articulated<L> {
    #[inline(always)]
    pub fn nothing(zero: L) -> Self {
        let none = Vec3::splat(zero);
        Self {
            moment: Sym3::splat(zero),
            coupling: Mat3([none; 3]),
            mass: Sym3::splat(zero),
            torque: none,
            force: none,
        }
    }

    /// The same seen from a point from which its origin is at `r`.
    #[inline(always)]
    pub fn shifted(self, r: Vec3<L>, half: L) -> Self {
        let lever = self.mass.columns().crossed_by(r);
        // J + A + Aᵀ with A = [r]× (H + ½ [r]× M)ᵀ.
        let a = lever.fma(half, self.coupling).transposed().crossed_by(r);
        let [a0, a1, a2] = [a.0[0].0, a.0[1].0, a.0[2].0];
        let both = Sym3([a0[0] + a0[0], a1[1] + a1[1], a2[2] + a2[2], a0[1] + a1[0], a0[2] + a2[0], a1[2] + a2[1]]);
        Self {
            moment: self.moment + both,
            coupling: self.coupling + lever,
            mass: self.mass,
            torque: r.cross_add(self.force, self.torque),
            force: self.force,
        }
    }

    #[inline(always)]
    pub fn plus(self, b: Self) -> Self {
        Self {
            moment: self.moment + b.moment,
            coupling: self.coupling + b.coupling,
            mass: self.mass + b.mass,
            torque: self.torque + b.torque,
            force: self.force + b.force,
        }
    }

    /// What the two arms hang on the base together.
    #[inline(always)]
    fn of_both_arms(self) -> Self {
        let swapped = Self {
            moment: self.moment.swap_halves(),
            coupling: self.coupling.swap_halves(),
            mass: self.mass.swap_halves(),
            torque: self.torque.swap_halves(),
            force: self.force.swap_halves(),
        };
        self.plus(swapped)
    }

    /// The spin rate and acceleration of a free link.
    #[inline(always)]
    fn solve(&self, one: L) -> (Vec3<L>, Vec3<L>) {
        let inverse = self.mass.inverse(one);
        // The Schur complement J − H M⁻¹ Hᵀ.
        let transposed = self.coupling.transposed();
        let k = inverse.times_matrix(&transposed);
        let rest = self.moment - transposed.transposed_times_symmetric(&k);
        let alone = inverse.times(self.force);
        let spin_rate = rest.inverse(one).times(self.coupling.times(alone) - self.torque);
        (spin_rate, -(alone + k.times(spin_rate)))
    }
}

/// One step with the eccentrics turning as told; returns what came out of it for them.
#[inline(always)]
pub(super) fn advance<K: Kind, S: Simd>(
    simd: S,
    model: &Model<K>,
    state: &mut State<K>,
    scratch: &mut Scratch<K>,
    rotor: &mut RotorStep<K::Store>,
) {
    let half_step = K::Lanes::<S>::splat(simd, 0.5 * model.step);
    drift::<K, S>(simd, state, half_step);
    let Outward { needs, joined } = outwards::<K, S>(simd, model, state, scratch, rotor, half_step);
    let base_needs = inwards::<K, S>(simd, model, scratch, &needs, &joined, half_step);
    accelerate::<K, S>(simd, model, state, scratch, rotor, &joined, base_needs, half_step);
    drift::<K, S>(simd, state, half_step);
    state.steps += 1;
}

/// The base moves on for half a step. The hinges do so in the passes, which have their angles at hand.
#[inline(always)]
fn drift<K: Kind, S: Simd>(simd: S, state: &mut State<K>, half_step: K::Lanes<S>) {
    let position = Vec3::load(simd, &state.velocity).fma(half_step, Vec3::load(simd, &state.position));
    state.position = position.store();
    let spin = Vec3::load(simd, &state.spin);
    let q = &state.orientation;
    let load = |store: &K::Store| K::Lanes::<S>::load(simd, store);
    let [w, x, y, z] = turned(simd, [load(&q[0]), load(&q[1]), load(&q[2]), load(&q[3])], spin, half_step);
    state.orientation = [w.store(), x.store(), y.store(), z.store()];
}

/// A unit quaternion after a time at a spin (world frame): its exponential to the fifth order, which a half step of
/// a thousandth of a turn needs no more of, and one step of normalising.
#[inline(always)]
fn turned<L: Lanes>(token: L::Token, [w, x, y, z]: [L; 4], spin: Vec3<L>, time: L) -> [L; 4] {
    let number = |value: f64| L::splat(token, value);
    let half = spin.scale(time * number(0.5));
    let square = half.dot(half);
    let cos = square.fma(square.fma(number(1.0 / 24.0), number(-0.5)), number(1.0));
    let sin = square.fma(square.fma(number(1.0 / 120.0), number(-1.0 / 6.0)), number(1.0));
    let [a, b, c] = half.scale(sin).0;
    let [w, x, y, z] = [
        cos * w - a * x - b * y - c * z,
        cos * x + a * w + b * z - c * y,
        cos * y - a * z + b * w + c * x,
        cos * z + a * y - b * x + c * w,
    ];
    let norm = w.fma(w, x.fma(x, y.fma(y, z * z)));
    let scale = norm.fma(number(-0.5), number(1.5));
    [w * scale, x * scale, y * scale, z * scale]
}

/// Rotation matrix of a unit quaternion, columns.
#[inline(always)]
fn axes<L: Lanes>(token: L::Token, [w, x, y, z]: [L; 4]) -> Mat3<L> {
    let (one, two) = (L::splat(token, 1.0), L::splat(token, 2.0));
    let diagonal = |a: L, b: L| (-two).fma(a.fma(a, b * b), one);
    let plus = |a: L, b: L, c: L, d: L| two * a.fma(b, c * d);
    let minus = |a: L, b: L, c: L, d: L| two * a.fma(b, -(c * d));
    Mat3([
        Vec3([diagonal(y, z), plus(x, y, w, z), minus(x, z, w, y)]),
        Vec3([minus(x, y, w, z), diagonal(x, z), plus(y, z, w, x)]),
        Vec3([plus(x, z, w, y), minus(y, z, w, x), diagonal(x, y)]),
    ])
}

/// What the first pass finds beside the links.
struct Outward<L> {
    /// What the base's own mass and feet need.
    needs: Articulated<L>,
    /// What the eccentric hangs on its link.
    joined: Joined<L>,
}

/// The first pass.
#[inline(always)]
fn outwards<K: Kind, S: Simd>(
    simd: S,
    model: &Model<K>,
    state: &mut State<K>,
    scratch: &mut Scratch<K>,
    rotor: &RotorStep<K::Store>,
    half_step: K::Lanes<S>,
) -> Outward<K::Lanes<S>> {
    let zero = K::Lanes::<S>::splat(simd, 0.0);
    let [linear, angular] = &state.acceleration;
    let q = &state.orientation;
    let load = |store: &K::Store| K::Lanes::<S>::load(simd, store);
    let orientation = [load(&q[0]), load(&q[1]), load(&q[2]), load(&q[3])];
    let base = Motion {
        axes: axes(simd, orientation),
        position: Vec3::load(simd, &state.position),
        velocity: Vec3::load(simd, linear).fma(half_step, Vec3::load(simd, &state.velocity)),
        spin: Vec3::load(simd, angular).fma(half_step, Vec3::load(simd, &state.spin)),
        acceleration: Vec3::load(simd, &model.lift),
        spin_rate: Vec3::splat(zero),
    };
    let mut joined = Joined::none(zero);
    if model.has_rotor && model.rotor_depth.is_none() {
        joined = Joined::new(simd, &model.rotor, rotor, &base);
    }
    // Each lane takes half of the base's own needs: both lanes' are added later.
    let mut needs = own_needs(simd, &model.base, &base, K::Lanes::<S>::splat(simd, 0.5));
    stand::<K, S>(simd, model, &model.base, &base, state, scratch, half_step);
    if let Some(set) = model.base.feet {
        add_touches(simd, &scratch.touches[set], &mut needs);
    }
    let mut inner = base;
    let mut from = inner.axes.times(Vec3::load(simd, &model.base.next));
    for (depth, index) in model.arm.iter().enumerate() {
        let link = &model.links[*index];
        inner = beyond(simd, link, &inner, from, &mut state.hinges[depth], &mut scratch.links[depth], half_step);
        stand::<K, S>(simd, model, link, &inner, state, scratch, half_step);
        if model.has_rotor && model.rotor_depth == Some(depth) {
            joined = Joined::new(simd, &model.rotor, rotor, &inner);
        }
        from = along(simd, link, &inner.axes);
    }
    Outward { needs, joined }
}

/// From a link's hinges to the next ones: along its first axis or its third, never its second.
#[inline(always)]
fn along<L: Lanes>(token: L::Token, link: &LinkRow<L::Store>, axes: &Mat3<L>) -> Vec3<L> {
    let (first, third) = (L::load(token, &link.next[0]), L::load(token, &link.next[2]));
    axes.0[0].fma(first, axes.0[2].scale(third))
}

/// What a link's own mass needs to move as it does, about its origin, times `share`.
#[inline(always)]
fn own_needs<L: Lanes>(token: L::Token, link: &LinkRow<L::Store>, motion: &Motion<L>, share: L) -> Articulated<L> {
    let (moment, mass, moved) = inertia(token, link, &motion.axes);
    let (torque, force) = newton_euler(&moment, mass, moved, motion);
    let nothing = Articulated::nothing(L::splat(token, 0.0));
    Articulated {
        moment: moment.scale(share),
        coupling: nothing.coupling.plus_cross(moved.scale(share)),
        mass: nothing.mass.add_diagonal(mass * share),
        torque: torque.scale(share),
        force: force.scale(share),
    }
}

/// A link's inertia about its origin in the world's axes, its mass, and its mass times its centre from there.
#[inline(always)]
fn inertia<L: Lanes>(token: L::Token, link: &LinkRow<L::Store>, axes: &Mat3<L>) -> (Sym3<L>, L, Vec3<L>) {
    let own = Sym3::<L>::load(token, &link.inertia);
    let [first, second, third] = axes.0;
    let world = if link.aligned {
        // R diag(a, b, c) Rᵀ = b·1 + (a − b)·e₁e₁ᵀ + (c − b)·e₃e₃ᵀ.
        let [a, b, c, ..] = own.0;
        let round = Sym3::splat(L::splat(token, 0.0)).add_diagonal(b);
        round.add_outer(a - b, first).add_outer(c - b, third)
    } else {
        let turned = axes.times_matrix(&own.columns());
        turned.transposed().transposed_times_symmetric(&axes.transposed())
    };
    let moved = Vec3::<L>::load(token, &link.moved).0;
    let moved = first.fma(moved[0], third.scale(moved[2]));
    let moved = if link.aligned { moved } else { second.fma(L::load(token, &link.moved[1]), moved) };
    (world, L::load(token, &link.mass), moved)
}

/// Newton and Euler: torque about the origin and force for a motion.
#[inline(always)]
fn newton_euler<L: Lanes>(moment: &Sym3<L>, mass: L, moved: Vec3<L>, motion: &Motion<L>) -> (Vec3<L>, Vec3<L>) {
    let spun = motion.spin.cross(moved);
    let linear = motion.spin_rate.cross_add(moved, motion.acceleration.scale(mass));
    let force = motion.spin.cross_add(spun, linear);
    let angular = moved.cross_add(motion.acceleration, moment.times(motion.spin_rate));
    let torque = motion.spin.cross_add(moment.times(motion.spin), angular);
    (torque, force)
}

/// The link beyond a triple of hinges: its motion, and what the later passes need.
#[inline(always)]
fn beyond<L: Lanes>(
    token: L::Token,
    link: &LinkRow<L::Store>,
    inner: &Motion<L>,
    from: Vec3<L>,
    hinge: &mut HingeState<L::Store>,
    handed: &mut Handed<L::Store>,
    half_step: L,
) -> Motion<L> {
    let spun = inner.spin.cross(from);
    let start = match &link.turn {
        Some(turn) => inner.axes.times_matrix(&Mat3::load(token, turn)),
        None => inner.axes,
    };
    // The axes after each of the three turns: about the first, the second, the third axis.
    let rate = Vec3::<L>::load(token, &hinge.rate);
    let middle_angle = rate.fma(half_step, Vec3::load(token, &hinge.angle));
    hinge.angle = middle_angle.store();
    let angle = middle_angle.0;
    let ((c1, s1), (c2, s2), (c3, s3)) = (cos_sin(token, angle[0]), cos_sin(token, angle[1]), cos_sin(token, angle[2]));
    let [a, b, c] = start.0;
    let (b_first, c_first) = (b.fma(c1, c.scale(s1)), c.fma(c1, -b.scale(s1)));
    let (a_second, c_second) = (a.fma(c2, -c_first.scale(s2)), a.fma(s2, c_first.scale(c2)));
    let axes = Mat3([a_second.fma(c3, b_first.scale(s3)), b_first.fma(c3, -a_second.scale(s3)), c_second]);

    // Hinge axes a, b_first, c_second; their dual basis.
    let secant = L::splat(token, 1.0) / c2;
    let dual = Mat3([a_second.scale(secant), b_first, c_first.scale(secant)]);
    let middle = Vec3::<L>::load(token, &hinge.acceleration).fma(half_step, rate).0;
    let (first, second, third) = (a.scale(middle[0]), b_first.scale(middle[1]), c_second.scale(middle[2]));
    let relative = first + second + third;
    let gained = (inner.spin + first).cross_add(relative, second.cross(third));
    let motion = Motion {
        axes,
        position: inner.position + from,
        velocity: inner.velocity + spun,
        spin: inner.spin + relative,
        acceleration: inner.spin.cross_add(spun, inner.spin_rate.cross_add(from, inner.acceleration)),
        spin_rate: inner.spin_rate + gained,
    };

    let (stiffness, damping) = (Vec3::<L>::load(token, &link.stiffness).0, Vec3::<L>::load(token, &link.damping).0);
    // The rate half a step before the middle's, by the last acceleration: with `C` for a whole step it makes the damping
    // act in the middle.
    let late = rate + rate - Vec3(middle);
    let torque = Vec3([
        -stiffness[0].fma(angle[0], damping[0] * late.0[0]),
        -stiffness[1].fma(angle[1], damping[1] * late.0[1]),
        -stiffness[2].fma(angle[2], damping[2] * late.0[2]),
    ]);
    let (moment, mass, moved) = inertia(token, link, &motion.axes);
    let (need, force) = newton_euler(&moment, mass, moved, &motion);
    handed.dual = dual.store();
    handed.from = from.store();
    handed.moment = moment.store();
    handed.moved = moved.store();
    handed.needs = [need.store(), force.store()];
    handed.spring = dual.times(torque).store();
    motion
}

/// The feet of a link, if it has any.
#[inline(always)]
fn stand<K: Kind, S: Simd>(
    simd: S,
    model: &Model<K>,
    link: &LinkRow<K::Store>,
    motion: &Motion<K::Lanes<S>>,
    state: &mut State<K>,
    scratch: &mut Scratch<K>,
    half_step: K::Lanes<S>,
) {
    let Some(set) = link.feet else { return };
    for side in 0..2 {
        scratch.touches[set][side] = touch::<K::Lanes<S>>(
            simd,
            (&model.feet[set], side),
            &model.contact,
            model.special.as_deref(),
            motion,
            half_step,
            &mut state.feet[set][side],
        );
    }
}

#[inline(always)]
fn add_touches<L: Lanes>(token: L::Token, touches: &[Touch<L::Store>; 2], to: &mut Articulated<L>) {
    for touch in touches {
        touch.add_to(token, (&mut to.moment, &mut to.coupling, &mut to.mass), (&mut to.torque, &mut to.force));
    }
}

/// The second pass: everything as the base sees it.
#[inline(always)]
fn inwards<K: Kind, S: Simd>(
    simd: S,
    model: &Model<K>,
    scratch: &mut Scratch<K>,
    base: &Articulated<K::Lanes<S>>,
    joined: &Joined<K::Lanes<S>>,
    half_step: K::Lanes<S>,
) -> Articulated<K::Lanes<S>> {
    let (zero, half) = (K::Lanes::<S>::splat(simd, 0.0), K::Lanes::<S>::splat(simd, 0.5));
    let one = K::Lanes::<S>::splat(simd, 1.0);
    let mut outer = Articulated::nothing(zero);
    for (depth, index) in model.arm.iter().enumerate().rev() {
        let link = &model.links[*index];
        let handed = &mut scratch.links[depth];
        outer.moment = outer.moment + Sym3::load(simd, &handed.moment);
        outer.coupling = outer.coupling.plus_cross(Vec3::load(simd, &handed.moved));
        outer.mass = outer.mass.add_diagonal(K::Lanes::<S>::load(simd, &link.mass));
        outer.torque = outer.torque + Vec3::load(simd, &handed.needs[0]);
        outer.force = outer.force + Vec3::load(simd, &handed.needs[1]);
        if let Some(set) = link.feet {
            add_touches(simd, &scratch.touches[set], &mut outer);
        }
        if model.rotor_depth == Some(depth) {
            outer = outer.plus(joined.on_link);
        }
        outer = seen_through(simd, outer, link, handed, half_step + half_step, one)
            .shifted(Vec3::load(simd, &handed.from), half);
    }
    let mut base = base.plus(outer);
    if model.rotor_depth.is_none() {
        base = base.plus(joined.on_link);
    }
    base.of_both_arms()
}

/// A link through its hinges.
#[inline(always)]
fn seen_through<L: Lanes>(
    token: L::Token,
    outer: Articulated<L>,
    link: &LinkRow<L::Store>,
    handed: &mut Handed<L::Store>,
    step: L,
    one: L,
) -> Articulated<L> {
    let dual = Mat3::<L>::load(token, &handed.dual);
    let damping = Vec3::<L>::load(token, &link.damping).scale(step).0;
    let [x, y, z] = dual.0;
    let zero = Sym3::splat(L::splat(token, 0.0));
    let damping = zero.add_outer(damping[0], x).add_outer(damping[1], y).add_outer(damping[2], z);
    let inverse = (outer.moment + damping).inverse(one);
    let spring = Vec3::load(token, &handed.spring);
    let response = inverse.times(spring - outer.torque);
    let damped = inverse.times_matrix(&damping.columns());
    let coupled = inverse.times_matrix(&outer.coupling);
    handed.response = response.store();
    handed.damped = damped.store();
    handed.coupled = coupled.store();
    Articulated {
        moment: damping - damping.columns().transposed_times_symmetric(&damped),
        coupling: damping.times_matrix(&coupled),
        mass: outer.mass - outer.coupling.transposed_times_symmetric(&coupled),
        torque: spring - damping.times(response),
        force: outer.force + outer.coupling.transposed_times(response),
    }
}

/// The third pass: accelerations, and velocities at the step's end.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the last pass needs what all others made")]
fn accelerate<K: Kind, S: Simd>(
    simd: S,
    model: &Model<K>,
    state: &mut State<K>,
    scratch: &Scratch<K>,
    rotor: &mut RotorStep<K::Store>,
    joined: &Joined<K::Lanes<S>>,
    base: Articulated<K::Lanes<S>>,
    half_step: K::Lanes<S>,
) {
    let step = half_step + half_step;
    let zero = Vec3::splat(K::Lanes::<S>::splat(simd, 0.0));
    let (mut spin_rate, mut acceleration) = (zero, zero);
    if !model.clamped {
        (spin_rate, acceleration) = base.solve(K::Lanes::<S>::splat(simd, 1.0));
        state.velocity = acceleration.fma(step, Vec3::load(simd, &state.velocity)).store();
        state.spin = spin_rate.fma(step, Vec3::load(simd, &state.spin)).store();
        state.acceleration = [acceleration.store(), spin_rate.store()];
    }
    let mut keep = |link: &LinkRow<K::Store>, acceleration, spin_rate| {
        let Some(set) = link.feet else { return };
        for side in 0..2 {
            scratch.touches[set][side].keep(simd, acceleration, spin_rate, &mut state.feet[set][side]);
        }
    };
    keep(&model.base, acceleration, spin_rate);
    if model.has_rotor && model.rotor_depth.is_none() {
        joined.respond(simd, acceleration, spin_rate, rotor);
    }
    for (depth, index) in model.arm.iter().enumerate() {
        let handed = &scratch.links[depth];
        acceleration = spin_rate.cross_add(Vec3::load(simd, &handed.from), acceleration);
        let damped = Mat3::<K::Lanes<S>>::load(simd, &handed.damped).times(spin_rate);
        let coupled = Mat3::<K::Lanes<S>>::load(simd, &handed.coupled).times(acceleration);
        let outer = Vec3::<K::Lanes<S>>::load(simd, &handed.response) + damped - coupled;
        let found = Mat3::load(simd, &handed.dual).transposed_times(outer - spin_rate);
        let hinge = &mut state.hinges[depth];
        hinge.acceleration = found.store();
        let rate = found.fma(step, Vec3::load(simd, &hinge.rate));
        hinge.rate = rate.store();
        hinge.angle = rate.fma(half_step, Vec3::load(simd, &hinge.angle)).store();
        spin_rate = outer;
        keep(&model.links[*index], acceleration, spin_rate);
        if model.has_rotor && model.rotor_depth == Some(depth) {
            joined.respond(simd, acceleration, spin_rate, rotor);
        }
    }
}
