//! Every way in which a robot file can be wrong: the whole message, with file, line and field.

use robot_file::Robot;

/// A small robot file; the tests change one thing each. Line numbers count from its first line.
const BENCH: &str = r#"name = "bench"
summary = "a motor with an encoder"

[motor]
resistance_ohm = { value = 15.0, low = 12.75, high = 17.25, source = "data sheet" }
inductance_h = { value = 150e-6, low = 1e-4, high = 2e-3, source = "estimate" }
torque_constant_nm_per_a = { value = 0.02, low = 0.01, high = 0.03, source = "data sheet" }
rotor_inertia_kg_m2 = { value = 1.2e-6, low = 0.7e-6, high = 2.5e-6, source = "estimate" }
viscous_nm_s_per_rad = { value = 1e-6, low = 0, high = 2e-6, source = "estimate" }
gear_ratio = { value = 26.4, low = 26.0, high = 26.5, source = "data sheet" }
continuous_current_a = { value = 0.1, low = 0.08, high = 0.12, source = "data sheet" }
thermal_time_constant_s = { value = 3, low = 1, high = 5, source = "estimate" }

[load]
inertia_kg_m2 = { value = 2.5e-7, low = 1e-7, high = 4e-7, source = "estimate" }

[driver]
pwm_frequency_hz = { value = 20e3, low = 20e3, high = 20e3, source = "chosen" }
pwm_steps = { value = 2048, low = 2048, high = 2048, source = "data sheet" }
dead_time_s = { value = 5e-7, low = 0, high = 1e-6, source = "data sheet" }

[supply]
rail_v = { value = 5.0, low = 4.8, high = 5.2, source = "data sheet" }

[sensor]
kind = "encoder"
counts_per_turn = { value = 4096, low = 4096, high = 4096, source = "data sheet" }
noise_deg = { value = 0.05, low = 0.02, high = 0.2, source = "estimate" }

[effects.coulomb_friction]
torque_nm = { value = 2e-3, low = 1e-3, high = 3e-3, source = "estimate" }
presliding_deg = { value = 0.2, low = 0.05, high = 1.0, source = "estimate" }
"#;

/// What the reader says about the file after one change.
#[track_caller]
fn says(from: &str, to: &str, expected: &str) {
    assert_eq!(BENCH.matches(from).count(), 1, "the change must hit one place");
    says_of(&BENCH.replacen(from, to, 1), expected);
}

#[track_caller]
fn says_of(text: &str, expected: &str) {
    let error = Robot::parse(text, "bench.toml").expect_err("the file must be refused");
    assert_eq!(error.to_string(), expected);
}

#[test]
fn the_unchanged_file_is_a_robot() {
    Robot::parse(BENCH, "bench.toml").unwrap();
}

#[test]
fn no_toml() {
    says("[load]\n", "[load\n", "bench.toml:14: not valid TOML: unclosed table, expected `]`");
    says("[load]", "[motor]", "bench.toml:14: not valid TOML: duplicate key");
}

#[test]
fn missing_field() {
    says(
        "inductance_h = { value = 150e-6, low = 1e-4, high = 2e-3, source = \"estimate\" }\n",
        "",
        "bench.toml:4: motor.inductance_h: field is missing in table [motor]; add `inductance_h = { value = …, low = …, \
         high = …, source = \"…\" }` within 1e-7 … 1 H (Winding inductance)",
    );
}

#[test]
fn missing_part_of_a_quantity() {
    says(
        "high = 17.25, source = \"data sheet\" }",
        "high = 17.25 }",
        "bench.toml:5: motor.resistance_ohm.source: field is missing in table [motor.resistance_ohm]; add `source = \
         \"…\"` (data sheet, paper, measurement or estimate)",
    );
    says(
        "low = 12.75, ",
        "",
        "bench.toml:5: motor.resistance_ohm.low: field is missing in table [motor.resistance_ohm]; add `low = …` (value \
         and the ends of its plausible range)",
    );
}

#[test]
fn missing_table() {
    says(
        "[load]\ninertia_kg_m2",
        "[effects.sensor_delay]\ndelay_s",
        "bench.toml:1: load: table is missing in the file; add [load] (What turns with the shaft)",
    );
}

