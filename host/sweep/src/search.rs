//! Looks within the spreads of a robot file for the numbers that make most of the thesis's claims true.
//!
//! Set 1 is the file's own. The others come from CMA-ES (N. Hansen, "The CMA evolution strategy: a tutorial", arXiv 1604.00772, 2016;
//! `basin`'s, bounded), which starts there and makes the claims' lack of margins small; every number is a share of its spread, of the
//! spread's logarithm where the ends are more than a factor of three apart. What a set gave decides the next generation, and rows that a
//! killed search has left are taken in their order: the same search whatever the thread count, and after a kill.

mod set;

use std::cell::RefCell;
use std::path::PathBuf;

use basin::{
    BoundedCmaEs, BoxBounds, ConstraintDescription, ConstraintSet, ConstraintSolveError, Constraints, CostFunction,
    DenseMatrix, Executor, PopulationProgress,
};
use hal_sim::body::Plan;
use robot_file::edit::Document;
use serde::Serialize;
use set::EvaluatedSet;
pub(super) use set::Unknown;
use toml::{Table, Value};

use super::axis::AxisError;
use super::campaign::{Campaign, SweepError, Target};
use super::claims;
use super::journal::{Journal, Rows, claim};
use super::table::Conditions;
use super::trial::RunSettings;
use super::variant::VariantBuilder;

/// The numbers that nobody has published, by the beginnings of their paths: what the thesis leaves as "X mm", masses and sizes, stiffness,
/// damping, friction, the feet, and the effects of the ground and of the body that the file lists.
const UNKNOWN: [&str; 8] = [
    "body.",
    "backbone.",
    "eccentric.",
    "feet.",
    "ground.friction",
    "effects.foot_",
    "effects.payload_",
    "effects.backbone_",
];
/// What a builder chooses.
pub(super) const CHOSEN: [&str; 2] = ["backbone.alpha_deg", "backbone.roll_deg"];
/// Standard deviation of the first generation, share of the spread.
const FIRST: f64 = 0.2;

/// A distribution that is nowhere wider than this has ended.
const SHRUNK: f64 = 1e-3;

/// What a search found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Sets that were tried.
    pub sets: usize,
    /// Of them, those whose runs all came to an end.
    pub admissible: usize,
    /// Of the claims: name, and in how many admissible sets it holds.
    pub claims: Vec<(String, usize)>,
    /// Number of the best set, from 1, which is the file's own.
    pub best: usize,
    /// Claims that hold in it.
    pub best_holds: Vec<String>,
    /// Its numbers.
    pub values: Vec<(String, f64)>,
    /// The table of all sets.
    pub file: PathBuf,
}

/// A search.
pub struct Search<'a> {
    builder: &'a VariantBuilder,
    unknowns: Vec<Unknown>,
    sets: usize,
    seed: u64,
    settings: RunSettings,
    seeds: Vec<u64>,
}

impl<'a> Search<'a> {
    /// Of so many sets; the seed is of their numbers, the seeds are of every set's runs.
    #[must_use]
    pub fn new(builder: &'a VariantBuilder, sets: usize, seed: u64, settings: RunSettings, seeds: Vec<u64>) -> Self {
        let begins = |path: &str, with: &[&str]| with.iter().any(|beginning| path.starts_with(beginning));
        let counts = |path: &str| begins(path, &UNKNOWN) && !begins(path, &CHOSEN);
        let unknowns = builder
            .quantities()
            .iter()
            .filter(|(path, quantity)| counts(path) && quantity.low < quantity.high)
            .map(|(path, quantity)| Unknown { path: path.clone(), low: quantity.low, high: quantity.high })
            .collect();
        Self { builder, unknowns, sets, seed, settings, seeds }
    }

