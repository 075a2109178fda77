//! The correction against the truth of the simulated robot, and refusals.

use std::f64::consts::TAU;
use std::path::Path;

use control::Actuation;
use hal_sim::{Settings, SimulatedRobot};
use robot_file::angle_code::{AdcCurve, corrected_angle};
use robot_file::robot::{self, InGap, Quantity, Robot, Sensor};

use super::{GapBehaviour, PotentiometerError, ZeroSource, potentiometer, second_potentiometer};
use common::wrap;
use recording::{AngleReading, Drive, Recording};

fn within(value: f64, low: f64, high: f64) -> Quantity {
    Quantity { value, low, high, source: "test".into() }
}

fn exactly(value: f64) -> Quantity {
    within(value, value, value)
}

/// The default robot.
fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap()
}

struct Run {
    recording: Recording,
    /// Raw code, true shaft angle.
    truth: Vec<(u16, f64)>,
}

fn run(robot: &Robot, seed: u64, duty: f32, seconds: f64, in_gap: Option<InGap>) -> Run {
    let settings = Settings { in_gap, linearity_peak: Some(3.0_f64.to_radians()), ..Settings::default() };
    let mut simulated = SimulatedRobot::with(robot, seed, &settings);
    let mut recording = Recording::default();
    let (mut codes, mut duties, mut truth) = (Vec::new(), Vec::new(), Vec::new());
    let mut second_codes = Vec::new();
    for _ in 0..(seconds * 1000.0) as usize {
        let sample = simulated.sample();
        let now = simulated.truth();
        recording.t_s.push(sample.time_us as f64 * 1e-6);
        codes.push(Some(sample.angle.0));
        second_codes.extend(sample.second.map(|code| Some(code.0)));
        duties.push(f64::from(duty));
        truth.push((sample.angle.0, now.angle));
        simulated.advance(Actuation { duty, enable: true });
    }
    recording.enable = vec![true; codes.len()];
    recording.angle = AngleReading::Adc(codes);
    recording.adc_second = second_codes;
    recording.drive = Drive::Duty(duties);
    Run { recording, truth }
}

/// Mean, RMS about the mean and peak (degrees) of the corrected reading against the truth outside the arc: the same robot
/// again, without noise, spikes and jitter, so that what is seen is the correction's error alone.
fn left_over(robot: &Robot, correction: &robot::Correction, seed: u64, duty: f32) -> (f64, f64, f64) {
    let mut quiet = robot.clone();
    let Sensor::Potentiometer(sensor) = &mut quiet.sensor else { panic!("no potentiometer") };
    let adc = &mut sensor.adc;
    (adc.noise_lsb, adc.spike_share, adc.jitter_s) = (exactly(0.0), exactly(0.0), exactly(0.0));
    let play = 0.5 * sensor.hysteresis_deg.value * f64::from(duty.signum());
    let converter = AdcCurve::new(&sensor.adc);
    let truth = run(&quiet, seed, duty, 2.5, None).truth;
    let errors: Vec<f64> = truth[500..]
        .iter()
        .map(|&(code, angle)| (code, angle, wrap(angle).to_degrees()))
        .filter(|&(_, _, angle)| angle < correction.blind_from_deg || angle > correction.blind_to_deg)
        // The wiper lags by half of its play; a correction made turning one way cannot know.
        .map(|(code, angle, _)| {
            wrap(corrected_angle(correction, &converter, f64::from(code)) - angle).to_degrees() + play
        })
        .collect();
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let rms = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
    (mean, rms, errors.iter().map(|e| (e - mean).abs()).fold(0.0, f64::max))
}

#[test]
fn one_run_leaves_a_tenth_of_a_degree_of_three() {
    let robot = robot();
    let (mut squares, mut zeros, mut within, mut worst) = (0.0, 0.0, 0, 0.0_f64);
    let (mut before, mut peaks, mut said, mut zeros_said) = (0.0, 0.0_f64, 0.0, 0.0);
    let seeds = 100;
    for seed in 0..seeds {
        let duty = if seed % 2 == 0 { 1.0 } else { -1.0 };
        let run = run(&robot, seed, duty, 2.5, None);
        let fit = potentiometer(&robot, &run.recording).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let (mean, rms, peak) = left_over(&robot, &fit.correction, seed, duty);
        assert!(matches!(fit.zero_source, ZeroSource::Gap(_)), "seed {seed}: {:?}", fit.zero_source);
        squares += rms * rms;
        said += fit.after_rms_deg.powi(2);
        zeros_said += fit.zero_uncertainty_deg.powi(2);
        zeros += mean * mean;
        before += fit.before_rms_deg.powi(2);
        within += usize::from(rms <= 0.1);
        worst = worst.max(rms);
        peaks = peaks.max(peak);
    }
    let pooled = |sum: f64| (sum / seeds as f64).sqrt();
    println!(
        "before {:.2}° RMS; left {:.3}° RMS (fits say {:.3}), {within} of {seeds} runs within 0.1°, worst {worst:.3}°, \
         peak {peaks:.2}°; zero {:.3}° RMS (fits say {:.3})",
        pooled(before),
        pooled(squares),
        pooled(said),
        pooled(zeros),
        pooled(zeros_said)
    );
    assert!(pooled(squares) <= 0.1 && within >= 75 && worst < 0.25, "too much is left");
    assert!(pooled(zeros) <= 0.2, "zero is off by {:.2}° RMS", pooled(zeros));
    let honest = pooled(said) / pooled(squares);
    assert!((0.7..1.5).contains(&honest), "the fits say {honest:.2} times what is left");
    let honest = pooled(zeros_said) / pooled(zeros);
    assert!((0.7..1.5).contains(&honest), "the fits say {honest:.2} times how far the zero is off");
}

