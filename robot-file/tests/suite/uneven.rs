//! Bodies that are not even, and what is refused of them: the whole message, and the line that it names.

use robot_file::Robot;
use robot_file::robot::Side;

const DEFAULT: &str = include_str!("../../../robot.toml");

fn quantity(key: &str, value: f64) -> String {
    format!("{key} = {{ value = {value}, low = {value}, high = {value}, source = \"a test\" }}\n")
}

/// What the reader says of the default robot with tables after it, at the line that begins with `at`; LINE is its number.
#[track_caller]
fn says(tables: &str, at: &str, expected: &str) {
    says_of(&format!("{DEFAULT}\n{tables}"), at, expected);
}

#[track_caller]
fn says_of(text: &str, at: &str, expected: &str) {
    let error = Robot::parse(text, "robot.toml").expect_err("the file must be refused");
    let line = error.problems()[0].line.expect("a line");
    assert_eq!(error.to_string(), format!("robot.toml:{line}: {expected}"));
    let named = text.lines().nth(line - 1).unwrap_or_default();
    assert!(named.starts_with(at), "the error names the line `{named}`");
}

/// An effect's table with these values; every other key has `rest`.
fn effect(name: &str, values: &[(&str, f64)], rest: f64) -> String {
    let id = effects::Id::of(name).expect("an effect");
    let keys = id.spec().parameters.iter().map(|one| one.key);
    let value = |key: &str| values.iter().find(|(name, _)| *name == key).map_or(rest, |(_, value)| *value);
    format!("[effects.{name}]\n{}", keys.map(|key| quantity(key, value(key))).collect::<String>())
}

#[test]
fn a_module_may_differ_from_its_kind() {
    let tables = format!(
        "[body.module.2]\n{}feet = [\"left\"]\n[body.module.4]\n{}{}",
        quantity("mass_kg", 0.021),
        quantity("height_m", 0.01),
        quantity("right_leg_m", 0.011)
    );
    let robot = Robot::parse(&format!("{DEFAULT}\n{tables}"), "robot.toml").unwrap_or_else(|error| panic!("{error}"));
    let (body, feet) = (robot.body.as_ref().unwrap(), robot.feet.as_ref().unwrap());
    assert_eq!(body.module[&2].feet, Some(vec![Side::Left]));
    let modules = body.modules_with(feet);
    assert_eq!(modules.iter().map(|module| module.mass).collect::<Vec<_>>(), [0.008, 0.021, 0.006, 0.006]);
    assert_eq!(modules.iter().map(|module| module.size[2]).collect::<Vec<_>>(), [0.008, 0.008, 0.008, 0.01]);
    let legs: Vec<_> = modules.iter().map(|module| module.feet.map(|foot| foot.map(|foot| foot.leg))).collect();
    let usual = [Some(None), Some(None)];
    assert_eq!(legs, [usual, [Some(None), None], usual, [Some(None), Some(Some(0.011))]]);
}

#[test]
fn a_variant_changes_one_number_of_a_module() {
    let text = format!("base = \"../robot.toml\"\n[body.module.3]\n{}", quantity("mass_kg", 0.007));
    let variant = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/uneven.toml");
    let robot = Robot::parse(&text, variant).unwrap_or_else(|error| panic!("{error}"));
    let modules = robot.body.as_ref().unwrap().modules_with(robot.feet.as_ref().unwrap());
    assert_eq!(modules.iter().map(|module| module.mass).collect::<Vec<_>>(), [0.008, 0.020, 0.007, 0.006]);
}

