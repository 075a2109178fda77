//! Bodies that cannot be: the whole message, and the line that it names.

use robot_file::Robot;
use robot_file::robot::ModuleKind::{Actuator, Courier, Passive};

const DEFAULT: &str = include_str!("../../../robot.toml");

/// The default robot with one change.
#[track_caller]
fn changed(from: &str, to: &str) -> String {
    assert_eq!(DEFAULT.matches(from).count(), 1, "the change must hit one place: {from}");
    DEFAULT.replacen(from, to, 1)
}

/// What the reader says about the default robot after one change, at the line that begins with `at`; LINE is its number.
#[track_caller]
fn says(from: &str, to: &str, at: &str, expected: &str) {
    says_of(&changed(from, to), at, expected);
}

#[track_caller]
fn says_of(text: &str, at: &str, expected: &str) {
    let error = Robot::parse(text, "robot.toml").expect_err("the file must be refused");
    let line = error.problems()[0].line.expect("a line");
    let expected = format!("robot.toml:LINE: {expected}").replace("LINE", &line.to_string());
    assert_eq!(error.to_string(), expected);
    let named = text.lines().nth(line - 1).unwrap_or_default();
    assert!(named.starts_with(at), "the error names the line `{named}`");
}

#[track_caller]
fn is_robot(text: &str) -> Robot {
    Robot::parse(text, "robot.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// The default file without one of its tables.
fn without(table: &str) -> String {
    let header = format!("[{table}]\n");
    let from = DEFAULT.find(&header).expect("the table");
    let length = DEFAULT[from..].find("\n\n").expect("an end") + 1;
    format!("{}{}", &DEFAULT[..from], &DEFAULT[from + length..])
}

const MODULES: &str = "modules = [\"actuator\", \"courier\", \"passive\", \"passive\"]";
const FRICTION: &str = "[ground]\n";

#[test]
fn the_default_body_is_the_reference_model() {
    let robot = is_robot(DEFAULT);
    assert_eq!(robot.body.as_ref().unwrap().modules, [Actuator, Courier, Passive, Passive]);
    let eccentric = robot.eccentric.as_ref().unwrap();
    assert!((eccentric.inertia_kg_m2() - 3.03375e-7).abs() < 1e-18, "{}", eccentric.inertia_kg_m2());
    // 40 g of modules, 30 segments, and the eccentric.
    let body = robot.body.as_ref().unwrap();
    let modules = body.actuator.mass_kg.value + body.courier.mass_kg.value + 2.0 * body.passive.mass_kg.value;
    let mass = modules + 30.0 * robot.backbone.as_ref().unwrap().segment_mass_kg.value + eccentric.mass_kg.value;
    assert!((mass - 0.04396).abs() < 1e-12, "{mass} kg");
}

#[test]
fn a_chain_that_is_none() {
    let found = |count| {
        format!(
            "body.modules: a chain has 2 to 64 modules, found {count}; name them from front to rear, e.g. [\"actuator\", \
             \"courier\", \"passive\"]"
        )
    };
    says(MODULES, "modules = []", "modules", &found(0));
    says(MODULES, "modules = [\"actuator\"]", "modules", &found(1));
    let chain = |passive: usize| format!("modules = [\"actuator\"{}]", ", \"passive\"".repeat(passive));
    says(MODULES, &chain(64), "modules", &found(65));
    is_robot(&changed(MODULES, &chain(63)));
    is_robot(&changed(MODULES, &chain(1)));
    let front = "body.modules: the first module is the actuator, and the only one: it carries the eccentric; name \
                 `actuator` once, at the front";
    says(MODULES, "modules = [\"courier\", \"passive\"]", "modules", front);
    says(MODULES, "modules = [\"actuator\", \"actuator\"]", "modules", front);
}

#[test]
fn a_module_that_is_none() {
    says(
        MODULES,
        "modules = [\"actuator\", \"pasive\"]",
        "modules",
        "body.modules: unknown kind of module `pasive`; did you mean `passive`? allowed are actuator, courier, passive",
    );
    says(MODULES, "modules = [\"actuator\", 3]", "modules", "body.modules: expected a kind of module, found a number");
    says(MODULES, "modules = \"actuator\"", "modules", "body.modules: expected an array of module kinds, found a text");
}

#[test]
fn zero_and_negative_masses() {
    let mass = |value: &str| format!("mass_kg = {{ value = {value}, low = 0.006, high = 0.010,");
    let from = mass("0.008");
    // A negative or zero value is also below its own spread, but the range is said first.
    let zero = "body.actuator.mass_kg.value: 0 is outside the allowed 1e-6 … 1 kg";
    says(&from, &mass("0"), "mass_kg", zero);
    says(&from, &mass("-0.008"), "mass_kg", "body.actuator.mass_kg.value: -0.008 is outside the allowed 1e-6 … 1 kg");
    says(
        "segment_mass_kg = { value = 3.2e-5,",
        "segment_mass_kg = { value = 0,",
        "segment_mass_kg",
        "backbone.segment_mass_kg.value: 0 is outside the allowed 1e-9 … 0.01 kg",
    );
    says(
        "mass_kg = { value = 0.003, low = 0.002,",
        "mass_kg = { value = 0.003, low = 0,",
        "mass_kg",
        "eccentric.mass_kg.low: 0 is outside the allowed 1e-6 … 1 kg",
    );
}

#[test]
fn the_unit_that_was_probably_meant() {
    for (from, to, at, expected) in [
        (
            "mass_kg = { value = 0.008,",
            "mass_kg = { value = 8,",
            "mass_kg",
            "body.actuator.mass_kg.value: 8 is outside the allowed 1e-6 … 1 kg; if it is in g, write 0.008 kg; if it is in \
             mg, write 8e-6 kg",
        ),
        (
            "leg_m = { value = 0.012,",
            "leg_m = { value = 12,",
            "leg_m",
            "feet.leg_m.value: 12 is outside the allowed 1e-4 … 0.5 m; if it is in mm, write 0.012 m",
        ),
        (
            "torsion_nm_per_rad = { value = 0.012,",
            "torsion_nm_per_rad = { value = 1200,",
            "torsion_nm_per_rad",
            "backbone.torsion_nm_per_rad.value: 1200 is outside the allowed 1e-6 … 1000 N·m/rad; if it is in mN·m/rad, \
             write 1.2 N·m/rad",
        ),
        (
            "torsion_nm_s_per_rad = { value = 4.0e-5,",
            "torsion_nm_s_per_rad = { value = 40,",
            "torsion_nm_s_per_rad",
            "backbone.torsion_nm_s_per_rad.value: 40 is outside the allowed 0 … 1 N·m·s/rad; if it is in mN·m·s/rad, write \
             0.04 N·m·s/rad; if it is in µN·m·s/rad, write 4e-5 N·m·s/rad",
        ),
        (
            "normal_n_per_m = { value = 1900.0,",
            "normal_n_per_m = { value = 0.34,",
            "normal_n_per_m",
            "feet.normal_n_per_m.value: 0.34 is outside the allowed 1 … 1e6 N/m; if it is in N/mm, write 340 N/m",
        ),
        (
            "normal_s_per_m = { value = 60.0,",
            "normal_s_per_m = { value = -0.05,",
            "normal_s_per_m",
            "feet.normal_s_per_m.value: -0.05 is outside the allowed 0 … 1000 s/m",
        ),
        (
            "shear_n_s_per_m = { value = 6.5,",
            "shear_n_s_per_m = { value = 2000,",
            "shear_n_s_per_m",
            "feet.shear_n_s_per_m.value: 2000 is outside the allowed 0 … 1000 N·s/m",
        ),
    ] {
        says(from, to, at, expected);
    }
    let stribeck =
        "[effects.foot_stribeck]\nexcess_share = { value = 0.3, low = 0, high = 1, source = \"estimate\" }\n";
    says_of(
        &format!(
            "{DEFAULT}\n{stribeck}speed_m_per_s = {{ value = 10e0, low = 5e-3, high = 20, source = \"estimate\" }}\n"
        ),
        "speed_m_per_s",
        "effects.foot_stribeck.speed_m_per_s.high: 20 is outside the allowed 1e-5 … 10 m/s; if it is in mm/s, write 0.02 \
         m/s",
    );
    let load = "[effects.foot_load_friction]\nexponent = { value = 0.3, low = 0, high = 1, source = \"estimate\" }\n";
    says_of(
        &format!("{DEFAULT}\n{load}load_n = {{ value = 60, low = 50, high = 120, source = \"estimate\" }}\n"),
        "load_n",
        "effects.foot_load_friction.load_n.high: 120 is outside the allowed 1e-4 … 100 N; if it is in mN, write 0.12 N",
    );
}

#[test]
fn a_body_that_lacks_a_part() {
    let all = "[body], [backbone], [eccentric], [feet] and [ground] are one";
    for (table, there) in [
        ("backbone", "[body], [eccentric], [feet], [ground]"),
        ("eccentric", "[body], [backbone], [feet], [ground]"),
        ("feet", "[body], [backbone], [eccentric], [ground]"),
        ("ground", "[body], [backbone], [eccentric], [feet]"),
    ] {
        let expected = format!("body: stands without [{table}]: {all}; add [{table}], or remove {there}");
        says_of(&without(table), "[body]", &expected);
    }
}

#[test]
fn the_effects_of_the_feet_need_feet() {
    let bench = is_robot_of(
        "base = \"../robot.toml\"\nremove = [\"body\", \"backbone\", \"eccentric\", \"feet\", \"ground\"]\n",
    );
    assert!(bench.is_ok(), "{}", bench.unwrap_err());
    let share = "lateral_share = { value = 0.7, low = 0.5, high = 1, source = \"estimate\" }\n";
    let effect = format!(
        "base = \"../robot.toml\"\nremove = [\"body\", \"backbone\", \"eccentric\", \"feet\", \"ground\"]\n\
         [effects.foot_anisotropy]\n{share}"
    );
    assert_eq!(
        is_robot_of(&effect).unwrap_err(),
        "variant.toml:3: effects.foot_anisotropy: needs a body: there are no feet on the ground; remove it, or add [body]"
    );
    is_robot(&format!("{DEFAULT}\n[effects.foot_anisotropy]\n{share}"));
}

/// A variant in robots/, or what is wrong with it.
fn is_robot_of(text: &str) -> Result<Robot, String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/");
    Robot::parse(text, &format!("{folder}variant.toml")).map_err(|error| error.to_string().replace(folder, ""))
}

#[test]
fn a_clamp_on_no_module() {
    let clamped = |number: &str| format!("clamped_module = {number}\n{MODULES}");
    is_robot(&changed(MODULES, &clamped("4")));
    let expected = "body.clamped_module: there is no module 5: the robot has 4; write 1 (the front one) to 4";
    says(MODULES, &clamped("5"), "clamped_module", expected);
    let whole = "body.clamped_module: must be a whole number; write it without a fraction";
    says(MODULES, &clamped("1.5"), "clamped_module", whole);
    says(MODULES, &clamped("0"), "clamped_module", "body.clamped_module: 0 is outside the allowed 1 … 64");
}

#[test]
fn backbones_that_do_not_fit_the_modules() {
    says(
        "segments = { value = 10, low = 10, high = 10,",
        "segments = { value = 10.5, low = 10, high = 11,",
        "segments",
        "backbone.segments: must be a whole number; write it without a fraction",
    );
    let roll = |angles: &str| changed("[backbone]\n", &format!("[backbone]\nroll_deg = {angles}\n"));
    is_robot(&roll("[60, 120, 180]"));
    says_of(
        &roll("[60, 120]"),
        "roll_deg",
        "backbone.roll_deg: 4 modules have 3 backbones, found 2 angles; give one angle a backbone, from front to rear",
    );
    says_of(&roll("[60, 120, 2000]"), "roll_deg", "backbone.roll_deg: 2000 is outside the allowed -1080 … 1080 °");
}

#[test]
fn ground_that_does_not_run_on() {
    let ground = |lines: &str| changed(FRICTION, &format!("{FRICTION}{lines}\n"));
    let order = "x must increase; order the pairs from rear to front (x points ahead)";
    for key in ["steps_m", "patches_m"] {
        let text = ground(&format!("{key} = [[0.2, 0.0], [0.1, 0.5]]"));
        says_of(&text, key, &format!("ground.{key}: {order}"));
        let text = ground(&format!("{key} = [[0.2, 0.0], [0.2, 0.5]]"));
        says_of(&text, key, &format!("ground.{key}: {order}"));
        is_robot(&ground(&format!("{key} = [[0.1, 0.0], [0.2, 0.5]]")));
    }
    says_of(
        &ground("steps_m = [[0.1, 5]]"),
        "steps_m",
        "ground.steps_m: 5 is outside the allowed -1 … 1 m; if it is in mm, write 0.005 m; if it is in µm, write 5e-6 m",
    );
    says_of(
        &ground("patches_m = [[0.1, 80]]"),
        "patches_m",
        "ground.patches_m: 80 is outside the allowed 0 … 10; if it is in %, write 0.8",
    );
    says_of(
        &ground("patches_m = [[300, 1]]"),
        "patches_m",
        "ground.patches_m: 300 is outside the allowed -100 … 100 m; if it is in mm, write 0.3 m; if it is in µm, write \
         3e-4 m",
    );
}

#[test]
fn feet_below_ground() {
    let steps = |pairs: &str| changed(FRICTION, &format!("{FRICTION}steps_m = {pairs}\n"));
    let below = |module: usize, x: &str, height: &str| {
        format!(
            "ground.steps_m: the feet of module {module} start below ground: at x = {x} m it is {height} m high, and the \
             feet start on height 0; let the ground rise ahead of x = 0.002 m or behind x = -0.122 m, or lower it"
        )
    };
    // The modules stand at 0, -0.04, -0.08 and -0.12 m, on spheres of 2 mm.
    says_of(&steps("[[-0.1, 0.01]]"), "steps_m", &below(1, "0", "0.01"));
    says_of(&steps("[[-0.13, 0.01], [-0.05, 0.0]]"), "steps_m", &below(3, "-0.08", "0.01"));
    says_of(&steps("[[-0.121, 0.004], [-0.119, 0.0]]"), "steps_m", &below(4, "-0.12", "0.004"));
    says_of(&steps("[[0.001, 0.01]]"), "steps_m", &below(1, "0", "0.01"));
    // Ahead of all feet, behind them, between two modules, and a ditch under the feet.
    for pairs in ["[[0.003, 0.01]]", "[[-1, 0.01], [-0.123, 0.0]]", "[[-0.03, 0.01], [-0.01, 0.0]]", "[[-1, -0.1]]"] {
        is_robot(&steps(pairs));
    }
}

#[test]
fn feet_that_do_not_fit_the_modules() {
    says(
        "inset_m = { value = 0.002, low = 0.0, high = 0.004,",
        "inset_m = { value = 0.02, low = 0.0, high = 0.04,",
        "inset_m",
        "feet.inset_m: must be less than half of body.actuator.width_m: the feet stand left and right of the middle; write \
         less than 0.015 m\n\
         robot.toml:LINE: feet.inset_m: must be less than half of body.passive.width_m: the feet stand left and right of \
         the middle; write less than 0.015 m",
    );
    says(
        "radius_m = { value = 0.002, low = 0.001, high = 0.003,",
        "radius_m = { value = 0.012, low = 0.001, high = 0.013,",
        "radius_m",
        "feet.radius_m: the foot is larger than its leg: it would be inside the module; write less than feet.leg_m, 0.012 m",
    );
}

#[test]
fn a_load_that_is_not_the_eccentrics() {
    let expected = |load: &str, made: &str| {
        format!(
            "load.inertia_kg_m2: {load} kg·m² is not the inertia of [eccentric] about the shaft, m (r² + ½ r_bolt²) = \
             {made} kg·m²; write {made}, or change [eccentric]"
        )
    };
    let load =
        |value: &str| changed("inertia_kg_m2 = { value = 3.03375e-7,", &format!("inertia_kg_m2 = {{ value = {value},"));
    says_of(&load("2.5e-7"), "inertia_kg_m2", &expected("2.5e-7", "3.03375e-7"));
    says_of(&load("3.07e-7"), "inertia_kg_m2", &expected("3.07e-7", "3.03375e-7"));
    says(
        "radius_m = { value = 0.010, low = 0.008,",
        "radius_m = { value = 0.009, low = 0.008,",
        "inertia_kg_m2",
        &expected("3.03375e-7", "2.46375e-7"),
    );
    is_robot(&load("3.05e-7"));
}
