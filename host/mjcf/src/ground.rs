//! The ground: a plane, or boxes where there are steps or patches.

use hal_sim::body::plan::Contact;

/// How far the boxes reach in front, behind and aside, m.
const REACH: f64 = 10.0;

/// A stretch of ground across the whole width.
#[derive(Debug, PartialEq)]
pub(super) struct Stretch {
    /// From and to along x, m.
    pub x: [f64; 2],
    /// Of the surface, m.
    pub height: f64,
    /// Coefficient.
    pub friction: f64,
}

impl Stretch {
    /// Of a box that reaches down to the same depth everywhere: half lengths.
    pub(super) fn half_size(&self, depth: f64) -> [f64; 3] {
        [0.5 * (self.x[1] - self.x[0]), REACH, 0.5 * (self.height - depth)]
    }

    /// Of the same box: its centre.
    pub(super) fn centre(&self, depth: f64) -> [f64; 3] {
        [0.5 * (self.x[0] + self.x[1]), 0.0, 0.5 * (self.height + depth)]
    }
}

/// The stretches from rear to front; none for an even ground of one friction.
pub(super) fn stretches(contact: &Contact) -> Vec<Stretch> {
    if contact.steps.is_empty() && contact.patches.is_empty() {
        return Vec::new();
    }
    let mut edges: Vec<f64> = contact.steps.iter().chain(&contact.patches).map(|pair| pair[0]).collect();
    let outermost = |pick: fn(f64, f64) -> f64| edges.iter().copied().fold(0.0, pick);
    let ends = [outermost(f64::min) - REACH, outermost(f64::max) + REACH];
    edges.extend(ends);
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    let stretch = |pair: &[f64]| {
        let x = [pair[0], pair[1]];
        Stretch { x, height: contact.height(x[0]), friction: contact.patch_friction(x[0]) }
    };
    edges.windows(2).map(stretch).collect()
}

/// What the boxes reach down to, m: below the lowest surface, so that each has a body.
pub(super) fn depth(stretches: &[Stretch]) -> f64 {
    stretches.iter().map(|stretch| stretch.height).fold(0.0, f64::min) - 0.1
}
