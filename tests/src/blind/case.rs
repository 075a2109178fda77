//! From a seed to a data set: draws the specimen, the sensor, the excitations and what is hidden, and scales the hidden
//! effect until the independent measure says that it is as visible as the seed wants.

use super::beside;
use super::excite::{self, FIT_RUNS, PLAN};
use super::files::{self, Decimals, Paths, Run, Units};
use super::hidden::{Effect, Shape};
use super::measure::{self, Linear, Size};
use super::mistake::Mistake;
use super::rig::{Rig, RigError};
use super::run::simulate;
use super::sensing::Sensor;
use super::setting::Setting;
use super::world::{Drive, World};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;

/// Which of the bars a data set belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Category {
    /// One effect of the library is hidden.
    Hidden,
    /// Nothing is hidden, the parameters are wrong.
    Nothing,
    /// Something outside the library is hidden.
    Outside,
    /// One more is hidden beside the effects that the robot file lists.
    Beside,
    /// One effect of the library is hidden, and hardly to be seen.
    Weak,
    /// Two effects of the library are hidden.
    Two,
    /// Nothing is hidden, and the files hold a mistake.
    Mistaken,
}

impl Category {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Hidden, Self::Weak, Self::Nothing, Self::Two, Self::Outside, Self::Beside, Self::Mistaken];

    /// As the command line spells it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Hidden => "hidden",
            Self::Weak => "weak",
            Self::Nothing => "nothing",
            Self::Two => "two",
            Self::Outside => "outside",
            Self::Beside => "beside",
            Self::Mistaken => "mistaken",
        }
    }

    /// The category of a word.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|category| category.word() == word)
    }

    /// What a campaign's data set of a seed is recorded with.
    #[must_use]
    pub fn setting(self, seed: u64) -> Setting {
        Setting::drawn(seed.wrapping_mul(8).wrapping_add(self as u64))
    }

    /// Bounds of the hidden effects' misfit over the noise floor, in the generator's own rollouts on held-out runs.
    #[must_use]
    pub fn ratio(self) -> (f64, f64) {
        match self {
            Self::Weak => (1.03, 1.2),
            // Clearly there, not grotesque.
            Self::Outside => (2.5, 8.0),
            _ => (1.5, 6.0),
        }
    }
}

/// A data set with its secret.
#[derive(Clone, Debug)]
pub struct Case {
    /// The seed.
    pub seed: u64,
    /// The category.
    pub category: Category,
    /// What is hidden, with its size in the units of [`Shape::apply`].
    pub effects: Vec<(Effect, f64)>,
    /// What is wrong with the files.
    pub mistake: Option<Mistake>,
    /// The misfit over the floor that the seed wanted; NaN beside known effects, which the linear measure
    /// sees as well.
    pub target: f64,
    /// What the independent measure says of the finished data set.
    pub size: Size,
    /// The true world.
    pub world: World,
    /// The true sensor.
    pub sensor: Sensor,
    /// What it was recorded with.
    pub setting: Setting,
    /// The six runs, [`FIT_RUNS`] to fit first.
    pub runs: Vec<Run>,
    /// The robot file's text that goes with them.
    pub robot_file: String,
}

/// A data set before its effect is scaled.
#[derive(Clone)]
struct Draft {
    mistake: Option<Mistake>,
    world: World,
    sensor: Sensor,
    shapes: [Shape; 2],
    drives: Vec<Vec<Drive>>,
    per_s: f64,
    starts: Vec<f64>,
    noise_seed: u64,
    linear: Linear,
}

impl Draft {
    fn runs(&self, effects: &[(Effect, f64)]) -> (Vec<Run>, World, Sensor) {
        let (mut world, mut sensor) = (self.world.clone(), self.sensor.clone());
        for ((effect, scale), shape) in effects.iter().zip(&self.shapes) {
            shape.apply(*effect, *scale, &mut world, &mut sensor);
        }
        let runs = (0..self.drives.len())
            .into_par_iter()
            .map(|n| {
                // The same noise at every size, so that the search sees the size alone.
                let mut rng = Pcg64::seed_from_u64(self.noise_seed.wrapping_add(n as u64));
                simulate(&world, &sensor, &self.drives[n], self.per_s, self.starts[n], &mut rng)
            })
            .collect();
        (runs, world, sensor)
    }

