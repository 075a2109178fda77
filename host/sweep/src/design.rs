//! Which runs a sweep has, in a fixed order.

use hal_sim::random::Seeds;

use super::axis::{Axis, Factor};

/// The thesis's frequencies, Hz, positive clockwise.
pub const FREQUENCIES: [f64; 6] = [-8.0, -7.0, -6.0, 6.0, 7.0, 8.0];
/// The thesis's α, degrees.
pub const ALPHAS: [f64; 4] = [0.0, 60.0, 90.0, 120.0];
/// How much more friction the thesis's section 5.2 tries.
pub const MORE_FRICTION: f64 = 1.1;
/// Frequency where none is varied, Hz.
pub const USUAL_F_HZ: f64 = 7.0;
/// More runs than this are a slip of the finger.
pub const MOST_RUNS: usize = 1_000_000;

/// What a sweep runs: points in the space of its axes, each with every seed. So many seeds in a row are runs of one robot: what belongs to a
/// robot and not to a run, as its sensor's error, is drawn from the first of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// What is varied.
    pub axes: Vec<Axis>,
    /// A value for every axis.
    pub points: Vec<Vec<f64>>,
    /// Repeats.
    pub seeds: Vec<u64>,
    /// Of which so many in a row are of one robot.
    pub runs_a_robot: usize,
}

impl Design {
    /// Every combination, the last axis running fastest.
    #[must_use]
    pub fn product(axes: Vec<Axis>, seeds: Vec<u64>) -> Self {
        let mut points = vec![Vec::new()];
        for axis in &axes {
            let longer = |point: &Vec<f64>| {
                let point = point.clone();
                axis.values.iter().map(move |value| [point.as_slice(), &[*value]].concat()).collect::<Vec<_>>()
            };
            points = points.iter().flat_map(longer).collect();
        }
        Self { axes, points, seeds, runs_a_robot: 1 }
    }

    /// The same with so many seeds in a row for every robot.
    #[must_use]
    pub fn with_runs_a_robot(self, runs_a_robot: usize) -> Self {
        Self { runs_a_robot: runs_a_robot.max(1), ..self }
    }

    /// How many combinations there are, without making them.
    #[must_use]
    pub fn count(axes: &[Axis], repeats: usize) -> usize {
        axes.iter().map(|axis| axis.values.len()).fold(repeats, usize::saturating_mul)
    }

    /// The thesis's axes.
    #[must_use]
    pub fn thesis() -> Vec<Axis> {
        vec![
            Axis { what: Factor::Alpha, values: ALPHAS.to_vec() },
            Axis { what: Factor::Frequency, values: FREQUENCIES.to_vec() },
        ]
    }

    /// With nominal and more friction.
    #[must_use]
    pub fn friction_axis() -> Axis {
        Axis { what: Factor::FrictionFactor, values: vec![1.0, MORE_FRICTION] }
    }

    /// Runs: points times seeds.
    #[must_use]
    pub fn runs(&self) -> usize {
        self.points.len() * self.seeds.len()
    }

    /// Index of the point of a run.
    #[must_use]
    pub fn point(&self, index: usize) -> usize {
        index / self.seeds.len()
    }

    /// The seeds of a run: of its robot, and its own.
    #[must_use]
    pub fn seeds_of(&self, index: usize) -> Seeds {
        let repeat = index % self.seeds.len();
        Seeds { specimen: self.seeds[repeat - repeat % self.runs_a_robot], run: self.seeds[repeat] }
    }

    /// Where an axis stands.
    #[must_use]
    pub fn position(&self, what: &Factor) -> Option<usize> {
        self.axes.iter().position(|axis| axis.what == *what)
    }

    /// The frequency at a point, Hz, positive clockwise.
    #[must_use]
    pub fn frequency(&self, point: &[f64]) -> f64 {
        self.position(&Factor::Frequency).map_or(USUAL_F_HZ, |index| point[index])
    }

    /// Where the shaft swings to from 0 at a point, degrees; 0 where it turns.
    #[must_use]
    pub fn swing(&self, point: &[f64]) -> f64 {
        self.position(&Factor::Swing).map_or(0.0, |index| point[index])
    }
}
