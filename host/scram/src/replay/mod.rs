//! A recording seen again: what happened, and what the current controller would do with the same samples and commands.
//!
//! The samples are fixed (open loop): once the controller decides otherwise, the shaft of the recording does not follow it.
//! So a difference shows that and where decisions change, not how the new run would go on.

mod compare;
mod decide;
mod history;
mod picture;
mod trail;

use std::collections::VecDeque;
use std::path::Path;

use control::State;
use robot_file::Robot;
use serde::Serialize;

use crate::progress;
use recording::{
    Entry, FullRow, Loaded, Metadata, Progress, ReadOptions, RecordingError, SessionEvent, require_same_rig,
};

pub use compare::{First, Quantity, Shown, Worst};
pub use picture::{COMPARISON, OVERVIEW};

use compare::Comparison;
use decide::{Answered, Decider};
use history::History;

/// The period of the rows may be off the controller's by this share: more is another tick.
const TICK_TOLERANCE: f64 = 0.1;
/// Rows whose period is looked at.
const ROWS_OF_PERIOD: usize = 200;

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// Ticks in the recording.
    pub rows: u64,
    /// From the first to the last, s.
    pub seconds: f64,
    /// Ticks missing between them.
    pub missed_ticks: u64,
    /// In how many gaps.
    pub gaps: u64,
    /// Commands that a controller understands, without repeats.
    pub orders: u64,
    /// Whether every decision (bridge, duty, state, fault) is the same; null where there is no comparison.
    pub same: Option<bool>,
    /// Conclusion, as a sentence.
    pub verdict: String,
    /// One a quantity; empty where there is no comparison.
    pub compared: Vec<Quantity>,
    /// Why there is no comparison, or none of some quantity.
    pub not_compared: Vec<String>,
    /// What a person should know of the file and of how it was read.
    pub notes: Vec<String>,
}

/// A recording seen again.
pub struct Replay {
    /// Numbers and words.
    pub findings: Findings,
    /// "scram-26, freq:7, seed 1": what the file says of whom and what it recorded; empty where it says nothing.
    pub recorded: String,
    history: History,
}

impl Replay {
    /// The pictures by name, without `.svg`: [`OVERVIEW`], and [`COMPARISON`] where there is one.
    ///
    /// # Errors
    /// The drawing library refuses.
    pub fn pictures(&self) -> Result<Vec<(&'static str, String)>, plot::PlotError> {
        let mut drawn = vec![(OVERVIEW, self.history.overview()?)];
        if self.findings.same.is_some() {
            drawn.push((COMPARISON, self.history.comparison()?));
        }
        Ok(drawn)
    }
}

/// Reads a recording twice: once to check it, once to see every tick of it.
///
/// # Errors
/// The file cannot be read, or has several robots and none was named. What stands in the way of a comparison is told in
/// [`Findings::not_compared`].
pub fn replay(path: &Path, robot_name: Option<&str>, robot: &Robot) -> Result<Replay, RecordingError> {
    let progress = Some(progress::bar as Progress);
    let options = ReadOptions { robot: robot_name.map(str::to_owned), progress, ..ReadOptions::default() };
    let loaded = recording::load_with(path, &options)?;
    let answers = decide::answers(&recording::events(path)?, robot_name);
    let recorded = recorded(&loaded.metadata, robot_name);
    let mut pass = Pass::new(&loaded, robot, answers);
    recording::entries_with(path, robot_name, progress, &mut |entry| pass.take(&entry))?;
    // What was dropped to bound memory was dropped from the check only.
    let notes = loaded.notes.into_iter().filter(|note| !note.contains("rows were kept")).collect();
    Ok(pass.finish(notes, recorded))
}

