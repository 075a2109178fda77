//! Skeletons in lanes: the constants that a step reads, and the state that it advances.

use std::ops::Range;

use super::coordinates::Coordinates;
use super::lanes::{Kind, Store};
use super::plan::{Contact, Plan};
use super::skeleton::{Link, Matrix, Skeleton, Vector, product, to_frame, transposed};
use super::walls::Surroundings;

/// A vector of three in lanes.
pub type Vec3s<T> = [T; 3];

/// Constants of bodies of one shape, side by side.
#[derive(Clone, Debug)]
pub struct Model<K: Kind> {
    /// Different links; an arm of forty has but a few.
    pub links: Vec<LinkRow<K::Store>>,
    /// Which of `links` stands at which depth.
    pub arm: Vec<usize>,
    /// The base.
    pub base: LinkRow<K::Store>,
    /// A base held fast does not move.
    pub clamped: bool,
    /// Feet of a pair of modules (front and rear arm).
    pub feet: Vec<FeetRow<K::Store>>,
    /// Contact, the same for all feet of a body.
    pub contact: ContactRow<K::Store>,
    /// A law of friction beyond Coulomb's, or a ground that is not even, body by body; none where all are plain.
    pub special: Option<Vec<Option<Contact>>>,
    /// Walls; none where no body has any.
    pub(super) surroundings: Option<Surroundings>,
    /// The eccentric.
    pub rotor: RotorRow<K::Store>,
    /// Where the eccentric stands: at the depth of module 0, or on the base.
    pub rotor_depth: Option<usize>,
    /// Whether there is one.
    pub has_rotor: bool,
    /// Against gravity: the acceleration that a body at rest seems to have, m/s².
    pub lift: Vec3s<K::Store>,
    /// Integration step, s.
    pub step: f64,
}

/// A link of either arm, front arm in even lanes.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkRow<T> {
    /// From the inner link's frame to this link's with all hinges at zero, columns; none where it changes nothing.
    pub turn: Option<[Vec3s<T>; 3]>,
    /// Stiffness of the joint about its three axes, N·m/rad.
    pub stiffness: Vec3s<T>,
    /// Damping of the joint about its three axes, N·m·s/rad.
    pub damping: Vec3s<T>,
    /// How the joint's stiffness grows with the square of its angles, 1/rad²; none where it does not.
    pub hardening: Option<Vec3s<T>>,
    /// Mass, kg.
    pub mass: T,
    /// Mass times centre, kg·m.
    pub first_moment: Vec3s<T>,
    /// xx, yy, zz, xy, xz, yz about the origin, kg·m².
    pub inertia: [T; 6],
    /// A segment without a module, in its own frame: `inertia` is diagonal and the centre halfway to the next hinges. By
    /// kind and not by value: by value, what a body does would depend on those beside it.
    pub aligned: bool,
    /// From the link's origin to that of the next, link frame, m.
    pub next: Vec3s<T>,
    /// Of `Model::feet`.
    pub feet: Option<usize>,
}

/// Two feet.
#[derive(Clone, Debug, PartialEq)]
pub struct FeetRow<T> {
    /// Left and right, in the link's frame, m.
    pub centres: [Vec3s<T>; 2],
    /// Across the module, in the link's frame.
    pub across: Vec3s<T>,
    /// 1 where the lane has the left or the right foot, 0 where it has not.
    pub there: [T; 2],
    /// Friction of either as a share of the contact's.
    pub friction_shares: [T; 2],
}

/// A body's contact.
#[derive(Clone, Debug)]
pub struct ContactRow<T> {
    /// Radius, m.
    pub radius: T,
    /// Stiffness along the normal, N/m.
    pub normal_stiffness: T,
    /// Damping along the normal, per unit of elastic force, s/m.
    pub normal_damping: T,
    /// Stiffness in the plane of contact, N/m.
    pub shear_stiffness: T,
    /// Damping in the plane of contact, N·s/m.
    pub shear_damping: T,
    /// Coefficient of friction.
    pub friction: T,
    /// 1/lateral_share − 1; none where that is 0 for all.
    pub lateral_excess: Option<T>,
    /// Share of the load that is carried as by a sphere, and the inverse of the depth at which it is as stiff, 1/m; none where the
    /// share is 0 for all.
    pub sphere: Option<[T; 2]>,
}

