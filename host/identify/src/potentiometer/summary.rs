//! What a fit is worth: the correction in shaft angle, its figures, and the residual over the angle.

use std::f64::consts::{PI, TAU};

use robot_file::angle_code::{AdcCurve, Track};
use robot_file::robot::{Correction, Robot};
use serde::Serialize;

use super::arc::{Reliable, Zero, ZeroSource};
use super::curve::{self, Curve, Fit};
use super::line::nominal_grid;
use super::phase::{Ramp, Reading};
use common::{median, wrap};
use recording::Recording;

/// The blind arc is made this much wider at both ends, rad.
const MARGIN: f64 = 1.0 * PI / 180.0;
/// Bins of the residual over a turn.
const BINS: usize = 72;

/// What one run says about the sensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PotentiometerFit {
    /// For `[sensor.correction]`.
    pub correction: Correction,
    /// Steady turns used.
    pub turns: f64,
    /// Mean speed, rad/s, counter-clockwise positive.
    pub speed_rad_per_s: f64,
    /// Change of the speed over the stretch, % of its mean.
    pub drift_percent: f64,
    /// The stretch used, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
    /// Samples outside the blind arc in the stretch.
    pub samples: usize,
    /// Scatter of one reading about the corrected curve (noise), degrees.
    pub noise_deg: f64,
    /// Error of the uncorrected reading (nominal curve of sensor and converter), RMS, degrees.
    pub before_rms_deg: f64,
    /// Its peak, degrees.
    pub before_peak_deg: f64,
    /// Estimated error of the corrected reading, RMS, degrees, without noise and without the zero's uncertainty.
    pub after_rms_deg: f64,
    /// Largest mean residual of a bin of 5°, degrees (noise of the bin's mean included).
    pub after_peak_deg: f64,
    /// How far the zero moved against the nominal line, degrees.
    pub zero_shift_deg: f64,
    /// Standard uncertainty of the zero, degrees.
    pub zero_uncertainty_deg: f64,
    /// What the zero was taken from.
    pub zero_source: ZeroSource,
    /// What 1 mN·m of torque at one cycle per turn would look like (amplitude, degrees): ripple that no fit can tell
    /// from the sensor's own error.
    pub ripple_deg_per_mnm: f64,
    /// Residual over the angle.
    pub bins: Vec<ResidualBin>,
}

/// Mean residual in a stretch of shaft angle outside the blind arc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ResidualBin {
    /// Middle of the bin, shaft angle, degrees, −180 … 180.
    pub angle_deg: f64,
    /// Uncorrected reading minus shaft angle, mean, degrees.
    pub before_deg: f64,
    /// Corrected reading minus shaft angle, mean, degrees.
    pub after_deg: f64,
    /// Standard error of that mean, degrees.
    pub error_deg: f64,
    /// Samples.
    pub samples: usize,
}

/// Torque ripple's amplitude in angle, degrees per mN·m at one cycle a turn.
fn ripple_deg_per_mnm(robot: &Robot, speed: f64) -> f64 {
    let inertia = robot.motor.rotor_inertia_kg_m2.value + robot.load.inertia_kg_m2.value;
    let k = robot.motor.torque_constant_nm_per_a.value;
    let damping = robot.motor.viscous_nm_s_per_rad.value + k * k / robot.motor.resistance_ohm.value;
    (1e-3 / (speed.abs() * (inertia * speed).hypot(damping))).to_degrees()
}

