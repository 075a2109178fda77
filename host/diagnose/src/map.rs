//! Where the misfit lives: the held-out error against angle, speed, voltage and time, before and after.

use super::model::Plant;
use super::probe::Follows;
use super::rollout::{residual, rollout};
use super::search::Candidate;
use super::session::Session;
use super::spectrum;
use super::track::Track;
use super::verdict::{LeftOver, MisfitBin, MisfitCurve, RolloutError, RolloutTrace, RunUse, TraceSample};
use common::{quantile, wrap};

/// Bins of a curve.
pub(super) const BINS: usize = 24;
/// A bin with fewer samples is left out.
const FEWEST: usize = 20;

/// One reading with what it is plotted against.
pub(super) struct Point {
    pub(super) coordinates: [f64; NAMES.len()],
    before: f64,
    pub(super) after: f64,
}

/// Names of the coordinates, in order of [`Point::coordinates`].
pub(super) const NAMES: [&str; 8] = [
    "angle_rad",
    "speed_rad_per_s",
    "voltage_v",
    "current_a",
    "time_s",
    "time_since_reversal_s",
    "run",
    "time_in_rollout_s",
];

/// The readings of the held-out runs.
fn points(session: &Session, before: &Candidate, after: &Candidate) -> Vec<Point> {
    let plant = after.fit.plant(&session.model);
    let of_track = |(index, track): (usize, &Track)| {
        let (before, after) = (&before.evaluation.rolled[index].readings, &after.evaluation);
        points_of(session, &plant, track, &after.starts[index], [before, &after.rolled[index].readings])
    };
    session.held_out.iter().enumerate().flat_map(of_track).collect()
}

/// The readings of a run, with what a plant shows from the rollouts' starts before and after.
pub(super) fn points_of(
    session: &Session,
    plant: &Plant,
    track: &Track,
    starts: &[[f64; 2]],
    [before, after]: [&[f64]; 2],
) -> Vec<Point> {
    let currents = rollout(plant, track, starts, None, true).currents;
    let (mut out, mut offset) = (Vec::new(), 0);
    for segment in &track.segments {
        let length = segment.last - segment.first;
        for i in 0..length {
            let k = segment.first + i;
            if track.weight[k] <= 0.0 {
                continue;
            }
            // Speed of the better model's rollout about this sample.
            let (a, b) = (i.saturating_sub(2), (i + 2).min(length - 1));
            let span = track.t[segment.first + b] - track.t[segment.first + a];
            let rail = track.supply_v.get(k).copied().unwrap_or(session.model.rail_v);
            let volts = if track.terminals_measured { 1.0 } else { rail };
            out.push(Point {
                coordinates: [
                    wrap(after[offset + i]),
                    (after[offset + b] - after[offset + a]) / span.max(1e-9),
                    if track.enable[k] { track.drive[k] * volts } else { 0.0 },
                    currents[offset + i],
                    track.t[k] - track.t[0],
                    track.since_reversal[k],
                    track.place as f64,
                    track.t[k] - track.t[segment.first],
                ],
                before: residual(track, segment, k, before[offset + i]),
                after: residual(track, segment, k, after[offset + i]),
            });
        }
        offset += length;
    }
    out
}

/// Equal bins over the values of a coordinate.
pub(super) struct Bins {
    low: f64,
    width: f64,
}

impl Bins {
    /// A few wild samples must not stretch the axis.
    pub(super) fn over(values: &mut [f64]) -> Self {
        let mut at = |share: f64| quantile(values, share).unwrap_or(0.0);
        let (low, high) = (at(0.002), at(0.998));
        Self { low, width: ((high - low) / BINS as f64).max(1e-12) }
    }

    pub(super) fn of(&self, value: f64) -> Option<usize> {
        let place = (value - self.low) / self.width;
        (0.0..=BINS as f64).contains(&place).then_some((place as usize).min(BINS - 1))
    }

    fn range(&self, bin: usize) -> (f64, f64) {
        (self.low + self.width * bin as f64, self.low + self.width * (bin + 1) as f64)
    }
}

/// The curves, and where what is left after `after` is concentrated most: on the coordinate that it follows, where one is known.
#[must_use]
pub fn misfit_map(
    session: &Session,
    before: &Candidate,
    after: &Candidate,
    follows: Option<&str>,
) -> (Vec<MisfitCurve>, Option<LeftOver>) {
    let points = points(session, before, after);
    let mut curves: Vec<MisfitCurve> = (0..NAMES.len()).map(|axis| curve(&points, axis)).collect();
    curves.push(spectrum::of(&session.held_out, &before.evaluation.rolled, &after.evaluation.rolled));
    let sought = |curve: &&MisfitCurve| follows.is_none_or(|follows| follows == curve.coordinate);
    let best = curves
        .iter()
        .filter(sought)
        .filter_map(|curve| concentration(curve, session.noise))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, left_over)| left_over);
    let left_over = best.map(|left_over| with_runs(session, left_over));
    (curves, left_over)
}

