//! Every effect that a fit moves, put into the simulated robot and fitted to its noisy readings with nothing else free: its
//! values come back. That a diagnosis finds it among others is another matter.

use std::collections::BTreeMap;
use std::path::Path;

use control::Actuation;
use effects::{Id, States};
use hal_sim::{Settings, SimulatedRobot};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use recording::{AngleReading, Drive, Recording};
use robot_file::Robot;
use robot_file::angle_code::angle_scale;
use robot_file::robot::Quantity;

use super::super::fit::{Data, Fit, Until, fit, in_small_steps, misfit};
use super::super::model::Boundary;
use super::super::rollout::{guess, refine, refine_all};
use super::super::track::Track;
use super::super::values;
use super::super::verdict::FittedParameter;
use super::FileModel;

mod coverage;

const SECONDS: f64 = 6.0;
/// Standard deviation of the readings' noise, rad.
const NOISE: f64 = 1e-3;

/// The bench: a motor on a 5 V rail, an ideal driver and sensor, no effect; and the same with one of the catalogue.
fn robots(effect: &str, values: &[(&str, f64)]) -> (Robot, Robot) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-linear.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let parse = |text: &str| {
        let document = robot_file::edit::Document::parse(text, &path.display().to_string()).unwrap();
        document.robot().unwrap()
    };
    let mut table = format!("[effects.{effect}]\n");
    for (key, value) in values {
        table += &format!("{key} = {{ value = {value:e}, low = {value:e}, high = {value:e}, source = \"test\" }}\n");
    }
    (parse(&text), parse(&(text.clone() + "\n" + &table)))
}

/// A motor of the file's kind: its numbers are drawn as their ranges say, one standard deviation to either end.
fn specimen(plain: &Robot, with: &Robot, seed: u64) -> (Robot, BTreeMap<String, f64>) {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let (mut robot, mut truth) = (with.clone(), BTreeMap::new());
    let mut drawn = |path: &str, quantity: &mut Quantity| {
        let normal: f64 = StandardNormal.sample(&mut random);
        quantity.value *= (0.5 * (quantity.high / quantity.low).ln() * normal.clamp(-2.0, 2.0)).exp();
        truth.insert(path.to_owned(), quantity.value);
    };
    drawn("motor.resistance_ohm", &mut robot.motor.resistance_ohm);
    drawn("motor.torque_constant_nm_per_a", &mut robot.motor.torque_constant_nm_per_a);
    drawn("motor.viscous_nm_s_per_rad", &mut robot.motor.viscous_nm_s_per_rad);
    // Rotor and load are told by their sum alone, so they scatter together.
    let rotor = robot.motor.rotor_inertia_kg_m2.value;
    drawn("motor.rotor_inertia_kg_m2", &mut robot.motor.rotor_inertia_kg_m2);
    let factor = robot.motor.rotor_inertia_kg_m2.value / rotor;
    robot.load.inertia_kg_m2.value = factor * plain.load.inertia_kg_m2.value;
    (robot, truth)
}

/// A share within which a value is known well, and the width of its interval then, as a share of it.
const WELL: f64 = 0.05;
const SURE: f64 = 0.6;

/// Smooth and slow, smooth and fast, levels with an open bridge between them, and others of them.
const ALL: [u32; 4] = [0, 1, 2, 3];

fn run(robot: &Robot, kind: u32) -> Recording {
    run_of(robot, kind, u64::from(kind))
}

/// The same with the noise of a seed.
fn run_of(robot: &Robot, kind: u32, seed: u64) -> Recording {
    let settings = Settings { start_angle: Some(0.3 + f64::from(kind)), ..Settings::default() };
    let mut simulated = SimulatedRobot::with(robot, 1, &settings);
    let scale = angle_scale(&robot.sensor);
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let mut out = Recording::default();
    let (mut duties, mut angles) = (Vec::new(), Vec::new());
    for k in 0..(SECONDS * 1e3) as u32 {
        let t = f64::from(k) * 1e-3;
        let level = (f64::from(k / 250 * 7 + kind) * 2.399).sin();
        let duty: f64 = match kind {
            0 => 0.35 * (1.7 * t).sin() + 0.15 * (9.0 * t).sin(),
            1 => 0.6 * (11.0 * t + 2.0 * t * t).sin() + 0.3 * (41.0 * t).sin(),
            _ => level,
        };
        let enable = kind < 2 || (k / 250) % 4 != 3;
        let sample = simulated.sample();
        out.t_s.push(t);
        out.enable.push(enable);
        // As the firmware's own number has it.
        let duty = duty as f32;
        duties.push(f64::from(duty));
        let noise: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
        angles.push(Some(scale.angle(f64::from(sample.angle.0)) + NOISE * noise));
        simulated.advance(Actuation { duty, enable });
    }
    out.drive = Drive::Duty(duties);
    out.angle = AngleReading::Angle(angles);
    out
}

