//! Which robot walks and turns best: designs within bounds, each with a short training of its own (thesis 6.2 wishes for it).
//!
//! The first design is the file's, the first half of the others is drawn evenly within the bounds, the second half around designs of the
//! front as it then is. Which design comes next follows from the seed and from what the ones before it came to, so a search that was
//! stopped goes on.

use std::path::Path;

use rand::RngExt;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use robot_file::Robot;
use serde::{Deserialize, Serialize};
use sweep::{AxisError, VariantBuilder};

use super::gait::Gait;
use super::settings::{DesignSettings, Direction, Settings, Straightness, Turning};
use super::straight;
use super::training::Training;
use super::turning::{self, Contender, Robots};
use super::variant::{quantity, variant};
use super::{LearnError, Played};

/// Episodes on which the learned gait of a design is judged.
const JUDGED: usize = 4;
/// Standard deviation around a design of the front, share of the bounds' width.
const AROUND: f64 = 0.15;
/// How often a design near another one has a module more or less.
const OTHER_MODULES: f64 = 0.3;

/// What a robot is built like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Design {
    /// α, degrees.
    pub alpha_deg: f64,
    /// By how much each backbone's roll differs from its multiple of α, degrees, from front to rear: there is a module more than backbones.
    pub roll_off_deg: Vec<f64>,
    /// The eccentric's mass times radius, share of the file's.
    pub eccentric_share: f64,
}

impl Design {
    /// As a robot file is built.
    ///
    /// # Errors
    /// The file has no body.
    pub fn of(robot: &Robot) -> Result<Self, LearnError> {
        let (Some(body), Some(backbone)) = (&robot.body, &robot.backbone) else { return Err(no_body()) };
        let alpha_deg = backbone.alpha_deg.value;
        let backbones = body.modules.len() - 1;
        let own = |place: usize| backbone.roll_deg.as_ref().map(|rolls| rolls[place] - (place + 1) as f64 * alpha_deg);
        let roll_off_deg = (0..backbones).map(|place| own(place).unwrap_or(0.0)).collect();
        Ok(Self { alpha_deg, roll_off_deg, eccentric_share: 1.0 })
    }

    /// Number of modules.
    #[must_use]
    pub fn modules(&self) -> usize {
        self.roll_off_deg.len() + 1
    }

    /// The roll of each backbone, degrees.
    #[must_use]
    pub fn rolls_deg(&self) -> Vec<f64> {
        (1..).zip(&self.roll_off_deg).map(|(number, off)| f64::from(number) * self.alpha_deg + off).collect()
    }

    /// The robot: an actuator, a courier, then passive modules, all as in the file.
    ///
    /// # Errors
    /// The robot file cannot be read, or allows no such robot.
    pub fn robot(&self, file: &Path, base: &Robot) -> Result<VariantBuilder, LearnError> {
        let Some(eccentric) = &base.eccentric else { return Err(no_body()) };
        let kinds = ["actuator", "courier"].into_iter().chain(std::iter::repeat("passive"));
        let kinds: Vec<&str> = kinds.take(self.modules()).collect();
        let mut eccentric = eccentric.clone();
        eccentric.mass_kg.value *= self.eccentric_share;
        let mass = quantity("mass_kg", eccentric.mass_kg.value, "design");
        let load = quantity("inertia_kg_m2", eccentric.inertia_kg_m2(), "design");
        let rolls = self.rolls_deg();
        let differs =
            format!("[body]\nmodules = {kinds:?}\n[backbone]\nroll_deg = {rolls:?}\n[eccentric]\n{mass}[load]\n{load}");
        variant(file, ["design", "a design that was tried"], &differs)
    }
}

fn no_body() -> LearnError {
    AxisError::NoBody("the robot file has no body".to_owned()).into()
}

/// What a design came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tried {
    /// How it is built.
    pub design: Design,
    /// The fastest of the alternations by (5.3), from start to end over the time, mm/s.
    pub speed_mm_per_s: f64,
    /// Its t₁ and t₂, s.
    pub held_s: [f64; 2],
    /// Rate of the learned gait, °/s, positive in the direction that was learned.
    pub turning_deg_per_s: f64,
    /// Median radius of the circle on which it turns, mm.
    pub radius_mm: f64,
    /// What training and tries took, simulated seconds.
    pub simulated_s: f64,
}

/// A search for designs.
pub struct Search<'a> {
    file: &'a Path,
    base: Robot,
    own: Design,
    settings: Settings,
    direction: Direction,
    seed: u64,
    threads: Option<usize>,
}

