//! What the claims are judged on.

use hal_sim::body::Plan;

use super::{SWINGING_ALPHA, USUAL};
use crate::axis::Factor;
use crate::design::{ALPHAS, FREQUENCIES, MORE_FRICTION, USUAL_F_HZ};
use crate::measure::Measures;
use crate::table::{Component, Conditions, Robustness};

/// The conditions, and the effectiveness of the thesis's 24.
pub(super) struct Evidence<'a> {
    conditions: &'a Conditions,
    /// Of the robot, mm.
    pub length_mm: f64,
    /// (α, f) of the 24.
    places: Vec<(f64, f64)>,
    /// φ at the places, by component.
    effectiveness: [Vec<Option<f64>>; 3],
}

/// A condition of the claims' design.
#[derive(Clone, Copy)]
struct At {
    modules: f64,
    alpha: f64,
    f: f64,
    friction: f64,
    swing: f64,
}

impl<'a> Evidence<'a> {
    pub fn new(conditions: &'a Conditions, plan: &Plan) -> Self {
        let places: Vec<(f64, f64)> = ALPHAS.iter().flat_map(|alpha| FREQUENCIES.map(|f| (*alpha, f))).collect();
        let modules = plan.modules.iter().map(|module| module.size[0]);
        let length_mm = 1e3 * modules.chain(plan.backbones.iter().map(|backbone| backbone.length)).sum::<f64>();
        let mut evidence = Self { conditions, length_mm, places, effectiveness: Default::default() };
        evidence.effectiveness = Component::ALL.map(|component| {
            let means = |friction: f64| -> Vec<Option<f64>> {
                let at = |(alpha, f): &(f64, f64)| At { modules: USUAL, alpha: *alpha, f: *f, friction, swing: 0.0 };
                evidence.places.iter().map(|place| evidence.at(at(place), |m| component.of(m))).collect()
            };
            Robustness::new(&means(1.0), &means(MORE_FRICTION)).effectiveness
        });
        evidence
    }

    fn at(&self, at: At, of: impl Fn(&Measures) -> Option<f64>) -> Option<f64> {
        let wanted = |what: &Factor| match what {
            Factor::Modules => Some(at.modules),
            Factor::Alpha => Some(at.alpha),
            Factor::Frequency => Some(at.f),
            Factor::FrictionFactor => Some(at.friction),
            Factor::Swing => Some(at.swing),
            _ => None,
        };
        let wanted: Vec<Option<f64>> = self.conditions.axes.iter().map(wanted).collect();
        let here = |point: &[f64]| point.iter().zip(&wanted).all(|(value, wanted)| Some(*value) == *wanted);
        self.conditions.conditions.iter().find(|condition| here(&condition.point))?.stat(of).mean
    }

    /// Of a robot of so many modules at nominal friction.
    pub fn mean(&self, modules: f64, alpha: f64, f: f64, of: impl Fn(&Measures) -> Option<f64>) -> Option<f64> {
        self.at(At { modules, alpha, f, friction: 1.0, swing: 0.0 }, of)
    }

    /// Of the usual robot at nominal friction.
    pub fn usual(&self, alpha: f64, f: f64, of: impl Fn(&Measures) -> Option<f64>) -> Option<f64> {
        self.mean(USUAL, alpha, f, of)
    }

    /// Of the usual robot whose shaft swings.
    pub fn swinging(&self, swing: f64, of: impl Fn(&Measures) -> Option<f64>) -> Option<f64> {
        self.at(At { modules: USUAL, alpha: SWINGING_ALPHA, f: USUAL_F_HZ, friction: 1.0, swing }, of)
    }

    /// Mean effectiveness of the places that count.
    pub fn effectiveness(&self, component: Component, counts: impl Fn(f64, f64) -> bool) -> Option<f64> {
        let here = self.places.iter().zip(&self.effectiveness[component as usize]);
        mean(here.filter(|((alpha, f), _)| counts(*alpha, *f)).map(|(_, phi)| *phi))
    }

    /// Of the 24.
    pub fn largest_effectiveness(&self, component: Component) -> f64 {
        self.effectiveness[component as usize].iter().flatten().fold(0.0, |largest, phi| largest.max(*phi))
    }
}

/// Of all, if none is missing.
pub(super) fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values = values.collect::<Option<Vec<f64>>>()?;
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
