//! The arc in which the codes do not follow the shaft, and the gap in it.

use std::f64::consts::TAU;

use serde::Serialize;

use super::curve::Curve;
use super::phase::{Ramp, Reading};
use common::{median, wrap};

/// Width of a bin, rad.
const BIN: f64 = 2.0 * TAU / 360.0;
/// A bin whose scatter is this many times the typical one does not follow the shaft.
const SCATTER: f64 = 5.0;
/// A bin may be this far from the nominal curve of sensor and converter, rad.
const FARTHEST: f64 = 45.0 * TAU / 360.0;
/// Between neighbouring bins the deviation from the nominal curve changes by less than this share of a bin; where a code
/// is held, by a whole one.
const HELD: f64 = 0.8;
/// Share of clipped codes from which a bin counts as clipped. Spikes are rarer.
const CLIPPED: f64 = 0.25;

/// Angles where the codes follow the shaft: from `from` counter-clockwise to `to`, rad, `from < to < from + 2π`, in the
/// frame of the ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reliable {
    pub from: f64,
    pub to: f64,
}

impl Reliable {
    /// Whether an angle (any turn) lies in it.
    pub fn contains(&self, angle: f64) -> bool {
        (angle - self.from).rem_euclid(TAU) <= self.to - self.from
    }

    /// Smaller at both ends, rad.
    pub fn shrunk(&self, lower: f64, upper: f64) -> Self {
        Self { from: self.from + lower, to: self.to - upper }
    }
}

/// Finds where the codes follow. `None` when no arc is reliable or all is.
pub(super) fn reliable(readings: &[Reading], ramp: &Ramp, top_code: f64) -> Option<Reliable> {
    let count = (TAU / BIN).round() as usize;
    let mut bins: Vec<(Vec<f64>, usize)> = vec![(Vec::new(), 0); count];
    for reading in readings {
        let angle = ramp.angle(reading.t).rem_euclid(TAU);
        let bin = &mut bins[((angle / TAU * count as f64) as usize).min(count - 1)];
        bin.0.push(wrap(reading.nominal - angle));
        if reading.code <= 0.0 || reading.code >= top_code {
            bin.1 += 1;
        }
    }
    let scatters: Vec<(f64, f64)> = bins
        .iter()
        .map(|(deviations, _)| {
            let center = median(&mut deviations.clone()).unwrap_or(f64::NAN);
            let mut around: Vec<f64> = deviations.iter().map(|d| (d - center).abs()).collect();
            (center, median(&mut around).unwrap_or(f64::NAN))
        })
        .collect();
    let mut known: Vec<f64> = scatters.iter().map(|s| s.1).filter(|s| s.is_finite()).collect();
    let typical = median(&mut known).map_or(0.1 * BIN, |typical| typical.max(0.1 * BIN));
    // Some(false): garbage; None: no sample there (a turn may be a whole number of samples).
    let follows: Vec<Option<bool>> = bins
        .iter()
        .zip(&scatters)
        .enumerate()
        .map(|(n, ((deviations, clipped), &(center, scatter)))| {
            if deviations.is_empty() {
                return None;
            }
            let clipped = *clipped as f64 >= CLIPPED * deviations.len() as f64;
            // Two bins on: noise counts less, and NaN (no sample there) compares false.
            let two_on = scatters[(n + 2) % count].0;
            let held = (two_on - center).abs() > 2.0 * HELD * BIN && !two_on.is_nan();
            Some(!clipped && !held && scatter < SCATTER * typical && center.abs() < FARTHEST)
        })
        .collect();
    longest(&follows)
}

/// The longest stretch on the circle of bins without garbage that begins and ends on a bin that follows.
fn longest(follows: &[Option<bool>]) -> Option<Reliable> {
    let count = follows.len();
    let start = follows.iter().position(|&f| f == Some(false))?;
    let (mut best, mut run): ((usize, usize), Option<(usize, usize)>) = ((0, 0), None);
    for step in 1..=count {
        match follows[(start + step) % count] {
            Some(true) => {
                run = Some(run.map_or((start + step, start + step + 1), |(from, _)| (from, start + step + 1)))
            }
            Some(false) => {
                if let Some((from, to)) = run.take()
                    && to - from > best.1 - best.0
                {
                    best = (from, to);
                }
            }
            None => {}
        }
    }
    let width = TAU / count as f64;
    (best.1 - best.0 > count / 3).then_some(Reliable { from: best.0 as f64 * width, to: best.1 as f64 * width })
}

