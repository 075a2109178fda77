//! The thesis's qualitative claims (chapters 2 and 5), each as a margin over simulated speeds.
//!
//! Words leave room; what is counted as "holds" is fixed here, before looking. Speeds are means over the repeats.
//! Frequencies have the thesis's sign. Where a claim speaks of an α or an |f| and not of a direction, both directions
//! count alike. Every claim has a margin, and holds where that is positive: a tie does not count for it. So a robot that is symmetric
//! about its own plane, which gives at 60° and f what it gives at 120° and −f, cannot hold what is said to grow from 60° to 120°.

mod evidence;
mod margins;

use hal_sim::body::Plan;
use serde::Serialize;

use super::axis::{Axis, Factor};
use super::design::{ALPHAS, Design, FREQUENCIES, MORE_FRICTION, USUAL_F_HZ};
use super::table::Conditions;
use evidence::Evidence;

/// Frequencies below the thesis's, where locomotion starts, Hz.
const LOW_FREQUENCIES: [f64; 3] = [3.0, 4.0, 5.0];
/// Modules of longer chains; the thesis's robot has 4.
const LONGER: [f64; 2] = [5.0, 6.0];
/// Modules of the thesis's robot.
const USUAL: f64 = 4.0;
/// |f| at which longer chains are compared, Hz; at α = 90°.
const LONGER_AT_HZ: [f64; 2] = [7.0, 8.0];
/// Where the shaft swings to from 0, degrees, where the robot is to turn in place, ...
const SWINGS_DEG: [f64; 2] = [100.0, -100.0];
/// ... at this α, that of the thesis's figure 5.4.
const SWINGING_ALPHA: f64 = 90.0;

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
    /// By how much, as a share of what is compared; none where a number is missing.
    pub margin: Option<f64>,
    /// Whether that is more than nothing.
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

/// The runs that the claims speak of: the thesis's with nominal and more friction, slower ones, longer chains, and a shaft that swings.
#[must_use]
pub fn design(seeds: Vec<u64>) -> Design {
    let longer_f: Vec<f64> = LONGER_AT_HZ.iter().flat_map(|f| [-f, *f]).collect();
    let axes = vec![
        Axis { what: Factor::Modules, values: [&[USUAL], LONGER.as_slice()].concat() },
        Axis { what: Factor::Alpha, values: ALPHAS.to_vec() },
        Axis { what: Factor::Frequency, values: [&FREQUENCIES[..3], &LOW_FREQUENCIES, &FREQUENCIES[3..]].concat() },
        Axis { what: Factor::FrictionFactor, values: vec![1.0, MORE_FRICTION] },
        Axis { what: Factor::Swing, values: [&[0.0], SWINGS_DEG.as_slice()].concat() },
    ];
    let mut points = Vec::new();
    for alpha in ALPHAS {
        for f in FREQUENCIES {
            points.extend([1.0, MORE_FRICTION].map(|factor| vec![USUAL, alpha, f, factor, 0.0]));
        }
        points.extend(LOW_FREQUENCIES.map(|f| vec![USUAL, alpha, f, 1.0, 0.0]));
    }
    for modules in LONGER {
        points.extend(longer_f.iter().map(|f| vec![modules, 90.0, *f, 1.0, 0.0]));
    }
    points.extend(SWINGS_DEG.map(|swing| vec![USUAL, SWINGING_ALPHA, USUAL_F_HZ, 1.0, swing]));
    Design { axes, points, seeds, runs_a_robot: 1 }
}

