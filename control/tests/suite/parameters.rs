//! Parameters by name: what is set comes back, and nothing that is set can make a set that no controller can run on.

use crate::common;
use control::parameters::table::{Kind, TABLE, find, get};
use control::parameters::{FaultLimit, ParameterError, Parameters, SetError};
use control::{Controller, ParameterError as Exported};
use proptest::prelude::*;

/// A set whose numbers bound each other so little that every other may be anywhere in its range.
fn loose() -> Parameters {
    let mut p = common::parameters();
    let s = &mut p.supervisor;
    for (watch, bound) in [
        (&mut s.stall, 0.6),
        (&mut s.sensor_open, 1.5),
        (&mut s.sensor_shorted, 0.7),
        (&mut s.sensor_frozen, 0.4),
        (&mut s.supply_low, 0.15),
        (&mut s.clock, 0.15),
        (&mut s.runaway, 0.6),
        (&mut s.overheated, 0.1),
    ] {
        *watch = FaultLimit { persistence: 0.0, bound, ..*watch };
    }
    s.slow_after = 0.0;
    s.command_old = FaultLimit { limit: 0.0, persistence: 0.0, bound: 0.7 };
    s.loop_starved = FaultLimit { limit: 0.01, persistence: 0.0, bound: 0.2 };
    s.supply_low.limit = 3.0;
    s.supply_high = 60.0;
    s.rest_least = 0.0;
    s.rest_most = 100.0;
    s.runaway.limit = 1e4;
    p.limits.speed = 700.0;
    p.limits.least_speed = 0.0;
    p
}

fn index(name: &str) -> u16 {
    find(name).unwrap_or_else(|| panic!("no parameter {name}"))
}

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-6 * b.abs() + f32::MIN_POSITIVE
}

/// The parameter that a refusal is about.
fn named(error: SetError) -> Option<&'static str> {
    match error {
        SetError::NoSuchParameter => None,
        SetError::NotWhole { name, .. }
        | SetError::Refused(
            ParameterError::NonFinite { name }
            | ParameterError::NonPositive { name, .. }
            | ParameterError::OutOfRange { name, .. },
        ) => Some(name),
    }
}

#[test]
fn a_name_is_found_at_its_index_and_fits_the_wire() {
    for (place, entry) in (0u16..).zip(TABLE) {
        assert_eq!(find(entry.name), Some(place), "{} stands twice", entry.name);
        assert!(entry.name.len() < 64 && entry.unit.len() < 16, "{entry:?}");
        assert!(entry.low < entry.high && entry.low.is_finite() && entry.high.is_finite(), "{entry:?}");
        if entry.kind == Kind::Whole {
            let (low, high) = (entry.low, entry.high);
            assert!(low.fract() == 0.0 && high.fract() == 0.0 && low >= 0.0 && high <= 65535.0, "{entry:?}");
        }
    }
    for name in ["", "controller", "controller.position.proportional", "position.proportional_v_per_rad"] {
        assert_eq!(find(name), None);
    }
}

#[test]
fn what_is_set_comes_back_and_nothing_else_moves() {
    for (place, entry) in (0u16..).zip(TABLE) {
        let mut base = loose();
        if entry.name == "controller.supervisor.runaway_rad_per_s" {
            base.limits.speed = 0.07;
        }
        if entry.name == "effects.driver_drop.drop_v" {
            base.bridge.rail = 10.0;
        }
        if entry.name == "controller.supervisor.link_slow_s" {
            base.supervisor.command_old.limit = 0.6;
        }
        for share in [0.0, 0.1, 0.37, 0.5, 0.9, 1.0f32] {
            let mut value = entry.low + share * (entry.high - entry.low);
            if entry.kind == Kind::Whole {
                value = value.round();
            }
            let changed = base.with(place, value).unwrap_or_else(|error| panic!("{} = {value}: {error}", entry.name));
            let back = get(&changed, place).unwrap();
            assert!(close(back, value), "{} = {value} comes back as {back}", entry.name);
            assert!(Controller::new(&changed).is_ok());
            for other in (0..).take(TABLE.len()).filter(|other| *other != place) {
                assert_eq!(
                    get(&changed, other),
                    get(&base, other),
                    "{} moved {}",
                    entry.name,
                    TABLE[other as usize].name
                );
            }
        }
    }
}

