//! The firmware's image of a robot file, and every way in which a robot file does not fit an ESP32 board.

use std::path::Path;

use robot_file::Robot;
use robot_file::design;
use robot_file::image::{self, Image, ImageError};
use robot_file::robot::{Potentiometer, Sensor};

fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).expect("the project's own robot file")
}

fn potentiometer(robot: &mut Robot) -> &mut Potentiometer {
    match &mut robot.sensor {
        Sensor::Potentiometer(potentiometer) => potentiometer,
        _ => panic!("robot.toml has a potentiometer"),
    }
}

/// Field, reason and help of the refusal after one change to robot.toml.
#[track_caller]
fn refusal(change: impl FnOnce(&mut Robot)) -> (String, String, String) {
    let mut robot = robot();
    change(&mut robot);
    match Image::of(&robot) {
        Err(ImageError::Unfit { field, reason, help }) => (field.into(), reason, help),
        other => panic!("expected a refusal, got {other:?}"),
    }
}

#[track_caller]
fn refused(change: impl FnOnce(&mut Robot), field: &str, reason: &str, help: &str) {
    let (got_field, got_reason, got_help) = refusal(change);
    assert_eq!((got_field.as_str(), got_reason.as_str(), got_help.as_str()), (field, reason, help));
}

#[test]
fn the_image_holds_what_the_file_says() {
    let robot = robot();
    let image = Image::of(&robot).expect("robot.toml fits the boards");
    assert_eq!(image.name, robot.name);
    assert_eq!(image.parameters, design::design(&robot).expect("has a controller").parameters);
    assert_eq!(f64::from(image.pwm_hz), robot.driver.pwm_frequency_hz.value);
    assert_eq!(f64::from(image.pwm_bits).exp2(), robot.driver.pwm_steps.value);
    let mut copy = robot.clone();
    let adc = &potentiometer(&mut copy).adc;
    assert_eq!(f64::from(image.conversions), adc.conversions.value);
    assert_eq!(f64::from(image.outlier_lsb), 5.0 * adc.noise_lsb.high);
    assert_eq!(image.curve.saturates_v, adc.saturates_above_v.value as f32);
}

#[test]
fn every_robot_of_the_project_with_a_potentiometer_and_a_controller_fits() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    let mut fits = 0;
    let paths = std::fs::read_dir(folder).expect("robots/").map(|entry| entry.expect("an entry").path());
    for path in paths.filter(|path| path.is_file()) {
        let robot = Robot::load(&path).expect("the project's own robot file");
        let real = matches!(robot.sensor, Sensor::Potentiometer(_)) && robot.controller.is_some();
        let image = Image::of(&robot);
        assert_eq!(image.is_ok(), real, "{}: {:?}", robot.name, image.err());
        fits += usize::from(real);
    }
    assert!(fits > 0);
}

#[test]
fn a_sensor_that_the_boards_cannot_read() {
    refused(
        |robot| robot.sensor = Sensor::Ideal,
        "sensor.kind",
        "`ideal` is for simulation only, the firmware's boards read a potentiometer",
        "describe the potentiometer: kind = \"potentiometer\" and its table [sensor.adc]",
    );
}

#[test]
fn a_potentiometer_that_would_break_the_pin() {
    refused(
        |robot| potentiometer(robot).supply_v.value = 5.0,
        "sensor.supply_v",
        "the wiper reaches 5 V, a pin of the chip bears 3.6 V",
        "feed the potentiometer from the chip's own 3.3 V",
    );
}

#[test]
fn a_converter_of_other_bits() {
    refused(
        |robot| potentiometer(robot).adc.bits.value = 10.0,
        "sensor.adc.bits",
        "the converter has 10 bits, the boards' have 12",
        "set its value to 12",
    );
}

#[test]
fn no_battery() {
    let (field, reason, help) = refusal(|robot| robot.supply.battery = None);
    assert_eq!(field, "supply.battery");
    assert!(reason.contains("without its divider"), "{reason}");
    assert!(help.contains("[supply.battery]"), "{help}");
}

#[test]
fn a_divider_that_leaves_the_converter_no_room() {
    refused(
        |robot| robot.supply.battery.as_mut().expect("a battery").divider.value = 1.0,
        "supply.battery.divider",
        "a full cell of 4.2 V times 1 is 4.2 V at the pin, the converter saturates at 3.07 V",
        "choose resistors for a divider of at most 0.58",
    );
}

#[test]
fn no_controller() {
    let mut robot = robot();
    robot.controller = None;
    let error = Image::of(&robot).expect_err("no controller");
    assert!(matches!(error, ImageError::Design(_)), "{error}");
    assert!(error.to_string().contains("[controller]"), "{error}");
}