fn recorded(metadata: &Metadata, robot_name: Option<&str>) -> String {
    let robot = robot_name.map(str::to_owned).or_else(|| metadata.robot.clone());
    let seed = metadata.seed.map(|seed| format!("seed {seed}"));
    [robot, metadata.excitation.clone(), seed].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// One pass over all entries.
struct Pass {
    decider: Option<Decider>,
    comparison: Comparison,
    history: History,
    obstacles: Vec<String>,
    notes: Vec<String>,
    /// Usual time from row to row, s.
    period: f64,
    start: Option<State>,
    rows: u64,
    first_s: f64,
    last: Option<FullRow>,
    missed: u64,
    gaps: u64,
    orders: u64,
}

impl Pass {
    fn new(loaded: &Loaded, robot: &Robot, answers: VecDeque<Answered>) -> Self {
        let mut obstacles = Vec::new();
        if let Err(other) = require_same_rig(loaded, robot) {
            obstacles.push(other.to_string());
        }
        let mut tick_s = description_tick(robot);
        let mut decider = None;
        match robot_file::design::parameters(robot) {
            Ok(parameters) => {
                tick_s = f64::from(parameters.tick);
                match Decider::new(&parameters, answers) {
                    Ok(designed) => decider = Some(designed),
                    Err(e) => obstacles.push(format!("the controller refuses its parameters: {e}")),
                }
            }
            Err(e) => obstacles.push(format!("no controller for this robot: {e}")),
        }
        let period = period(&loaded.recording.t_s).unwrap_or(tick_s);
        if (period / tick_s - 1.0).abs() > TICK_TOLERANCE {
            obstacles.push(format!(
                "the rows are {:.3} ms apart, but the controller's tick is {:.3} ms",
                1e3 * period,
                1e3 * tick_s
            ));
        }
        Self {
            decider,
            comparison: Comparison::default(),
            history: History::new(robot),
            obstacles,
            notes: Vec::new(),
            period,
            start: loaded.metadata.start_state,
            rows: 0,
            first_s: 0.0,
            last: None,
            missed: 0,
            gaps: 0,
            orders: 0,
        }
    }

    fn take(&mut self, entry: &Entry) {
        match entry {
            Entry::Row(row) => self.row(row),
            Entry::Event(event) => {
                if let SessionEvent::Command { repeat: false, .. } = event.event {
                    self.orders += u64::from(decide::command(&event.event).is_some());
                }
                if let Some(decider) = &mut self.decider {
                    decider.event(event);
                }
                self.history.event(event);
            }
            Entry::Link { t_s, quality } => self.history.link(*t_s, quality),
        }
    }

    fn row(&mut self, row: &FullRow) {
        match self.last {
            None => self.begin(row),
            Some(last) => {
                let missed = self.missed_between(&last, row);
                self.missed += missed;
                self.gaps += u64::from(missed > 0);
                if missed > 0 {
                    self.history.gap(row.t_s);
                }
            }
        }
        self.rows += 1;
        self.last = Some(*row);
        let decided = self.decider.as_mut().and_then(|decider| decider.tick(row));
        if let Some(decided) = &decided {
            self.comparison.take(row, decided);
        }
        self.history.row(row, decided.as_ref());
    }

    fn begin(&mut self, row: &FullRow) {
        self.first_s = row.t_s;
        let Some(stated) = row.stated else { return };
        let restarted = stated.fault == Some(control::Fault::Restarted);
        if let Some(decider) = &mut self.decider
            && (restarted || self.start == Some(State::Fault))
        {
            decider.restart();
        } else if self.start.is_none() && stated.state != State::Idle {
            self.notes.push(format!(
                "the recording begins with the robot in the state {:?}; the current controller begins in Idle",
                stated.state
            ));
        }
        if row.is_radio {
            self.notes.push(
                "from telemetry: compared to half a step of the radio's values; the heartbeat is taken to have arrived"
                    .into(),
            );
        }
    }

    fn missed_between(&self, last: &FullRow, row: &FullRow) -> u64 {
        match (last.tick, row.tick) {
            (Some(from), Some(to)) => to.saturating_sub(from).saturating_sub(1),
            _ => (((row.t_s - last.t_s) / self.period).round() as u64).saturating_sub(1),
        }
    }

    fn finish(mut self, mut notes: Vec<String>, recorded: String) -> Replay {
        if self.last.is_some_and(|row| row.duty.is_none()) {
            self.obstacles.push("the recording has voltages and no duty".into());
        }
        if self.last.is_some_and(|row| row.adc.is_none() && row.angle_code.is_none()) && self.comparison.rows() == 0 {
            self.obstacles.push(
                "no codes of the angle sensor are recorded (`adc`, or `angle_code` of a digital one), which the \
                 controller reads"
                    .into(),
            );
        }
        if self.orders == 0 {
            self.obstacles.push(
                "no orders are recorded, so nobody knows what the controller was told (recordings of `scram calibrate` and \
                 of other programs hold none, nor do those of `scram sim` before orders were recorded)"
                    .into(),
            );
        }
        if let Some(decider) = &self.decider {
            notes.extend(decider.notes());
        }
        notes.append(&mut self.notes);
        let (compared, mut not_compared) = self.comparison.quantities();
        let possible = self.obstacles.is_empty();
        if !possible {
            not_compared = self.obstacles;
        }
        let compared = if possible { compared } else { Vec::new() };
        let same = possible.then(|| compared.iter().all(|q| !q.is_decision || q.different == 0));
        let inexact = self.decider.as_ref().is_some_and(Decider::rounds_times);
        let verdict =
            if possible { verdict(&compared, inexact) } else { "no comparison with the current controller".into() };
        let findings = Findings {
            rows: self.rows,
            seconds: self.last.map_or(0.0, |last| last.t_s - self.first_s),
            missed_ticks: self.missed,
            gaps: self.gaps,
            orders: self.orders,
            same,
            verdict,
            compared,
            not_compared,
            notes,
        };
        Replay { findings, recorded, history: self.history }
    }
}

fn description_tick(robot: &Robot) -> f64 {
    robot.controller.as_ref().map_or(1e-3, |controller| controller.tick_s.value)
}

/// The usual period of the first rows, s.
fn period(t_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = t_s.windows(2).take(ROWS_OF_PERIOD).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied()
}

/// What differs first among decisions, or else among beliefs. `inexact`: the samples' times are rounded to the ticks, which
/// by itself moves the numbers a little, but neither states nor the bridge.
fn verdict(compared: &[Quantity], inexact: bool) -> String {
    let decisions = || compared.iter().filter(|q| q.is_decision);
    let words_agree = decisions().filter(|q| q.rms.is_none()).all(|q| q.different == 0);
    if inexact && words_agree && decisions().any(|q| q.different > 0) {
        let apart = decisions().filter_map(|q| Some(format!("{} by {:.2e} RMS", q.name, q.rms?)));
        return format!(
            "the current controller takes the same states; {} apart, of which the rounded sample times are a part",
            apart.collect::<Vec<_>>().join(", ")
        );
    }
    let earliest = |decisions: bool| {
        let differing = compared.iter().filter(|q| q.is_decision == decisions);
        let firsts = differing.filter_map(|q| q.first.as_ref().map(|first| (q, first)));
        firsts.min_by(|a, b| a.1.t_s.total_cmp(&b.1.t_s))
    };
    let said = |(q, first): (&Quantity, &First)| {
        let unit = if q.unit.is_empty() { String::new() } else { format!(" {}", q.unit) };
        format!("{} at {:.3} s: {}{unit} recorded, {}{unit} now", q.name, first.t_s, first.recorded, first.replayed)
    };
    match (earliest(true), earliest(false)) {
        (Some(decision), _) => format!("the current controller decides otherwise; first {}", said(decision)),
        (None, Some(belief)) => {
            format!("the current controller decides the same, but believes otherwise; first {}", said(belief))
        }
        (None, None) => "the current controller decides the same".into(),
    }
}
