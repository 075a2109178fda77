//! The body: modules in a row on soft backbones, the eccentric, feet and ground.

use serde::Serialize;

use super::Quantity;
use crate::parts::Pairs;
use crate::schema::{Part, Place, Reader, Shape, nearest, table};
use crate::tree::Value;

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

const KINDS: [(&str, ModuleKind); 3] =
    [("actuator", ModuleKind::Actuator), ("courier", ModuleKind::Courier), ("passive", ModuleKind::Passive)];

impl ModuleKind {
    /// As the robot file spells it.
    #[must_use]
    pub fn name(self) -> &'static str {
        KINDS.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }
}

impl Part for Vec<ModuleKind> {
    type Spec = ();

    fn shape((): &()) -> Shape {
        Shape::Words(&["actuator", "courier", "passive"])
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        let how = format!("`{} = [\"actuator\", \"courier\", \"passive\", …]`", place.key);
        let entry = reader.need(place, "field", how)?;
        let Value::Array(items) = &entry.value else {
            reader.wrong_type(place, entry, "an array of module kinds");
            return None;
        };
        let mut kinds = Vec::with_capacity(items.len());
        for (at, item) in items {
            let Value::Text(text) = item else {
                let message = format!("expected a kind of module, found {}", item.what());
                reader.wrong(at, place.field(), message, None);
                return None;
            };
            let Some((_, kind)) = KINDS.iter().find(|(name, _)| name == text) else {
                let near = nearest(text, &KINDS.map(|(name, _)| name));
                let near = near.map_or(String::new(), |near| format!("did you mean `{near}`? "));
                let help = Some(format!("{near}allowed are actuator, courier, passive"));
                reader.wrong(at, place.field(), format!("unknown kind of module `{text}`"), help);
                return None;
            };
            kinds.push(*kind);
        }
        Some(kinds)
    }
}
