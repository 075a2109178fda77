//! `scram export mjcf`: the model's shape and numbers, and what is refused. `cargo body-figures` runs it in MuJoCo.

use effects::FootLoadFriction;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use hal_sim::body::Plan;
use mjcf::{MjcfError, Options, model};
use robot_file::Robot;
use roxmltree::{Document, Node};

fn robot_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")
}

fn plan() -> Plan {
    Plan::new(&Robot::load(&robot_file()).expect("robot.toml")).expect("a body")
}

fn export(words: &[&str]) -> Output {
    let robot = robot_file();
    let all = ["export", "mjcf", "--robot", robot.to_str().expect("a path")];
    Command::cargo_bin("scram").expect("scram").args(all).args(words).output().expect("it runs")
}

#[track_caller]
fn printed(words: &[&str]) -> String {
    let output = export(words);
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[track_caller]
fn refused(words: &[&str], code: i32, says: &str) {
    let output = export(words);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{words:?}: {message}");
    assert!(output.stdout.is_empty());
    assert!(message.contains(says), "{words:?}: `{message}` does not say `{says}`");
}

fn all<'a>(document: &'a Document<'a>, tag: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    document.descendants().filter(move |node| node.has_tag_name(tag))
}

fn named<'a>(document: &'a Document<'a>, tag: &'a str, name: &str) -> Node<'a, 'a> {
    all(document, tag).find(|node| node.attribute("name") == Some(name)).unwrap_or_else(|| panic!("no {tag} {name}"))
}

fn values(node: Node<'_, '_>, attribute: &str) -> Vec<f64> {
    let text = node.attribute(attribute).unwrap_or_else(|| panic!("no {attribute}"));
    text.split(' ').map(|word| word.parse().expect("a number")).collect()
}

/// Where a body stands in the world, all bodies being unrotated in the nominal pose.
fn position(body: Node<'_, '_>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for node in body.ancestors().filter(|node| node.has_tag_name("body")) {
        for (total, part) in sum.iter_mut().zip(values(node, "pos")) {
            *total += part;
        }
    }
    sum
}

#[track_caller]
fn near(a: &[f64], b: &[f64]) {
    assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?} is not {b:?}");
}

#[test]
fn the_model_has_every_degree_of_freedom_and_the_whole_mass() {
    let text = printed(&[]);
    let document = Document::parse(&text).expect("well-formed");
    let hinges = all(&document, "joint").filter(|joint| joint.attribute("axis").is_some()).count();
    assert_eq!((hinges, all(&document, "freejoint").count()), (91, 1), "90 hinges and the rotor, and the free joint");
    assert_eq!(plan().degrees_of_freedom(), hinges + 6);
    assert_eq!(all(&document, "body").count(), 32);
    let feet = all(&document, "geom").filter(|geom| geom.attribute("class") == Some("foot"));
    assert_eq!(feet.count(), 8);
    let mass: f64 = document
        .descendants()
        .filter(|node| node.has_tag_name("geom") || node.has_tag_name("inertial"))
        .filter(|node| node.parent().is_some_and(|parent| parent.has_tag_name("body")))
        .filter_map(|node| node.attribute("mass"))
        .map(|mass| mass.parse::<f64>().expect("a number"))
        .sum();
    near(&[mass], &[plan().mass()]);
}

#[test]
fn whichever_module_is_the_root_the_robot_is_the_same() {
    for root in 1..=4 {
        let text = printed(&["--alpha", "60", "--root", &root.to_string()]);
        let document = Document::parse(&text).expect("well-formed");
        let body = all(&document, "freejoint").next().and_then(|joint| joint.parent()).expect("a body");
        assert_eq!(body.attribute("name"), Some(format!("m{root}").as_str()));
        for module in 1..=4 {
            let geom = named(&document, "geom", &format!("module{module}"));
            let (body, inside) = (position(geom.parent().expect("a body")), values(geom, "pos"));
            let centre: Vec<f64> = body.iter().zip(inside).map(|(a, b)| a + b).collect();
            near(&centre, &[-0.04 * f64::from(module - 1), 0.0, 0.016]);
        }
        // Towards the front the child comes first: the axes turn round, and so does their order.
        let (third, sign) = (root <= 2, if root <= 2 { 1.0 } else { -1.0 });
        let axes: Vec<_> = ["x", "y", "z"].map(|axis| named(&document, "joint", &format!("b2h1{axis}"))).into();
        let (sin, cos) = 120_f64.to_radians().sin_cos();
        near(&values(axes[0], "axis"), &[sign, 0.0, 0.0]);
        near(&values(axes[1], "axis"), &[0.0, sign * cos, sign * sin]);
        near(&values(axes[2], "axis"), &[0.0, -sign * sin, sign * cos]);
        assert_eq!(axes[0].range().start < axes[2].range().start, third, "root {root}");
    }
}

