//! By how much each claim holds: a share of what it compares, positive where it holds, `None` where a number is missing.

use super::evidence::{Evidence, mean};
use super::{LONGER, LONGER_AT_HZ, LOW_FREQUENCIES, Number, SWINGS_DEG, USUAL};
use crate::design::{ALPHAS, FREQUENCIES};
use crate::measure::Measures;
use crate::table::Component;

/// Share of the largest speed from which on a robot is said to go that way.
const GOES: f64 = 0.05;
/// Share of the speed at 8 Hz from which on a robot is said to walk.
const WALKS: f64 = 0.10;
/// Onset of locomotion that counts as "near 5 Hz".
const ONSET_HZ: [f64; 2] = [4.0, 6.0];
/// Ratio of the axes of a trace from which on it counts as nearly round.
const ROUND: f64 = 0.5;
/// A robot turns in place if a quarter turn moves its middle by less than this share of its length.
const IN_PLACE: f64 = 0.5;
/// A speed or a rate that is nothing.
const NOTHING: f64 = 1e-9;

/// Speed of the centroid over the ground.
fn planar(measures: &Measures) -> Option<f64> {
    Some(measures.vx?.hypot(measures.vy?))
}

fn note(numbers: &mut Vec<Number>, name: impl Into<String>, value: Option<f64>) -> Option<f64> {
    numbers.push(Number { name: name.into(), value });
    value
}

/// Several at once; all are noted, also where one is missing.
fn noted(numbers: &mut Vec<Number>, values: impl Iterator<Item = (String, Option<f64>)>) -> Option<Vec<f64>> {
    let values: Vec<Option<f64>> = values.map(|(name, value)| note(numbers, name, value)).collect();
    values.into_iter().collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(NOTHING, |largest, value| largest.max(value.abs()))
}

/// Least step from each of some values to the next, as a share of the largest.
fn least_rise(values: &[f64]) -> f64 {
    values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min) / largest(values)
}

pub(super) fn onset(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let frequencies = [LOW_FREQUENCIES.as_slice(), &FREQUENCIES[3..]].concat();
    let speed = |f: &f64| mean(ALPHAS.iter().map(|alpha| evidence.usual(*alpha, *f, planar)));
    let speeds = noted(numbers, frequencies.iter().map(|f| (format!("speed at {f} Hz, mm/s"), speed(f))))?;
    let bound = WALKS * speeds.last()?;
    let index = speeds.iter().position(|speed| *speed >= bound)?;
    if index == 0 {
        // It may have begun anywhere below the lowest frequency: how far its speed there is past the bound.
        note(numbers, format!("onset below {} Hz", frequencies[0]), None);
        return Some(-1.0 - speeds[0] / bound.max(NOTHING));
    }
    let (slow, fast) = (speeds[index - 1], speeds[index]);
    let onset = frequencies[index - 1] + (bound - slow) / (fast - slow) * (frequencies[index] - frequencies[index - 1]);
    note(numbers, "onset, Hz", Some(onset));
    Some((onset - ONSET_HZ[0]).min(ONSET_HZ[1] - onset))
}

pub(super) fn both_signs(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let mut found = Vec::new();
    for alpha in ALPHAS {
        for f in FREQUENCIES {
            found.push((evidence.usual(alpha, f, |m| m.vx)?, alpha, f));
        }
    }
    let ahead = found.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let back = found.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))?;
    for (name, (vx, alpha, f)) in [("largest", ahead), ("least", back)] {
        note(numbers, format!("{name} vx, mm/s, at {alpha}°, {f} Hz"), Some(vx));
    }
    Some(ahead.0.min(-back.0) / largest(&[ahead.0, back.0]) - GOES)
}

pub(super) fn turns(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let mut toward = Vec::new();
    for alpha in ALPHAS.into_iter().filter(|alpha| *alpha != 0.0) {
        for f in FREQUENCIES {
            let yaw = evidence.usual(alpha, f, |m| m.yaw)?;
            if yaw * f <= 0.0 {
                note(numbers, format!("yaw at {alpha}°, {f} Hz, °/s"), Some(yaw));
            }
            toward.push(yaw * f.signum());
        }
    }
    let right = toward.iter().filter(|yaw| **yaw > 0.0).count();
    note(numbers, format!("right way, of {}", toward.len()), Some(right as f64));
    note(numbers, "largest |yaw|, °/s", Some(largest(&toward)));
    Some(toward.iter().copied().fold(f64::INFINITY, f64::min) / largest(&toward))
}

pub(super) fn bias(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let mut margin = f64::INFINITY;
    for f in [7.0, 8.0] {
        let both = |alpha| mean([-f, f].into_iter().map(|f| Some(evidence.usual(alpha, f, |m| m.yaw)?.abs())));
        let biases = ALPHAS.iter().map(|alpha| (format!("|yaw| at {alpha}°, {f} Hz, °/s"), both(*alpha)));
        margin = margin.min(least_rise(&noted(numbers, biases)?));
    }
    Some(margin)
}

pub(super) fn round(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let ratio = |alpha| mean(FREQUENCIES.iter().map(|f| evidence.usual(alpha, *f, |m| m.roundness)));
    let ratios = noted(numbers, ALPHAS.iter().map(|alpha| (format!("roundness at {alpha}°"), ratio(*alpha))))?;
    let beyond = ratios[1..].iter().copied().fold(0.0, f64::max);
    Some((ratios[0] - ROUND).min(ratios[0] - beyond))
}

