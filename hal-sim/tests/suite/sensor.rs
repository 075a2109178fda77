//! The potentiometer, its converter, and the digital sensors: curve, gap, hysteresis, instants, statistics.

use std::f64::consts::{PI, TAU};

use crate::common::{default_robot, drive, potentiometer, quiet_robot};
use control::Actuation;
use effects::{Laws, SensorDelay, SensorNonlinearity};
use hal_sim::adc::Adc;
use hal_sim::potentiometer::Potentiometer;
use hal_sim::random::{Source, Stream};
use hal_sim::{SampleTime, Settings, SimulatedRobot};
use robot_file::angle_code::{AdcCurve, Track, angle_scale};
use robot_file::robot::{InGap, Quantity, Robot, Sensor};

fn quantity(value: f64) -> Quantity {
    Quantity { value, low: value, high: value, source: "test".into() }
}

fn at(robot: &Robot, angle: f64) -> SimulatedRobot {
    SimulatedRobot::with(robot, 3, &Settings { start_angle: Some(angle), ..Settings::default() })
}

#[test]
fn the_converters_points_are_those_of_the_data() {
    // ESP32 at 11 dB: zero below 0.1–0.19 V, 80–100 mV low in between, above 2.5 V bent, full above about 3.07 V.
    let mut robot = quiet_robot();
    let file = potentiometer(&mut robot).adc.clone();
    let mut adc = Adc::new(&file, 1);
    assert!((0.10..=0.19).contains(&file.zero_below_v.value) && (0.08..=0.10).contains(&file.low_reading_v.value));
    let line = |voltage: f64| ((voltage - file.low_reading_v.value) / 3.3 * 4095.0).round() as u16;
    let zero = file.zero_below_v.value - 1e-3;
    for (voltage, code) in [(0.0, 0), (zero, 0), (0.5, line(0.5)), (1.65, line(1.65)), (2.5, line(2.5))] {
        assert_eq!(adc.convert(voltage), code, "{voltage} V");
    }
    assert!(adc.convert(2.9) > line(2.9) + 50, "bends upwards");
    assert_eq!(adc.convert(3.07), 4095);
    assert_eq!(adc.convert(3.3), 4095);
}

#[test]
fn every_angle_outside_the_blind_arc_reads_as_itself() {
    let mut robot = quiet_robot();
    let file = potentiometer(&mut robot).clone();
    let (curve, track) = (AdcCurve::new(&file.adc), Track::new(&file));
    let scale = angle_scale(&robot.sensor);
    for degrees in (-179..180).step_by(7) {
        let angle = f64::from(degrees).to_radians();
        let mut simulated = at(&robot, angle);
        let code = simulated.sample().angle.0;
        if simulated.truth().in_gap {
            continue;
        }
        if code == 0 || code == 4095 {
            assert!(angle.abs() < 45f64.to_radians(), "{degrees}° reads {code}");
            continue;
        }
        let read = hal_sim::robot::wrap(track.angle(curve.voltage(f64::from(code))));
        assert!((read - angle).abs() < 0.06f64.to_radians(), "{degrees}° reads {}°", read.to_degrees());
        if (0.2..2.4).contains(&track.voltage(angle)) {
            let straight = scale.angle(f64::from(code));
            assert!(
                (straight - angle).abs() < 0.06f64.to_radians(),
                "{degrees}° on the line {}°",
                straight.to_degrees()
            );
        }
    }
}

#[test]
fn the_blind_arc_is_as_wide_as_the_hardware_says() {
    let robot = quiet_robot();
    let blind = (-1800..1800)
        .filter(|&tenths| matches!(at(&robot, f64::from(tenths).to_radians() / 10.0).sample().angle.0, 0 | 4095))
        .count();
    let gap_too = (-1800..1800).filter(|&tenths| at(&robot, f64::from(tenths).to_radians() / 10.0).truth().in_gap);
    assert!((299..=301).contains(&gap_too.count()), "the gap is 30°");
    // Beside the gap, which may float anywhere, 10–15° of zeros and 23° of full scale.
    let beside = blind as f64 / 10.0;
    assert!((32.0..=72.0).contains(&beside), "{beside}°");
}

fn gap_codes(in_gap: InGap, conversions: f64) -> Vec<u16> {
    let mut robot = quiet_robot();
    potentiometer(&mut robot).adc.conversions = quantity(conversions);
    // Half-way up the track, then into the gap by hand: the shaft coasts at rest in the middle of it.
    let mut simulated = SimulatedRobot::with(
        &robot,
        5,
        &Settings { start_angle: Some(0.0), in_gap: Some(in_gap), ..Settings::default() },
    );
    (0..300)
        .map(|_| {
            simulated.advance(Actuation::OFF);
            assert!(simulated.truth().in_gap);
            simulated.sample().angle.0
        })
        .collect()
}

