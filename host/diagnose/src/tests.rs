//! The mechanics, on data made with the model itself: what was put in comes out. Whether the diagnosis finds what a
//! richer world hides is the system tests' business.

use effects::{
    BiasTorque, CoulombFriction, DriverDeadband, DriverDrop, GravityTilt, Id, Laws, LoadFriction, ShaftCompliance,
    StribeckFriction, TorqueRipple,
};
use hal_sim::shaft::{Shaft, ShaftState, Terminals};
use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use robot_file::robot::Quantity;

use super::nominal::FileModel;
use super::numbers::Number;
use super::*;
use recording::{AngleReading, Drive, Recording};

/// The bench: the robot's motor on a 5 V rail, ideal driver and sensor, no effects.
pub(super) fn bench() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-linear.toml")).unwrap()
}

/// The bench's file with its text changed.
fn edited(change: impl FnOnce(String) -> String) -> robot_file::edit::Document {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-linear.toml");
    let text = change(std::fs::read_to_string(&path).unwrap());
    robot_file::edit::Document::parse(&text, &path.display().to_string()).unwrap()
}

/// The same motor, in the robot, whose eccentric gives the load.
fn in_the_robot(text: String) -> String {
    let text = text.replace(", \"body\", \"backbone\", \"eccentric\", \"feet\", \"ground\"", "");
    text.replace("inertia_kg_m2 = { value = 2.5e-7", "inertia_kg_m2 = { value = 3.03375e-7")
}

/// What a made-up rig has beside its motor.
#[derive(Clone, Copy)]
pub(super) struct Rig {
    pub shaft: Shaft,
    pub noise: f64,
    pub sag_ohm: f64,
    pub cos1: f64,
    pub delay_samples: usize,
    /// Noise of a recorded current, A; none is recorded without it.
    pub current_noise: Option<f64>,
}

impl Rig {
    /// The bench's motor with its numbers off by 10–20 %, reading noise of 2 mrad, no effect.
    pub fn off() -> Self {
        Self {
            shaft: Shaft {
                resistance_ohm: 15.0 * 1.15,
                inductance_h: 150e-6,
                torque_constant: 0.0209 * 0.9,
                inertia_kg_m2: 1.5e-6 * 1.2,
                viscous: 8e-6,
                laws: Laws::NONE,
            },
            noise: 2e-3,
            sag_ohm: 0.0,
            cos1: 0.0,
            delay_samples: 0,
            current_noise: None,
        }
    }

    /// Six runs of 8 s at 1 kHz; the last two are to be held out.
    pub fn runs(&self, seed: u64) -> Vec<Recording> {
        (0..6).map(|i| self.run(seed * 10 + i, i as usize % 3, 8.0)).collect()
    }

