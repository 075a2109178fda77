//! Ground that is not even, and friction that is not Coulomb's: foot by foot, where a robot file asks for it.

use super::plan::Contact;

/// Where a sphere meets the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// How deep the sphere is in the ground, m; negative above it.
    pub depth: f64,
    /// From the ground to the sphere, in the plane of x and z.
    pub normal: [f64; 2],
}

/// A stretch of ground across the whole width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// From and to along x, m.
    pub x: [f64; 2],
    /// Of the surface, m.
    pub height: f64,
    /// Coefficient.
    pub friction: f64,
}

impl Contact {
    /// The ground from rear to front between two places (m), cut where its height or its friction changes.
    #[must_use]
    pub fn stretches(&self, [from, to]: [f64; 2]) -> Vec<Stretch> {
        let changes = self.steps.iter().chain(&self.patches).map(|pair| pair[0]).filter(|x| from < *x && *x < to);
        let mut edges: Vec<f64> = changes.chain([from, to]).collect();
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let stretch = |pair: &[f64]| {
            let x = [pair[0], pair[1]];
            Stretch { x, height: self.height(x[0]), friction: self.patch_friction(x[0]) }
        };
        edges.windows(2).map(stretch).collect()
    }

    /// Where a sphere of this radius with its centre at `x`, `z` meets the ground: the nearest of treads and risers.
    #[must_use]
    pub fn meeting(&self, radius: f64, x: f64, z: f64) -> Meeting {
        let under = self.height(x);
        let tread = Meeting { depth: radius - (z - under), normal: [0.0, 1.0] };
        if z <= under {
            return tread;
        }
        let mut nearest = tread;
        let mut lower: f64 = 0.0;
        for &[edge, height] in &self.steps {
            // A riser, and the edge above it.
            let on_riser = z.clamp(lower.min(height), lower.max(height));
            let (dx, dz) = (x - edge, z - on_riser);
            let distance = dx.hypot(dz);
            if distance > 0.0 && radius - distance > nearest.depth {
                nearest = Meeting { depth: radius - distance, normal: [dx / distance, dz / distance] };
            }
            lower = height;
        }
        nearest
    }

    /// Height of the ground, m.
    #[must_use]
    pub fn height(&self, x: f64) -> f64 {
        last_before(&self.steps, x).unwrap_or(0.0)
    }

    /// Coefficient of friction at `x` by its patch alone: what a foot has at speed, under its nominal load.
    #[must_use]
    pub fn patch_friction(&self, x: f64) -> f64 {
        self.friction * last_before(&self.patches, x).unwrap_or(1.0)
    }

    /// Coefficient of friction under a foot at `x` that slides at `speed` (m/s) under `load` (N).
    #[must_use]
    pub fn coefficient(&self, x: f64, speed: f64, load: f64) -> f64 {
        self.patch_friction(x) * self.laws.friction_factor(speed, load)
    }
}

fn last_before(pairs: &[[f64; 2]], x: f64) -> Option<f64> {
    pairs.iter().rev().find(|pair| x >= pair[0]).map(|pair| pair[1])
}