    fn size(&self, effect: Effect, scale: f64) -> Size {
        measure::size(&self.runs(&[(effect, scale)]).0, FIT_RUNS, self.linear)
    }

    /// Scales an effect to a ratio: the excess over the floor grows about as the size does, so steps of that rule
    /// first, bisection when they leave the bracket. `None` where the effect cannot be that visible.
    fn scale_to(&self, effect: Effect, target: f64) -> Option<f64> {
        let excess = |ratio: f64| (ratio * ratio - 1.0).max(1e-4).sqrt();
        let (mut low, mut high) = effect.bounds();
        let mut scale: f64 = 1f64.clamp(low, high);
        for _ in 0..24 {
            let ratio = self.size(effect, scale).ratio();
            if (ratio / target - 1.0).abs() < 0.02 {
                return Some(scale);
            }
            let (bottom, top) = effect.bounds();
            if ratio < target {
                if scale >= top {
                    return None;
                }
                low = scale;
            } else {
                if scale <= bottom {
                    // As small as it may be and still more visible than wanted: take it.
                    return Some(bottom);
                }
                high = scale;
            }
            let next = scale * (excess(target) / excess(ratio)).clamp(0.05, 20.0);
            scale = if next > low && next < high {
                next
            } else if next >= high && high >= top {
                top
            } else if next <= low && low <= bottom {
                bottom
            } else {
                (low * high).sqrt()
            };
        }
        None
    }
}

/// Draws the data set of a seed. `only` hides that effect instead of the one that the seed draws.
///
/// # Errors
/// The robot file lacks a number, or that effect cannot be made as visible as wanted.
pub fn draw(seed: u64, category: Category, only: Option<Effect>, robot_file: &str) -> Result<Case, RigError> {
    draw_with(seed, category, only, robot_file, &Setting::default())
}

/// The same in another setting.
///
/// # Errors
/// As [`draw`].
pub fn draw_with(
    seed: u64,
    category: Category,
    only: Option<Effect>,
    robot_file: &str,
    setting: &Setting,
) -> Result<Case, RigError> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(4).wrapping_add(category as u64));
    let draft = draft(seed, category, robot_file, setting, &mut rng)?;
    let ratio = setting.ratio.unwrap_or(category.ratio());
    let (effects, target) = match category {
        Category::Nothing | Category::Mistaken => (Vec::new(), 1.0),
        Category::Beside => {
            let drawn = beside::EFFECTS[rng.random_range(0..beside::EFFECTS.len())];
            let effect = only.unwrap_or(drawn);
            let (low, high) = beside::sizes(effect);
            (vec![(effect, rng.random_range(low..high))], f64::NAN)
        }
        Category::Hidden | Category::Weak | Category::Two | Category::Outside => {
            let among = if category == Category::Outside { Effect::outside() } else { Effect::library() };
            let (effect, scale, target) = choose(&draft, &mut rng, among, only, ratio)?;
            let mut effects = vec![(effect, scale)];
            if category == Category::Two {
                effects.push(second(&draft, &mut rng, effect, target)?);
            }
            (effects, target)
        }
    };
    let (runs, world, sensor) = draft.runs(&effects);
    let size = measure::size(&runs, FIT_RUNS, draft.linear);
    let mistake = draft.mistake;
    let robot_file = mistake.map_or(Ok(robot_file.to_owned()), |made| made.robot_file(robot_file))?;
    Ok(Case { seed, category, effects, mistake, target, size, world, sensor, setting: *setting, runs, robot_file })
}

