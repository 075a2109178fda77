//! `scram sweep`

mod words;

use std::path::PathBuf;

use clap::Args;
use hal_sim::body::{Plan, Precision};
use miette::{Report, miette};
use plot::{figures, under_title};
use robot_file::edit::Document;
use serde::Serialize;
use sweep::claims::{self, ClaimResult};
use sweep::{
    ArgumentError, Axis, Campaign, Component, Conditions, Factor, Lock, LockError, Measured, Robustness, RunSettings,
    Scatter, Search, Stat, SweepArguments, SweepError, Swept, Target, VariantBuilder,
};
use words::{Bar, claim_text, robustness_table, search_text, speeds_table, warn_notes, warn_unmatched};

use super::{Common, Done, Failure, print, print_json, say};

/// Conditions that a table on the screen shows.
const MOST_SHOWN: usize = 60;

/// Run the robot on the ground under many conditions, several times each, over all cores
///
/// Without --axis: the thesis's experiments, f = ±6, ±7, ±8 Hz and α = 0, 60, 90, 120°. Writes a table with a row a run
/// (sweep.csv), what was swept (sweep.toml) and plots (SVG) into --out. Killed, it goes on where it was when the same is
/// run again. f is positive clockwise seen from above; speeds are means over the second half of a run, in the frame of
/// its start: vx ahead, vy to the left, yaw counter-clockwise.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    scram sweep --sensitivity                        the thesis's Figs 3.4, 3.5, 5.1 and 5.2\n  \
    scram sweep --measured speeds.csv                beside measured speeds, with the error (5.1)\n  \
    scram sweep --axis f=7 --axis ground.friction=0.5:1.0:6\n  \
    scram sweep --axis 'backbone.roll_deg[1]=0:90:7' --axis 'backbone.roll_deg[3]=0:90:7'\n  \
    scram sweep --axis body.modules=2:8:7 --axis f=-7,7 --drive ideal\n  \
    scram sweep --claims                             what the thesis says, and whether it holds\n  \
    scram sweep --search 500                         numbers for which most of it holds\n\n\
    Axes: f (Hz), alpha (deg), swing (deg: the shaft swings between 0 and there), body.modules, backbone.roll_deg[N], or any \
    quantity of the robot file. With --axis only \
    what is named varies; f is then 7 Hz and α the file's unless named. See docs/sweep.md.")]
pub struct Sweep {
    #[command(flatten)]
    runs: SweepArguments,
    /// Measured speeds to compare with: f_hz, alpha_deg, vx_mm_per_s, vy_mm_per_s, yaw_deg_per_s
    #[arg(long, value_name = "CSV", conflicts_with_all = ["claims", "search"])]
    measured: Option<PathBuf>,
    /// Judge the thesis's qualitative claims
    #[arg(long, conflicts_with_all = ["axes", "sensitivity", "search"])]
    claims: bool,
    /// Try so many sets of the unknown numbers, within the robot file's spreads, for one that makes most claims hold
    #[arg(long, value_name = "SETS", conflicts_with_all = ["axes", "sensitivity", "robots"],
        value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    search: Option<u32>,
    /// Threads [default: one a core]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Begin anew: delete what --out has of an earlier sweep
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    common: Common,
}

/// What `--json` prints and `sweep.json` has.
#[derive(Serialize)]
struct Summary {
    robot: String,
    runs: usize,
    resumed: usize,
    /// Runs without speeds.
    blown_up: usize,
    /// Runs with a note.
    notes: usize,
    conditions: Vec<Line>,
    #[serde(skip_serializing_if = "Option::is_none")]
    robustness: Option<Vec<(Component, Robustness)>>,
    /// Where robots have several runs each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    scatter: Vec<(Component, Scatter)>,
    files: Vec<PathBuf>,
}

#[derive(Serialize)]
struct Line {
    /// By axis.
    point: serde_json::Map<String, serde_json::Value>,
    vx_mm_per_s: Stat,
    vy_mm_per_s: Stat,
    yaw_deg_per_s: Stat,
    energy_j_per_m: Stat,
}

/// What `--claims --json` prints.
#[derive(Serialize)]
struct Judged<'a> {
    robot: &'a str,
    holds: usize,
    of: usize,
    claims: &'a [ClaimResult],
    file: &'a PathBuf,
}

impl Sweep {
    pub fn run(&self) -> Done {
        let axes = Axis::parse_all(&self.runs.axes).map_err(|error| Failure::Usage(error.into()))?;
        let robot = self.common.robot()?;
        let document = Document::load(&self.common.robot).map_err(Report::from)?;
        self.runs.settings().check_step(&robot).map_err(|error| Failure::Usage(ArgumentError::from(error).into()))?;
        let builder = VariantBuilder::new(document, robot).map_err(Report::from)?;
        if let Some(sets) = self.search {
            return self.search(&builder, sets as usize);
        }
        if self.claims {
            return self.evaluate(&builder);
        }
        let measured = self.measured.as_deref().map(Measured::read).transpose().map_err(Report::from)?;
        let (swept, _lock) = self.sweep(&builder, axes)?;
        self.tell(&builder, &swept, measured.as_ref())
    }

