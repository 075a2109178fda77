//! Means and spreads over the repeats, and the thesis's figures of merit: error (5.1), sensitivity (5.2),
//! effectiveness (5.3).

use serde::Serialize;

use super::axis::Factor;
use super::campaign::Run;
use super::design::{Design, MORE_FRICTION};
use super::measure::Measures;

/// A speed below this share of the largest of its kind has no sensitivity: a change over nearly nothing says nothing.
pub const SENSITIVITY_FLOOR: f64 = 0.05;

/// The three speeds of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// Along the robot's first heading.
    Longitudinal,
    /// To the left of it.
    Lateral,
    /// Counter-clockwise.
    Rotational,
}

impl Component {
    /// In the thesis's order.
    pub const ALL: [Self; 3] = [Self::Longitudinal, Self::Lateral, Self::Rotational];

    /// Name for titles and legends.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Longitudinal => "Longitudinal",
            Self::Lateral => "Lateral",
            Self::Rotational => "Rotational",
        }
    }

    /// Unit of the speed.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Longitudinal | Self::Lateral => "mm/s",
            Self::Rotational => "°/s",
        }
    }

    /// Of a run.
    #[must_use]
    pub fn of(self, measures: &Measures) -> Option<f64> {
        match self {
            Self::Longitudinal => measures.vx,
            Self::Lateral => measures.vy,
            Self::Rotational => measures.yaw,
        }
    }
}

/// Mean over the repeats, and how far they spread.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct Stat {
    /// None where no repeat has the number.
    pub mean: Option<f64>,
    /// Standard deviation of the sample; none for fewer than two.
    pub spread: Option<f64>,
}

impl Stat {
    /// Of some numbers; what is missing takes no part.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Self {
        let values: Vec<f64> = values.into_iter().flatten().collect();
        let count = values.len() as f64;
        if values.is_empty() {
            return Self::default();
        }
        let mean = values.iter().sum::<f64>() / count;
        let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self { mean: Some(mean), spread: (values.len() > 1).then(|| (square / (count - 1.0)).sqrt()) }
    }
}

/// What a condition gave, over its repeats.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// A value for every axis.
    pub point: Vec<f64>,
    /// Every repeat.
    pub repeats: Vec<Measures>,
}

impl Condition {
    /// Of one of the speeds.
    #[must_use]
    pub fn speed(&self, component: Component) -> Stat {
        self.stat(|measures| component.of(measures))
    }

    /// Of anything measured.
    pub fn stat(&self, of: impl Fn(&Measures) -> Option<f64>) -> Stat {
        Stat::of(self.repeats.iter().map(of))
    }
}

/// The conditions of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Conditions {
    /// What the points' values are of.
    pub axes: Vec<Factor>,
    /// In the design's order.
    pub conditions: Vec<Condition>,
}

impl Conditions {
    /// Of the runs of a design.
    #[must_use]
    pub fn new(design: &Design, runs: &[Run]) -> Self {
        let axes = design.axes.iter().map(|axis| axis.what.clone()).collect();
        let mut conditions: Vec<Condition> =
            design.points.iter().map(|point| Condition { point: point.clone(), repeats: Vec::new() }).collect();
        for run in runs {
            conditions[run.point].repeats.push(run.measures);
        }
        Self { axes, conditions }
    }

    /// The conditions at one factor on the friction, without that axis. All of them where it is not varied.
    #[must_use]
    pub fn at_friction(&self, factor: f64) -> Self {
        let Some(position) = self.axes.iter().position(|axis| *axis == Factor::FrictionFactor) else {
            return self.clone();
        };
        let without = |condition: &Condition| {
            let mut condition = condition.clone();
            condition.point.remove(position);
            condition
        };
        let mut axes = self.axes.clone();
        axes.remove(position);
        let here = self.conditions.iter().filter(|condition| condition.point[position] == factor);
        Self { axes, conditions: here.map(without).collect() }
    }

    /// How far runs and robots scatter in a speed, so many repeats in a row being of one robot.
    #[must_use]
    pub fn scatter(&self, component: Component, runs_a_robot: usize) -> Option<Scatter> {
        let repeats = |one: &Condition| one.repeats.iter().map(|measures| component.of(measures)).collect();
        Scatter::new(&self.conditions.iter().map(repeats).collect::<Vec<_>>(), runs_a_robot)
    }