/// The eccentric, in the frame of the link that carries it; zero in odd lanes.
#[derive(Clone, Debug)]
pub struct RotorRow<T> {
    /// Mass, kg.
    pub mass: T,
    /// Radius, m.
    pub radius: T,
    /// About the bolt's own axis, and across it, kg·m².
    pub axial: T,
    /// See `axial`.
    pub across: T,
    /// On the shaft at the bolt's height, m.
    pub pivot: Vec3s<T>,
    /// The shaft, upwards.
    pub axis: Vec3s<T>,
    /// The module's x axis, angle 0.
    pub zero: Vec3s<T>,
}

/// What a step changes.
#[derive(Clone, Debug)]
pub struct State<K: Kind> {
    /// Of the base's centre of mass, m.
    pub position: Vec3s<K::Store>,
    /// w, x, y, z.
    pub orientation: [K::Store; 4],
    /// Velocity of the base, world frame, m/s.
    pub velocity: Vec3s<K::Store>,
    /// Angular velocity of the base, world frame, rad/s.
    pub angular_velocity: Vec3s<K::Store>,
    /// Linear and angular, during the last step.
    pub acceleration: [Vec3s<K::Store>; 2],
    /// Depth by depth.
    pub hinges: Vec<HingeState<K::Store>>,
    /// Of each of `Model::feet`, left and right.
    pub feet: Vec<[FootState<K::Store>; 2]>,
    /// Body by body.
    pub rotors: Vec<RotorState>,
    /// Steps since the start.
    pub steps: u64,
}

/// A triple of hinges.
#[derive(Clone, Copy, Debug)]
pub struct HingeState<T> {
    /// Joint angles about the three axes, rad.
    pub angle: Vec3s<T>,
    /// Rates of the joint angles, rad/s.
    pub rate: Vec3s<T>,
    /// During the last step, rad/s².
    pub acceleration: Vec3s<T>,
}

/// A foot.
#[derive(Clone, Copy, Debug)]
pub struct FootState<T> {
    /// How far the ground has sheared it, m.
    pub shear: Vec3s<T>,
    /// Of the point that touches, during the last step, m/s.
    pub velocity: Vec3s<T>,
    /// Of the point that touches, during the last step, m/s².
    pub acceleration: Vec3s<T>,
    /// From the ground, during the last step, N.
    pub force: Vec3s<T>,
}

/// An eccentric.
#[derive(Clone, Copy, Debug, Default)]
pub struct RotorState {
    /// Angle of the shaft against its module, rad.
    pub angle: f64,
    /// Speed of the shaft against its module, rad/s.
    pub speed: f64,
    /// During the last step, rad/s².
    pub acceleration: f64,
    /// From the shaft on the eccentric, during the last step, N·m.
    pub torque: f64,
    /// The same without what the shaft's own acceleration takes, N·m.
    pub load_torque: f64,
}

