//! A sweep from its design to its table: every run once, over all cores, whatever happened before.

mod about;
mod ledger;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{OnceLock, mpsc};

use control::Parameters;
use hal_sim::random::Seeds;
use rayon::prelude::*;

use super::axis::{AxisError, Factor};
use super::design::Design;
use super::journal::{JournalError, Rows};
use super::measure::{COLUMNS, Measures};
use super::trial::{
    DriveKind, Outcome, PATH_POINTS, RunSettings, SIDE_BY_SIDE, Trial, TrialError, check, shape, simulate,
};
use super::variant::{Variant, VariantBuilder};

/// Where a sweep is written.
#[derive(Clone, Debug)]
pub struct Target<'a> {
    /// The directory.
    pub directory: &'a Path,
    /// Name of the table, without `.csv`.
    pub stem: &'a str,
    /// Paths are kept, too, in `STEM_paths.csv`.
    pub paths: bool,
    /// What is there of another sweep is deleted.
    pub fresh: bool,
}

/// Why a sweep ended.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SweepError {
    /// The robot cannot be brought somewhere.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Axis(#[from] AxisError),
    /// A run cannot be made.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Trial(#[from] TrialError),
    /// The table cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Journal(#[from] JournalError),
    /// No controller for a robot.
    #[error("no controller for this robot: {0}")]
    #[diagnostic(help("--drive ideal turns the eccentric without one"))]
    Design(String),
    /// The numbers cannot be searched.
    #[error("no search over this robot's numbers: {0}")]
    #[diagnostic(help("give the unknown numbers of the robot file a low below their high"))]
    Search(String),
    /// The thread pool cannot be created.
    #[error("no threads: {0}")]
    #[diagnostic(help("name fewer with --threads"))]
    Threads(String),
}

pub use ledger::{Ledger, Row};

/// A run as it stands in the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The point of the design.
    pub point: usize,
    /// What was measured.
    pub measures: Measures,
    /// What a person should know.
    pub note: String,
    /// The centroid's path, mm, where paths are kept.
    pub path: Vec<[f64; 2]>,
}

/// A finished sweep.
#[derive(Clone, Debug)]
pub struct Swept {
    /// What was swept.
    pub design: Design,
    /// Every run, in the design's order.
    pub runs: Vec<Run>,
    /// Of them, those that were there already.
    pub resumed: usize,
    /// The table.
    pub file: PathBuf,
    /// The paths, where they are kept.
    pub paths_file: Option<PathBuf>,
}

/// A sweep that can be run.
pub struct Campaign {
    builder: VariantBuilder,
    design: Design,
    settings: RunSettings,
    /// Robots that differ, made when they are first asked for, and which a point has.
    variants: Vec<OnceLock<(Variant, Option<Parameters>)>>,
    variant_of: Vec<usize>,
}

impl Campaign {
    /// Makes the robots of a design.
    ///
    /// # Errors
    /// One cannot be made, or has no controller.
    pub fn new(builder: &VariantBuilder, design: Design, settings: RunSettings) -> Result<Self, SweepError> {
        let campaign = Self::of_checked(builder, design, settings);
        let points = campaign.design.points.len();
        let mut first_of = vec![0; campaign.variants.len()];
        (0..points).rev().for_each(|point| first_of[campaign.variant_of[point]] = point);
        first_of.par_iter().try_for_each(|point| campaign.variant(*point).map(|_| ()))?;
        for point in 0..points {
            // Before anything is run or written.
            check(&campaign.trial(point * campaign.design.seeds.len())?)?;
        }
        Ok(campaign)
    }

    /// The same of a design that [`Self::new`] has found to be one that can be run, on another machine: a robot is made when its first
    /// run is, so that who makes a part of the runs makes a part of the robots.
    #[must_use]
    pub fn of_checked(builder: &VariantBuilder, design: Design, settings: RunSettings) -> Self {
        let mut known: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
        // What the shaft does is none of the robot's properties.
        let drive = [Factor::Frequency, Factor::Swing].map(|what| design.position(&what));
        let variant_of = design
            .points
            .iter()
            .map(|point| {
                let others = point.iter().enumerate().filter(|(index, _)| !drive.contains(&Some(*index)));
                let key = others.map(|(_, value)| value.to_bits()).collect();
                let next = known.len();
                *known.entry(key).or_insert(next)
            })
            .collect();
        let variants = known.iter().map(|_| OnceLock::new()).collect();
        Self { builder: builder.clone(), design, settings, variants, variant_of }
    }

