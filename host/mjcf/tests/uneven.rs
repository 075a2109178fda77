//! A body that is not even, as MuJoCo's model has it.

use std::path::Path;

use hal_sim::body::Plan;
use mjcf::{MjcfError, Options, model};
use roxmltree::{Document, Node};

fn even() -> Plan {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml"));
    Plan::new(&robot_file::Robot::load(path).unwrap()).unwrap()
}

fn named<'a>(document: &'a Document<'_>, tag: &str, name: &str) -> Option<Node<'a, 'a>> {
    document.descendants().find(|node| node.has_tag_name(tag) && node.attribute("name") == Some(name))
}

fn numbers(node: Node<'_, '_>, attribute: &str) -> Vec<f64> {
    node.attribute(attribute).unwrap().split(' ').map(|word| word.parse().unwrap()).collect()
}

#[test]
fn an_off_centre_mass_hangs_on_its_module() {
    let mut plan = even();
    plan.modules[1].mass_centre = [0.001, -0.004, 0.002];
    plan.modules[2].inertia = Some([1e-6, 2e-6, 2.5e-6]);
    let text = model("uneven", &plan, &Options::default()).unwrap();
    let document = Document::parse(&text).unwrap();
    for (k, module) in plan.modules.iter().enumerate() {
        let name = format!("module{}", k + 1);
        let uneven = k == 1 || k == 2;
        let of_box = numbers(named(&document, "geom", &name).unwrap(), "mass")[0];
        assert_eq!(of_box, if uneven { 0.0 } else { module.mass }, "{name}");
        let hung = named(&document, "body", &format!("{name}mass"));
        assert_eq!(hung.is_some(), uneven, "{name}");
        let Some(hung) = hung else { continue };
        assert_eq!(hung.attribute("pos"), named(&document, "site", &name).unwrap().attribute("pos"));
        assert!(!hung.children().any(|node| node.has_tag_name("joint")), "{name} is held fast");
        let inertial = hung.children().find(|node| node.has_tag_name("inertial")).unwrap();
        assert_eq!(numbers(inertial, "pos"), module.mass_centre);
        assert_eq!(numbers(inertial, "mass"), [module.mass]);
        // The numbers have twelve digits.
        let (found, expected) = (numbers(inertial, "diaginertia"), module.principal_inertia());
        assert!((0..3).all(|axis| (found[axis] / expected[axis] - 1.0).abs() < 1e-11), "{found:?}, {expected:?}");
    }
}

#[test]
fn feet_are_there_or_not_each_with_its_friction() {
    let mut plan = even();
    plan.modules[2].has_foot[0] = false;
    plan.modules[3].feet[1][2] += 1e-3;
    plan.modules[0].friction_shares = [0.5, 1.0];
    let text = model("uneven", &plan, &Options::default()).unwrap();
    let document = Document::parse(&text).unwrap();
    for tag in ["geom", "site"] {
        assert!(named(&document, tag, "foot3L").is_none() && named(&document, tag, "foot3R").is_some(), "{tag}");
    }
    let height = |name: &str| numbers(named(&document, "geom", name).unwrap(), "pos")[2];
    assert!((height("foot4R") - height("foot4L") - 1e-3).abs() < 1e-12);
    let friction = plan.contact.as_ref().unwrap().friction;
    assert_eq!(numbers(named(&document, "geom", "foot1L").unwrap(), "friction")[0], 0.5 * friction);
    // The class's.
    assert_eq!(named(&document, "geom", "foot1R").unwrap().attribute("friction"), None);

    plan.contact.as_mut().unwrap().patches = vec![[0.1, 0.5]];
    assert_eq!(model("uneven", &plan, &Options::default()), Err(MjcfError::FootOnPatches { module: 0 }));
    assert!(model("uneven", &plan, &Options { contact: false, ..Options::default() }).is_ok());
}

#[test]
fn a_backbone_has_its_own_stiffness_and_hardens() {
    let mut plan = even();
    plan.backbones[1].stiffness = [0.02, 0.2, 0.05];
    plan.backbones[2].hardening = [0.0, 50.0, 0.0];
    let text = model("uneven", &plan, &Options::default()).unwrap();
    let document = Document::parse(&text).unwrap();
    let stiffness = |class: &str| {
        let of_class = |node: &Node<'_, '_>| node.has_tag_name("default") && node.attribute("class") == Some(class);
        let joint = document.descendants().find(of_class).unwrap().first_element_child().unwrap();
        numbers(joint, "stiffness")
    };
    assert_eq!(["b2x", "b2y", "b2z"].map(stiffness), [[0.02], [0.2], [0.05]].map(|k| k.to_vec()));
    assert_eq!(stiffness("b1x"), [0.012]);
    assert_eq!(stiffness("b3y"), [0.1, 0.0, 5.0]);
    assert_eq!(stiffness("b3z"), [0.04]);
}

#[test]
fn the_files_servo_holds_the_shaft_and_the_options_where_it_has_none() {
    let mut plan = even();
    let gains = |plan: &Plan| {
        let text = model("held", plan, &Options::default()).unwrap();
        let document = Document::parse(&text).unwrap();
        let servo = named(&document, "position", "rotor").unwrap();
        [numbers(servo, "kp")[0], numbers(servo, "kv")[0]]
    };
    let options = Options::default();
    assert_eq!(gains(&plan), [options.servo_nm_per_rad, options.servo_nm_s_per_rad]);
    plan.eccentric.as_mut().unwrap().servo = Some([0.5, 1e-3]);
    assert_eq!(gains(&plan), [0.5, 1e-3]);
}
