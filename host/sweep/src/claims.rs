//! The thesis's qualitative claims (chapters 2 and 5), each as a predicate on simulated speeds.
//!
//! Words leave room; what is counted as "holds" is fixed here, before looking. Speeds are means over the repeats.
//! Frequencies have the thesis's sign. Where a claim speaks of an α or an |f| and not of a direction, both directions
//! count alike. Ties within `TIE` count for the claim: a robot that is symmetric about its own plane gives 60° at f
//! what 120° gives at −f, so that the two cannot differ on the mean over both directions.

use serde::Serialize;

use super::axis::{Axis, Factor};
use super::design::{ALPHAS, Design, FREQUENCIES, MORE_FRICTION};
use super::measure::Measures;
use super::table::{Component, Conditions, Robustness};

/// Frequencies below the thesis's, where locomotion starts, Hz.
const LOW_FREQUENCIES: [f64; 3] = [3.0, 4.0, 5.0];
/// Modules of longer chains; the thesis's robot has 4.
const LONGER: [f64; 2] = [5.0, 6.0];
/// Modules of the thesis's robot.
const USUAL: f64 = 4.0;
/// |f| at which longer chains are compared, Hz; at α = 90°.
const LONGER_AT_HZ: [f64; 2] = [7.0, 8.0];
/// Relative difference up to which two numbers count as equal.
const TIE: f64 = 0.05;
/// Share of the largest yaw rate below which a robot goes straight.
const STRAIGHT: f64 = 0.05;
/// Share of the speed at 8 Hz from which on a robot is said to walk.
const WALKS: f64 = 0.10;
/// Onset of locomotion that counts as "near 5 Hz".
const ONSET_HZ: std::ops::RangeInclusive<f64> = 4.0..=6.0;
/// Ratio of the axes of a trace from which on it counts as nearly round.
const ROUND: f64 = 0.5;
/// Least share of the speed at 7 Hz at 8 Hz that counts as "the speed does not fall".
const NOT_SLOWER: f64 = 0.9;

/// Result of a claim.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClaimResult {
    /// Short name.
    pub claim: &'static str,
    /// What the thesis says, and where.
    pub thesis: &'static str,
    /// What counts as holding.
    pub holds_if: &'static str,
    /// What the simulation gives.
    pub numbers: Vec<Number>,
    /// None where a number is missing.
    pub holds: Option<bool>,
}

/// A number with its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Number {
    /// What it is, with its unit.
    pub name: String,
    /// None where it is missing.
    pub value: Option<f64>,
}

/// The runs that the claims speak of: the thesis's with nominal and more friction, slower ones, longer chains.
#[must_use]
pub fn design(seeds: Vec<u64>) -> Design {
    let values = |parts: &[&[f64]]| parts.concat();
    let longer_f: Vec<f64> = LONGER_AT_HZ.iter().flat_map(|f| [-f, *f]).collect();
    let axes = vec![
        Axis { what: Factor::Modules, values: values(&[&[USUAL], &LONGER]) },
        Axis { what: Factor::Alpha, values: ALPHAS.to_vec() },
        Axis { what: Factor::Frequency, values: values(&[&FREQUENCIES[..3], &LOW_FREQUENCIES, &FREQUENCIES[3..]]) },
        Axis { what: Factor::FrictionFactor, values: vec![1.0, MORE_FRICTION] },
    ];
    let mut points = Vec::new();
    for alpha in ALPHAS {
        for f in FREQUENCIES {
            points.extend([1.0, MORE_FRICTION].map(|factor| vec![USUAL, alpha, f, factor]));
        }
        points.extend(LOW_FREQUENCIES.map(|f| vec![USUAL, alpha, f, 1.0]));
    }
    for modules in LONGER {
        points.extend(longer_f.iter().map(|f| vec![modules, 90.0, *f, 1.0]));
    }
    Design { axes, points, seeds, runs_a_robot: 1 }
}

/// Judges every claim on the conditions of [`design`].
#[must_use]
pub fn evaluate(conditions: &Conditions) -> Vec<ClaimResult> {
    let evidence = Evidence::new(conditions);
    CLAIMS
        .iter()
        .map(|claim| {
            let mut numbers = Vec::new();
            let holds = (claim.evaluate)(&evidence, &mut numbers);
            ClaimResult { claim: claim.name, thesis: claim.thesis, holds_if: claim.holds_if, numbers, holds }
        })
        .collect()
}

/// Short names of the claims, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    CLAIMS.iter().map(|claim| claim.name)
}

