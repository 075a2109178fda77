//! From a seed to a data set: draws the specimen, the sensor, the excitations and what is hidden, and scales the hidden
//! effect until the independent measure says that it is as visible as the seed wants.

use super::beside;
use super::excite::{self, FIT_RUNS, PLAN};
use super::files::{self, Decimals, Paths, Run};
use super::hidden::{Effect, Shape};
use super::measure::{self, Linear, Size};
use super::noise::{Noise, Source};
use super::rig::{Rig, RigError};
use super::sensing::{Sensor, follow};
use super::world::{Drive, World};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use std::io;
use std::path::Path;

/// Which of the three bars a data set belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Category {
    /// One of the eight is hidden.
    Hidden,
    /// Nothing is hidden, the parameters are wrong.
    Nothing,
    /// Something outside the eight is hidden.
    Outside,
    /// One more is hidden beside the effects that the robot file lists.
    Beside,
}

impl Category {
    /// As the command line spells it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Hidden => "hidden",
            Self::Nothing => "nothing",
            Self::Outside => "outside",
            Self::Beside => "beside",
        }
    }

    /// The category of a word.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        [Self::Hidden, Self::Nothing, Self::Outside, Self::Beside].into_iter().find(|category| category.word() == word)
    }
}

/// Bounds of the hidden effects' misfit over the noise floor, 0.1 s rollouts on held-out runs (the bar's own).
pub const HIDDEN_RATIO: (f64, f64) = (1.5, 6.0);
/// Bounds for what lies outside the eight: clearly there, not grotesque.
pub const OUTSIDE_RATIO: (f64, f64) = (2.5, 8.0);

/// A data set with its secret.
#[derive(Clone, Debug)]
pub struct Case {
    /// The seed.
    pub seed: u64,
    /// The category.
    pub category: Category,
    /// What is hidden.
    pub effect: Option<Effect>,
    /// Its size, in the units of [`Shape::apply`].
    pub scale: f64,
    /// The misfit over the floor that the seed wanted; NaN beside known effects, which the linear measure
    /// sees as well.
    pub target: f64,
    /// What the independent measure says of the finished data set.
    pub size: Size,
    /// The true world.
    pub world: World,
    /// The true sensor.
    pub sensor: Sensor,
    /// The six runs, [`FIT_RUNS`] to fit first.
    pub runs: Vec<Run>,
    /// The robot file's text that goes with them.
    pub robot_file: String,
}

/// What a data set has other than usual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Every run's length is this share of the usual one, above 0 and at most 1: another data set than the whole one's
    /// beginning, because each waveform is shortened.
    pub share: f64,
    /// What the noise of the reading is like.
    pub noise: Noise,
    /// Bounds of the hidden effect's misfit over the noise floor instead of [`HIDDEN_RATIO`] or [`OUTSIDE_RATIO`].
    pub ratio: Option<(f64, f64)>,
}

impl Default for Setting {
    fn default() -> Self {
        Self { share: 1.0, noise: Noise::White, ratio: None }
    }
}

/// A data set before its effect is scaled.
struct Draft {
    world: World,
    sensor: Sensor,
    shape: Shape,
    drives: Vec<Vec<Drive>>,
    starts: Vec<f64>,
    noise_seed: u64,
    linear: Linear,
}

/// The longest integration step, s. A sliding bristle's rate is speed over presliding length, up to 1e5 1/s, and
/// Runge–Kutta is stable to 2.8 over that.
const STEP_S: f64 = 16e-6;
const STEP_BRISTLE_S: f64 = 10e-6;

/// One run of a world behind a sensor.
#[must_use]
pub fn simulate(world: &World, sensor: &Sensor, drives: &[Drive], start: f64, rng: &mut Pcg64) -> Run {
    simulate_with(world, sensor, drives, start, rng, 1.0)
}