/// Takes angles off both ends where a fit with a few harmonics cannot follow the converter's bends: as long as the mean
/// residual of the outermost `step` is larger than `tolerance` and than noise (`sigma` a sample) explains, at most `most`;
/// rad.
pub(super) fn trimmed(
    reliable: Reliable,
    residuals: &[(f64, f64)],
    sigma: f64,
    (step, tolerance, most): (f64, f64, f64),
) -> Reliable {
    let off = |end_distance: &dyn Fn(f64) -> f64| {
        let steps = (most / step).round() as usize;
        let bad = (0..steps).rev().find(|&n| {
            let mut values: Vec<f64> = residuals
                .iter()
                .filter(|&&(angle, _)| {
                    let distance = end_distance(angle);
                    distance >= n as f64 * step && distance < (n + 1) as f64 * step
                })
                .map(|&(_, residual)| residual)
                .collect();
            let error = 1.25 * sigma / (values.len().max(1) as f64).sqrt();
            values.len() >= 5 && median(&mut values).is_some_and(|middle| middle.abs() > tolerance.max(4.0 * error))
        });
        bad.map_or(0.0, |n| (n + 1) as f64 * step)
    };
    let lower = off(&|angle| (angle - reliable.from).rem_euclid(TAU));
    let upper = off(&|angle| (reliable.to - angle).rem_euclid(TAU));
    reliable.shrunk(lower, upper)
}

/// What the wiper showed in its gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GapBehaviour {
    /// Held the last voltage.
    Hold,
    /// Uncorrelated codes over the full scale: the input floats.
    Random,
    /// Code 0: a resistor pulls the input to ground.
    Zero,
    /// Held or pulled to zero: turning this way the codes are the same.
    HoldOrZero,
}

/// What the absolute zero was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ZeroSource {
    /// The jump of the code at an end of the gap.
    Gap(GapBehaviour),
    /// The nominal line of potentiometer and converter.
    NominalLine,
}

impl ZeroSource {
    /// Phrase for the report.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Gap(GapBehaviour::Hold) => "the gap's edge (the open wiper holds its voltage)",
            Self::Gap(GapBehaviour::Random) => "the gap's edges (the open wiper shows anything)",
            Self::Gap(GapBehaviour::Zero) => "the gap's edge (the open wiper is pulled to zero)",
            Self::Gap(GapBehaviour::HoldOrZero) => "the gap's edge",
            Self::NominalLine => "the nominal line of sensor and converter (no edge of the gap was seen)",
        }
    }
}

/// Where the gap's middle is in the frame of the ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Zero {
    /// Angle of the gap's middle, rad.
    pub angle: f64,
    /// Standard uncertainty in the frame of the ramp, rad.
    pub uncertainty: f64,
    pub source: ZeroSource,
}

/// Angle of the nominal curve against the fitted one: the constant of constant + two harmonics over the reliable arc,
/// so that the linearity error itself does not count. rad to subtract from fitted angles.
pub(super) fn line_zero(curve: &Curve, reliable: Reliable, codes: &[(f64, f64)]) -> Option<f64> {
    let inside: Vec<(f64, f64)> = codes
        .iter()
        .map(|&(code, nominal)| (nominal, wrap(curve.angle(code) - nominal), curve.angle(code)))
        .filter(|&(_, _, angle)| reliable.contains(angle))
        .map(|(nominal, difference, _)| (nominal, difference))
        .collect();
    let mut design = nalgebra::DMatrix::zeros(inside.len(), 5);
    for (row, &(angle, _)) in inside.iter().enumerate() {
        let (sin, cos) = angle.sin_cos();
        let (sin2, cos2) = (2.0 * angle).sin_cos();
        for (column, value) in [1.0, cos, sin, cos2, sin2].into_iter().enumerate() {
            design[(row, column)] = value;
        }
    }
    let right = nalgebra::DVector::from_iterator(inside.len(), inside.iter().map(|p| p.1));
    let normal = design.transpose() * &design;
    Some(normal.cholesky()?.solve(&(design.transpose() * right))[0])
}

