//! What `robot_file` writes into the firmware is what the firmware reads.

use std::path::Path;

use control::AdcCode;
use robot_file::Robot;
use robot_file::angle_code::AdcCurve;
use robot_file::image;
use robot_file::robot::Sensor;
use shell::adc::Curve;
use shell::image::{Image, Pwm};
use shell::robot::Settings;

fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).expect("the project's own robot file")
}

/// What the firmware reads of what `robot_file` writes.
fn read(written: &image::Image) -> Image {
    let mut buffer = [0; 2048];
    Image::read(postcard::to_slice(written, &mut buffer).expect("short")).expect("the same fields")
}

#[test]
fn what_is_written_is_read_field_by_field() {
    let mut written = image::Image::of(&robot()).expect("robot.toml fits the boards");
    // No two are the same: none can be taken for another.
    (written.conversions, written.outlier_lsb, written.pwm_hz, written.pwm_bits) = (5, 70, 20_000, 11);
    written.curve = image::Curve {
        top_code: 4095.0,
        codes_per_v: 1350.0,
        low_v: 0.09,
        zero_below_v: 0.1,
        bend_v: 2.6,
        saturates_v: 3.1,
        bend_codes_per_v2: -50.0,
    };
    let curve = Curve {
        top_code: 4095.0,
        codes_per_v: 1350.0,
        low_v: 0.09,
        zero_below_v: 0.1,
        bend_v: 2.6,
        saturates_v: 3.1,
        bend_codes_per_v2: -50.0,
    };
    let name = written.name.as_str().try_into().expect("short");
    let settings = Settings { name, parameters: written.parameters, conversions: 5, outlier_lsb: 70 };
    assert_eq!(read(&written), Image { settings, pwm: Pwm { hz: 20_000, bits: 11 }, curve });
}

#[test]
fn the_project_s_own_robot_is_one_that_the_firmware_runs_on() {
    let image = read(&image::Image::of(&robot()).expect("robot.toml fits the boards"));
    assert_eq!(image.settings.check(), Ok(()));
    assert_eq!(image.settings.name.as_str(), robot().name);
}

#[test]
fn what_is_too_short_or_too_long_is_no_image() {
    let written = image::Image::of(&robot()).expect("robot.toml fits the boards");
    let mut buffer = [0; 2048];
    let length = postcard::to_slice(&written, &mut buffer).expect("short").len();
    assert!(Image::read(&buffer[..length]).is_ok());
    assert!(Image::read(&buffer[..=length]).is_err());
    assert!(Image::read(&buffer[..length - 1]).is_err());
}

#[test]
fn codes_are_those_of_the_robot_file() {
    let robot = robot();
    let Sensor::Potentiometer(potentiometer) = &robot.sensor else { panic!("robot.toml has a potentiometer") };
    let nominal = AdcCurve::new(&potentiometer.adc);
    let curve = read(&image::Image::of(&robot).expect("robot.toml fits the boards")).curve;
    for millivolt in 0..=u16::MAX {
        let exact = nominal.code(f64::from(millivolt) * 1e-3);
        let code = curve.code(millivolt);
        // Half a code of rounding, and single precision.
        assert!((f64::from(code.0) - exact).abs() < 0.502, "{millivolt} mV: {code:?}, exactly {exact}");
    }
    assert_eq!(curve.code(0), AdcCode(0));
    assert_eq!(curve.code(3300), curve.top());
    assert_eq!(f64::from(curve.top().0), nominal.top_code);
}