/// The same with the integration step scaled, for the step-halving test.
#[must_use]
pub fn simulate_with(world: &World, sensor: &Sensor, drives: &[Drive], start: f64, rng: &mut Pcg64, finer: f64) -> Run {
    let t_s = sensor.instants(drives.len(), rng);
    let longest = finer * if world.bristle.is_some() { STEP_BRISTLE_S } else { STEP_S };
    let mut state = world.rest(start);
    let mut follower = start;
    let mut noise = Source::new(sensor.kind);
    // (time, angle, speed) of the shown angle, for readings between steps.
    let mut past: Vec<(f64, f64, f64)> = vec![(0.0, start, 0.0)];
    let history = sensor.delay > 0.0 || sensor.hysteresis > 0.0;
    let (mut reading, mut clean) = (Vec::with_capacity(drives.len()), Vec::with_capacity(drives.len()));
    let mut blind = Vec::with_capacity(drives.len());
    let mut current = sensor.current_noise.map(|_| Vec::with_capacity(drives.len()));
    for tick in 0..drives.len() {
        let now = t_s[tick];
        let jitter: f64 = StandardNormal.sample(rng);
        let (shown, expected) = if sensor.hysteresis > 0.0 {
            (follower, follower)
        } else if sensor.delay > 0.0 {
            let age = (sensor.delay + sensor.delay_jitter * jitter).max(0.0);
            (at(&past, now - age), at(&past, now - sensor.delay))
        } else {
            (world.shown_angle(&state), world.shown_angle(&state))
        };
        let bent = |angle: f64| angle + sensor.nonlinearity(angle);
        let dt = if tick == 0 { 0.0 } else { now - t_s[tick - 1] };
        reading.push(sensor.read(bent(shown), noise.next(dt, world.shaft_speed(&state), rng)));
        clean.push(bent(expected));
        blind.push(sensor.blind(expected));
        if let (Some(list), Some(noise)) = (&mut current, sensor.current_noise) {
            let draw: f64 = StandardNormal.sample(rng);
            list.push(((state.current + noise * draw) * 1e4).round() / 1e4);
        }
        let Some(&next) = t_s.get(tick + 1) else { break };
        let drive = drives[tick];
        let before = if tick == 0 { Drive { duty: 0.0, enable: drive.enable } } else { drives[tick - 1] };
        let jumped = before.enable != drive.enable || (before.duty - drive.duty).abs() > 0.02;
        if history {
            let pieces = 16;
            let length = (next - now) / f64::from(pieces);
            for piece in 0..pieces {
                world.hold(&mut state, drive, jumped && piece == 0, length, longest);
                past.push((now + f64::from(piece + 1) * length, world.shown_angle(&state), world.shaft_speed(&state)));
                follower = follow(follower, world.shown_angle(&state), sensor.hysteresis);
            }
        } else {
            world.hold(&mut state, drive, jumped, next - now, longest);
        }
    }
    Run { t_s, drive: drives.to_vec(), reading, clean, blind, current }
}

/// The shown angle at a time in the past: cubic Hermite between the integrator's steps; before the start, the start.
fn at(past: &[(f64, f64, f64)], time: f64) -> f64 {
    let after = past.partition_point(|(t, ..)| *t <= time);
    match (after.checked_sub(1).and_then(|n| past.get(n)), past.get(after)) {
        (Some(&(t0, a0, w0)), Some(&(t1, a1, w1))) => {
            let h = t1 - t0;
            let s = (time - t0) / h;
            let (s2, s3) = (s * s, s * s * s);
            a0 * (2.0 * s3 - 3.0 * s2 + 1.0)
                + w0 * h * (s3 - 2.0 * s2 + s)
                + a1 * (3.0 * s2 - 2.0 * s3)
                + w1 * h * (s3 - s2)
        }
        (Some(&(_, a, _)), None) | (None, Some(&(_, a, _))) => a,
        (None, None) => 0.0,
    }
}

impl Draft {
    fn runs(&self, effect: Option<Effect>, scale: f64) -> (Vec<Run>, World, Sensor) {
        let (mut world, mut sensor) = (self.world.clone(), self.sensor.clone());
        if let Some(effect) = effect {
            self.shape.apply(effect, scale, &mut world, &mut sensor);
        }
        let runs = (0..self.drives.len())
            .into_par_iter()
            .map(|n| {
                // The same noise at every size, so that the search sees the size alone.
                let mut rng = Pcg64::seed_from_u64(self.noise_seed.wrapping_add(n as u64));
                simulate(&world, &sensor, &self.drives[n], self.starts[n], &mut rng)
            })
            .collect();
        (runs, world, sensor)
    }

    fn size(&self, effect: Option<Effect>, scale: f64) -> Size {
        measure::size(&self.runs(effect, scale).0, FIT_RUNS, self.linear)
    }

