//! Generalised coordinates of a body, and where its parts are and move for them. Plain recursion in double precision, which
//! shares no arithmetic with the lanes that advance the body: what people see, and what tests judge by.

use super::plan::Plan;
use super::skeleton::{Link, Matrix, Skeleton, Vector, cross, product, sum, times, transposed};
use super::snapshot::Pose;

/// Where a body is and how it moves, exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct Coordinates {
    /// Of the base link's centre of mass, world frame, m.
    pub position: Vector,
    /// Of the base link: unit quaternion (w, x, y, z).
    pub orientation: [f64; 4],
    /// Of the base link's centre of mass, world frame, m/s.
    pub velocity: Vector,
    /// Of the base link, world frame, rad/s.
    pub angular_velocity: Vector,
    /// Hinge angles, triple after triple from the front: x, y', z', rad.
    pub angles: Vec<Vector>,
    /// Their rates, rad/s.
    pub rates: Vec<Vector>,
    /// Of the eccentric against module 0, rad; 0 without one.
    pub rotor_angle: f64,
    /// Speed of the shaft against its module, rad/s.
    pub rotor_speed: f64,
}

/// A rigid part that moves, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moving {
    /// Rotation from its frame to the world's.
    pub rotation: Matrix,
    /// Of a point of it, m.
    pub position: Vector,
    /// Of that point, m/s.
    pub velocity: Vector,
    /// Angular velocity, world frame, rad/s.
    pub angular_velocity: Vector,
}

/// Where a body's parts are and how they move.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// Front to rear, at the boxes' centres, frames along the boxes.
    pub modules: Vec<Moving>,
    /// Front to rear, at the boxes' centres, frames along the boxes.
    pub segments: Vec<Moving>,
    /// The bolt, at its centre.
    pub bolt: Option<Moving>,
}

/// Energies and momenta, SI, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Of all that moves, J.
    pub kinetic: f64,
    /// Of the hinges' springs, J.
    pub elastic: f64,
    /// Of gravity against the world's origin, J.
    pub gravity: f64,
    /// Linear momentum, world frame, kg·m/s.
    pub momentum: Vector,
    /// About the world's origin, kg·m²/s.
    pub angular_momentum: Vector,
}

impl Coordinates {
    /// At rest in the nominal pose.
    #[must_use]
    pub fn nominal(plan: &Plan) -> Self {
        let joints = plan.joints();
        Self {
            position: Skeleton::new(plan).base_position,
            orientation: [1.0, 0.0, 0.0, 0.0],
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            angles: vec![[0.0; 3]; joints],
            rates: vec![[0.0; 3]; joints],
            rotor_angle: 0.0,
            rotor_speed: 0.0,
        }
    }

    /// The same turned by `turn` (rad, counter-clockwise) about the world's vertical axis, then moved along the ground by
    /// `displacement` (m).
    #[must_use]
    pub fn carried(&self, turn: f64, displacement: [f64; 2]) -> Self {
        let rotation = about(2, turn);
        let [dx, dy] = displacement;
        let ((sin, cos), [w, x, y, z]) = ((0.5 * turn).sin_cos(), self.orientation);
        Self {
            position: sum(times(rotation, self.position), [dx, dy, 0.0]),
            orientation: [cos * w - sin * z, cos * x - sin * y, cos * y + sin * x, cos * z + sin * w],
            velocity: times(rotation, self.velocity),
            angular_velocity: times(rotation, self.angular_velocity),
            ..self.clone()
        }
    }

    /// Where everything is.
    #[must_use]
    pub fn parts(&self, plan: &Plan, skeleton: &Skeleton) -> Parts {
        let still =
            Moving { rotation: [[0.0; 3]; 3], position: [0.0; 3], velocity: [0.0; 3], angular_velocity: [0.0; 3] };
        let mut parts =
            Parts { modules: vec![still; plan.modules.len()], segments: vec![still; plan.joints()], bolt: None };
        let base = Moving {
            rotation: rotation(self.orientation),
            position: self.position,
            velocity: self.velocity,
            angular_velocity: self.angular_velocity,
        };
        place(&mut parts, plan, &skeleton.base, &base);
        for (side, arm) in skeleton.arms.iter().enumerate() {
            let mut inner = (&skeleton.base, base);
            for link in arm {
                let outer = self.beyond(inner.0, &inner.1, link, side);
                place(&mut parts, plan, link, &outer);
                inner = (link, outer);
            }
        }
        parts.bolt = plan.eccentric.map(|eccentric| {
            let module = &parts.modules[0];
            let (sin, cos) = self.rotor_angle.sin_cos();
            let turn = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
            let arm = [eccentric.radius * cos, eccentric.radius * sin, eccentric.height];
            let axis = times(module.rotation, [0.0, 0.0, 1.0]);
            let angular_velocity = sum(module.angular_velocity, axis.map(|x| x * self.rotor_speed));
            let pivot = module.point([0.0, 0.0, eccentric.height]);
            let off = times(module.rotation, [arm[0], arm[1], 0.0]);
            Moving {
                rotation: product(module.rotation, turn),
                position: sum(pivot.position, off),
                velocity: sum(pivot.velocity, cross(angular_velocity, off)),
                angular_velocity,
            }
        });
        parts
    }

