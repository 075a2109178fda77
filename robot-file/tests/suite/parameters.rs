//! The controller's table of parameters against the robot files: a name is a path in robot.toml, and the value that a
//! design gives it is the one that stands there.

use std::path::{Path, PathBuf};

use control::parameters::table::{Entry, Kind, TABLE, find, get};
use control::{ParameterError, Parameters};
use effects::{DriverDeadband, DriverDrop, SensorDelay};
use robot_file::Robot;
use robot_file::design::{DesignError, design};
use robot_file::unit;
use toml_edit::{DocumentMut, Item};

/// Numbers of `[controller]` that enter through a design: not to be changed alone. `control::parameters::table` says why.
const DESIGNED: [&str; 15] = [
    "controller.tick_s",
    "controller.lqg.phase_deg",
    "controller.lqg.speed_rad_per_s",
    "controller.lqg.current_a",
    "controller.lqg.voltage_v",
    "controller.lqg.anchor_deg",
    "controller.lqg.fade_a",
    "controller.estimator.reading_deg",
    "controller.estimator.reading_calibrated_deg",
    "controller.estimator.drag_share",
    "controller.estimator.stroke_reading_deg",
    "controller.estimator.stroke_reading_calibrated_deg",
    "controller.estimator.stroke_drag_share",
    "controller.estimator.initial_drag_share",
    "controller.estimator.drag_limit_share",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// robot.toml, and the effects that the table speaks of and it does not have, at no size.
fn document() -> DocumentMut {
    let mut text = std::fs::read_to_string(root().join("robot.toml")).unwrap();
    for name in TABLE.iter().map(|entry| entry.name).filter(|name| name.starts_with("effects.")) {
        let (table, key) = name.rsplit_once('.').unwrap();
        if !text.contains(&format!("[{table}]")) {
            text += &format!("\n[{table}]\n{key} = {{ value = 0, low = 0, high = 0, source = \"test\" }}\n");
        }
    }
    text.parse().unwrap()
}

fn item<'d>(document: &'d mut DocumentMut, path: &str) -> Option<&'d mut Item> {
    path.split('.').try_fold(document.as_item_mut(), |item, key| item.get_mut(key))
}

fn float(item: &Item, key: &str) -> f64 {
    let number = item.get(key).unwrap_or_else(|| panic!("no {key}"));
    number.as_float().or_else(|| number.as_integer().map(|whole| whole as f64)).expect("a number")
}

/// robot.toml with one number's value, low and high changed.
fn variant(path: &str, number: f64) -> String {
    let mut document = document();
    let quantity = item(&mut document, path).unwrap_or_else(|| panic!("no {path}"));
    for key in ["value", "low", "high"] {
        quantity[key] = toml_edit::value(number);
    }
    document.to_string()
}

fn is_close(value: f32, expected: f64) -> bool {
    (f64::from(value) - expected).abs() <= 5e-7 * expected.abs()
}

fn value(parameters: &Parameters, entry: &Entry) -> f32 {
    find(entry.name).and_then(|index| get(parameters, index)).unwrap()
}

#[test]
fn a_name_is_a_path_in_robot_toml_and_the_default_is_what_stands_there() {
    let factory = design(&Robot::load(&root().join("robot.toml")).unwrap()).unwrap().parameters;
    let mut document = document();
    for entry in TABLE {
        let item = item(&mut document, entry.name).unwrap_or_else(|| panic!("robot.toml has no {}", entry.name));
        let (stands, low, high) = (float(item, "value"), float(item, "low"), float(item, "high"));
        let found = value(&factory, entry);
        assert!(is_close(found, stands), "{} is {stands} in robot.toml and {found} in its design", entry.name);
        assert!(
            f64::from(entry.low) <= low * (1.0 + 1e-7) && high <= f64::from(entry.high) * (1.0 + 1e-7),
            "{}",
            entry.name
        );
        if entry.kind == Kind::Whole {
            assert_eq!([stands, low, high].map(f64::fract), [0.0; 3], "{}", entry.name);
        }
    }
}