/// With the names of the runs that it lies in, where the run is what it follows.
fn with_runs(session: &Session, left_over: LeftOver) -> LeftOver {
    let within = |track: &&Track| (left_over.from..=left_over.to).contains(&(track.place as f64));
    let runs = if left_over.coordinate == Follows::Run.name() {
        session.held_out.iter().filter(within).map(|track| track.name.clone()).collect()
    } else {
        Vec::new()
    };
    LeftOver { runs, ..left_over }
}

fn curve(points: &[Point], axis: usize) -> MisfitCurve {
    let mut values: Vec<f64> = points.iter().map(|point| point.coordinates[axis]).collect();
    let range = Bins::over(&mut values);
    let mut sums = vec![(0usize, 0.0, 0.0, 0.0, 0.0); BINS];
    for point in points {
        if let Some(bin) = range.of(point.coordinates[axis]) {
            let sum = &mut sums[bin];
            sum.0 += 1;
            sum.1 += point.before.powi(2);
            sum.2 += point.after.powi(2);
            sum.3 += point.before;
            sum.4 += point.after;
        }
    }
    let bins = sums
        .iter()
        .enumerate()
        .filter(|(_, sum)| sum.0 >= FEWEST)
        .map(|(i, &(samples, before, after, bias_before, bias_after))| {
            let n = samples as f64;
            MisfitBin {
                from: range.range(i).0,
                to: range.range(i).1,
                samples,
                before: (before / n).sqrt(),
                after: (after / n).sqrt(),
                bias_before: bias_before / n,
                bias_after: bias_after / n,
            }
        })
        .collect();
    MisfitCurve { coordinate: NAMES[axis].to_owned(), bins }
}

/// The range of a curve that holds more of the excess than its samples would, and by how much.
fn concentration(curve: &MisfitCurve, noise: f64) -> Option<(f64, LeftOver)> {
    // Within a rollout the error always grows: that says nothing about the cause.
    if curve.coordinate == "time_in_rollout_s" {
        return None;
    }
    let slowest = curve.bins.first().map(|bin| bin.from);
    let excess: Vec<f64> =
        curve.bins.iter().map(|bin| (bin.after.powi(2) - noise).max(0.0) * bin.samples as f64).collect();
    let (total, samples) = (excess.iter().sum::<f64>(), curve.bins.iter().map(|bin| bin.samples).sum::<usize>() as f64);
    if total <= 0.0 {
        return None;
    }
    let mut best: Option<(f64, LeftOver)> = None;
    for first in 0..curve.bins.len() {
        let (mut part, mut count) = (0.0, 0.0);
        for (last, bin) in curve.bins.iter().enumerate().skip(first) {
            part += excess[last];
            count += bin.samples as f64;
            let (share, expected) = (part / total, count / samples);
            // Information about where the excess lies (Kullback-Leibler, in or out of the range).
            let out = if share < 1.0 { (1.0 - share) * ((1.0 - share) / (1.0 - expected).max(1e-9)).ln() } else { 0.0 };
            let gained = share * (share / expected).ln() + out;
            // Errors of a simulation pile up, so that any misfit is slow: only a range above says something about the cause.
            if curve.coordinate == spectrum::NAME && Some(curve.bins[first].from) == slowest {
                continue;
            }
            if share > expected && best.as_ref().is_none_or(|best| gained > best.0) {
                best = Some((
                    gained,
                    LeftOver {
                        coordinate: curve.coordinate.clone(),
                        from: curve.bins[first].from,
                        to: bin.to,
                        share,
                        runs: Vec::new(),
                    },
                ));
            }
        }
    }
    best
}

/// RMS error of every held-out rollout before and after.
#[must_use]
pub fn rollout_errors(before: &Candidate, after: &Candidate) -> Vec<RolloutError> {
    let rms = |&(sum, freedom): &(f64, f64)| (sum / freedom).sqrt();
    let pairs = before.evaluation.errors.iter().zip(&after.evaluation.errors);
    pairs.map(|(before, after)| RolloutError { before: rms(before), after: rms(after) }).collect()
}

