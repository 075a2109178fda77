//! Hands a data set's files to the diagnosis and scores what it says.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use diagnose::{Cause, Diagnosis, Options, Verdict, diagnose};
use miette::Diagnostic;
use recording::{Recording, load};
use robot_file::robot::Robot;
use serde::{Deserialize, Serialize};

use super::case::{Case, Category};
use super::files::Paths;
use super::heard::{self, Heard};
use super::hidden::Effect;
use super::memory;

/// Most members that a stated class may have: one that lists half the library says nothing.
pub const LARGEST_CLASS: usize = 3;

/// How a verdict compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mark {
    /// As it should be.
    Right,
    /// The truth is in the class of names that was given.
    InClass,
    /// Of two effects, one, and no other name.
    OneOfTwo,
    /// A wrong name, alone, in a class or for a part of the misfit: the worst thing to say.
    FalseName,
    /// Nothing wrong named, but not what should have been said.
    Missed,
    /// No verdict at all.
    Failed,
}

/// One data set's outcome.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// Seed of the data set.
    pub seed: u64,
    /// Which bar it belongs to.
    pub category: Category,
    /// What was hidden.
    pub truth: Vec<String>,
    /// What it was recorded with, in a few words.
    pub setting: String,
    /// Misfit over the true floor by the generator's own measure.
    pub visibility: f64,
    /// True noise floor over the held-out rollouts, rad.
    pub true_floor: f64,
    /// What the diagnosis said; `Err` with its words if it gave up.
    pub said: Result<Diagnosis, String>,
    /// Wall-clock time to read the files and diagnose, s.
    pub seconds: f64,
    /// Most memory that this held beyond what the process had before, MB; `None` where the machine does not say.
    #[serde(default)]
    pub peak_mb: Option<f64>,
    /// Samples a second and length of a run, s.
    #[serde(default)]
    pub recorded: Option<(f64, f64)>,
    /// How that compares with the truth.
    pub mark: Mark,
    /// What is said of the mistake in the files, where there is one.
    #[serde(default)]
    pub heard: Option<Heard>,
    /// The effects of the model with the least held-out error of all that were tried; none where that is the file's own, or where
    /// no screen raised an alarm and no other was tried.
    #[serde(default)]
    pub lowest: Vec<String>,
}

/// Diagnoses the files of a data set, as a user would: the robot file and recordings from disk.
///
/// # Errors
/// What the reading or the diagnosis said.
pub fn examine(paths: &Paths) -> Result<Diagnosis, String> {
    let robot = Robot::load(&paths.robot).map_err(|error| error.to_string())?;
    let read = |list: &[std::path::PathBuf]| -> Result<Vec<Recording>, String> {
        list.iter().map(|path| load(path).map_err(|error| in_words(&error))).collect()
    };
    diagnose(&robot, &read(&paths.fit)?, &read(&paths.held_out)?, &Options::default()).map_err(|error| in_words(&error))
}

/// An error and what to do about it.
pub fn in_words(error: &dyn Diagnostic) -> String {
    error.help().map_or_else(|| error.to_string(), |help| format!("{error}; {help}"))
}

/// Compares a verdict with the truth.
#[must_use]
pub fn mark(category: Category, truth: &[&str], said: &Diagnosis) -> Mark {
    let explains = !matches!(said.verdict, Verdict::Nothing | Verdict::Unexplained);
    // "Unexplained" may come with a name for a part of the misfit: that is a name, too.
    let named = explains || !said.causes.is_empty();
    let knows = |cause: &Cause| truth.iter().any(|truth| holds(cause, truth));
    match category {
        Category::Nothing if said.verdict == Verdict::Nothing && !named => Mark::Right,
        // A name for a part of the misfit beside which the truth stands is not false.
        Category::Outside if said.verdict == Verdict::Unexplained && said.causes.iter().all(knows) => Mark::Right,
        Category::Nothing | Category::Outside if named => Mark::FalseName,
        Category::Nothing | Category::Outside => Mark::Missed,
        Category::Two => mark_two(truth, said),
        // The truth for a part of the misfit is not the answer, but it is not wrong.
        _ if !explains => {
            if said.causes.iter().all(knows) {
                Mark::Missed
            } else {
                Mark::FalseName
            }
        }
        _ => {
            let [cause] = said.causes.as_slice() else { return Mark::FalseName };
            if !knows(cause) || cause.also.len() >= LARGEST_CLASS {
                Mark::FalseName
            } else if cause.also.is_empty() {
                Mark::Right
            } else {
                Mark::InClass
            }
        }
    }
}