    /// The link beyond its hinges.
    fn beyond(&self, inner: &Link, moving: &Moving, link: &Link, side: usize) -> Moving {
        let hinge = moving.point(inner.next[side]);
        let mut rotation = product(moving.rotation, product(transposed(inner.frame), link.frame));
        let joint = link.joint.unwrap_or(0);
        let order = if side == 0 { [2, 1, 0] } else { [0, 1, 2] };
        let mut angular_velocity = hinge.angular_velocity;
        for (axis, hinge) in order.into_iter().enumerate() {
            let along = [rotation[0][axis], rotation[1][axis], rotation[2][axis]];
            angular_velocity = sum(angular_velocity, along.map(|x| x * self.rates[joint][hinge]));
            rotation = product(rotation, about(axis, self.angles[joint][hinge]));
        }
        Moving { rotation, angular_velocity, ..hinge }
    }

    /// Energies and momenta.
    #[must_use]
    pub fn balance(&self, plan: &Plan, skeleton: &Skeleton) -> Balance {
        let parts = self.parts(plan, skeleton);
        let mut balance =
            Balance { kinetic: 0.0, elastic: 0.0, gravity: 0.0, momentum: [0.0; 3], angular_momentum: [0.0; 3] };
        for (module, moving) in plan.modules.iter().zip(&parts.modules) {
            let inertia = super::skeleton::diagonal(module.principal_inertia());
            balance.add(plan, module.mass, inertia, &moving.point(module.mass_centre));
        }
        let backbones = plan.backbones.iter().flat_map(|b| std::iter::repeat_n(b, b.segments));
        for (joint, (backbone, moving)) in backbones.zip(&parts.segments).enumerate() {
            let size = [backbone.length / backbone.segments as f64, backbone.section[0], backbone.section[1]];
            let inertia = super::skeleton::box_inertia(backbone.segment_mass, size);
            balance.add(plan, backbone.segment_mass, inertia, moving);
            let springs = self.angles[joint].iter().zip(backbone.stiffness).zip(backbone.hardening);
            balance.elastic += springs
                .map(|((angle, k), hardening)| 0.5 * k * angle * angle * (1.0 + 0.5 * hardening * angle * angle))
                .sum::<f64>();
        }
        if let (Some(eccentric), Some(bolt)) = (&plan.eccentric, &parts.bolt) {
            let [axial, across] = eccentric.inertia;
            let inertia = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, axial]];
            balance.add(plan, eccentric.mass, inertia, bolt);
        }
        balance
    }
}

impl Balance {
    fn add(&mut self, plan: &Plan, mass: f64, inertia: Matrix, moving: &Moving) {
        let dot = |a: Vector, b: Vector| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let world = product(product(moving.rotation, inertia), transposed(moving.rotation));
        let angular_velocity = times(world, moving.angular_velocity);
        let momentum = moving.velocity.map(|v| mass * v);
        self.kinetic += 0.5 * (dot(momentum, moving.velocity) + dot(angular_velocity, moving.angular_velocity));
        self.gravity -= mass * dot(plan.gravity, moving.position);
        self.momentum = sum(self.momentum, momentum);
        self.angular_momentum = sum(self.angular_momentum, sum(angular_velocity, cross(moving.position, momentum)));
    }
}

impl Moving {
    /// The same rigid part at another of its points, given in its own frame against the present one.
    #[must_use]
    pub fn point(&self, local: Vector) -> Self {
        let off = times(self.rotation, local);
        Self {
            position: sum(self.position, off),
            velocity: sum(self.velocity, cross(self.angular_velocity, off)),
            ..*self
        }
    }

    /// Position and orientation.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose { position: self.position, orientation: quaternion(self.rotation) }
    }
}

/// Enters a link's module and segment.
fn place(parts: &mut Parts, plan: &Plan, link: &Link, moving: &Moving) {
    // The boxes' own frames: along the world's axes in the nominal pose, the segments' rolled as their backbone.
    let unturned = product(moving.rotation, transposed(link.frame));
    if let Some((index, centre)) = link.module {
        parts.modules[index] = Moving { rotation: unturned, ..moving.point(centre) };
    }
    if let Some((index, centre)) = link.segment {
        let roll = super::skeleton::rotation_x(plan.backbone_of(index).roll);
        parts.segments[index] = Moving { rotation: product(unturned, roll), ..moving.point(centre) };
    }
}

/// Rotation about a coordinate axis.
fn about(axis: usize, angle: f64) -> Matrix {
    let (sin, cos) = angle.sin_cos();
    match axis {
        0 => [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]],
        1 => [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]],
        _ => [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]],
    }
}

/// Rotation matrix of a unit quaternion.
#[must_use]
pub fn rotation([w, x, y, z]: [f64; 4]) -> Matrix {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// Unit quaternion of a rotation matrix, w ≥ 0 (Shepperd 1978: from the largest of the four).
#[must_use]
pub fn quaternion(m: Matrix) -> [f64; 4] {
    let trace = m[0][0] + m[1][1] + m[2][2];
    let mut q = if trace > 0.0 {
        [1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    } else {
        let i = (0..3).max_by(|a, b| m[*a][*a].total_cmp(&m[*b][*b])).unwrap_or(0);
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let mut q = [m[k][j] - m[j][k], 0.0, 0.0, 0.0];
        q[1 + i] = 1.0 + m[i][i] - m[j][j] - m[k][k];
        q[1 + j] = m[i][j] + m[j][i];
        q[1 + k] = m[i][k] + m[k][i];
        q
    };
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt().copysign(if q[0] < 0.0 { -1.0 } else { 1.0 });
    q.iter_mut().for_each(|x| *x /= norm);
    q
}
