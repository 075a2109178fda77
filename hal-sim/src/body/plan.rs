//! What a body is made of: a plain description in SI units, from a robot file or made by hand.
//!
//! Nominal pose, world frame (right-handed, z up): the robot straight along x with its first module at the +x end, the
//! feet's lowest points at z = 0. Module k (from 0) has its centre at `x = −k·pitch`. Backbone b (from 0) joins modules
//! b and b+1 by `segments` triples of hinges at one point each; triple i stands `i·L/segments` behind module b. Between
//! two triples is a segment's box; the last one is rigidly part of module b+1.

use effects::Laws;
use robot_file::Robot;
use robot_file::robot::{Backbone as BackboneFile, Feet as FeetFile, FootNumbers, ModuleKind, ModuleNumbers};

use super::skeleton::box_inertia;
use super::walls::Wall;

/// A body. All fields are public: a test or an experiment may build what no robot file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// From front to rear.
    pub modules: Vec<Module>,
    /// Between the modules, from front to rear: one fewer.
    pub backbones: Vec<Backbone>,
    /// On module 0; none for a body without a rotor.
    pub eccentric: Option<Eccentric>,
    /// How the feet touch the ground; none for no contact at all.
    pub contact: Option<Contact>,
    /// The module (from 0) that is held fast in its nominal pose.
    pub clamped: Option<usize>,
    /// Gravity in the world's frame, m/s². On a slope the world's z is the slope's normal.
    pub gravity: [f64; 3],
    /// What stands around it; only a body with contact meets it. No robot file says any.
    pub walls: Vec<Wall>,
}

/// A box with a foot on either side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Module {
    /// What it is for.
    pub kind: ModuleKind,
    /// Mass, kg.
    pub mass: f64,
    /// Length (x), width (y), height (z), m.
    pub size: [f64; 3],
    /// Where the mass is centred, against the box's centre, in the module's frame, m: 0 for a homogeneous box.
    pub mass_centre: [f64; 3],
    /// About the mass's centre and the module's axes, kg·m²; none for a homogeneous box's.
    pub inertia: Option<[f64; 3]>,
    /// Height of the nominal centre over the lowest point of the longest legs' feet, m; the same for all modules of a plan.
    pub centre_height: f64,
    /// Foot centres, left then right, against the module's centre, in its frame, m.
    pub feet: [[f64; 3]; 2],
    /// Which of the feet are there; one that is not touches nothing.
    pub has_foot: [bool; 2],
    /// Each foot's friction as a share of [`Contact::friction`].
    pub friction_shares: [f64; 2],
}

/// A soft I-beam as a chain of boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backbone {
    /// Roll about the long axis, rad.
    pub roll: f64,
    /// Length, m.
    pub length: f64,
    /// Triples of hinges, and boxes.
    pub segments: usize,
    /// Of one box, kg.
    pub segment_mass: f64,
    /// Width and height of a box, m.
    pub section: [f64; 2],
    /// Of each hinge about x (torsion), y' (stiff), z' (soft), N·m/rad.
    pub stiffness: [f64; 3],
    /// Of each hinge about x, y', z', N·m·s/rad.
    pub damping: [f64; 3],
    /// How a hinge of angle q grows stiffer, `τ = −k q (1 + hardening·q²)`, about x, y', z', 1/rad².
    pub hardening: [f64; 3],
}

/// A bolt that turns about the vertical axis through the centre of module 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eccentric {
    /// Mass, kg.
    pub mass: f64,
    /// Of the bolt's axis from the shaft's, m.
    pub radius: f64,
    /// Of the bolt's centre over the module's centre, m.
    pub height: f64,
    /// Of the bolt about its own centre: about its axis, and across, kg·m².
    pub inertia: [f64; 2],
    /// The bolt's own radius and length, m: for pictures.
    pub bolt: [f64; 2],
    /// Of the position servo that holds the shaft at its phase where no motor is simulated: stiffness, N·m/rad, and damping, N·m·s/rad;
    /// none where it turns whatever torque that takes.
    pub servo: Option<[f64; 2]>,
}