struct Claim {
    name: &'static str,
    thesis: &'static str,
    holds_if: &'static str,
    /// Notes its numbers; `None` where one is missing.
    evaluate: fn(&Evidence<'_>, &mut Vec<Number>) -> Option<bool>,
}

const CLAIMS: &[Claim] = &[
    Claim {
        name: "onset",
        thesis: "locomotion starts near 5 Hz (5, 5.1)",
        holds_if: "the speed over the ground, mean of the four α, reaches 10 % of that at 8 Hz between 4 and 6 Hz \
                   (f > 0; linear between 3, 4, 5, 6, 7, 8 Hz)",
        evaluate: onset,
    },
    Claim {
        name: "turns",
        thesis: "with α ≠ 0 the robot turns left for positive and right for negative frequencies (5.1)",
        holds_if: "of the 18 conditions with α ≠ 0 none turns the other way at more than 5 % of the largest yaw rate, and \
                   at least 9 turn the right way at more than that",
        evaluate: turns,
    },
    Claim {
        name: "bias",
        thesis: "the turning bias grows with α at 7 and 8 Hz (5.1)",
        holds_if: "|yaw|, mean of both directions, does not fall by more than 5 % from 0 to 60 to 90 to 120°, and is \
                   larger at 120° than at 0, at 7 Hz and at 8 Hz",
        evaluate: bias,
    },
    Claim {
        name: "round",
        thesis: "nearly round foot traces at α = 0, elongated ones beyond (5.1)",
        holds_if: "short over long axis of the front feet's traces from above, less their drift, mean of the six \
                   frequencies: at least 0.5 at α = 0, and larger there than at 60, 90 and 120°",
        evaluate: round,
    },
    Claim {
        name: "lateral |f|",
        thesis: "lateral effectiveness grows with |f| (5.2)",
        holds_if: "φ of the lateral speed, mean of the four α and both directions, grows from 6 to 7 to 8 Hz",
        evaluate: lateral_frequency,
    },
    Claim {
        name: "lateral α",
        thesis: "lateral effectiveness is best at 90° and 120° (5.2)",
        holds_if: "φ of the lateral speed, mean of the six frequencies, at 90° and at 120° is nowhere more than 5 % below \
                   that at 0 and 60°",
        evaluate: lateral_alpha,
    },
    Claim {
        name: "rotation",
        thesis: "rotation is best at 120° (5.2)",
        holds_if: "φ of the yaw rate, mean of the six frequencies, at 120° is at most 5 % below that of any other α",
        evaluate: rotation,
    },
    Claim {
        name: "all-round",
        thesis: "90° at 7 Hz is the best all-round (5.2, 1.3)",
        holds_if: "the sum of the three φ, each over its largest, mean of both directions, is largest at 90° and 7 Hz",
        evaluate: all_round,
    },
    Claim {
        name: "7 to 8 Hz",
        thesis: "longitudinal effectiveness falls from 7 to 8 Hz at 90° though the speed does not (5.2)",
        holds_if: "at 90° φ of the longitudinal speed is smaller at +8 than at +7 Hz, and |vx| at +8 Hz is at least 90 % of \
                   that at +7 Hz",
        evaluate: seven_to_eight,
    },
    Claim {
        name: "modules",
        thesis: "more passive modules turn translation into rotation about the rear (2.4.3)",
        holds_if: "from 4 to 6 modules at 90°, mean of ±7 and ±8 Hz, the centroid's speed falls, |yaw| over it grows, and \
                   the last module's speed over the first's falls",
        evaluate: modules,
    },
];

/// The conditions, and the effectiveness of the thesis's 24.
struct Evidence<'a> {
    conditions: &'a Conditions,
    /// (α, f) of the 24.
    places: Vec<(f64, f64)>,
    /// φ at the places, by component.
    effectiveness: [Vec<Option<f64>>; 3],
}

impl<'a> Evidence<'a> {
    fn new(conditions: &'a Conditions) -> Self {
        let places: Vec<(f64, f64)> = ALPHAS.iter().flat_map(|alpha| FREQUENCIES.map(|f| (*alpha, f))).collect();
        let mut evidence = Self { conditions, places, effectiveness: Default::default() };
        evidence.effectiveness = Component::ALL.map(|component| {
            let means = |factor: f64| -> Vec<Option<f64>> {
                let here = |(alpha, f): &(f64, f64)| evidence.mean(USUAL, *alpha, *f, factor, |m| component.of(m));
                evidence.places.iter().map(here).collect()
            };
            Robustness::new(&means(1.0), &means(MORE_FRICTION)).effectiveness
        });
        evidence
    }

