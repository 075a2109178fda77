//! `scram learn turn`

use std::path::{Path, PathBuf};

use ::learn::turning::{self, Contender, Judged, Robots};
use ::learn::{Direction, Gait, Played, PolicyFile, Progress, Saved, Training};
use clap::Args;
use miette::{IntoDiagnostic, Report};
use plot::{TurningRun, turning_svg, under_title};
use robot_file::gait::{GaitFile, GaitStep};
use serde::Serialize;
use serde::ser::SerializeMap;

use super::super::run_directory::LEARNED;
use super::super::{Done, print, print_json, say, table, write};
use super::{Begin, Options, SETTINGS, bar, read, written};

/// Files of a training.
const TRAINING: &str = "training.json";
const POLICY: &str = "policy.json";
const CURVE: &str = "curve.csv";
const PICTURE: &str = "turn.svg";
const GAIT: &str = "gait.toml";

/// Episodes on the file's robot by which a gait is judged; they differ by the angle of the shaft at their start.
const STARTS: usize = 16;

/// Learn to turn in place by proximal policy optimisation (thesis section 5.3)
///
/// The robot acts every Δt by one of ten frequencies; the reward is the thesis's (5.5). All numbers are in a learning file; without one they
/// are the thesis's, and where it is silent chosen ones. Writes the policy, what it does step by step as a gait that a robot plays, the learning curve, the learning file and a picture into a directory of
/// its own, out/learn-0001 and so on, and says how fast the robot turns and how far it drifts, beside the best constant frequency and
/// the best alternation of two, the best oscillation by ±100°, and the oscillation that walks on the smallest circle. Stopped, it goes on with --resume.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(LEARNED.numbered)))]
#[command(after_help = "Examples:\n  \
    scram learn turn --direction left\n  \
    scram learn turn --direction right --settings examples/learn-turn.toml --seed 7\n  \
    scram learn turn --resume out/learn-0001\n\n\
    docs/learning.md describes the learning file, the method and what is reached.")]
pub struct TurnCommand {
    #[command(flatten)]
    begin: Begin,
    /// Judge on so many robots drawn from the file's spreads, too, with controller, motor and sensor
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    robots: usize,
    #[command(flatten)]
    options: Options,
}

/// A gait that was judged.
#[derive(Serialize)]
struct Row {
    #[serde(flatten, serialize_with = "of_contender")]
    contender: Contender,
    /// On the file's robot.
    nominal: Judged,
    /// On robots drawn from its spreads.
    drawn: Option<Judged>,
    /// The first episode on the file's robot.
    #[serde(skip)]
    first: Option<Played>,
}

/// What of a contender is printed: its name, its gait (but for a policy, which has a file of its own), and how many episodes it took.
fn of_contender<S: serde::Serializer>(contender: &Contender, to: S) -> Result<S::Ok, S::Error> {
    let mut map = to.serialize_map(None)?;
    map.serialize_entry("name", &contender.name)?;
    map.serialize_entry("episodes_tried", &contender.tried)?;
    if !matches!(contender.gait, Gait::Policy(_)) {
        map.serialize_entry("gait", &contender.gait)?;
    }
    map.end()
}

#[derive(Serialize)]
struct Output<'a> {
    direction: Direction,
    updates: usize,
    steps: usize,
    gaits: &'a [Row],
    files: Vec<PathBuf>,
}

impl TurnCommand {
    pub fn run(&self) -> Done {
        match &self.begin.resume {
            Some(directory) => self.go_on(directory)?,
            None => LEARNED.fill(&self.options.common.out, self.options.overwrite, |out| self.begin(out))?,
        }
        Ok(())
    }

    fn begin(&self, out: &Path) -> Result<(), Report> {
        let settings = self.options.settings()?;
        let direction = self.begin.direction();
        write(&out.join(SETTINGS), &settings.text())?;
        let training =
            Training::new(self.options.robot()?, settings, direction, self.options.common.seed, self.options.threads)?;
        self.train(training, out)
    }

    fn go_on(&self, directory: &Path) -> Result<(), Report> {
        let saved: Saved = read(&directory.join(TRAINING), "no training")?;
        self.train(Training::resume(self.options.robot()?, saved, self.options.threads)?, directory)
    }