#[test]
fn another_control_period() {
    let (field, reason, help) = refusal(|robot| {
        robot.controller.as_mut().expect("a controller").tick_s.value = 2e-3;
    });
    assert_eq!((field.as_str(), help.as_str()), ("controller.tick_s", "set its value to 1e-3"));
    assert!(reason.contains("0.002") && reason.contains("0.001 s"), "{reason}");
}

#[test]
fn conversions_that_fill_the_tick() {
    refused(
        |robot| potentiometer(robot).adc.conversions.value = 9.0,
        "sensor.adc.conversions",
        "9 conversions of the wiper and one of the cell at 37.0 µs each take more than a third of a tick of 1000 µs",
        "set its value to at most 8",
    );
    let mut fits = robot();
    potentiometer(&mut fits).adc.conversions.value = 8.0;
    assert_eq!(Image::of(&fits).expect("a third of a tick").conversions, 8);
    let (_, _, help) = refusal(|robot| potentiometer(robot).adc.conversion_s.value = 5e-4);
    assert!(help.contains("sensor.adc.conversion_s"), "{help}");
    let (field, ..) = refusal(|robot| potentiometer(robot).adc.conversions.value = 2.5);
    assert_eq!(field, "sensor.adc.conversions");
}

#[test]
fn pwm_that_the_peripheral_cannot_make() {
    refused(
        |robot| robot.driver.pwm_steps.value = 8000.0,
        "driver.pwm_steps",
        "8000 steps, the chips' PWM (LEDC) has a power of two from 2 to 16384",
        "at 20000 Hz choose 2048 or less",
    );
    refused(
        |robot| robot.driver.pwm_steps.value = 4096.0,
        "driver.pwm_steps",
        "4096 steps at 20000 Hz need a clock of 81.9200 MHz, the chips' PWM (LEDC) has 80 MHz",
        "choose 2048 steps or less",
    );
    refused(
        |robot| robot.driver.pwm_frequency_hz.value = 20_000.5,
        "driver.pwm_frequency_hz",
        "20000.5 Hz is no whole number of hertz",
        "choose a whole number",
    );
    refused(
        |robot| robot.driver.pwm_frequency_hz.value = 10.0,
        "driver.pwm_frequency_hz",
        "10 Hz is too slow for the chips' PWM (LEDC) at 2048 steps",
        "choose 39 Hz or more",
    );
    // An ideal driver has no steps.
    let (field, ..) = refusal(|robot| robot.driver.pwm_steps.value = 0.0);
    assert_eq!(field, "driver.pwm_steps");
}

#[test]
fn a_name_that_is_too_long() {
    let (field, reason, _) = refusal(|robot| robot.name = "x".repeat(33));
    assert_eq!(field, "name");
    assert!(reason.contains("33 bytes"), "{reason}");
}

#[test]
fn a_build_looks_at_the_file_and_its_bases() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    let variant = folder.join("motor-136.toml");
    assert_eq!(image::files(&variant), [variant.clone(), folder.join("../robot.toml")]);
    assert_eq!(image::files(Path::new("none.toml")), [Path::new("none.toml")]);
    // Stands on itself.
    let loops = tempfile::Builder::new().suffix(".toml").tempfile().expect("a file");
    let name = loops.path().file_name().expect("a name").to_str().expect("plain");
    std::fs::write(loops.path(), format!("base = \"{name}\"")).expect("written");
    assert_eq!(image::files(loops.path()).len(), 9);
}

#[test]
fn a_second_sensor_that_the_boards_cannot_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/two-sensors.toml");
    let two = || Robot::load(&path).expect("the project's own robot file");
    assert!(Image::of(&two()).is_ok());
    let refused = |change: &dyn Fn(&mut Potentiometer)| {
        let mut robot = two();
        change(potentiometer(&mut robot));
        match Image::of(&robot) {
            Err(ImageError::Unfit { field, .. }) => field,
            other => panic!("expected a refusal, got {other:?}"),
        }
    };
    let another_converter = |sensor: &mut Potentiometer| {
        let mut adc = sensor.adc.clone();
        adc.full_scale_v.value += 0.1;
        sensor.second.as_mut().unwrap().adc = Some(adc);
    };
    assert_eq!(refused(&another_converter), "sensor.second.adc");
    let five_volts = |sensor: &mut Potentiometer| {
        let mut supply = sensor.supply_v.clone();
        (supply.value, supply.high) = (5.0, 5.0);
        sensor.second.as_mut().unwrap().supply_v = Some(supply);
    };
    assert_eq!(refused(&five_volts), "sensor.second.supply_v");
    // Twice 5 and the cell's are 2 more than a third of a tick holds; of one sensor it holds 8.
    assert_eq!(refused(&|sensor| sensor.adc.conversions.value = 5.0), "sensor.adc.conversions");
}
