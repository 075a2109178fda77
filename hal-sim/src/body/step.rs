//! One step of many bodies: Featherstone's articulated-body algorithm on two arms at once.
//!
//! R. Featherstone, "The calculation of robot dynamics using articulated-body inertias", 1983; *Rigid Body Dynamics
//! Algorithms*, 2008, chapter 7. Everything is in the world's axes with the origin at each link's hinges, so that passing
//! from link to link is a shift without a rotation; every triple of hinges is one joint of three degrees of freedom.
//!
//! Three passes. Outwards: where the links are, how they move, and which forces they need if no hinge accelerates.
//! Inwards: articulated inertias. Outwards: accelerations.
//!
//! Of an articulated link, `[torque; force] = [J H; Hᵀ M]·[angular_velocity rate; acceleration] + [n; f]`. A triple with axes E
//! (columns) and rates q̇ bears the torque `t − C·x`, `x` being the relative spin rate: `t = E⁻ᵀ(−K q − D q̇)`, and
//! `C = E⁻ᵀ h D E⁻¹` what the damping gains over the step. With `X = (J + C)⁻¹` the inner
//! link sees `J' = C − C X C`, `H' = C X H`, `M' = M − Hᵀ X H`: where C is small against J, as at the modules, nothing cancels.
//! X itself is not needed, but `X = Vᵀ W V` by Cholesky: `C X C = (V C)ᵀ W (V C)`, and so on.
//!
//! In time, the leapfrog: positions drift for half a step, forces act in the middle, positions drift on. Springs and
//! gravity see the middle's position, and what depends on velocity sees the velocity extrapolated to the middle by the last
//! step's acceleration: second order, one evaluation a step. The hinges' damping needs more: the segments are so light that
//! a step is hundreds of their damping times. It acts on `q̇ − h/2·q̈_last + h·q̈`, which is the middle's velocity to second
//! order, and in the stiff limit shrinks a motion by 0.71 a step.

use fearless_simd::Simd;

use super::algebra::{Factors, Mat3, Sym3, Vec3};
use super::contact::{Motion, Touch, touch};
use super::lanes::{Kind, Lanes, Store, cos_sin};
use super::model::{FootState, HingeState, LinkRow, Model, State};
use super::rotor::{Joined, RotorStep};
use super::walls::{MovingLink, Push};

/// What the passes hand on, depth by depth.
#[derive(Clone, Debug)]
pub struct Scratch<K: Kind> {
    links: Vec<JointWorkspace<K::Store>>,
    touches: Vec<[Touch<K::Store>; 2]>,
    /// By walls, of each of `Model::feet`; empty without walls.
    pushes: Vec<Push<K::Store>>,
}

/// See [`Scratch`].
#[derive(Clone, Debug)]
struct JointWorkspace<T> {
    /// E⁻ᵀ by columns: the dual axes.
    dual: [[T; 3]; 3],
    /// From the inner link's origin, m.
    from: [T; 3],
    /// J about the own origin, kg·m².
    moment: [T; 6],
    /// Mass times centre, kg·m: H = [·]×.
    first_moment: [T; 3],
    /// Bias force `[n, f]`: torque and force without accelerations of the joints, N·m and N.
    bias_force: [[T; 3]; 2],
    /// Torque `t` of the joint's spring and damper, N·m.
    spring: [T; 3],
    /// V below its diagonal of ones.
    below: [T; 3],
    /// W V (t − n).
    response: [T; 3],
    /// W V C.
    damped: [[T; 3]; 3],
    /// W V H.
    coupled: [[T; 3]; 3],
}

