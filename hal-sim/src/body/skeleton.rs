//! A plan cut into rigid links: the base in the middle of the chain and two arms of links from it, in plain numbers.
//!
//! A link is what lies between two triples of hinges. Seen from the base an arm's hinges are met in a fixed order; every
//! link's frame has its axes along those hinges, in that order, so that the same arithmetic serves both arms:
//! to the rear x, y', z'; to the front −z', −y', −x. In the nominal pose a frame is the constant rotation `Link::frame`
//! against the world.

use super::plan::{Module, Plan};

/// A vector of three, m or rad.
pub type Vector = [f64; 3];
/// A matrix by its rows.
pub type Matrix = [[f64; 3]; 3];

/// A plan cut into links.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// The link in the middle, or the clamped one; its frame is the world's in the nominal pose, its origin its centre of
    /// mass.
    pub base: Link,
    /// Where the base is in the nominal pose, world frame, m.
    pub base_position: Vector,
    /// From the base to the front, and to the rear.
    pub arms: [Vec<Link>; 2],
    /// Whether the base is held fast.
    pub clamped: bool,
}

/// A rigid link, in its own frame with the origin at its hinges (the base: at its centre of mass).
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Columns: the link's axes in the world's frame in the nominal pose.
    pub frame: Matrix,
    /// Its triple of hinges in the whole chain, from the front; none for the base.
    pub joint: Option<usize>,
    /// Stiffness and damping of its hinges, in the order in which they come, N·m/rad and N·m·s/rad.
    pub stiffness: Vector,
    /// See `stiffness`.
    pub damping: Vector,
    /// How its hinges grow stiffer with the square of their angles, in the same order, 1/rad².
    pub hardening: Vector,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub centre: Vector,
    /// About the centre of mass, kg·m².
    pub inertia: Matrix,
    /// Hinges of the next link of the arm, m. For the base: of the front arm and of the rear arm.
    pub next: [Vector; 2],
    /// The module that it carries, from 0, and the module's centre, m.
    pub module: Option<(usize, Vector)>,
    /// The segment's box that it carries, from 0 in the whole chain, and the box's centre, m.
    pub segment: Option<(usize, Vector)>,
}

/// A homogeneous box or other part, world frame, nominal pose.
struct Lump {
    mass: f64,
    centre: Vector,
    inertia: Matrix,
}

/// What lies between triple `index − 1` and triple `index`: link `index` from the front.
struct Piece {
    lumps: Vec<Lump>,
    module: Option<(usize, Vector)>,
    segment: Option<(usize, Vector)>,
}

impl Skeleton {
    /// Cuts a plan.
    #[must_use]
    pub fn new(plan: &Plan) -> Self {
        let (pieces, hinges) = pieces(plan);
        let joints = hinges.len();
        let base = match plan.clamped {
            Some(module) => plan.backbones[..module].iter().map(|backbone| backbone.segments).sum(),
            None => joints.div_ceil(2),
        };
        let identity = rotation_x(0.0);
        let base_position = centre_of_mass(&pieces[base].lumps);
        let mut base_link = link(&pieces[base], identity, base_position);
        if base > 0 {
            base_link.next[0] = difference(hinges[base - 1].position, base_position);
        }
        if base < joints {
            base_link.next[1] = difference(hinges[base].position, base_position);
        }
        let rear = (base..joints).map(|joint| arm_link(plan, &pieces[joint + 1], &hinges, joint, false)).collect();
        let front = (0..base).rev().map(|joint| arm_link(plan, &pieces[joint], &hinges, joint, true)).collect();
        Self { base: base_link, base_position, arms: [front, rear], clamped: plan.clamped.is_some() }
    }

    /// Links of the longer arm.
    #[must_use]
    pub fn depth(&self) -> usize {
        self.arms[0].len().max(self.arms[1].len())
    }
}

/// A triple of hinges.
struct Hinges {
    position: Vector,
    backbone: usize,
}

fn arm_link(plan: &Plan, piece: &Piece, hinges: &[Hinges], joint: usize, to_front: bool) -> Link {
    let backbone = &plan.backbones[hinges[joint].backbone];
    let rolled = rotation_x(backbone.roll);
    let order = |v: Vector| if to_front { [v[2], v[1], v[0]] } else { v };
    let frame = if to_front { reversed(rolled) } else { rolled };
    let mut link = link(piece, frame, hinges[joint].position);
    link.joint = Some(joint);
    link.stiffness = order(backbone.stiffness);
    link.damping = order(backbone.damping);
    link.hardening = order(backbone.hardening);
    let next = if to_front { joint.checked_sub(1) } else { Some(joint + 1) };
    if let Some(next) = next.and_then(|next| hinges.get(next)) {
        link.next = [to_frame(frame, difference(next.position, hinges[joint].position)); 2];
    }
    link
}