#[test]
fn pulled_to_zero_in_the_gap() {
    assert!(gap_codes(InGap::Zero, 3.0).iter().all(|&code| code == 0));
}

#[test]
fn anything_in_the_gap() {
    // Uniform; the median of three lies more often in the middle: F = 3u² − 2u³.
    for (conversions, middle) in [(1.0, 100..190), (3.0, 170..240)] {
        let codes = gap_codes(InGap::Random, conversions);
        let found = codes.iter().filter(|&&code| (1000..3000).contains(&code)).count();
        assert!(middle.contains(&found), "{found} of 300 between 1000 and 3000, {conversions} conversions");
        assert!(codes.windows(2).filter(|pair| pair[0].abs_diff(pair[1]) > 400).count() > 150);
    }
}

#[test]
fn held_and_drifting_in_the_gap() {
    let codes = gap_codes(InGap::Hold, 3.0);
    let moved = codes.first().unwrap().abs_diff(*codes.last().unwrap());
    assert!(moved > 50, "drifted by {moved}");
    assert!(codes.windows(2).all(|pair| pair[0].abs_diff(pair[1]) < 60), "no jumps");
}

#[test]
fn a_wiper_that_leaves_the_track_takes_the_tracks_end_along() {
    let mut robot = quiet_robot();
    let track = Track::new(potentiometer(&mut robot));
    for (from, end_v) in [(0.5, 0.0), (-0.5, track.supply_v)] {
        let gap = Stream::new(1, Source::Gap);
        let mut wiper = Potentiometer::new(track, Laws::NONE, 0.0, InGap::Hold, from, gap);
        let mut angle: f64 = from;
        while !track.in_gap(angle) {
            angle -= 0.001 * from.signum();
            wiper.step(angle, 1e-6, false);
        }
        let voltage = wiper.voltage(angle, false);
        assert!((voltage - end_v).abs() < 0.02, "{voltage} V after leaving from {from} rad");
    }
}

#[test]
fn the_wiper_follows_with_play() {
    let track = Track { half_gap: 0.26, electrical: 5.76, supply_v: 3.3 };
    let gap = Stream::new(1, Source::Gap);
    let mut wiper = Potentiometer::new(track, Laws::NONE, 0.02, InGap::Zero, 1.0, gap);
    for (shaft, expected) in [(1.005, 1.0), (1.5, 1.49), (1.485, 1.49), (1.45, 1.46), (1.465, 1.46)] {
        let angle = wiper.step(shaft, 1e-4, false);
        assert!((angle - expected).abs() < 1e-12, "{angle} at shaft {shaft}, {expected} expected");
    }
}

#[test]
fn noise_and_spikes_have_their_size() {
    let mut robot = quiet_robot();
    let file = potentiometer(&mut robot);
    file.adc.noise_lsb = quantity(8.0);
    let mut adc = Adc::new(&file.adc, 11);
    let centre = adc.curve.code(1.5);
    let count = 200_000;
    let rms = |adc: &mut Adc| {
        let squares: f64 = (0..count).map(|_| (f64::from(adc.convert(1.5)) - centre).powi(2)).sum();
        (squares / f64::from(count)).sqrt()
    };
    // Rounding adds 1/12: √(64 + 1/12) = 8.005; three standard errors of the estimate are 0.04.
    let noise = rms(&mut adc);
    assert!((noise - 8.005).abs() < 0.04, "σ = {noise}");
    adc.spike_share = 0.02;
    adc.spike_lsb = 300.0;
    let spikes = (0..count).filter(|_| (f64::from(adc.convert(1.5)) - centre).abs() > 60.0).count();
    // |N(0, 300)| > 60 in 84.1 % of the spikes.
    let share = spikes as f64 / f64::from(count);
    assert!((share - 0.02 * 0.841).abs() < 0.0009, "share {share}");
}

#[test]
fn noise_levels_lie_within_the_files_range_and_fill_it() {
    let mut robot = default_robot();
    let file = potentiometer(&mut robot).adc.clone();
    let levels: Vec<f64> = (0..500).map(|seed| Adc::new(&file, seed).noise_lsb).collect();
    let (low, high) = (file.noise_lsb.low, file.noise_lsb.high);
    assert!(levels.iter().all(|level| (low..=high).contains(level)));
    let mean = levels.iter().sum::<f64>() / 500.0;
    let width = high - low;
    assert!((mean - 0.5 * (low + high)).abs() < 4.0 * width / 12f64.sqrt() / 500f64.sqrt(), "mean {mean}");
}