impl<'a> Search<'a> {
    /// Around the robot of a file.
    ///
    /// # Errors
    /// A key of the learning file is out of its range, or the robot has no body.
    pub fn new(
        (file, base): (&'a Path, Robot),
        (settings, direction): (&Settings, Direction),
        seed: u64,
        threads: Option<usize>,
    ) -> Result<Self, LearnError> {
        settings.design.check()?;
        let own = Design::of(&base)?;
        Ok(Self { file, base, own, settings: settings.clone(), direction, seed, threads })
    }

    /// The design that is to be tried after these.
    #[must_use]
    pub fn next(&self, tried: &[Tried]) -> Design {
        let told = &self.settings.design;
        if tried.is_empty() {
            return self.own.clone();
        }
        let mut random = Pcg64::new(u128::from(self.seed), tried.len() as u128);
        if tried.len() <= told.designs / 2 {
            return told.draw(&mut random);
        }
        let front = front(tried);
        let near = &tried[front[random.random_range(0..front.len())]].design;
        told.draw_near(near, &mut random)
    }

    /// Trains a design to turn, searches how it walks straight, and says what came of both.
    ///
    /// # Errors
    /// The environments', or those of [`Design::robot`].
    pub fn evaluate(&self, design: Design) -> Result<Tried, LearnError> {
        let robot = design.robot(self.file, &self.base)?;
        let told = &self.settings.design;
        // The robot's rolls are its design's.
        let turn = Turning { updates: told.updates, alpha_deg: None, ..self.settings.turn.clone() };
        let settings = Settings { turn, ..self.settings.clone() };
        let mut training = Training::new(robot.clone(), settings.clone(), self.direction, self.seed, self.threads)?;
        while training.advance()?.is_some() {}
        let definition = settings.turn.definition(self.direction);
        let trained_s = (settings.ppo.steps * told.updates) as f64 * definition.interval_s;
        let learned = Contender { name: String::new(), gait: Gait::Policy(training.policy()), definition, tried: 0 };
        let played = turning::episodes(&robot, &learned, Robots::Nominal, JUDGED, self.threads)?;
        let judged = turning::judged(&played, &learned, settings.turn.interval_s);
        let found = straight::search(&robot, &told.walking(), self.threads, &mut |_, _| {})?;
        let fastest = found.alternations.iter().max_by(|a, b| a.speed_mm_per_s.total_cmp(&b.speed_mm_per_s));
        let seconds = |played: &[Played]| played.iter().map(|one| one.seconds).sum::<f64>();
        let walked_s = (found.alternations.len() + found.constant.len()) as f64 * told.episode_s;
        Ok(Tried {
            design,
            speed_mm_per_s: fastest.map_or(0.0, |walked| walked.speed_mm_per_s),
            held_s: fastest.map_or([0.0; 2], |walked| walked.held_s),
            turning_deg_per_s: self.direction.sign() * judged.rate_deg_per_s,
            radius_mm: judged.radius_mm,
            simulated_s: trained_s + seconds(&played) + walked_s,
        })
    }
}

impl DesignSettings {
    /// How a design's signals for walking are searched.
    fn walking(&self) -> Straightness {
        Straightness {
            frequency_hz: self.frequency_hz,
            interval_s: self.interval_s,
            held: self.held.clone(),
            episode_s: self.episode_s,
            starts: 1,
            alpha_deg: None,
            ..Straightness::default()
        }
    }

    fn draw(&self, random: &mut Pcg64) -> Design {
        let mut within = |[low, high]: [f64; 2]| low + (high - low) * random.random::<f64>();
        let alpha_deg = within(self.alpha_deg);
        let eccentric_share = within(self.eccentric_share);
        let roll = [-self.roll_off_deg, self.roll_off_deg];
        let backbones = self.modules.map(|modules| (modules - 1) as f64);
        let backbones = within([backbones[0], backbones[1] + 1.0]).floor().min(backbones[1]) as usize;
        Design { alpha_deg, roll_off_deg: (0..backbones).map(|_| within(roll)).collect(), eccentric_share }
    }

