//! Writing the model: settings, shared properties, ground, the tree of bodies, the servo.

mod bodies;

use std::borrow::Cow;

use hal_sim::body::Plan;
use hal_sim::body::plan::{Backbone, Contact};

use super::Options;
use super::chain::Chain;
use super::ground::{centre, depth, half_size, stretches};
use super::words::word;
use super::xml::{Xml, numbers};

/// Half the sides of the ground's plane as it is drawn, and its grid, m.
const PLANE: [f64; 3] = [2.0, 2.0, 0.1];
/// MuJoCo's torsional and rolling friction, which contacts of three dimensions do not use.
const UNUSED_FRICTION: [f64; 2] = [0.002, 0.0001];
/// The axes of a triple from front to rear.
const AXES: [&str; 3] = ["x", "y", "z"];

/// What is being written, and of what.
struct Writer<'a> {
    xml: Xml,
    plan: &'a Plan,
    options: &'a Options,
    chain: &'a Chain,
}

/// The model as text; everything has been checked.
pub(super) fn model(name: &str, plan: &Plan, options: &Options, chain: &Chain, root: usize) -> String {
    let mut writer = Writer { xml: Xml::default(), plan, options, chain };
    writer.xml.comment(&heading(name, root));
    writer.xml.open("mujoco", &[("model", name.into())]);
    writer.settings();
    writer.classes();
    writer.xml.open("worldbody", &[]);
    writer.ground();
    writer.bodies(root);
    writer.xml.close();
    writer.servo();
    writer.xml.finish()
}

fn heading(name: &str, root: usize) -> String {
    format!(
        "{name}, written by `scram export mjcf`. SI units; nominal pose: along x, module 1 in front at the origin, z up.\n\
         The free joint or the clamp is on module {}. The rotor turns counter-clockwise with positive speed, seen from above.\n\
         Not carried over: the feet's own law of contact (stiffness, damping and grip). MuJoCo's soft constraint stands in\n\
         its place, with the same coefficient of friction: compare motion on the ground, not forces at the feet.",
        root + 1
    )
}

impl Writer<'_> {
    fn settings(&mut self) {
        let compiler: [(&str, Cow<str>); 4] = [
            ("angle", "radian".into()),
            ("autolimits", "true".into()),
            ("boundmass", "0".into()),
            ("boundinertia", "0".into()),
        ];
        self.xml.element("compiler", &compiler);
        let option = [
            ("timestep", numbers(&[self.options.timestep_s])),
            ("integrator", word(self.options.integrator).into()),
            ("solver", word(self.options.solver).into()),
            ("cone", word(self.options.cone).into()),
            ("impratio", numbers(&[self.options.impratio])),
            ("gravity", numbers(&self.plan.gravity)),
        ];
        if self.contact().is_some() {
            self.xml.element("option", &option);
        } else {
            self.xml.open("option", &option);
            self.xml.element("flag", &[("contact", "disable".into())]);
            self.xml.close();
        }
    }

    /// How the feet touch, unless they do not.
    fn contact(&self) -> Option<&Contact> {
        self.plan.contact.as_ref().filter(|_| self.options.contact)
    }

    /// What many elements share.
    fn classes(&mut self) {
        self.xml.open("default", &[]);
        let untouchable: [(&str, Cow<str>); 2] = [("contype", "0".into()), ("conaffinity", "0".into())];
        self.class("seen", "geom", &untouchable);
        if let Some(contact) = self.contact().cloned() {
            let mut foot: Vec<(&str, Cow<str>)> = vec![
                ("type", "sphere".into()),
                ("size", numbers(&[contact.foot_radius])),
                ("mass", "0".into()),
                ("contype", "1".into()),
                ("conaffinity", "0".into()),
                ("priority", "1".into()),
            ];
            foot.extend(self.touch(contact.friction));
            self.class("foot", "geom", &foot);
        }
        for (b, backbone) in self.plan.backbones.iter().enumerate() {
            for (axis, name) in AXES.iter().enumerate() {
                let hinge = [
                    ("type", "hinge".into()),
                    ("stiffness", numbers(&stiffness(backbone, axis))),
                    ("damping", numbers(&[backbone.damping[axis]])),
                ];
                self.class(&hinge_class(b, name), "joint", &hinge);
            }
        }
        self.xml.close();
    }

    fn class(&mut self, class: &str, tag: &'static str, attributes: &[(&str, Cow<'_, str>)]) {
        self.xml.open("default", &[("class", class.into())]);
        self.xml.element(tag, attributes);
        self.xml.close();
    }

    /// How a foot and the ground touch.
    fn touch(&self, friction: f64) -> [(&'static str, Cow<'static, str>); 4] {
        [
            ("condim", "3".into()),
            ("friction", friction_words(friction)),
            ("solref", numbers(&self.options.solref)),
            ("solimp", numbers(&self.options.solimp)),
        ]
    }

    fn ground(&mut self) {
        let stretches = self.contact().map(stretches).unwrap_or_default();
        if stretches.is_empty() {
            let plane = [
                ("name", "ground".into()),
                ("type", "plane".into()),
                ("size", numbers(&PLANE)),
                ("contype", "0".into()),
                ("conaffinity", "1".into()),
            ];
            self.xml.element("geom", &plane);
        }
        let depth = depth(&stretches);
        for (index, stretch) in stretches.iter().enumerate() {
            let mut attributes = vec![
                ("name", format!("ground{}", index + 1).into()),
                ("type", "box".into()),
                ("size", numbers(&half_size(stretch, depth))),
                ("pos", numbers(&centre(stretch, depth))),
                ("contype", "0".into()),
                ("conaffinity", "1".into()),
                // Over the feet's: the friction is the ground's.
                ("priority", "2".into()),
            ];
            attributes.extend(self.touch(stretch.friction));
            self.xml.element("geom", &attributes);
        }
    }

    fn servo(&mut self) {
        let Some(eccentric) = self.plan.eccentric else { return };
        let [stiffness, damping] =
            eccentric.servo.unwrap_or([self.options.servo_nm_per_rad, self.options.servo_nm_s_per_rad]);
        self.xml.open("actuator", &[]);
        let servo = [
            ("name", "rotor".into()),
            ("joint", "rotor".into()),
            ("kp", numbers(&[stiffness])),
            ("kv", numbers(&[damping])),
        ];
        self.xml.element("position", &servo);
        self.xml.close();
    }
}

fn friction_words(friction: f64) -> Cow<'static, str> {
    numbers(&[friction, UNUSED_FRICTION[0], UNUSED_FRICTION[1]])
}

/// MuJoCo's polynomial: of a hinge's angle q the torque is `−(k + a·|q| + b·q²)·q`.
fn stiffness(backbone: &Backbone, axis: usize) -> Vec<f64> {
    let (k, hardening) = (backbone.stiffness[axis], backbone.hardening[axis]);
    if hardening == 0.0 { vec![k] } else { vec![k, 0.0, k * hardening] }
}

fn hinge_class(backbone: usize, axis: &str) -> String {
    format!("b{}{axis}", backbone + 1)
}