impl<K: Kind> Model<K> {
    /// Up to `K::BODIES` plans of one shape; the last one fills the lanes that are left.
    pub fn new(plans: &[Plan], step: f64) -> Self {
        let plan = |body: usize| &plans[body.min(plans.len() - 1)];
        let skeletons: Vec<_> = (0..K::BODIES).map(|body| Skeleton::new(plan(body))).collect();
        let depth = skeletons[0].depth();
        let mut feet = vec![];
        let base_links: Vec<_> = skeletons.iter().map(|s| &s.base).collect();
        let base = LinkRow {
            next: rows(|lane| base_links[lane / 2].next[lane % 2]),
            // Its frame is the world's, whatever its segment's roll.
            aligned: false,
            ..link_row(&|lane| Some(base_links[lane / 2]), &|_| None, &mut feet, &|lane| lane % 2 == 0, &plan)
        };
        let mut links: Vec<LinkRow<K::Store>> = vec![];
        let mut arm = vec![];
        for index in 0..depth {
            let at = |lane: usize| skeletons[lane / 2].arms[lane % 2].get(index);
            let inner = |lane: usize| {
                let skeleton = &skeletons[lane / 2];
                match index.checked_sub(1) {
                    None => Some(&skeleton.base),
                    Some(inner) => skeleton.arms[lane % 2].get(inner),
                }
            };
            let row = link_row(&at, &inner, &mut feet, &|_| true, &plan);
            arm.push(links.iter().position(|known| *known == row).unwrap_or_else(|| {
                links.push(row);
                links.len() - 1
            }));
        }
        let mut surroundings = Surroundings::new(&plan, K::BODIES);
        if let Some(surroundings) = &mut surroundings {
            if base.feet.is_some() {
                let at = |lane: usize| Some((base_links[lane / 2], plan(lane / 2))).filter(|_| lane.is_multiple_of(2));
                surroundings.add(K::Store::WIDTH, step, &at);
            }
            for (depth, _) in arm.iter().enumerate().filter(|(_, index)| links[**index].feet.is_some()) {
                let link = |lane: usize| skeletons[lane / 2].arms[lane % 2].get(depth);
                surroundings.add(K::Store::WIDTH, step, &|lane| Some((link(lane)?, plan(lane / 2))));
            }
        }
        let front = skeletons[0].arms[0].len();
        Self {
            surroundings,
            links,
            arm,
            base,
            clamped: skeletons[0].clamped,
            feet,
            contact: contact_row(&plan),
            special: special((0..K::BODIES).map(|body| plan(body).contact.clone()).collect()),
            rotor: rotor_row(&plan, &|body| skeletons[body].arms[0].last().unwrap_or(&skeletons[body].base)),
            rotor_depth: front.checked_sub(1),
            has_rotor: plans[0].eccentric.is_some(),
            lift: rows(|lane| plan(lane / 2).gravity.map(|g| -g)),
            step,
        }
    }
}

/// All that a body has, contacts and what the last step left included.
#[derive(Clone, Debug)]
pub struct BodyState {
    /// Both lanes of each row.
    rows: Vec<[f64; 2]>,
    rotor: RotorState,
}

impl<K: Kind> State<K> {
    /// Of bodies with these coordinates, one for each lane pair.
    pub fn new(model: &Model<K>, skeletons: &[Skeleton], coordinates: &[Coordinates]) -> Self {
        let zero = K::Store::splat(0.0);
        let foot = FootState { shear: [zero; 3], velocity: [zero; 3], acceleration: [zero; 3], force: [zero; 3] };
        let mut state = Self {
            position: [zero; 3],
            orientation: [zero; 4],
            velocity: [zero; 3],
            angular_velocity: [zero; 3],
            acceleration: [[zero; 3]; 2],
            hinges: vec![HingeState { angle: [zero; 3], rate: [zero; 3], acceleration: [zero; 3] }; model.arm.len()],
            feet: vec![[foot; 2]; model.feet.len()],
            rotors: vec![RotorState::default(); K::BODIES],
            steps: 0,
        };
        for body in 0..K::BODIES {
            let from = body.min(coordinates.len() - 1);
            state.put(body, &skeletons[from], &coordinates[from]);
        }
        state
    }