impl<K: Kind> Scratch<K> {
    /// For a model.
    pub fn new(model: &Model<K>) -> Self {
        let zero = K::Store::splat(0.0);
        let workspace = JointWorkspace {
            dual: [[zero; 3]; 3],
            from: [zero; 3],
            moment: [zero; 6],
            first_moment: [zero; 3],
            bias_force: [[zero; 3]; 2],
            spring: [zero; 3],
            below: [zero; 3],
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
        let pushes = model.surroundings.as_ref().map_or(0, |_| model.feet.len());
        Self {
            links: vec![workspace; model.arm.len()],
            touches: vec![[touch; 2]; model.feet.len()],
            pushes: vec![[[zero; 3]; 2]; pushes],
        }
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
    pub fn shifted(self, r: Vec3<L>) -> Self {
        // H + [r]×M, and J + H [r]×ᵀ + [r]× (H + [r]×M)ᵀ.
        let coupling = self.mass.columns().crossed_by_and(r, &self.coupling);
        Self {
            moment: self.moment.add_crossed(r, &self.coupling, &coupling),
            coupling,
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
        let angular_acceleration = rest.inverse(one).times(self.coupling.times(alone) - self.torque);
        (angular_acceleration, -(alone + k.times(angular_acceleration)))
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
    let Outward { bias_force, joined } = outwards::<K, S>(simd, model, state, scratch, rotor, half_step);
    let base_bias_force = inwards::<K, S>(simd, model, scratch, &bias_force, &joined, half_step);
    accelerate::<K, S>(simd, model, state, scratch, rotor, &joined, base_bias_force, half_step);
    drift::<K, S>(simd, state, half_step);
    state.steps += 1;
}

/// The base moves on for half a step. The hinges do so in the passes, which have their angles at hand.
#[inline(always)]
fn drift<K: Kind, S: Simd>(simd: S, state: &mut State<K>, half_step: K::Lanes<S>) {
    let position = Vec3::load(simd, &state.velocity).fma(half_step, Vec3::load(simd, &state.position));
    state.position = position.store();
    let angular_velocity = Vec3::load(simd, &state.angular_velocity);
    let q = &state.orientation;
    let load = |store: &K::Store| K::Lanes::<S>::load(simd, store);
    let [w, x, y, z] = turned(simd, [load(&q[0]), load(&q[1]), load(&q[2]), load(&q[3])], angular_velocity, half_step);
    state.orientation = [w.store(), x.store(), y.store(), z.store()];
}

/// A unit quaternion after a time at a spin (world frame): its exponential to the fifth order, which a half step of
/// a thousandth of a turn needs no more of, and one step of normalising.
#[inline(always)]
fn turned<L: Lanes>(token: L::Token, [w, x, y, z]: [L; 4], angular_velocity: Vec3<L>, time: L) -> [L; 4] {
    let number = |value: f64| L::splat(token, value);
    let half = angular_velocity.scale(time * number(0.5));
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
    bias_force: Articulated<L>,
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
        angular_velocity: Vec3::load(simd, angular).fma(half_step, Vec3::load(simd, &state.angular_velocity)),
        acceleration: Vec3::load(simd, &model.lift),
        angular_acceleration: Vec3::splat(zero),
    };
    let mut joined = Joined::none(zero);
    if model.has_rotor && model.rotor_depth.is_none() {
        joined = Joined::new(simd, &model.rotor, rotor, &base);
    }
    let mut next = Point::carried(&base, base.axes.times(Vec3::load(simd, &model.base.next)));
    // Each lane takes half of the base's own needs: both lanes' are added later.
    let mut bias_force =
        own_bias_force(simd, &model.base, &base, &next).articulated(simd, K::Lanes::<S>::splat(simd, 0.5));
    stand::<K, S>(simd, model, &model.base, &base, state, scratch, half_step);
    if let Some(set) = model.base.feet {
        add_touches(simd, &scratch.touches[set], &mut bias_force);
        add_push(simd, scratch.pushes.get(set), &mut bias_force);
    }
    let mut inner = base;
    for (depth, index) in model.arm.iter().enumerate() {
        let link = &model.links[*index];
        let workspace = &mut scratch.links[depth];
        (inner, next) = beyond(simd, link, &inner, &next, &mut state.hinges[depth], workspace, half_step);
        stand::<K, S>(simd, model, link, &inner, state, scratch, half_step);
        if model.has_rotor && model.rotor_depth == Some(depth) {
            joined = Joined::new(simd, &model.rotor, rotor, &inner);
        }
    }
    Outward { bias_force, joined }
}

/// Where the next hinges are on a link, and how they move.
#[derive(Clone, Copy)]
struct Point<L> {
    /// From the link's origin, m.
    from: Vec3<L>,
    /// Velocity of the link's origin, world frame, m/s.
    velocity: Vec3<L>,
    /// Without what is to be found, m/s².
    acceleration: Vec3<L>,
}

impl<L: Lanes> Point<L> {
    /// A point of a link that moves so.
    #[inline(always)]
    fn carried(motion: &Motion<L>, from: Vec3<L>) -> Self {
        let spun = motion.angular_velocity.cross(from);
        Self {
            from,
            velocity: motion.velocity + spun,
            acceleration: motion
                .angular_velocity
                .cross_add(spun, motion.angular_acceleration.cross_add(from, motion.acceleration)),
        }
    }
}

/// From a link's hinges to the next ones: along its first axis or its third, never its second.
#[inline(always)]
fn along<L: Lanes>(token: L::Token, link: &LinkRow<L::Store>, axes: &Mat3<L>) -> Vec3<L> {
    let (first, third) = (L::load(token, &link.next[0]), L::load(token, &link.next[2]));
    axes.0[0].fma(first, axes.0[2].scale(third))
}

/// A rigid link about its origin, in the world's axes: its inertia, and what it needs to move as it does.
struct Own<L> {
    moment: Sym3<L>,
    mass: L,
    /// Mass times centre, kg·m.
    first_moment: Vec3<L>,
    torque: Vec3<L>,
    force: Vec3<L>,
}

impl<L: Lanes> Own<L> {
    /// `share` of it.
    #[inline(always)]
    fn articulated(self, token: L::Token, share: L) -> Articulated<L> {
        let nothing = Articulated::nothing(L::splat(token, 0.0));
        Articulated {
            moment: self.moment.scale(share),
            coupling: nothing.coupling.plus_cross(self.first_moment.scale(share)),
            mass: nothing.mass.add_diagonal(self.mass * share),
            torque: self.torque.scale(share),
            force: self.force.scale(share),
        }
    }
}

/// Newton and Euler of a link's own mass.
#[inline(always)]
fn own_bias_force<L: Lanes>(token: L::Token, link: &LinkRow<L::Store>, motion: &Motion<L>, next: &Point<L>) -> Own<L> {
    let inertia = Sym3::<L>::load(token, &link.inertia);
    let mass = L::load(token, &link.mass);
    let (moment, first_moment, force);
    if link.aligned {
        // R diag(a, b, c) Rᵀ = b·1 + (a − b)·e₁e₁ᵀ + (c − b)·e₃e₃ᵀ.
        let [a, b, c, ..] = inertia.0;
        let [first, _, third] = motion.axes.0;
        let round = Sym3::splat(L::splat(token, 0.0)).add_diagonal(b);
        moment = round.add_outer(a - b, first).add_outer(c - b, third);
        // The centre is in the middle between two triples of hinges, and so is its acceleration.
        let half_mass = mass * L::splat(token, 0.5);
        first_moment = next.from.scale(half_mass);
        force = (motion.acceleration + next.acceleration).scale(half_mass);
    } else {
        let turned = motion.axes.times_matrix(&inertia.columns());
        moment = turned.transposed().transposed_times_symmetric(&motion.axes.transposed());
        first_moment = motion.axes.times(Vec3::load(token, &link.first_moment));
        let linear = motion.angular_acceleration.cross_add(first_moment, motion.acceleration.scale(mass));
        force = motion.angular_velocity.cross_add(motion.angular_velocity.cross(first_moment), linear);
    }
    let angular = first_moment.cross_add(motion.acceleration, moment.times(motion.angular_acceleration));
    let torque = motion.angular_velocity.cross_add(moment.times(motion.angular_velocity), angular);
    Own { moment, mass, first_moment, torque, force }
}

/// The link beyond a triple of hinges: its motion and its next hinges', and what the later passes need.
#[inline(always)]
fn beyond<L: Lanes>(
    token: L::Token,
    link: &LinkRow<L::Store>,
    inner: &Motion<L>,
    hinges: &Point<L>,
    hinge: &mut HingeState<L::Store>,
    workspace: &mut JointWorkspace<L::Store>,
    half_step: L,
) -> (Motion<L>, Point<L>) {
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
    let gained = (inner.angular_velocity + first).cross_add(relative, second.cross(third));
    let motion = Motion {
        axes,
        position: inner.position + hinges.from,
        velocity: hinges.velocity,
        angular_velocity: inner.angular_velocity + relative,
        acceleration: hinges.acceleration,
        angular_acceleration: inner.angular_acceleration + gained,
    };

    let (stiffness, damping) = (Vec3::<L>::load(token, &link.stiffness).0, Vec3::<L>::load(token, &link.damping).0);
    // The rate half a step before the middle's, by the last acceleration: with `C` for a whole step it makes the damping
    // act in the middle.
    let late = rate + rate - Vec3(middle);
    let stiffness = match &link.hardening {
        None => stiffness,
        Some(hardening) => hardened(token, stiffness, Vec3::<L>::load(token, hardening).0, angle),
    };
    let torque = Vec3([
        -stiffness[0].fma(angle[0], damping[0] * late.0[0]),
        -stiffness[1].fma(angle[1], damping[1] * late.0[1]),
        -stiffness[2].fma(angle[2], damping[2] * late.0[2]),
    ]);
    let next = Point::carried(&motion, along(token, link, &motion.axes));
    let own = own_bias_force(token, link, &motion, &next);
    workspace.dual = dual.store();
    workspace.from = hinges.from.store();
    workspace.moment = own.moment.store();
    workspace.first_moment = own.first_moment.store();
    workspace.bias_force = [own.torque.store(), own.force.store()];
    workspace.spring = dual.times(torque).store();
    (motion, next)
}

/// Stiffness of hinges that grow stiffer with the square of their angles.
#[inline(always)]
fn hardened<L: Lanes>(token: L::Token, stiffness: [L; 3], hardening: [L; 3], angle: [L; 3]) -> [L; 3] {
    let one = L::splat(token, 1.0);
    let at = |axis: usize| stiffness[axis] * hardening[axis].fma(angle[axis] * angle[axis], one);
    [at(0), at(1), at(2)]
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
        touch::<K::Lanes<S>>(
            simd,
            (&model.feet[set], side),
            &model.contact,
            model.special.as_deref(),
            motion,
            half_step,
            (&mut state.feet[set][side], &mut scratch.touches[set][side]),
        );
    }
    if let Some(surroundings) = &model.surroundings {
        let axes = motion.axes.store();
        let [position, velocity] = [motion.position.store(), motion.velocity.store()];
        let angular_velocity = motion.angular_velocity.store();
        scratch.pushes[set] = surroundings.push(set, &|lane| {
            let of = |v: &[K::Store; 3]| [v[0].get(lane), v[1].get(lane), v[2].get(lane)];
            MovingLink {
                axes: [of(&axes[0]), of(&axes[1]), of(&axes[2])],
                position: of(&position),
                velocity: of(&velocity),
                angular_velocity: of(&angular_velocity),
            }
        });
    }
}

/// What walls do to a link, if there are any.
#[inline(always)]
fn add_push<L: Lanes>(token: L::Token, push: Option<&Push<L::Store>>, to: &mut Articulated<L>) {
    let Some([torque, force]) = push else { return };
    to.torque = to.torque - Vec3::load(token, torque);
    to.force = to.force - Vec3::load(token, force);
}

#[inline(always)]
fn add_touches<L: Lanes>(token: L::Token, touches: &[Touch<L::Store>; 2], to: &mut Articulated<L>) {
    for touch in touches {
        touch.add_to(token, (&mut to.moment, &mut to.coupling, &mut to.mass), (&mut to.torque, &mut to.force));
    }
}

// A function, not a closure: what is not inlined is compiled without the instructions that the step was dispatched for.
#[inline(always)]
fn keep_touches<L: Lanes>(
    token: L::Token,
    touches: &[Touch<L::Store>; 2],
    acceleration: Vec3<L>,
    angular_acceleration: Vec3<L>,
    feet: &mut [FootState<L::Store>; 2],
) {
    for (touch, foot) in touches.iter().zip(feet) {
        touch.keep(token, acceleration, angular_acceleration, foot);
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
    let zero = K::Lanes::<S>::splat(simd, 0.0);
    let one = K::Lanes::<S>::splat(simd, 1.0);
    let mut outer = Articulated::nothing(zero);
    for (depth, index) in model.arm.iter().enumerate().rev() {
        let link = &model.links[*index];
        let workspace = &mut scratch.links[depth];
        outer.moment = outer.moment + Sym3::load(simd, &workspace.moment);
        outer.coupling = outer.coupling.plus_cross(Vec3::load(simd, &workspace.first_moment));
        outer.mass = outer.mass.add_diagonal(K::Lanes::<S>::load(simd, &link.mass));
        outer.torque = outer.torque + Vec3::load(simd, &workspace.bias_force[0]);
        outer.force = outer.force + Vec3::load(simd, &workspace.bias_force[1]);
        if let Some(set) = link.feet {
            add_touches(simd, &scratch.touches[set], &mut outer);
            add_push(simd, scratch.pushes.get(set), &mut outer);
        }
        if model.rotor_depth == Some(depth) {
            outer = outer.plus(joined.on_link);
        }
        outer = seen_through(simd, outer, link, workspace, half_step + half_step, one);
        outer = outer.shifted(Vec3::load(simd, &workspace.from));
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
    workspace: &mut JointWorkspace<L::Store>,
    step: L,
    one: L,
) -> Articulated<L> {
    let dual = Mat3::<L>::load(token, &workspace.dual);
    let damping = Vec3::<L>::load(token, &link.damping).scale(step).0;
    let [x, y, z] = dual.0;
    let zero = Sym3::splat(L::splat(token, 0.0));
    let damping = zero.add_outer(damping[0], x).add_outer(damping[1], y).add_outer(damping[2], z);
    let factors = (outer.moment + damping).factors(one);
    let spring = Vec3::load(token, &workspace.spring);
    let response = factors.weighted(factors.times(spring - outer.torque));
    let (damped, coupled) = (factors.times_matrix(&damping.columns()), factors.times_matrix(&outer.coupling));
    let (damped_weighted, coupled_weighted) = (factors.weighted_matrix(&damped), factors.weighted_matrix(&coupled));
    workspace.below = factors.below.store();
    workspace.response = response.store();
    workspace.damped = damped_weighted.store();
    workspace.coupled = coupled_weighted.store();
    Articulated {
        moment: damping.minus_transposed_times(&damped, &damped_weighted),
        coupling: damped.transposed_times_matrix(&coupled_weighted),
        mass: outer.mass.minus_transposed_times(&coupled, &coupled_weighted),
        torque: spring - damped.transposed_times(response),
        force: outer.force + coupled.transposed_times(response),
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
    let (mut angular_acceleration, mut acceleration) = (zero, zero);
    if !model.clamped {
        (angular_acceleration, acceleration) = base.solve(K::Lanes::<S>::splat(simd, 1.0));
        state.velocity = acceleration.fma(step, Vec3::load(simd, &state.velocity)).store();
        state.angular_velocity = angular_acceleration.fma(step, Vec3::load(simd, &state.angular_velocity)).store();
        state.acceleration = [acceleration.store(), angular_acceleration.store()];
    }
    if let Some(set) = model.base.feet {
        keep_touches(simd, &scratch.touches[set], acceleration, angular_acceleration, &mut state.feet[set]);
    }
    if model.has_rotor && model.rotor_depth.is_none() {
        joined.respond(simd, acceleration, angular_acceleration, rotor);
    }
    for (depth, index) in model.arm.iter().enumerate() {
        let workspace = &scratch.links[depth];
        acceleration = angular_acceleration.cross_add(Vec3::load(simd, &workspace.from), acceleration);
        let damped = Mat3::<K::Lanes<S>>::load(simd, &workspace.damped).times(angular_acceleration);
        let coupled = Mat3::<K::Lanes<S>>::load(simd, &workspace.coupled).times(acceleration);
        let weighted = Vec3::<K::Lanes<S>>::load(simd, &workspace.response) + damped - coupled;
        let outer = Factors::transposed_times(Vec3::load(simd, &workspace.below), weighted);
        let found = Mat3::load(simd, &workspace.dual).transposed_times(outer - angular_acceleration);
        let hinge = &mut state.hinges[depth];
        hinge.acceleration = found.store();
        let rate = found.fma(step, Vec3::load(simd, &hinge.rate));
        hinge.rate = rate.store();
        hinge.angle = rate.fma(half_step, Vec3::load(simd, &hinge.angle)).store();
        angular_acceleration = outer;
        if let Some(set) = model.links[*index].feet {
            keep_touches(simd, &scratch.touches[set], acceleration, angular_acceleration, &mut state.feet[set]);
        }
        if model.has_rotor && model.rotor_depth == Some(depth) {
            joined.respond(simd, acceleration, angular_acceleration, rotor);
        }
    }
}