    pub fn run(&self, seed: u64, kind: usize, seconds: f64) -> Recording {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let n = (seconds * 1000.0) as usize;
        let stepper = self.shaft.stepper(1e-4);
        let mut state = ShaftState { angle: random.random_range(-3.0..3.0), ..ShaftState::default() };
        let phases: Vec<f64> = (0..4).map(|_| random.random_range(0.0..TAU)).collect();
        let (mut level, mut enabled) = (0.0, true);
        let mut out = Recording::default();
        let (mut duty_column, mut angles, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        let mut bus = 0.0;
        for k in 0..n {
            let t = k as f64 * 1e-3;
            if k % 250 == 0 {
                level = random.random_range(-1.0..1.0);
                enabled = kind == 0 || random.random_range(0.0..1.0) < 0.75;
            }
            let duty: f64 = match kind {
                0 => (0..4).map(|i| 0.3 * (TAU * [0.3, 0.9, 2.1, 4.3][i] * t + phases[i]).sin()).sum(),
                1 => level,
                _ => (0.8 * (TAU * (0.2 + 0.5 * t) * t).sin()) * if level > 0.0 { 1.0 } else { 0.5 },
            };
            let duty = duty.clamp(-1.0, 1.0);
            truth.push(state.angle);
            let shown = truth[k.saturating_sub(self.delay_samples)];
            let noise: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
            angles.push(Some(shown + self.cos1 * shown.cos() + self.noise * noise));
            if let Some(noise) = self.current_noise {
                out.current_a.push(Some(state.current + noise * random.random_range(-1.7..1.7)));
            }
            duty_column.push(duty);
            out.t_s.push(t);
            out.enable.push(enabled);
            for _ in 0..10 {
                let terminals = if enabled {
                    Terminals::Driven { voltage: self.shaft.laws.duty(duty) * (5.0 - self.sag_ohm * bus) }
                } else {
                    Terminals::Open
                };
                let means = stepper.advance(&mut state, terminals);
                bus = if enabled { duty * means.current } else { 0.0 };
            }
        }
        out.drive = Drive::Duty(duty_column);
        out.angle = AngleReading::Angle(angles);
        out
    }
}

/// Four runs to fit on, two held out.
fn diagnosed(rig: &Rig, seed: u64) -> Diagnosis {
    let runs = rig.runs(seed);
    diagnose(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap()
}

fn changed(change: impl FnOnce(&mut Rig)) -> Rig {
    let mut rig = Rig::off();
    change(&mut rig);
    rig
}

pub(super) fn coulomb(torque_nm: f64) -> Laws {
    Laws { coulomb_friction: Some(CoulombFriction { torque_nm, presliding_rad: 6e-3 }), ..Laws::NONE }
}

fn assert_found(rig: &Rig, effect: &str, key: &str, truth: f64) {
    assert_found_in_class(rig, &[effect], key, truth);
}

/// The first of a class is named, and the others beside it.
fn assert_found_in_class(rig: &Rig, class: &[&str], key: &str, truth: f64) {
    let diagnosis = diagnosed(rig, 3);
    let verdict = if class.len() > 1 { Verdict::Ambiguous } else { Verdict::Explained };
    assert_eq!(diagnosis.verdict, verdict, "{:?}", diagnosis.detail.summary);
    let [cause] = diagnosis.causes.as_slice() else { panic!("{:?}", diagnosis.causes) };
    let named: Vec<&str> = std::iter::once(&cause.effect).chain(&cause.also).map(String::as_str).collect();
    assert_eq!(named, class);
    let [value, low, high] = cause.parameters[key];
    // The scale of all torques hangs on the file's inertia: what is wrong there is wrong here.
    assert!((0.6..1.5).contains(&(value / truth)), "{key}: {value}, truth {truth}");
    assert!(low < value && value < high);
    assert!(diagnosis.after < 1.05 * diagnosis.noise_floor, "{:?}", diagnosis.detail.summary);
    assert!(diagnosis.gain.percent_of_excess_removed > 95.0 && diagnosis.gain.low > 90.0);
}

/// Runs of whose readings some are missing, or repeat the one before.
fn with_some(mut runs: Vec<Recording>, share: f64, change: impl Fn(&mut [Option<f64>], usize)) -> Vec<Recording> {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(8);
    for run in &mut runs {
        let AngleReading::Angle(cells) = &mut run.angle else { unreachable!() };
        let chosen = (1..cells.len()).filter(|_| random.random_range(0.0..1.0) < share);
        chosen.collect::<Vec<_>>().into_iter().for_each(|i| change(cells, i));
    }
    runs
}

#[test]
fn runs_with_missing_readings_are_followed_as_well() {
    let rig = changed(|rig| rig.shaft.torque_constant *= 0.6);
    let runs = with_some(rig.runs(5), 0.02, |cells, i| cells[i] = None);
    let found = diagnose(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
    assert_eq!(found.verdict, Verdict::Nothing, "{:?}", found.detail.summary);
    assert!(found.before < 1.03 * found.noise_floor, "{} of {}", found.before, found.noise_floor);
}

#[test]
fn held_readings_are_named_with_their_share_beside_another_effect() {
    let share = |found: &Diagnosis| {
        let held = found.causes.iter().find(|cause| cause.effect == "held_samples").expect("held readings");
        held.parameters["held_share"]
    };
    for (rig, others) in [(Rig::off(), vec![]), (changed(|rig| rig.sag_ohm = 2.0), vec!["battery_sag"])] {
        let runs = with_some(rig.runs(6), 0.05, |cells, i| cells[i] = cells[i - 1]);
        let found = diagnose(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
        let [value, low, high] = share(&found);
        assert!(low < 0.05 && 0.05 < high && high - low < 0.02, "{value} ({low} … {high})");
        let named: Vec<&str> = found.causes.iter().map(|cause| cause.effect.as_str()).collect();
        assert_eq!(named, [others, vec!["held_samples"]].concat(), "{:?}", found.detail.summary);
        assert_eq!(found.verdict, Verdict::Explained);
        assert!(found.after < 1.05 * found.noise_floor && found.before > 3.0 * found.noise_floor, "{found:?}");
        assert!(found.detail.extended.iter().any(|one| one.path == "effects.held_samples.held_share"));
    }
}

#[test]
fn what_leaves_a_trace_in_noise_that_remembers_is_not_sought_among_all_effects_and_pairs() {
    let rig = changed(|rig| (rig.sag_ohm, rig.cos1) = (2.0, 3e-3));
    let mut runs = rig.runs(6);
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(9);
    for run in &mut runs {
        let AngleReading::Angle(cells) = &mut run.angle else { unreachable!() };
        let mut remembered = 0.0;
        for cell in cells.iter_mut().flatten() {
            // For 40 ms.
            remembered = 0.975 * remembered + 6e-4 * random.random_range(-1.7..1.7);
            *cell += remembered;
        }
    }
    let found = diagnose(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
    assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.detail.summary);
    // What leaves the trace is asked for beside it.
    let causes: Vec<&str> = found.causes.iter().map(|cause| cause.effect.as_str()).collect();
    assert_eq!(causes, ["battery_sag", "sensor_nonlinearity"]);
    assert!(found.after > 1.12 * found.noise_floor, "{} of {}", found.after, found.noise_floor);
    let alone = found.detail.candidates.iter().filter(|one| one.effects.len() == 1).count();
    assert!(alone < 12, "{alone}");
}

/// The largest share of held readings that a fit to runs may try.
fn most_held(runs: &[Recording]) -> f64 {
    let (session, _) = Session::open(&bench(), &runs[..2], &runs[2..], &Options::default()).unwrap();
    let numbers = session.model.with(&[Id::of("held_samples").unwrap()], 0);
    numbers.iter().find(|one| one.number == Number::OfEffect("held_share")).unwrap().high
}

#[test]
fn late_readings_of_which_none_repeats_are_not_held_ones() {
    let mut runs = changed(|rig| rig.delay_samples = 3).runs(11);
    runs.truncate(3);
    assert!(most_held(&runs) < 0.01, "{}", most_held(&runs));
    // One that measures every fifth time it is asked holds four of five.
    let asked = with_some(runs, 1.0, |cells, i| cells[i] = if i % 5 > 0 { cells[i - 1] } else { cells[i] });
    assert!(most_held(&asked) > 0.8, "{}", most_held(&asked));
}

#[test]
fn wrong_numbers_are_refitted_and_nothing_is_named() {
    let rig = Rig::off();
    let runs = rig.runs(1);
    let (session, nominal) = session::Session::open(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
    let number = |number: Number| nominal.value(number).unwrap();
    let near = |value: f64, truth: f64| assert!((value / truth - 1.0).abs() < 0.02, "{value}, truth {truth}");
    // What angle and drive show: K, the gain K/(RJ), and the coast's damping b/J.
    let (resistance, inertia) = (number(Number::Resistance), number(Number::Inertia));
    near(number(Number::TorqueConstant), rig.shaft.torque_constant);
    near(1e-6 / (resistance * inertia), 1e-6 / (rig.shaft.resistance_ohm * rig.shaft.inertia_kg_m2));
    near(number(Number::Viscous) / inertia, rig.shaft.viscous / rig.shaft.inertia_kg_m2);
    near(session.noise.sqrt(), rig.noise);
    let diagnosis = diagnosed(&rig, 1);
    assert_eq!((diagnosis.verdict, diagnosis.causes.len()), (Verdict::Nothing, 0));
    assert!(diagnosis.before < 1.02 * diagnosis.noise_floor);
    assert_eq!(diagnosis.left_over, None);
}

#[test]
fn coulomb_friction_is_found_and_not_called_stribeck() {
    assert_found(&changed(|rig| rig.shaft.laws = coulomb(1e-4)), "coulomb_friction", "torque_nm", 1e-4);
}

#[test]
fn stribeck_friction_is_found() {
    let law =
        StribeckFriction { torque_nm: 1e-4, breakaway_excess_nm: 2e-4, speed_rad_per_s: 4.0, presliding_rad: 6e-3 };
    let rig = changed(|rig| rig.shaft.laws.stribeck_friction = Some(law));
    assert_found(&rig, "stribeck_friction", "breakaway_excess_nm", 2e-4);
}

#[test]
fn load_friction_is_found() {
    let law = LoadFriction { coefficient: 0.15, presliding_rad: 6e-3 };
    assert_found(&changed(|rig| rig.shaft.laws.load_friction = Some(law)), "load_friction", "coefficient", 0.15);
}

#[test]
fn gravity_is_found() {
    let law = GravityTilt { torque_nm: 1e-4, direction_rad: 1.0 };
    assert_found(&changed(|rig| rig.shaft.laws.gravity_tilt = Some(law)), "gravity_tilt", "direction_deg", 57.3);
}

/// A curve's value at a place on its coordinate.
fn at(term: &MissingTerm, place: f64) -> TermPoint {
    let off = |point: &&TermPoint| (point.at - place).abs();
    *term.points.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
}

#[test]
fn a_torque_over_the_angle_is_drawn_as_it_is() {
    let law = GravityTilt { torque_nm: 1e-4, direction_rad: 1.0 };
    let diagnosis = diagnosed(&changed(|rig| rig.shaft.laws.gravity_tilt = Some(law)), 3);
    let term = &diagnosis.missing_terms[0];
    assert_eq!((term.coordinate.as_str(), term.kind), ("angle_rad", TermKind::TorqueNm));
    assert!(term.promised > 0.9 && term.chance < 0.005);
    for point in &term.points {
        let truth = -1e-4 * (point.at - 1.0).sin();
        assert!((point.value - truth).abs() < 3e-5, "{} at {}, truth {truth}", point.value, point.at);
        assert!(point.low < point.value && point.high - point.low < 3e-5, "{point:?}");
    }
}

#[test]
fn a_friction_is_a_step_of_the_curve_over_the_speed() {
    let diagnosis = diagnosed(&changed(|rig| rig.shaft.laws = coulomb(2e-4)), 3);
    let term = diagnosis.missing_terms.iter().find(|term| term.coordinate == "speed_rad_per_s").unwrap();
    // What grows with the speed may be the fit's own numbers'; between slow motions either way there is little of that.
    let step = at(term, 15.0).value - at(term, -15.0).value;
    assert!((0.6..1.4).contains(&(step / -4e-4)), "{step}");
}

#[test]
fn what_is_in_volts_is_known_whatever_the_scale_of_torques() {
    let rig = changed(|rig| rig.shaft.laws = coulomb(2e-4));
    let diagnosis = diagnosed(&rig, 3);
    let Shaft { resistance_ohm, torque_constant, inertia_kg_m2, viscous, .. } = rig.shaft;
    let per_torque = resistance_ohm / torque_constant;
    let back_emf = torque_constant + viscous * per_torque;
    let truths = [
        ("motor.back_emf_v_s_per_rad", back_emf),
        ("motor.inertia_v_s2_per_rad", inertia_kg_m2 * per_torque),
        ("motor.time_constant_s", inertia_kg_m2 * per_torque / back_emf),
        ("coulomb_friction.torque_v", 2e-4 * per_torque),
    ];
    for (key, truth) in truths {
        let [value, low, high] = diagnosis.scale_free[key];
        assert!((value / truth - 1.0).abs() < 0.02, "{key}: {value}, truth {truth}");
        // Three standard deviations.
        assert!(
            (value - truth).abs() < 1.5 * (high - value) && high - low < 0.05 * truth,
            "{key}: {low} … {high}, truth {truth}"
        );
    }
    // The torque itself is not known nearly as well.
    let [value, low, high] = diagnosis.causes[0].parameters["torque_nm"];
    assert!(high - low > 0.1 * value, "{low} … {high}");
}

#[test]
fn an_unknown_scale_of_torques_hides_no_effect() {
    let mut robot = bench();
    for quantity in
        [&mut robot.motor.resistance_ohm, &mut robot.motor.rotor_inertia_kg_m2, &mut robot.load.inertia_kg_m2]
    {
        (quantity.low, quantity.high) = (quantity.value / 4.0, quantity.value * 4.0);
    }
    let runs = changed(|rig| rig.shaft.laws = coulomb(2e-4)).runs(4);
    let diagnosis = diagnose(&robot, &runs[..4], &runs[4..], &Options::default()).unwrap();
    let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    assert_eq!((diagnosis.verdict, names), (Verdict::Explained, vec!["coulomb_friction"]));
    // By a factor of four either way the file does not know the scale: the interval is one of ratios.
    let [value, low, high] = diagnosis.causes[0].parameters["torque_nm"];
    assert!(low > 0.0 && high > 1.1 * value && low < 2e-4 && high > 2e-4, "{value}: {low} … {high}");
}

#[test]
fn a_size_that_only_its_shape_leaves_open_is_a_size() {
    let (model, patch) = (FileModel::new(&bench()), Id::of("friction_patch").unwrap());
    let mut fit = Fit::begin(&model, &[patch], 0, Vec::new());
    let places = model.numbers_of(patch, &fit);
    let (height, width) = (places[0], places[2]);
    assert!(fit.free[height].is_size() && !fit.free[width].is_size());
    // Twice its deviation is less than 95 % from zero where the width is open.
    fit.coordinates[height] = 1.0;
    fit.covariance = DMatrix::identity(fit.free.len(), fit.free.len()) * 1e-6;
    fit.covariance[(height, height)] = 1.0;
    fit.covariance[(width, width)] = 1.0;
    assert!(!fit.has_size(&model, patch) && !fit.has_size_in_its_shape(&model, patch));
    // A higher and narrower patch does as well: of a known width the height is known to a seventh.
    fit.covariance[(height, width)] = -0.99;
    fit.covariance[(width, height)] = -0.99;
    assert!(!fit.has_size(&model, patch) && fit.has_size_in_its_shape(&model, patch));
    let found = values::fitted(&bench(), &model, &fit);
    let height = found.iter().find(|one| one.path == "effects.friction_patch.torque_nm").unwrap();
    assert!(height.low > 0.0 && height.low < 0.5 * height.value && height.high > 2.0 * height.value, "{height:?}");
}

#[test]
fn what_the_file_has_already_is_no_size_of_what_contains_it() {
    let coulomb = "[effects.coulomb_friction]\n\
         torque_nm = { value = 1e-4, low = 1e-4, high = 1e-4, source = \"test\" }\n\
         presliding_deg = { value = 0.2, low = 0.2, high = 0.2, source = \"test\" }\n";
    let model = FileModel::new(&edited(|text| text + coulomb).robot().unwrap());
    for (name, own) in [("stribeck_friction", "breakaway_excess"), ("directional_friction", "friction_lean")] {
        let id = Id::of(name).unwrap();
        let mut fit = Fit::begin(&model, &[id], 0, Vec::new());
        fit.covariance = DMatrix::identity(fit.free.len(), fit.free.len()) * 1e-6;
        let own = fit.free.iter().position(|one| one.number == Number::OfEffect(own)).unwrap();
        fit.coordinates[own] = 0.0;
        assert!(!fit.has_size(&model, id) && !fit.has_size_in_its_shape(&model, id), "{name}");
        fit.coordinates[own] = 1.0;
        assert!(fit.has_size(&model, id), "{name}");
    }
}

#[test]
fn a_spring_is_there_whatever_is_known_of_the_drag_on_its_load() {
    let (model, spring) = (FileModel::new(&bench()), Id::of("shaft_compliance").unwrap());
    let mut fit = Fit::begin(&model, &[spring], 0, Vec::new());
    fit.covariance = DMatrix::identity(fit.free.len(), fit.free.len()) * 1e-6;
    let drag = fit.free.iter().position(|one| one.number == Number::OfEffect("load_drag_share")).unwrap();
    fit.covariance[(drag, drag)] = 100.0;
    assert!(fit.has_size(&model, spring));
    // One that may be as stiff as any is none.
    let stiffness = fit.free.iter().position(|one| one.number == Number::OfEffect("stiffness")).unwrap();
    fit.covariance[(stiffness, stiffness)] = 100.0;
    assert!(!fit.has_size(&model, spring));
}

#[test]
fn where_nothing_is_missing_no_curve_is_drawn() {
    assert_eq!(diagnosed(&Rig::off(), 3).missing_terms, []);
}

#[test]
fn driver_drop_is_found_and_its_slope_is_a_resistance() {
    let law = DriverDrop { drop_v: 0.15, knee_a: 0.0, slope_ohm: 1.0 };
    assert_found(&changed(|rig| rig.shaft.laws.driver_drop = Some(law)), "driver_drop", "drop_v", 0.15);
}

#[test]
fn a_deadband_is_found() {
    let law = DriverDeadband { width_duty: 0.06 };
    let rig = changed(|rig| rig.shaft.laws.driver_deadband = Some(law));
    // At one supply, a share of the duty and a voltage are the same.
    assert_found_in_class(&rig, &["driver_drop_by_command", "driver_deadband"], "drop_v", 0.06 * 5.0);
}

#[test]
fn battery_sag_is_found() {
    assert_found(&changed(|rig| rig.sag_ohm = 1.5), "battery_sag", "resistance_ohm", 1.5);
}

#[test]
fn sensor_nonlinearity_is_found() {
    assert_found(&changed(|rig| rig.cos1 = 0.02), "sensor_nonlinearity", "cos1_deg", 0.02f64.to_degrees());
}

#[test]
fn sensor_delay_is_found() {
    // Nothing but the command and the angle was recorded: which of them is late, nobody can say.
    let rig = changed(|rig| rig.delay_samples = 2);
    assert_found_in_class(&rig, &["command_latency", "sensor_delay"], "latency_s", 2e-3);
}

#[test]
fn where_the_reading_is_late_a_measured_current_is_not() {
    let rig = changed(|rig| {
        rig.delay_samples = 2;
        rig.current_noise = Some(2e-3);
    });
    assert_found_in_class(&rig, &["sensor_delay", "command_latency"], "delay_s", 2e-3);
}

#[test]
fn a_pair_is_found_together() {
    let rig = changed(|rig| {
        rig.shaft.laws = coulomb(1.5e-4);
        rig.cos1 = 0.02;
    });
    let diagnosis = diagnosed(&rig, 5);
    let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    assert_eq!((diagnosis.verdict, names), (Verdict::Explained, vec!["coulomb_friction", "sensor_nonlinearity"]));
    // No model is tried twice: it would be its own rival.
    let mut tried: Vec<&Vec<String>> = diagnosis.detail.candidates.iter().map(|one| &one.effects).collect();
    let all = tried.len();
    tried.sort();
    tried.dedup();
    assert_eq!(tried.len(), all);
}

#[test]
fn what_a_friction_leaves_for_want_of_a_second_effect_does_not_speak_against_it() {
    // Coulomb friction alone reaches the floor, and what it leaves follows the angle.
    let rig = changed(|rig| {
        rig.shaft.laws = coulomb(1e-4);
        rig.cos1 = 1.2e-3;
    });
    let runs: Vec<Recording> = (0..6).map(|i| rig.run(30 + i, i as usize % 3, 4.0)).collect();
    let diagnosis = diagnose(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
    let named: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    assert_eq!(named, ["coulomb_friction", "sensor_nonlinearity"], "{:?}", diagnosis.detail.summary);
}

#[test]
fn the_json_has_the_keys_of_the_format_and_no_more() {
    let diagnosis = diagnosed(&changed(|rig| rig.cos1 = 0.02), 2);
    let json = serde_json::to_value(&diagnosis).unwrap();
    let keys: Vec<&str> = json.as_object().unwrap().keys().map(String::as_str).collect();
    let mut wanted = [
        "verdict",
        "causes",
        "models",
        "limits",
        "noise_floor",
        "before",
        "after",
        "after_cross_judged",
        "gain",
        "left_over",
        "missing_terms",
        "scale_free",
        "next_experiment",
    ]
    .to_vec();
    wanted.sort_unstable();
    let mut keys = keys;
    keys.sort_unstable();
    assert_eq!(keys, wanted);
    assert_eq!(json["verdict"], "explained");
    assert_eq!(json["causes"][0]["parameters"]["cos1_deg"].as_array().unwrap().len(), 3);
    let back: Diagnosis = serde_json::from_value(json).unwrap();
    assert_eq!(Diagnosis { detail: Detail::default(), ..diagnosis }, back);
}

#[test]
fn threads_do_not_change_the_outcome() {
    let runs = changed(|rig| rig.cos1 = 0.02).runs(7);
    let with = |threads| {
        let options = Options { threads, ..Options::default() };
        diagnose(&bench(), &runs[..4], &runs[4..], &options).unwrap()
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn the_extended_file_has_the_cause_and_simulates() {
    let diagnosis = diagnosed(&changed(|rig| rig.shaft.laws = coulomb(1e-4)), 3);
    let mut document = edited(|text| text);
    extend(&mut document, &diagnosis.detail.extended, "test").unwrap();
    let robot = document.robot().unwrap();
    let quantity = |key| robot.effects.quantity("coulomb_friction", key).unwrap();
    assert_eq!(quantity("torque_nm").value.to_bits(), {
        let [value, ..] = diagnosis.causes[0].parameters["torque_nm"];
        format!("{value:.8e}").parse::<f64>().unwrap().to_bits()
    });
    assert!(quantity("presliding_deg").low < quantity("presliding_deg").value);
    // What was extended has nothing left to explain.
    let runs = changed(|rig| rig.shaft.laws = coulomb(1e-4)).runs(4);
    let again = diagnose(&document.robot().unwrap(), &runs[..4], &runs[4..], &Options::default()).unwrap();
    assert_eq!(again.verdict, Verdict::Nothing, "{:?}", again.detail.summary);
}

#[test]
fn a_robots_load_stays_its_eccentrics() {
    let mut document = edited(in_the_robot);
    let robot = document.robot().unwrap();
    assert!(robot.eccentric.is_some());
    let (rig, runs) = (Rig::off(), Rig::off().runs(5));
    let diagnosis = diagnose(&robot, &runs[..4], &runs[4..], &Options::default()).unwrap();
    extend(&mut document, &diagnosis.detail.extended, "test").unwrap();
    let extended = document.robot().unwrap();
    assert_eq!(extended.load, robot.load);
    let rotor = extended.motor.rotor_inertia_kg_m2;
    // What angle and drive show is R J.
    let product = extended.motor.resistance_ohm.value * (rotor.value + extended.load.inertia_kg_m2.value);
    let truth = rig.shaft.resistance_ohm * rig.shaft.inertia_kg_m2;
    assert!((product / truth - 1.0).abs() < 0.02, "{product}, truth {truth}");
    assert!(rotor.low < rotor.value && rotor.value < rotor.high, "{rotor:?}");
}

#[test]
fn a_rotor_never_gets_less_than_nothing() {
    // The load alone, which the eccentric gives, is heavier than everything that turns on the rig.
    let mut document = edited(in_the_robot);
    let quantity = |value: f64| Quantity { value, low: 0.5 * value, high: 2.0 * value, source: "test".to_owned() };
    document.set("motor.rotor_inertia_kg_m2", &quantity(3e-7)).unwrap();
    let robot = document.robot().unwrap();
    let runs = changed(|rig| rig.shaft.inertia_kg_m2 = 1.5e-7).runs(5);
    let diagnosis = diagnose(&robot, &runs[..4], &runs[4..], &Options::default()).unwrap();
    extend(&mut document, &diagnosis.detail.extended, "test").unwrap();
    assert!(document.robot().unwrap().motor.rotor_inertia_kg_m2.value > 0.0);
}

#[test]
fn numbers_of_the_file_beyond_the_catalogues_bounds_stay() {
    // The catalogue's own fits stop at 60 ms.
    let delay = "[effects.sensor_delay]\ndelay_s = { value = 0.08, low = 0.07, high = 0.09, source = \"test\" }\n";
    let robot = edited(|text| text + delay).robot().unwrap();
    let runs = changed(|rig| rig.delay_samples = 80).runs(3);
    let (_, nominal) = session::Session::open(&robot, &runs[..4], &runs[4..], &Options::default()).unwrap();
    let delay = nominal.value(Number::OfEffect("delay_s")).unwrap();
    assert!((delay - 0.08).abs() < 1e-3, "{delay}");
}

#[test]
fn an_angle_that_was_recorded_has_no_blind_arc() {
    // A robot with a potentiometer, whose shaft something else has measured.
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
    let runs = Rig::off().runs(3);
    let (session, _) = session::Session::open(&robot, &runs[..4], &runs[4..], &Options::default()).unwrap();
    let all = session.fit.iter().chain(&session.held_out);
    assert!(all.into_iter().all(|track| track.dropped == 0 && track.weight.iter().all(|weight| *weight > 0.0)));
}

#[test]
fn a_deadband_acts_on_the_duty_whatever_supply_was_measured() {
    let law = DriverDeadband { width_duty: 0.06 };
    let mut runs = changed(|rig| rig.shaft.laws.driver_deadband = Some(law)).runs(3);
    // The measured supply is half of the file's.
    for run in &mut runs {
        run.supply_v = vec![5.0; run.t_s.len()];
    }
    let mut robot = bench();
    robot.supply.rail_v.value = 10.0;
    let diagnosis = diagnose(&robot, &runs[..4], &runs[4..], &Options::default()).unwrap();
    // At one supply a drop in volts does the same: it is among the others then.
    let others = diagnosis.detail.rivals.iter().flatten();
    let width =
        diagnosis.detail.extended.iter().chain(others).find(|one| one.path.ends_with("width_duty")).unwrap().value;
    assert!((width / 0.06 - 1.0).abs() < 0.1, "{width}");
    let torque_constant =
        diagnosis.detail.extended.iter().find(|one| one.path.contains("torque_constant")).unwrap().value;
    assert!((torque_constant / Rig::off().shaft.torque_constant - 1.0).abs() < 0.02, "{torque_constant}");
}

#[test]
fn unusable_recordings_are_refused_by_name() {
    let runs = Rig::off().runs(1);
    let robot = bench();
    let refused = |change: &dyn Fn(&mut Recording)| {
        let mut fit = runs[..4].to_vec();
        fit[1].path = "bad.csv".into();
        change(&mut fit[1]);
        diagnose(&robot, &fit, &runs[4..], &Options::default()).unwrap_err().to_string()
    };
    let angles = |change: fn(f64) -> f64| {
        move |run: &mut Recording| {
            let AngleReading::Angle(cells) = &mut run.angle else { panic!("the rig reads angles") };
            cells.iter_mut().for_each(|cell| *cell = cell.map(change));
        }
    };
    assert!(
        refused(&|run| *run = Recording { path: "bad.csv".into(), ..Recording::default() }).starts_with("bad: only 0")
    );
    assert!(refused(&|run| run.t_s[100] = run.t_s[99]).contains("does not increase at sample 100"));
    assert!(refused(&|run| run.t_s[100] = f64::NAN).contains("sample 100"));
    assert!(refused(&angles(f64::to_degrees)).contains("rad/s"), "degrees");
    assert!(refused(&angles(|_| f64::NAN)).contains("not finite"));
    assert!(refused(&|run| run.enable.truncate(7)).contains("unequal"));
    assert!(
        refused(&|run| run.angle = AngleReading::Angle(vec![None; run.t_s.len()])).contains("only 0 angle readings")
    );
    assert!(refused(&|run| run.drive = Drive::Duty(vec![5.0; run.t_s.len()])).contains("duty beyond"));
    assert_eq!(diagnose(&robot, &[], &runs, &Options::default()), Err(DiagnoseError::NothingToFit));
    assert_eq!(diagnose(&robot, &runs, &[], &Options::default()), Err(DiagnoseError::NothingHeldOut));
}

#[test]
fn a_reversed_motor_is_another_rig() {
    let mut runs = Rig::off().runs(1);
    for run in &mut runs {
        let Drive::Duty(duty) = &mut run.drive else { panic!("the rig is driven by duty") };
        duty.iter_mut().for_each(|duty| *duty = -*duty);
    }
    let error = diagnose(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap_err();
    let DiagnoseError::WrongRig { detail, mend, .. } = &error else { panic!("{error}") };
    assert!(detail.contains("turns against its drive"), "the reason: {detail}");
    assert!(mend.contains("--map angle=-COLUMN:UNIT"), "the mend: {mend}");
}

#[test]
fn other_columns_and_rates_work() {
    let rig = Rig::off();
    let sparse: Vec<Recording> = rig
        .runs(8)
        .into_iter()
        .map(|run| {
            // 1 kHz down to some 200 Hz, unevenly, with the duty as measured supply and a voltage.
            let keep: Vec<usize> = (0..run.t_s.len()).filter(|i| i % 5 == 0 || i % 35 == 3).collect();
            let Drive::Duty(duty) = &run.drive else { panic!() };
            let AngleReading::Angle(angle) = &run.angle else { panic!() };
            // The mean over each longer step, so that the drive is what the motor got.
            let held = |place: usize| {
                let end = keep.get(place + 1).copied().unwrap_or(run.t_s.len());
                duty[keep[place]..end].iter().sum::<f64>() / (end - keep[place]) as f64
            };
            Recording {
                t_s: keep.iter().map(|&i| run.t_s[i]).collect(),
                enable: keep.iter().map(|&i| run.enable[i]).collect(),
                drive: Drive::Voltage((0..keep.len()).map(|place| 5.0 * held(place)).collect()),
                angle: AngleReading::Angle(keep.iter().map(|&i| angle[i].map(common::wrap)).collect()),
                ..Recording::default()
            }
        })
        .collect();
    let diagnosis = diagnose(&bench(), &sparse[..4], &sparse[4..], &Options::default()).unwrap();
    assert!(diagnosis.detail.candidates.iter().all(|one| !one.effects.contains(&"battery_sag".to_owned())));
    assert!(diagnosis.before < 1.3 * diagnosis.noise_floor, "{:?}", diagnosis.detail.summary);
}

fn asked(effect: &str) -> Options {
    Options { also_try: vec![Id::of(effect).unwrap()], ..Options::default() }
}

#[test]
fn a_constant_torque_is_found() {
    let law = BiasTorque { torque_nm: 1e-4 };
    assert_found(&changed(|rig| rig.shaft.laws.bias_torque = Some(law)), "bias_torque", "torque_nm", 1e-4);
}

#[test]
fn torque_ripple_of_any_order_is_found() {
    let law = TorqueRipple { order: 7.0, torque_nm: 2e-4, phase_rad: 0.7 };
    assert_found(&changed(|rig| rig.shaft.laws.torque_ripple = Some(law)), "torque_ripple", "torque_nm", 2e-4);
}

#[test]
fn a_flexible_shaft_is_found() {
    let law = ShaftCompliance {
        stiffness_nm_per_rad: 4e-3,
        damping_ratio: 0.1,
        load_share: 0.35,
        load_drag_share: 0.4,
        hardening_per_rad2: 0.0,
    };
    assert_found(&changed(|rig| rig.shaft.laws.shaft_compliance = Some(law)), "shaft_compliance", "load_share", 0.35);
}

#[test]
fn what_cannot_be_tried_is_refused() {
    let runs = Rig::off().runs(3);
    let refused =
        |robot: &Robot, runs: &[Recording], effect: &str| match diagnose(robot, &runs[..4], &runs[4..], &asked(effect))
        {
            Err(DiagnoseError::CannotTry { effect: named, why }) => {
                assert_eq!(named, effect);
                why
            }
            other => panic!("{other:?}"),
        };
    assert!(refused(&bench(), &runs, "foot_stribeck").contains("no recording"));
    let bias = "[effects.bias_torque]\ntorque_nm = { value = 0.0, low = -1e-5, high = 1e-5, source = \"test\" }\n";
    let robot = edited(|text| text + bias).robot().unwrap();
    assert!(refused(&robot, &runs, "bias_torque").contains("has it already"));
    let measured: Vec<Recording> = runs
        .iter()
        .map(|run| {
            let Drive::Duty(duty) = &run.drive else { panic!("duties were recorded") };
            Recording { drive: Drive::Voltage(duty.iter().map(|duty| 5.0 * duty).collect()), ..run.clone() }
        })
        .collect();
    assert!(refused(&bench(), &measured, "driver_dead_time").contains("measured"));
}

#[test]
fn a_file_with_another_supply_is_doubted_although_its_numbers_can_be_refitted() {
    let runs = Rig::off().runs(5);
    let said = |robot: &Robot| diagnose(robot, &runs[..4], &runs[4..], &Options::default()).unwrap();
    assert_eq!(said(&bench()).rig_doubts, []);
    let file = edited(|text| {
        text.replace(
            "rail_v = { value = 5.0, low = 5.0, high = 5.0",
            "rail_v = { value = 24.0, low = 24.0, high = 24.0",
        )
    });
    let doubted = said(&file.robot().unwrap());
    assert!(doubted.causes.is_empty(), "{:?}", doubted.causes);
    assert!(doubted.rig_doubts[0].mend.contains("supply.rail_v"), "{:?}", doubted.rig_doubts);
}

#[test]
fn readings_too_far_apart_to_follow_the_shaft_are_refused_with_the_mend() {
    let runs: Vec<Recording> = Rig::off()
        .runs(5)
        .into_iter()
        .map(|run| Recording { t_s: run.t_s.iter().map(|t| 1e3 * t).collect(), ..run })
        .collect();
    match diagnose(&bench(), &runs[..4], &runs[4..], &Options::default()) {
        Err(DiagnoseError::Recording { problem, help, .. }) => {
            assert!(problem.contains("apart") && help.contains("time=COLUMN:ms"), "{problem}; {help}");
        }
        other => panic!("{other:?}"),
    }
}