    /// Learns to the end, keeping what it takes to go on after every update, and judges what was learned.
    fn train(&self, mut training: Training, out: &Path) -> Result<(), Report> {
        let bar = bar(training.settings().turn.updates, training.curve().len());
        while let Some(progress) = training.advance()? {
            bar.set_message(words(progress));
            bar.inc(1);
            if bar.is_hidden() {
                say(&format!("update {}: {}", progress.updates, words(progress)));
            }
            write(&out.join(TRAINING), &serde_json::to_string(&training.saved()).into_diagnostic()?)?;
        }
        bar.finish_and_clear();
        self.save(&training, out)?;
        let rows = self.judge(&training)?;
        self.write_gait(&training, &rows, &out.join(GAIT))?;
        let title = format!("turning {}, {}", training.direction().word(), self.options.common.robot.display());
        write(&out.join(PICTURE), &under_title(&title, &picture(&rows)?))?;
        let names = [POLICY, GAIT, CURVE, SETTINGS, PICTURE].into_iter().filter(|name| out.join(name).exists());
        let names: Vec<&str> = names.collect();
        if self.options.common.json {
            let steps = training.curve().last().map_or(0, |last| last.steps);
            let (direction, updates) = (training.direction(), training.curve().len());
            let files = names.iter().map(|name| out.join(name)).collect();
            return print_json(&Output { direction, updates, steps, gaits: &rows, files });
        }
        print(&shown(&rows));
        written(out, &names);
        Ok(())
    }

    fn save(&self, training: &Training, out: &Path) -> Result<(), Report> {
        let file = PolicyFile {
            robot: training.robot().to_owned(),
            direction: training.direction(),
            seed: training.seed(),
            updates: training.curve().len(),
            settings: training.settings().clone(),
            policy: training.policy(),
        };
        write(&out.join(POLICY), &serde_json::to_string(&file).into_diagnostic()?)?;
        write(&out.join(CURVE), &curve(training.curve()))
    }

    /// What the policy does on the file's robot, step by step, for robots that do not see their pose.
    fn write_gait(&self, training: &Training, rows: &[Row], path: &Path) -> Result<(), Report> {
        let Some((learned, played)) =
            rows.iter().find_map(|row| Some((&row.contender.definition, row.first.as_ref()?)))
        else {
            return Ok(());
        };
        let known = learned.actions();
        let steps: Vec<GaitStep> = played.actions.iter().map(|action| known[*action]).collect();
        let (direction, seed) = (training.direction().word(), training.seed());
        let mut gait = match GaitFile::new(&format!("turn-{direction}"), learned.interval_s, true, &steps) {
            Ok(gait) => gait,
            // A learning file may ask for what no robot plays: longer episodes, more frequencies.
            Err(error) => {
                say(&format!("no {GAIT}, since robots play no such gait: {error}"));
                return Ok(());
            }
        };
        let told = self.options.settings.as_ref().map(|file| format!(" --settings {}", file.display()));
        let command = format!("scram learn turn --direction {direction} --seed {seed}{}", told.unwrap_or_default());
        let alpha = learned.alpha_deg.map(|alpha_deg| ("alpha_deg", alpha_deg.to_string()));
        let made_by = [
            ("robot", self.options.common.robot.display().to_string()),
            ("seed", seed.to_string()),
            ("command", command),
        ];
        gait.made_by = made_by.into_iter().chain(alpha).map(|(key, text)| (key.to_owned(), text)).collect();
        Ok(gait.save(path)?)
    }

    /// The learned gait and the best of those that need no policy, each with its episodes on the file's robot and on drawn ones.
    fn judge(&self, training: &Training) -> Result<Vec<Row>, Report> {
        let settings = training.settings();
        let file = self.options.robot()?;
        let bar = bar(0, 0);
        bar.set_message("gaits without a policy");
        let told = (settings, training.direction());
        let contenders =
            turning::contenders(&file, told, training.policy(), self.options.threads, &mut |tried, all| {
                bar.set_length(all as u64);
                bar.set_position(tried as u64);
            })?;
        bar.finish_and_clear();
        let row = |contender: Contender| {
            let episodes = |robots: Robots, count: usize| {
                turning::episodes(&file, &contender, robots, count, self.options.threads)
            };
            let judged = |played: &[Played]| turning::judged(played, &contender, settings.turn.interval_s);
            let nominal = episodes(Robots::Nominal, STARTS)?;
            let drawn = if self.robots > 0 { Some(judged(&episodes(Robots::Drawn, self.robots)?)) } else { None };
            let first = nominal.first().cloned();
            Ok(Row { nominal: judged(&nominal), drawn, first, contender })
        };
        contenders.into_iter().map(row).collect()
    }
}