    /// Tries every set that is not in the table yet.
    ///
    /// # Errors
    /// The directory holds another search, a row that cannot be read, or the table cannot be written; rows that were
    /// written stay.
    pub fn run(
        &self,
        target: &Target<'_>,
        threads: Option<usize>,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Found, SweepError> {
        let name = format!("{}.csv", target.stem);
        claim(target.directory, target.stem, &self.about()?, &[&name], target.fresh)?;
        let (journal, rows) = Journal::open(&target.directory.join(&name), &self.header(), self.sets)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.unwrap_or(0))
            .build()
            .map_err(|error| SweepError::Threads(error.to_string()))?;
        for (number, cells) in &rows {
            self.read(&journal, *number, cells)?;
        }
        progress(rows.len(), self.sets);
        let attempts = RefCell::new(Attempts { journal, rows, evaluated: Vec::new(), progress });
        match self.evolve(&Problem { search: self, pool: &pool, attempts: &attempts }) {
            Ended::AllTried => {}
            Ended::Failed(error) => return Err(*error),
        }
        let Attempts { journal, rows, evaluated, .. } = attempts.into_inner();
        let file = journal.finish(&rows)?;
        Ok(self.found(&evaluated, file))
    }

    /// From the file's own numbers until all sets were tried. A distribution that has shrunk to a point begins anew, with another seed.
    fn evolve(&self, problem: &Problem<'_, '_>) -> Ended {
        let value = |unknown: &Unknown| self.builder.quantity(&unknown.path).map_or(unknown.low, |q| q.value);
        let nominal: Vec<f64> = self.unknowns.iter().map(|unknown| unknown.share(value(unknown))).collect();
        let mut ended = problem.cost(&nominal).err();
        for start in 0.. {
            if let Some(ended) = ended {
                return ended;
            }
            let strategy = BoundedCmaEs::<Vec<f64>, DenseMatrix>::new(self.seed.wrapping_add(start), FIRST)
                .with_absolute_distribution_size_tolerance(SHRUNK);
            let mean = PopulationProgress::<Vec<f64>>::from_point(nominal.clone());
            let bounded = Bounded { problem, low: vec![0.0; nominal.len()], high: vec![1.0; nominal.len()] };
            ended = match Executor::new(bounded, strategy, mean).max_iter(u64::MAX).run() {
                Ok(_) if nominal.is_empty() => Some(Ended::AllTried),
                Ok(_) => None,
                Err(ConstraintSolveError::Evaluation(ended)) => Some(ended),
                Err(other) => Some(Ended::from(SweepError::Search(other.to_string()))),
            };
        }
        Ended::AllTried
    }

    fn read(&self, journal: &Journal, number: usize, cells: &[String]) -> Result<EvaluatedSet, SweepError> {
        let evaluated = EvaluatedSet::parse(cells, self.unknowns.len(), claims::names().count());
        Ok(evaluated.ok_or_else(|| journal.unreadable(number))?)
    }

    fn pairs<'s>(&'s self, values: &'s [f64]) -> Vec<(&'s str, f64)> {
        self.unknowns.iter().map(|unknown| unknown.path.as_str()).zip(values.iter().copied()).collect()
    }

    /// The robot file of a set.
    ///
    /// # Errors
    /// The file does not take a number.
    pub fn document(&self, values: &[f64]) -> Result<Document, SweepError> {
        Ok(self.builder.edited(&self.pairs(values))?)
    }

    fn attempt(&self, values: &[f64]) -> EvaluatedSet {
        let none = vec![None; claims::names().count()];
        match self.judged(values) {
            Ok((margins, note)) => EvaluatedSet { values: values.to_vec(), margins, note },
            Err(error) => EvaluatedSet { values: values.to_vec(), margins: none, note: error.to_string() },
        }
    }

    fn judged(&self, values: &[f64]) -> Result<(Vec<Option<f64>>, String), SweepError> {
        let document = self.document(values)?;
        let robot = document.robot().map_err(|error| SweepError::Design(error.to_string()))?;
        let plan = Plan::new(&robot).map_err(|error| AxisError::NoBody(error.to_string()))?;
        let builder = VariantBuilder::new(document, robot)?;
        let campaign = Campaign::new(&builder, claims::design(self.seeds.clone()), self.settings)?;
        let runs = campaign.outcomes()?;
        let bad = runs.iter().filter(|run| run.measures.vx.is_none()).count();
        let note = if bad > 0 { format!("{bad} runs blew up") } else { String::new() };
        let verdicts = claims::evaluate(&Conditions::new(campaign.design(), &runs), &plan);
        Ok((verdicts.iter().map(|verdict| verdict.margin).collect(), note))
    }

    fn header(&self) -> Vec<String> {
        let unknowns = self.unknowns.iter().map(|unknown| unknown.path.clone());
        let claims = claims::names().map(|name| format!("margin: {name}"));
        ["set".to_owned()].into_iter().chain(unknowns).chain(claims).chain(["held", "note"].map(String::from)).collect()
    }

    fn about(&self) -> Result<Table, SweepError> {
        // A claims' sweep of the file's own numbers says which robot, which physics and which claims.
        let campaign = Campaign::new(self.builder, claims::design(self.seeds.clone()), self.settings)?;
        let mut about = campaign.about();
        about.insert("sets".into(), Value::Integer(i64::try_from(self.sets).unwrap_or(i64::MAX)));
        about.insert("search_seed".into(), Value::Integer(i64::from_ne_bytes(self.seed.to_ne_bytes())));
        Ok(about)
    }

    fn found(&self, evaluated: &[EvaluatedSet], file: PathBuf) -> Found {
        let admissible: Vec<&EvaluatedSet> = evaluated.iter().filter(|evaluated| evaluated.note.is_empty()).collect();
        let holding = |index: usize| admissible.iter().filter(|evaluated| evaluated.holds(index)).count();
        let claims = claims::names().enumerate().map(|(index, name)| (name.to_owned(), holding(index))).collect();
        // Of equals the earlier.
        let by_cost = |a: &usize, b: &usize| evaluated[*a].cost().total_cmp(&evaluated[*b].cost());
        let best = (0..evaluated.len()).min_by(by_cost).unwrap_or(0);
        let best_holds = claims::names().enumerate().filter(|(index, _)| evaluated[best].holds(*index));
        let values = self.pairs(&evaluated[best].values).into_iter().map(|(path, value)| (path.to_owned(), value));
        Found {
            sets: evaluated.len(),
            admissible: admissible.len(),
            claims,
            best: best + 1,
            best_holds: best_holds.map(|(_, name)| name.to_owned()).collect(),
            values: values.collect(),
            file,
        }
    }
}