#[test]
fn modules_that_are_not_there() {
    let mass = quantity("mass_kg", 0.007);
    says(
        &format!("[body.module.5]\n{mass}"),
        "[body.module.5]",
        "body.module.5: there is no module 5: the robot has 4; write 1 (the front one) to 4",
    );
    for number in ["0", "two", "02"] {
        says(
            &format!("[body.module.{number}]\n{mass}"),
            &format!("[body.module.{number}]"),
            &format!("body.module.{number}: is no number; write [body.module.N], N being 1 for the first"),
        );
    }
    says("[body.module]\n2 = 0.007\n", "2 =", "body.module.2: expected a table, found a number");
    says(
        "[body.module.2]\nmass = 0.007\n",
        "mass",
        "body.module.2.mass: unknown field; did you mean `mass_kg`? allowed are mass_kg, length_m, width_m, height_m, \
         inertia_x_kg_m2, inertia_y_kg_m2, inertia_z_kg_m2, feet, inset_m, left_leg_m, right_leg_m",
    );
    says(
        "[body.module.2]\nmass_kg = { value = 0.007, low = 0.006, high = 8, source = \"a test\" }\n",
        "mass_kg",
        "body.module.2.mass_kg.high: 8 is outside the allowed 1e-6 … 1 kg; if it is in g, write 0.008 kg; if it is in mg, \
         write 8e-6 kg",
    );
}

#[test]
fn an_inertia_that_no_mass_has() {
    says(
        &format!("[body.module.3]\n{}", quantity("inertia_z_kg_m2", 2e-6)),
        "[body.module.3]",
        "body.module.3: the inertia about z is 2e-6 kg·m², more than those about the other two axes together, 7.14e-7: no \
         mass is spread so; compare inertia_x_kg_m2, inertia_y_kg_m2 and inertia_z_kg_m2; what is left out is the box's",
    );
}

#[test]
fn feet_that_cannot_be() {
    says(
        "[body.module.3]\nfeet = [\"lef\"]\n",
        "feet",
        "body.module.3.feet: unknown side of a module `lef`; did you mean `left`? allowed are left, right",
    );
    says(
        "[body.module.3]\nfeet = \"left\"\n",
        "feet",
        "body.module.3.feet: expected an array of `left` and `right`, found a text",
    );
    let bare = "feet = []\n";
    says(
        &format!("[body.module.1]\n{bare}[body.module.2]\n{bare}[body.module.3]\n{bare}"),
        "feet",
        "body.module.1.feet: the robot stands on 2 feet and falls over; leave it 3 or more, or hold a module fast with \
         body.clamped_module",
    );
    says(
        &format!("[body.module.2]\n{}", quantity("left_leg_m", 0.0015)),
        "left_leg_m",
        "body.module.2.left_leg_m: the foot is larger than its leg: it would be inside the module; write more than \
         feet.radius_m, 0.002 m",
    );
    says(
        &format!("[body.module.4]\n{}", quantity("inset_m", 0.02)),
        "[body.module.4]",
        "body.module.4: its feet's inset must be less than half of its width: they stand left and right of the middle; \
         write an inset_m of less than 0.015 m",
    );
}

#[test]
fn effects_of_parts_that_are_not_there() {
    let short = DEFAULT.replacen("\"passive\", \"passive\"]", "\"passive\"]", 1);
    for (tables, at, expected) in [
        (
            effect("foot_friction", &[("left_4_share", 0.5)], 1.0),
            "[effects.foot_friction]",
            "effects.foot_friction: speaks of the feet of module 4: the robot has 3 modules; write 1 for feet that are not \
             there",
        ),
        (
            effect("backbone_mismatch", &[("damping_3_share", 2.0)], 1.0),
            "[effects.backbone_mismatch]",
            "effects.backbone_mismatch: speaks of backbone 3: the robot has 2; write 1 for a backbone that is not there",
        ),
    ] {
        says_of(&format!("{short}\n{tables}"), at, expected);
        let whole = Robot::parse(&format!("{DEFAULT}\n{tables}"), "robot.toml");
        assert!(whole.is_ok(), "{:?}", whole.err());
    }
    let alike = DEFAULT.replacen("\"courier\", \"passive\", \"passive\"]", "\"passive\", \"passive\", \"passive\"]", 1);
    says_of(
        &format!("{alike}\n{}", effect("payload_offset", &[("y_m", 0.002)], 0.0)),
        "[effects.payload_offset]",
        "effects.payload_offset: needs a courier: no module of body.modules is one; remove it, or add a courier",
    );
}
