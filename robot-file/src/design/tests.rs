use super::*;

use crate::edit::Document;
use crate::robot::{Quantity, Sensor};

fn default_robot() -> Robot {
    Robot::load(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).unwrap()
}

#[test]
fn the_default_robot_gets_a_stable_loop_with_margins() {
    let design = design(&default_robot()).unwrap();
    for pole in design.regulator_poles.iter().chain(&design.filter_poles) {
        assert!(pole.norm() < 1.0 - 1e-6, "{pole}");
    }
    assert!(design.residuals.iter().all(|residual| *residual < 1e-8), "{:?}", design.residuals);
    assert!(design.loop_margins.phase > 0.5, "{:?}", design.loop_margins);
    assert!(design.loop_margins.delay > 2.0 * design.discrete.period, "{:?}", design.loop_margins);
    // The thesis's 9 Hz are those of the robot that walks, which takes some of the torque.
    assert!((9.5..11.5).contains(&(design.ceiling / TAU)), "{} Hz", design.ceiling / TAU);
}

#[test]
fn the_arc_of_the_default_robot_is_wider_than_the_gap_and_not_symmetric() {
    let sensor = design(&default_robot()).unwrap().parameters.sensor;
    assert!((60.0..72.0).contains(&sensor.arc_width().to_degrees()), "{} deg", sensor.arc_width().to_degrees());
    assert!((sensor.blind_from + sensor.blind_to).abs().to_degrees() > 3.0);
}

#[test]
fn the_map_inverts_the_nominal_curve() {
    let robot = default_robot();
    let map = design(&robot).unwrap().parameters.sensor;
    let Sensor::Potentiometer(potentiometer) = &robot.sensor else { panic!("potentiometer expected") };
    let (curve, track) =
        (crate::angle_code::AdcCurve::new(&potentiometer.adc), crate::angle_code::Track::new(potentiometer));
    for code in map.lowest_code..=map.highest_code {
        let truth = track.angle(curve.voltage(f64::from(code)));
        let error =
            (f64::from(map.angle(control::AdcCode(code))) - truth + 9.0 * TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        assert!(error.abs().to_degrees() < 0.1, "code {code}: {} deg off", error.to_degrees());
    }
}

/// The default robot with an effect more, or another of the same name.
fn with_effect(name: &str, numbers: &[(&str, f64)]) -> Robot {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    let mut document = Document::parse(&std::fs::read_to_string(&file).unwrap(), "robot.toml").unwrap();
    let quantity = |value: f64| Quantity { value, low: value, high: value, source: "test".into() };
    let quantities: Vec<(&str, Quantity)> = numbers.iter().map(|(key, value)| (*key, quantity(*value))).collect();
    document.set_effect(name, &quantities).unwrap();
    document.robot().unwrap()
}

#[test]
fn every_loss_of_the_bridge_is_taken_back() {
    let base = design(&default_robot()).unwrap().parameters.bridge;
    let bridge = |name, numbers: &[_]| design(&with_effect(name, numbers)).unwrap().parameters.bridge;
    let near = |value: f32, expected: f32| assert!((value - expected).abs() < 1e-5, "{value}, not {expected}");
    near(
        bridge("driver_dead_time", &[("lost_duty", 0.04), ("shortest_duty", 0.0), ("knee_a", 0.0)]).drop,
        base.drop + 0.04 * base.rail,
    );
    near(bridge("driver_deadband", &[("width_duty", 0.05)]).deadband, base.deadband + 0.05);
    near(bridge("driver_drop_by_command", &[("drop_v", 0.3)]).deadband, base.deadband + 0.3 / base.rail);
}

#[test]
fn a_late_reading_costs_phase_and_a_filter_that_knows_it_bears_it() {
    let (prompt, late) =
        (design(&default_robot()).unwrap(), design(&with_effect("sensor_lag", &[("time_s", 8e-3)])).unwrap());
    assert!((late.parameters.estimator.reading_age - 8e-3).abs() < 1e-9);
    for pole in &late.filter_poles {
        assert!(pole.norm() < 1.0 - 1e-6, "{pole}");
    }
    assert!(late.loop_margins.delay < prompt.loop_margins.delay, "{:?}", late.loop_margins);
    assert!(late.loop_margins.phase > 0.3, "{:?}", late.loop_margins);
}

#[test]
fn the_filter_of_the_controller_settles_where_the_design_says() {
    settles_where_the_design_says(&default_robot());
    settles_where_the_design_says(&with_effect("sensor_delay", &[("delay_s", 8e-3)]));
}

/// f32 with the current slaved to the speed against f64 with all four states.
fn settles_where_the_design_says(robot: &Robot) {
    let design = design(robot).unwrap();
    let mut p = design.parameters;
    (p.sensor.blind_from, p.sensor.blind_to) = (0.0, 0.0);
    let mut filter = control::estimator::Estimator::new(&p);
    filter.acquire(&p, 2.0, 40.0);
    for _ in 0..4000 {
        filter.predict(&p, &p.estimator.speed, control::Actuation { duty: 0.95, enable: true }, 1);
        let reading = control::sensor::Reading::Angle(filter.estimate().angle_of_reading(&p));
        filter.update(&p, &p.estimator.speed, reading, -p.estimator.reading_age);
    }
    let covariance = filter.covariance();
    let steady = &design.filter.corrected;
    for (name, f32_value, f64_value) in [
        ("θθ", covariance.angle, steady[(0, 0)]),
        ("ωω", covariance.speed, steady[(1, 1)]),
        ("ττ", covariance.drag, steady[(3, 3)]),
    ] {
        let ratio = f64::from(f32_value) / f64_value;
        assert!((ratio - 1.0).abs() < 0.03, "{name}: {f32_value:e} against {f64_value:e}");
    }
}

#[test]
fn a_missing_number_is_named() {
    let mut robot = default_robot();
    robot.controller.as_mut().unwrap().numbers.remove("lqg.phase_deg");
    assert_eq!(design(&robot).unwrap_err(), DesignError::Missing { field: "controller.lqg.phase_deg".into() });
}

#[test]
fn a_motor_without_torque_is_refused() {
    let mut robot = default_robot();
    robot.motor.torque_constant_nm_per_a.value = 1e-30;
    assert!(matches!(design(&robot), Err(DesignError::NotStabilisable { what: "regulator", .. })));
}

#[test]
fn the_second_map_reads_the_shaft_from_its_own_gap() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/two-sensors.toml");
    let robot = crate::Robot::load(&path).expect("a robot");
    let parameters = design(&robot).expect("a controller").parameters;
    let second = parameters.second.expect("a second sensor");
    // The same part and converter: the same map, half a turn away.
    assert_eq!(second.map, parameters.sensor);
    assert!((second.offset.abs() - std::f32::consts::PI).abs() < 1e-6, "{}", second.offset);
    assert!((second.tolerance - 3f32.to_radians()).abs() < 1e-6);
    // Three conversions of 37 µs after three others.
    assert!((second.delay - 111e-6).abs() < 1e-9, "{}", second.delay);
    assert_eq!(second.noise, 1.0);
    let Some(crate::robot::Sensor::Potentiometer(mut sensor)) = Some(robot.sensor.clone()) else { panic!() };
    sensor.second = None;
    let one = crate::Robot { sensor: crate::robot::Sensor::Potentiometer(sensor), ..robot };
    assert_eq!(design(&one).expect("a controller").parameters, control::Parameters { second: None, ..parameters });
}