pub(super) fn lateral_frequency(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let phi = |magnitude: f64| evidence.effectiveness(Component::Lateral, |_, f| f.abs() == magnitude);
    let means = [6.0, 7.0, 8.0].into_iter().map(|magnitude| (format!("φ at {magnitude} Hz, mm/s"), phi(magnitude)));
    Some(least_rise(&noted(numbers, means)?))
}

/// Effectiveness over the six frequencies, by α.
fn by_alpha(evidence: &Evidence<'_>, component: Component, numbers: &mut Vec<Number>) -> Option<Vec<f64>> {
    let phi = |here: f64| evidence.effectiveness(component, |alpha, _| alpha == here);
    noted(numbers, ALPHAS.iter().map(|here| (format!("φ at {here}°, {}", component.unit()), phi(*here))))
}

pub(super) fn lateral_alpha(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let phi = by_alpha(evidence, Component::Lateral, numbers)?;
    Some((phi[2].min(phi[3]) - phi[0].max(phi[1])) / largest(&phi))
}

pub(super) fn rotation(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let phi = by_alpha(evidence, Component::Rotational, numbers)?;
    Some((phi[3] - phi[..3].iter().copied().fold(0.0, f64::max)) / largest(&phi))
}

pub(super) fn all_round(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let largest = Component::ALL.map(|component| evidence.largest_effectiveness(component));
    let mut scores = Vec::new();
    for alpha in ALPHAS {
        for magnitude in [6.0, 7.0, 8.0] {
            let part = |component: Component| {
                let phi = evidence.effectiveness(component, |a, f| a == alpha && f.abs() == magnitude)?;
                let largest = largest[component as usize];
                Some(if largest > 0.0 { phi / largest } else { 0.0 })
            };
            let score = Component::ALL.map(part).into_iter().collect::<Option<Vec<f64>>>()?.iter().sum::<f64>();
            scores.push((score, alpha, magnitude));
        }
    }
    let claimed = |(_, alpha, f): &(f64, f64, f64)| *alpha == 90.0 && *f == 7.0;
    let own = scores.iter().copied().find(claimed)?;
    let best = scores.iter().copied().filter(|one| !claimed(one)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    note(numbers, "score of 90°, 7 Hz, of 3", Some(own.0));
    note(numbers, format!("best of the others, at {}°, {} Hz", best.1, best.2), Some(best.0));
    Some((own.0 - best.0) / own.0.max(best.0).max(NOTHING))
}

pub(super) fn seven_to_eight(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let mut pairs = Vec::new();
    for f in [7.0, 8.0] {
        let phi = evidence.effectiveness(Component::Longitudinal, |alpha, here| alpha == 90.0 && here == f);
        let phi = note(numbers, format!("φ at +{f} Hz, mm/s"), phi);
        let speed = evidence.usual(90.0, f, |m| m.vx).map(f64::abs);
        let speed = note(numbers, format!("|vx| at +{f} Hz, mm/s"), speed);
        pairs.push(phi.zip(speed));
    }
    let pairs = pairs.into_iter().collect::<Option<Vec<(f64, f64)>>>()?;
    let falls = least_rise(&[pairs[1].0, pairs[0].0]);
    Some(falls.min(least_rise(&[pairs[0].1, pairs[1].1])))
}

pub(super) fn modules(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let of = |count: f64, what: fn(&Measures) -> Option<f64>| {
        let all = LONGER_AT_HZ.iter().flat_map(|f| [-f, *f]);
        mean(all.map(|f| evidence.mean(count, 90.0, f, what)))
    };
    let mut found = Vec::new();
    for count in [USUAL, LONGER[0], LONGER[1]] {
        let speed = note(numbers, format!("speed with {count}, mm/s"), of(count, planar));
        let yaw = note(numbers, format!("|yaw| with {count}, °/s"), of(count, |m| Some(m.yaw?.abs())));
        let (rear, front) = (of(count, |m| m.rear), of(count, |m| m.front));
        let share = rear.zip(front).map(|(rear, front)| rear / front.max(NOTHING));
        let share = note(numbers, format!("rear/front with {count}"), share);
        found.push(speed.zip(yaw).zip(share).map(|((speed, yaw), share)| (speed, yaw / speed.max(NOTHING), share)));
    }
    let found = found.into_iter().collect::<Option<Vec<_>>>()?;
    let (short, long) = (found[0], found[2]);
    let falls = |from: f64, to: f64| least_rise(&[to, from]);
    Some(falls(short.0, long.0).min(falls(long.1, short.1)).min(falls(short.2, long.2)))
}

pub(super) fn in_place(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<f64> {
    let mut margin = f64::INFINITY;
    let mut rates = Vec::new();
    for swing in SWINGS_DEG {
        let yaw = note(numbers, format!("yaw swinging to {swing:+}°, °/s"), evidence.swinging(swing, |m| m.yaw))?;
        let speed = note(numbers, format!("speed swinging to {swing:+}°, mm/s"), evidence.swinging(swing, planar))?;
        let way = note(numbers, "way of a quarter turn, mm", Some(90.0 * speed / yaw.abs().max(NOTHING)))?;
        let most = IN_PLACE * evidence.length_mm;
        // Between −1, a robot that only goes, and 1, one that only turns.
        margin = margin.min((most - way) / (most + way));
        rates.push(yaw);
    }
    // To opposite sides: the thesis does not say which way its angle counts.
    let opposed = rates.iter().map(|yaw| yaw.abs()).fold(f64::INFINITY, f64::min) / largest(&rates);
    Some(margin.min(if rates[0] * rates[1] < 0.0 { opposed } else { -opposed }))
}