    fn seeds(&self) -> Vec<u64> {
        self.runs.seeds(self.common.seed)
    }

    fn target<'a>(&'a self, stem: &'a str, paths: bool) -> Target<'a> {
        Target { directory: &self.common.out, stem, paths, fresh: self.fresh }
    }

    /// Makes the directory and keeps other sweeps out of it until everything is written.
    fn lock(&self) -> Result<Option<Lock>, Report> {
        let out = &self.common.out;
        std::fs::create_dir_all(out)
            .map_err(|error| miette!("the directory {} cannot be made: {error}", out.display()))?;
        match Lock::take(out) {
            Ok(lock) => Ok(Some(lock)),
            Err(busy @ LockError::Busy { .. }) => Err(busy.into()),
            Err(unavailable) => {
                say(&format!("warning: {unavailable}; run no other sweep there"));
                Ok(None)
            }
        }
    }

    /// Runs a campaign with a bar on a terminal.
    fn campaign(&self, campaign: Campaign, stem: &str, paths: bool) -> Result<(Swept, Option<Lock>), Failure> {
        let lock = self.lock()?;
        let mut bar = Bar::new("runs");
        let swept = campaign
            .run(&self.target(stem, paths), self.threads.map(usize::from), &mut |done, total| bar.show(done, total))
            .map_err(failure)?;
        bar.end();
        if swept.resumed > 0 {
            say(&format!("{} of {} runs were in {} already", swept.resumed, swept.runs.len(), swept.file.display()));
        }
        Ok((swept, lock))
    }

    fn sweep(&self, builder: &VariantBuilder, given: Vec<Axis>) -> Result<(Swept, Option<Lock>), Failure> {
        let (design, paths) =
            self.runs.design(given, self.common.seed).map_err(|error| Failure::Usage(error.into()))?;
        // Not what --sensitivity adds.
        let given = design.axes.iter().filter(|axis| axis.what != Factor::FrictionFactor).cloned().collect::<Vec<_>>();
        for warning in builder.check(&given).map_err(|error| Failure::Usage(error.into()))? {
            say(&format!("warning: {warning}"));
        }
        let campaign = Campaign::new(builder, design, self.runs.settings()).map_err(failure)?;
        self.campaign(campaign, "sweep", paths)
    }

    fn tell(&self, builder: &VariantBuilder, swept: &Swept, measured: Option<&Measured>) -> Done {
        let conditions = Conditions::new(&swept.design, &swept.runs);
        if let Some(measured) = measured {
            warn_unmatched(measured, &conditions.at_friction(1.0));
        }
        let mut files = vec![swept.file.clone()];
        files.extend(swept.paths_file.clone());
        for (name, svg) in figures::draw(swept, measured).map_err(Report::from)? {
            files.push(self.common.write(&format!("{name}.svg"), &under_title(&self.title(builder), &svg))?);
        }
        let robustness: Option<Vec<_>> =
            Component::ALL.iter().map(|c| conditions.robustness(*c).map(|r| (*c, r))).collect();
        let blown_up = swept.runs.iter().filter(|run| run.measures.vx.is_none()).count();
        let mut summary = Summary {
            robot: builder.robot().name.clone(),
            runs: swept.runs.len(),
            resumed: swept.resumed,
            blown_up,
            notes: swept.runs.iter().filter(|run| !run.note.is_empty()).count(),
            conditions: lines(&conditions),
            robustness,
            scatter: Component::ALL
                .iter()
                .filter_map(|c| Some((*c, conditions.at_friction(1.0).scatter(*c, swept.design.runs_a_robot)?)))
                .collect(),
            files,
        };
        warn_notes(swept, &summary);
        if self.common.json {
            summary.files.push(self.common.out.join("sweep.json"));
            let text = serde_json::to_string_pretty(&summary).map_err(|error| miette!("sweep.json: {error}"))?;
            self.common.write("sweep.json", &(text + "\n"))?;
            print_json(&summary)?;
            return Ok(());
        }
        let each =
            format!("{} conditions, {} runs of {} s", conditions.conditions.len(), summary.runs, self.runs.seconds);
        print(&format!("{}: {each}, drive {}", summary.robot, if self.runs.is_by_motor() { "motor" } else { "ideal" }));
        if conditions.conditions.len() <= MOST_SHOWN {
            print(&speeds_table(&conditions));
            if let Some(robustness) = &summary.robustness {
                print(&robustness_table(&conditions.at_friction(1.0), robustness));
            }
        }
        if !summary.scatter.is_empty() {
            print(&scatter_text(&summary.scatter));
        }
        print(&format!("written: {}", super::sim::listed(&summary.files)));
        Ok(())
    }