fn holds(cause: &Cause, truth: &str) -> bool {
    cause.effect == truth || cause.also.iter().any(|also| also == truth)
}

/// How it compares with the truth to name the model with the least held-out error, whatever it is.
#[must_use]
pub fn mark_lowest(category: Category, truth: &[&str], lowest: &[&str]) -> Mark {
    let is_true = |name: &&str| truth.contains(name);
    match category {
        _ if lowest.is_empty() => {
            if truth.is_empty() {
                Mark::Right
            } else {
                Mark::Missed
            }
        }
        Category::Nothing | Category::Outside | Category::Mistaken => Mark::FalseName,
        _ if !lowest.iter().all(is_true) => Mark::FalseName,
        _ if lowest.len() < truth.len() => Mark::OneOfTwo,
        _ => Mark::Right,
    }
}

/// Each of the names is one of two effects, or the class of one; or some are not.
fn mark_two(truth: &[&str], said: &Diagnosis) -> Mark {
    let small = |cause: &Cause| cause.also.len() < LARGEST_CLASS;
    if !said.causes.iter().all(|cause| small(cause) && truth.iter().any(|truth| holds(cause, truth))) {
        return Mark::FalseName;
    }
    match truth.iter().filter(|truth| said.causes.iter().any(|cause| holds(cause, truth))).count() {
        0 => Mark::Missed,
        1 => Mark::OneOfTwo,
        _ if said.causes.iter().all(|cause| cause.also.is_empty()) => Mark::Right,
        _ => Mark::InClass,
    }
}

/// Writes a case's files into a directory, diagnoses them and scores the verdict.
/// # Errors
/// The files could not be written.
pub fn run(case: &Case, directory: &Path) -> std::io::Result<Outcome> {
    let paths = case.write(directory)?;
    let start = Instant::now();
    let (said, peak_mb) = memory::measured(|| examine(&paths));
    let seconds = start.elapsed().as_secs_f64();
    let lowest = said.as_ref().map_or_else(|_| Vec::new(), lowest);
    let heard = case.mistake.map(|mistake| heard::listen(mistake, case, &paths, &said));
    let mark = match &heard {
        Some(heard) => heard.mark(),
        None => said.as_ref().map_or(Mark::Failed, |said| mark(case.category, &case.truth(), said)),
    };
    Ok(Outcome {
        seed: case.seed,
        category: case.category,
        truth: case.truth().into_iter().map(str::to_owned).collect(),
        setting: case.setting.words(),
        visibility: case.size.ratio(),
        true_floor: case.size.floor,
        said,
        seconds,
        peak_mb,
        recorded: Some((case.setting.per_s, 8.0 * case.setting.share)),
        mark,
        heard,
        lowest,
    })
}

/// The effects of the model with the least held-out error.
fn lowest(said: &Diagnosis) -> Vec<String> {
    let tried = said.detail.candidates.iter();
    let least = tried.min_by(|a, b| a.held_out_rmse.total_cmp(&b.held_out_rmse));
    least.map_or_else(Vec::new, |least| least.effects.clone())
}

impl Outcome {
    /// Whether it counts towards the bar.
    #[must_use]
    pub fn passed(&self) -> bool {
        matches!(self.mark, Mark::Right | Mark::InClass)
    }

