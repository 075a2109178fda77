//! What a whole run may show, and what the person at the bench is told.

use std::time::Duration;

use control::State;
use control::protocol::radio::{BATCH, Batch, PackedTick};
use simulation::{Drive, Plan, Trace, run};

use super::*;

fn expected() -> Expected {
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).expect("robot.toml");
    let ceiling_hz = design(&robot).expect("it has a controller").ceiling / std::f64::consts::TAU;
    Expected { robot, tick_s: 1e-3, ceiling_hz }
}

fn simulated(expected: &Expected, duty: f64) -> Trace {
    let drive = Drive::parse(&format!("duty:{duty}")).expect("a drive");
    let plan = Plan { drive, seconds: 2.5, faults: Vec::new() };
    run(&expected.robot, 1, &hal_sim::Settings::default(), &plan).expect("it runs")
}

/// Telemetry of a run, as `edit` would have it; batches for which it says so never arrive.
fn received(trace: &Trace, arrives: impl Fn(u32) -> bool, edit: impl Fn(usize, PackedTick) -> PackedTick) -> Recorder {
    let mut recorder = Recorder::default();
    let rows: Vec<PackedTick> =
        trace.ticks.iter().map(|tick| PackedTick::new(tick.sample.angle, &tick.telemetry)).collect();
    for (number, rows) in (0u32..).zip(rows.chunks(BATCH)).filter(|(number, _)| arrives(*number)) {
        let first_tick = number * BATCH as u32;
        let rows = (first_tick as usize..).zip(rows).map(|(tick, row)| edit(tick, *row)).collect();
        let batch = Batch {
            first_tick,
            time_us: 1000 * u64::from(first_tick),
            state: State::Duty,
            fault: None,
            tracking: true,
            failed_sensor: None,
            battery_mv: 3900,
            rows,
        };
        let at = Duration::from_millis(u64::from(first_tick));
        recorder.take(&batch, at).expect("it goes on");
    }
    recorder
}

fn said(recorder: &Recorder, expected: &Expected) -> String {
    let error = evaluate(recorder, &recorder.recording(expected.tick_s), expected).expect_err("it is refused");
    format!("{error}; {}", error.help().expect("what to do"))
}

#[test]
fn a_good_run_gives_a_correction() {
    let expected = expected();
    let recorder = received(&simulated(&expected, 1.0), |_| true, |_, row| row);
    let fit = evaluate(&recorder, &recorder.recording(1e-3), &expected).expect("a correction");
    assert!(fit.after_rms_deg < 0.2 && fit.turns > 15.0);
}

#[test]
fn a_shaft_that_turns_the_wrong_way_has_swapped_wires() {
    let expected = expected();
    let swapped = |_, row: PackedTick| PackedTick { duty: row.duty.map(|duty| -duty), ..row };
    let text = said(&received(&simulated(&expected, -1.0), |_| true, swapped), &expected);
    assert!(text.contains("the angle falls") && text.contains("motor's two wires"), "{text}");
}

#[test]
fn a_shaft_that_stands_is_said() {
    let expected = expected();
    let text =
        said(&received(&simulated(&expected, 1.0), |_| true, |_, row| PackedTick { code: 2000, ..row }), &expected);
    assert!(text.contains("does not turn steadily") && text.contains("did it spin?"), "{text}");
}

#[test]
fn too_few_turns_are_said() {
    let expected = expected();
    let text = said(&received(&simulated(&expected, 1.0), |number| number < 45, |_, row| row), &expected);
    assert!(text.contains("turns") && text.contains("charge the battery"), "{text}");
}

#[test]
fn a_wiper_with_nothing_but_spikes_gives_no_correction() {
    let expected = expected();
    // Two readings of three are the hum of something else.
    let spikes = |tick: usize, row: PackedTick| PackedTick {
        code: if tick.is_multiple_of(3) { row.code } else { (tick * 1237 % 4096) as u16 },
        ..row
    };
    let text = said(&received(&simulated(&expected, 1.0), |_| true, spikes), &expected);
    assert!(text.contains("wiper"), "{text}");
}

#[test]
fn a_radio_that_loses_too_much_is_said() {
    let expected = expected();
    let text = said(&received(&simulated(&expected, 1.0), |number| number % 3 != 1, |_, row| row), &expected);
    assert!(text.starts_with("33 % of the ticks were lost on the radio; bring the dongle nearer"), "{text}");
}

#[test]
fn another_tick_than_the_robot_files_is_said() {
    let mut expected = expected();
    let recorder = received(&simulated(&expected, 1.0), |_| true, |_, row| row);
    expected.tick_s = 2e-3;
    let text = said(&recorder, &expected);
    assert!(text.starts_with("a tick of the robot lasts 1.00 ms; by the robot file it is 2.00 ms"), "{text}");
}

#[test]
fn paths_are_given_from_where_the_person_stands() {
    assert_eq!(for_shell(Path::new("out/calibrated/robot.toml")), "$PWD/out/calibrated/robot.toml");
    assert_eq!(for_shell(Path::new("/tmp/robot.toml")), "/tmp/robot.toml");
}