/// The sets that were tried, in their order.
struct Attempts<'p> {
    journal: Journal,
    /// All that the table has, of an earlier run as well.
    rows: Rows,
    evaluated: Vec<EvaluatedSet>,
    progress: &'p mut dyn FnMut(usize, usize),
}

/// Why a search has ended.
#[derive(Debug, thiserror::Error)]
enum Ended {
    #[error("all sets were tried")]
    AllTried,
    #[error(transparent)]
    Failed(Box<SweepError>),
}

impl<E: Into<SweepError>> From<E> for Ended {
    fn from(error: E) -> Self {
        Self::Failed(Box::new(error.into()))
    }
}

/// The lack of margins over shares of the spreads.
struct Problem<'s, 'p> {
    search: &'s Search<'s>,
    pool: &'s rayon::ThreadPool,
    attempts: &'s RefCell<Attempts<'p>>,
}

impl Problem<'_, '_> {
    /// Of the next set; from the table where that has it.
    fn cost(&self, shares: &[f64]) -> Result<f64, Ended> {
        let mut attempts = self.attempts.borrow_mut();
        let number = attempts.evaluated.len() + 1;
        if number > self.search.sets {
            return Err(Ended::AllTried);
        }
        if !attempts.rows.contains_key(&number) {
            let values: Vec<f64> =
                self.search.unknowns.iter().zip(shares).map(|(unknown, share)| unknown.value(*share)).collect();
            let row = (number, self.pool.install(|| self.search.attempt(&values)).cells());
            attempts.journal.append(std::slice::from_ref(&row))?;
            attempts.rows.insert(row.0, row.1);
            let done = attempts.rows.len();
            (attempts.progress)(done, self.search.sets);
        }
        let cells = attempts.rows.get(&number).map_or(&[][..], Vec::as_slice);
        let evaluated = self.search.read(&attempts.journal, number, cells)?;
        let cost = evaluated.cost();
        attempts.evaluated.push(evaluated);
        Ok(cost)
    }
}

/// The same with every share between 0 and 1.
struct Bounded<'s, 'p> {
    problem: &'s Problem<'s, 'p>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl CostFunction for Bounded<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Ended;

    fn cost(&self, shares: &Vec<f64>) -> Result<f64, Ended> {
        self.problem.cost(shares)
    }
}

impl Constraints for Bounded<'_, '_> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>>;

    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.low), Some(&self.high)))
    }
}