#[test]
fn unknown_field() {
    says(
        "resistance_ohm",
        "resistence_ohm",
        "bench.toml:4: motor.resistance_ohm: field is missing in table [motor]; add `resistance_ohm = { value = …, low = \
         …, high = …, source = \"…\" }` within 0.01 … 1000 Ω (Winding resistance)\n\
         bench.toml:5: motor.resistence_ohm: unknown field; did you mean `resistance_ohm`? allowed are resistance_ohm, \
         inductance_h, torque_constant_nm_per_a, rotor_inertia_kg_m2, viscous_nm_s_per_rad, gear_ratio, \
         continuous_current_a, thermal_time_constant_s",
    );
    says(
        "inertia_kg_m2 = { value = 2.5e-7, low = 1e-7, high = 4e-7, source = \"estimate\" }\n",
        "inertia = 3\n",
        "bench.toml:14: load.inertia_kg_m2: field is missing in table [load]; add `inertia_kg_m2 = { value = …, low = …, \
         high = …, source = \"…\" }` within 0 … 1 kg·m² (The eccentric (or the pendulum) about the shaft; with an \
         `[eccentric]`, what follows from it)\n\
         bench.toml:15: load.inertia: unknown field; did you mean `inertia_kg_m2`? allowed are inertia_kg_m2",
    );
    says(
        "high = 17.25,",
        "high = 17.25, spread = 3,",
        "bench.toml:5: motor.resistance_ohm.spread: unknown field; allowed are value, low, high, source",
    );
    says(
        "[load]",
        "[wheel]\n[load]",
        "bench.toml:14: wheel: unknown field; allowed are name, summary, motor, load, driver, supply, sensor, radio, \
         body, backbone, eccentric, feet, ground, controller, effects",
    );
}

#[test]
fn wrong_type() {
    says(
        "resistance_ohm = { value = 15.0, low = 12.75, high = 17.25, source = \"data sheet\" }",
        "resistance_ohm = 15",
        "bench.toml:5: motor.resistance_ohm: expected { value, low, high, source }, found a number; write { value = 15, \
         low = …, high = …, source = \"…\" }: a number has its spread and source",
    );
    says(
        "value = 15.0",
        "value = \"15 ohm\"",
        "bench.toml:5: motor.resistance_ohm.value: expected a number in Ω, found a text",
    );
    says("\"encoder\"", "true", "bench.toml:26: sensor.kind: expected a text, found a boolean");
    says(
        "[supply]\nrail_v = { value = 5.0, low = 4.8, high = 5.2, source = \"data sheet\" }",
        "[[supply]]",
        "bench.toml:22: supply: expected a table, found an array",
    );
    says("name = \"bench\"", "name = \"\"", "bench.toml:1: name: must not be empty");
}

#[test]
fn not_finite() {
    says(
        "value = 15.0",
        "value = nan",
        "bench.toml:5: motor.resistance_ohm.value: NaN is not a finite number, allowed are 0.01 … 1000 Ω",
    );
    says(
        "high = 17.25",
        "high = inf",
        "bench.toml:5: motor.resistance_ohm.high: inf is not a finite number, allowed are 0.01 … 1000 Ω",
    );
}

#[test]
fn outside_the_range_with_the_unit_that_was_probably_meant() {
    says(
        "{ value = 2e-3, low = 1e-3, high = 3e-3,",
        "{ value = 20.0, low = 1e-3, high = 30.0,",
        "bench.toml:31: effects.coulomb_friction.torque_nm.value: 20 is outside the allowed 0 … 10 N·m; if it is in mN·m, \
         write 0.02 N·m; if it is in µN·m, write 2e-5 N·m\n\
         bench.toml:31: effects.coulomb_friction.torque_nm.high: 30 is outside the allowed 0 … 10 N·m; if it is in mN·m, \
         write 0.03 N·m; if it is in µN·m, write 3e-5 N·m",
    );
    says(
        "value = 15.0",
        "value = -15.0",
        "bench.toml:5: motor.resistance_ohm.value: -15 is outside the allowed 0.01 … 1000 Ω",
    );
    says(
        "value = 5e-7",
        "value = 0.55",
        "bench.toml:20: driver.dead_time_s.value: 0.55 is outside the allowed 0 … 0.001 s; if it is in ms, write 5.5e-4 s; if it is in µs, write 5.5e-7 s",
    );
}

#[test]
fn value_outside_its_own_spread() {
    says(
        "value = 15.0",
        "value = 12.0",
        "bench.toml:5: motor.resistance_ohm: low ≤ value ≤ high is required, found low 12.75, value 12, high 17.25",
    );
}