/// How the feet touch the ground: a compliant sphere with friction.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// Of the feet's spheres, m.
    pub foot_radius: f64,
    /// Hunt and Crossley's `k`, N/m.
    pub normal_stiffness: f64,
    /// Hunt and Crossley's `χ`, s/m.
    pub normal_damping: f64,
    /// Along the ground until it slides, N/m.
    pub shear_stiffness: f64,
    /// Along the ground until it slides, N·s/m.
    pub shear_damping: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// What acts at the feet beyond Coulomb's friction.
    pub laws: Laws,
    /// Steps: from x on, the ground's height, m; x increasing. Empty for an even ground.
    pub steps: Vec<[f64; 2]>,
    /// Patches: from x (m) on, a factor on the friction; x increasing.
    pub patches: Vec<[f64; 2]>,
}

/// Why there is no body.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// The robot file has no `[body]`.
    #[error("robot `{0}` has no [body]: it is a motor on a bench")]
    NoBody(String),
    /// Something in the file makes no body.
    #[error("{field}: {what}")]
    Field {
        /// Dotted path in the robot file.
        field: &'static str,
        /// What is wrong, and what to do.
        what: String,
    },
}

/// Standard gravity, m/s². MuJoCo's default, which the reference model uses, is 9.81.
pub const GRAVITY: f64 = 9.81;

impl Plan {
    /// The body of a robot file, at its nominal values.
    ///
    /// # Errors
    /// The file has no body, or one that cannot be built.
    pub fn new(robot: &Robot) -> Result<Self, PlanError> {
        let (Some(body), Some(backbone), Some(feet)) = (&robot.body, &robot.backbone, &robot.feet) else {
            return Err(PlanError::NoBody(robot.name.clone()));
        };
        let modules = modules(&body.modules_with(feet), feet, &robot.effects.laws());
        if modules.len() < 2 {
            let what = format!("{} modules make no chain: name two or more", modules.len());
            return Err(PlanError::Field { field: "body.modules", what });
        }
        let backbones = backbones(backbone, modules.len() - 1, &robot.effects.laws())?;
        let clamped = match body.clamped_module {
            None => None,
            Some(number) if number.fract() == 0.0 && number >= 1.0 && number <= modules.len() as f64 => {
                Some(number as usize - 1)
            }
            Some(number) => {
                let what = format!("there is no module {number}: the robot has {}", modules.len());
                return Err(PlanError::Field { field: "body.clamped_module", what });
            }
        };
        let eccentric = robot.eccentric.as_ref().map(|file| {
            let (mass, radius, length) = (file.mass_kg.value, file.bolt_radius_m.value, file.bolt_length_m.value);
            Eccentric {
                mass,
                radius: file.radius_m.value,
                height: 0.5 * modules[0].size[2] + file.height_m.value,
                inertia: [0.5 * mass * radius * radius, mass * (3.0 * radius * radius + length * length) / 12.0],
                bolt: [radius, length],
                servo: file.servo_nm_per_rad.as_ref().map(|stiffness| {
                    [stiffness.value, file.servo_nm_s_per_rad.as_ref().map_or(0.0, |damping| damping.value)]
                }),
            }
        });
        let (contact, gravity) = (contact(robot), gravity(robot));
        Ok(Self { modules, backbones, eccentric, contact, clamped, gravity, walls: vec![] })
    }