/// The axes −z', −y', −x of the rolled axes x, y', z', all as columns.
fn reversed(rolled: Matrix) -> Matrix {
    rolled.map(|row| [-row[2], -row[1], -row[0]])
}

/// Every link's parts and every triple's place, from the front, world frame, nominal pose.
fn pieces(plan: &Plan) -> (Vec<Piece>, Vec<Hinges>) {
    let mut pieces = vec![];
    let mut hinges = vec![];
    let mut piece = Piece { lumps: vec![], module: None, segment: None };
    let mut face = 0.5 * plan.modules[0].size[0];
    let mut segment = 0;
    for (k, module) in plan.modules.iter().enumerate() {
        let height = module.centre_height;
        let centre = [face - 0.5 * module.size[0], 0.0, height];
        let inertia = diagonal(module.principal_inertia());
        piece.lumps.push(Lump { mass: module.mass, centre: sum(centre, module.mass_centre), inertia });
        piece.module = Some((k, centre));
        face -= module.size[0];
        let Some(backbone) = plan.backbones.get(k) else { break };
        let length = backbone.length / backbone.segments as f64;
        for index in 0..backbone.segments {
            hinges.push(Hinges { position: [face - index as f64 * length, 0.0, height], backbone: k });
            pieces.push(std::mem::replace(&mut piece, Piece { lumps: vec![], module: None, segment: None }));
            let centre = [face - (index as f64 + 0.5) * length, 0.0, height];
            let size = [length, backbone.section[0], backbone.section[1]];
            let own = box_inertia(backbone.segment_mass, size);
            let roll = rotation_x(backbone.roll);
            let inertia = product(product(roll, own), transposed(roll));
            piece.lumps.push(Lump { mass: backbone.segment_mass, centre, inertia });
            piece.segment = Some((segment, centre));
            segment += 1;
        }
        face -= backbone.length;
    }
    pieces.push(piece);
    (pieces, hinges)
}

/// The parts as one rigid link with this frame and origin.
fn link(piece: &Piece, frame: Matrix, origin: Vector) -> Link {
    let centre = centre_of_mass(&piece.lumps);
    let mut inertia = [[0.0; 3]; 3];
    for lump in &piece.lumps {
        let off = difference(lump.centre, centre);
        let square = off.iter().map(|x| x * x).sum::<f64>();
        for (i, row) in inertia.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                let diagonal = if i == j { square } else { 0.0 };
                *entry += lump.inertia[i][j] + lump.mass * (diagonal - off[i] * off[j]);
            }
        }
    }
    let local = |point: Vector| to_frame(frame, difference(point, origin));
    Link {
        frame,
        joint: None,
        stiffness: [0.0; 3],
        damping: [0.0; 3],
        hardening: [0.0; 3],
        mass: piece.lumps.iter().map(|lump| lump.mass).sum(),
        centre: local(centre),
        inertia: product(product(transposed(frame), inertia), frame),
        next: [[0.0; 3]; 2],
        module: piece.module.map(|(index, centre)| (index, local(centre))),
        segment: piece.segment.map(|(index, centre)| (index, local(centre))),
    }
}

impl Module {
    /// Foot centres in the frame of a link that carries the module's centre at `centre`.
    pub(super) fn feet_in(&self, frame: Matrix, centre: Vector) -> [Vector; 2] {
        self.feet.map(|foot| sum(centre, to_frame(frame, foot)))
    }
}

/// Of a homogeneous box about its centre, kg·m².
pub fn box_inertia(mass: f64, size: Vector) -> Matrix {
    let [x, y, z] = size.map(|side| side * side * mass / 12.0);
    diagonal([y + z, x + z, x + y])
}

/// A matrix with these in its diagonal.
pub fn diagonal([x, y, z]: Vector) -> Matrix {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

fn centre_of_mass(lumps: &[Lump]) -> Vector {
    let mass: f64 = lumps.iter().map(|lump| lump.mass).sum();
    [0, 1, 2].map(|axis| lumps.iter().map(|lump| lump.mass * lump.centre[axis]).sum::<f64>() / mass)
}

/// Rotation about x.
pub fn rotation_x(angle: f64) -> Matrix {
    let (sin, cos) = angle.sin_cos();
    [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]]
}

/// `frameᵀ·v`.
pub fn to_frame(frame: Matrix, v: Vector) -> Vector {
    times(transposed(frame), v)
}

/// `m·v`.
pub fn times(m: Matrix, v: Vector) -> Vector {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// `a·b`.
pub fn product(a: Matrix, b: Matrix) -> Matrix {
    a.map(|row| [0, 1, 2].map(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

/// `mᵀ`.
pub fn transposed(m: Matrix) -> Matrix {
    [0, 1, 2].map(|i| [m[0][i], m[1][i], m[2][i]])
}

/// `a − b`.
pub fn difference(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + b`.
pub fn sum(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a × b`.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
