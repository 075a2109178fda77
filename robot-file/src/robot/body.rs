//! The body: modules in a row on soft backbones, the eccentric, feet and ground.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Quantity;
use crate::parts::{Pairs, read_words};
use crate::schema::{Part, Place, Reader, Shape, table};

/// What a module is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModuleKind {
    /// Carries motor and eccentric.
    Actuator,
    /// Carries electronics and battery.
    Courier,
    /// Module without actuator and electronics.
    Passive,
}

table! {
    /// `[body]`
    pub struct Body {
        /// The modules from front to rear: two or more of `actuator`, `courier`, `passive`, the first an actuator.
        modules: Vec<ModuleKind>,
        /// The module (1 is the front one) that is held fast; missing for a robot that is free.
        clamped_module: Option<f64> = 1.0..=64.0,
        /// A module with motor and eccentric.
        actuator: Module,
        /// A module with electronics and battery.
        courier: Module,
        /// A module with nothing on it.
        passive: Module,
        /// What one module, by its number from the front, has differently from its kind.
        module: BTreeMap<usize, OwnModule>,
    }
}

table! {
    /// `[body.actuator]`, `[body.courier]`, `[body.passive]`: a homogeneous box.
    pub struct Module {
        /// Mass.
        mass_kg: Quantity = 1e-6..=1.0,
        /// Length, along the chain.
        length_m: Quantity = 1e-4..=1.0,
        /// Width.
        width_m: Quantity = 1e-4..=1.0,
        /// Height.
        height_m: Quantity = 1e-4..=1.0,
    }
}

table! {
    /// `[body.module.N]`: what module N has differently from its kind and from `[feet]`.
    pub struct OwnModule {
        /// Mass.
        mass_kg: Option<Quantity> = 1e-6..=1.0,
        /// Length, along the chain.
        length_m: Option<Quantity> = 1e-4..=1.0,
        /// Width.
        width_m: Option<Quantity> = 1e-4..=1.0,
        /// Height.
        height_m: Option<Quantity> = 1e-4..=1.0,
        /// Inertia about the length axis through the centre of mass, instead of a homogeneous box's.
        inertia_x_kg_m2: Option<Quantity> = 1e-15..=1.0,
        /// Inertia about the width axis through the centre of mass, instead of a homogeneous box's.
        inertia_y_kg_m2: Option<Quantity> = 1e-15..=1.0,
        /// Inertia about the height axis through the centre of mass, instead of a homogeneous box's.
        inertia_z_kg_m2: Option<Quantity> = 1e-15..=1.0,
        /// The feet that it has, `[]` for none; both when nothing is said.
        feet: Option<Vec<Side>>,
        /// From the module's side to the spheres' centres, instead of `feet.inset_m`.
        inset_m: Option<Quantity> = 0.0..=0.1,
        /// From the module's underside to the left foot's lowest point: shorter than the others, it hangs in the air.
        left_leg_m: Option<Quantity> = 1e-4..=0.5,
        /// The same of the right foot.
        right_leg_m: Option<Quantity> = 1e-4..=0.5,
    }
}

table! {
    /// `[backbone]`: a chain of boxes joined by triples of hinges, x (torsion), y (bending, stiff), z (bending, soft), thesis section 3.1.
    pub struct Backbone {
        /// α: backbone b is rolled about the long axis by b·α.
        alpha_deg: Quantity = -360.0..=360.0,
        /// Roll of every backbone by itself, instead of α, 2α, 3α.
        roll_deg: Option<Vec<f64>> = -1080.0..=1080.0,
        /// Length.
        length_m: Quantity = 1e-3..=1.0,
        /// Segments, and triples of hinges, per backbone.
        segments: Quantity = 1.0..=100.0,
        /// Mass of a segment.
        segment_mass_kg: Quantity = 1e-9..=0.01,
        /// Width of a segment's box, along y.
        segment_width_m: Quantity = 1e-5..=1.0,
        /// Height of a segment's box, along z.
        segment_height_m: Quantity = 1e-5..=1.0,
        /// Stiffness of a hinge, torsion about x.
        torsion_nm_per_rad: Quantity = 1e-6..=1000.0,
        /// Stiffness of a hinge, bending about y.
        stiff_nm_per_rad: Quantity = 1e-6..=1000.0,
        /// Stiffness of a hinge, bending about z.
        soft_nm_per_rad: Quantity = 1e-6..=1000.0,
        /// Damping of a hinge, torsion about x.
        torsion_nm_s_per_rad: Quantity = 0.0..=1.0,
        /// Damping of a hinge, bending about y.
        stiff_nm_s_per_rad: Quantity = 0.0..=1.0,
        /// Damping of a hinge, bending about z.
        soft_nm_s_per_rad: Quantity = 0.0..=1.0,
    }
}

