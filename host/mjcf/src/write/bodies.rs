//! The tree of bodies: modules, segments, hinges, feet and rotor.

use super::{AXES, Writer, friction_words, hinge_class};
use crate::chain::{Part, Segment, Triple};
use crate::xml::numbers;

/// Radius of the legs' capsules, which are only seen, m.
const LEG_RADIUS: f64 = 0.0012;
/// Where the tree of bodies passes a triple of hinges.
#[derive(Clone, Copy, PartialEq)]
enum Towards {
    Rear,
    Front,
}

impl Writer<'_> {
    /// The tree of bodies: the root, what is behind it, then what is in front of it.
    pub(super) fn bodies(&mut self, root: usize) {
        let (chain, start) = (self.chain, self.chain.part_of(root));
        let origin = chain.modules[root];
        self.open_body(&chain.parts[start], [origin, 0.0, chain.height]);
        if self.plan.clamped.is_none() {
            self.xml.element("freejoint", &[("name", "root".into())]);
        }
        self.part(&chain.parts[start], origin);
        self.branch((start..chain.triples.len()).map(|i| (i, i + 1)), origin, Towards::Rear);
        self.branch((0..start).rev().map(|i| (i, i)), origin, Towards::Front);
        self.xml.close();
    }

    /// Bodies inside each other, each with the triple of hinges that leads to it.
    fn branch(&mut self, steps: impl Iterator<Item = (usize, usize)>, root: f64, towards: Towards) {
        let (chain, mut parent, mut depth) = (self.chain, root, 0);
        for (triple, part) in steps {
            let (triple, part) = (&chain.triples[triple], &chain.parts[part]);
            self.open_body(part, [triple.x - parent, 0.0, 0.0]);
            self.hinges(triple, towards);
            self.part(part, triple.x);
            parent = triple.x;
            depth += 1;
        }
        for _ in 0..depth {
            self.xml.close();
        }
    }

    fn open_body(&mut self, part: &Part, position: [f64; 3]) {
        let name = match (part.module, &part.segment) {
            (Some(module), _) => format!("m{}", module + 1),
            (None, Some(segment)) => segment_name(segment),
            (None, None) => String::new(),
        };
        self.xml.open("body", &[("name", name.into()), ("pos", numbers(&position))]);
    }

    /// In MuJoCo the first joint of a body is the one next to its parent: towards the front the order turns round, and
    /// so do the axes, so that an angle has the same sign whichever module is the root.
    fn hinges(&mut self, triple: &Triple, towards: Towards) {
        let (sin, cos) = self.plan.backbones[triple.backbone].roll.sin_cos();
        let mut axes = [[1.0, 0.0, 0.0], [0.0, cos, sin], [0.0, -sin, cos]].into_iter().zip(AXES).collect::<Vec<_>>();
        if towards == Towards::Front {
            axes.reverse();
        }
        for (axis, name) in axes {
            let axis = if towards == Towards::Front { axis.map(|part| -part) } else { axis };
            let joint = [
                ("name", format!("b{}h{}{name}", triple.backbone + 1, triple.number + 1).into()),
                ("class", hinge_class(triple.backbone, name).into()),
                ("axis", numbers(&axis)),
            ];
            self.xml.element("joint", &joint);
        }
    }

    /// What a part is made of, in a frame at `origin` along x and the modules' height.
    fn part(&mut self, part: &Part, origin: f64) {
        if let Some(segment) = &part.segment {
            self.segment(segment, origin);
        }
        if let Some(module) = part.module {
            self.module(module, self.chain.modules[module] - origin);
        }
    }

    fn segment(&mut self, segment: &Segment, origin: f64) {
        let backbone = &self.plan.backbones[segment.backbone];
        let (sin, cos) = (0.5 * backbone.roll).sin_cos();
        let half = [0.5 * segment.length, 0.5 * backbone.section[0], 0.5 * backbone.section[1]];
        let attributes = [
            ("name", segment_name(segment).into()),
            ("class", "seen".into()),
            ("type", "box".into()),
            ("size", numbers(&half)),
            ("pos", numbers(&[segment.x - origin, 0.0, 0.0])),
            ("quat", numbers(&[cos, sin, 0.0, 0.0])),
            ("mass", numbers(&[backbone.segment_mass])),
        ];
        self.xml.element("geom", &attributes);
    }

    fn module(&mut self, index: usize, x: f64) {
        let module = &self.plan.modules[index];
        let centre = numbers(&[x, 0.0, 0.0]);
        let name = format!("module{}", index + 1);
        // What is no homogeneous box hangs its mass on the module as a body of its own, which nothing moves against it.
        let uneven = module.inertia.is_some() || module.mass_centre != [0.0; 3];
        let attributes = [
            ("name", name.clone().into()),
            ("class", "seen".into()),
            ("type", "box".into()),
            ("size", numbers(&module.size.map(|side| 0.5 * side))),
            ("pos", centre.clone()),
            ("mass", numbers(&[if uneven { 0.0 } else { module.mass }])),
        ];
        self.xml.element("geom", &attributes);
        self.xml.element("site", &[("name", name.clone().into()), ("pos", centre.clone())]);
        if uneven {
            self.xml.open("body", &[("name", format!("{name}mass").into()), ("pos", centre)]);
            let inertial = [
                ("pos", numbers(&module.mass_centre)),
                ("mass", numbers(&[module.mass])),
                ("diaginertia", numbers(&module.principal_inertia())),
            ];
            self.xml.element("inertial", &inertial);
            self.xml.close();
        }
        for side in (0..2).filter(|side| module.has_foot[*side]) {
            self.foot(index, side, x);
        }
        if index == 0 {
            self.rotor(x);
        }
    }

    /// A leg that is only seen, and the sphere that touches the ground.
    fn foot(&mut self, index: usize, side: usize, x: f64) {
        let module = &self.plan.modules[index];
        let name = format!("foot{}{}", index + 1, ["L", "R"][side]);
        let [along, aside, up] = module.feet[side];
        let centre = [x + along, aside, up];
        let leg = [centre[0], centre[1], -0.5 * module.size[2], centre[0], centre[1], centre[2]];
        let attributes = [
            ("class", "seen".into()),
            ("type", "capsule".into()),
            ("size", numbers(&[LEG_RADIUS])),
            ("fromto", numbers(&leg)),
            ("mass", "0".into()),
        ];
        self.xml.element("geom", &attributes);
        if let Some(friction) = self.contact().map(|contact| contact.friction) {
            let mut sphere = vec![("name", name.clone().into()), ("class", "foot".into()), ("pos", numbers(&centre))];
            let share = module.friction_shares[side];
            if share != 1.0 {
                sphere.push(("friction", friction_words(share * friction)));
            }
            self.xml.element("geom", &sphere);
        }
        self.xml.element("site", &[("name", name.into()), ("pos", numbers(&centre))]);
    }

    fn rotor(&mut self, x: f64) {
        let Some(eccentric) = self.plan.eccentric else { return };
        let bolt = [eccentric.radius, 0.0, 0.0];
        let [along, across] = eccentric.inertia;
        self.xml.open("body", &[("name", "rotor".into()), ("pos", numbers(&[x, 0.0, eccentric.height]))]);
        self.xml.element("joint", &[("name", "rotor".into()), ("type", "hinge".into()), ("axis", "0 0 1".into())]);
        let inertial = [
            ("pos", numbers(&bolt)),
            ("mass", numbers(&[eccentric.mass])),
            ("diaginertia", numbers(&[across, across, along])),
        ];
        self.xml.element("inertial", &inertial);
        let geom = [
            ("name", "bolt".into()),
            ("class", "seen".into()),
            ("type", "cylinder".into()),
            ("size", numbers(&[eccentric.bolt[0], 0.5 * eccentric.bolt[1]])),
            ("pos", numbers(&bolt)),
        ];
        self.xml.element("geom", &geom);
        self.xml.close();
    }
}

fn segment_name(segment: &Segment) -> String {
    format!("b{}s{}", segment.backbone + 1, segment.number + 1)
}