    /// The robot of a point.
    fn variant(&self, point: usize) -> Result<&(Variant, Option<Parameters>), SweepError> {
        let kept = &self.variants[self.variant_of[point]];
        if let Some(made) = kept.get() {
            return Ok(made);
        }
        let variant = self.builder.variant(&self.design.axes, &self.design.points[point])?;
        let parameters = match self.settings.drive {
            DriveKind::Motor => Some(parameters(&variant)?),
            _ => None,
        };
        Ok(kept.get_or_init(|| (variant, parameters)))
    }

    fn trial(&self, run: usize) -> Result<Trial<'_>, SweepError> {
        let (point, seeds) = (self.design.point(run), self.design.seeds_of(run));
        let (variant, parameters) = self.variant(point)?;
        let at = &self.design.points[point];
        let (f_hz, swing_deg) = (self.design.frequency(at), self.design.swing(at));
        Ok(Trial { variant, parameters: parameters.as_ref(), f_hz, swing_deg, seeds })
    }

    /// Runs of one shape side by side, in a fixed order.
    fn groups(&self, left: impl Iterator<Item = usize>) -> Result<Vec<Vec<usize>>, SweepError> {
        let mut shapes: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for run in left {
            shapes.entry(shape(&self.trial(run)?.variant.plan)).or_default().push(run);
        }
        Ok(shapes
            .into_values()
            .flat_map(|runs| runs.chunks(SIDE_BY_SIDE).map(<[usize]>::to_vec).collect::<Vec<_>>())
            .collect())
    }

    /// Makes every run that is not in the table yet. `progress` is told how many are done, of how many.
    ///
    /// # Errors
    /// A run cannot be made, the directory holds another sweep, or the table cannot be written; rows that were written stay.
    pub fn run(
        self,
        target: &Target<'_>,
        threads: Option<usize>,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Swept, SweepError> {
        let mut ledger = self.open(target)?;
        let total = self.design.runs();
        progress(ledger.len(), total);
        let groups = self.pending(&ledger)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.unwrap_or(0))
            .build()
            .map_err(|error| SweepError::Threads(error.to_string()))?;
        let stop = AtomicBool::new(false);
        let (sender, receiver) = mpsc::channel();
        let campaign = &self;
        std::thread::scope(|scope| {
            let (stop, groups) = (&stop, &groups);
            scope.spawn(move || {
                pool.install(|| {
                    groups.par_iter().for_each_with(sender, |sender, group| {
                        if !stop.load(Ordering::Relaxed) {
                            // Nobody listens any more after an error.
                            let _ = sender.send(campaign.rows(group));
                        }
                    });
                });
            });
            for made in receiver {
                if let Err(error) = made.and_then(|rows| ledger.book(rows)) {
                    stop.store(true, Ordering::Relaxed);
                    return Err(error);
                }
                progress(ledger.len(), total);
            }
            Ok(())
        })?;
        self.finish(ledger)
    }

    fn group(&self, runs: &[usize]) -> Result<Vec<(usize, Outcome)>, SweepError> {
        let trials = runs.iter().map(|run| self.trial(*run)).collect::<Result<Vec<Trial<'_>>, _>>()?;
        match (simulate(&trials, &self.settings), runs) {
            (Ok(outcomes), _) => Ok(runs.iter().copied().zip(outcomes).collect()),
            // One body that cannot be: a note in its row, not the end of the others.
            (Err(TrialError::Body(note)), [run]) => Ok(vec![(*run, Outcome { note, ..Outcome::default() })]),
            (Err(TrialError::Body(_)), _) => {
                runs.iter().map(|run| self.group(&[*run])).collect::<Result<Vec<_>, _>>().map(|all| all.concat())
            }
            (Err(error), _) => Err(error.into()),
        }
    }

    /// Every run's outcome, nothing written: for a search, which keeps a table of its own. In the calling pool's threads.
    ///
    /// # Errors
    /// A run cannot be made.
    pub fn outcomes(&self) -> Result<Vec<Run>, SweepError> {
        self.outcomes_until(&AtomicBool::new(false))
    }

    /// The same until `stop` is true: no group of runs begins then, and the runs are those that were made.
    ///
    /// # Errors
    /// A run cannot be made.
    pub fn outcomes_until(&self, stop: &AtomicBool) -> Result<Vec<Run>, SweepError> {
        let groups = self.all()?;
        let made = |group: &Vec<usize>| match stop.load(Ordering::Relaxed) {
            true => Ok(Vec::new()),
            false => self.group(group),
        };
        let found: Vec<_> = groups.par_iter().map(made).collect::<Result<_, _>>()?;
        let runs: BTreeMap<usize, Outcome> = found.into_iter().flatten().collect();
        let run = |(run, outcome): (usize, Outcome)| Run {
            point: self.design.point(run),
            measures: outcome.measures,
            note: outcome.note,
            path: outcome.path,
        };
        Ok(runs.into_iter().map(run).collect())
    }

    /// The design.
    #[must_use]
    pub fn design(&self) -> &Design {
        &self.design
    }

    fn header(&self) -> Vec<String> {
        let axes = self.design.axes.iter().map(|axis| axis.what.column());
        let measures = COLUMNS.iter().map(|column| column.name.to_owned());
        ["run".to_owned()]
            .into_iter()
            .chain(axes)
            .chain(["robot_seed".to_owned(), "seed".to_owned()])
            .chain(measures)
            .chain(["note".into()])
            .collect()
    }

    fn cells(&self, run: usize, outcome: &Outcome) -> Vec<String> {
        let Seeds { specimen, run: seed } = self.design.seeds_of(run);
        let axes = self.design.points[self.design.point(run)].iter().map(f64::to_string);
        let measures =
            outcome.measures.values().into_iter().map(|value| value.map_or(String::new(), |v| v.to_string()));
        axes.chain([specimen.to_string(), seed.to_string()]).chain(measures).chain([outcome.note.clone()]).collect()
    }

    fn read(&self, run: usize, rows: &Rows, paths: Option<&Rows>) -> Run {
        let empty = Vec::new();
        let cells = rows.get(&(run + 1)).unwrap_or(&empty);
        let first = self.design.axes.len() + 2;
        let number = |text: &String| text.parse::<f64>().ok().filter(|value| value.is_finite());
        let values: Vec<Option<f64>> = cells.iter().skip(first).take(COLUMNS.len()).map(number).collect();
        let path: Option<Vec<f64>> =
            paths.and_then(|paths| paths.get(&(run + 1))).and_then(|cells| cells.iter().map(number).collect());
        Run {
            point: self.design.point(run),
            measures: Measures::from_values(&values),
            note: cells.last().cloned().unwrap_or_default(),
            path: path.unwrap_or_default().chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect(),
        }
    }
}