    fn mean(
        &self,
        modules: f64,
        alpha: f64,
        f: f64,
        factor: f64,
        of: impl Fn(&Measures) -> Option<f64>,
    ) -> Option<f64> {
        let wanted = |what: &Factor| match what {
            Factor::Modules => Some(modules),
            Factor::Alpha => Some(alpha),
            Factor::Frequency => Some(f),
            Factor::FrictionFactor => Some(factor),
            _ => None,
        };
        let wanted: Vec<Option<f64>> = self.conditions.axes.iter().map(wanted).collect();
        let here = |point: &[f64]| point.iter().zip(&wanted).all(|(value, wanted)| Some(*value) == *wanted);
        self.conditions.conditions.iter().find(|condition| here(&condition.point))?.stat(of).mean
    }

    /// Of the usual robot at nominal friction.
    fn usual(&self, alpha: f64, f: f64, of: impl Fn(&Measures) -> Option<f64>) -> Option<f64> {
        self.mean(USUAL, alpha, f, 1.0, of)
    }

    /// Mean effectiveness of the places that count.
    fn effectiveness(&self, component: Component, counts: impl Fn(f64, f64) -> bool) -> Option<f64> {
        let here = self.places.iter().zip(&self.effectiveness[component as usize]);
        mean(here.filter(|((alpha, f), _)| counts(*alpha, *f)).map(|(_, phi)| *phi))
    }
}

/// Of all, if none is missing.
fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values = values.collect::<Option<Vec<f64>>>()?;
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Speed of the centroid over the ground.
fn planar(measures: &Measures) -> Option<f64> {
    Some(measures.vx?.hypot(measures.vy?))
}

fn note(numbers: &mut Vec<Number>, name: impl Into<String>, value: Option<f64>) -> Option<f64> {
    numbers.push(Number { name: name.into(), value });
    value
}

fn onset(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let frequencies = [LOW_FREQUENCIES.as_slice(), &FREQUENCIES[3..]].concat();
    let mut speeds = Vec::new();
    for f in &frequencies {
        let speed = mean(ALPHAS.iter().map(|alpha| evidence.usual(*alpha, *f, planar)));
        speeds.push(note(numbers, format!("speed at {f} Hz, mm/s"), speed));
    }
    let speeds = speeds.into_iter().collect::<Option<Vec<f64>>>()?;
    let bound = WALKS * speeds.last()?;
    let index = speeds.iter().position(|speed| *speed >= bound)?;
    let onset = if index == 0 {
        frequencies[0]
    } else {
        let (slow, fast) = (speeds[index - 1], speeds[index]);
        frequencies[index - 1] + (bound - slow) / (fast - slow) * (frequencies[index] - frequencies[index - 1])
    };
    note(numbers, "onset, Hz", Some(onset));
    // From the lowest frequency on it may have begun anywhere below.
    Some(index > 0 && ONSET_HZ.contains(&onset))
}

fn turns(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let all = |alpha: &f64| FREQUENCIES.map(|f| (*alpha, f, evidence.usual(*alpha, f, |m| m.yaw)));
    let yaws: Vec<(f64, f64, Option<f64>)> = ALPHAS.iter().flat_map(all).collect();
    let largest = yaws.iter().filter_map(|(.., yaw)| *yaw).fold(0.0_f64, |largest, yaw| largest.max(yaw.abs()));
    let (mut right, mut wrong) = (0, 0);
    for (alpha, f, yaw) in yaws.iter().filter(|(alpha, ..)| *alpha != 0.0) {
        let toward = (*yaw)? * f.signum();
        right += i32::from(toward > STRAIGHT * largest);
        let against = toward < -STRAIGHT * largest;
        wrong += i32::from(against);
        if against {
            note(numbers, format!("yaw at {alpha}°, {f} Hz, °/s"), *yaw);
        }
    }
    note(numbers, "right way", Some(f64::from(right)));
    note(numbers, "wrong way", Some(f64::from(wrong)));
    note(numbers, "largest |yaw|, °/s", Some(largest));
    Some(wrong == 0 && right >= 9)
}

fn bias(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let mut holds = true;
    for f in [7.0, 8.0] {
        let mut biases = Vec::new();
        for alpha in ALPHAS {
            let both = mean([-f, f].into_iter().map(|f| Some(evidence.usual(alpha, f, |m| m.yaw)?.abs())));
            biases.push(note(numbers, format!("|yaw| at {alpha}°, {f} Hz, °/s"), both));
        }
        let biases = biases.into_iter().collect::<Option<Vec<f64>>>()?;
        holds &= biases.windows(2).all(|pair| pair[1] >= (1.0 - TIE) * pair[0]) && biases[3] > biases[0];
    }
    Some(holds)
}

