//! Which foot a simulated walk is wrong at: what each foot's friction alone would take away of the deviations.
//!
//! A score test (C. R. Rao, 1948) by the derivatives at the refit: the refitted numbers may follow, the other feet stay.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

use super::models::Screened;
use super::place::stands_out;

/// The effect whose numbers are a foot's each.
const FRICTION: &str = "foot_friction";

/// A foot, and what the speeds say of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FootPlace {
    /// As in the keys of `[effects.foot_friction]`: `left_1` is module 1's left one.
    pub foot: String,
    /// Share of the ground's friction with which the speeds fit best, all other feet as they are.
    pub share: f64,
    /// How many standard deviations that is from 1.
    pub deviations: f64,
    /// How probable such a share is, or one farther from 1, if nothing is wrong with this foot.
    pub probability: f64,
}

impl FootPlace {
    /// `left` or `right`, and the module's number.
    #[must_use]
    pub fn side_and_module(&self) -> (&str, &str) {
        self.foot.split_once('_').unwrap_or((&self.foot, ""))
    }
}

/// All feet that the speeds tell something of, the most suspicious first; `misfit` is what the file's model leaves in units of what the means
/// are known to, by which deviations are less telling where everything is wrong.
pub fn feet(screens: &[Screened], misfit: f64) -> Vec<FootPlace> {
    let Some(screen) = screens.iter().find(|one| one.effect.name() == FRICTION) else { return Vec::new() };
    let mut found: Vec<FootPlace> = screen
        .alone
        .iter()
        .map(|one| {
            let deviations = one.deviations / misfit.max(1.0);
            let key = one.path.rsplit('.').next().unwrap_or_default();
            FootPlace {
                foot: key.trim_end_matches("_share").to_owned(),
                share: one.value,
                deviations,
                probability: 2.0 * Normal::standard().sf(deviations.abs()),
            }
        })
        .collect();
    found.sort_by(|a, b| a.probability.total_cmp(&b.probability));
    found
}

/// The first of some feet, if it is more than an accident among as many.
pub fn pointed(feet: &[FootPlace]) -> Option<&FootPlace> {
    feet.first().filter(|first| stands_out(first.probability, feet.len()))
}
