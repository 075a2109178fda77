//! Looks within the spreads of a robot file for the numbers that make most of the thesis's claims true.
//!
//! Set 1 is the file's own. The first half of the others is drawn evenly over the spreads (over their logarithm where the
//! ends are more than a factor of three apart); the second half changes every number of one of the best sets so far by a
//! normal deviate of 15 % of its spread. Sets come in generations, and a set depends on the generations before it alone:
//! the same search whatever the thread count, and after a kill.

mod set;

use std::path::PathBuf;
use std::sync::mpsc;

use hal_sim::random::{Source, Stream};
use rayon::prelude::*;
use robot_file::edit::Document;
use serde::Serialize;
use set::{EvaluatedSet, Unknown};
use toml::{Table, Value};

use super::campaign::{Campaign, SweepError, Target};
use super::claims;
use super::journal::{Journal, Rows, claim};
use super::table::Conditions;
use super::trial::RunSettings;
use super::variant::VariantBuilder;

/// The numbers that nobody has published: what the thesis leaves as "X mm", stiffness, damping, friction, the feet.
const UNKNOWN: [&str; 17] = [
    "eccentric.mass_kg",
    "eccentric.radius_m",
    "eccentric.height_m",
    "backbone.torsion_nm_per_rad",
    "backbone.stiff_nm_per_rad",
    "backbone.soft_nm_per_rad",
    "backbone.torsion_nm_s_per_rad",
    "backbone.stiff_nm_s_per_rad",
    "backbone.soft_nm_s_per_rad",
    "feet.leg_m",
    "feet.radius_m",
    "feet.inset_m",
    "feet.normal_n_per_m",
    "feet.normal_s_per_m",
    "feet.shear_n_per_m",
    "feet.shear_n_s_per_m",
    "ground.friction",
];
/// The ground's effects belong to the unknown, too, where the file lists them.
const UNKNOWN_EFFECTS: &str = "effects.foot_";
/// Sets that are drawn before any of them is judged.
const GENERATION: usize = 24;
/// Sets that may be varied.
const PARENTS: usize = 8;
/// Standard deviation of a variation, share of the spread.
const VARIATION: f64 = 0.15;
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
        let counts = |path: &str| UNKNOWN.contains(&path) || path.starts_with(UNKNOWN_EFFECTS);
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
        let (mut journal, mut rows) = Journal::open(&target.directory.join(&name), &self.header(), self.sets)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.unwrap_or(0))
            .build()
            .map_err(|error| SweepError::Threads(error.to_string()))?;
        for (number, cells) in &rows {
            self.read(&journal, *number, cells)?;
        }
        let mut evaluated: Vec<EvaluatedSet> = Vec::new();
        progress(rows.len(), self.sets);
        while evaluated.len() < self.sets {
            let numbers = evaluated.len() + 1..=(evaluated.len() + GENERATION).min(self.sets);
            let sets: Vec<(usize, Vec<f64>)> =
                numbers.clone().filter(|n| !rows.contains_key(n)).map(|n| (n, self.set(n, &evaluated))).collect();
            self.generation(&sets, &pool, &mut journal, &mut rows, progress)?;
            for number in numbers {
                evaluated.push(self.read(&journal, number, rows.get(&number).map_or(&[], Vec::as_slice))?);
            }
        }
        let file = journal.finish(&rows)?;
        Ok(self.found(&evaluated, file))
    }

    fn read(&self, journal: &Journal, number: usize, cells: &[String]) -> Result<EvaluatedSet, SweepError> {
        let evaluated = EvaluatedSet::parse(cells, self.unknowns.len(), claims::names().count());
        Ok(evaluated.ok_or_else(|| journal.unreadable(number))?)
    }

    fn generation(
        &self,
        sets: &[(usize, Vec<f64>)],
        pool: &rayon::ThreadPool,
        journal: &mut Journal,
        rows: &mut Rows,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<(), SweepError> {
        let (sender, receiver) = mpsc::channel();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                pool.install(|| {
                    sets.par_iter().for_each_with(sender, |sender, (number, values)| {
                        // Nobody listens any more after an error.
                        let _ = sender.send((*number, self.attempt(values)));
                    });
                });
            });
            for (number, evaluated) in receiver {
                let row = (number, evaluated.cells());
                journal.append(std::slice::from_ref(&row))?;
                rows.insert(row.0, row.1);
                progress(rows.len(), self.sets);
            }
            Ok(())
        })
    }

    /// The numbers of a set, from 1, after those of the generations before.
    fn set(&self, number: usize, before: &[EvaluatedSet]) -> Vec<f64> {
        if number == 1 {
            let nominal = |unknown: &Unknown| self.builder.quantity(&unknown.path).map_or(unknown.low, |q| q.value);
            return self.unknowns.iter().map(nominal).collect();
        }
        let seed = self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number as u64);
        let mut draws = Stream::new(seed, Source::Variation);
        let mut best: Vec<&EvaluatedSet> = before.iter().filter(|evaluated| evaluated.note.is_empty()).collect();
        // Stable: of equals the earlier.
        best.sort_by_key(|evaluated| std::cmp::Reverse(evaluated.held()));
        best.truncate(PARENTS);
        if number <= 1 + self.sets / 2 || best.is_empty() {
            return self.unknowns.iter().map(|unknown| unknown.value(draws.uniform(0.0, 1.0))).collect();
        }
        let parent = best[draws.below(u32::try_from(best.len()).unwrap_or(1)) as usize];
        let vary = |(unknown, value): (&Unknown, &f64)| {
            let share = unknown.share(*value) + VARIATION * draws.normal();
            // Reflected at the ends.
            let folded = share.rem_euclid(2.0);
            unknown.value(if folded > 1.0 { 2.0 - folded } else { folded })
        };
        self.unknowns.iter().zip(&parent.values).map(vary).collect()
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
            Ok((holds, note)) => EvaluatedSet { values: values.to_vec(), holds, note },
            Err(error) => EvaluatedSet { values: values.to_vec(), holds: none, note: error.to_string() },
        }
    }

    fn judged(&self, values: &[f64]) -> Result<(Vec<Option<bool>>, String), SweepError> {
        let document = self.document(values)?;
        let robot = document.robot().map_err(|error| SweepError::Design(error.to_string()))?;
        let builder = VariantBuilder::new(document, robot)?;
        let campaign = Campaign::new(&builder, claims::design(self.seeds.clone()), self.settings)?;
        let runs = campaign.outcomes()?;
        let bad = runs.iter().filter(|run| run.measures.vx.is_none()).count();
        let note = if bad > 0 { format!("{bad} runs blew up") } else { String::new() };
        let verdicts = claims::evaluate(&Conditions::new(campaign.design(), &runs));
        Ok((verdicts.iter().map(|verdict| verdict.holds).collect(), note))
    }

    fn header(&self) -> Vec<String> {
        let unknowns = self.unknowns.iter().map(|unknown| unknown.path.clone());
        let claims = claims::names().map(|name| format!("holds: {name}"));
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
        let holding = |index: usize| admissible.iter().filter(|evaluated| evaluated.holds[index] == Some(true)).count();
        let claims = claims::names().enumerate().map(|(index, name)| (name.to_owned(), holding(index))).collect();
        let score =
            |index: &usize| (evaluated[*index].note.is_empty(), evaluated[*index].held(), std::cmp::Reverse(*index));
        let best = (0..evaluated.len()).max_by_key(score).unwrap_or(0);
        let best_holds = claims::names().zip(&evaluated[best].holds).filter(|(_, holds)| **holds == Some(true));
        let values = self.pairs(&evaluated[best].values).into_iter().map(|(path, value)| (path.to_owned(), value));
        Found {
            sets: evaluated.len(),
            admissible: admissible.len(),
            claims,
            best: best + 1,
            best_holds: best_holds.map(|(name, _)| name.to_owned()).collect(),
            values: values.collect(),
            file,
        }
    }
}
