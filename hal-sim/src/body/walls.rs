//! Upright walls, thin and of any height, that the modules' boxes run into. Seen from above a box is a rectangle: its corners
//! meet a wall's face, a wall's ends meet its sides.
//!
//! A wall is as soft as the feet and as rough as the ground: Hunt and Crossley's law with the feet's `normal_*`, against a
//! sliding corner the smaller of `shear_n_s_per_m` times its speed and the ground's friction times the force. Both act
//! explicitly; their damping is capped at what a quarter of the module's mass bears in a step.

use super::lanes::Store;
use super::model::Vec3s;
use super::plan::Plan;
use super::skeleton::{Link, Vector, cross, difference, sum, to_frame};

/// A wall's foot on the ground, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Where it begins, m.
    pub from: [f64; 2],
    /// Where it ends, m.
    pub to: [f64; 2],
}

/// A rigid link in the middle of a step, world frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingLink {
    /// Columns: its axes.
    pub axes: [Vector; 3],
    /// Of its origin, m.
    pub position: Vector,
    /// Of its origin, m/s.
    pub velocity: Vector,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector,
}

/// Torque about a link's origin, N·m, and force, N.
pub(super) type Push<T> = [Vec3s<T>; 2];

/// The walls around some bodies, and what of the bodies meets them.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    /// Body by body.
    bodies: Vec<Surrounded>,
    /// Of each of `Model::feet`, lane by lane: the module's box, where the lane has one.
    boxes: Vec<Vec<Option<ModuleBox>>>,
}

/// A body's walls and their law.
#[derive(Clone, Debug)]
struct Surrounded {
    walls: Vec<Wall>,
    stiffness: f64,
    damping: f64,
    shear_damping: f64,
    friction: f64,
}

/// A module's box, in the frame of the link that carries it.
#[derive(Clone, Copy, Debug)]
struct ModuleBox {
    centre: Vector,
    along: Vector,
    across: Vector,
    /// Half of length and width, m.
    half: [f64; 2],
    /// What a corner's damping may be at most, N·s/m.
    most_damping: f64,
}

/// Where a box and a wall touch.
struct Meeting {
    point: Vector,
    depth: f64,
    /// From the wall to the box.
    normal: [f64; 2],
}

impl Surroundings {
    /// None where no body has a wall.
    pub fn new<'a>(plan: &dyn Fn(usize) -> &'a Plan, bodies: usize) -> Option<Self> {
        let surrounded = |body: usize| {
            let (walls, contact) = (plan(body).walls.clone(), plan(body).contact.as_ref());
            let of = |read: &dyn Fn(&super::plan::Contact) -> f64| contact.map_or(0.0, read);
            Surrounded {
                walls,
                stiffness: of(&|c| c.normal_stiffness),
                damping: of(&|c| c.normal_damping),
                shear_damping: of(&|c| c.shear_damping),
                friction: of(&|c| c.friction),
            }
        };
        let bodies: Vec<_> = (0..bodies).map(surrounded).collect();
        bodies.iter().any(|body| !body.walls.is_empty()).then_some(Self { bodies, boxes: vec![] })
    }

    /// The boxes of the next of `Model::feet`, from each lane's link and its body's plan.
    pub fn add<'a>(&mut self, lanes: usize, step: f64, at: &dyn Fn(usize) -> Option<(&'a Link, &'a Plan)>) {
        let module_box = |lane: usize| {
            let (link, plan) = at(lane)?;
            let (index, centre) = link.module?;
            let module = &plan.modules[index];
            Some(ModuleBox {
                centre,
                along: to_frame(link.frame, [1.0, 0.0, 0.0]),
                across: to_frame(link.frame, [0.0, 1.0, 0.0]),
                half: [0.5 * module.size[0], 0.5 * module.size[1]],
                most_damping: 0.25 * module.mass / step,
            })
        };
        self.boxes.push((0..lanes).map(module_box).collect());
    }

    /// What the walls do to the links of a set of feet.
    pub fn push<T: Store>(&self, set: usize, link: &dyn Fn(usize) -> MovingLink) -> Push<T> {
        let mut push = [[T::splat(0.0); 3]; 2];
        for (lane, module) in self.boxes[set].iter().enumerate() {
            let (Some(module), surrounded) = (module, &self.bodies[lane / 2]) else { continue };
            if surrounded.walls.is_empty() {
                continue;
            }
            for (part, value) in push.iter_mut().zip(surrounded.push(module, &link(lane))) {
                part.iter_mut().zip(value).for_each(|(to, from)| to.set(lane, from));
            }
        }
        push
    }
}

