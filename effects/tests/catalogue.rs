//! What every effect of the catalogue must fulfil, and that one file and one line are all that an effect takes.

use std::path::{Path, PathBuf};

use effects::{Id, Laws, Sizes};

const SIZES: Sizes = Sizes {
    torque_nm: 7e-3,
    rail_v: 5.0,
    resistance_ohm: 15.0,
    inertia_kg_m2: 1.4e-6,
    free_speed: 240.0,
    gear_ratio: 26.0,
    repeats: 1.0,
};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Names of the files in `src/catalogue` that are effects.
fn files() -> Vec<String> {
    let folder = root().join("effects/src/catalogue");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .filter(|name| !["mod", "id", "list"].contains(&name.as_str()))
        .collect();
    names.sort();
    names
}

#[test]
fn every_file_is_an_effect_of_its_name() {
    let mut names: Vec<String> = Id::all().map(|id| id.name().to_owned()).collect();
    names.sort();
    assert_eq!(names, files());
    for id in Id::all() {
        assert_eq!(Id::of(id.name()), Some(id));
    }
}

/// Where effects are named besides their files, which of them, and why.
const NAMED: [(&str, &[&str], &str); 17] = [
    ("robot-file/src/design/fill.rs", &["battery_sag"], "the firmware inverts what the supply does to a duty"),
    (
        "robot-file/src/design/mod.rs",
        &["battery_sag"],
        "the highest speed that is left is that of the voltage that it leaves",
    ),
    (
        "control/src/parameters/table.rs",
        &["driver_drop", "driver_deadband", "sensor_delay"],
        "a person sets what the controller takes back by its path in the robot file",
    ),
    ("control/src/parameters/check.rs", &["driver_drop"], "no bridge takes more than its supply has"),
    (
        "robot-file/src/design/model.rs",
        &["coulomb_friction", "stribeck_friction", "load_friction", "driver_drop"],
        "gains are designed for a linear model, and its friction and resistance are theirs",
    ),
    ("hal-sim/src/linearity.rs", &["sensor_nonlinearity"], "of a sensor the file knows bounds, a specimen is drawn"),
    ("hal-sim/src/robot.rs", &["sensor_nonlinearity"], "the specimen's error in place of the file's"),
    ("hal-sim/src/second_sensor.rs", &["sensor_nonlinearity"], "another specimen of the same sensor"),
    ("host/diagnose/src/held.rs", &["held_samples"], "they are told by counting equal readings, not by a fit"),
    (
        "host/diagnose/src/session.rs",
        &["gravity_tilt"],
        "on the ground the body that leans does what it says of a bench",
    ),
    (
        "host/diagnose/src/ground/turns.rs",
        &["directional_friction", "driver_drop", "sensor_nonlinearity"],
        "a body is found with much of what moves a shaft free, before it is known what the file lacks",
    ),
    (
        "host/scram/src/cli/new_rig/text.rs",
        &["driver_drop"],
        "what is known of a bridge is what its data sheet says it takes",
    ),
    (
        "host/diagnose/src/motor.rs",
        &["coulomb_friction", "load_friction", "stribeck_friction"],
        "a motor's identification looks for friction and for nothing else",
    ),
    (
        "host/identify/src/robot/numbers.rs",
        &["payload_offset", "foot_friction"],
        "what makes a robot uneven, with what is believed of it before its walk is fitted",
    ),
    (
        "host/diagnose/src/walk/feet.rs",
        &["foot_friction"],
        "the friction of one foot after the other, where no effect explains the walk",
    ),
    ("host/learn/src/terrain.rs", &["ground_slope"], "a slope is one of the grounds that a robot is sent over"),
    ("hal-sim/src/body/walking.rs", &["gravity_tilt"], "a body on the ground has gravity of its own"),
];

/// Rooms that must not know effects by name. `host` has one in each of its folders.
const ROOMS: [&str; 6] = ["control", "robot-file", "shell", "hal-sim", "testbed", "host"];

/// Sources of tests alone whose names do not say so.
const TESTS: [&str; 1] = ["host/diagnose/src/measured.rs"];

