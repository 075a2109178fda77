//! `scram identify robot`

use std::path::{Path, PathBuf};

use ::identify::robot::{ComponentError, Options, Parameter, RobotFit, identify};
use clap::Args;
use miette::Report;
use plot::{speeds_svg, under_title};
use robot_file::edit::Document;
use serde::Serialize;

use super::super::diagnose::progress;
use super::super::measured::{MeasuredArgs, condition, held_out, kept_beside};
use super::super::run_directory::IDENTIFIED;
use super::super::{Common, Done, print, print_json, say, table, write};
use super::capture::CaptureArgs;
use super::{ROBOT, short};

/// Find what of a robot decides how it walks, from its measured speeds (thesis section 3.3)
///
/// Stiffness and damping of the hinges, the feet's law and friction, the eccentric's mass and height, and with --uneven an off-centre
/// weight and each foot's own friction, are looked for by what they do to three mean speeds under every condition. The robot file's spreads are what is believed before; what the
/// speeds tell narrows them. One condition in four is held out and judged. Writes a copy of the robot file with the numbers and their
/// intervals and a plot into a directory of its own, out/identify-0001 and so on. Killed, it goes on where it was when the same is run
/// again.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(IDENTIFIED.numbered)))]
#[command(mut_arg("measured", |arg| arg.required(true)))]
#[command(
    after_help = "A table has a line a run, repeats as further lines: f_hz (positive clockwise), alpha_deg, and either vx_mm_per_s, \
    vy_mm_per_s (to the left), yaw_deg_per_s, or file: a motion capture of the run, beside the table.\n\n\
    Examples:\n  \
    scram identify robot --measured speeds.csv\n  \
    scram identify robot --measured filmed.csv --body robot --window 1,3\n  \
    scram identify robot --measured points.csv --body head --rear tail --uneven\n  \
    scram identify robot --measured monday.csv tuesday.csv --holdout 7,60 --holdout=-7,120\n\n\
    docs/identify-robot.md describes the tables, the method and what it reaches."
)]
pub struct RobotCommand {
    /// A condition to judge by, in place of one in four; repeatable
    #[arg(long, value_name = "HZ,DEG", value_parser = condition, allow_hyphen_values = true)]
    holdout: Vec<(f64, f64)>,
    /// Look for an off-centre weight and for the friction of every foot, too
    #[arg(long)]
    uneven: bool,
    /// Sets of numbers that are drawn from what is believed; the most probable are followed
    #[arg(long, default_value_t = 200, value_name = "SETS")]
    draws: usize,
    #[command(flatten)]
    walks: MeasuredArgs,
    #[command(flatten)]
    capture: CaptureArgs,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
}

#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    fit: &'a RobotFit,
    files: &'a [PathBuf],
}

impl RobotCommand {
    pub fn run(&self) -> Done {
        let common = &self.common;
        let document = Document::load(&common.robot).map_err(Report::from)?;
        let measured = self.walks.table(&self.capture)?;
        let held = held_out(&self.holdout, &measured)?;
        common.keeps_robot_file(&common.out.join(ROBOT))?;
        IDENTIFIED.refuse(&common.out, self.overwrite)?;
        let options = Options {
            held,
            uneven: self.uneven,
            window_s: self.walks.window,
            step_s: self.walks.step,
            seed: common.seed,
            draws: self.draws,
            threads: self.walks.threads,
            keep_in: Some(kept_beside(&common.out)),
            progress: Some(progress()),
        };
        let fit = identify(&document, &measured, &options).map_err(Report::from)?;
        let files = IDENTIFIED.fill(&common.out, self.overwrite, |out| self.save(&fit, out))?;
        if let Some(kept) = &fit.kept {
            // Everything is written: what was kept to go on from is not needed. Where it cannot be removed it does no harm.
            let _ = std::fs::remove_file(kept);
        }
        if common.json {
            print_json(&Output { fit: &fit, files: &files })?;
            return Ok(());
        }
        print(&numbers(&fit.parameters));
        print(&facts(&fit));
        let told = fit.parameters.iter().filter(|one| one.told).count();
        say(&format!(
            "{told} of {} numbers are told by these speeds: at most half of what was believed of them is left",
            fit.parameters.len()
        ));
        print(&format!("written: {}, {}", files[0].display(), files[1].display()));
        print(&format!(
            "use it: scram sweep --robot {} --measured {}",
            files[0].display(),
            self.walks.measured[0].display()
        ));
        Ok(())
    }

    fn save(&self, fit: &RobotFit, out: &Path) -> Result<[PathBuf; 2], Report> {
        let (file, picture) = (out.join(ROBOT), out.join("robot.svg"));
        self.common.save(&fit.document, &file)?;
        let title = format!("{}, {}", self.common.robot.display(), self.walks.measured[0].display());
        write(&picture, &under_title(&title, &speeds_svg(&fit.conditions)?))?;
        Ok([file, picture])
    }
}

fn numbers(parameters: &[Parameter]) -> String {
    let header = ["what these speeds tell best first", "found", "90 % interval", "file", "left of the spread"];
    let row = |one: &Parameter| {
        vec![
            one.path.clone(),
            short(one.value),
            format!("{} … {}", short(one.low), short(one.high)),
            short(one.file),
            format!("{:.0} %", 100.0 * one.left),
        ]
    };
    table::columns(&header, parameters.iter().map(row))
}

fn facts(fit: &RobotFit) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut rows = Vec::new();
    let names = ["vx", "vy", "yaw"];
    let words = |one: &ComponentError| {
        let scatter = one.scatter.map_or_else(String::new, |s| format!("; repeats alone make {}", percent(s)));
        let (before, after, worst) = (percent(one.before), percent(one.after), percent(one.worst_after));
        format!("{before} with the file's numbers, {after} with these (worst {worst}){scatter}")
    };
    for (name, error) in names.iter().zip(&fit.held_out) {
        if let Some(error) = error {
            rows.push((format!("{name}, held out"), words(error)));
        }
    }
    rows.push(("loss (3.2)".into(), format!("{:.0} before, {:.0} after", fit.thesis_loss[0], fit.thesis_loss[1])));
    let misfit = match fit.misfit {
        misfit if misfit > 1.5 => format!("{misfit:.1} times what repeats explain: something is missing in the model"),
        misfit => format!("{misfit:.1} times what repeats explain"),
    };
    rows.push(("misfit".into(), misfit));
    table::facts(rows.iter().map(|(name, words)| (name.as_str(), words.clone())))
}