    /// Whether it is a body at all: what a robot file's checks ask, of a plan made by hand.
    ///
    /// # Errors
    /// What is wrong, and where.
    pub fn check(&self) -> Result<(), PlanError> {
        let wrong = |field, what: String| Err(PlanError::Field { field, what });
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if self.modules.len() < 2 || self.backbones.len() + 1 != self.modules.len() {
            let what = format!(
                "{} modules and {} backbones: a chain has two modules or more, and one backbone fewer",
                self.modules.len(),
                self.backbones.len()
            );
            return wrong("body.modules", what);
        }
        for (k, module) in self.modules.iter().enumerate() {
            if !positive(module.mass) || !module.size.iter().all(|side| positive(*side)) {
                return wrong("body", format!("module {}: mass and size must be positive", k + 1));
            }
            let shares = module.friction_shares.iter().all(|share| share.is_finite() && *share >= 0.0);
            let placed = module.mass_centre.iter().chain(module.feet.iter().flatten()).all(|x| x.is_finite());
            if !module.principal_inertia().iter().all(|inertia| positive(*inertia)) || !placed || !shares {
                let what = format!(
                    "module {}: inertia must be positive, friction not negative, and mass and feet somewhere",
                    k + 1
                );
                return wrong("body", what);
            }
            if module.centre_height != self.modules[0].centre_height {
                return wrong(
                    "body",
                    format!("module {} is not as high as the first: backbones lie on one line", k + 1),
                );
            }
        }
        for (b, backbone) in self.backbones.iter().enumerate() {
            let springs = backbone.stiffness.iter().all(|k| k.is_finite() && *k >= 0.0);
            let dampers = backbone.damping.iter().all(|d| d.is_finite() && *d >= 0.0);
            let springs = springs && backbone.hardening.iter().all(|h| h.is_finite() && *h >= 0.0);
            let boxes = positive(backbone.length) && backbone.section.iter().all(|side| positive(*side));
            if backbone.segments == 0 || !positive(backbone.segment_mass) || !boxes || !springs || !dampers {
                let what = format!(
                    "backbone {}: segments, mass, length and section must be positive, stiffness, damping and hardening not negative",
                    b + 1
                );
                return wrong("backbone", what);
            }
        }
        if self.clamped.is_some_and(|k| k >= self.modules.len()) {
            return wrong("body.clamped_module", format!("there are {} modules", self.modules.len()));
        }
        if self.eccentric.is_some_and(|e| !positive(e.mass) || !positive(e.inertia[0]) || !positive(e.inertia[1])) {
            return wrong("eccentric", "its mass and inertia must be positive".into());
        }
        let stands = |wall: &Wall| wall.from.iter().chain(&wall.to).all(|x| x.is_finite()) && wall.from != wall.to;
        if !self.walls.iter().all(stands) {
            return wrong("walls", "a wall needs two different ends".into());
        }
        Ok(())
    }

    /// Distance between the centres of neighbouring modules k and k+1 in the nominal pose, m.
    #[must_use]
    pub fn pitch(&self, k: usize) -> f64 {
        0.5 * (self.modules[k].size[0] + self.modules[k + 1].size[0]) + self.backbones[k].length
    }

    /// Triples of hinges in the whole chain.
    #[must_use]
    pub fn joints(&self) -> usize {
        self.backbones.iter().map(|backbone| backbone.segments).sum()
    }

    /// The backbone that a triple of hinges, or the segment behind it, belongs to; both are counted from the front, from 0.
    ///
    /// # Panics
    /// There are no backbones.
    #[must_use]
    pub fn backbone_of(&self, joint: usize) -> &Backbone {
        let mut first = 0;
        let holds = |backbone: &&Backbone| {
            first += backbone.segments;
            joint < first
        };
        self.backbones.iter().find(holds).unwrap_or(&self.backbones[self.backbones.len() - 1])
    }

    /// Degrees of freedom: three a triple, six of a free robot, one of the rotor.
    #[must_use]
    pub fn degrees_of_freedom(&self) -> usize {
        3 * self.joints() + if self.clamped.is_some() { 0 } else { 6 } + usize::from(self.eccentric.is_some())
    }

    /// Mass of everything, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        let modules: f64 = self.modules.iter().map(|module| module.mass).sum();
        let backbones: f64 = self.backbones.iter().map(|b| b.segments as f64 * b.segment_mass).sum();
        modules + backbones + self.eccentric.map_or(0.0, |eccentric| eccentric.mass)
    }
}

impl Module {
    /// About the mass's centre and the module's axes, kg·m².
    #[must_use]
    pub fn principal_inertia(&self) -> [f64; 3] {
        let of_box = box_inertia(self.mass, self.size);
        self.inertia.unwrap_or([of_box[0][0], of_box[1][1], of_box[2][2]])
    }
}

