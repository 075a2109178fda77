//! `scram learn design`

use std::path::Path;

use ::learn::design::{self, Search, Tried};
use ::learn::{Direction, LearnError, Settings};
use clap::Args;
use miette::{IntoDiagnostic, Report, WrapErr};
use plot::{DesignDot, designs_svg, under_title};
use serde::{Deserialize, Serialize};

use super::super::run_directory::LEARNED;
use super::super::{Done, print, print_json, say, table, write};
use super::{Begin, Options, SETTINGS, bar, read, written};

/// What is written.
const FOUND: &str = "designs.json";
const PICTURE: &str = "designs.svg";

/// Search for the robot that walks and turns best: roll angles, modules, eccentric (thesis 6.2)
///
/// Every design is trained to turn for a few updates, as by `scram learn turn`, and tried with signals that walk straight. Says which designs
/// nothing beats in both, and writes all of them after each one, with a picture, into a directory of its own, out/learn-0001 and so on.
/// Stopped, it goes on with --resume.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(LEARNED.numbered)))]
#[command(after_help = "Examples:\n  \
    scram learn design --direction left\n  \
    scram learn design --resume out/learn-0001\n\n\
    docs/learning.md describes the learning file, the method and what is reached.")]
pub struct DesignCommand {
    #[command(flatten)]
    begin: Begin,
    #[command(flatten)]
    options: Options,
}

/// All of a search.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    robot: String,
    direction: Direction,
    seed: u64,
    settings: Settings,
    tried: Vec<Tried>,
    /// Places in `tried`, the fastest walker first.
    front: Vec<usize>,
}

impl DesignCommand {
    pub fn run(&self) -> Done {
        match &self.begin.resume {
            Some(directory) => self.search(read(&directory.join(FOUND), "no search for designs")?, directory)?,
            None => LEARNED.fill(&self.options.common.out, self.options.overwrite, |out| self.begin(out))?,
        }
        Ok(())
    }

    fn begin(&self, out: &Path) -> Result<(), Report> {
        let settings = self.options.settings()?;
        write(&out.join(SETTINGS), &settings.text())?;
        let saved = Saved {
            robot: self.options.robot()?.robot().name.clone(),
            direction: self.begin.direction(),
            seed: self.options.common.seed,
            settings,
            tried: Vec::new(),
            front: Vec::new(),
        };
        self.search(saved, out)
    }

    /// Tries designs to the end, keeping all of them after each.
    fn search(&self, mut saved: Saved, out: &Path) -> Result<(), Report> {
        let robot = self.options.robot()?.robot().clone();
        LearnError::unless_same(&saved.robot, &robot.name)?;
        let file = &self.options.common.robot;
        let told = (&saved.settings, saved.direction);
        let search = Search::new((file, robot), told, saved.seed, self.options.threads)?;
        let bar = bar(saved.settings.design.designs, saved.tried.len());
        while saved.tried.len() < saved.settings.design.designs {
            let design = search.next(&saved.tried);
            let number = saved.tried.len() + 1;
            let tried = search.evaluate(design).wrap_err_with(|| format!("design {number}"))?;
            bar.inc(1);
            if bar.is_hidden() {
                say(&format!("design {number}: {}", words(&tried)));
            }
            saved.tried.push(tried);
            saved.front = design::front(&saved.tried);
            write(&out.join(FOUND), &serde_json::to_string_pretty(&saved).into_diagnostic()?)?;
        }
        bar.finish_and_clear();
        let title = format!("designs, turning {}, {}", saved.direction.word(), file.display());
        write(&out.join(PICTURE), &under_title(&title, &picture(&saved)?))?;
        if self.options.common.json {
            return print_json(&saved);
        }
        print(&shown(&saved));
        written(out, &[FOUND, PICTURE, SETTINGS]);
        Ok(())
    }
}

fn words(tried: &Tried) -> String {
    format!("walks {:.2} mm/s, turns {:.2} °/s", tried.speed_mm_per_s, tried.turning_deg_per_s)
}

/// The file's own design and those of the front.
fn shown(saved: &Saved) -> String {
    let header = ["design", "modules", "rolls / °", "m·r / file's", "walking / mm/s", "turning / °/s", "circle / mm"];
    let own = (!saved.front.contains(&0)).then_some(0);
    let row = |place: usize| {
        let Tried { design, speed_mm_per_s, turning_deg_per_s, radius_mm, .. } = &saved.tried[place];
        let rolls: Vec<String> = design.rolls_deg().iter().map(|roll| format!("{roll:.0}")).collect();
        vec![
            if place == 0 { "the file's".to_owned() } else { (place + 1).to_string() },
            design.modules().to_string(),
            rolls.join(", "),
            format!("{:.2}", design.eccentric_share),
            format!("{speed_mm_per_s:.2}"),
            format!("{turning_deg_per_s:.2}"),
            format!("{radius_mm:.0}"),
        ]
    };
    let table = table::columns(&header, own.into_iter().chain(saved.front.iter().copied()).map(row));
    let simulated = saved.tried.iter().map(|tried| tried.simulated_s).sum::<f64>();
    let (all, best) = (saved.tried.len(), saved.front.len());
    format!(
        "{table}\n{all} designs, {:.1} simulated hours; none of them both walks and turns faster than one of {best}",
        simulated / 3600.0
    )
}

fn picture(saved: &Saved) -> Result<String, Report> {
    let dot =
        |tried: &Tried| DesignDot { speed_mm_per_s: tried.speed_mm_per_s, turning_deg_per_s: tried.turning_deg_per_s };
    Ok(designs_svg(&saved.tried.iter().map(dot).collect::<Vec<_>>(), &saved.front)?)
}