#[test]
fn unknown_effect() {
    let modelled: Vec<&str> = effects::Id::all().map(effects::Id::name).collect();
    let modelled = modelled.join(", ");
    says(
        "[effects.coulomb_friction]",
        "[effects.coulumb_friction]",
        &format!(
            "bench.toml:30: effects.coulumb_friction: unknown effect; did you mean `coulomb_friction`? allowed are {modelled}"
        ),
    );
    says(
        "[effects.coulomb_friction]",
        "[effects.magic]",
        &format!("bench.toml:30: effects.magic: unknown effect; allowed are {modelled}"),
    );
    says(
        "[effects.coulomb_friction]",
        "[effects.blind_arc]",
        &format!(
            "bench.toml:30: effects.blind_arc: this effect has a name but is not modelled yet; remove the table; modelled \
             are {modelled}"
        ),
    );
}

#[test]
fn two_frictions_of_which_one_contains_the_other() {
    let text = format!(
        "{BENCH}
[effects.stribeck_friction]
torque_nm = {{ value = 2e-3, low = 1e-3, high = 3e-3, source = \"estimate\" }}
breakaway_excess_nm = {{ value = 1e-3, low = 0, high = 2e-3, source = \"estimate\" }}
speed_rad_per_s = {{ value = 3, low = 1, high = 10, source = \"estimate\" }}
presliding_deg = {{ value = 0.2, low = 0.05, high = 1.0, source = \"estimate\" }}
"
    );
    says_of(
        &text,
        "bench.toml:30: effects.coulomb_friction: stands beside stribeck_friction, which contains it; keep one of the two \
         tables",
    );
}

#[test]
fn unknown_sensor() {
    says(
        "\"encoder\"",
        "\"potentiometre\"",
        "bench.toml:26: sensor.kind: unknown kind `potentiometre`; did you mean `potentiometer`? allowed are ideal, \
         encoder, potentiometer",
    );
    says(
        "kind = \"encoder\"\n",
        "",
        "bench.toml:25: sensor.kind: field is missing in table [sensor]; add `kind = \"…\"`, allowed are ideal, encoder, \
         potentiometer (which kind of sensor)",
    );
}

#[test]
fn steps_must_be_whole() {
    says(
        "value = 2048, low = 2048, high = 2048",
        "value = 2048.5, low = 2048, high = 2049",
        "bench.toml:19: driver.pwm_steps: must be a whole number; write it without a fraction",
    );
}

const BATTERY: &str = r#"
[supply.battery]
capacity_ah = { value = 0.15, low = 0.12, high = 0.15, source = "label" }
resistance_ohm = { value = 0.2, low = 0.1, high = 0.34, source = "estimate" }
open_circuit_v = [[0.0, 3.5], [0.5, 3.9], [1.0, 4.2]]
charge = { value = 0.75, low = 0.5, high = 1.0, source = "chosen" }
boost_efficiency = { value = 0.9, low = 0.85, high = 0.95, source = "data sheet" }
boost_limit_a = { value = 0.5, low = 0.45, high = 0.55, source = "data sheet" }
logic_current_a = { value = 0.2, low = 0.1, high = 0.3, source = "estimate" }
divider = { value = 0.5, low = 0.49, high = 0.51, source = "chosen" }
"#;

#[test]
fn a_battery_curve_that_is_none() {
    let with = |curve: &str| format!("{BENCH}{}", BATTERY.replace("[[0.0, 3.5], [0.5, 3.9], [1.0, 4.2]]", curve));
    Robot::parse(&with("[[0, 3.5], [1, 4.2]]"), "bench.toml").unwrap();
    let field = "bench.toml:37: supply.battery.open_circuit_v";
    says_of(
        &with("[[0, 4.2], [1, 3.5]]"),
        &format!("{field}: charge and voltage must both increase; order the pairs from empty to full"),
    );
    says_of(
        &with("[[0.1, 3.5], [1, 4.2]]"),
        &format!("{field}: must run from charge 0 to charge 1; add the missing end as [charge, volt]"),
    );
    says_of(&with("[[0, 3.5, 1], [1, 4.2]]"), &format!("{field}: expected 2 numbers, found 3"));
    says_of(&with("[3.5, 4.2]"), &format!("{field}: expected a pair of numbers, found a number"));
    says_of(&with("4.2"), &format!("{field}: expected an array of pairs, found a number"));
    says_of(
        &with("[[0, 3500], [1, 4.2]]"),
        &format!("{field}: 3500 is outside the allowed 0.5 … 60 V; if it is in mV, write 3.5 V"),
    );
}

const CORRECTION: &str = "
[sensor.correction]
zero_deg = 21.0
deg_per_code = 0.0887
cos_deg = [1.0, 0.5]
sin_deg = [1.0, 0.5]
blind_from_deg = -35.0
blind_to_deg = 25.0
residual_deg = 0.05
source = \"test\"
";

/// The default robot with a correction, its line numbers counted from the correction's header as 1.
#[track_caller]
fn correction_says(from: &str, to: &str, expected: &str) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    let robot = std::fs::read_to_string(path).unwrap();
    let header = robot.lines().count() + 2;
    let text = format!("{robot}{}", CORRECTION.replacen(from, to, 1));
    match Robot::parse(&text, "robot.toml") {
        Ok(_) => assert_eq!("", expected),
        Err(error) => {
            let problem = &error.problems()[0];
            let line = problem.line.unwrap() + 1 - header;
            assert_eq!(error.to_string(), expected.replace("LINE", &problem.line.unwrap().to_string()));
            let changed = to.trim().split(' ').next().unwrap();
            assert!(
                line == 1 || CORRECTION.lines().nth(line).unwrap().starts_with(changed),
                "line {line} of the table"
            );
        }
    }
}

#[test]
fn a_correction_that_contradicts_itself() {
    correction_says("", "", "");
    correction_says(
        "blind_to_deg = 25.0",
        "blind_to_deg = 0.0",
        "robot.toml:LINE: sensor.correction: blind_from_deg < 0 < blind_to_deg is required; angle 0 is the middle of the \
         gap; run `scram identify potentiometer` again",
    );
    correction_says(
        "cos_deg = [1.0, 0.5]",
        "cos_deg = [1.0]",
        "robot.toml:LINE: sensor.correction: cos_deg and sin_deg must be equally long; give every harmonic both amplitudes",
    );
    correction_says(
        "deg_per_code = 0.0887",
        "deg_per_code = 0",
        "robot.toml:LINE: sensor.correction.deg_per_code: must not be 0; run `scram identify potentiometer` again",
    );
    correction_says(
        "cos_deg = [1.0, 0.5]",
        "cos_deg = [1.0, 200]",
        "robot.toml:LINE: sensor.correction.cos_deg: 200 is outside the allowed -30 … 30 °",
    );
}

#[test]
fn no_such_file() {
    let error = Robot::load(std::path::Path::new("no/robot.toml")).unwrap_err();
    assert_eq!(error.to_string(), "no/robot.toml: no such file; name a robot file, e.g. robot.toml or one of robots/");
}

#[test]
fn everything_wrong_is_said_at_once_in_the_order_of_the_text() {
    let text =
        BENCH.replace("value = 15.0", "value = 0").replace("\"encoder\"", "\"lidar\"").replace("[load]", "[lode]");
    let error = Robot::parse(&text, "bench.toml").unwrap_err();
    let lines: Vec<_> =
        error.problems().iter().map(|problem| (problem.line.unwrap(), problem.field.as_str())).collect();
    assert_eq!(lines, [(1, "load"), (5, "motor.resistance_ohm.value"), (14, "lode"), (26, "sensor.kind")]);
}

#[test]
fn of_many_problems_the_first_are_shown_and_the_others_counted() {
    let table: String = (0..2000).map(|row| format!("{row},1,0.5\n")).collect();
    let said = Robot::parse(&table, "run.csv").expect_err("a table").to_string();
    assert!(said.starts_with("run.csv:1: "), "{said}");
    assert!(said.lines().count() <= 21 && said.ends_with("other mistakes: is this a robot file?"), "{said}");
}

#[test]
fn the_diagnostic_shows_the_line() {
    let error = Robot::parse(&BENCH.replace("value = 15.0", "value = 15000"), "bench.toml").unwrap_err();
    let mut shown = String::new();
    miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor())
        .with_width(160)
        .render_report(&mut shown, &error)
        .unwrap();
    assert!(shown.contains("15000 is outside the allowed 0.01 … 1000 Ω"), "{shown}");
    assert!(shown.contains("bench.toml:5:"), "{shown}");
    assert!(shown.contains("5 │ resistance_ohm = { value = 15000"), "{shown}");
    assert!(shown.contains("motor.resistance_ohm.value"), "{shown}");
}

/// The small file with the default robot's `[radio]`, changed in one place.
#[track_caller]
fn radio_says(from: &str, to: &str, expected: &str) {
    let default = include_str!("../../../robot.toml");
    let radio: Vec<&str> =
        default.lines().skip_while(|line| *line != "[radio]").take_while(|line| !line.is_empty()).collect();
    let text = format!("{BENCH}\n{}\n", radio.join("\n"));
    Robot::parse(&text, "bench.toml").expect("unchanged it is a robot");
    assert_eq!(text.matches(from).count(), 1, "the change must hit one place");
    let error =
        Robot::parse(&text.replacen(from, to, 1), "bench.toml").expect_err("the file must be refused").to_string();
    assert!(error.ends_with(expected), "{error}");
}

#[test]
fn a_radio_that_cannot_be() {
    radio_says(
        "channel = { value = 1,",
        "channel = { value = 1.5,",
        ": radio.channel: must be a whole number; write it without a fraction",
    );
    radio_says(
        "unicast_bit_per_s = { value = 6e6,",
        "unicast_bit_per_s = { value = 5e6,",
        ": radio.unicast_bit_per_s: is no bit rate of 802.11b or 802.11g; write 1e6, 2e6, 5.5e6, 11e6 (802.11b), 6e6, 9e6, \
         12e6, 18e6, 24e6, 36e6, 48e6 or 54e6 (802.11g)",
    );
    radio_says(
        "unicast_bit_per_s = { value = 6e6, low = 1e6, high = 6e6,",
        "unicast_bit_per_s = { value = 6, low = 6, high = 6,",
        "radio.unicast_bit_per_s.high: 6 is outside the allowed 1e6 … 5.4e7 bit/s; if it is in Mbit/s, write 6e6 bit/s",
    );
}

#[test]
fn a_radio_that_contradicts_itself() {
    radio_says(
        "tail_least_s = { value = 5e-3, low = 1e-3, high = 10e-3",
        "tail_least_s = { value = 50e-3, low = 1e-3, high = 50e-3",
        ": radio.tail_least_s: must not be above tail_most_s; compare the two values",
    );
    radio_says(
        "burst_loss_share = { value = 0.9, low = 0.5,",
        "burst_loss_share = { value = 0.005, low = 0.0,",
        ": radio.loss_share: must not be above burst_loss_share; compare the two values",
    );
    radio_says(
        "loss_share = { value = 0.01, low = 0.001, high = 0.03,",
        "loss_share = { value = 0.0001, low = 0.0, high = 0.03,",
        ": radio.quiet_loss_share: must not be above loss_share; compare the two values",
    );
}

/// The default robot with these lines behind it.
#[track_caller]
fn second_says(table: &str, expected: &str) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    let text = format!("{}\n[sensor.second]\n{table}\n", std::fs::read_to_string(path).unwrap());
    let found = Robot::parse(&text, "robot.toml").map_or_else(|error| error.to_string(), |_| String::new());
    let found = found.lines().next().unwrap_or_default();
    let (place, message) = found.split_once(": ").unwrap_or(("", ""));
    assert_eq!(message, expected);
    assert!(expected.is_empty() || place.starts_with("robot.toml:"), "{found}");
}

#[test]
fn a_second_sensor_that_cannot_be() {
    let offset =
        |value: f64| format!("offset_deg = {{ value = {value}, low = {value}, high = {value}, source = \"test\" }}");
    second_says(&offset(180.0), "");
    second_says(&offset(150.0), "");
    second_says(&offset(60.0), "sensor.second.offset_deg.value: 60 is outside the allowed 90 … 270 °");
    let wide = "electrical_angle_deg = { value = 180.0, low = 180.0, high = 180.0, source = \"test\" }";
    second_says(
        &format!("{}\n{wide}", offset(95.0)),
        "sensor.second.offset_deg: is 95° from the first one's gap, and the two gaps reach 105°: they overlap; mount it \
         half a turn away: 180°",
    );
}

#[test]
fn a_second_sensor_is_as_the_first_where_nothing_else_is_said() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let robot = Robot::load(&root.join("robots/two-sensors.toml")).unwrap();
    let robot_file::robot::Sensor::Potentiometer(mut first) = robot.sensor else { panic!("a potentiometer") };
    let second = first.second.as_mut().unwrap();
    let mut play = first.hysteresis_deg.clone();
    play.value = 1.5;
    second.hysteresis_deg = Some(play);
    second.correction = None;
    let resolved = first.second_resolved().unwrap();
    assert_eq!((&resolved.adc, resolved.in_gap), (&first.adc, first.in_gap));
    assert_eq!(resolved.electrical_angle_deg, first.electrical_angle_deg);
    assert_eq!((resolved.hysteresis_deg.value, resolved.second), (1.5, None));
}
