//! The ground: a plane, or boxes where there are steps or patches.

use hal_sim::body::Stretch;
use hal_sim::body::plan::Contact;

/// How far the boxes reach in front, behind and aside, m.
const REACH: f64 = 10.0;

/// Of a box that reaches down to the same depth everywhere: half lengths.
pub(super) fn half_size(stretch: &Stretch, depth: f64) -> [f64; 3] {
    [0.5 * (stretch.x[1] - stretch.x[0]), REACH, 0.5 * (stretch.height - depth)]
}

/// Of the same box: its centre.
pub(super) fn centre(stretch: &Stretch, depth: f64) -> [f64; 3] {
    [0.5 * (stretch.x[0] + stretch.x[1]), 0.0, 0.5 * (stretch.height + depth)]
}

/// The stretches from rear to front; none for an even ground of one friction.
pub(super) fn stretches(contact: &Contact) -> Vec<Stretch> {
    if contact.steps.is_empty() && contact.patches.is_empty() {
        return Vec::new();
    }
    let edges = || contact.steps.iter().chain(&contact.patches).map(|pair| pair[0]);
    contact.stretches([edges().fold(0.0, f64::min) - REACH, edges().fold(0.0, f64::max) + REACH])
}

/// What the boxes reach down to, m: below the lowest surface, so that each has a body.
pub(super) fn depth(stretches: &[Stretch]) -> f64 {
    stretches.iter().map(|stretch| stretch.height).fold(0.0, f64::min) - 0.1
}