    /// Means of a speed, in order.
    #[must_use]
    pub fn means(&self, component: Component) -> Vec<Option<f64>> {
        self.conditions.iter().map(|condition| condition.speed(component).mean).collect()
    }

    /// Effectiveness and sensitivity of a speed, where the friction is varied.
    #[must_use]
    pub fn robustness(&self, component: Component) -> Option<Robustness> {
        self.axes.contains(&Factor::FrictionFactor).then(|| {
            let nominal = self.at_friction(1.0).means(component);
            Robustness::new(&nominal, &self.at_friction(MORE_FRICTION).means(component))
        })
    }
}

/// How far runs scatter, and robots: one-way analysis of variance, pooled over the conditions, as shares of the largest mean speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scatter {
    /// Standard deviation between runs of one robot.
    pub runs: f64,
    /// Standard deviation between robots beyond that; none of one robot.
    pub robots: Option<f64>,
}

impl Scatter {
    /// Of the repeats of every condition, so many in a row being of one robot. None where a robot has one run.
    #[must_use]
    pub fn new(conditions: &[Vec<Option<f64>>], runs_a_robot: usize) -> Option<Self> {
        let largest = conditions.iter().filter_map(|repeats| Stat::of(repeats.iter().copied()).mean);
        let largest = largest.fold(0.0_f64, |largest, mean| largest.max(mean.abs()));
        let (mut within, mut between) = ((0.0, 0.0), (0.0, 0.0));
        for repeats in conditions {
            let robots: Vec<Vec<f64>> =
                repeats.chunks(runs_a_robot).filter_map(|runs| runs.iter().copied().collect()).collect();
            let means: Vec<f64> = robots.iter().map(|runs| runs.iter().sum::<f64>() / runs.len() as f64).collect();
            let mean = means.iter().sum::<f64>() / means.len().max(1) as f64;
            for (runs, own) in robots.iter().zip(&means) {
                within.0 += runs.iter().map(|run| (run - own).powi(2)).sum::<f64>();
                within.1 += runs.len() as f64 - 1.0;
                between.0 += (own - mean).powi(2);
            }
            between.1 += means.len().max(1) as f64 - 1.0;
        }
        if within.1 <= 0.0 || largest <= 0.0 {
            return None;
        }
        let within = within.0 / within.1;
        // A robot's mean scatters with its runs, too.
        let robots =
            |(sum, freedom): (f64, f64)| (sum / freedom - within / runs_a_robot as f64).max(0.0).sqrt() / largest;
        Some(Self {
            runs: within.sqrt() / largest,
            robots: Some(between).filter(|(_, freedom)| *freedom > 0.0).map(robots),
        })
    }
}

/// Thesis (5.1): `ε = (V_sim − V_exp) / max|V_exp|`, in percent.
#[must_use]
pub fn error_percent(simulated: f64, measured: f64, largest_measured: f64) -> Option<f64> {
    (largest_measured > 0.0).then(|| 100.0 * (simulated - measured) / largest_measured)
}

/// Thesis (5.2) and (5.3) over the conditions of one speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robustness {
    /// `σ = |(V_f − V_i) / V_i|`. None where a speed is missing or where `|V_i|` is below [`SENSITIVITY_FLOOR`] of the
    /// largest: such a cell takes no part in the largest σ.
    pub sensitivity: Vec<Option<f64>>,
    /// `φ = |V| (1 − σ/σ_max)`; 0 for a cell below the floor, which hardly moves; none where the speed is missing.
    pub effectiveness: Vec<Option<f64>>,
}

