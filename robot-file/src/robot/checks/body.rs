//! The body's checks: what must hold between `[body]`, `[backbone]`, `[eccentric]`, `[feet]`, `[ground]` and `[load]`.

use super::Checks;
use crate::robot::{Backbone, Body, Eccentric, Feet, Ground, ModuleKind, ModuleNumbers, Robot};
use crate::unit::number;

/// Longest chain of modules.
const MOST_MODULES: usize = 64;
/// Largest share by which `[load]` may differ from what the eccentric makes: more than rounding.
const LOAD_SHARE: f64 = 0.01;
/// Fewer feet carry nothing.
const LEAST_FEET: usize = 3;

impl Checks<'_> {
    pub(super) fn body(&mut self, robot: &Robot) {
        self.whole_body(robot);
        let (Some(body), Some(backbone), Some(feet), Some(ground)) =
            (&robot.body, &robot.backbone, &robot.feet, &robot.ground)
        else {
            return;
        };
        let modules = body.modules_with(feet);
        self.modules(body);
        self.own_modules(body, &modules);
        self.backbone(backbone, body.modules.len());
        self.feet(feet, body, &modules);
        self.uneven_effects(robot, body);
        self.ground(ground, feet, &module_places(&modules, backbone));
        if let Some(eccentric) = &robot.eccentric {
            self.load(robot.load.inertia_kg_m2.value, eccentric);
        }
    }

    /// All five tables or none, and no effect of the feet without them.
    fn whole_body(&mut self, robot: &Robot) {
        let tables = [
            ("body", robot.body.is_some()),
            ("backbone", robot.backbone.is_some()),
            ("eccentric", robot.eccentric.is_some()),
            ("feet", robot.feet.is_some()),
            ("ground", robot.ground.is_some()),
        ];
        let named = |there: bool| -> Vec<_> {
            tables.iter().filter(|(_, is)| *is == there).map(|(name, _)| format!("[{name}]")).collect()
        };
        let missing = named(false).join(", ");
        if let Some((first, _)) = tables.iter().find(|(_, there)| *there)
            && !missing.is_empty()
        {
            let message =
                format!("stands without {missing}: [body], [backbone], [eccentric], [feet] and [ground] are one");
            self.wrong(first, &message, &format!("add {missing}, or remove {}", named(true).join(", ")));
        }
        for id in robot.effects.listed().filter(|id| id.spec().acts.on_the_ground()) {
            if robot.body.is_none() {
                let path = format!("effects.{}", id.name());
                self.wrong(&path, "needs a body: there are no feet on the ground", "remove it, or add [body]");
            }
        }
    }

    fn modules(&mut self, body: &Body) {
        let path = "body.modules";
        let count = body.modules.len();
        if !(2..=MOST_MODULES).contains(&count) {
            let message = format!("a chain has 2 to {MOST_MODULES} modules, found {count}");
            self.wrong(path, &message, "name them from front to rear, e.g. [\"actuator\", \"courier\", \"passive\"]");
        } else if body.modules[0] != ModuleKind::Actuator || body.modules[1..].contains(&ModuleKind::Actuator) {
            let help = "name `actuator` once, at the front";
            self.wrong(path, "the first module is the actuator, and the only one: it carries the eccentric", help);
        }
        if let Some(clamped) = body.clamped_module {
            let path = "body.clamped_module";
            if clamped.fract() != 0.0 {
                self.whole(path, clamped);
            } else if clamped > count as f64 {
                let message = format!("there is no module {clamped}: the robot has {count}");
                self.wrong(path, &message, &format!("write 1 (the front one) to {count}"));
            }
        }
    }

    /// What modules have of their own: they are there, their inertias are a body's, and enough feet are left.
    fn own_modules(&mut self, body: &Body, modules: &[ModuleNumbers]) {
        let count = modules.len();
        for number in body.module.keys().filter(|number| **number > count) {
            let message = format!("there is no module {number}: the robot has {count}");
            self.wrong(&format!("body.module.{number}"), &message, &format!("write 1 (the front one) to {count}"));
        }
        for (place, module) in body.module.keys().filter_map(|place| Some((place, modules.get(place - 1)?))) {
            let inertia = module.principal_inertia();
            for (axis, others) in [(0, [1, 2]), (1, [0, 2]), (2, [0, 1])] {
                if inertia[axis] > inertia[others[0]] + inertia[others[1]] {
                    let name = ["x", "y", "z"];
                    let message = format!(
                        "the inertia about {} is {} kg·m², more than those about the other two axes together, {}: no mass \
                         is spread so",
                        name[axis],
                        number(inertia[axis]),
                        number(inertia[others[0]] + inertia[others[1]])
                    );
                    let help =
                        "compare inertia_x_kg_m2, inertia_y_kg_m2 and inertia_z_kg_m2; what is left out is the box's";
                    self.wrong(&format!("body.module.{place}"), &message, help);
                }
            }
        }
        let feet = modules.iter().flat_map(|module| module.feet).flatten().count();
        let without = body.module.iter().find(|(_, own)| own.feet.is_some()).map(|(number, _)| number);
        if feet < LEAST_FEET
            && body.clamped_module.is_none()
            && let Some(number) = without
        {
            let message = format!("the robot stands on {feet} feet and falls over");
            let help = format!("leave it {LEAST_FEET} or more, or hold a module fast with body.clamped_module");
            self.wrong(&format!("body.module.{number}.feet"), &message, &help);
        }
    }

    /// No effect speaks of a module, a foot or a backbone that the robot has not.
    fn uneven_effects(&mut self, robot: &Robot, body: &Body) {
        let count = body.modules.len();
        let courier = body.modules.contains(&ModuleKind::Courier);
        for id in robot.effects.listed() {
            let path = format!("effects.{}", id.name());
            let mut alone = effects::Laws::NONE;
            id.put(&mut alone, robot.effects.values(id).as_deref());
            let absent = |first: usize, speaks: &dyn Fn(usize) -> bool| (first..MOST_MODULES).find(|k| speaks(*k));
            if let Some(module) = absent(count, &|k| (0..2).any(|side| alone.foot_share(k, side) != 1.0)) {
                let message = format!("speaks of the feet of module {}: the robot has {count} modules", module + 1);
                self.wrong(&path, &message, "write 1 for feet that are not there");
            }
            let backbones = count.saturating_sub(1);
            if let Some(backbone) = absent(backbones, &|b| alone.backbone_shares(b) != [1.0; 2]) {
                let message = format!("speaks of backbone {}: the robot has {backbones}", backbone + 1);
                self.wrong(&path, &message, "write 1 for a backbone that is not there");
            }
            if alone.payload() != [0.0; 3] && !courier {
                self.wrong(&path, "needs a courier: no module of body.modules is one", "remove it, or add a courier");
            }
        }
    }

    fn backbone(&mut self, backbone: &Backbone, modules: usize) {
        self.whole("backbone.segments", backbone.segments.value);
        let count = modules.saturating_sub(1);
        if let Some(roll) = &backbone.roll_deg
            && roll.len() != count
        {
            let message = format!("{modules} modules have {count} backbones, found {} angles", roll.len());
            self.wrong("backbone.roll_deg", &message, "give one angle a backbone, from front to rear");
        }
    }

    fn feet(&mut self, feet: &Feet, body: &Body, modules: &[ModuleNumbers]) {
        for (name, module) in [("actuator", &body.actuator), ("courier", &body.courier), ("passive", &body.passive)] {
            let half = 0.5 * module.width_m.value;
            if feet.inset_m.value >= half {
                let message = format!(
                    "must be less than half of body.{name}.width_m: the feet stand left and right of the middle"
                );
                self.wrong("feet.inset_m", &message, &format!("write less than {} m", number(half)));
            }
        }
        if feet.radius_m.value >= feet.leg_m.value {
            let help = format!("write less than feet.leg_m, {} m", number(feet.leg_m.value));
            self.wrong("feet.radius_m", "the foot is larger than its leg: it would be inside the module", &help);
        }
        for (place, own) in &body.module {
            let path = format!("body.module.{place}");
            let Some(module) = modules.get(place - 1) else { continue };
            let half = 0.5 * module.size[1];
            if module.feet.iter().flatten().any(|foot| foot.inset >= half)
                && (own.inset_m.is_some() || own.width_m.is_some())
            {
                let message =
                    "its feet's inset must be less than half of its width: they stand left and right of the middle";
                self.wrong(&path, message, &format!("write an inset_m of less than {} m", number(half)));
            }
            for (key, leg) in [("left_leg_m", &own.left_leg_m), ("right_leg_m", &own.right_leg_m)] {
                if leg.as_ref().is_some_and(|leg| leg.value <= feet.radius_m.value) {
                    let help = format!("write more than feet.radius_m, {} m", number(feet.radius_m.value));
                    let message = "the foot is larger than its leg: it would be inside the module";
                    self.wrong(&format!("{path}.{key}"), message, &help);
                }
            }
        }
    }

    fn ground(&mut self, ground: &Ground, feet: &Feet, places: &[f64]) {
        for (path, pairs) in [("ground.steps_m", &ground.steps_m), ("ground.patches_m", &ground.patches_m)] {
            if pairs.as_ref().is_some_and(|pairs| pairs.windows(2).any(|pair| pair[0][0] >= pair[1][0])) {
                self.wrong(path, "x must increase", "order the pairs from rear to front (x points ahead)");
            }
        }
        let Some(steps) = &ground.steps_m else { return };
        let radius = feet.radius_m.value;
        // The highest ground under a foot decides.
        let under = |x: f64| highest(steps, x - radius, x + radius);
        let Some(module) = (0..places.len()).find(|&module| under(places[module]) > 0.0) else { return };
        let message = format!(
            "the feet of module {} start below ground: at x = {} m it is {} m high, and the feet start on height 0",
            module + 1,
            number(places[module]),
            number(under(places[module])),
        );
        let (front, rear) = (places[0] + radius, places[places.len() - 1] - radius);
        let help = format!(
            "let the ground rise ahead of x = {} m or behind x = {} m, or lower it",
            number(front),
            number(rear)
        );
        self.wrong("ground.steps_m", &message, &help);
    }

    fn load(&mut self, load: f64, eccentric: &Eccentric) {
        let made = eccentric.inertia_kg_m2();
        if (load / made - 1.0).abs() > LOAD_SHARE {
            let message = format!(
                "{} kg·m² is not the inertia of [eccentric] about the shaft, m (r² + ½ r_bolt²) = {} kg·m²",
                number(load),
                number(made)
            );
            self.wrong("load.inertia_kg_m2", &message, &format!("write {}, or change [eccentric]", number(made)));
        }
    }
}

/// Nominal x of every module's centre, where its feet are, m; 0 for the front one.
fn module_places(modules: &[ModuleNumbers], backbone: &Backbone) -> Vec<f64> {
    let half = |module: &ModuleNumbers| 0.5 * module.size[0];
    let mut x = 0.0;
    let mut places = vec![x; modules.len().min(1)];
    for pair in modules.windows(2) {
        x -= half(&pair[0]) + backbone.length_m.value + half(&pair[1]);
        places.push(x);
    }
    places
}

/// The greatest height of the ground between two x, m.
fn highest(steps: &[[f64; 2]], from: f64, to: f64) -> f64 {
    let at_from = steps.iter().rev().find(|[x, _]| *x <= from).map_or(0.0, |[_, height]| *height);
    steps.iter().filter(|[x, _]| (from..=to).contains(x)).map(|[_, height]| *height).fold(at_from, f64::max)
}
