//! `[design]`.

use serde::{Deserialize, Serialize};

use super::super::LearnError;
use super::{key, positive};

/// Within which bounds designs are looked for, and how long each is trained (thesis 6.2 wishes for it; all of it is chosen).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DesignSettings {
    /// Designs that are tried, the file's own first.
    pub designs: usize,
    /// Bounds of α, degrees. A robot with −α is the mirror image of one with α: it turns right as that one turns left.
    pub alpha_deg: [f64; 2],
    /// How far a backbone's roll may be from its multiple of α, degrees.
    pub roll_off_deg: f64,
    /// Bounds of the number of modules.
    pub modules: [usize; 2],
    /// Bounds of the eccentric's mass times radius, shares of the file's; its mass changes.
    pub eccentric_share: [f64; 2],
    /// Updates of each design's training, told by `[turn]` and `[ppo]`.
    pub updates: usize,
    /// F of the signals by which it walks straight, Hz.
    pub frequency_hz: f64,
    /// Between two changes of that signal, s: t₁ and t₂ of (5.3) are multiples of it.
    pub interval_s: f64,
    /// Intervals for which +F and −F are held, of which every pair is tried.
    pub held: Vec<usize>,
    /// How long every pair is tried, s.
    pub episode_s: f64,
}

impl Default for DesignSettings {
    fn default() -> Self {
        Self {
            designs: 40,
            alpha_deg: [-120.0, 120.0],
            roll_off_deg: 30.0,
            modules: [3, 5],
            eccentric_share: [0.6, 1.4],
            updates: 20,
            frequency_hz: 8.0,
            interval_s: 0.1,
            held: vec![1, 2, 5],
            episode_s: 10.0,
        }
    }
}

impl DesignSettings {
    /// Checks what the robot file and the environments do not.
    ///
    /// # Errors
    /// The key that is out of its range, with what is expected.
    pub fn check(&self) -> Result<(), LearnError> {
        let ordered = |[low, high]: [f64; 2]| low.is_finite() && high.is_finite() && low <= high;
        key("design.designs", self.designs > 0, "a whole number above 0")?;
        key("design.alpha_deg", ordered(self.alpha_deg), "two numbers, the lower one first")?;
        key("design.roll_off_deg", self.roll_off_deg >= 0.0 && self.roll_off_deg <= 180.0, "0 to 180")?;
        let [fewest, most] = self.modules;
        key(
            "design.modules",
            2 <= fewest && fewest <= most && most <= 64,
            "two whole numbers of 2 to 64, the lower one first",
        )?;
        let share = self.eccentric_share;
        key("design.eccentric_share", ordered(share) && share[0] > 0.0, "two numbers above 0, the lower one first")?;
        key("design.updates", self.updates > 0, "a whole number above 0")?;
        key("design.held", !self.held.is_empty() && !self.held.contains(&0), "one whole number above 0 or more")?;
        positive("design.frequency_hz", self.frequency_hz)
    }
}