impl Robustness {
    /// Of speeds at nominal friction and at more.
    #[must_use]
    pub fn new(nominal: &[Option<f64>], more: &[Option<f64>]) -> Self {
        let largest = nominal.iter().flatten().fold(0.0_f64, |largest, v| largest.max(v.abs()));
        let above = |v: f64| v.abs() >= SENSITIVITY_FLOOR * largest && v != 0.0;
        let sigma = |(before, after): (&Option<f64>, &Option<f64>)| {
            let (before, after) = ((*before)?, (*after)?);
            above(before).then(|| ((after - before) / before).abs())
        };
        let sensitivity: Vec<Option<f64>> = nominal.iter().zip(more).map(sigma).collect();
        let most = sensitivity.iter().flatten().fold(0.0_f64, |most, sigma| most.max(*sigma));
        let phi = |((before, after), sigma): ((&Option<f64>, &Option<f64>), &Option<f64>)| {
            let (before, _) = ((*before)?, (*after)?);
            Some(sigma.map_or(0.0, |sigma| before.abs() * if most > 0.0 { 1.0 - sigma / most } else { 1.0 }))
        };
        let effectiveness = nominal.iter().zip(more).zip(&sensitivity).map(phi).collect();
        Self { sensitivity, effectiveness }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Option<f64>, b: f64) -> bool {
        a.is_some_and(|a| (a - b).abs() < 1e-12)
    }

    #[test]
    fn mean_and_spread_of_three() {
        let stat = Stat::of([Some(1.0), Some(2.0), Some(6.0)]);
        assert!(close(stat.mean, 3.0) && close(stat.spread, 7.0_f64.sqrt()));
        assert_eq!(Stat::of([Some(4.0), None]), Stat { mean: Some(4.0), spread: None });
        assert_eq!(Stat::of([None, None]), Stat::default(), "no number is made up");
    }

    #[test]
    fn runs_scatter_apart_from_robots() {
        // Robots at 10 ± 2 and 20 ± 2 (two runs each): within 2² · 2, between the means 50, less half of 8.
        let one = vec![Some(8.0), Some(12.0), Some(18.0), Some(22.0)];
        let found = Scatter::new(std::slice::from_ref(&one), 2).unwrap();
        assert!((found.runs - 8f64.sqrt() / 15.0).abs() < 1e-12, "{found:?}");
        assert!((found.robots.unwrap() - 46f64.sqrt() / 15.0).abs() < 1e-12, "{found:?}");
        assert_eq!(Scatter::new(std::slice::from_ref(&one), 1), None, "a run a robot");
        assert_eq!(Scatter::new(&[one[..2].to_vec()], 2).unwrap().robots, None, "one robot");
    }

    #[test]
    fn error_by_hand() {
        // Largest measured speed 20 mm/s, 12 simulated where 15 were measured: −3/20.
        assert_eq!(error_percent(12.0, 15.0, 20.0), Some(-15.0));
        assert_eq!(error_percent(-1.0, -2.0, 4.0), Some(25.0));
        assert_eq!(error_percent(1.0, 0.0, 0.0), None);
    }

    #[test]
    fn sensitivity_and_effectiveness_by_hand() {
        // 10 → 9 is 10 %, −4 → −6 is 50 % (the largest), 0.4 lies under the floor of 5 % of 10, 8 → 8 does not change.
        let nominal = [Some(10.0), Some(-4.0), Some(0.4), Some(8.0), None];
        let more = [Some(9.0), Some(-6.0), Some(4.0), Some(8.0), Some(1.0)];
        let found = Robustness::new(&nominal, &more);
        assert!(
            close(found.sensitivity[0], 0.1) && close(found.sensitivity[1], 0.5) && close(found.sensitivity[3], 0.0)
        );
        assert_eq!((found.sensitivity[2], found.sensitivity[4]), (None, None));
        assert!(close(found.effectiveness[0], 10.0 * (1.0 - 0.2)), "{found:?}");
        assert!(close(found.effectiveness[1], 0.0) && close(found.effectiveness[3], 8.0));
        assert_eq!((found.effectiveness[2], found.effectiveness[4]), (Some(0.0), None));
    }

    #[test]
    fn at_the_floor_itself_there_is_a_sensitivity() {
        let found = Robustness::new(&[Some(100.0), Some(5.0), Some(4.999)], &[Some(100.0), Some(6.0), Some(5.0)]);
        assert!(close(found.sensitivity[1], 0.2));
        assert_eq!(found.sensitivity[2], None);
        let still = Robustness::new(&[Some(0.0), Some(0.0)], &[Some(0.0), Some(1.0)]);
        assert_eq!(still.effectiveness, [Some(0.0), Some(0.0)], "no division by nothing");
    }
}