fn round(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let mut ratios = Vec::new();
    for alpha in ALPHAS {
        let ratio = mean(FREQUENCIES.iter().map(|f| evidence.usual(alpha, *f, |m| m.roundness)));
        ratios.push(note(numbers, format!("roundness at {alpha}°"), ratio));
    }
    let ratios = ratios.into_iter().collect::<Option<Vec<f64>>>()?;
    Some(ratios[0] >= ROUND && ratios[1..].iter().all(|ratio| *ratio < ratios[0]))
}

fn lateral_frequency(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let mut means = Vec::new();
    for magnitude in [6.0, 7.0, 8.0] {
        let phi = evidence.effectiveness(Component::Lateral, |_, f| f.abs() == magnitude);
        means.push(note(numbers, format!("φ at {magnitude} Hz, mm/s"), phi));
    }
    let means = means.into_iter().collect::<Option<Vec<f64>>>()?;
    Some(means[0] < means[1] && means[1] < means[2])
}

/// Effectiveness over the six frequencies, by α.
fn by_alpha(evidence: &Evidence<'_>, component: Component, numbers: &mut Vec<Number>) -> Option<Vec<f64>> {
    let mut means = Vec::new();
    for here in ALPHAS {
        let phi = evidence.effectiveness(component, |alpha, _| alpha == here);
        means.push(note(numbers, format!("φ at {here}°, {}", component.unit()), phi));
    }
    means.into_iter().collect()
}

/// Not less than another by more than a tie.
fn matches(value: f64, other: f64) -> bool {
    value >= (1.0 - TIE) * other
}

fn lateral_alpha(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let phi = by_alpha(evidence, Component::Lateral, numbers)?;
    Some([2, 3].iter().all(|&best: &usize| matches(phi[best], phi[0]) && matches(phi[best], phi[1])))
}

fn rotation(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let phi = by_alpha(evidence, Component::Rotational, numbers)?;
    Some(phi[3] > 0.0 && phi.iter().all(|other| matches(phi[3], *other)))
}

fn all_round(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let largest = Component::ALL.map(|component| {
        evidence.effectiveness[component as usize].iter().flatten().fold(0.0_f64, |largest, phi| largest.max(*phi))
    });
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
    let best = scores.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let claimed = scores.iter().copied().find(|(_, alpha, f)| *alpha == 90.0 && *f == 7.0)?;
    note(numbers, "score of 90°, 7 Hz, of 3", Some(claimed.0));
    note(numbers, format!("best score, at {}°, {} Hz", best.1, best.2), Some(best.0));
    Some(claimed.0 >= best.0 && claimed.0 > 0.0)
}

fn seven_to_eight(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let mut pairs = Vec::new();
    for f in [7.0, 8.0] {
        let phi = evidence.effectiveness(Component::Longitudinal, |alpha, here| alpha == 90.0 && here == f);
        let phi = note(numbers, format!("φ at +{f} Hz, mm/s"), phi);
        let speed = evidence.usual(90.0, f, |m| m.vx).map(f64::abs);
        let speed = note(numbers, format!("|vx| at +{f} Hz, mm/s"), speed);
        pairs.push(phi.zip(speed));
    }
    let pairs = pairs.into_iter().collect::<Option<Vec<(f64, f64)>>>()?;
    Some(pairs[1].0 < pairs[0].0 && pairs[1].1 >= NOT_SLOWER * pairs[0].1)
}

fn modules(evidence: &Evidence<'_>, numbers: &mut Vec<Number>) -> Option<bool> {
    let of = |count: f64, what: fn(&Measures) -> Option<f64>| {
        let all = LONGER_AT_HZ.iter().flat_map(|f| [-f, *f]);
        mean(all.map(|f| evidence.mean(count, 90.0, f, 1.0, what)))
    };
    let mut found = Vec::new();
    for count in [USUAL, LONGER[0], LONGER[1]] {
        let speed = note(numbers, format!("speed with {count}, mm/s"), of(count, planar));
        let yaw = note(numbers, format!("|yaw| with {count}, °/s"), of(count, |m| Some(m.yaw?.abs())));
        let (rear, front) = (of(count, |m| m.rear), of(count, |m| m.front));
        let share = rear.zip(front).map(|(rear, front)| rear / front.max(1e-9));
        let share = note(numbers, format!("rear/front with {count}"), share);
        found.push(speed.zip(yaw).zip(share).map(|((speed, yaw), share)| (speed, yaw, share)));
    }
    let found = found.into_iter().collect::<Option<Vec<_>>>()?;
    let (short, long) = (found[0], found[2]);
    let turning = |(speed, yaw, _): (f64, f64, f64)| yaw / speed.max(1e-9);
    Some(long.0 < short.0 && turning(long) > turning(short) && long.2 < short.2)
}

#[cfg(test)]
#[path = "claims_tests.rs"]
mod tests;
