//! `scram learn straight`

use std::path::Path;

use ::learn::gait::End;
use ::learn::straight::{self, Found, STRAIGHT_TURNS_PER_M, Steered, Walked};
use clap::Args;
use miette::{IntoDiagnostic, Report};
use plot::{Straightness, straightness_svg, under_title};
use serde::Serialize;

use super::super::run_directory::LEARNED;
use super::super::{Done, print, print_json, say, table, write};
use super::{Options, SETTINGS, bar, ended, written};

/// Files of a search.
const FOUND: &str = "straight.json";
const PICTURE: &str = "straight.svg";
/// Rows of the table, at most: the straightest and the fastest of the front are among them.
const ROWS: usize = 8;
/// Off a line of 200 mm, mm: within it a robot is said to walk straight.
const OFF_MM: f64 = 5.0;

/// Search for the two times of +F and −F that walk straight (thesis (5.3)), and steer along a line by the pose
///
/// Tries every pair of holding times of the learning file, says how fast and how straight each walks, and writes the front of both as a plot into a
/// directory of its own, out/learn-0001 and so on. With --robots, so many robots drawn from the file's spreads then steer along a line by their pose,
/// with controller, motor and sensor.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(LEARNED.numbered)))]
#[command(after_help = "Examples:\n  \
    scram learn straight\n  \
    scram learn straight --robots 100 --settings learn.toml --robot robots/thesis.toml\n\n\
    docs/learning.md describes the learning file, the method and what is reached.")]
pub struct StraightCommand {
    /// Let so many robots drawn from the file's spreads steer along a line
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    robots: usize,
    #[command(flatten)]
    options: Options,
}

#[derive(Serialize)]
struct Output<'a> {
    frequency_hz: f64,
    found: &'a Found,
    steered: &'a [Steered],
}

impl StraightCommand {
    pub fn run(&self) -> Done {
        self.options.fill(|out| self.search(out))
    }

    fn search(&self, out: &Path) -> Result<(), Report> {
        let settings = self.options.settings()?;
        settings.straight.check()?;
        write(&out.join(SETTINGS), &settings.text())?;
        let robot = self.options.robot()?;
        let bar = bar(0, 0);
        bar.set_message("holding times");
        let found = straight::search(&robot, &settings.straight, self.options.threads, &mut |tried, all| {
            bar.set_length(all as u64);
            bar.set_position(tried as u64);
        })?;
        bar.finish_and_clear();
        let mut steered = Vec::new();
        if self.robots > 0 {
            say(&format!("{} robots steer along a line", self.robots));
            steered = straight::steered(&robot, &settings.straight, &found, self.robots, self.options.threads)?;
        }
        let title = format!("walking straight, {}", self.options.common.robot.display());
        write(&out.join(PICTURE), &under_title(&title, &picture(&found)?))?;
        let output = Output { frequency_hz: settings.straight.frequency_hz, found: &found, steered: &steered };
        write(&out.join(FOUND), &serde_json::to_string_pretty(&output).into_diagnostic()?)?;
        if self.options.common.json {
            return print_json(&output);
        }
        print(&shown(&found, settings.straight.frequency_hz));
        if !steered.is_empty() {
            print(&format!("\n{}", steered_table(&steered, settings.straight.distance_m)));
        }
        written(out, &[FOUND, PICTURE, SETTINGS]);
        Ok(())
    }
}

fn shown(found: &Found, hz: f64) -> String {
    let row = |name: String, walked: &Walked| {
        vec![
            name,
            format!("{:.2}", walked.speed_mm_per_s),
            format!("{:.2}", walked.path_mm_per_s),
            format!("{:.3}", walked.turns_per_m),
        ]
    };
    let header = ["signal", "speed / mm/s", "along the path / mm/s", "turns a metre"];
    let constant = [hz, -hz].into_iter().zip(&found.constant).map(|(hz, walked)| row(format!("{hz} Hz"), walked));
    // Thinned evenly, the first and the last one kept.
    let last = found.front.len().saturating_sub(1);
    let mut shown: Vec<usize> =
        (0..ROWS.min(found.front.len())).map(|i| i * last / (ROWS - 1).min(last).max(1)).collect();
    shown.dedup();
    let alternation = |place: usize| {
        let walked = &found.alternations[found.front[place]];
        let [forward, backward] = walked.held_s;
        row(format!("{hz} Hz for {forward:.1} s, −{hz} Hz for {backward:.1} s"), walked)
    };
    let text = table::columns(&header, constant.chain(shown.into_iter().map(alternation)));
    let constant = found.constant.iter().map(|walked| walked.path_mm_per_s).fold(0.0, f64::max);
    let words = found.best.map_or_else(
        || format!("no pair of times walks with less than {STRAIGHT_TURNS_PER_M} turns a metre"),
        |best| {
            let Walked { held_s: [forward, backward], speed_mm_per_s, turns_per_m, .. } = &found.alternations[best];
            let share = 100.0 * speed_mm_per_s / constant;
            format!(
                "the fastest under {STRAIGHT_TURNS_PER_M} turns a metre: t₁ = {forward:.1} s, t₂ = {backward:.1} s, {turns_per_m:.3} turns \
                 a metre at {share:.0} % of one frequency's speed"
            )
        },
    );
    format!("{text}\n{words}")
}

fn steered_table(steered: &[Steered], distance_m: f64) -> String {
    let walked = format!("walked {:.0} mm", 1e3 * distance_m);
    let within = format!("within {OFF_MM:.0} mm of the line");
    let header =
        ["drawn robots", &walked, &within, "median / s", "farthest off / mm", "stood", "stopped", "out of time"];
    let is_within = |one: &&Steered| one.end == End::Arrived && one.farthest_off_mm < OFF_MM;
    let [arrived, median, stood, stopped, out_of_time] = ended(steered.iter().map(|one| (one.end, one.arrived_s)));
    let row = vec![
        "by their pose".to_owned(),
        arrived,
        steered.iter().filter(is_within).count().to_string(),
        median,
        format!("{:.1}", steered.iter().map(|one| one.farthest_off_mm).fold(0.0, f64::max)),
        stood,
        stopped,
        out_of_time,
    ];
    table::columns(&header, [row])
}

fn picture(found: &Found) -> Result<String, Report> {
    let of = |walked: &Walked| Straightness { speed_mm_per_s: walked.speed_mm_per_s, turns_per_m: walked.turns_per_m };
    let along = |walked: &Walked| Straightness { speed_mm_per_s: walked.path_mm_per_s, ..of(walked) };
    let all: Vec<Straightness> = found.alternations.iter().map(of).collect();
    let constant: Vec<Straightness> = found.constant.iter().map(along).collect();
    Ok(straightness_svg(&all, &found.front, &constant, STRAIGHT_TURNS_PER_M)?)
}