/// The folders with the sources of [`ROOMS`], from the root.
fn sources() -> Vec<PathBuf> {
    let inner = |room: PathBuf| {
        let entries = std::fs::read_dir(root().join(&room)).unwrap_or_else(|e| panic!("{}: {e}", room.display()));
        let names = entries.map(|entry| entry.unwrap()).filter(|entry| entry.path().is_dir());
        names.map(|entry| room.join(entry.file_name())).collect::<Vec<_>>()
    };
    let rooms = ROOMS.into_iter().map(PathBuf::from);
    let crates = rooms.flat_map(|room| if room == Path::new("host") { inner(room) } else { vec![room] });
    crates.map(|room| room.join("src")).collect()
}

/// `driver_deadband` as a type: `DriverDeadband`.
fn type_name(name: &str) -> String {
    let words = name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]);
    words.collect()
}

#[test]
fn an_effect_takes_one_file_and_one_line() {
    let lines = std::fs::read_to_string(root().join("effects/src/catalogue/mod.rs")).unwrap();
    for id in Id::all() {
        let line = format!("{}::{},", id.name(), type_name(id.name()));
        assert_eq!(lines.lines().filter(|listed| listed.trim() == line).count(), 1, "{line} in the list");
    }
    let sources = sources();
    let crates: Vec<_> = sources.iter().map(|source| source.to_string_lossy()).collect();
    for needed in
        ["host/diagnose/src", "host/plot/src", "host/mjcf/src", "host/sim/src", "host/sweep/src", "host/scram/src"]
    {
        assert!(crates.iter().any(|source| source == needed), "{needed} is not among {crates:?}");
    }
    let mut found = Vec::new();
    for source in &sources {
        mentions(source, &mut found);
    }
    let named: Vec<_> = NAMED.iter().flat_map(|(file, names, _)| names.iter().map(|name| (*file, *name))).collect();
    let elsewhere = found.iter().filter(|(file, name, _)| !named.contains(&(file, name)));
    let elsewhere: Vec<_> = elsewhere.map(|(file, name, line)| format!("{file}: {name}: {line}")).collect();
    assert!(elsewhere.is_empty(), "named outside of its file:\n{}", elsewhere.join("\n"));
    for (file, name) in named {
        assert!(
            found.iter().any(|(there, other, _)| (there.as_str(), *other) == (file, name)),
            "{file} names no {name}"
        );
    }
}

