//! `scram identify backbone` on the oscillations of `examples/backbone`, which MuJoCo moved, with the command as a person uses it.

use std::path::Path;

use crate::common::command::{fails, json, succeeds, temporary};
use crate::common::root;

/// What the example's README says was put in.
const TRUTH: [(&str, f64); 6] = [
    ("torsion_nm_per_rad", 0.0092),
    ("stiff_nm_per_rad", 0.078),
    ("soft_nm_per_rad", 0.0535),
    ("torsion_nm_s_per_rad", 2.1e-5),
    ("stiff_nm_s_per_rad", 1.7e-4),
    ("soft_nm_s_per_rad", 0.95e-4),
];

fn runs(directory: &Path) -> String {
    for k in 1..=4 {
        let name = format!("release-{k}.csv");
        std::fs::copy(root().join("examples/backbone").join(&name), directory.join(name)).unwrap();
    }
    "release-1.csv release-2.csv release-3.csv release-4.csv --robot @/robot.toml".to_owned()
}

#[test]
fn what_was_put_into_the_example_comes_out_and_goes_into_a_robot_file() {
    let directory = temporary();
    let words =
        format!("identify backbone {} --section 4,6,1.5,1 --modulus 2.4 --out found --json", runs(directory.path()));
    let said = json(&succeeds(directory.path(), &words));
    let robot = robot_file::Robot::load(&directory.path().join("found/robot.toml")).unwrap();
    let backbone = robot.backbone.unwrap();
    for (k, (field, truth)) in TRUTH.into_iter().enumerate() {
        let hinge = &said["hinges"][k];
        assert_eq!(hinge["field"], field);
        let value = hinge["value"].as_f64().unwrap();
        let bar = if k < 3 { 0.02 } else { 0.05 };
        assert!((value / truth - 1.0).abs() < bar, "{field}: {value} for {truth}");
        assert_eq!(hinge["told"], true);
    }
    assert!(
        (backbone.soft_nm_per_rad.value / 0.0535 - 1.0).abs() < 0.02
            && backbone.soft_nm_per_rad.source.contains("release-3")
    );
    assert!(said["section_nm_per_rad"][1].as_f64().unwrap() > 0.07);
    let held_out = &said["held_out"][0];
    assert!(held_out["before_rad"].as_f64() > held_out["after_rad"].as_f64().map(|after| 10.0 * after), "{held_out}");
    assert!(
        std::fs::read_to_string(directory.path().join("found/backbone.svg")).unwrap().contains("release-4 (held out)")
    );
}

#[test]
fn what_cannot_be_used_is_said() {
    let directory = temporary();
    let runs = runs(directory.path());
    let refused = |words: &str, says: &[&str]| fails(directory.path(), &format!("identify backbone {words}"), 1, says);
    std::fs::write(directory.path().join("empty.csv"), "a,b\n1,2\n3,4\n").unwrap();
    refused("empty.csv --robot @/robot.toml", &["empty.csv, line 1", "no column of a pose"]);
    refused("missing.csv --robot @/robot.toml", &["missing.csv: cannot be read"]);
    refused(&format!("{runs} --body tip"), &["no body `tip`"]);
    refused(&format!("{runs} --section 4,6,4,1 --modulus 2.4"), &["a section of 4 × 6 × 4 × 1 mm"]);
    refused("release-1.csv --robot @/robots/bench-linear.toml", &["bench-linear", "no [body]"]);
}

#[cfg(feature = "bayes")]
#[test]
fn bayes_finds_the_examples_stiffnesses_and_keeps_the_files_spreads() {
    let directory = temporary();
    let runs = runs(directory.path());
    let words = format!("identify backbone {runs} --method bayes --evaluations 60 --out found --json");
    let said = json(&succeeds(directory.path(), &words));
    for (k, (field, truth)) in TRUTH.into_iter().enumerate() {
        let value = said["hinges"][k]["value"].as_f64().unwrap();
        assert!(k > 2 || (value / truth - 1.0).abs() < 0.03, "{field}: {value} for {truth}");
        assert!(said["hinges"][k].get("low").is_none(), "{said}");
    }
    assert_eq!(said["evaluations"], 60);
    let robot = |path: &Path| robot_file::Robot::load(path).unwrap().backbone.unwrap().soft_nm_per_rad;
    let (before, after) = (robot(&root().join("robot.toml")), robot(&directory.path().join("found/robot.toml")));
    assert_eq!((before.low, before.high), (after.low, after.high));
    assert!(after.source.contains("--method bayes") && after.source.contains("no interval"), "{}", after.source);
    let few = format!("identify backbone {runs} --method bayes --evaluations 5");
    fails(directory.path(), &few, 1, &["5 evaluations are too few", "--evaluations 48 or more"]);
}

#[cfg(not(feature = "bayes"))]
#[test]
fn without_bayes_the_command_says_how_to_build_with_it() {
    let directory = temporary();
    let words = format!("identify backbone {} --method bayes", runs(directory.path()));
    fails(
        directory.path(),
        &words,
        1,
        &["built without Bayesian optimisation", "cargo run --release -p scram --features bayes"],
    );
}

#[test]
fn evaluations_are_for_bayes() {
    let directory = temporary();
    let words = format!("identify backbone {} --evaluations 40", runs(directory.path()));
    fails(directory.path(), &words, 2, &["--evaluations is for --method bayes"]);
}