#[test]
fn beyond_the_range_nothing_is_taken() {
    let base = loose();
    for (place, entry) in (0u16..).zip(TABLE) {
        let (name, low, high) = (entry.name, entry.low, entry.high);
        for value in [low.next_down(), high.next_up(), -1.0, f32::MIN, f32::MAX] {
            let refused = Err(SetError::Refused(ParameterError::OutOfRange { name, value, low, high }));
            assert_eq!(base.with(place, value), refused);
        }
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(base.with(place, value), Err(SetError::Refused(ParameterError::NonFinite { name })));
        }
    }
}

#[test]
fn a_count_is_whole() {
    let base = loose();
    let samples = index("controller.position.average_samples");
    let name = TABLE[usize::from(samples)].name;
    assert_eq!(base.with(samples, 4.5), Err(SetError::NotWhole { name, value: 4.5 }));
    assert_eq!(base.with(samples, 4.0f32.next_up()).map_err(named), Err(Some(name)));
    assert_eq!(base.with(samples, 7.0).unwrap().position.average, 7);
    let refused = base.with(samples, 4.5).unwrap_err().to_string();
    assert_eq!(refused, "controller.position.average_samples must be a whole number, not 4.5");
}

#[test]
fn beyond_the_table_there_is_nothing() {
    let base = loose();
    for place in [TABLE.len() as u16, u16::MAX] {
        assert_eq!(get(&base, place), None);
        assert_eq!(base.with(place, 1.0), Err(SetError::NoSuchParameter));
    }
}

#[test]
fn degrees_and_hertz_become_radians() {
    let base = loose();
    let tolerance = base.with(index("controller.position.tolerance_deg"), 90.0).unwrap();
    assert!(close(tolerance.position.tolerance, std::f32::consts::FRAC_PI_2));
    let fastest = base.with(index("controller.limits.frequency_hz"), 10.0).unwrap();
    assert!(close(fastest.limits.speed, 20.0 * std::f32::consts::PI));
    let slowest = base.with(index("controller.limits.least_frequency_hz"), 2.0).unwrap();
    assert!(close(slowest.limits.least_speed, 4.0 * std::f32::consts::PI));
}

/// A set that is filled elsewhere is held to the same ranges, and the refusal speaks in robot.toml's names and units.
#[test]
fn a_set_is_checked_in_the_units_of_the_file() {
    let refused = |change: fn(&mut Parameters)| {
        let mut set = loose();
        change(&mut set);
        set.check().expect_err("refused").to_string()
    };
    let least = refused(|p| p.limits.least_stroke = 0.001);
    assert!(least.starts_with("controller.limits.least_stroke_deg must be from 0.1 to 343, not 0.05729"), "{least}");
    let gate = refused(|p| p.estimator.gate = f32::NAN);
    assert_eq!(gate, "controller.estimator.gate_sigma must be a finite number");
    let margin = refused(|p| p.sensor.edge_margin = -0.1);
    assert!(margin.starts_with("controller.estimator.edge_margin_deg must be from 0 to 30"), "{margin}");
    let average = refused(|p| p.position.average = 0);
    assert_eq!(average, "controller.position.average_samples must be from 1 to 16, not 0");
}