table! {
    /// `[eccentric]`: a bolt beside the vertical shaft of the actuator module, its axis parallel to the shaft's.
    pub struct Eccentric {
        /// Mass.
        mass_kg: Quantity = 1e-6..=1.0,
        /// Distance of the bolt's axis from the shaft's.
        radius_m: Quantity = 0.0..=0.1,
        /// Height of the bolt's centre over the module's top.
        height_m: Quantity = 0.0..=0.1,
        /// The bolt's own radius.
        bolt_radius_m: Quantity = 1e-4..=0.05,
        /// The bolt's own length.
        bolt_length_m: Quantity = 1e-4..=0.1,
        /// How stiffly the shaft is held at its phase where no motor is simulated (identification of a robot, its walk's diagnosis,
        /// MuJoCo's model): stiffness of a position servo. Without it the shaft turns at its frequency whatever torque that takes.
        servo_nm_per_rad: Option<Quantity> = 1e-4..=1e3,
        /// Damping of that servo; 0 without it.
        servo_nm_s_per_rad: Option<Quantity> = 0.0..=10.0,
    }
}

table! {
    /// `[feet]`: a sphere at the end of a massless leg on either side of every module.
    pub struct Feet {
        /// From the module's underside to the foot's lowest point.
        leg_m: Quantity = 1e-4..=0.5,
        /// Radius of the sphere.
        radius_m: Quantity = 1e-5..=0.1,
        /// From the module's side to the sphere's centre.
        inset_m: Quantity = 0.0..=0.1,
        /// Stiffness k of the contact along the normal, `F = k δ (1 + χ dδ/dt)` (Hunt and Crossley 1975).
        normal_n_per_m: Quantity = 1.0..=1e6,
        /// Damping χ of the contact along the normal.
        normal_s_per_m: Quantity = 0.0..=1000.0,
        /// Stiffness of the contact along the ground until it slides.
        shear_n_per_m: Quantity = 1.0..=1e6,
        /// Damping of the contact along the ground until it slides.
        shear_n_s_per_m: Quantity = 0.0..=1000.0,
    }
}

table! {
    /// `[ground]`
    pub struct Ground {
        /// Coefficient of friction of the feet.
        friction: Quantity = 0.0..=10.0,
        /// Steps: from x on, the ground's height; x increasing. Missing for an even ground.
        steps_m: Option<Vec<[f64; 2]>> = Pairs {
            bounds: [-100.0..=100.0, -1.0..=1.0],
            units: ["m", "m"],
            rule: "x -100 … 100, increasing, and height -1 … 1; the feet start on height 0",
        },
        /// Patches: from x on, a factor on the friction; x increasing. Missing for the same friction everywhere.
        patches_m: Option<Vec<[f64; 2]>> = Pairs {
            bounds: [-100.0..=100.0, 0.0..=10.0],
            units: ["m", "1"],
            rule: "x -100 … 100, increasing, and factor 0 … 10",
        },
    }
}

impl Eccentric {
    /// Its inertia about the shaft, `m (r² + ½ r_bolt²)`, kg·m².
    #[must_use]
    pub fn inertia_kg_m2(&self) -> f64 {
        let (radius, bolt) = (self.radius_m.value, self.bolt_radius_m.value);
        self.mass_kg.value * (radius * radius + 0.5 * bolt * bolt)
    }
}