fn tracks(plain: &Robot, runs: &[Recording]) -> Vec<Track> {
    runs.iter().enumerate().map(|(i, run)| Track::new(plain, run, i).unwrap()).collect()
}

/// The model of a file none of whose numbers is free.
fn held_model(plain: &Robot) -> FileModel {
    let mut model = FileModel::new(plain);
    model.free.clear();
    model
}

/// The parameters that a fit of the effect alone finds, with their intervals.
fn fitted(effect: &str, plain: &Robot, runs: &[Recording]) -> Vec<FittedParameter> {
    let model = held_model(plain);
    let tracks = tracks(plain, runs);
    values::fitted(plain, &model, &best_fit(effect, &model, &data(&tracks)))
}

fn data(tracks: &[Track]) -> Data<'_> {
    Data { tracks, sigma: NOISE, sigma_current: None }
}

/// The fit of the effect from the best of its starts.
fn best_fit(effect: &str, model: &FileModel, data: &Data) -> Fit {
    let (id, tracks) = (Id::of(effect).unwrap(), data.tracks);
    let starts: Vec<_> = tracks.iter().map(|track| guess(track, 0.02)).collect();
    let begin = |start| {
        let mut begun = Fit::begin(model, &[id], start, starts.clone());
        let _ = refine_all(&begun.plant(model), tracks, &mut begun.starts, std::slice::from_ref(&starts), 4);
        begun
    };
    let fits = (0..model.starts(&[id])).map(|start| fit(model, data, begin(start), Until::settled(25, 1e-6)));
    fits.min_by(|a, b| a.cost.total_cmp(&b.cost)).unwrap()
}

#[test]
fn starts_are_found_where_a_shaft_sticks() {
    let (plain, with) = robots("coulomb_friction", &[("torque_nm", 4e-4), ("presliding_deg", 0.5)]);
    for seed in 0..6 {
        let (robot, _) = specimen(&plain, &with, seed);
        let model = held_model(&robot);
        let tracks = tracks(&robot, &ALL.map(|kind| run(&robot, kind)));
        let plant = |model: &FileModel| Fit::begin(model, &[], 0, Vec::new()).plant(model);
        let mut starts: Vec<_> = tracks.iter().map(|track| guess(track, 0.02)).collect();
        // As in a diagnosis: the starts are first those that suit a model without friction.
        let _ = refine_all(&plant(&held_model(&plain)), &tracks, &mut starts, &[], 4);
        let plant = plant(&model);
        for (track, (_, errors)) in tracks.iter().zip(refine_all(&plant, &tracks, &mut starts, &[], 8)) {
            let left = (errors.iter().sum::<f64>() / track.readings()).sqrt();
            println!("robot {seed}: {left} rad left");
            assert!(left < 1.1 * NOISE, "robot {seed}: {left} rad left");
        }
    }
}

#[test]
fn starts_are_found_where_teeth_meet_and_part() {
    // Lightly damped, they bounce from one rollout into the next. Refined all at once, the starts leave up to five times the noise.
    let values = [
        ("gap_deg", 4.0),
        ("stiffness_nm_per_rad", 0.8),
        ("damping_ratio", 0.1),
        ("load_share", 0.35),
        ("load_drag_share", 0.3),
    ];
    let (plain, with) = robots("backlash", &values);
    let tracks = tracks(&plain, &ALL.map(|kind| run(&with, kind)));
    let plant = Fit::begin(&FileModel::new(&with), &[], 0, Vec::new()).plant(&FileModel::new(&with));
    let mut starts: Vec<_> = tracks.iter().map(|track| guess(track, 0.02)).collect();
    for (track, (_, errors)) in tracks.iter().zip(refine_all(&plant, &tracks, &mut starts, &[], 2)) {
        let left = (errors.iter().sum::<f64>() / track.readings()).sqrt();
        assert!(left < 1.3 * NOISE, "{left} rad left");
    }
}