#[test]
fn each_behaviour_of_the_gap_gives_the_zero() {
    let robot = robot();
    for (in_gap, ccw) in
        [(InGap::Hold, GapBehaviour::Hold), (InGap::Random, GapBehaviour::Random), (InGap::Zero, GapBehaviour::Zero)]
    {
        for duty in [1.0, -1.0] {
            let run = run(&robot, 11, duty, 2.5, Some(in_gap));
            let fit = potentiometer(&robot, &run.recording).unwrap();
            let (zero, _, _) = left_over(&robot, &fit.correction, 11, duty);
            let seen = if duty < 0.0 && in_gap != InGap::Random { GapBehaviour::HoldOrZero } else { ccw };
            assert_eq!(fit.zero_source, ZeroSource::Gap(seen), "{in_gap:?}, duty {duty}");
            assert!(zero.abs() < 0.3 && zero.abs() < 5.0 * fit.zero_uncertainty_deg, "zero {zero}° off");
        }
    }
}

#[test]
fn the_start_of_the_run_may_be_in_it_and_a_stop_too() {
    let robot = robot();
    let mut run = run(&robot, 5, 1.0, 2.5, None).recording;
    // The shaft stands for the last 0.4 s, the bridge still said to be on.
    let AngleReading::Adc(codes) = &mut run.angle else { panic!("codes") };
    let held = codes[2099];
    codes[2100..].fill(held);
    let fit = potentiometer(&robot, &run).unwrap();
    assert!(fit.to_s < 2.12 && fit.from_s > 0.1, "{} … {}", fit.from_s, fit.to_s);
    let (_, rms, _) = left_over(&robot, &fit.correction, 5, 1.0);
    assert!(rms < 0.2, "{rms}");
}

#[test]
fn the_arc_holds_every_code_that_does_not_follow() {
    let robot = robot();
    let Sensor::Potentiometer(sensor) = &robot.sensor else { panic!("no potentiometer") };
    let converter = AdcCurve::new(&sensor.adc);
    for seed in 0..10 {
        let run = run(&robot, seed, 1.0, 2.5, None);
        let correction = potentiometer(&robot, &run.recording).unwrap().correction;
        let width = correction.blind_to_deg - correction.blind_from_deg;
        assert!((55.0..80.0).contains(&width), "an arc of {width}°");
        let outside = run.truth[300..].iter().filter(|(_, angle)| {
            let angle = wrap(*angle).to_degrees();
            angle < correction.blind_from_deg || angle > correction.blind_to_deg
        });
        let off = outside
            .map(|&(code, angle)| wrap(corrected_angle(&correction, &converter, f64::from(code)) - angle).abs())
            .filter(|error| error.to_degrees() > 8.0)
            .count();
        // Spikes are 0.2 % of the samples.
        assert!(off <= 12, "seed {seed}: {off} readings outside the arc are garbage");
    }
}