/// Finds the gap's middle from the codes' jumps between full scale and zero. `expected` is where the nominal line puts
/// it, `gap` the gap's width, `slack` how far the line may be off; all rad, in the frame of the ramp.
pub(super) fn gap_middle(
    readings: &[Reading],
    ramp: &Ramp,
    top_code: f64,
    (expected, gap, slack): (f64, f64, f64),
) -> Option<Zero> {
    let direction = ramp.speed(ramp.center).signum();
    // Progress through the arc in the direction of rotation, 0 where the gap's middle is expected.
    let reach = 0.5 * gap + slack;
    let mut passed: Vec<(f64, Level)> = readings
        .iter()
        .map(|r| (direction * wrap(ramp.angle(r.t) - expected), Level::of(r.code, top_code)))
        .filter(|(progress, _)| progress.abs() < reach)
        .collect();
    if passed.len() < 20 {
        return None;
    }
    passed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (before, after) = if direction > 0.0 { (Level::Full, Level::Zero) } else { (Level::Zero, Level::Full) };
    let entry = change(&passed, |level| level == before)?;
    let exit = change(&passed, |level| level != after)?;
    let one_jump = (exit.at - entry.at).abs() < 0.25 * gap;
    let (middle, uncertainty, behaviour) = if one_jump {
        let jump = if entry.width < exit.width { entry } else { exit };
        let (early, late) = (jump.at + 0.5 * gap, jump.at - 0.5 * gap);
        // Turning into the gap from the track's upper end, a pulled-down wiper jumps at once, a held one when it
        // leaves. The other way round both jump where the upper end begins.
        if direction < 0.0 {
            (late, jump.width, GapBehaviour::HoldOrZero)
        } else if early.abs() < late.abs() {
            (early, jump.width, GapBehaviour::Zero)
        } else {
            (late, jump.width, GapBehaviour::Hold)
        }
    } else if (exit.at - entry.at - gap).abs() < 0.25 * gap {
        (0.5 * (entry.at + exit.at), 0.5 * (entry.width + exit.width), GapBehaviour::Random)
    } else {
        // Held and drifted out of the clipped range: only leaving the gap is sharp.
        (exit.at - 0.5 * gap, exit.width, GapBehaviour::Hold)
    };
    (middle.abs() < slack).then(|| Zero {
        angle: expected + direction * middle,
        uncertainty: uncertainty / 12_f64.sqrt(),
        source: ZeroSource::Gap(behaviour),
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Zero,
    Between,
    Full,
}

impl Level {
    fn of(code: f64, top_code: f64) -> Self {
        if code <= 0.02 * top_code {
            Self::Zero
        } else if code >= 0.98 * top_code {
            Self::Full
        } else {
            Self::Between
        }
    }
}

/// A change found between two samples.
#[derive(Clone, Copy, Debug)]
struct Change {
    at: f64,
    width: f64,
}

/// The angle that best separates samples for which `first` holds (before) from the others (after); `None` when more than
/// a tenth is on the wrong side.
fn change(passed: &[(f64, Level)], first: impl Fn(Level) -> bool) -> Option<Change> {
    let mut wrong = passed.iter().filter(|p| first(p.1)).count();
    let (mut least, mut span) = (usize::MAX, (0, 0));
    for (n, sample) in passed.iter().enumerate() {
        // `n` samples before the cut.
        if wrong < least {
            (least, span) = (wrong, (n, n));
        } else if wrong == least {
            span.1 = n;
        }
        if first(sample.1) { wrong -= 1 } else { wrong += 1 }
    }
    if least * 10 > passed.len() || span.0 == 0 || span.1 + 1 >= passed.len() {
        return None;
    }
    let (from, to) = (passed[span.0 - 1].0, passed[span.1].0);
    Some(Change { at: 0.5 * (from + to), width: to - from })
}