#[test]
fn every_robot_with_a_controller_has_its_own_defaults() {
    let mut designed = 0;
    let paths = std::fs::read_dir(root().join("robots")).unwrap().map(|entry| entry.unwrap().path());
    for path in paths.filter(|path| path.is_file()) {
        let robot = Robot::load(&path).unwrap();
        let Some(controller) = &robot.controller else { continue };
        let factory = design(&robot).unwrap().parameters;
        for entry in TABLE {
            let effects = &robot.effects;
            let stands = match entry.name {
                "effects.driver_drop.drop_v" => effects.get::<DriverDrop>().map_or(0.0, |drop| drop.drop_v),
                "effects.driver_deadband.width_duty" => effects.get::<DriverDeadband>().map_or(0.0, |it| it.width_duty),
                "effects.sensor_delay.delay_s" => effects.get::<SensorDelay>().map_or(0.0, |delay| delay.delay_s),
                name => controller.numbers[name.strip_prefix("controller.").unwrap()].value,
            };
            let (name, found) = (entry.name, value(&factory, entry));
            assert!(is_close(found, stands), "{}: {name} is {stands} in the file, {found} here", robot.name);
        }
        designed += 1;
    }
    assert!(designed >= 2, "only {designed} robots with a controller");
}

#[test]
fn every_number_of_the_controller_is_in_the_table_or_enters_through_a_design() {
    let robot = Robot::load(&root().join("robot.toml")).unwrap();
    let controller = robot.controller.unwrap();
    let mut in_file: Vec<_> = controller.numbers.keys().map(|key| format!("controller.{key}")).collect();
    in_file.push("controller.tick_s".into());
    in_file.sort();
    let in_table = TABLE.iter().map(|entry| entry.name).filter(|name| name.starts_with("controller."));
    let mut known: Vec<_> = in_table.chain(DESIGNED).map(String::from).collect();
    known.sort();
    assert_eq!(in_file, known);
}

#[test]
fn units_are_those_of_the_names() {
    for entry in TABLE {
        let unit = match unit::of(entry.name) {
            "1" => "",
            "°" => "deg",
            other => other,
        };
        assert_eq!(entry.unit, unit, "{}", entry.name);
    }
}

#[test]
fn a_value_that_is_written_is_the_value_that_is_read() {
    for entry in TABLE {
        let middle = f64::from(entry.low) + 0.3 * f64::from(entry.high - entry.low);
        let written = if entry.kind == Kind::Whole { middle.round() } else { middle };
        let text = variant(entry.name, written);
        let robot = Robot::parse(&text, "variant.toml").unwrap_or_else(|error| panic!("{error}"));
        match design(&robot) {
            Ok(design) => assert!(is_close(value(&design.parameters, entry), written), "{}", entry.name),
            Err(error) => assert_contradicts(entry, &error),
        }
    }
}

/// What the reader lets through the controller takes: the file's range lies within the table's.
#[test]
fn the_files_range_is_not_wider_than_the_tables() {
    for entry in TABLE {
        let (low, high) = (f64::from(entry.low), f64::from(entry.high));
        let step = 1e-5 * (low.abs() + high.abs());
        for (end, beyond) in [(low, low - 1e-6 * low.abs() - if low == 0.0 { step } else { 0.0 }), (high, high + step)]
        {
            let message = match Robot::parse(&variant(entry.name, beyond), "variant.toml") {
                Ok(_) => panic!("robot.toml may have {} = {beyond}, beyond the controller's {end}", entry.name),
                Err(error) => error.to_string(),
            };
            assert!(message.contains(entry.name), "{message}");
        }
    }
}

/// The ends themselves are borne, whatever converts them.
#[test]
fn the_ends_of_the_tables_range_are_taken_from_a_file() {
    let mut taken = 0;
    for entry in TABLE {
        for end in [entry.low, entry.high] {
            let written: f64 = end.to_string().parse().unwrap();
            let robot = Robot::parse(&variant(entry.name, written), "variant.toml")
                .unwrap_or_else(|error| panic!("{} = {written}: {error}", entry.name));
            match design(&robot) {
                Ok(design) => {
                    assert!(is_close(value(&design.parameters, entry), written), "{}", entry.name);
                    taken += 1;
                }
                Err(error) => assert_contradicts(entry, &error),
            }
        }
    }
    assert!(taken > TABLE.len(), "{taken} ends taken");
}

/// The number is in its range, and yet too much beside another one.
#[track_caller]
fn assert_contradicts(entry: &Entry, error: &DesignError) {
    let DesignError::Refused(ParameterError::OutOfRange { name, low, high, .. }) = error else {
        panic!("{}: {error}", entry.name)
    };
    let Some(refused) = find(name) else { panic!("{}: {error}", entry.name) };
    let refused = &TABLE[usize::from(refused)];
    assert!((*low, *high) != (refused.low, refused.high), "{}: {error}", entry.name);
}
