//! What is kept in a simulated NOR flash: power cuts, rubbish, other versions, wear.

use std::fmt::Debug;
use std::path::Path;

use control::gait::{MOST_NUMBERS, MOST_STEPS, Name};
use control::protocol::pairing::Pairing;
use control::protocol::radio::Source;
use control::protocol::secure::Key;
use control::{Gait, Parameters};
use embassy_futures::block_on;
use nor_flash::Flash;
use rand::{Rng, RngExt};
use shell::store::pairing::Unpaired;
use shell::store::{self, StoreError};

mod damage;
mod gait;
mod nor_flash;
mod pairing;
mod power;
mod wear;

/// The parameters' partition as on the chips.
const PAGES: usize = 6;
/// And the pairing's.
const PAIRING_PAGES: usize = 4;
/// And the gait's.
const GAIT_PAGES: usize = 4;
type Chip = Flash<4096>;

fn factory() -> Parameters {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    let robot = robot_file::robot::Robot::load(&file).expect("robot.toml");
    robot_file::design::design(&robot).expect("a controller").parameters
}

/// A valid set that differs from every other in every part.
fn another(factory: &Parameters, random: &mut impl Rng) -> Parameters {
    let mut set = *factory;
    let mut vary = |value: &mut f32| *value *= random.random_range(0.9..0.999);
    vary(&mut set.tick);
    vary(&mut set.motor.resistance);
    vary(&mut set.transition.speed_speed);
    vary(&mut set.transition.current_voltage);
    vary(&mut set.bridge.fade_current);
    set.sensor.knots.iter_mut().for_each(|knot| vary(&mut knot.angle));
    set.sensor.harmonics.iter_mut().for_each(|harmonic| vary(&mut harmonic.cos));
    vary(&mut set.estimator.gate);
    vary(&mut set.acquisition.residual);
    vary(&mut set.speed.angle_gain);
    vary(&mut set.position.proportional);
    vary(&mut set.oscillator.brake_share);
    vary(&mut set.supervisor.stall.limit);
    vary(&mut set.supervisor.driven_duty);
    vary(&mut set.limits.least_stroke);
    assert_eq!(set.check(), Ok(()));
    set
}

fn load<const PAGE: usize>(flash: &mut Flash<PAGE>, factory: &Parameters) -> (Parameters, Source) {
    let range = flash.range();
    block_on(store::parameters::load(flash, range, factory))
}

/// Saves a set, or without one resets.
fn save<const PAGE: usize>(
    flash: &mut Flash<PAGE>,
    factory: &Parameters,
    set: Option<&Parameters>,
) -> Result<(), StoreError> {
    let range = flash.range();
    match set {
        Some(set) => block_on(store::parameters::save(flash, range, factory, set)),
        None => block_on(store::parameters::reset(flash, range)),
    }
}

/// What is in the flash; `None` for the factory's set.
fn stored<const PAGE: usize>(flash: &mut Flash<PAGE>, factory: &Parameters) -> Option<Parameters> {
    let (set, source) = load(flash, factory);
    if source == Source::Stored {
        Some(set)
    } else {
        assert_eq!(set, *factory, "{source:?}");
        None
    }
}

/// A pairing that is like no other.
fn another_pairing(random: &mut impl Rng) -> Pairing {
    Pairing { console: random.random(), primary: random.random(), local: random.random(), key: Key(random.random()) }
}

/// What a partition keeps, for tests of either.
trait Subject: Sync {
    type Kept: Clone + PartialEq + Debug + Send;
    /// Nothing can be saved in its place.
    const FORGETS: bool = true;

    fn another(&self, random: &mut impl Rng) -> Self::Kept;
    /// Saves something, or nothing any more.
    fn save<const PAGE: usize>(&self, flash: &mut Flash<PAGE>, kept: Option<&Self::Kept>) -> Result<(), StoreError>;
    /// What is in the flash.
    fn stored<const PAGE: usize>(&self, flash: &mut Flash<PAGE>) -> Option<Self::Kept>;
}

/// The parameters, beside the factory's.
struct OfParameters(Parameters);

impl Subject for OfParameters {
    type Kept = Parameters;

    fn another(&self, random: &mut impl Rng) -> Parameters {
        another(&self.0, random)
    }

    fn save<const PAGE: usize>(&self, flash: &mut Flash<PAGE>, set: Option<&Parameters>) -> Result<(), StoreError> {
        save(flash, &self.0, set)
    }

    fn stored<const PAGE: usize>(&self, flash: &mut Flash<PAGE>) -> Option<Parameters> {
        stored(flash, &self.0)
    }
}

/// The pairing.
struct OfPairing;

impl Subject for OfPairing {
    type Kept = Pairing;

    fn another(&self, random: &mut impl Rng) -> Pairing {
        another_pairing(random)
    }

    fn save<const PAGE: usize>(&self, flash: &mut Flash<PAGE>, pairing: Option<&Pairing>) -> Result<(), StoreError> {
        let range = flash.range();
        match pairing {
            Some(pairing) => block_on(store::pairing::save(flash, range, pairing)),
            None => block_on(store::pairing::forget(flash, range)),
        }
    }

    fn stored<const PAGE: usize>(&self, flash: &mut Flash<PAGE>) -> Option<Pairing> {
        let range = flash.range();
        match block_on(store::pairing::load(flash, range)) {
            Ok(pairing) => Some(pairing),
            Err(Unpaired::Nobody | Unpaired::Damaged) => None,
            Err(Unpaired::OtherVersion) => panic!("there is only one version"),
        }
    }
}

/// A gait of any length that is like no other.
fn another_gait(random: &mut impl Rng) -> Gait {
    let speeds: Vec<f32> = (0..MOST_NUMBERS).map(|_| random.random_range(10.0..70.0)).collect();
    let steps: Vec<u8> = (0..random.random_range(1..=MOST_STEPS)).map(|_| random.random_range(0..16)).collect();
    Gait::new(Name::new("any").expect("a name"), &speeds, &[], &steps, 40, random.random()).expect("sound")
}

/// The gait.
struct OfGait;

impl Subject for OfGait {
    type Kept = Gait;
    const FORGETS: bool = false;

    fn another(&self, random: &mut impl Rng) -> Gait {
        another_gait(random)
    }

    fn save<const PAGE: usize>(&self, flash: &mut Flash<PAGE>, gait: Option<&Gait>) -> Result<(), StoreError> {
        let range = flash.range();
        let gait = gait.expect("a gait is never forgotten");
        block_on(store::gait::save(flash, range, gait))
    }

    fn stored<const PAGE: usize>(&self, flash: &mut Flash<PAGE>) -> Option<Gait> {
        let range = flash.range();
        block_on(store::gait::load(flash, range))
    }
}
