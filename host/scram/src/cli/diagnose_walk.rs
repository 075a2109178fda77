//! `scram diagnose --measured`

use std::path::{Path, PathBuf};

use diagnose::Verdict;
use diagnose::walk::{WalkDiagnosis, WalkModel, WalkOptions, diagnose_walk};
use miette::{Report, miette};
use plot::report::{WalkAbout, odds, walk_html};
use robot_file::edit::Document;

use super::diagnose::{ROBOT, progress};
use super::identify::capture::CaptureArgs;
use super::identify::short;
use super::measured::{MeasuredArgs, held_out, kept_beside};
use super::run_directory::DIAGNOSED;
use super::{Common, Done, print, print_json, say, table, write};

/// A walk's diagnosis as the command line asks for it.
pub struct WalkRun<'a> {
    pub common: &'a Common,
    pub walks: &'a MeasuredArgs,
    pub capture: CaptureArgs,
    pub holdout: Vec<(f64, f64)>,
    pub overwrite: bool,
}

impl WalkRun<'_> {
    /// Diagnoses, writes it down and tells it.
    pub fn run(&self) -> Done {
        let common = self.common;
        let document = Document::load(&common.robot).map_err(Report::from)?;
        let measured = self.walks.table(&self.capture)?;
        let options = WalkOptions {
            held: held_out(&self.holdout, &measured)?,
            window_s: self.walks.window,
            step_s: self.walks.step,
            seed: common.seed,
            threads: self.walks.threads,
            keep_in: Some(kept_beside(&common.out)),
            progress: Some(progress()),
            ..WalkOptions::default()
        };
        common.keeps_robot_file(&common.out.join(ROBOT))?;
        DIAGNOSED.refuse(&common.out, self.overwrite)?;
        let found = diagnose_walk(&document, &measured, &options).map_err(Report::from)?;
        let files = DIAGNOSED.fill(&common.out, self.overwrite, |out| self.save(&found, out))?;
        for kept in &found.kept {
            // Everything is written: what was kept to go on from is not needed. Where it cannot be removed it does no harm.
            let _ = std::fs::remove_file(kept);
        }
        let written = files.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
        if common.json {
            say(&format!("written: {written}"));
            print_json(&found)?;
            return Ok(());
        }
        for line in &found.summary {
            print(line);
        }
        print(&facts(&found));
        print(&models(&found.models));
        print(&format!("written: {written}"));
        if found.verdict != Verdict::Unexplained {
            print(&format!(
                "use it: scram sweep --robot {} --measured {}",
                files[1].display(),
                self.walks.measured[0].display()
            ));
        }
        Ok(())
    }

    fn save(&self, found: &WalkDiagnosis, out: &Path) -> Result<[PathBuf; 3], Report> {
        let files = [out.join("report.html"), out.join(ROBOT), out.join("diagnosis.json")];
        // First what can be refused, so that no report speaks of a model that was not written.
        self.common.save(&found.document, &files[1])?;
        let about = WalkAbout {
            robot: self.common.robot.display().to_string(),
            measured: self.walks.measured.iter().map(|path| path.display().to_string()).collect(),
            extended_file: Some(files[1].display().to_string()),
        };
        write(&files[0], &walk_html(found, &about)?)?;
        let json = serde_json::to_string_pretty(found).map_err(|e| miette!("diagnosis.json: {e}"))?;
        write(&files[2], &(json + "\n"))?;
        Ok(files)
    }
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "–".into(), |share| format!("{:.1} %", 100.0 * share))
}

fn facts(found: &WalkDiagnosis) -> String {
    let three = |shares: [Option<f64>; 3]| shares.map(percent).join(" / ");
    let mut rows = vec![("verdict", found.verdict.word().to_owned())];
    for cause in &found.causes {
        let also = if cause.also.is_empty() { String::new() } else { format!(" (or {})", cause.also.join(", ")) };
        rows.push(("cause", format!("{}{also}", cause.effect)));
        for (key, [value, low, high]) in &cause.parameters {
            rows.push(("", format!("{key} {} ({} … {})", short(*value), short(*low), short(*high))));
        }
    }
    rows.push(("held-out vx / vy / yaw, before", three(found.before)));
    rows.push(("held-out vx / vy / yaw, after", three(found.after)));
    rows.push(("what repeats alone make", three(found.scatter)));
    rows.push((
        "odds of a missing effect",
        format!("{}; an alarm needs 100 to 1", odds(found.log10_evidence_against_nothing)),
    ));
    table::facts(rows)
}

fn models(models: &[WalkModel]) -> String {
    let header = ["model", "log₁₀ of the evidence over the file's", "probability", "misfit", "adequate"];
    let row = |one: &WalkModel| {
        let name = if one.effects.is_empty() { "the file's, refitted".to_owned() } else { one.effects.join(" and ") };
        let adequate = one.adequate.map_or("–", |adequate| if adequate { "yes" } else { "no" });
        vec![
            name,
            format!("{:.1}", one.log10_bayes_factor),
            if one.effects.is_empty() { "–".into() } else { format!("{:.3}", one.probability) },
            one.misfit.map_or_else(|| "–".into(), |misfit| format!("{misfit:.2}")),
            adequate.to_owned(),
        ]
    };
    table::columns(&header, models.iter().map(row))
}
