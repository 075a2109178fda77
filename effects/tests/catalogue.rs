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

/// Where an effect may be named besides its file: the controller's design and the specimens that are drawn know some by what
/// they do, the body on the ground has its own gravity.
const MAY_NAME: [&str; 5] = [
    "robot-file/src/design/",
    "hal-sim/src/linearity.rs",
    "hal-sim/src/robot.rs",
    "hal-sim/src/second_sensor.rs",
    "hal-sim/src/body/walking.rs",
];

#[test]
fn an_effect_takes_one_file_and_one_line() {
    let lines = std::fs::read_to_string(root().join("effects/src/catalogue/mod.rs")).unwrap();
    let mut elsewhere = Vec::new();
    for id in Id::all() {
        let listed = lines.lines().filter(|line| line.trim_start().starts_with(&format!("{}::", id.name()))).count();
        assert_eq!(listed, 1, "{} in the list", id.name());
        for room in ["robot-file/src", "hal-sim/src", "host/diagnose/src", "host/plot/src", "host/mjcf/src"] {
            mentions(&root().join(room), id.name(), &mut elsewhere);
        }
    }
    elsewhere.retain(|place| !MAY_NAME.iter().any(|allowed| place.contains(allowed)));
    assert!(elsewhere.is_empty(), "named outside of its file:\n{}", elsewhere.join("\n"));
}

/// Lines of code (no comments, no tests) below a folder that name an effect.
fn mentions(folder: &Path, name: &str, found: &mut Vec<String>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.map(|entry| entry.unwrap().path()) {
        if path.is_dir() {
            mentions(&path, name, found);
            continue;
        }
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        if path.extension().is_none_or(|end| end != "rs") || stem.contains("tests") || stem == "measured" {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.lines().take_while(|line| line.trim() != "#[cfg(test)]");
        for line in code.filter(|line| !line.trim_start().starts_with("//")) {
            let whole_word = line.match_indices(name).any(|(at, _)| {
                let word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
                !word(line[..at].chars().next_back()) && !word(line[at + name.len()..].chars().next())
            });
            if whole_word {
                found.push(format!("{}: {}", path.display(), line.trim()));
            }
        }
    }
}

#[test]
fn a_law_comes_back_from_its_fit() {
    for id in Id::all() {
        let spec = id.spec();
        let numbers = id.fit(&SIZES);
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
        let tried = |name: &&str| Id::of(name).is_some_and(|other| other.spec().candidate);
        assert!(!spec.resembles.iter().any(tried), "{}: is a name of its own", spec.name);
        assert!(!spec.candidate || !id.fit(&SIZES).is_empty(), "{}: nothing to try", spec.name);
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
    assert_eq!((none.foot_friction(0.1, 0.2), none.lateral_share(), none.down()), (1.0, 1.0, [0.0, 0.0, -1.0]));
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