/// The modules hang on one line. Where the file says nothing else, the highest stands on legs of the length that
/// `feet.leg_m` says and the others' reach as low; a leg that is said by itself is as long as that, and the longest ones
/// carry the robot at the start.
fn modules(numbers: &[ModuleNumbers], file: &FeetFile, laws: &Laws) -> Vec<Module> {
    let highest = numbers.iter().map(|module| module.size[2]).fold(0.0, f64::max);
    let usual = file.leg_m.value + 0.5 * highest;
    let reach = |module: &ModuleNumbers, foot: &FootNumbers| foot.leg.map_or(usual, |leg| 0.5 * module.size[2] + leg);
    let reaches = numbers.iter().flat_map(|module| module.feet.iter().flatten().map(|foot| reach(module, foot)));
    let centre_height = reaches.reduce(f64::max).unwrap_or(usual);
    let module = |(index, numbers): (usize, &ModuleNumbers)| {
        // A foot that is not there keeps its place, for pictures and tables.
        let foot = |side: usize| numbers.feet[side].unwrap_or(FootNumbers { inset: file.inset_m.value, leg: None });
        let centre = |side: usize| {
            let aside = 0.5 * numbers.size[1] - foot(side).inset;
            [0.0, if side == 0 { aside } else { -aside }, file.radius_m.value - reach(numbers, &foot(side))]
        };
        Module {
            kind: numbers.kind,
            mass: numbers.mass,
            size: numbers.size,
            mass_centre: if numbers.kind == ModuleKind::Courier { laws.payload() } else { [0.0; 3] },
            inertia: numbers.inertia.iter().any(Option::is_some).then(|| numbers.principal_inertia()),
            centre_height,
            feet: [centre(0), centre(1)],
            has_foot: numbers.feet.map(|foot| foot.is_some()),
            friction_shares: [laws.foot_share(index, 0), laws.foot_share(index, 1)],
        }
    };
    numbers.iter().enumerate().map(module).collect()
}

fn backbones(file: &BackboneFile, count: usize, laws: &Laws) -> Result<Vec<Backbone>, PlanError> {
    if let Some(roll) = &file.roll_deg
        && roll.len() != count
    {
        let what = format!("{} angles for {count} backbones: give one for each", roll.len());
        return Err(PlanError::Field { field: "backbone.roll_deg", what });
    }
    let roll_deg = |b: usize| file.roll_deg.as_ref().map_or((b + 1) as f64 * file.alpha_deg.value, |roll| roll[b]);
    let stiffness = [file.torsion_nm_per_rad.value, file.stiff_nm_per_rad.value, file.soft_nm_per_rad.value];
    let damping = [file.torsion_nm_s_per_rad.value, file.stiff_nm_s_per_rad.value, file.soft_nm_s_per_rad.value];
    let segments = file.segments.value;
    let backbone = |b: usize| {
        let [stiffer, damped] = laws.backbone_shares(b);
        Backbone {
            roll: roll_deg(b).to_radians(),
            length: file.length_m.value,
            segments: segments as usize,
            segment_mass: file.segment_mass_kg.value,
            section: [file.segment_width_m.value, file.segment_height_m.value],
            stiffness: stiffness.map(|k| stiffer * k),
            damping: damping.map(|d| damped * d),
            // The law is told for the turn of a whole backbone, which its hinges share.
            hardening: laws.hardening().map(|share| segments * segments * share),
        }
    };
    Ok((0..count).map(backbone).collect())
}

fn contact(robot: &Robot) -> Option<Contact> {
    let (feet, ground) = (robot.feet.as_ref()?, robot.ground.as_ref()?);
    Some(Contact {
        foot_radius: feet.radius_m.value,
        normal_stiffness: feet.normal_n_per_m.value,
        normal_damping: feet.normal_s_per_m.value,
        shear_stiffness: feet.shear_n_per_m.value,
        shear_damping: feet.shear_n_s_per_m.value,
        friction: ground.friction.value,
        laws: robot.effects.laws(),
        steps: ground.steps_m.clone().unwrap_or_default(),
        patches: ground.patches_m.clone().unwrap_or_default(),
    })
}

/// The world's z is the ground's normal: on a slope gravity leans.
fn gravity(robot: &Robot) -> [f64; 3] {
    robot.effects.laws().down().map(|share| GRAVITY * share)
}
