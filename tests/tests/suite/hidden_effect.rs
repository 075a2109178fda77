//! `examples/hidden-effect`: its files are what the generator makes, and the diagnosis names what is hidden.

use std::path::{Path, PathBuf};

use diagnose::{Options, diagnose};
use recording::{Recording, load};
use robot_file::Robot;
use serde_json::Value;
use system_tests::blind::case::{self, Case, Category};
use system_tests::blind::files::Decimals;
use system_tests::blind::hidden::Effect;
use system_tests::blind::rig;
use system_tests::blind::setting::Setting;

const HIDDEN: Effect = Effect::GravityTilt;

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/hidden-effect").join(name)
}

fn run(number: usize) -> PathBuf {
    example(&format!("run-{number}.csv"))
}

/// As `answer.md` makes it.
fn made() -> Case {
    let bench = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/bench-linear.toml");
    let robot_file = rig::flatten(&bench).expect("the bench's robot file");
    let short = Setting { share: 0.4, ..Setting::default() };
    case::draw_with(11, Category::Hidden, Some(HIDDEN), &robot_file, &short).expect("the bench's file has every number")
}

/// Cells of a CSV as numbers; an empty cell is NaN.
fn cells(text: &str) -> Vec<Vec<f64>> {
    let cell = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().expect("a number") };
    text.lines().skip(1).map(|line| line.split(',').map(cell).collect()).collect()
}

#[test]
fn the_files_are_what_the_generator_makes() {
    let case = made();
    for (n, made) in case.runs.iter().enumerate() {
        let path = run(n + 1);
        let kept = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let (kept, made) = (cells(&kept), cells(&made.csv(case.sensor.wrapped, Decimals::FEW)));
        assert_eq!(kept.len(), made.len(), "{}", path.display());
        for (line, (kept, made)) in kept.iter().zip(&made).enumerate() {
            // Another machine's sine may differ in the last bit, and so a rounded number in its last decimal.
            let near = |(a, b): (&f64, &f64)| (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1.01e-4;
            assert!(kept.len() == made.len() && kept.iter().zip(made).all(near), "{}:{}", path.display(), line + 2);
        }
    }
    let text = std::fs::read_to_string(example("robot.toml")).expect("the example's robot file");
    assert_eq!(text, case.robot_file, "robot.toml");
}

#[test]
fn the_diagnosis_names_the_hidden_effect() {
    let robot = Robot::load(&example("robot.toml")).expect("the example's robot file");
    let read = |numbers: std::ops::RangeInclusive<usize>| -> Vec<Recording> {
        numbers.map(|number| load(&run(number)).expect("the example's recordings")).collect()
    };
    // As the command divides files of one kind: the last is held out.
    let diagnosis = diagnose(&robot, &read(1..=5), &read(6..=6), &Options::default()).expect("a diagnosis");
    let json: Value = serde_json::to_value(&diagnosis).expect("JSON");
    assert_eq!(json["verdict"], "explained", "{json:#}");
    let causes: Vec<_> = json["causes"].as_array().into_iter().flatten().map(|cause| &cause["effect"]).collect();
    assert_eq!(causes, [HIDDEN.name()], "{json:#}");
}

#[test]
fn the_answer_is_told_only_in_its_own_file() {
    let name = HIDDEN.name();
    for (file, told) in [("answer.md", true), ("README.md", false), ("robot.toml", false)] {
        let text = std::fs::read_to_string(example(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert_eq!(text.contains(name), told, "{file}");
    }
}
