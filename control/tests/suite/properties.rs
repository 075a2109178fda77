//! Whatever comes in: nothing panics, the bridge's command is finite and within ±1, and it is off where it must be.

use crate::common;
use control::parameters::ParameterError;
use control::{AdcCode, Command, Controller, Field, ParameterError as Exported, Refusal, Sample, State, Stroke};
use proptest::prelude::*;

fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![-80.0f32..80.0, -4.0f32..4.0, any::<f32>(), Just(f32::NAN), Just(f32::INFINITY)]
}

fn any_command() -> impl Strategy<Value = Command> {
    prop_oneof![
        Just(Command::Idle),
        Just(Command::Coast),
        Just(Command::ClearFault),
        any_f32().prop_map(|omega| Command::Speed { omega }),
        Just(Command::Gait { id: common::gait().id() }),
        any::<u32>().prop_map(|id| Command::Gait { id }),
        any_f32().prop_map(|angle| Command::Position { angle }),
        any_f32().prop_map(|duty| Command::Duty { duty }),
        (any_f32(), any_f32(), any::<bool>()).prop_map(|(from, to, bang)| Command::Oscillate {
            from,
            to,
            style: if bang { Stroke::BangBang } else { Stroke::Proportional },
        }),
    ]
}

/// Mostly a tick later, at times anything.
fn any_time() -> impl Strategy<Value = (bool, u64)> {
    prop_oneof![20 => (Just(true), 900u64..1100), 1 => (Just(true), 0u64..100_000), 1 => (Just(false), any::<u64>())]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn nothing_that_comes_in_harms(
        steps in prop::collection::vec((any_time(), 0u16..5000, any::<u16>(), prop::option::weighted(0.1, any_command())), 1..400)
    ) {
        let mut controller = Controller::new(&common::parameters()).unwrap();
        controller.keep_gait(&common::gait()).unwrap();
        let mut time_us = 0u64;
        for ((relative, time), angle, battery, command) in steps {
            time_us = if relative { time_us.wrapping_add(time) } else { time };
            let before = controller.telemetry();
            if let Some(command) = command {
                let answer = controller.command(command, time_us);
                if before.state == State::Fault && command != Command::ClearFault {
                    prop_assert!(answer.is_err());
                }
            }
            let actuation = controller.tick(&Sample { time_us, angle: AdcCode(angle), second: None, battery: AdcCode(battery) });
            let t = controller.telemetry();
            prop_assert!(actuation.duty.is_finite() && actuation.duty.abs() <= 1.0, "{actuation:?}");
            prop_assert!(t.angle.is_finite() && t.speed.is_finite() && t.current.is_finite() && t.drag.is_finite(), "{t:?}");
            prop_assert!(t.angle.abs() <= std::f32::consts::PI + 1e-5);
            if !t.state.is_driving() {
                prop_assert!(!actuation.enable, "{:?}", t.state);
            }
            if t.state == State::Fault {
                prop_assert!(t.fault.is_some());
            }
            if before.state == State::Fault && t.state != State::Fault {
                prop_assert_eq!(command, Some(Command::ClearFault));
            }
        }
    }
}

#[test]
fn parameters_are_refused_by_name() {
    let refused = |change: fn(&mut control::Parameters)| {
        let mut parameters = common::parameters();
        change(&mut parameters);
        Controller::new(&parameters).err()
    };
    assert_eq!(refused(|_| ()), None);
    assert_eq!(refused(|p| p.motor.inertia = f32::NAN), Some(Exported::NonFinite { name: "motor.inertia" }));
    assert_eq!(
        refused(|p| p.motor.resistance = 0.0),
        Some(ParameterError::NonPositive { name: "motor.resistance", value: 0.0 })
    );
    assert_eq!(
        refused(|p| p.sensor.blind_to = 4.0),
        Some(ParameterError::OutOfRange { name: "sensor.blind_to", value: 4.0, low: 0.0, high: std::f32::consts::PI })
    );
    assert!(matches!(refused(|p| p.acquisition.samples = 17), Some(ParameterError::OutOfRange { .. })));
    assert!(matches!(refused(|p| p.sensor.knots[1].code = 0.0), Some(ParameterError::NonPositive { .. })));
}

#[test]
fn commands_are_refused_with_a_reason() {
    let mut controller = Controller::new(&common::parameters()).unwrap();
    let nan = controller.command(Command::Speed { omega: f32::NAN }, 0);
    assert_eq!(nan, Err(Refusal::NonFinite { name: Field::Omega }));
    let fast = controller.command(Command::Speed { omega: 500.0 }, 0);
    assert!(matches!(fast, Err(Refusal::OutOfRange { name: Field::Omega, .. })), "{fast:?}");
    let still = controller.command(Command::Speed { omega: 0.0 }, 0);
    assert!(matches!(still, Err(Refusal::OutOfRange { name: Field::OmegaMagnitude, .. })), "{still:?}");
    let backwards = Command::Oscillate { from: 1.0, to: -1.0, style: Stroke::BangBang };
    assert!(matches!(controller.command(backwards, 0), Err(Refusal::OutOfRange { name: Field::Span, .. })));
    for duty in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let refused = controller.command(Command::Duty { duty }, 0);
        assert_eq!(refused, Err(Refusal::NonFinite { name: Field::Duty }));
    }
    for duty in [1.001, -1.001] {
        let refused = controller.command(Command::Duty { duty }, 0);
        assert_eq!(refused, Err(Refusal::OutOfRange { name: Field::Duty, value: duty, low: -1.0, high: 1.0 }));
    }
    assert_eq!(controller.telemetry().state, State::Idle);
}
