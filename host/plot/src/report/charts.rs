//! The charts of the diagnosis report.

use std::f64::consts::TAU;

use diagnose::{Diagnosis, MisfitCurve, MissingTerm, RolloutTrace};

use super::nothing_added;
use super::svg::{Chart, range};
use super::words::{axis, coordinate, degrees, term_kind, three};

const SIZE: (f64, f64) = (380.0, 210.0);

/// Angle measured and simulated over a few rollouts, and under it how far off the simulations are.
#[must_use]
pub(super) fn trace(index: usize, why: &str, trace: &RolloutTrace, diagnosis: &Diagnosis) -> String {
    let samples = &trace.samples;
    let Some(first) = samples.first() else { return String::new() };
    let origin = first.before;
    let time = (first.t_s, samples.last().map_or(first.t_s, |last| last.t_s));
    let rows = on_one_scale(trace, origin);
    let measured: Vec<(f64, f64)> = rows.iter().map(|row| (row.t, row.measured)).collect();

    let angles = range(rows.iter().flat_map(|row| [row.measured, row.before, row.after])).unwrap_or((0.0, 1.0));
    let mut top = Chart::new(&format!("trace{index}"), (SIZE.0, 150.0), time, angles);
    top.line(measured, "measured");
    let simulated: [(Value, &str); 2] = [(|row| row.before, "before"), (|row| row.after, "after")];
    for (value, class) in simulated.into_iter().take(models(diagnosis)) {
        top.line(broken(&rows, value), class);
    }
    let about = format!("{why} ({})", trace.run);
    let top = top.finish(&about, "", "shaft angle, °", &format!("Measured and simulated angle, {about}"));

    let floor = diagnosis.noise_floor.to_degrees();
    let errors = rows.iter().flat_map(|row| [row.measured - row.before, row.measured - row.after]);
    let errors = errors.chain([-2.5 * floor, 2.5 * floor]);
    let mut bottom = Chart::new(&format!("off{index}"), (SIZE.0, 170.0), time, range(errors).unwrap_or((-1.0, 1.0)));
    bottom.block(time, (-2.0 * floor, 2.0 * floor), "shade");
    bottom.level(0.0, "floor");
    for (value, class) in simulated.into_iter().take(models(diagnosis)) {
        bottom.line(broken(&rows, |row| row.measured - value(row)), class);
    }
    let bottom = bottom.finish(
        "how far off",
        "time, s",
        "measured − simulated, °",
        &format!("Measured minus simulated angle, {about}; noise of the reading shaded"),
    );
    format!("<figure>{top}{bottom}</figure>")
}

/// What is drawn of a sample.
type Value = fn(&ChartPoint) -> f64;

/// One sample of a trace in degrees on one continuous scale; NaN where there is no reading.
struct ChartPoint {
    t: f64,
    starts: bool,
    measured: f64,
    before: f64,
    after: f64,
}

/// Every rollout drawn on the turn that follows the one before; `origin` (rad) is zero.
fn on_one_scale(trace: &RolloutTrace, origin: f64) -> Vec<ChartPoint> {
    let (mut shift, mut last) = (0.0, origin);
    let mut rows = Vec::with_capacity(trace.samples.len());
    for sample in &trace.samples {
        if sample.starts {
            shift = TAU * ((last - sample.before) / TAU).round();
        }
        last = sample.before + shift;
        let turn = |angle: f64| (angle + shift - origin).to_degrees();
        rows.push(ChartPoint {
            t: sample.t_s,
            starts: sample.starts,
            measured: sample.measured.map_or(f64::NAN, turn),
            before: turn(sample.before),
            after: turn(sample.after),
        });
    }
    rows
}

/// Points of a line that breaks where a rollout begins.
fn broken(rows: &[ChartPoint], value: impl Fn(&ChartPoint) -> f64) -> Vec<(f64, f64)> {
    let mut points = Vec::with_capacity(rows.len());
    for row in rows {
        if row.starts {
            points.push((f64::NAN, f64::NAN));
        }
        points.push((row.t, value(row)));
    }
    points
}

/// How many models there are to draw: the refitted one, and the extended one where something was added.
fn models(diagnosis: &Diagnosis) -> usize {
    if nothing_added(diagnosis) { 1 } else { 2 }
}