impl Surrounded {
    fn push(&self, module: &ModuleBox, link: &MovingLink) -> [Vector; 2] {
        let world = |v: Vector| [0, 1, 2].map(|i| (0..3).map(|axis| link.axes[axis][i] * v[axis]).sum::<f64>());
        let centre = sum(link.position, world(module.centre));
        let sides = [world(module.along), world(module.across)];
        let [mut torque, mut force] = [[0.0; 3]; 2];
        let mut take = |meeting: &Meeting| {
            let arm = difference(meeting.point, link.position);
            let velocity = sum(link.velocity, cross(link.angular_velocity, arm));
            let pushed = self.force(meeting, velocity, module.most_damping);
            force = sum(force, pushed);
            torque = sum(torque, cross(arm, pushed));
        };
        for wall in &self.walls {
            meetings(wall, centre, sides, module.half, &mut take);
        }
        [torque, force]
    }

    fn force(&self, meeting: &Meeting, velocity: Vector, most_damping: f64) -> Vector {
        let [nx, ny] = meeting.normal;
        let capped = |damping: f64| damping * most_damping / (damping + most_damping);
        let elastic = self.stiffness * meeting.depth;
        let away = velocity[0] * nx + velocity[1] * ny;
        let pressed = (elastic - capped(self.damping * elastic) * away).max(0.0);
        let sliding = [velocity[0] - away * nx, velocity[1] - away * ny, velocity[2]];
        let speed = sliding.iter().map(|v| v * v).sum::<f64>().sqrt();
        let grip = capped(self.shear_damping).min(self.friction * pressed / speed.max(1e-12));
        [pressed * nx - grip * sliding[0], pressed * ny - grip * sliding[1], -grip * sliding[2]]
    }
}

/// Every place where a box touches a wall. `sides` are the box's axes along and across, `half` its half length and width, m.
fn meetings(wall: &Wall, centre: Vector, sides: [Vector; 2], half: [f64; 2], take: &mut impl FnMut(&Meeting)) {
    let (dx, dy) = (wall.to[0] - wall.from[0], wall.to[1] - wall.from[1]);
    let length = dx.hypot(dy);
    let along = [dx / length, dy / length];
    let place = |p: [f64; 2]| {
        let (x, y) = (p[0] - wall.from[0], p[1] - wall.from[1]);
        (x * along[0] + y * along[1], y * along[0] - x * along[1])
    };
    let reach = half[0].hypot(half[1]);
    let (at, off) = place([centre[0], centre[1]]);
    if off.abs() > reach || at < -reach || at > length + reach {
        return;
    }
    // The box is on the side where its centre is.
    let side = if off < 0.0 { -1.0 } else { 1.0 };
    let normal = [-side * along[1], side * along[0]];
    for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let corner = [0, 1, 2].map(|i| centre[i] + a * half[0] * sides[0][i] + b * half[1] * sides[1][i]);
        let (at, off) = place([corner[0], corner[1]]);
        if side * off < 0.0 && (0.0..=length).contains(&at) {
            take(&Meeting { point: corner, depth: -side * off, normal });
        }
    }
    for end in [wall.from, wall.to] {
        take_end(end, centre, sides, half, take);
    }
}

/// Where a wall's end stands in a box: it pushes the nearest side.
fn take_end(end: [f64; 2], centre: Vector, sides: [Vector; 2], half: [f64; 2], take: &mut impl FnMut(&Meeting)) {
    let off = [end[0] - centre[0], end[1] - centre[1]];
    let inside = [0, 1].map(|i| off[0] * sides[i][0] + off[1] * sides[i][1]);
    let depths = [half[0] - inside[0].abs(), half[1] - inside[1].abs()];
    if depths[0] <= 0.0 || depths[1] <= 0.0 {
        return;
    }
    let nearest = usize::from(depths[1] < depths[0]);
    let away = -inside[nearest].signum();
    let normal = [away * sides[nearest][0], away * sides[nearest][1]];
    take(&Meeting { point: [end[0], end[1], centre[2]], depth: depths[nearest], normal });
}