    /// Gives a body these coordinates.
    pub fn put(&mut self, body: usize, skeleton: &Skeleton, from: &Coordinates) {
        for (side, lane) in [2 * body, 2 * body + 1].into_iter().enumerate() {
            let set = |to: &mut [K::Store], from: &[f64]| {
                to.iter_mut().zip(from).for_each(|(to, from)| to.set(lane, *from));
            };
            set(&mut self.position, &from.position);
            set(&mut self.orientation, &from.orientation);
            set(&mut self.velocity, &from.velocity);
            set(&mut self.angular_velocity, &from.angular_velocity);
            for (hinge, link) in self.hinges.iter_mut().zip(&skeleton.arms[side]) {
                let joint = link.joint.unwrap_or(0);
                set(&mut hinge.angle, &ordered(side, from.angles[joint]));
                set(&mut hinge.rate, &ordered(side, from.rates[joint]));
            }
        }
        self.rotors[body] = RotorState { angle: from.rotor_angle, speed: from.rotor_speed, ..RotorState::default() };
    }

    /// Takes everything that stands in these lanes, two a body, from another state of the same shape.
    pub fn take_lanes(&mut self, from: &Self, lanes: Range<usize>) {
        for (to, from) in self.rows_mut().into_iter().zip(from.rows()) {
            lanes.clone().for_each(|lane| to.set(lane, from.get(lane)));
        }
        let bodies = lanes.start / 2..lanes.end / 2;
        self.rotors[bodies.clone()].copy_from_slice(&from.rotors[bodies]);
    }

    /// All that a body has.
    pub fn body(&self, body: usize) -> BodyState {
        let lanes = |row: &K::Store| [row.get(2 * body), row.get(2 * body + 1)];
        BodyState { rows: self.rows().into_iter().map(lanes).collect(), rotor: self.rotors[body] }
    }

    /// Makes a body what one of the same shape is.
    pub fn set_body(&mut self, body: usize, to: &BodyState) {
        for (row, [left, right]) in self.rows_mut().into_iter().zip(&to.rows) {
            row.set(2 * body, *left);
            row.set(2 * body + 1, *right);
        }
        self.rotors[body] = to.rotor;
    }

    /// Everything that stands in lanes, row after row.
    fn rows(&self) -> Vec<&K::Store> {
        let base = self.position.iter().chain(&self.orientation).chain(&self.velocity).chain(&self.angular_velocity);
        let hinges = self.hinges.iter().flat_map(|one| one.angle.iter().chain(&one.rate).chain(&one.acceleration));
        let feet = self.feet.iter().flatten();
        let feet =
            feet.flat_map(|one| one.shear.iter().chain(&one.velocity).chain(&one.acceleration).chain(&one.force));
        base.chain(self.acceleration.iter().flatten()).chain(hinges).chain(feet).collect()
    }

    /// The same rows, in the same order.
    fn rows_mut(&mut self) -> Vec<&mut K::Store> {
        let base = self.position.iter_mut().chain(&mut self.orientation).chain(&mut self.velocity);
        let base = base.chain(&mut self.angular_velocity).chain(self.acceleration.iter_mut().flatten());
        let hinges = self.hinges.iter_mut();
        let hinges = hinges.flat_map(|one| one.angle.iter_mut().chain(&mut one.rate).chain(&mut one.acceleration));
        let feet = self.feet.iter_mut().flatten().flat_map(|one| {
            one.shear.iter_mut().chain(&mut one.velocity).chain(&mut one.acceleration).chain(&mut one.force)
        });
        base.chain(hinges).chain(feet).collect()
    }