    fn draw_near(&self, near: &Design, random: &mut Pcg64) -> Design {
        // A standard deviation above 0 is one.
        let scatter = Normal::new(0.0, AROUND).unwrap_or_else(|_| unreachable!("a standard deviation"));
        let mut moved = |value: f64, [low, high]: [f64; 2]| {
            let value = value + (high - low) * scatter.sample(random);
            value.clamp(low, high)
        };
        let roll = [-self.roll_off_deg, self.roll_off_deg];
        let alpha_deg = moved(near.alpha_deg, self.alpha_deg);
        let eccentric_share = moved(near.eccentric_share, self.eccentric_share);
        let mut roll_off_deg: Vec<f64> = near.roll_off_deg.iter().map(|off| moved(*off, roll)).collect();
        if random.random::<f64>() < OTHER_MODULES {
            let [fewest, most] = self.modules.map(|modules| modules - 1);
            let more = random.random::<bool>();
            let backbones = if more { roll_off_deg.len() + 1 } else { roll_off_deg.len() - 1 };
            roll_off_deg.resize(backbones.clamp(fewest, most), 0.0);
        }
        Design { alpha_deg, roll_off_deg, eccentric_share }
    }
}

/// Of the designs those than which none both walks and turns faster, their places, the fastest walker first.
#[must_use]
pub fn front(tried: &[Tried]) -> Vec<usize> {
    super::front::front(tried, [|one| one.speed_mm_per_s, |one| one.turning_deg_per_s])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tried(speed_mm_per_s: f64, turning_deg_per_s: f64) -> Tried {
        let design = Design { alpha_deg: 60.0, roll_off_deg: vec![0.0, 10.0], eccentric_share: 1.0 };
        Tried { design, speed_mm_per_s, held_s: [0.1; 2], turning_deg_per_s, radius_mm: 0.0, simulated_s: 0.0 }
    }

    fn file() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")
    }

    fn base() -> Robot {
        robot_file::edit::Document::load(&file()).unwrap().robot().unwrap()
    }

    #[test]
    fn the_front_has_what_nothing_beats_in_both() {
        let all = [tried(1.0, 9.0), tried(3.0, 4.0), tried(3.0, 5.0), tried(2.0, 4.5), tried(4.0, -1.0)];
        assert_eq!(front(&all), [4, 2, 0]);
    }

    #[test]
    fn a_design_is_the_robot_that_it_says() {
        let design = Design { alpha_deg: 40.0, roll_off_deg: vec![0.0, -5.0], eccentric_share: 1.2 };
        let base = base();
        let robot = design.robot(&file(), &base).unwrap();
        let robot = robot.robot();
        assert_eq!(robot.backbone.as_ref().unwrap().roll_deg, Some(vec![40.0, 75.0]));
        assert_eq!(robot.body.as_ref().unwrap().modules.len(), 3);
        let moment = |robot: &Robot| {
            let eccentric = robot.eccentric.as_ref().unwrap();
            eccentric.mass_kg.value * eccentric.radius_m.value
        };
        assert!((moment(robot) / moment(&base) - 1.2).abs() < 1e-12);
        let back = Design::of(robot).unwrap();
        assert_eq!(back.rolls_deg(), design.rolls_deg());
        // The file's own design is the file's robot.
        let own = Design::of(&base).unwrap().robot(&file(), &base).unwrap();
        assert_eq!(own.robot().body, base.body);
        assert_eq!(
            own.robot().eccentric.as_ref().unwrap().mass_kg.value,
            base.eccentric.as_ref().unwrap().mass_kg.value
        );
    }

    #[test]
    fn designs_stay_within_their_bounds_and_follow_from_what_was_tried() {
        let told = DesignSettings { designs: 200, ..DesignSettings::default() };
        let settings = Settings { design: told.clone(), ..Settings::default() };
        let path = file();
        let search = Search::new((&path, base()), (&settings, Direction::Left), 3, None).unwrap();
        let mut all = Vec::new();
        for place in 0..told.designs {
            let design = search.next(&all);
            assert_eq!(design, search.next(&all), "design {place}");
            let within = |value: f64, [low, high]: [f64; 2]| (low..=high).contains(&value);
            assert!(within(design.alpha_deg, told.alpha_deg) && within(design.eccentric_share, told.eccentric_share));
            assert!((told.modules[0]..=told.modules[1]).contains(&design.modules()), "{design:?}");
            assert!(design.roll_off_deg.iter().all(|off| off.abs() <= told.roll_off_deg));
            // The front is the designs with α near 100°.
            let speed = -(design.alpha_deg - 100.0).abs();
            all.push(Tried { design, ..tried(speed, speed) });
        }
        let near = |some: &[Tried]| some.iter().filter(|one| (one.design.alpha_deg - 100.0).abs() < 36.0).count();
        // 36° is a standard deviation of what is drawn near the front, and an eighth of the bounds.
        let (early, late) = (near(&all[1..101]), near(&all[101..]));
        assert!(early < 35 && late > 60, "{early} of the first half, {late} of the second");
        let modules = |count: usize| all.iter().filter(|one| one.design.modules() == count).count();
        assert!([3, 4, 5].into_iter().all(|count| modules(count) > 20));
    }
}