#[test]
fn refusals_say_why() {
    let robot = robot();
    let good = run(&robot, 1, 1.0, 2.5, None).recording;
    let refused = |recording: &Recording| potentiometer(&robot, recording).unwrap_err();

    let mut digital = robot.clone();
    digital.sensor = Sensor::Ideal;
    assert_eq!(potentiometer(&digital, &good).unwrap_err(), PotentiometerError::NoPotentiometer { kind: "ideal" });

    let angles = Recording { angle: AngleReading::Angle(vec![Some(0.1); good.len()]), ..good.clone() };
    assert!(matches!(refused(&angles), PotentiometerError::NoCodes { .. }));

    assert!(matches!(
        refused(&Recording { angle: AngleReading::Adc(Vec::new()), ..Recording::default() }),
        PotentiometerError::TooShort { .. }
    ));
    let short = run(&robot, 1, 1.0, 0.6, None).recording;
    assert!(matches!(refused(&short), PotentiometerError::TooShort { .. }), "{}", refused(&short));

    let still = run(&robot, 1, 0.0, 2.5, None).recording;
    assert!(matches!(refused(&still), PotentiometerError::NotTurning { .. }), "{}", refused(&still));

    let mut off = good.clone();
    off.enable.fill(false);
    assert!(matches!(refused(&off), PotentiometerError::TooShort { .. }));

    let mut wide = good.clone();
    wide.angle = AngleReading::Adc(vec![Some(5000); good.len()]);
    assert!(matches!(refused(&wide), PotentiometerError::CodeTooLarge { sample: 0, code: 5000, top: 4095, .. }));

    let mut ripple = good.clone();
    ripple.drive = Drive::Duty((0..good.len()).map(|i| 0.8 + 0.1 * (0.05 * i as f64).sin()).collect());
    assert!(matches!(refused(&ripple), PotentiometerError::DriveVaries { .. }));

    // Codes that follow the shaft all around: a sensor without a gap.
    let mut whole = good.clone();
    let code = |t: f64| (4095.0 * (0.2 + 8.0 * t).rem_euclid(1.0)) as u16;
    whole.angle = AngleReading::Adc(good.t_s.iter().map(|&t| Some(code(t))).collect());
    let refusal = refused(&whole);
    assert!(matches!(refusal, PotentiometerError::NoArc { .. }), "{refusal}");
}

#[test]
fn a_speed_that_swings_or_jumps_is_refused() {
    let robot = robot();
    let Sensor::Potentiometer(sensor) = &robot.sensor else { panic!("no potentiometer") };
    let (converter, track) = (AdcCurve::new(&sensor.adc), robot_file::angle_code::Track::new(sensor));
    let turning = |angle: &dyn Fn(f64) -> f64| {
        let t_s: Vec<f64> = (0..2500).map(|i| 1e-3 * f64::from(i)).collect();
        let codes = t_s.iter().map(|&t| Some(converter.code(track.voltage(angle(t))).round() as u16)).collect();
        Recording {
            enable: vec![true; t_s.len()],
            drive: Drive::Duty(vec![1.0; t_s.len()]),
            angle: AngleReading::Adc(codes),
            t_s,
            ..Recording::default()
        }
    };
    assert!(potentiometer(&robot, &turning(&|t| 50.0 * t)).is_ok());
    // 0.8 turns/s up and down by 20 %.
    let swinging = turning(&|t| 50.0 * t + 2.0 * (TAU * 0.8 * t).sin());
    assert!(matches!(potentiometer(&robot, &swinging), Err(PotentiometerError::SpeedVaries { .. })));
    let back_and_forth = turning(&|t| 40.0 * (2.0 * t).sin());
    assert!(potentiometer(&robot, &back_and_forth).is_err());
    // Single turns a few degrees early or late.
    let jerky = turning(&|t| 50.0 * t + 0.06 * (TAU * 3.1 * t).sin());
    let refusal = potentiometer(&robot, &jerky).unwrap_err();
    assert!(
        matches!(refusal, PotentiometerError::RoughTurns { .. } | PotentiometerError::SpeedVaries { .. }),
        "{refusal}"
    );
}

#[test]
fn the_second_sensor_is_found_with_where_it_is_mounted() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/two-sensors.toml");
    let robot = Robot::load(&path).unwrap();
    for seed in 1000..1006 {
        for duty in [0.95, -0.95] {
            let recording = run(&robot, seed, duty, 2.5, None).recording;
            let first = potentiometer(&robot, &recording).unwrap();
            let fit = second_potentiometer(&robot, &recording).unwrap();
            let mounting = SimulatedRobot::new(&robot, seed).second_mounting().unwrap().to_degrees();
            // Either correction's zero is off by what the gap's edges leave; the offset takes both out.
            let zeros = first.zero_uncertainty_deg.hypot(fit.own.zero_uncertainty_deg);
            let error = fit.offset.value - mounting;
            assert!(error.abs() < 0.3 + 4.0 * zeros, "seed {seed}: {error}° beside {mounting}°");
            assert!(fit.own.correction.residual_deg < 0.15, "{}", fit.own.correction.residual_deg);
            assert!(fit.offset.low < fit.offset.value && fit.offset.value < fit.offset.high);
        }
    }
    let alone = self::robot();
    let recording = run(&alone, 1000, 0.95, 2.5, None).recording;
    assert_eq!(second_potentiometer(&alone, &recording), Err(PotentiometerError::NoSecond));
    assert!(matches!(
        second_potentiometer(&robot, &recording),
        Err(PotentiometerError::NoCodes { column: "adc_second", .. })
    ));
}