#[expect(clippy::too_many_arguments, reason = "one place that turns the pieces of the fit into the result")]
pub(super) fn summarise(
    robot: &Robot,
    recording: &Recording,
    converter: &AdcCurve,
    track: &Track,
    steady: &[Reading],
    fit: &Fit,
    reliable: Reliable,
    (zero, offset): (Zero, f64),
) -> PotentiometerFit {
    // From the fit's gauge to shaft angle.
    let curve = fit.curve.shifted(-zero.angle);
    let ramp = {
        let mut ramp = fit.ramp.clone();
        ramp.coefficients[0] -= zero.angle;
        ramp
    };
    let reliable = Reliable { from: reliable.from - zero.angle, to: reliable.to - zero.angle };
    let inside: Vec<Reading> = steady.iter().filter(|r| reliable.contains(ramp.angle(r.t))).copied().collect();
    let bins = residual_bins(&inside, &curve, &ramp, fit.sigma);
    let before = before_error(converter, track, &curve, reliable);
    let after = after_rms(&bins, fit);
    // The phase in which the gap's edges were seen hangs on the curve, and is as wrong as that.
    let zero_uncertainty = zero.uncertainty.hypot(after);
    let (slowest, fastest) = ramp.speed_range();
    let speed = ramp.speed(ramp.center);
    let degrees = |values: &[f64]| values.iter().map(|v| v.to_degrees()).collect::<Vec<f64>>();
    let turns = ramp.turns();
    let correction = Correction {
        zero_deg: wrap(curve.zero).to_degrees(),
        deg_per_code: curve.per_code.to_degrees(),
        cos_deg: degrees(&curve.cos),
        sin_deg: degrees(&curve.sin),
        blind_from_deg: (wrap(reliable.to) - MARGIN).to_degrees(),
        blind_to_deg: (wrap(reliable.from) + MARGIN).to_degrees(),
        residual_deg: after.to_degrees(),
        source: format!(
            "scram identify potentiometer {}: {turns:.0} turns at {:.2} turns/s, zero from {}, ±{:.2}° (1 sigma)",
            recording.path.file_name().map_or_else(|| "a run in memory".into(), |name| name.to_string_lossy()),
            speed / TAU,
            match zero.source {
                ZeroSource::Gap(_) => "the gap's edges",
                ZeroSource::NominalLine => "the nominal line",
            },
            zero_uncertainty.to_degrees(),
        ),
    };
    PotentiometerFit {
        correction,
        turns,
        speed_rad_per_s: speed,
        drift_percent: 100.0 * (fastest - slowest) / fastest,
        from_s: ramp.center - ramp.half,
        to_s: ramp.center + ramp.half,
        samples: inside.len(),
        noise_deg: fit.sigma.to_degrees(),
        before_rms_deg: before.0.to_degrees(),
        before_peak_deg: before.1.to_degrees(),
        after_rms_deg: after.to_degrees(),
        after_peak_deg: bins.iter().map(|b| b.after_deg.abs()).fold(0.0, f64::max),
        zero_shift_deg: wrap(offset - zero.angle).to_degrees(),
        zero_uncertainty_deg: zero_uncertainty.to_degrees(),
        zero_source: zero.source,
        ripple_deg_per_mnm: ripple_deg_per_mnm(robot, speed),
        bins,
    }
}

/// RMS and peak (rad) of the uncorrected reading against the corrected one over the reliable arc.
fn before_error(converter: &AdcCurve, track: &Track, curve: &Curve, reliable: Reliable) -> (f64, f64) {
    let (mut sum, mut count, mut peak) = (0.0, 0.0, 0.0_f64);
    for (straightened, nominal) in nominal_grid(converter, track) {
        let angle = curve.angle(straightened);
        if reliable.contains(angle) {
            let error = wrap(nominal - angle);
            sum += error * error;
            count += 1.0;
            peak = peak.max(error.abs());
        }
    }
    ((sum / f64::max(count, 1.0)).sqrt(), peak)
}

/// Estimated RMS error of the corrected curve, rad: what the bins' means show beyond their own noise, and the fit's
/// standard error, which its own residuals cannot show.
fn after_rms(bins: &[ResidualBin], fit: &Fit) -> f64 {
    let samples = bins.iter().map(|b| b.samples as f64).sum::<f64>().max(1.0);
    let mean = |value: fn(&ResidualBin) -> f64| {
        bins.iter().map(|b| b.samples as f64 * value(b).to_radians().powi(2)).sum::<f64>() / samples
    };
    let (seen, noise) = (mean(|b| b.after_deg), mean(|b| b.error_deg));
    ((seen - noise).max(0.0) + fit.standard_error.powi(2)).sqrt()
}

fn residual_bins(inside: &[Reading], curve: &Curve, ramp: &Ramp, sigma: f64) -> Vec<ResidualBin> {
    let mut values: Vec<(Vec<f64>, Vec<f64>)> = vec![(Vec::new(), Vec::new()); BINS];
    for reading in inside {
        let angle = wrap(ramp.angle(reading.t));
        let bin = &mut values[(((angle + PI) / TAU * BINS as f64) as usize).min(BINS - 1)];
        bin.0.push(wrap(reading.nominal - angle).to_degrees());
        bin.1.push(curve::residual(curve, ramp, reading).to_degrees());
    }
    let mut bins = Vec::new();
    for (n, (before, after)) in values.iter_mut().enumerate() {
        if after.len() < 5 {
            continue;
        }
        // A spike would move a plain mean: samples beyond four standard deviations do not count.
        let center = median(after).unwrap_or(f64::NAN);
        let sigma = sigma.to_degrees();
        let kept: Vec<f64> = after.iter().copied().filter(|v| (v - center).abs() <= 4.0 * sigma).collect();
        let count = kept.len().max(2) as f64;
        let mean = kept.iter().sum::<f64>() / count;
        let variance = kept.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
        bins.push(ResidualBin {
            angle_deg: 360.0 * (n as f64 + 0.5) / BINS as f64 - 180.0,
            before_deg: median(before).unwrap_or(f64::NAN),
            after_deg: mean,
            error_deg: (variance / count).sqrt(),
            samples: after.len(),
        });
    }
    bins
}