/// Everything but what is hidden.
fn draft(
    seed: u64,
    category: Category,
    robot_file: &str,
    setting: &Setting,
    rng: &mut Pcg64,
) -> Result<Draft, RigError> {
    let mut rig = Rig::nominal(robot_file)?.specimen(setting.file_off, rng);
    let mut sensor = Sensor::draw(rng);
    sensor.kind = setting.noise;
    sensor.bits = setting.bits.unwrap_or(sensor.bits);
    let mut mistake = None;
    if category == Category::Mistaken {
        let made = Mistake::of(seed, sensor.bits, robot_file, rng)?;
        rig = made.rig(rig, robot_file)?;
        sensor.wrapped &= made.can_be_wrapped(&rig, setting.per_s);
        mistake = Some(made);
    }
    let mut world = World::linear(rig);
    let mut drives: Vec<Vec<Drive>> = PLAN
        .iter()
        .map(|plan| {
            let plan: Vec<_> = plan.iter().map(|&(kind, seconds)| (kind, seconds * setting.share)).collect();
            excite::run(&plan, setting.per_s, rng)
        })
        .collect();
    let starts = PLAN.iter().map(|_| rng.random_range(-3.1..3.1)).collect();
    let mut shape = Shape::draw(rng);
    shape.law = setting.law;
    let noise_seed: u64 = rng.random();
    if category == Category::Beside {
        beside::furnish(robot_file, &mut world, &mut sensor, &shape, rng)?;
        drives.iter_mut().for_each(|drives| beside::lift(drives, &world));
    }
    let stiffness = rig.torque_constant * rig.torque_constant / rig.resistance_ohm;
    let linear = Linear {
        driven: (stiffness + rig.viscous) / rig.inertia_kg_m2,
        open: rig.viscous / rig.inertia_kg_m2,
        gain: 0.0,
    };
    // Of the second of two effects; from another stream, so that one effect's data sets do not depend on there being two.
    let mut other = Shape::draw(&mut Pcg64::seed_from_u64(noise_seed ^ 0x2));
    other.law = setting.law;
    Ok(Draft {
        mistake,
        world,
        sensor,
        shapes: [shape, other],
        drives,
        per_s: setting.per_s,
        starts,
        noise_seed,
        linear,
    })
}

/// Times that an effect or a ratio is drawn before it is given up.
const DRAWS: usize = 60;

/// Draws effect and ratio. Where the effect cannot be that visible within its physical bounds, a lower ratio is drawn;
/// where it cannot even reach the lowest, another effect.
fn choose(
    draft: &Draft,
    rng: &mut Pcg64,
    among: &[Effect],
    only: Option<Effect>,
    (low, high): (f64, f64),
) -> Result<(Effect, f64, f64), RigError> {
    for _ in 0..DRAWS {
        let drawn = among[rng.random_range(0..among.len())];
        let effect = only.unwrap_or(drawn);
        let mut top = high;
        for _ in 0..6 {
            let target = low * (top / low).powf(rng.random_range(0.0..1.0));
            if let Some(scale) = draft.scale_to(effect, target) {
                return Ok((effect, scale, target));
            }
            top = target;
        }
        if only.is_some() {
            break;
        }
    }
    Err(RigError::Invisible(only.map_or("no effect", Effect::name).to_owned()))
}

/// Draws the second of two effects: its excess alone is a quarter of the first one's to as much.
fn second(draft: &Draft, rng: &mut Pcg64, first: Effect, target: f64) -> Result<(Effect, f64), RigError> {
    let alone = Draft { shapes: [draft.shapes[1], draft.shapes[0]], ..draft.clone() };
    for _ in 0..DRAWS {
        let effect = Effect::library()[rng.random_range(0..Effect::library().len())];
        let share = 0.25 * 4f64.powf(rng.random_range(0.0..1.0));
        let wanted = (1.0 + share * share * (target * target - 1.0)).sqrt();
        if effect.excludes(first) {
            continue;
        }
        if let Some(scale) = alone.scale_to(effect, wanted) {
            return Ok((effect, scale));
        }
    }
    Err(RigError::Invisible(format!("nothing beside {}", first.name())))
}

impl Case {
    /// Writes the six CSV files and the robot file.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, directory: &Path) -> io::Result<Paths> {
        self.write_with(directory, Decimals::FULL)
    }

    /// The same with the decimals as wanted.
    ///
    /// # Errors
    /// What the system says.
    pub fn write_with(&self, directory: &Path, decimals: Decimals) -> io::Result<Paths> {
        let units = self.mistake.map_or(Units::default(), Mistake::units);
        files::write(directory, &self.robot_file, &self.runs, FIT_RUNS, self.sensor.wrapped, (decimals, &units))
    }

    /// The hidden names; the mistake's, where there is one.
    #[must_use]
    pub fn truth(&self) -> Vec<&'static str> {
        self.effects.iter().map(|(effect, _)| effect.name()).chain(self.mistake.map(Mistake::name)).collect()
    }
}
