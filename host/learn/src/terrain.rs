//! Over terrain: robots that follow a line by their pose, beside the same ones that only alternate (thesis 6.2 asks for it).

use std::path::Path;

use serde::Serialize;
use sweep::VariantBuilder;
use tasks::{Definition, DriveKind, Straight, Task};

use super::LearnError;
use super::gait::{self, Gait, Played};
use super::seeds;
use super::settings::TerrainSettings;
use super::sides;
use super::variant::{quantity, variant};
use super::way::Way;

/// A ground that is not the robot file's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Terrain {
    /// The robot file's own.
    Flat,
    /// It rises along +x by so much, degrees.
    Slope(f64),
    /// A step of so much, m, which the front feet meet after [`TerrainSettings::begins_m`].
    Step(f64),
    /// From there on so much of the friction.
    Patch(f64),
}

impl Terrain {
    /// What it is called.
    #[must_use]
    pub fn words(self) -> String {
        match self {
            Self::Flat => "even ground".to_owned(),
            Self::Slope(degrees) if degrees > 0.0 => format!("{degrees}° uphill"),
            Self::Slope(degrees) => format!("{}° downhill", -degrees),
            Self::Step(metres) if metres > 0.0 => format!("a step of {} mm up", 1e3 * metres),
            Self::Step(metres) => format!("a step of {} mm down", -1e3 * metres),
            Self::Patch(share) => format!("{:.0} % of the friction", 100.0 * share),
        }
    }

    /// The robot file on it: the file is the base of one that says what differs.
    ///
    /// # Errors
    /// The robot file cannot be read, or the terrain is out of what a robot file may say.
    pub fn robot(self, file: &Path, begins_m: f64) -> Result<VariantBuilder, LearnError> {
        let differs = match self {
            Self::Flat => String::new(),
            Self::Slope(degrees) => {
                let [ahead, left] =
                    [("ahead_deg", degrees), ("left_deg", 0.0)].map(|(key, value)| quantity(key, value, "terrain"));
                format!("[effects.ground_slope]\n{ahead}{left}")
            }
            Self::Step(metres) => format!("[ground]\nsteps_m = [[{begins_m:?}, {metres:?}]]\n"),
            Self::Patch(share) => format!("[ground]\npatches_m = [[{begins_m:?}, {share:?}]]\n"),
        };
        variant(file, ["terrain", &self.words()], &differs)
    }
}

impl TerrainSettings {
    /// Every terrain, the even ground first.
    #[must_use]
    pub fn all(&self) -> Vec<Terrain> {
        let kinds = [
            self.slopes_deg.iter().map(|degrees| Terrain::Slope(*degrees)).collect::<Vec<_>>(),
            self.steps_m.iter().map(|metres| Terrain::Step(*metres)).collect(),
            self.patches.iter().map(|share| Terrain::Patch(*share)).collect(),
        ];
        std::iter::once(Terrain::Flat).chain(kinds.into_iter().flatten()).collect()
    }

    /// The environments of a terrain, with robots drawn from the file's spreads.
    #[must_use]
    pub fn definition(&self) -> Definition {
        let task = Task::Straight(Straight::default());
        let mut definition = Definition {
            episode_s: self.episode_s,
            drive: DriveKind::Motor,
            ..sides::definition(task, self.frequency_hz, self.interval_s, self.alpha_deg)
        };
        definition.randomization.share = self.randomize;
        definition
    }
}

/// What came of a robot on a terrain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Crossed {
    /// How far along the line it came, mm.
    pub ahead_mm: f64,
    /// Farthest off the line, mm.
    pub off_mm: f64,
    /// How long it walked: less than an episode where its supervisor stopped it, s.
    pub seconds: f64,
}

/// Robots drawn from the spreads of a file on a terrain, by their pose or alternating: `actions` are left and right.
///
/// # Errors
/// The environments'.
pub fn cross(
    robot: &VariantBuilder,
    settings: &TerrainSettings,
    (actions, by_pose): ([usize; 2], bool),
    robots: usize,
    threads: Option<usize>,
) -> Result<Vec<Crossed>, LearnError> {
    let definition = settings.definition();
    let unit = definition.length_unit_m;
    let gait = if by_pose {
        Gait::Pursuit { actions, lookahead: settings.lookahead_m / unit, way: Way::along_x() }
    } else {
        Gait::Alternation { actions, steps: [1, 1] }
    };
    let seeds: Vec<u64> = (0..robots as u64).map(|i| seeds::TERRAIN_JUDGED + i).collect();
    let played = gait::play_each(robot, definition, (&gait, &seeds), &|_| false, threads)?;
    Ok(played.iter().map(result).collect())
}

fn result(played: &Played) -> Crossed {
    Crossed {
        ahead_mm: 1e3 * played.path.last().map_or(0.0, |pose| pose.x),
        off_mm: 1e3 * played.path.iter().fold(0.0, |most, pose| pose.y.abs().max(most)),
        seconds: played.seconds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")
    }

    #[test]
    fn a_terrain_is_the_robot_file_s_ground_and_nothing_else() {
        let flat = Terrain::Flat.robot(&file(), 0.05).unwrap();
        let step = Terrain::Step(0.001).robot(&file(), 0.05).unwrap();
        let ground = |robot: &VariantBuilder| robot.robot().ground.clone().unwrap();
        assert_eq!(ground(&step).steps_m, Some(vec![[0.05, 0.001]]));
        assert_eq!((ground(&flat).steps_m, flat.quantities()), (None, step.quantities()));
        let patch = Terrain::Patch(0.5).robot(&file(), 0.05).unwrap();
        assert_eq!(ground(&patch).patches_m, Some(vec![[0.05, 0.5]]));
    }

    #[test]
    fn uphill_gravity_pulls_back() {
        let down = |terrain: Terrain| terrain.robot(&file(), 0.05).unwrap().robot().effects.laws().down();
        let [x, y, z] = down(Terrain::Slope(5.0));
        assert!((x + 5.0_f64.to_radians().sin()).abs() < 1e-12 && y.abs() < 1e-12 && z < -0.99, "{x} {y} {z}");
        assert!(down(Terrain::Slope(-5.0))[0] > 0.08);
    }

    #[test]
    fn every_terrain_has_its_name() {
        let names: Vec<String> = TerrainSettings::default().all().into_iter().map(Terrain::words).collect();
        let expected = [
            "even ground",
            "5° uphill",
            "5° downhill",
            "a step of 0.5 mm up",
            "a step of 1 mm up",
            "a step of 1 mm down",
            "50 % of the friction",
        ];
        assert_eq!(names, expected);
    }
}
