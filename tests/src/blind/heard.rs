//! Whether a mistake in the files is said, and its mend: by the check of the rig (`scram new-rig --check`) and by the diagnosis.

use diagnose::{Diagnosis, Mend, RigMistake, check_rig};
use recording::{ReadOptions, load_with};
use robot_file::robot::Robot;
use serde::{Deserialize, Serialize};

use super::case::Case;
use super::files::Paths;
use super::mistake::Mistake;
use super::score::{Mark, in_words};

/// What is said of a mistake.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Heard {
    /// The check of the rig has the right mend among those that it gives, three at most.
    pub by_check: bool,
    /// The diagnosis has it in its refusal, or among its doubts.
    pub by_diagnosis: bool,
    /// The diagnosis gives physics a name.
    pub named: bool,
    /// What the check says, in words.
    pub check: String,
}

impl Heard {
    /// Said where people meet it, and nothing physical named.
    #[must_use]
    pub fn mark(&self) -> Mark {
        match self {
            Self { named: true, .. } => Mark::FalseName,
            Self { by_check: true, by_diagnosis: true, .. } => Mark::Right,
            _ => Mark::Missed,
        }
    }
}

/// Checks the files of a data set, and compares what that and a diagnosis say with the mistake in them.
pub fn listen(mistake: Mistake, case: &Case, paths: &Paths, said: &Result<Diagnosis, String>) -> Heard {
    let truth = Truth { mistake, case };
    let mends = check(paths);
    let right: Vec<&Mend> = mends.iter().filter(|mend| truth.is_mended_by(mend)).collect();
    let has =
        |words: &String| right.iter().any(|mend| words.contains(&mend.change)) || truth.is_mended_by_the_reader(words);
    Heard {
        by_check: !right.is_empty(),
        by_diagnosis: !right.is_empty()
            && match said {
                Err(refusal) => has(refusal),
                Ok(said) => said.rig_doubts.iter().any(|doubt| has(&doubt.mend)),
            },
        named: said.as_ref().is_ok_and(|said| !said.causes.is_empty()),
        check: mends.iter().map(|mend| mend.change.as_str()).collect::<Vec<_>>().join(" | "),
    }
}

/// The mends of everything that the check finds; of what no reader takes, the reader's.
fn check(paths: &Paths) -> Vec<Mend> {
    let refused =
        |words: String| Mend { causes: vec![RigMistake::Recording], words: words.clone(), change: words, field: None };
    let robot = match Robot::load(&paths.robot) {
        Ok(robot) => robot,
        Err(error) => return vec![refused(error.to_string())],
    };
    let (mut runs, mut mends) = (Vec::new(), Vec::new());
    for path in paths.fit.iter().chain(&paths.held_out) {
        match load_with(path, &ReadOptions { as_written: true, ..ReadOptions::default() }) {
            Ok(loaded) => runs.push(loaded.recording),
            Err(error) => mends.push(refused(in_words(&error))),
        }
    }
    mends.extend(check_rig(&robot, &runs).findings.into_iter().flat_map(|finding| finding.mends));
    mends
}

/// The mistake with the data set that it is in.
struct Truth<'a> {
    mistake: Mistake,
    case: &'a Case,
}

/// By how much a torque constant that is read off the recordings may miss the rig's: friction and damping make it look larger.
const CONSTANT: f64 = 1.3;
/// The same of a supply, which is read off by the file's torque constant: that is off by as much as half.
const SUPPLY: f64 = 2.2;

impl Truth<'_> {
    /// Whether a mend takes the mistake away, and nothing else.
    fn is_mended_by(&self, mend: &Mend) -> bool {
        let rig = &self.case.world.rig;
        let [cause] = mend.causes.as_slice() else { return false };
        let unit = |name: &str| *cause == RigMistake::AngleUnit(name.to_owned());
        let scale = |full: f64| *cause == RigMistake::DutyFullScale(full);
        match self.mistake {
            Mistake::ReversedSensor | Mistake::ReversedDrive => *cause == RigMistake::ReversedSign,
            Mistake::Degrees => unit("deg"),
            Mistake::Turns => unit("turns"),
            Mistake::Counts(turn) => unit(&format!("counts/{turn}")),
            Mistake::MotorSide(_) => *cause == RigMistake::MotorSide,
            Mistake::Milliseconds => *cause == RigMistake::TimeUnit("ms".to_owned()),
            Mistake::Percent => scale(100.0),
            Mistake::Pwm => scale(255.0),
            Mistake::OtherGears(_) => {
                matches!(cause, RigMistake::TorqueConstant(k) if within(*k, rig.torque_constant, CONSTANT))
            }
            Mistake::Supply(_) => matches!(cause, RigMistake::Supply(volts) if within(*volts, rig.rail_v, SUPPLY)),
            // By a file whose driver is another's as well, a torque constant is no figure of the rig's.
            Mistake::OtherRig(_) => matches!(cause, RigMistake::TorqueConstant(_) | RigMistake::Recording),
        }
    }

    /// Whether what a reader says when it refuses a file takes the mistake away, or says what does.
    fn is_mended_by_the_reader(&self, words: &str) -> bool {
        let mend = match self.mistake {
            Mistake::Degrees => "multiply the column by π/180",
            Mistake::Milliseconds => "divide by 1000 if the file holds milliseconds",
            Mistake::Percent => "divide by 100 if the file holds percent",
            Mistake::Pwm => "by the full scale if it holds counts",
            _ => "scram new-rig --check",
        };
        words.contains(mend) || words.contains("scram new-rig --check")
    }
}

fn within(value: f64, truth: f64, factor: f64) -> bool {
    value < factor * truth && truth < factor * value
}