/// What of each run was used.
#[must_use]
pub fn runs(session: &Session) -> Vec<RunUse> {
    let all = session.fit.iter().map(|track| (track, false)).chain(session.held_out.iter().map(|track| (track, true)));
    all.map(|(track, held_out)| {
        let missing = track.angle.iter().filter(|angle| !angle.is_finite()).count();
        let counts = |range: std::ops::Range<usize>| range.filter(|&k| track.weight[k] > 0.0).count();
        RunUse {
            name: track.name.clone(),
            held_out,
            seconds: track.t.last().map_or(0.0, |last| last - track.t[0]),
            samples: track.t.len(),
            used: track.segments.iter().map(|segment| counts(segment.first..segment.last)).sum(),
            missing,
            blind: track.dropped,
            pull_unknown: track
                .pull_unknown
                .iter()
                .zip(&track.weight)
                .filter(|(unknown, weight)| **unknown && **weight > 0.0)
                .count(),
            spikes: track.t.len() - missing - counts(0..track.t.len()),
            rollouts: track.segments.len(),
        }
    })
    .collect()
}

/// Held-out rollouts to look at: the one that was worst before, the worst after, and a typical one.
#[must_use]
pub fn traces(session: &Session, before: &Candidate, after: &Candidate) -> Vec<RolloutTrace> {
    let places: Vec<(usize, usize)> = session
        .held_out
        .iter()
        .enumerate()
        .flat_map(|(track, it)| (0..it.segments.len()).map(move |segment| (track, segment)))
        .collect();
    let per = |candidate: &Candidate| -> Vec<f64> {
        candidate.evaluation.errors.iter().map(|(sum, freedom)| sum / freedom).collect()
    };
    let (sizes_before, sizes_after) = (per(before), per(after));
    let ranked = |sizes: &[f64]| {
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_by(|&a, &b| sizes[b].total_cmp(&sizes[a]));
        order
    };
    let (by_before, by_after) = (ranked(&sizes_before), ranked(&sizes_after));
    let wanted = [
        (by_before.first(), "worst before"),
        (by_before.get(by_before.len() / 2), "typical"),
        (by_after.first(), "worst after"),
    ];
    wanted
        .into_iter()
        .filter_map(|(place, why)| place.map(|&place| (places[place], why)))
        .map(|((track, segment), why)| trace(session, before, after, track, segment, why))
        .collect()
}

/// A rollout with two on either side of it.
fn trace(
    session: &Session,
    before: &Candidate,
    after: &Candidate,
    index: usize,
    centre: usize,
    why: &str,
) -> RolloutTrace {
    let track = &session.held_out[index];
    let (first, last) = (centre.saturating_sub(2), (centre + 2).min(track.segments.len() - 1));
    let mut offset: usize = track.segments[..first].iter().map(|segment| segment.last - segment.first).sum();
    let mut samples = Vec::new();
    for segment in &track.segments[first..=last] {
        for k in segment.first..segment.last {
            let simulated = before.evaluation.rolled[index].readings[offset];
            let measured = track.angle[k];
            // All three on the turn of the rollout before.
            let turn = |angle: f64| if segment.whole { angle } else { simulated + wrap(angle - simulated) };
            samples.push(TraceSample {
                t_s: track.t[k],
                starts: k == segment.first,
                measured: (track.weight[k] > 0.0).then(|| turn(measured)),
                before: simulated,
                after: turn(after.evaluation.rolled[index].readings[offset]),
            });
            offset += 1;
        }
    }
    RolloutTrace { run: track.name.clone(), why: why.to_owned(), samples }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve over the frequency, 5 Hz a bin, with an error of 3 in one of them above a floor of 1.
    fn spectrum_with(peak: usize) -> MisfitCurve {
        let bin = |i: usize| MisfitBin {
            from: 5.0 * i as f64 + 2.5,
            to: 5.0 * i as f64 + 7.5,
            samples: 100,
            before: 3.0,
            after: if i == peak { 3.0 } else { 1.0 },
            bias_before: 0.0,
            bias_after: 0.0,
        };
        MisfitCurve { coordinate: spectrum::NAME.to_owned(), bins: (0..20).map(bin).collect() }
    }

    #[test]
    fn a_tone_is_a_place_and_a_slow_error_is_none() {
        let (_, tone) = concentration(&spectrum_with(9), 1.0).expect("a tone has a place");
        assert_eq!((tone.coordinate.as_str(), tone.from, tone.to), ("frequency_hz", 47.5, 52.5));
        assert!(concentration(&spectrum_with(0), 1.0).is_none());
    }
}