/// How many rollouts are off by how much, over the noise floor.
#[must_use]
pub(super) fn distribution(diagnosis: &Diagnosis) -> String {
    let floor = diagnosis.noise_floor.max(f64::MIN_POSITIVE);
    let ratios = |value: fn(&diagnose::RolloutError) -> f64| -> Vec<f64> {
        let errors = diagnosis.detail.rollout_errors.iter().map(|one| value(one) / floor);
        errors.filter(|ratio| ratio.is_finite()).map(|ratio| ratio.max(1e-3).log10()).collect()
    };
    let (before, after) = (ratios(|one| one.before), ratios(|one| one.after));
    let Some(span) = range(before.iter().chain(&after).copied().chain([-0.3, 0.3])) else { return String::new() };
    const BINS: usize = 28;
    let width = (span.1 - span.0) / BINS as f64;
    let shares = |values: &[f64]| -> Vec<f64> {
        let mut counts = vec![0.0; BINS];
        for value in values {
            counts[(((value - span.0) / width) as usize).min(BINS - 1)] += 100.0 / values.len() as f64;
        }
        counts
    };
    let (before, after) = (shares(&before), shares(&after));
    let most = before.iter().chain(&after).copied().fold(1.0, f64::max);
    let mut chart = Chart::new("distribution", SIZE, span, (0.0, 1.08 * most)).decades();
    let steps = |shares: &[f64]| -> Vec<(f64, f64)> {
        let edge = |i: usize| span.0 + width * i as f64;
        shares.iter().enumerate().flat_map(|(i, &share)| [(edge(i), share), (edge(i + 1), share)]).collect()
    };
    let drawn = [(&before, "before"), (&after, "after")].into_iter().take(models(diagnosis));
    for (shares, class) in drawn {
        for (i, &share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let from = span.0 + width * i as f64;
            chart.block((from, from + width), (0.0, share), &format!("{class} fill faint"));
        }
        chart.line(steps(shares), class);
    }
    chart.line([(0.0, 0.0), (0.0, 1.08 * most)], "floor");
    chart.finish(
        "all held-out rollouts",
        "RMS error over the noise floor (1 = as good as the sensor)",
        "% of rollouts",
        "Histogram of the held-out rollouts' errors",
    )
}

/// RMS error against one coordinate, with the floor; the range where the rest lives is shaded. Nothing where there are not two points.
#[must_use]
pub(super) fn misfit(index: usize, curve: &MisfitCurve, diagnosis: &Diagnosis) -> String {
    let (label, unit, factor) = axis(&curve.coordinate);
    let [first, .., last] = curve.bins.as_slice() else { return String::new() };
    let x = (first.from * factor, last.to * factor);
    let floor = diagnosis.noise_floor.to_degrees();
    let values = curve.bins.iter().flat_map(|bin| [bin.before, bin.after]).map(f64::to_degrees);
    let top = values.chain([1.5 * floor]).filter(|v| v.is_finite()).fold(0.0, f64::max);
    let mut chart = Chart::new(&format!("misfit{index}"), SIZE, x, (0.0, 1.08 * top));
    if let Some(left) = diagnosis.left_over.as_ref().filter(|left| left.coordinate == curve.coordinate) {
        chart.shade(left.from * factor, left.to * factor);
    }
    // The line breaks where bins were left out.
    let points = |value: fn(&diagnose::MisfitBin) -> f64| -> Vec<(f64, f64)> {
        let mut out = Vec::new();
        let mut end = f64::NAN;
        for bin in &curve.bins {
            if (bin.from - end).abs() > 1e-6 * (bin.to - bin.from) {
                out.push((f64::NAN, f64::NAN));
            }
            end = bin.to;
            out.push((0.5 * (bin.from + bin.to) * factor, value(bin).to_degrees()));
        }
        out
    };
    chart.level(floor, "floor");
    let drawn = [(points(|bin| bin.before), "before"), (points(|bin| bin.after), "after")];
    for (value, class) in drawn.into_iter().take(models(diagnosis)) {
        chart.line(value.iter().copied(), class);
        chart.dots(value, 2.0, &format!("{class} fill"));
    }
    chart.finish(
        &format!("against {label}"),
        &format!("{label}, {unit}"),
        "RMS error, °",
        &format!(
            "RMS error against {label} from {} to {} {unit}; noise floor {}",
            three(x.0),
            three(x.1),
            degrees(diagnosis.noise_floor)
        ),
    )
}

/// A missing term over its coordinate, its interval shaded.
#[must_use]
pub(super) fn missing_term(index: usize, term: &MissingTerm) -> String {
    let (label, unit, factor) = coordinate(&term.coordinate);
    let (kind, kind_unit, scale) = term_kind(term.kind);
    let finite = |point: &&diagnose::TermPoint| point.low.is_finite() && point.high.is_finite();
    let points: Vec<_> = term.points.iter().filter(finite).collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return String::new() };
    let x = (first.at * factor, last.at * factor);
    let ends = points.iter().flat_map(|point| [point.low * scale, point.high * scale]);
    let mut chart = Chart::new(&format!("term{index}"), SIZE, x, range(ends.chain([0.0])).unwrap_or((-1.0, 1.0)));
    for pair in points.windows(2) {
        let middle = |value: fn(&diagnose::TermPoint) -> f64| 0.5 * scale * (value(pair[0]) + value(pair[1]));
        let ends = (middle(|point| point.low), middle(|point| point.high));
        chart.block((pair[0].at * factor, pair[1].at * factor), ends, "before fill faint");
    }
    chart.level(0.0, "floor");
    chart.line(points.iter().map(|point| (point.at * factor, point.value * scale)), "before");
    chart.finish(
        &format!("over {label}"),
        &format!("{label}, {unit}"),
        &format!("{kind}, {kind_unit}"),
        &format!("Missing {kind} over {label} from {} to {} {unit}", three(x.0), three(x.1)),
    )
}
