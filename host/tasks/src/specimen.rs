//! The robot of an episode: the file's, or one drawn from its spreads.

use hal_sim::body::Plan;
use hal_sim::random::{Source, Stream};
use sweep::{Axis, Factor, Variant, VariantBuilder};

use super::error::TaskError;

/// Tables and quantities that are randomised where nothing else is said: friction, payload, eccentric, motor, supply, sensor, and the effects of
/// the file. The feet's and the backbones' laws are left out: their ranges are what is thinkable of any such robot, from 100 to 20 000 N/m
/// for example, not what differs from one to the next of a kind.
pub const RANDOMIZED: [&str; 8] = [
    "ground.friction",
    "body.courier.mass_kg",
    "eccentric.mass_kg",
    "motor",
    "supply",
    "sensor.electrical_angle_deg",
    "sensor.hysteresis_deg",
    "effects",
];

/// What differs from one episode's robot to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Randomization {
    /// Share of each spread: 0 is the file's value, 1 uniformly from `low` to `high`.
    pub share: f64,
    /// Dotted paths of quantities, or of tables of them.
    pub paths: Vec<String>,
}

impl Default for Randomization {
    /// Every robot is the file's.
    fn default() -> Self {
        Self { share: 0.0, paths: RANDOMIZED.map(str::to_owned).into() }
    }
}

impl Randomization {
    pub(crate) fn check(&self) -> Result<(), TaskError> {
        if (0.0..=1.0).contains(&self.share) {
            return Ok(());
        }
        let problem = format!("{} is no share of a spread", self.share);
        Err(TaskError::definition("randomize", problem, "give a number from 0 to 1"))
    }
}

/// Draws the robots of episodes.
#[derive(Debug)]
pub(crate) struct Specimens {
    builder: VariantBuilder,
    axes: Vec<Axis>,
    /// Value, and the ends of what is drawn, of each of `axes`.
    ranges: Vec<[f64; 2]>,
    nominal: Variant,
}

impl Specimens {
    pub fn new(
        builder: VariantBuilder,
        alpha_deg: Option<f64>,
        randomization: &Randomization,
    ) -> Result<Self, TaskError> {
        let axis = |what| Axis { what, values: vec![] };
        let (mut axes, mut ranges): (Vec<Axis>, Vec<[f64; 2]>) = Default::default();
        if let Some(alpha) = alpha_deg {
            axes.push(axis(Factor::Alpha));
            ranges.push([alpha, alpha]);
        }
        let values: Vec<f64> = ranges.iter().map(|[low, _]| *low).collect();
        // A robot without a body is no matter of the values that it was brought to.
        Plan::new(builder.robot())?;
        let nominal = builder.variant(&axes, &values)?;
        if randomization.share > 0.0 {
            for path in &randomization.paths {
                let within =
                    |known: &str| known.strip_prefix(path).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
                let mut found = false;
                for (known, quantity) in builder.quantities().iter().filter(|(known, _)| within(known)) {
                    found = true;
                    let end = |end: f64| quantity.value + randomization.share * (end - quantity.value);
                    if quantity.low < quantity.high {
                        axes.push(axis(Factor::Quantity(known.clone())));
                        ranges.push([end(quantity.low), end(quantity.high)]);
                    }
                }
                // The default's may be missing: a robot on another motor or sensor.
                if !found && !super::RANDOMIZED.contains(&path.as_str()) {
                    let problem = format!("`{}` has no `{path}`", builder.robot().name);
                    let help = "name a quantity of the robot file, e.g. ground.friction, or a table of it, e.g. motor";
                    return Err(TaskError::definition("randomized", problem, help));
                }
            }
        }
        Ok(Self { builder, axes, ranges, nominal })
    }

    /// The robot as the file has it.
    pub fn nominal(&self) -> &Variant {
        &self.nominal
    }

    /// Whether every robot is the file's.
    pub fn is_nominal(&self) -> bool {
        self.ranges.iter().all(|[low, high]| low == high)
    }

    /// The stream that draws an episode's robot.
    pub fn stream(seed: u64) -> Stream {
        Stream::new(seed, Source::Variation)
    }

    /// The next robot of a stream.
    pub fn draw(&self, stream: &mut Stream) -> Result<Variant, TaskError> {
        if self.is_nominal() {
            return Ok(self.nominal.clone());
        }
        let values: Vec<f64> = self.ranges.iter().map(|[low, high]| stream.uniform(*low, *high)).collect();
        Ok(self.builder.variant(&self.axes, &values)?)
    }
}