fn parameters(variant: &Variant) -> Result<Parameters, SweepError> {
    robot_file::design::parameters(&variant.robot).map_err(|error| SweepError::Design(error.to_string()))
}

fn path_header(seconds: f64) -> Vec<String> {
    let point = |k: usize| {
        let time = super::axis::significant(seconds * k as f64 / (PATH_POINTS - 1) as f64, 6);
        [format!("x_mm@{time}"), format!("y_mm@{time}")]
    };
    ["run".to_owned()].into_iter().chain((0..PATH_POINTS).flat_map(point)).collect()
}

/// Micrometres are enough for a path. Empty cells for a run that blew up.
fn path_cells(path: &[[f64; 2]]) -> Vec<String> {
    if path.is_empty() {
        return vec![String::new(); 2 * PATH_POINTS];
    }
    path.iter().flatten().map(|mm| format!("{mm:.3}")).collect()
}

#[cfg(test)]
mod tests {
    use hal_sim::body::Precision;
    use robot_file::edit::Document;

    use super::super::axis::Axis;
    use super::*;

    #[test]
    fn a_part_of_the_runs_needs_a_part_of_the_robots_and_its_rows_are_the_same() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let document = Document::load(&file).unwrap();
        let robot = document.robot().unwrap();
        let builder = VariantBuilder::new(document, robot).unwrap();
        let axes = Axis::parse_all(&["alpha=0:90:4".to_owned(), "f=6,8".to_owned()]).unwrap();
        let design = Design::product(axes, vec![1]);
        let settings =
            RunSettings { drive: DriveKind::Motor, seconds: 0.2, step_s: 1e-4, precision: Precision::Double };
        let made = |campaign: &Campaign| campaign.variants.iter().filter(|variant| variant.get().is_some()).count();
        let driver = Campaign::new(&builder, design.clone(), settings).unwrap();
        assert_eq!(made(&driver), 4, "a robot for each α, whatever the frequency");
        let worker = Campaign::of_checked(&builder, design, settings);
        assert_eq!(made(&worker), 0);
        let runs = [2, 3];
        let rows = worker.rows(&runs).unwrap();
        assert_eq!(rows, driver.rows(&runs).unwrap());
        assert_eq!(made(&worker), 1);
        assert_eq!(worker.about().to_string(), driver.about().to_string());
    }
}