    /// Scales an effect to a ratio: the excess over the floor grows about as the size does, so steps of that rule
    /// first, bisection when they leave the bracket. `None` where the effect cannot be that visible.
    fn scale_to(&self, effect: Effect, target: f64) -> Option<f64> {
        let excess = |ratio: f64| (ratio * ratio - 1.0).max(1e-4).sqrt();
        let (mut low, mut high) = effect.bounds();
        let mut scale: f64 = 1f64.clamp(low, high);
        for _ in 0..24 {
            let ratio = self.size(Some(effect), scale).ratio();
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
/// The robot file lacks a number.
pub fn draw(seed: u64, category: Category, only: Option<Effect>, robot_file: &str) -> Result<Case, RigError> {
    draw_with(seed, category, only, robot_file, &Setting::default())
}

/// The same in another setting.
///
/// # Errors
/// The robot file lacks a number.
pub fn draw_with(
    seed: u64,
    category: Category,
    only: Option<Effect>,
    robot_file: &str,
    setting: &Setting,
) -> Result<Case, RigError> {
    let nominal = Rig::nominal(robot_file)?;
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(4).wrapping_add(category as u64));
    let rig = nominal.specimen(&mut rng);
    let (mut world, mut sensor) = (World::linear(rig), Sensor::draw(&mut rng));
    sensor.kind = setting.noise;
    let mut drives: Vec<Vec<Drive>> = PLAN
        .iter()
        .map(|plan| {
            let plan: Vec<_> = plan.iter().map(|&(kind, seconds)| (kind, seconds * setting.share)).collect();
            excite::run(&plan, &mut rng)
        })
        .collect();
    let starts = PLAN.iter().map(|_| rng.random_range(-3.1..3.1)).collect();
    let shape = Shape::draw(&mut rng);
    let noise_seed = rng.random();
    if category == Category::Beside {
        beside::furnish(robot_file, &mut world, &mut sensor, &shape, &mut rng)?;
        drives.iter_mut().for_each(|drives| beside::lift(drives, &world));
    }
    let stiffness = rig.torque_constant * rig.torque_constant / rig.resistance_ohm;
    let linear = Linear {
        driven: (stiffness + rig.viscous) / rig.inertia_kg_m2,
        open: rig.viscous / rig.inertia_kg_m2,
        gain: 0.0,
    };
    let draft = Draft { world, sensor, shape, drives, starts, noise_seed, linear };
    let (effect, scale, target) = match category {
        Category::Nothing => (None, 0.0, 1.0),
        Category::Hidden => choose(&draft, &mut rng, &Effect::LIBRARY, only, setting.ratio.unwrap_or(HIDDEN_RATIO)),
        Category::Outside => choose(&draft, &mut rng, &Effect::OUTSIDE, only, setting.ratio.unwrap_or(OUTSIDE_RATIO)),
        Category::Beside => {
            let drawn = beside::EFFECTS[rng.random_range(0..beside::EFFECTS.len())];
            let effect = only.unwrap_or(drawn);
            let (low, high) = beside::sizes(effect);
            (Some(effect), rng.random_range(low..high), f64::NAN)
        }
    };
    let (runs, world, sensor) = draft.runs(effect, scale);
    let size = measure::size(&runs, FIT_RUNS, draft.linear);
    Ok(Case { seed, category, effect, scale, target, size, world, sensor, runs, robot_file: robot_file.to_owned() })
}

/// Draws effect and ratio. Where the effect cannot be that visible within its physical bounds, a lower ratio is drawn;
/// where it cannot even reach the lowest, another effect.
fn choose(
    draft: &Draft,
    rng: &mut Pcg64,
    among: &[Effect],
    only: Option<Effect>,
    (low, high): (f64, f64),
) -> (Option<Effect>, f64, f64) {
    loop {
        let drawn = among[rng.random_range(0..among.len())];
        let effect = only.unwrap_or(drawn);
        let mut top = high;
        for _ in 0..6 {
            let target = low * (top / low).powf(rng.random_range(0.0..1.0));
            if let Some(scale) = draft.scale_to(effect, target) {
                return (Some(effect), scale, target);
            }
            top = target;
        }
    }
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
        files::write(directory, &self.robot_file, &self.runs, FIT_RUNS, self.sensor.wrapped, decimals)
    }

    /// The hidden name, or "nothing".
    #[must_use]
    pub fn truth(&self) -> &'static str {
        self.effect.map_or("nothing", Effect::name)
    }
}
