//! The robot and its walls as faces.

use super::Colour;
use super::camera::{Camera, dot};
use hal_sim::body::coordinates::rotation;
use hal_sim::body::{Plan, Pose, Snapshot};
use robot_file::robot::ModuleKind;

type Vector = [f64; 3];

/// How high walls are drawn, m.
pub(super) const WALL_M: f64 = 0.025;
/// Where the light comes from.
const LIGHT: Vector = [0.35, -0.45, 0.82];
/// Corners of a round.
const ROUND: usize = 14;
/// Width of a leg, m.
const LEG_M: f64 = 0.0016;

/// A flat piece of something, its corners counter-clockwise seen from outside.
pub(super) struct Face {
    pub corners: Vec<Vector>,
    pub colour: Colour,
    /// Of its centre from the camera, m.
    pub distance: f64,
}

/// What the ground does not get of the light from straight above.
pub(super) fn shadows(plan: &Plan, snapshot: &Snapshot) -> Vec<Vec<Vector>> {
    outlines(plan, snapshot).map(|outline| outline.map(|[x, y, _]| [x + 0.002, y + 0.003, 0.0]).to_vec()).collect()
}

/// Corners of every module, seen from above, m.
pub(crate) fn outlines(plan: &Plan, snapshot: &Snapshot) -> impl Iterator<Item = [Vector; 4]> {
    snapshot.modules.iter().zip(&plan.modules).map(|(pose, module)| {
        let [x, y, _] = module.size.map(|side| 0.5 * side);
        [[x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0]].map(|corner| placed(pose, corner))
    })
}

/// Every face whose outside is seen.
pub(super) fn faces(plan: &Plan, snapshot: &Snapshot, camera: &Camera) -> Vec<Face> {
    let mut solids = Solids { camera, faces: vec![] };
    for (pose, module) in snapshot.modules.iter().zip(&plan.modules) {
        solids.block(pose, [0.0; 3], module.size, hue(module.kind), 1.0);
        for (foot, _) in module.feet.iter().zip(module.has_foot).filter(|(_, there)| *there) {
            let top = -0.5 * module.size[2];
            let leg = [foot[0], foot[1], 0.5 * (foot[2] + top)];
            solids.block(pose, leg, [LEG_M, LEG_M, top - foot[2]], [0.357, 0.400, 0.447], 1.0);
        }
    }
    for (index, pose) in snapshot.segments.iter().enumerate() {
        let backbone = plan.backbone_of(index);
        let size = [backbone.length / backbone.segments as f64, backbone.section[0], backbone.section[1]];
        solids.block(pose, [0.0; 3], size, [0.663, 0.722, 0.804], 1.0);
    }
    let radius = plan.contact.as_ref().map_or(0.0, |contact| contact.foot_radius);
    for foot in &snapshot.feet {
        let colour = if foot.touches() { [0.10, 0.55, 0.42] } else { [0.62, 0.66, 0.70] };
        solids.ball(foot.position, radius, colour);
    }
    if let (Some(rotor), Some(eccentric), Some(pose)) = (&snapshot.rotor, plan.eccentric, snapshot.modules.first()) {
        let (sin, cos) = rotor.angle.sin_cos();
        let (height, [bolt, length]) = (eccentric.height, eccentric.bolt);
        let top = 0.5 * plan.modules[0].size[2];
        solids.post(pose, [0.0, 0.0, 0.5 * (top + height)], 0.0012, height - top, [0.553, 0.600, 0.651]);
        let arm = Pose { position: placed(pose, [0.0, 0.0, height]), orientation: turned(pose, rotor.angle) };
        let middle = 0.5 * eccentric.radius;
        solids.block(&arm, [middle, 0.0, 0.0], [eccentric.radius, 0.003, 0.0015], [0.553, 0.600, 0.651], 1.0);
        solids.post(
            pose,
            [eccentric.radius * cos, eccentric.radius * sin, height],
            bolt,
            length,
            [0.831, 0.282, 0.102],
        );
    }
    for wall in &plan.walls {
        solids.wall(wall.from, wall.to);
    }
    solids.faces
}

fn hue(kind: ModuleKind) -> [f32; 3] {
    match kind {
        ModuleKind::Actuator => [0.725, 0.525, 0.235],
        ModuleKind::Courier => [0.184, 0.490, 0.357],
        ModuleKind::Passive => [0.914, 0.914, 0.894],
    }
}

/// A point of a part, given in its frame.
fn placed(pose: &Pose, local: Vector) -> Vector {
    let rotation = rotation(pose.orientation);
    [0, 1, 2].map(|axis| pose.position[axis] + dot(rotation[axis], local))
}

