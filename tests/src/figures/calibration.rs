//! A calibrated sensor: one run at constant voltage, `scram identify potentiometer`, and the same robot again.

use hal_sim::{Settings, SimulatedRobot};
use robot_file::design::design;
use robot_file::robot::{Correction, Robot, Sensor};
use serde_json::json;
use simulation::{DriveCommand, Metrics, recording};

use super::FigureRow;
use super::run::{DesignedRobot, for_seeds, frequency_error, plan, pooled, run, trace, worst};

/// Length of the calibration run, s.
const CALIBRATION_S: f64 = 2.5;
/// Its duty: about 7 Hz on the default robot.
const CALIBRATION_DUTY: f64 = 0.95;

/// What a calibration of one specimen gave.
struct Calibrated {
    /// RMS of what the correction leaves of the specimen's linearity error outside the arc, degrees; mean removed or not.
    left_deg: f64,
    left_shape_deg: f64,
    /// RMS of the error before, degrees.
    before_deg: f64,
    runs: Vec<Metrics>,
}

/// Calibrates a specimen from one run: the file with its correction; `None` where it cannot be identified.
pub fn calibrate(bench: &DesignedRobot, seed: u64) -> Option<(Robot, Correction)> {
    let run = trace(
        &bench.robot,
        &bench.parameters,
        seed,
        &plan(DriveCommand::Duty { duty: CALIBRATION_DUTY }, CALIBRATION_S),
    );
    let fit = identify::potentiometer::potentiometer(&bench.robot, &recording(&run, &bench.robot)).ok()?;
    let correction = fit.correction;
    let mut robot = bench.robot.clone();
    if let Sensor::Potentiometer(potentiometer) = &mut robot.sensor {
        potentiometer.correction = Some(correction.clone());
    }
    Some((robot, correction))
}

/// What the controller's map makes of the codes that a specimen gives without noise, spikes and jitter (but with its
/// linearity error and its converter's nonlinearity), against the wiper's true angle, outside the correction's arc: RMS
/// and RMS about the mean, degrees; and the RMS of the same for the uncorrected map.
fn left_over(bench: &DesignedRobot, calibrated: &Robot, seed: u64) -> Option<(f64, f64, f64)> {
    let mut quiet = bench.robot.clone();
    let Sensor::Potentiometer(potentiometer) = &mut quiet.sensor else { return None };
    let half_play = 0.5 * potentiometer.hysteresis_deg.value.to_radians();
    let adc = &mut potentiometer.adc;
    for nuisance in [&mut adc.noise_lsb, &mut adc.spike_share, &mut adc.jitter_s] {
        (nuisance.value, nuisance.low, nuisance.high) = (0.0, 0.0, 0.0);
    }
    let map = design(calibrated).ok()?.parameters.sensor;
    let mut specimen = SimulatedRobot::with(&quiet, seed, &Settings::default());
    let (mut errors, mut before) = (Vec::new(), Vec::new());
    for tick in 0..(CALIBRATION_S * 1000.0) as usize {
        let code = specimen.sample().angle;
        // Turning counter-clockwise the wiper lags by half of its play.
        let wiper = common::wrap(specimen.truth().angle - half_play);
        if tick > 300 && !map.is_blind(wiper as f32) {
            errors.push(common::wrap(f64::from(map.angle(code)) - wiper).to_degrees());
            let uncorrected = f64::from(bench.parameters.sensor.angle(code));
            before.push(common::wrap(uncorrected - wiper).to_degrees());
        }
        specimen.advance(control::Actuation { duty: CALIBRATION_DUTY as f32, enable: true });
    }
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let rms = |offset: f64, values: &[f64]| (values.iter().map(|e| (e - offset).powi(2)).sum::<f64>() / count).sqrt();
    Some((rms(0.0, &errors), rms(mean, &errors), rms(0.0, &before)))
}

fn one(bench: &DesignedRobot, seed: u64) -> Option<Calibrated> {
    let (robot, _) = calibrate(bench, seed)?;
    let parameters = design(&robot).ok()?.parameters;
    let (left_deg, left_shape_deg, before_deg) = left_over(bench, &robot, seed)?;
    // The world is the specimen as it was: only the controller knows the correction.
    let runs = super::speed::FREQUENCIES_HZ
        .map(|hz| run(&bench.robot, &parameters, seed, DriveCommand::Freq { hz }, 2.0))
        .to_vec();
    Some(Calibrated { left_deg, left_shape_deg, before_deg, runs })
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    let all = for_seeds(seeds, |seed| one(bench, seed));
    let failed = all.iter().filter(|one| one.is_none()).count();
    let done: Vec<_> = all.into_iter().flatten().collect();
    let runs: Vec<_> = done.iter().flat_map(|one| one.runs.clone()).collect();
    let outside = pooled(runs.iter().map(|m| m.estimate_rms_deg));
    let inside = pooled(runs.iter().map(|m| m.estimate_rms_blind_deg));
    let instantaneous = worst(runs.iter().map(|m| m.settling_instantaneous_s.unwrap_or(f64::INFINITY)));
    let late = runs.iter().filter(|m| !m.settling_instantaneous_s.is_some_and(|s| s <= 0.4)).count();
    let frequency = worst(runs.iter().map(frequency_error));
    let left = pooled(done.iter().map(|one| Some(one.left_deg)));
    let shape = pooled(done.iter().map(|one| Some(one.left_shape_deg)));
    let before = pooled(done.iter().map(|one| Some(one.before_deg)));
    let (count, tried) = (runs.len(), seeds);
    vec![
        FigureRow::new(
            "identify potentiometer on one 2.5 s run: what it leaves of ±3°",
            "0.1°",
            format!(
                "{shape:.3}° RMS pooled of {before:.2}° ({left:.3}° with the zero's offset), {failed} of {tried} not identified"
            ),
            // Linearity is about the best line, offset free (data sheets' "independent linearity"); the zero's own
            // error is in the estimate's figure below.
            shape <= 0.1 && failed == 0,
            json!({ "left_deg": left, "left_about_mean_deg": shape, "before_deg": before, "failed": failed }),
        ),
        FigureRow::new(
            "estimate against truth, RMS outside / inside the blind arc, calibrated",
            "0.3° / 0.3°",
            format!(
                "{outside:.2}° / {inside:.2}° pooled over {count} runs, frequency within {:.4} %",
                frequency * 100.0
            ),
            outside <= 0.3 && inside <= 0.3 && failed == 0,
            json!({ "outside_deg": outside, "inside_deg": inside, "frequency_worst": frequency }),
        ),
        FigureRow::new(
            "instantaneous speed within 2 %, and staying, calibrated",
            "in 0.4 s",
            format!("worst {instantaneous:.3} s, {late} of {count} late"),
            late == 0 && failed == 0,
            json!({ "worst_s": instantaneous, "late": late }),
        ),
    ]
}