    /// A body's coordinates.
    pub fn coordinates(&self, body: usize, skeleton: &Skeleton) -> Coordinates {
        let lane = 2 * body;
        let get = |from: &Vec3s<K::Store>, lane: usize| [from[0].get(lane), from[1].get(lane), from[2].get(lane)];
        let joints = skeleton.arms[0].len() + skeleton.arms[1].len();
        let (mut angles, mut rates) = (vec![[0.0; 3]; joints], vec![[0.0; 3]; joints]);
        for side in 0..2 {
            for (hinge, link) in self.hinges.iter().zip(&skeleton.arms[side]) {
                let joint = link.joint.unwrap_or(0);
                angles[joint] = ordered(side, get(&hinge.angle, lane + side));
                rates[joint] = ordered(side, get(&hinge.rate, lane + side));
            }
        }
        let orientation = [0, 1, 2, 3].map(|i| self.orientation[i].get(lane));
        let norm = orientation.iter().map(|x| x * x).sum::<f64>().sqrt();
        Coordinates {
            position: get(&self.position, lane),
            orientation: orientation.map(|x| x / norm),
            velocity: get(&self.velocity, lane),
            angular_velocity: get(&self.angular_velocity, lane),
            angles,
            rates,
            rotor_angle: self.rotors[body].angle,
            rotor_speed: self.rotors[body].speed,
        }
    }
}

/// The front arm meets its hinges in the order z', y', x.
fn ordered(side: usize, v: Vector) -> Vector {
    if side == 0 { [v[2], v[1], v[0]] } else { v }
}

fn row<T: Store>(lane: impl FnMut(usize) -> f64) -> T {
    T::from_fn(lane)
}

fn rows<T: Store>(lane: impl Fn(usize) -> Vector) -> Vec3s<T> {
    [0, 1, 2].map(|axis| row(|index| lane(index)[axis]))
}

/// Links of all lanes as one; a lane without a link gets a massless one behind rigid hinges. `own` says which lanes count
/// feet: both lanes of a body carry its base, but only one may carry the base's feet.
fn link_row<'a, T: Store>(
    at: &dyn Fn(usize) -> Option<&'a Link>,
    inner: &dyn Fn(usize) -> Option<&'a Link>,
    feet: &mut Vec<FeetRow<T>>,
    own: &dyn Fn(usize) -> bool,
    plan: &dyn Fn(usize) -> &'a Plan,
) -> LinkRow<T> {
    let lanes = 0..T::WIDTH;
    let identity: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let turn = |lane: usize| match (inner(lane), at(lane)) {
        (Some(inner), Some(link)) if inner.frame != link.frame => product(transposed(inner.frame), link.frame),
        // Not the product, whose rounding would turn every link a little.
        _ => identity,
    };
    let turns = lanes.clone().any(|lane| turn(lane) != identity);
    let of = |lane: usize, read: &dyn Fn(&Link) -> f64, missing: f64| at(lane).map_or(missing, read);
    let vector = |read: &dyn Fn(&Link) -> Vector, missing: f64| rows(|lane| at(lane).map_or([missing; 3], read));
    let module = |lane: usize| Some(&plan(lane / 2).modules[at(lane)?.module?.0]);
    let has_feet =
        |lane: usize| own(lane) && plan(lane / 2).contact.is_some() && at(lane).is_some_and(|l| l.module.is_some());
    let set = lanes.clone().any(has_feet).then(|| {
        let centre = |lane: usize, side: usize| match at(lane).and_then(|link| Some((link, link.module?))) {
            Some((link, (index, centre))) => plan(lane / 2).modules[index].feet_in(link.frame, centre)[side],
            None => [0.0; 3],
        };
        feet.push(FeetRow {
            centres: [0, 1].map(|side| rows(|lane| centre(lane, side))),
            across: rows(|lane| at(lane).map_or([0.0; 3], |link| to_frame(link.frame, [0.0, 1.0, 0.0]))),
            there: [0, 1].map(|side| {
                row(|lane| f64::from(u8::from(has_feet(lane) && module(lane).is_some_and(|m| m.has_foot[side]))))
            }),
            friction_shares: [0, 1].map(|side| row(|lane| module(lane).map_or(1.0, |m| m.friction_shares[side]))),
        });
        feet.len() - 1
    });
    let hardening = vector(&|link| link.hardening, 0.0);
    let entry = |i: usize, j: usize| row(|lane| of(lane, &|link| about_origin(link)[i][j], 0.0));
    LinkRow {
        turn: turns.then(|| [0, 1, 2].map(|column| rows(|lane| turn(lane).map(|row| row[column])))),
        stiffness: vector(&|link| link.stiffness, 0.0),
        damping: vector(&|link| link.damping, 1.0),
        // Where another lane has some, a lane without computes with a factor of exactly 1.
        hardening: Some(hardening).filter(|all| *all != [T::splat(0.0); 3]),
        mass: row(|lane| of(lane, &|link| link.mass, 0.0)),
        first_moment: vector(&|link| link.centre.map(|x| link.mass * x), 0.0),
        inertia: [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)],
        aligned: lanes.clone().all(|lane| at(lane).is_none_or(|link| link.module.is_none())),
        next: vector(&|link| link.next[0], 0.0),
        feet: set,
    }
}