/// A part's orientation after a turn about its own vertical axis.
fn turned(pose: &Pose, angle: f64) -> [f64; 4] {
    let ([w, x, y, z], (sin, cos)) = (pose.orientation, (0.5 * angle).sin_cos());
    [w * cos - z * sin, x * cos + y * sin, y * cos - x * sin, z * cos + w * sin]
}

struct Solids<'a> {
    camera: &'a Camera,
    faces: Vec<Face>,
}

impl Solids<'_> {
    /// A face that is shaded by how it stands to the light, if its outside is seen or it is seen through.
    fn face(&mut self, corners: Vec<Vector>, normal: Vector, [red, green, blue]: [f32; 3], alpha: f32) {
        let count = corners.len() as f64;
        let centre = [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / count);
        if alpha == 1.0 && !self.camera.faces(centre, normal) {
            return;
        }
        let shade = 0.62 + 0.38 * dot(normal, LIGHT).max(0.0) as f32;
        let colour = [shade * red, shade * green, shade * blue, alpha];
        self.faces.push(Face { corners, colour, distance: self.camera.distance(centre) });
    }

    /// A box at a place in a part's frame, along its axes.
    fn block(&mut self, pose: &Pose, at: Vector, size: Vector, colour: [f32; 3], alpha: f32) {
        let axes = rotation(pose.orientation);
        for axis in 0..3 {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [1.0, -1.0] {
                let corner = |(p, q): (f64, f64)| {
                    let mut local = at;
                    local[axis] += 0.5 * side * size[axis];
                    local[b] += 0.5 * p * size[b];
                    local[c] += 0.5 * q * size[c];
                    placed(pose, local)
                };
                let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(corner).to_vec();
                self.face(corners, [0, 1, 2].map(|row| side * axes[row][axis]), colour, alpha);
            }
        }
    }

    /// An upright cylinder about a place in a part's frame.
    fn post(&mut self, pose: &Pose, at: Vector, radius: f64, length: f64, colour: [f32; 3]) {
        let axes = rotation(pose.orientation);
        let rim = |k: usize, end: f64| {
            let (sin, cos) = (k as f64 * std::f64::consts::TAU / ROUND as f64).sin_cos();
            placed(pose, [at[0] + radius * cos, at[1] + radius * sin, at[2] + 0.5 * end * length])
        };
        for k in 0..ROUND {
            let (sin, cos) = ((k as f64 + 0.5) * std::f64::consts::TAU / ROUND as f64).sin_cos();
            let normal = [0, 1, 2].map(|row| axes[row][0] * cos + axes[row][1] * sin);
            self.face(vec![rim(k, -1.0), rim(k + 1, -1.0), rim(k + 1, 1.0), rim(k, 1.0)], normal, colour, 1.0);
        }
        self.face((0..ROUND).map(|k| rim(k, 1.0)).collect(), [0, 1, 2].map(|row| axes[row][2]), colour, 1.0);
    }

    /// A ball, as its outline.
    fn ball(&mut self, centre: Vector, radius: f64, colour: [f32; 3]) {
        let corners = (0..ROUND).map(|k| {
            let (sin, cos) = (k as f64 * std::f64::consts::TAU / ROUND as f64).sin_cos();
            self.camera.beside(centre, [radius * cos, radius * sin])
        });
        let corners = corners.collect();
        self.face(corners, self.camera.towards(centre), colour, 1.0);
    }

    /// A thin wall that is seen through, with a solid upper edge.
    fn wall(&mut self, from: [f64; 2], to: [f64; 2]) {
        let ([ax, ay], [bx, by]) = (from, to);
        let length = (bx - ax).hypot(by - ay);
        let normal = [(by - ay) / length, (ax - bx) / length, 0.0];
        // In pieces: one long face would be sorted by its middle alone.
        let pieces = (length / 0.06).ceil().max(1.0) as usize;
        let at = |k: usize, z: f64| {
            let share = k as f64 / pieces as f64;
            [ax + share * (bx - ax), ay + share * (by - ay), z]
        };
        for k in 0..pieces {
            let corners = vec![at(k, 0.0), at(k + 1, 0.0), at(k + 1, WALL_M), at(k, WALL_M)];
            self.face(corners, normal, [0.36, 0.47, 0.60], 0.35);
            let thick = [0.0012 * normal[0], 0.0012 * normal[1]];
            let edge = |k: usize, side: f64| {
                let [x, y, z] = at(k, WALL_M);
                [x + side * thick[0], y + side * thick[1], z]
            };
            let corners = vec![edge(k, 1.0), edge(k + 1, 1.0), edge(k + 1, -1.0), edge(k, -1.0)];
            self.face(corners, [0.0, 0.0, 1.0], [0.24, 0.33, 0.45], 0.95);
        }
    }
}