#[test]
fn a_clamped_robot_has_no_free_joint() {
    let mut plan = plan();
    plan.clamped = Some(3);
    let text = model("a < b", &plan, &Options::default()).expect("a model");
    let document = Document::parse(&text).expect("well-formed");
    assert_eq!(all(&document, "freejoint").count(), 0);
    assert_eq!(named(&document, "body", "m4").parent().map(|node| node.tag_name().name()), Some("worldbody"));
    assert_eq!(document.root_element().attribute("model"), Some("a < b"));
    let elsewhere = Options { root: Some(0), ..Options::default() };
    assert_eq!(model("", &plan, &elsewhere), Err(MjcfError::Clamped { clamped: 3, root: 0 }));
}

#[test]
fn steps_and_patches_become_boxes_that_leave_no_gap() {
    let mut plan = plan();
    let contact = plan.contact.as_mut().expect("feet");
    contact.steps = vec![[0.1, 0.002], [0.3, -0.001]];
    contact.patches = vec![[0.2, 0.5]];
    let text = model("", &plan, &Options::default()).expect("a model");
    let document = Document::parse(&text).expect("well-formed");
    let ground: Vec<Node> =
        all(&document, "geom").filter(|n| n.attribute("name").is_some_and(|n| n.starts_with("ground"))).collect();
    let seen: Vec<Vec<f64>> = ground
        .iter()
        .map(|node| {
            let (half, centre) = (values(*node, "size"), values(*node, "pos"));
            vec![centre[0] - half[0], centre[0] + half[0], centre[2] + half[2], values(*node, "friction")[0]]
        })
        .collect();
    let mu = 0.8;
    let expected =
        [[-10.0, 0.1, 0.0, mu], [0.1, 0.2, 0.002, mu], [0.2, 0.3, 0.002, 0.5 * mu], [0.3, 10.3, -0.001, 0.5 * mu]];
    assert_eq!(seen.len(), expected.len());
    for (seen, expected) in seen.iter().zip(expected) {
        near(seen, &expected);
    }
}

#[test]
fn settings_are_carried_over_and_a_slope_leans_gravity() {
    let text = printed(&[
        "--no-contact",
        "--timestep",
        "5e-4",
        "--integrator",
        "RK4",
        "--cone",
        "pyramidal",
        "--solver",
        "PGS",
    ]);
    let document = Document::parse(&text).expect("well-formed");
    let option = all(&document, "option").next().expect("an option");
    for (name, value) in [("timestep", "0.0005"), ("integrator", "RK4"), ("cone", "pyramidal"), ("solver", "PGS")] {
        assert_eq!(option.attribute(name), Some(value));
    }
    assert_eq!(all(&document, "flag").next().and_then(|flag| flag.attribute("contact")), Some("disable"));
    let mut plan = plan();
    plan.gravity = [-1.0, 0.5, -9.7];
    let text = model("", &plan, &Options::default()).expect("a model");
    let document = Document::parse(&text).expect("well-formed");
    near(&values(all(&document, "option").next().expect("an option"), "gravity"), &[-1.0, 0.5, -9.7]);
}

#[test]
fn a_file_is_written_whole() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("robot.xml");
    assert_eq!(printed(&["-o", path.to_str().expect("a path")]), "");
    let text = std::fs::read_to_string(&path).expect("the model");
    assert_eq!(text, printed(&[]));
    let nowhere = directory.path().join("robot.xml/robot.xml");
    refused(&["-o", nowhere.to_str().expect("a path")], 1, "cannot be written");
    refused(&["-o", robot_file().to_str().expect("a path")], 1, "is not written over");
}

#[test]
fn what_mujoco_cannot_do_is_refused() {
    refused(&["--root", "5"], 1, "there is no module 5 for the free joint: the robot has 4");
    refused(&["--root", "0"], 2, "0");
    refused(&["--alpha", "nan"], 2, "a number from -360 to 360 degrees");
    refused(&["--alpha", "400"], 2, "a number from -360 to 360 degrees");
    refused(&["--timestep", "0"], 1, "the time step must be a positive number");
    let mut plan = plan();
    let contact = plan.contact.as_mut().expect("feet");
    contact.laws.foot_load_friction = Some(FootLoadFriction { exponent: 0.3, load_n: 0.05 });
    let error = model("", &plan, &Options::default()).expect_err("no such friction");
    assert!(error.to_string().contains("[effects.foot_load_friction] cannot be exported"), "{error}");
    assert!(model("", &plan, &Options { contact: false, ..Options::default() }).is_ok(), "no feet, no friction");
}

#[test]
fn a_bench_without_a_body_is_refused() {
    let bench = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-linear.toml");
    let output = Command::cargo_bin("scram").expect("scram").args(["export", "mjcf", "--robot"]).arg(bench).output();
    let output = output.expect("it runs");
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("has no [body]"), "{message}");
}