#[test]
fn small_steps_take_the_integrators_share_out_of_a_number() {
    let (plain, with) = robots("sensor_lag", &[("time_s", 8e-3)]);
    let model = held_model(&plain);
    let tracks = tracks(&plain, &ALL.map(|kind| run(&with, kind)));
    let data = data(&tracks);
    let usual = best_fit("sensor_lag", &model, &data);
    let small = in_small_steps(&model, &data, usual.clone(), Until::settled(6, 1e-6));
    // In its own standard deviations.
    let off = |fit: &Fit| (fit.coordinates[0] - fit.free[0].coordinate(8e-3)) / fit.deviation(0);
    assert!(off(&small).abs() < 2.5, "{} instead of {}", off(&small), off(&usual));
    assert!(small.cost < usual.cost);
}

#[test]
fn a_model_that_is_wrong_keeps_its_numbers_where_the_file_has_them() {
    let (plain, with) = robots("coulomb_friction", &[("torque_nm", 4e-4), ("presliding_deg", 0.5)]);
    let model = FileModel::new(&plain);
    // Slow: resistance, torque constant and inertia can all give way together.
    let tracks = [Track::new(&plain, &run(&with, 0), 0).unwrap()];
    let starts = vec![guess(&tracks[0], 0.02)];
    for sigma in [NOISE, 1e-3 * NOISE] {
        let data = Data { tracks: &tracks, sigma, sigma_current: None };
        let found = fit(&model, &data, Fit::begin(&model, &[], 0, starts.clone()), Until::settled(25, 1e-5));
        assert!(misfit(&data, found.cost) > 10.0, "friction leaves more than noise");
        assert!(!found.strayed(), "{:?} with {sigma} rad", found.coordinates);
    }
}

#[test]
fn a_run_that_begins_at_rest_may_begin_anywhere_in_the_play() {
    let (plain, with) = robots("sensor_hysteresis", &[("gap_deg", 3.0)]);
    let plant = Fit::begin(&FileModel::new(&with), &[], 0, Vec::new()).plant(&FileModel::new(&with));
    let mut track = Track::new(&plain, &run(&plain, 1), 0).unwrap();
    track.segments.truncate(1);
    let segment = track.segments[0];
    for dragging in [-1.0, 0.0, 1.0] {
        let hidden = plant.hidden_at_start(dragging, 0.0, 1e-3, &States::default());
        let mut wipers = vec![0.0; segment.last - segment.first];
        let from = Boundary { hidden, shaft: [0.4, 0.0] };
        plant.rollout(&track, &segment, from, &mut plant.stepper(&track), &mut wipers, None);
        track.angle[..wipers.len()].copy_from_slice(&wipers);
        let mut starts = guess(&track, 0.02);
        let (_, errors) = refine(&plant, &track, &mut starts, &[], 6);
        let left = (errors[0] / wipers.len() as f64).sqrt();
        assert!(left < 1e-4, "dragged by {dragging}: {left} rad left");
    }
}

/// Puts an effect in and wants its values back, each within a share of it that is given.
fn comes_back(effect: &str, values: &[(&str, f64)], within: &[f64]) {
    comes_back_from(&ALL, effect, values, within);
}

fn comes_back_from(kinds: &[u32], effect: &str, values: &[(&str, f64)], within: &[f64]) {
    let (plain, with) = robots(effect, values);
    let runs: Vec<Recording> = kinds.iter().map(|kind| run(&with, *kind)).collect();
    assert_back(effect, values, within, &fitted(effect, &plain, &runs));
}

fn assert_back(effect: &str, values: &[(&str, f64)], within: &[f64], found: &[FittedParameter]) {
    assert_eq!(values.len(), found.len());
    for (((key, truth), one), within) in values.iter().zip(found).zip(within) {
        let FittedParameter { path, value, low, high, .. } = one;
        let found = format!("{path}: {value} ({low} … {high}), {truth} was put in");
        println!("{found}");
        assert_eq!(*path, format!("effects.{effect}.{key}"));
        assert!((value - truth).abs() <= within * truth.abs() || (low..=high).contains(&truth), "{found}");
        // An interval that is wide says nothing.
        assert!(*within > WELL || high - low <= SURE * truth.abs(), "{found}");
    }
}

#[test]
fn a_constant_torque_comes_back() {
    comes_back("bias_torque", &[("torque_nm", -1.5e-4)], &[0.01]);
}

#[test]
fn friction_that_differs_by_direction_comes_back() {
    let values = [("forward_nm", 3e-4), ("backward_nm", 1e-4), ("presliding_deg", 0.5)];
    comes_back("directional_friction", &values, &[0.02, 0.05, 0.3]);
}

#[test]
fn torque_ripple_comes_back() {
    let values = [("order_per_turn", 7.0), ("torque_nm", 2e-4), ("phase_deg", 40.0)];
    comes_back("torque_ripple", &values, &[0.0, 0.02, 0.05]);
}