#[test]
fn sampling_instants_jitter_as_they_should() {
    let mut robot = quiet_robot();
    let file = potentiometer(&mut robot);
    file.adc.jitter_s = quantity(10e-6);
    file.adc.conversions = quantity(3.0);
    let mut adc = Adc::new(&file.adc, 2);
    let (mut sum, mut squares) = (0.0, 0.0);
    let ticks = 50_000;
    for _ in 0..ticks {
        let middle = adc.middle();
        let instants: Vec<f64> = adc.instants(middle).collect();
        assert!((instants[1] - middle).abs() < 1e-12);
        assert_eq!(instants.len(), 3);
        assert!((instants[2] - instants[0] - 2.0 * adc.conversion_s).abs() < 1e-12);
        sum += instants[1];
        squares += instants[1] * instants[1];
    }
    let (mean, deviation) = (sum / f64::from(ticks), (squares / f64::from(ticks)).sqrt());
    assert!(mean.abs() < 3.5 * 10e-6 / f64::from(ticks).sqrt(), "mean {mean} s");
    assert!((deviation - 10e-6).abs() < 0.12e-6, "σ = {deviation} s");
}

#[test]
fn jitter_becomes_angle_error_at_speed() {
    let mut robot = quiet_robot();
    robot.sensor = Sensor::Potentiometer(Box::new({
        let mut file = potentiometer(&mut robot).clone();
        file.adc.jitter_s = quantity(100e-6);
        file
    }));
    let mut simulated = at(&robot, 0.0);
    for _ in 0..1000 {
        simulated.advance(drive(1.0));
    }
    let scale = angle_scale(&robot.sensor);
    let (mut squares, mut count) = (0.0, 0);
    for _ in 0..4000 {
        simulated.advance(drive(1.0));
        let (code, truth) = (simulated.sample().angle.0, simulated.truth());
        let angle = hal_sim::robot::wrap(truth.angle);
        if (0.6..3.0).contains(&angle) {
            squares += hal_sim::robot::wrap(scale.angle(f64::from(code)) - angle).powi(2);
            count += 1;
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    let expected = 100e-6 * simulated.truth().speed;
    assert!((rms / expected - 1.0).abs() < 0.1, "{rms} rad RMS, {expected} expected");
}

#[test]
fn the_time_of_a_sample_is_that_of_its_conversions_or_the_ticks() {
    for (sample_time, conversions) in
        [(SampleTime::Conversions, 1.0), (SampleTime::Conversions, 3.0), (SampleTime::Tick, 3.0)]
    {
        let mut robot = quiet_robot();
        let file = potentiometer(&mut robot);
        file.adc.jitter_s = quantity(100e-6);
        file.adc.conversions = quantity(conversions);
        let settings = Settings { start_angle: Some(0.0), sample_time, ..Settings::default() };
        let mut simulated = SimulatedRobot::with(&robot, 3, &settings);
        let scale = angle_scale(&robot.sensor);
        let (mut squares, mut count, mut off_tick) = (0.0, 0, 0);
        for tick in 0..4000u64 {
            let (sample, truth) = (simulated.sample(), simulated.truth());
            off_tick += u32::from(sample.time_us != 1000 * tick);
            let late_s = sample.time_us as f64 * 1e-6 - truth.time_s;
            let angle = hal_sim::robot::wrap(truth.angle);
            if tick > 1000 && (0.6..3.0).contains(&angle) {
                let then = angle + late_s * truth.speed;
                squares += hal_sim::robot::wrap(scale.angle(f64::from(sample.angle.0)) - then).powi(2);
                count += 1;
            }
            simulated.advance(drive(1.0));
        }
        let rms = (squares / f64::from(count)).sqrt();
        let from_jitter = 100e-6 * simulated.truth().speed;
        // Told the instant, only the codes' steps are left.
        let (told, expected) = match sample_time {
            SampleTime::Conversions => (off_tick > 3900, 0.6 * scale.rad_per_code),
            SampleTime::Tick => (off_tick == 0, 1.1 * from_jitter),
        };
        assert!(told && rms < expected, "{sample_time:?}: {rms} rad RMS, {off_tick} off the tick");
    }
}

#[test]
fn a_delayed_reading_is_that_much_behind() {
    let mut robot = quiet_robot();
    robot.effects.insert::<SensorDelay>(vec![quantity(4.3e-3)]);
    let mut ideal = robot.clone();
    ideal.sensor = Sensor::Ideal;
    for robot in [robot, ideal] {
        let mut simulated = at(&robot, 1.0);
        let scale = angle_scale(&robot.sensor);
        // On the straight part of the track, in the middle of a turn at speed.
        for _ in 0..1000 {
            simulated.advance(drive(1.0));
        }
        while !(2.0..3.0).contains(&hal_sim::robot::wrap(simulated.truth().angle)) {
            simulated.advance(drive(1.0));
        }
        let truth = simulated.truth();
        let behind = hal_sim::robot::wrap(truth.angle - scale.angle(f64::from(simulated.sample().angle.0)));
        let expected = 4.3e-3 * truth.speed;
        let code = 0.5 * scale.rad_per_code + 1e-4;
        assert!((behind - expected).abs() < code, "{behind} rad behind, {expected} expected");
    }
}

#[test]
fn the_ideal_sensor_resolves_a_turn_in_65536() {
    let mut robot = quiet_robot();
    robot.sensor = Sensor::Ideal;
    let scale = angle_scale(&robot.sensor);
    for i in 0..1000 {
        let angle = -PI + TAU * f64::from(i) / 1000.0;
        let read = scale.angle(f64::from(at(&robot, angle).sample().angle.0));
        assert!(hal_sim::robot::wrap(read - angle).abs() <= 0.5 * TAU / 65536.0 + 1e-12, "{angle} reads {read}");
    }
}

#[test]
fn linearity_errors_stay_within_the_files_bound_or_the_given_peak() {
    let robot = default_robot();
    let peaks: Vec<f64> =
        (0..300).map(|seed| SimulatedRobot::new(&robot, seed).linearity().peak().to_degrees()).collect();
    let bound = robot.effects.quantity("sensor_nonlinearity", "cos1_deg").unwrap().high;
    assert_eq!(bound, 3.0, "what the figures are asked for");
    assert!(peaks.iter().all(|&peak| peak <= bound + 1e-9));
    let beyond = |low: f64| peaks.iter().filter(|&&peak| peak > low * bound).count();
    assert!(beyond(0.95) > 3 && (110..190).contains(&beyond(0.5)) && beyond(0.05) < 300, "uniform");
    let settings = Settings { linearity_peak: Some(0.3f64.to_radians()), ..Settings::default() };
    let calibrated = SimulatedRobot::with(&robot, 9, &settings).linearity().peak().to_degrees();
    assert!((calibrated - 0.3).abs() < 1e-9, "{calibrated}°");
}

#[test]
fn runs_of_one_specimen_share_its_sensor_and_not_their_start() {
    let robot = default_robot();
    let run = |specimen, seed| SimulatedRobot::with(&robot, seed, &Settings { specimen, ..Settings::default() });
    let (one, again, other) = (run(Some(5), 1), run(Some(5), 2), run(Some(6), 1));
    assert_eq!(one.linearity(), again.linearity());
    assert_ne!(one.truth().angle, again.truth().angle);
    assert_ne!(one.linearity(), other.linearity());
    assert_eq!(one.truth().angle, other.truth().angle);
    assert_eq!(run(None, 5).linearity(), one.linearity(), "a run's own seed where no specimen is named");
}

#[test]
fn an_identified_linearity_error_is_the_files() {
    let mut robot = quiet_robot();
    robot.effects.insert::<SensorNonlinearity>([1.5, -0.5, 0.3, 0.2].map(quantity).to_vec());
    for seed in 0..3 {
        let error = SimulatedRobot::new(&robot, seed).linearity();
        let angle: f64 = 2.0;
        let expected = 1.5 * angle.cos() - 0.5 * angle.sin() + 0.3 * (2.0 * angle).cos() + 0.2 * (2.0 * angle).sin();
        assert!((error.error(angle).to_degrees() - expected).abs() < 1e-12);
    }
    // And it is seen: the reading is θ + error.
    let mut simulated = at(&robot, 2.0);
    let expected = 2.0 + simulated.linearity().error(2.0);
    let read = angle_scale(&robot.sensor).angle(f64::from(simulated.sample().angle.0));
    assert!((read - expected).abs() < 1e-3, "{read} rad, {expected} expected");
}

#[test]
fn the_battery_is_read_through_its_divider() {
    let robot = quiet_robot();
    let mut simulated = at(&robot, 1.0);
    for _ in 0..10 {
        simulated.advance(Actuation::OFF);
    }
    let curve = robot_file::angle_code::battery_curve(&robot.sensor);
    let read = curve.voltage(f64::from(simulated.sample().battery.0)) / 0.5;
    let truth = simulated.truth().battery_v;
    assert!((read - truth).abs() < 0.05, "{read} V, {truth} V expected");
}