    /// Over a plot: which robot, and which runs.
    fn title(&self, builder: &VariantBuilder) -> String {
        let seeds = self.seeds();
        let runs = match seeds.as_slice() {
            [first, .., last] => {
                format!("{} runs of {} s each, seeds {first} … {last}", seeds.len(), self.runs.seconds)
            }
            _ => format!("a run of {} s each, seed {}", self.runs.seconds, self.common.seed),
        };
        let drive = if self.runs.is_by_motor() { "motor" } else { "ideal shaft" };
        format!("{}, {drive}, {runs}", builder.robot().name)
    }

    fn evaluate(&self, builder: &VariantBuilder) -> Done {
        let design = claims::design(self.seeds()).with_runs_a_robot(self.runs.runs_a_robot());
        let campaign = Campaign::new(builder, design, self.runs.settings()).map_err(failure)?;
        let (swept, _lock) = self.campaign(campaign, "claims", false)?;
        let plan = Plan::new(builder.robot()).map_err(|error| miette!("{error}"))?;
        let verdicts = claims::evaluate(&Conditions::new(&swept.design, &swept.runs), &plan);
        let holds = verdicts.iter().filter(|verdict| verdict.holds == Some(true)).count();
        let judged =
            Judged { robot: &builder.robot().name, holds, of: verdicts.len(), claims: &verdicts, file: &swept.file };
        let text = serde_json::to_string_pretty(&judged).map_err(|error| miette!("claims.json: {error}"))?;
        let json = self.common.write("claims.json", &(text + "\n"))?;
        if self.common.json {
            print_json(&judged)?;
            return Ok(());
        }
        for verdict in &verdicts {
            print(&claim_text(verdict));
        }
        print(&format!("{}: {holds} of {} claims hold", judged.robot, judged.of));
        print(&format!("written: {}", super::sim::listed(&[swept.file.clone(), json])));
        Ok(())
    }

    fn search(&self, builder: &VariantBuilder, sets: usize) -> Done {
        let _lock = self.lock()?;
        let seeds = self.runs.repeats.map_or_else(|| vec![self.common.seed], |_| self.seeds());
        let settings = RunSettings { precision: Precision::Single, ..self.runs.settings() };
        let search = Search::new(builder, sets, self.common.seed, settings, seeds);
        let mut bar = Bar::new("sets");
        let found = search
            .run(&self.target("search", false), self.threads.map(usize::from), &mut |done, total| bar.show(done, total))
            .map_err(failure)?;
        bar.end();
        let values: Vec<f64> = found.values.iter().map(|(_, value)| *value).collect();
        let mut document = search.document(&values).map_err(failure)?;
        let name = format!("{}-claims", builder.robot().name);
        let summary =
            format!("Set {} of a search for the thesis's claims: {} of them hold.", found.best, found.best_holds.len());
        document.set_name(&name, &summary).map_err(Report::from)?;
        let file = self.common.out.join("best.toml");
        self.common.save(&document, &file)?;
        if self.common.json {
            print_json(&found)?;
            return Ok(());
        }
        print(&search_text(&found));
        print(&format!("written: {}", super::sim::listed(&[found.file.clone(), file.clone()])));
        print(&format!(
            "judge it over other starts: scram sweep --claims --seed 100 --repeats 10 --robot {}",
            file.display()
        ));
        Ok(())
    }
}

/// How far runs of one robot scatter, and robots.
fn scatter_text(scatter: &[(Component, Scatter)]) -> String {
    let shares = |of: fn(&Scatter) -> Option<f64>| -> Option<String> {
        let percent = |(_, one): &(Component, Scatter)| of(one).map(|share| format!("{:.1} %", 100.0 * share));
        Some(scatter.iter().map(percent).collect::<Option<Vec<_>>>()?.join(" / "))
    };
    let runs = shares(|one| Some(one.runs)).unwrap_or_default();
    let robots = shares(|one| one.robots).map_or_else(
        || "one robot; --robots tells how far robots do".to_owned(),
        |robots| format!("robots beyond that by {robots}"),
    );
    format!("of the largest speed, vx / vy / yaw: runs of one robot scatter by {runs}, {robots}")
}

/// Axes that lead nowhere are wrong usage.
fn failure(error: SweepError) -> Failure {
    match error {
        SweepError::Axis(_) => Failure::Usage(error.into()),
        _ => Failure::Failed(error.into()),
    }
}

fn lines(conditions: &Conditions) -> Vec<Line> {
    let line = |condition: &sweep::Condition| Line {
        point: conditions.axes.iter().map(Factor::column).zip(condition.point.iter().map(|v| (*v).into())).collect(),
        vx_mm_per_s: condition.speed(Component::Longitudinal),
        vy_mm_per_s: condition.speed(Component::Lateral),
        yaw_deg_per_s: condition.speed(Component::Rotational),
        energy_j_per_m: condition.stat(|measures| measures.energy_j_per_m),
    };
    conditions.conditions.iter().map(line).collect()
}