/// Lines of code (no comments, no tests) below a folder that name an effect or its type: file, effect, line.
fn mentions(folder: &Path, found: &mut Vec<(String, &'static str, String)>) {
    let entries = std::fs::read_dir(root().join(folder)).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries.map(|entry| entry.unwrap()) {
        let path = folder.join(entry.file_name());
        let stem = path.file_stem().unwrap().to_string_lossy();
        if entry.path().is_dir() {
            if stem != "tests" {
                mentions(&path, found);
            }
            continue;
        }
        let file = path.to_string_lossy().replace('\\', "/");
        if path.extension().is_none_or(|end| end != "rs") || stem.contains("tests") || TESTS.contains(&file.as_str()) {
            continue;
        }
        let text = std::fs::read_to_string(entry.path()).unwrap();
        for line in without_tests(&text).filter(|line| !line.trim_start().starts_with("//")) {
            let named = Id::all().map(Id::name).filter(|name| has_word(line, name) || has_word(line, &type_name(name)));
            found.extend(named.map(|name| (file.clone(), name, line.trim().to_owned())));
        }
    }
}

/// A file's lines but for items under `#[cfg(test)]`: those end with a semicolon, or with a brace as far in as they began.
fn without_tests(text: &str) -> impl Iterator<Item = &str> {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let mut lines = text.lines();
    std::iter::from_fn(move || {
        let line = lines.next()?;
        if line.trim() != "#[cfg(test)]" {
            return Some(line);
        }
        let mut begins = true;
        let over = |item: &&str| {
            let whole = begins && item.ends_with(';');
            // Further attributes stand before the item.
            begins &= item.trim_start().starts_with('#');
            whole || item.trim() == "}" && indent(item) == indent(line)
        };
        lines.by_ref().find(over);
        Some("")
    })
}

fn has_word(line: &str, name: &str) -> bool {
    line.match_indices(name).any(|(at, _)| {
        let word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
        !word(line[..at].chars().next_back()) && !word(line[at + name.len()..].chars().next())
    })
}

#[test]
fn items_of_tests_are_left_out_and_what_follows_is_not() {
    let text = "a\n#[cfg(test)]\nmod tests;\nb\n#[cfg(test)]\n#[path = \"x\"]\nmod more;\nb\nimpl A {\n    #[cfg(test)]\n    fn f() {\n        x;\n    }\n    c\n}\n";
    let kept: Vec<_> = without_tests(text).map(str::trim).filter(|line| !line.is_empty()).collect();
    assert_eq!(kept, ["a", "b", "b", "impl A {", "c", "}"]);
    assert!(has_word("let _ = GravityTilt::SPEC;", "GravityTilt") && !has_word("foot_load_friction", "load_friction"));
    assert_eq!(type_name("gravity_tilt"), "GravityTilt");
}

/// What recordings of the shaft show has numbers to fit, and what acts on the ground has none.
#[test]
fn a_law_comes_back_from_its_fit() {
    for id in Id::all() {
        let spec = id.spec();
        let numbers = id.fit(&SIZES);
        assert_eq!(numbers.is_empty(), spec.acts.on_the_ground(), "{}: what a fit moves", spec.name);
        // Somewhere inside the bounds, and off the special points.
        let inside: Vec<f64> = numbers.iter().map(|one| one.low + 0.37 * (one.high - one.low)).collect();
        let mut values: Vec<f64> =
            spec.parameters.iter().map(|key| key.to_si(0.3 * key.low + 0.7 * key.high)).collect();
        id.values_of_fit(&inside, &mut values);
        let back = id.fit_of_values(&values, numbers.len());
        for (was, is) in inside.iter().zip(&back) {
            assert!((was - is).abs() < 1e-9 * (1.0 + was.abs()), "{}: {inside:?} came back as {back:?}", spec.name);
        }
        assert!(numbers.iter().all(|one| one.low < one.high), "{}: empty bounds", spec.name);
        let starts = numbers
            .iter()
            .flat_map(|one| one.starts.iter().map(|start| (one.low, *start, one.high)).collect::<Vec<_>>());
        assert!(starts.into_iter().all(|(low, start, high)| low <= start && start <= high), "{}: a start", spec.name);
        let mut laws = Laws::NONE;
        id.put(&mut laws, Some(&values));
        assert_eq!(laws.listed().collect::<Vec<_>>(), [id]);
        id.put(&mut laws, None);
        assert_eq!(laws, Laws::NONE);
    }
}

#[test]
fn what_an_effect_says_of_others_is_true() {
    for id in Id::all() {
        let spec = id.spec();
        for name in spec.contains.iter().chain(spec.mistaken_for.iter().map(|other| &other.with)) {
            assert!(Id::of(name).is_some_and(|other| other != id), "{}: {name}", spec.name);
        }
        if spec.acts.on_the_ground() {
            assert!(spec.parameters.iter().all(|one| one.belief.is_some()), "{}: nothing believed", spec.name);
        } else {
            assert!(!spec.candidate || !id.fit(&SIZES).is_empty(), "{}: nothing to try", spec.name);
        }
        let beliefs = spec.parameters.iter().filter_map(|one| Some((one, one.belief?)));
        for (key, [value, low, high]) in beliefs {
            assert!(key.low <= low && low <= value && value <= high && high <= key.high, "{}: {}", spec.name, key.key);
        }
        assert!(effects::PLANNED.iter().all(|name| Id::of(name).is_none()), "planned, and there");
        assert!(!spec.source.is_empty() && !spec.law.is_empty() && !spec.parameters.is_empty(), "{}", spec.name);
        assert!(spec.parameters.iter().all(|one| one.low < one.high), "{}: a range", spec.name);
    }
}

#[test]
fn without_effects_nothing_changes() {
    let none = Laws::NONE;
    assert_eq!((none.duty(0.3), none.friction_level(0.0, 5.0, 1.0), none.torque(1.0)), (0.3, 0.0, 0.0));
    assert_eq!((none.reading_error(1.0), none.reading_age(), none.supply_resistance()), (0.0, 0.0, 0.0));
    assert_eq!((none.friction_factor(0.1, 0.2), none.lateral_share(), none.down()), (1.0, 1.0, [0.0, 0.0, -1.0]));
    assert_eq!(none.sphere(), [0.0, 1.0]);
    assert_eq!((none.presliding(), none.bridge()), (None, effects::BridgeDrop::default()));
}

#[test]
fn the_document_is_the_catalogue() {
    let path = root().join("docs/effects.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (_, tables) = text.split_once("<!-- the catalogue -->\n\n").expect("docs/effects.md has the marker");
    let made = effects::markdown();
    assert!(tables.trim_end() == made.trim_end(), "docs/effects.md is behind; below the marker goes:\n{made}");
}