/// A link's inertia about its origin, kg·m².
fn about_origin(link: &Link) -> Matrix {
    let c = link.centre;
    let square = c.iter().map(|x| x * x).sum::<f64>();
    let mut inertia = link.inertia;
    for (i, row) in inertia.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry += link.mass * (if i == j { square } else { 0.0 } - c[i] * c[j]);
        }
    }
    inertia
}

fn contact_row<'a, T: Store>(plan: &dyn Fn(usize) -> &'a Plan) -> ContactRow<T> {
    let of = |read: &dyn Fn(&Contact) -> f64| row(|lane| plan(lane / 2).contact.as_ref().map_or(1.0, read));
    let sphere = [of(&|c| c.laws.sphere()[0]), of(&|c| c.normal_stiffness / c.laws.sphere()[1])];
    ContactRow {
        radius: of(&|c| c.foot_radius),
        normal_stiffness: of(&|c| c.normal_stiffness),
        normal_damping: of(&|c| c.normal_damping),
        shear_stiffness: of(&|c| c.shear_stiffness),
        shear_damping: of(&|c| c.shear_damping),
        friction: of(&|c| c.friction),
        lateral_excess: Some(of(&|c| 1.0 / c.laws.lateral_share() - 1.0)).filter(|excess| *excess != T::splat(0.0)),
        sphere: Some(sphere).filter(|[share, _]| *share != T::splat(0.0)),
    }
}

fn special(contacts: Vec<Option<Contact>>) -> Option<Vec<Option<Contact>>> {
    let plain = |c: &Contact| !c.laws.varies_foot_friction() && c.steps.is_empty() && c.patches.is_empty();
    let special: Vec<_> = contacts.into_iter().map(|contact| contact.filter(|c| !plain(c))).collect();
    special.iter().any(Option::is_some).then_some(special)
}

fn rotor_row<'a, T: Store>(plan: &dyn Fn(usize) -> &'a Plan, host: &dyn Fn(usize) -> &'a Link) -> RotorRow<T> {
    let front = |lane: usize| lane.is_multiple_of(2);
    let of = |read: &dyn Fn(&super::plan::Eccentric) -> f64| {
        row(|lane| plan(lane / 2).eccentric.as_ref().filter(|_| front(lane)).map_or(0.0, read))
    };
    let pivot = |lane: usize| {
        let link = host(lane / 2);
        let height = plan(lane / 2).eccentric.map_or(0.0, |eccentric| eccentric.height);
        let up = to_frame(link.frame, [0.0, 0.0, height]);
        link.module.map_or(up, |(_, centre)| super::skeleton::sum(centre, up))
    };
    RotorRow {
        mass: of(&|e| e.mass),
        radius: of(&|e| e.radius),
        axial: of(&|e| e.inertia[0]),
        across: of(&|e| e.inertia[1]),
        pivot: rows(pivot),
        axis: rows(|lane| to_frame(host(lane / 2).frame, [0.0, 0.0, 1.0])),
        zero: rows(|lane| to_frame(host(lane / 2).frame, [1.0, 0.0, 0.0])),
    }
}