    /// The verdict in short: the word, or the names.
    #[must_use]
    pub fn verdict(&self) -> String {
        let said = match &self.said {
            Ok(said) => said,
            Err(words) => return format!("error: {words}"),
        };
        let names: Vec<String> = said
            .causes
            .iter()
            .map(|cause| std::iter::once(&cause.effect).chain(&cause.also).cloned().collect::<Vec<_>>().join(" or "))
            .collect();
        match said.verdict {
            Verdict::Nothing => "nothing".to_owned(),
            Verdict::Unexplained if names.is_empty() => "unexplained".to_owned(),
            Verdict::Unexplained => format!("unexplained, partly {}", names.join(" + ")),
            Verdict::Explained | Verdict::Ambiguous => names.join(" + "),
        }
    }

    /// The mark that the model with the least held-out error would have got.
    #[must_use]
    pub fn lowest_mark(&self) -> Mark {
        let [truth, lowest] =
            [&self.truth, &self.lowest].map(|names| names.iter().map(String::as_str).collect::<Vec<_>>());
        mark_lowest(self.category, &truth, &lowest)
    }

    /// Column of the confusion table.
    fn column(&self) -> String {
        match &self.said {
            Err(_) if self.category == Category::Mistaken && self.passed() => "said".to_owned(),
            Err(_) => "error".to_owned(),
            Ok(_) if self.mark == Mark::InClass => "in its class".to_owned(),
            Ok(said) if said.verdict == Verdict::Unexplained => "unexplained".to_owned(),
            Ok(said) if said.causes.len() > 1 => "several".to_owned(),
            Ok(_) => self.verdict(),
        }
    }

    /// Held-out error after extension over the estimated floor and over the true one; `None` without an extension.
    #[must_use]
    pub fn after(&self) -> Option<(f64, f64)> {
        let said = self.said.as_ref().ok()?;
        (!said.causes.is_empty()).then(|| (said.after / said.noise_floor, said.after / self.true_floor))
    }

    /// One line for people.
    #[must_use]
    pub fn line(&self) -> String {
        let numbers = self.said.as_ref().map_or(String::new(), |said| {
            format!(
                "; before {:.2}, after {:.3} × floor; after {:.3} × true floor",
                said.before / said.noise_floor,
                said.after / said.noise_floor,
                said.after / self.true_floor
            )
        });
        let memory = self.peak_mb.map_or(String::new(), |peak| format!(", {peak:.0} MB"));
        format!(
            "seed {:>6} {:<20} visible {:>5.2} × floor ({}) → {:?}: {}{numbers}; {:.1} s{memory}",
            self.seed,
            self.hidden(),
            self.visibility,
            self.setting,
            self.mark,
            self.verdict(),
            self.seconds
        )
    }

    /// What was hidden, in words.
    #[must_use]
    pub fn hidden(&self) -> String {
        if self.truth.is_empty() { "nothing".to_owned() } else { self.truth.join(" + ") }
    }

    /// Whether what is left of something outside the library is said to live where it does; `None` for others.
    #[must_use]
    pub fn right_place(&self) -> Option<bool> {
        let effect =
            self.truth.first().and_then(|name| Effect::from_name(name)).filter(|effect| !effect.in_library())?;
        let left = self.said.as_ref().ok()?.left_over.as_ref();
        Some(left.is_some_and(|left| effect.lives_in().contains(&left.coordinate.as_str())))
    }
}

/// Truth against verdict: counts.
#[must_use]
pub fn confusion(outcomes: &[Outcome]) -> BTreeMap<(Category, String), BTreeMap<String, usize>> {
    let mut table: BTreeMap<_, BTreeMap<String, usize>> = BTreeMap::new();
    for outcome in outcomes {
        *table.entry((outcome.category, outcome.hidden())).or_default().entry(outcome.column()).or_default() += 1;
    }
    table
}

/// Median and largest of some numbers; `None` for none.
#[must_use]
pub fn median_and_worst(mut values: Vec<f64>) -> Option<(f64, f64)> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let worst = *values.last()?;
    let median = if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) };
    Some((median, worst))
}