/// Judges every claim on the conditions of [`design`], of a robot with this body.
#[must_use]
pub fn evaluate(conditions: &Conditions, plan: &Plan) -> Vec<ClaimResult> {
    let evidence = Evidence::new(conditions, plan);
    CLAIMS
        .iter()
        .map(|claim| {
            let mut numbers = Vec::new();
            let margin = (claim.margin)(&evidence, &mut numbers);
            let holds = margin.map(|margin| margin > 0.0);
            ClaimResult { claim: claim.name, thesis: claim.thesis, holds_if: claim.holds_if, numbers, margin, holds }
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
    margin: fn(&Evidence<'_>, &mut Vec<Number>) -> Option<f64>,
}

const CLAIMS: &[Claim] = &[
    Claim {
        name: "onset",
        thesis: "locomotion starts near 5 Hz (5, 5.1)",
        holds_if: "the speed over the ground, mean of the four α, reaches 10 % of that at 8 Hz between 4 and 6 Hz \
                   (f > 0; linear between 3, 4, 5, 6, 7, 8 Hz)",
        margin: margins::onset,
    },
    Claim {
        name: "both signs",
        thesis: "longitudinal speeds of both signs occur (5.1)",
        holds_if: "of the 24 conditions one goes ahead and one back, each at more than 5 % of the largest |vx|",
        margin: margins::both_signs,
    },
    Claim {
        name: "turns",
        thesis: "with α ≠ 0 the robot turns left for positive and right for negative frequencies (5.1)",
        holds_if: "all 18 conditions with α ≠ 0 turn the right way",
        margin: margins::turns,
    },
    Claim {
        name: "bias",
        thesis: "the turning bias grows with α at 7 and 8 Hz (5.1)",
        holds_if: "|yaw|, mean of both directions, grows from 0 to 60 to 90 to 120°, at 7 Hz and at 8 Hz",
        margin: margins::bias,
    },
    Claim {
        name: "round",
        thesis: "nearly round foot traces at α = 0, elongated ones beyond (5.1)",
        holds_if: "short over long axis of the front feet's traces from above, less their drift, mean of the six \
                   frequencies: more than 0.5 at α = 0, and larger there than at 60, 90 and 120°",
        margin: margins::round,
    },
    Claim {
        name: "lateral |f|",
        thesis: "lateral effectiveness grows with |f| (5.2)",
        holds_if: "φ of the lateral speed, mean of the four α and both directions, grows from 6 to 7 to 8 Hz",
        margin: margins::lateral_frequency,
    },
    Claim {
        name: "lateral α",
        thesis: "lateral effectiveness is best at 90° and 120° (5.2)",
        holds_if: "φ of the lateral speed, mean of the six frequencies, is larger at 90° and at 120° than at 0 and at 60°",
        margin: margins::lateral_alpha,
    },
    Claim {
        name: "rotation",
        thesis: "rotation is best at 120° (5.2)",
        holds_if: "φ of the yaw rate, mean of the six frequencies, is larger at 120° than at any other α",
        margin: margins::rotation,
    },
    Claim {
        name: "all-round",
        thesis: "90° at 7 Hz is the best all-round (5.2, 1.3)",
        holds_if: "the sum of the three φ, each over its largest, mean of both directions, is largest at 90° and 7 Hz",
        margin: margins::all_round,
    },
    Claim {
        name: "7 to 8 Hz",
        thesis: "longitudinal effectiveness falls from 7 to 8 Hz at 90° though the speed does not (5.2)",
        holds_if: "at 90° φ of the longitudinal speed is smaller at +8 than at +7 Hz, and |vx| is larger",
        margin: margins::seven_to_eight,
    },
    Claim {
        name: "modules",
        thesis: "more passive modules turn translation into rotation about the rear (2.4.3)",
        holds_if: "from 4 to 6 modules at 90°, mean of ±7 and ±8 Hz, the centroid's speed falls, |yaw| over it grows, and \
                   the last module's speed over the first's falls",
        margin: margins::modules,
    },
    Claim {
        name: "in place",
        thesis: "a mass that swings to +100° turns the robot clockwise in place, one that swings to −100° counter-clockwise (5.3.3)",
        holds_if: "at 90° a swing between 0 and +100° turns the robot one way and one between 0 and −100° the other, and a \
                   quarter turn moves its middle by less than half its length",
        margin: margins::in_place,
    },
];

#[cfg(test)]
mod tests;