/// A module with all that is its own: SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModuleNumbers {
    /// What it is for.
    pub kind: ModuleKind,
    /// Mass, kg.
    pub mass: f64,
    /// Length (x), width (y), height (z), m.
    pub size: [f64; 3],
    /// About the centre of mass and the module's axes x, y, z, where the file says it, kg·m².
    pub inertia: [Option<f64>; 3],
    /// The left and the right foot, where it has them.
    pub feet: [Option<FootNumbers>; 2],
}

/// A foot of a module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootNumbers {
    /// From the module's side to the sphere's centre, m.
    pub inset: f64,
    /// From the module's underside to the lowest point, m; none where the foot reaches as low as the others.
    pub leg: Option<f64>,
}

impl ModuleNumbers {
    /// Inertia about the centre of mass and the axes x, y, z: the file's, or a homogeneous box's, kg·m².
    #[must_use]
    pub fn principal_inertia(&self) -> [f64; 3] {
        let [x, y, z] = self.size.map(|side| side * side * self.mass / 12.0);
        let of_box = [y + z, x + z, x + y];
        [0, 1, 2].map(|axis| self.inertia[axis].unwrap_or(of_box[axis]))
    }
}

impl Body {
    /// The modules from front to rear: each one's kind, and what is its own.
    #[must_use]
    pub fn modules_with(&self, feet: &Feet) -> Vec<ModuleNumbers> {
        let module = |(index, kind): (usize, &ModuleKind)| {
            let file = match kind {
                ModuleKind::Actuator => &self.actuator,
                ModuleKind::Courier => &self.courier,
                ModuleKind::Passive => &self.passive,
            };
            let own = self.module.get(&(index + 1));
            let or = |read: fn(&OwnModule) -> &Option<Quantity>, otherwise: &Quantity| {
                own.and_then(|own| read(own).as_ref()).unwrap_or(otherwise).value
            };
            let own_value =
                |read: fn(&OwnModule) -> &Option<Quantity>| own.and_then(|own| read(own).as_ref()).map(|it| it.value);
            let has = |side: Side| own.and_then(|own| own.feet.as_ref()).is_none_or(|feet| feet.contains(&side));
            let foot = |side, leg| {
                has(side).then(|| FootNumbers { inset: or(|own| &own.inset_m, &feet.inset_m), leg: own_value(leg) })
            };
            ModuleNumbers {
                kind: *kind,
                mass: or(|own| &own.mass_kg, &file.mass_kg),
                size: [
                    or(|own| &own.length_m, &file.length_m),
                    or(|own| &own.width_m, &file.width_m),
                    or(|own| &own.height_m, &file.height_m),
                ],
                inertia: [
                    own_value(|own| &own.inertia_x_kg_m2),
                    own_value(|own| &own.inertia_y_kg_m2),
                    own_value(|own| &own.inertia_z_kg_m2),
                ],
                feet: [foot(Side::Left, |own| &own.left_leg_m), foot(Side::Right, |own| &own.right_leg_m)],
            }
        };
        self.modules.iter().enumerate().map(module).collect()
    }
}

const KINDS: [(&str, ModuleKind); 3] =
    [("actuator", ModuleKind::Actuator), ("courier", ModuleKind::Courier), ("passive", ModuleKind::Passive)];

impl ModuleKind {
    /// As the robot file spells it.
    #[must_use]
    pub fn name(self) -> &'static str {
        KINDS.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }
}

/// A side of a module, seen from above with x ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Towards +y.
    Left,
    /// Towards −y.
    Right,
}

const SIDES: [(&str, Side); 2] = [("left", Side::Left), ("right", Side::Right)];

impl Part for Vec<Side> {
    type Spec = ();

    fn shape((): &()) -> Shape {
        Shape::Words(&["left", "right"])
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        read_words(reader, place, ("side of a module", "an array of `left` and `right`"), &SIDES)
    }
}

impl Part for Vec<ModuleKind> {
    type Spec = ();

    fn shape((): &()) -> Shape {
        Shape::Words(&["actuator", "courier", "passive"])
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        read_words(reader, place, ("kind of module", "an array of module kinds"), &KINDS)
    }
}