fn words(progress: &Progress) -> String {
    let sum = progress.mean_return.map_or_else(|| "no episode has ended".to_owned(), |sum| format!("return {sum:.2}"));
    format!("{sum}, entropy {:.2}", progress.entropy)
}

fn shown(rows: &[Row]) -> String {
    let header = ["gait", "episodes", "return", "turning / °/s", "drift / mm a turn", "circle / mm", "farthest / mm"];
    let nominal = |row: &Row| {
        let Judged { sum_of_rewards, rate_deg_per_s, drift_mm_per_turn, radius_mm, farthest_mm, .. } = row.nominal;
        vec![
            row.contender.name.clone(),
            row.contender.tried.to_string(),
            format!("{sum_of_rewards:.2}"),
            format!("{rate_deg_per_s:.2}"),
            drift(drift_mm_per_turn),
            drift(radius_mm),
            format!("{farthest_mm:.1}"),
        ]
    };
    let table = table::columns(&header, rows.iter().map(nominal));
    let drawn: Vec<_> = rows.iter().filter_map(|row| Some((&row.contender.name, row.drawn.as_ref()?))).collect();
    if drawn.is_empty() {
        return table;
    }
    let header = [
        "on drawn robots",
        "return",
        "turning / °/s",
        "a tenth below",
        "a tenth above",
        "drift / mm a turn",
        "to the end",
    ];
    let row = |(name, judged): (&String, &Judged)| {
        let [slow, fast] = judged.rates_deg_per_s;
        vec![
            name.clone(),
            format!("{:.2}", judged.sum_of_rewards),
            format!("{:.2}", judged.rate_deg_per_s),
            format!("{slow:.2}"),
            format!("{fast:.2}"),
            drift(judged.drift_mm_per_turn),
            format!("{:.0} %", 100.0 * judged.to_the_end),
        ]
    };
    format!("{table}\n\n{}", table::columns(&header, drawn.into_iter().map(row)))
}

/// A robot that hardly turns drifts by metres for a turn: no number to compare.
fn drift(mm_per_turn: f64) -> String {
    if mm_per_turn < 1e4 { format!("{mm_per_turn:.1}") } else { "–".to_owned() }
}

fn curve(curve: &[Progress]) -> String {
    let header = "updates,steps,mean_return,episodes,entropy,divergence,clipped,value_error\n".to_owned();
    curve.iter().fold(header, |text, one| {
        let mean = one.mean_return.map_or_else(String::new, |mean| mean.to_string());
        let Progress { updates, steps, episodes, entropy, divergence, clipped, value_error, .. } = one;
        text + &format!("{updates},{steps},{mean},{episodes},{entropy},{divergence},{clipped},{value_error}\n")
    })
}

fn picture(rows: &[Row]) -> Result<String, Report> {
    let run = |row: &Row| {
        let (played, definition) = (row.first.as_ref()?, &row.contender.definition);
        let times = (0..played.actions.len()).map(|step| step as f64 * definition.interval_s);
        let start = played.path[0];
        let about = |pose: &tasks::Pose| {
            let tasks::Pose { x, y, heading } = pose.seen_from(start);
            [1e3 * x, 1e3 * y, heading]
        };
        let known = definition.actions();
        Some(TurningRun {
            title: row.contender.name.clone(),
            orders: times.zip(&played.actions).map(|(t, action)| (t, known[*action])).collect(),
            seconds: played.seconds,
            path: played.path.iter().map(about).collect(),
        })
    };
    // The oscillation on the smallest circle is often the best one.
    let is_new =
        |(index, row): &(usize, &Row)| rows[..*index].iter().all(|before| before.contender.gait != row.contender.gait);
    let new = rows.iter().enumerate().filter(is_new).map(|(_, row)| row);
    Ok(turning_svg("", &new.filter_map(run).collect::<Vec<_>>())?)
}
