//! What an experiment is expected to tell is what simulated recordings tell.

use std::path::Path;

use hal_sim::Settings;
use recording::Recording;
use robot_file::edit::Document;
use simulation::{Drive, DriveCommand, Plan, Step, recording, run};

use super::*;
use crate::misfit;

/// A bench with an encoder, and one effect.
fn bench(effect: &str) -> Robot {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-linear.toml");
    let encoder = "kind = \"encoder\"\n\
        counts_per_turn = { value = 4096, low = 4096, high = 4096, source = \"test\" }\n\
        noise_deg = { value = 0.2, low = 0.2, high = 0.2, source = \"test\" }\n";
    let text = std::fs::read_to_string(&file).unwrap().replace("kind = \"ideal\"\n", encoder) + effect;
    Document::parse(&text, &file.display().to_string()).unwrap().robot().unwrap()
}

const DROP: &str = "[effects.driver_drop]\n\
    drop_v = { value = 0.8, low = 0.8, high = 0.8, source = \"test\" }\n\
    knee_a = { value = 0, low = 0, high = 0, source = \"test\" }\n\
    slope_ohm = { value = 0, low = 0, high = 0, source = \"test\" }\n";
const DEADBAND: &str = "[effects.driver_deadband]\n\
    width_duty = { value = 0.16, low = 0.16, high = 0.16, source = \"test\" }\n";

fn recorded(robot: &Robot, pieces: &[Piece], seed: u64) -> Recording {
    let mut at_s = 0.0;
    let mut steps = Vec::new();
    for piece in pieces {
        let command = piece.duty.map_or(DriveCommand::Coast, |duty| DriveCommand::Duty { duty });
        steps.push(Step { at_s, command });
        at_s += piece.seconds;
    }
    let plan = Plan { drive: Drive { steps, end_s: None }, seconds: at_s, faults: Vec::new() };
    let trace = run(robot, seed, &Settings::default(), &plan).unwrap();
    let faults: Vec<_> = trace.ticks.iter().filter_map(|tick| Some((tick.time_s, tick.telemetry.fault?))).collect();
    assert_eq!(faults.first(), None, "{pieces:?}");
    recording(&trace, robot)
}

/// Held-out error over the floor of a model that is fitted to the simulated recordings of another.
fn simulated(truth: &Robot, model: &Robot, pieces: &[Piece]) -> f64 {
    let [fit, held_out] = [1, 2].map(|seed| [recorded(truth, pieces, seed)]);
    let found = misfit(model, &fit, &held_out, &Options::default()).unwrap();
    found.before / found.noise_floor
}

#[test]
fn what_is_expected_is_what_recordings_show() {
    let models = [bench(DROP), bench(DEADBAND)];
    let found = design_experiment(&models, 6.0, &Options::default()).unwrap();
    let best = &found[0];
    let worst = best.expected.iter().map(|one| one.ratio).fold(f64::INFINITY, f64::min);
    assert!(worst > 1.1, "{best:?}");
    for one in &best.expected {
        let shown = simulated(&models[one.truth], &models[one.model], &best.pieces);
        let agree = (shown - 1.0) / (one.ratio - 1.0);
        assert!((0.5..2.0).contains(&agree), "{one:?}: {shown:.3}");
        let true_one = simulated(&models[one.truth], &models[one.truth], &best.pieces);
        assert!(true_one < 1.03, "{true_one:.3}");
    }
    // What a person would run first tells less.
    let most = best.pieces.iter().filter_map(|piece| piece.duty).fold(0.0, |most: f64, duty| most.max(duty.abs()));
    let steady = [Piece { seconds: 6.0, duty: Some(most) }];
    let told = simulated(&models[0], &models[1], &steady);
    assert!(told < 0.5 * (worst - 1.0) + 1.0, "{told:.3} of {:.3}", worst);
}

#[test]
fn two_models_that_no_drive_tells_apart_do_not_hide_a_third() {
    // Of one supply, a dead time takes as much as a drop until the duty is full: this pair stays near 1 whatever the drive.
    let dead_time = "[effects.driver_dead_time]\nlost_duty = { value = 0.16, low = 0.16, high = 0.16, source = \"test\" }\n\
         shortest_duty = { value = 0, low = 0, high = 0, source = \"test\" }\n\
         knee_a = { value = 0, low = 0, high = 0, source = \"test\" }\n";
    let models = [bench(DROP), bench(dead_time), bench(DEADBAND)];
    let found = design_experiment(&models, 6.0, &Options::default()).unwrap();
    let of = |pair: [usize; 2]| {
        found[0].expected.iter().filter(move |one| pair.contains(&one.truth) && pair.contains(&one.model))
    };
    assert!(of([0, 2]).all(|one| one.ratio > 1.5), "{:?}", found[0].expected);
}

#[test]
fn one_model_and_a_shaft_that_never_turns_have_no_experiment() {
    let one = [bench(DROP)];
    assert_eq!(design_experiment(&one, 4.0, &Options::default()), Err(DiagnoseError::NothingToTellApart));
    let stuck = bench(
        "[effects.coulomb_friction]\n\
         torque_nm = { value = 1e-2, low = 1e-2, high = 1e-2, source = \"test\" }\n\
         presliding_deg = { value = 0.2, low = 0.2, high = 0.2, source = \"test\" }\n",
    );
    let [drop] = one;
    assert_eq!(design_experiment(&[drop, stuck], 4.0, &Options::default()), Ok(Vec::new()));
}

#[test]
fn a_seed_gives_one_experiment_whatever_the_threads() {
    let models = [bench(DROP), bench(DEADBAND)];
    let with = |threads| design_experiment(&models, 2.0, &Options { threads, ..Options::default() }).unwrap();
    assert_eq!(with(1), with(2));
}
