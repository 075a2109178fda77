//! Every effect that a fit moves, put into the simulated robot and fitted with nothing else free: its values come back.
//! That a diagnosis finds it among others is another matter.

use std::path::Path;

use control::Actuation;
use effects::Id;
use hal_sim::{Settings, SimulatedRobot};
use recording::{AngleReading, Drive, Recording};
use robot_file::Robot;
use robot_file::angle_code::angle_scale;

use super::super::fit::{Data, Fit, fit};
use super::super::rollout::{guess, refine_all};
use super::super::track::Track;
use super::FileModel;

const SECONDS: f64 = 6.0;
/// Standard deviation that the fit takes the readings to have, rad.
const SIGMA: f64 = 1e-4;

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

/// Smooth and slow, smooth and fast, levels with an open bridge between them, and others of them.
const ALL: [u32; 4] = [0, 1, 2, 3];

fn run(robot: &Robot, kind: u32) -> Recording {
    let settings = Settings { start_angle: Some(0.3 + f64::from(kind)), ..Settings::default() };
    let mut simulated = SimulatedRobot::with(robot, 1, &settings);
    let scale = angle_scale(&robot.sensor);
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
        angles.push(Some(scale.angle(f64::from(sample.angle.0))));
        simulated.advance(Actuation { duty, enable });
    }
    out.drive = Drive::Duty(duties);
    out.angle = AngleReading::Angle(angles);
    out
}

/// The values that a fit of the effect alone finds, by key, from the best of its starts.
fn fitted(effect: &str, plain: &Robot, with: &Robot, kinds: &[u32]) -> Vec<(&'static str, f64)> {
    let id = Id::of(effect).unwrap();
    let mut model = FileModel::new(plain);
    model.free.clear();
    let tracks: Vec<Track> =
        kinds.iter().enumerate().map(|(i, kind)| Track::new(plain, &run(with, *kind), i).unwrap()).collect();
    let data = Data { tracks: &tracks, sigma: SIGMA, sigma_current: None };
    let starts: Vec<_> = tracks.iter().map(|track| guess(track, 0.02)).collect();
    let begin = |start| {
        let mut begun = Fit::begin(&model, &[id], start, starts.clone());
        let _ = refine_all(&begun.plant(&model), &tracks, &mut begun.starts, std::slice::from_ref(&starts), 4);
        begun
    };
    let fits = (0..model.starts(&[id])).map(|start| fit(&model, &data, begin(start), 25, 1e-6));
    let found = fits.min_by(|a, b| a.cost.total_cmp(&b.cost)).unwrap();
    let values = model.values(&[id], |number| found.value(number));
    id.spec().parameters.iter().zip(&values[&id]).map(|(key, value)| (key.key, key.from_si(*value))).collect()
}

/// Puts an effect in and wants its values back within a share of them.
fn comes_back(effect: &str, values: &[(&str, f64)], within: &[f64]) {
    comes_back_from(&ALL, effect, values, within);
}

fn comes_back_from(kinds: &[u32], effect: &str, values: &[(&str, f64)], within: &[f64]) {
    let (plain, with) = robots(effect, values);
    let found = fitted(effect, &plain, &with, kinds);
    println!("{effect}: {found:?}");
    assert_eq!(values.len(), found.len());
    for (((key, truth), (found_key, value)), within) in values.iter().zip(&found).zip(within) {
        assert_eq!(key, found_key);
        assert!(
            (value - truth).abs() <= within * truth.abs(),
            "{effect}.{key}: {value}, {truth} was put in: {found:?}"
        );
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
    comes_back("friction_patch", &values, &[0.1, 0.05, 0.1, 1.0, 1.0]);
}

#[test]
fn a_flexible_shaft_comes_back() {
    let values = [("stiffness_nm_per_rad", 4e-3), ("damping_ratio", 0.1), ("load_share", 0.35)];
    comes_back("shaft_compliance", &values, &[0.03, 0.1, 0.03]);
}

#[test]
fn backlash_comes_back() {
    // A slow run shows the play and not what lies behind it. Where the load is thrown from tooth to tooth, what no sensor
    // sees is lost from one rollout to the next.
    let values = [("gap_deg", 4.0), ("stiffness_nm_per_rad", 0.8), ("damping_ratio", 1.0), ("load_share", 0.35)];
    comes_back_from(&[0], "backlash", &values, &[0.1, 5.0, 5.0, 5.0]);
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
    comes_back("driver_dead_time", &[("lost_duty", 0.06)], &[0.01]);
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
