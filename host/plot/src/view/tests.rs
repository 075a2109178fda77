//! The page stands alone, holds the motion, and cannot be broken by a name.

use std::path::Path;

use hal_sim::body::{Drive, Ensemble, Plan, Settings, Track};
use robot_file::Robot;
use serde_json::Value;

use super::*;

const INTERVAL_S: f64 = 1e-3;

fn plan() -> Plan {
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
    Plan::new(&robot).unwrap()
}

/// What stands between a start and the next end.
fn between<'a>(text: &'a str, start: &str, end: &str) -> &'a str {
    let (_, rest) = text.split_once(start).unwrap_or_else(|| panic!("no {start}"));
    rest.split_once(end).unwrap().0
}

fn embedded(page: &str) -> Value {
    serde_json::from_str(between(page, "<script type=\"application/json\" id=\"run\">", "</script>")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The frames of a page, decoded: a row a frame; and half a step of each channel, which is the error allowed.
fn decoded(run: &Value) -> (Vec<Vec<f64>>, Vec<f64>) {
    let scale: Vec<Vec<f64>> = run["scale"].as_array().unwrap().iter().map(numbers).collect();
    let bytes = base16ct::lower::decode_vec(run["codes"].as_str().unwrap()).unwrap();
    let codes: Vec<f64> = bytes.chunks(2).map(|pair| f64::from(u16::from_le_bytes([pair[0], pair[1]]))).collect();
    let row = |codes: &[f64]| codes.iter().zip(&scale).map(|(code, scale)| scale[0] + scale[1] * code).collect();
    (codes.chunks(scale.len()).map(row).collect(), scale.iter().map(|scale| 0.5 * scale[1]).collect())
}

#[test]
fn the_page_needs_nothing_else() {
    let page = page(&synthetic::track(&plan(), 0.1, INTERVAL_S), "walk");
    assert!(page.contains("default-src 'none'"), "a browser that is told to load nothing");
    for loads in [" src=", " href=", "url(", "@import", "<link", "<img"] {
        assert!(!page.contains(loads), "{loads}");
    }
    for (name, source) in &SCRIPTS[1..] {
        for reaches in ["http:", "https:", "fetch(", "XMLHttpRequest", "WebSocket", "import("] {
            assert!(!source.contains(reaches), "{name}: {reaches}");
        }
        for import in source.lines().filter_map(|line| line.split_once(" from \"")) {
            let wanted = import.1.trim_end_matches("\";");
            assert!(SCRIPTS.iter().any(|(name, _)| *name == wanted), "{name} imports {wanted}");
        }
    }
    assert!(page.contains("Permission is hereby granted"), "three.js comes with its licence");
}

#[test]
fn scripts_come_out_of_the_import_map_as_they_are() {
    let page = page(&synthetic::track(&plan(), 0.1, INTERVAL_S), "walk");
    let map: Value = serde_json::from_str(between(&page, "<script type=\"importmap\">", "</script>")).unwrap();
    for (name, source) in SCRIPTS {
        let url = map["imports"][name].as_str().unwrap();
        let encoded = url.strip_prefix("data:text/javascript;charset=utf-8,").unwrap();
        let mut bytes = vec![];
        let mut pieces = encoded.split('%');
        bytes.extend(pieces.next().unwrap().bytes());
        for piece in pieces {
            let (digits, plain) = piece.split_at(2);
            bytes.push(u8::from_str_radix(digits, 16).unwrap());
            bytes.extend(plain.bytes());
        }
        assert!(bytes == source.as_bytes(), "{name}");
        assert!(!encoded.contains(['#', '\n', ' ', '"']), "{name}: what a URL drops or ends at");
    }
}

#[test]
fn the_motion_is_in_the_page_to_half_a_step_of_its_codes() {
    let track = synthetic::track(&plan(), 2.0, INTERVAL_S);
    let page = page(&track, "walk");
    assert!(page.len() < 1_500_000, "{} bytes", page.len());
    let run = embedded(&page);
    let (rows, allowed) = decoded(&run);
    assert_eq!(rows.len(), 401, "200 frames a second");
    assert!((run["interval_s"].as_f64().unwrap() - 0.005).abs() < 1e-12);
    // Micrometres and 0.01°: less than a pixel shows.
    let segments = track.plan.joints();
    for (channel, allowed) in allowed.iter().take(7 * (track.plan.modules.len() + segments)).enumerate() {
        assert!(*allowed < if channel % 7 < 3 { 2e-6 } else { 1e-4 }, "channel {channel}: {allowed}");
    }
    for (row, snapshot) in rows.iter().zip(track.snapshots.iter().step_by(5)) {
        let mut expected = vec![];
        for pose in snapshot.modules.iter().chain(&snapshot.segments) {
            expected.extend(pose.position);
            expected.extend(pose.orientation);
        }
        expected.extend(snapshot.feet.iter().flat_map(|foot| foot.force));
        let rotor = snapshot.rotor.unwrap();
        expected.extend([rotor.angle, 7.0]);
        assert_eq!(row.len(), expected.len());
        for (channel, (value, expected)) in row.iter().zip(&expected).enumerate() {
            let off = (value - expected).abs();
            assert!(off <= 1.001 * allowed[channel] + 1e-9, "{} s, channel {channel}: {off}", snapshot.time_s);
        }
    }
}

#[test]
fn orientations_do_not_jump_to_the_other_sign() {
    let mut track = synthetic::track(&plan(), 0.2, INTERVAL_S);
    for snapshot in track.snapshots.iter_mut().skip(50) {
        for pose in snapshot.modules.iter_mut().chain(&mut snapshot.segments) {
            pose.orientation = pose.orientation.map(|part| -part);
        }
    }
    let (rows, _) = decoded(&embedded(&page(&track, "walk")));
    for pair in rows.windows(2) {
        for part in 0..track.plan.modules.len() + track.plan.joints() {
            let at = |row: &[f64]| row[7 * part + 3..7 * part + 7].to_vec();
            let dot: f64 = at(&pair[0]).iter().zip(at(&pair[1])).map(|(a, b)| a * b).sum();
            assert!(dot > 0.9, "part {part}: {dot}");
        }
    }
}

/// The page draws the feet where the modules carry them.
#[test]
fn feet_of_the_simulation_are_fixed_to_their_modules() {
    let plan = plan();
    let mut ensemble = Ensemble::new(std::slice::from_ref(&plan), Settings::default()).unwrap();
    let drive = Drive::Phase { speed: common::conventions::omega_from_frequency(7.0) };
    for _ in 0..20 {
        ensemble.advance(100, &[drive]);
        let snapshot = ensemble.snapshot(0);
        for (k, (module, pose)) in plan.modules.iter().zip(&snapshot.modules).enumerate() {
            let [w, x, y, z] = pose.orientation;
            let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
            for (side, place) in module.feet.iter().enumerate() {
                let carried = turn * nalgebra::Vector3::from(*place) + nalgebra::Vector3::from(pose.position);
                let off = (carried - nalgebra::Vector3::from(snapshot.feet[2 * k + side].position)).norm();
                assert!(off < 1e-9, "module {k}, side {side}: {off} m");
            }
        }
    }
    assert!(ensemble.snapshot(0).modules[0].position[2] > 0.0);
}

#[test]
fn a_name_is_only_a_name() {
    let name = "a </title></script><script>alert(1)</script> {{run}} & \"b\" <!-- 'c'";
    let page = page(&synthetic::track(&plan(), 0.05, INTERVAL_S), name);
    assert!(!page.contains("alert(1)</script>"));
    assert_eq!(page.matches("</script").count(), 3, "import map, run, and the start");
    assert_eq!(page.matches("id=\"run\"").count(), 1);
    let shown = between(&page, "<title>", "</title>");
    assert_eq!(shown, crate::report::svg::escape(name));
    assert_eq!(embedded(&page)["title"], name);
}

#[test]
fn long_short_and_empty_runs_have_a_page() {
    let plan = plan();
    let frames = |track: &Track| embedded(&page(track, "walk"))["frames"].as_u64().unwrap();
    let long = synthetic::track(&plan, 65.0, 5e-3);
    assert_eq!(frames(&long), 4334, "every third of 13 001");
    let mut track = synthetic::track(&plan, 0.05, INTERVAL_S);
    track.snapshots.truncate(1);
    assert_eq!(frames(&track), 1);
    track.snapshots.clear();
    assert_eq!(frames(&track), 0);
}

#[test]
fn speeds_are_those_of_the_second_half_and_a_clamped_robot_has_none() {
    let plan = plan();
    let speeds =
        |seconds: f64| embedded(&page(&synthetic::track(&plan, seconds, INTERVAL_S), "walk"))["speeds"].clone();
    let whole = speeds(2.0);
    assert_eq!((whole["from_s"].as_f64(), whole["to_s"].as_f64()), (Some(1.0), Some(2.0)));
    let expected = synthetic::track(&plan, 2.0, INTERVAL_S).speeds(1.0, 2.0).unwrap();
    assert!((whole["longitudinal"].as_f64().unwrap() - expected.longitudinal).abs() < 1e-12);
    for (seconds, from) in [(0.5, 0.25), (5.0, 2.5)] {
        let other = speeds(seconds);
        assert_eq!((other["from_s"].as_f64(), other["to_s"].as_f64()), (Some(from), Some(seconds)));
    }
    let clamped = Plan { clamped: Some(3), ..plan };
    assert_eq!(embedded(&page(&synthetic::track(&clamped, 0.1, INTERVAL_S), "bench"))["speeds"], Value::Null);
}

#[test]
fn the_live_page_reaches_only_where_it_came_from() {
    let (plan, title) = (plan(), "a</script><b>\"robot\"");
    let rest = synthetic::track(&plan, 0.0, INTERVAL_S).snapshots.remove(0);
    let setup = Setup { title, body: Some((&plan, &rest)), moves: true, drive: false, frequency_limit_hz: 12.0 };
    let page = live_page(&setup);
    assert!(page.contains("default-src 'none'") && page.contains("connect-src 'self'"));
    assert!(page.contains("<title>a&lt;/script&gt;&lt;b&gt;") && !page.contains("<b>"));
    let known: Value =
        serde_json::from_str(between(&page, "<script type=\"application/json\" id=\"setup\">", "</script>")).unwrap();
    assert_eq!((known["drive"].as_bool(), known["moves"].as_bool()), (Some(false), Some(true)));
    assert_eq!(numbers(&known["rest"]), channels(&rest));
    assert_eq!(known["plan"]["modules"].as_array().unwrap().len(), plan.modules.len());
    let none = live_page(&Setup { body: None, ..setup });
    assert!(none.contains("\"plan\":null") && none.contains("\"rest\":null"));
    for (name, source) in live::LIVE_SCRIPTS {
        for reaches in ["http:", "https:", "fetch(", "XMLHttpRequest", "import("] {
            assert!(!source.contains(reaches), "{name}: {reaches}");
        }
        assert_eq!(source.contains("new WebSocket("), name == "live/line", "{name}");
        assert!(!source.contains("innerHTML") || !source.contains("message."), "{name}: what is told is text");
        for import in source.lines().filter_map(|line| line.split_once(" from \"")) {
            let wanted = import.1.trim_end_matches("\";");
            let mut all = SCRIPTS.iter().chain(&live::LIVE_SCRIPTS);
            assert!(all.any(|(name, _)| *name == wanted), "{name} imports {wanted}");
        }
    }
}