/// Whoever converts a range's end, in f32 or in f64, rounds; what is more than rounding is refused.
#[test]
fn the_ends_of_a_range_bear_rounding_and_no_more() {
    const STROKE: f64 = 343.0;
    let with_stroke = |stroke: f32| {
        let mut set = loose();
        set.limits.least_stroke = stroke;
        set.check()
    };
    let end = STROKE.to_radians() as f32;
    for stroke in [end.next_down(), end, end.next_up(), 343.0f32.to_radians(), 0.1f32.to_radians().next_down()] {
        assert_eq!(with_stroke(stroke), Ok(()), "{stroke}");
    }
    assert!(with_stroke(end * (1.0 + 1e-6)).is_err());
    assert!(with_stroke(0.1f32.to_radians() * (1.0 - 1e-6)).is_err());
    assert!(with_stroke(f32::INFINITY).is_err() && with_stroke(f32::MAX).is_err());
}

#[test]
fn what_contradicts_another_parameter_is_refused() {
    let mut base = common::parameters();
    base.limits.speed = 70.0;
    let contradictions = [
        ("stall_bound_s", 0.1, "stall_bound_s"),
        ("runaway_bound_s", 0.05, "runaway_bound_s"),
        ("open_bound_s", 0.2, "open_bound_s"),
        ("shorted_bound_s", 0.2, "shorted_bound_s"),
        ("frozen_bound_s", 0.05, "frozen_bound_s"),
        ("supply_bound_s", 0.04, "supply_bound_s"),
        ("clock_bound_s", 0.04, "clock_bound_s"),
        ("starved_bound_s", 0.04, "starved_bound_s"),
        ("supply_high_v", 3.0, "supply_high_v"),
        ("rest_most_lsb", 0.1, "rest_most_lsb"),
        ("command_age_s", 0.6, "command_bound_s"),
        ("command_bound_s", 0.4, "command_bound_s"),
        ("runaway_rad_per_s", 69.0, "runaway_rad_per_s"),
        ("runaway_rad_per_s", 70.0, "runaway_rad_per_s"),
    ];
    let supervisor = |key: &str| format!("controller.supervisor.{key}");
    for (key, value, about) in contradictions {
        let error = base.with(index(&supervisor(key)), value).expect_err(key);
        let Some(name) = named(error) else { panic!("{error}") };
        assert_eq!(name, supervisor(about), "{key} = {value}");
        // The range that it names ends where the table's does.
        let SetError::Refused(Exported::OutOfRange { high, .. }) = error else { panic!("{error}") };
        assert_eq!(high, TABLE[usize::from(index(name))].high);
    }
    let speeds = base.with(index("controller.limits.least_frequency_hz"), 50.0).unwrap_err();
    assert_eq!(named(speeds), Some("controller.limits.frequency_hz"));
    let SetError::Refused(ParameterError::OutOfRange { value, low, .. }) = speeds else { panic!("{speeds}") };
    assert!(close(value, 70.0 / std::f32::consts::TAU) && close(low, 50.0), "{speeds}");
}

/// Often inside the range, else anything.
fn any_setting() -> impl Strategy<Value = (u16, f32)> {
    let inside = (0..TABLE.len(), 0.0f32..=1.0).prop_map(|(place, share)| {
        let entry = &TABLE[place];
        let value = entry.low + share * share * share * (entry.high - entry.low);
        (place as u16, if entry.kind == Kind::Whole { value.round() } else { value })
    });
    prop_oneof![4 => inside, 1 => (0u16..70, any::<f32>()), 1 => (any::<u16>(), any::<u32>().prop_map(f32::from_bits))]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_setting_makes_a_set_that_is_refused(
        settings in prop::collection::vec(any_setting(), 1..60), is_loose in any::<bool>()
    ) {
        let mut set = if is_loose { loose() } else { common::parameters() };
        for (place, value) in settings {
            match set.with(place, value) {
                Ok(changed) => {
                    set = changed;
                    prop_assert_eq!(set.check(), Ok(()));
                    prop_assert!(close(get(&set, place).unwrap(), value));
                }
                Err(SetError::NoSuchParameter) => prop_assert!(usize::from(place) >= TABLE.len()),
                Err(error) => prop_assert!(named(error).is_some_and(|name| find(name).is_some()), "{}", error),
            }
        }
        prop_assert!(Controller::new(&set).is_ok());
    }
}