#[test]
fn drag_comes_back() {
    comes_back("quadratic_drag", &[("drag_nm_s2_per_rad2", 2e-8)], &[0.01]);
    comes_back("cubic_drag", &[("drag_nm_s3_per_rad3", 1e-10)], &[0.01]);
}

#[test]
fn a_patch_of_friction_comes_back() {
    let values = [
        ("torque_nm", 3e-4),
        ("middle_deg", 80.0),
        ("half_width_deg", 35.0),
        ("edge_deg", 5.0),
        ("presliding_deg", 0.5),
    ];
    comes_back("friction_patch", &values, &[0.02, 0.02, 0.05, 0.2, 0.2]);
}

#[test]
fn a_flexible_shaft_comes_back() {
    let values = [
        ("stiffness_nm_per_rad", 4e-3),
        ("damping_ratio", 0.1),
        ("load_share", 0.35),
        ("load_drag_share", 0.3),
        ("hardening_per_rad2", 1.0),
    ];
    comes_back("shaft_compliance", &values, &[0.02, 0.05, 0.02, 0.3, 0.1]);
}

#[test]
fn backlash_comes_back() {
    // Abrupt reversals, and coasting in between. Of a load that rattles about all the time, as under a smooth drive, what no
    // sensor sees is lost from one rollout to the next, and the fit with it.
    let values = [
        ("gap_deg", 4.0),
        ("stiffness_nm_per_rad", 0.8),
        ("damping_ratio", 1.0),
        ("load_share", 0.35),
        ("load_drag_share", 0.3),
    ];
    comes_back_from(&[2, 3], "backlash", &values, &[0.02, 0.2, 0.1, 0.03, 0.3]);
}

#[test]
fn a_lag_comes_back() {
    comes_back("sensor_lag", &[("time_s", 8e-3)], &[0.02]);
}

#[test]
fn hysteresis_comes_back() {
    comes_back("sensor_hysteresis", &[("gap_deg", 2.0)], &[0.03]);
}

#[test]
fn drops_of_the_bridge_come_back() {
    comes_back("driver_drop_by_command", &[("drop_v", 0.6)], &[0.01]);
    comes_back(
        "driver_dead_time",
        &[("lost_duty", 0.06), ("shortest_duty", 0.03), ("knee_a", 5e-3)],
        &[0.01, 0.3, 0.3],
    );
}

#[test]
fn a_late_command_comes_back() {
    comes_back("command_latency", &[("latency_s", 3.6e-3)], &[0.02]);
}

#[test]
fn a_battery_that_empties_comes_back() {
    comes_back("battery_discharge", &[("fall_v_per_as", 2.0)], &[0.02]);
}

#[test]
fn warmth_comes_back() {
    comes_back("winding_heating", &[("rise_k_per_w", 150.0), ("time_s", 3.0)], &[0.05, 0.1]);
    comes_back("grease_warming", &[("thinning_per_w", 2e3), ("time_s", 3.0)], &[0.1, 0.2]);
}

#[test]
fn held_samples_come_back() {
    comes_back("held_samples", &[("held_share", 0.6)], &[0.05]);
    comes_back("held_samples", &[("held_share", 0.25)], &[0.05]);
}

#[test]
fn a_clock_that_runs_fast_comes_back() {
    comes_back("clock_drift", &[("drift_ppm", 800.0)], &[0.02]);
}

#[test]
fn a_clock_that_runs_slow_comes_back() {
    // No simulated robot reads what is to come: its stamps are shifted afterwards, the readings between its samples on
    // straight lines.
    const DRIFT_PPM: f64 = -800.0;
    let (plain, _) = robots("clock_drift", &[("drift_ppm", 0.0)]);
    let runs = ALL.map(|kind| {
        let mut run = run(&plain, kind);
        let AngleReading::Angle(read) = &run.angle else { panic!("angles were recorded") };
        let read: Vec<f64> = read.iter().map(|angle| angle.unwrap()).collect();
        let shown = |t: &f64| {
            let at = (t * (1.0 - 1e-6 * DRIFT_PPM)) * 1e3;
            let before = at.floor() as usize;
            let after = *read.get(before + 1)?;
            Some(read[before] + common::wrap(after - read[before]) * (at - at.floor()))
        };
        run.angle = AngleReading::Angle(run.t_s.iter().map(shown).collect());
        run
    });
    assert_back("clock_drift", &[("drift_ppm", DRIFT_PPM)], &[0.02], &fitted("clock_drift", &plain, &runs));
}
