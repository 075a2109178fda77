//! The body in its nominal pose as rigid parts between triples of hinges.

use hal_sim::body::Plan;

/// What moves as one: a segment of a backbone, a module, or a module with the last segment in front of it.
pub(super) struct Part {
    /// A segment's backbone, its number in it, and where its box is along x, m.
    pub segment: Option<Segment>,
    /// A module's number.
    pub module: Option<usize>,
}

/// A segment's box.
pub(super) struct Segment {
    pub backbone: usize,
    pub number: usize,
    /// Of the box's centre, m.
    pub x: f64,
    /// Length along the chain, m.
    pub length: f64,
}

/// A triple of hinges at one point.
pub(super) struct Triple {
    pub backbone: usize,
    pub number: usize,
    /// Position along the chain, m.
    pub x: f64,
}

/// Parts from front to rear; `triples[i]` joins `parts[i]` and `parts[i + 1]`.
pub(super) struct Chain {
    pub parts: Vec<Part>,
    pub triples: Vec<Triple>,
    /// Of the modules' centres along x, m.
    pub modules: Vec<f64>,
    /// Of the modules' centres over the ground, m.
    pub height: f64,
}

impl Chain {
    pub(super) fn new(plan: &Plan) -> Self {
        let mut modules = vec![0.0];
        for k in 0..plan.backbones.len() {
            modules.push(modules[k] - plan.pitch(k));
        }
        let mut parts = vec![Part { segment: None, module: Some(0) }];
        let mut triples = Vec::new();
        for (b, backbone) in plan.backbones.iter().enumerate() {
            let front = modules[b] - 0.5 * plan.modules[b].size[0];
            let length = backbone.length / backbone.segments as f64;
            for i in 0..backbone.segments {
                let x = front - i as f64 * length;
                triples.push(Triple { backbone: b, number: i, x });
                let segment = Segment { backbone: b, number: i, x: x - 0.5 * length, length };
                let module = (i + 1 == backbone.segments).then_some(b + 1);
                parts.push(Part { segment: Some(segment), module });
            }
        }
        // Of all modules alike: backbones lie on one line.
        let height = plan.modules[0].centre_height;
        Self { parts, triples, modules, height }
    }

    /// The part that holds a module.
    pub(super) fn part_of(&self, module: usize) -> usize {
        self.parts.iter().position(|part| part.module == Some(module)).unwrap_or(0)
    }
}
