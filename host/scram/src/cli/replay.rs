//! `scram replay`

use std::path::PathBuf;

use clap::Args;
use miette::Report;
use plot::under_title;
use scram::replay::{COMPARISON, Findings, Quantity, replay};
use serde::Serialize;

use super::run_directory::REPLAYED;
use super::sim::listed;
use super::{Common, Done, print, print_json, table, write};

/// Plot a recording again, and show what the current controller would decide otherwise
///
/// Reads recordings of `scram sim` and `scram hil`, of a console session, and CSV. Plots (SVG) go into a
/// directory of their own, out/replay-0001 and so on; out/latest-replay leads to the last. Where the recording has orders
/// and sensor codes, the current controller, designed from --robot, gets the recorded samples and orders, and what it
/// decides is compared with what was decided then.
///
/// The samples are fixed (open loop): the recorded shaft does not follow the current controller. A difference shows that
/// and where decisions change, not how the run would have gone on.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(REPLAYED.numbered)))]
#[command(after_help = "Examples:\n  \
    scram replay out/latest/run.mcap                 the same robot file: nothing differs\n  \
    scram replay out/latest/run.mcap --robot changed.toml   what other gains would do\n  \
    scram replay session.mcap --robot-name scram-26 --json\n\n\
    The exit code is 0 whether or not something differs.")]
pub struct Replay {
    /// The recording
    run: PathBuf,
    /// Which robot of a session with several
    #[arg(long, value_name = "NAME")]
    robot_name: Option<String>,
    #[command(flatten)]
    common: Common,
    /// Write over pictures of a replay that are in --out already
    #[arg(long)]
    overwrite: bool,
}

#[derive(Serialize)]
struct Output<'a> {
    recording: &'a PathBuf,
    #[serde(flatten)]
    findings: &'a Findings,
    files: &'a [PathBuf],
}

impl Replay {
    pub fn run(&self) -> Done {
        let (robot, out) = (self.common.robot()?, &self.common.out);
        REPLAYED.refuse(out, self.overwrite)?;
        let seen = replay(&self.run, self.robot_name.as_deref(), &robot).map_err(Report::from)?;
        let pictures = seen.pictures().map_err(Report::from)?;
        let findings = &seen.findings;
        let files = REPLAYED.fill(out, self.overwrite, |out| {
            let mut files = Vec::new();
            for (name, svg) in &pictures {
                files.push(out.join(format!("{name}.svg")));
                write(&out.join(format!("{name}.svg")), &under_title(&self.title(name, &seen.recorded), svg))?;
            }
            // Of an earlier replay: a comparison, where this one compares nothing.
            REPLAYED.warn_older(out, &files);
            Ok(files)
        })?;
        if self.common.json {
            print_json(&Output { recording: &self.run, findings, files: &files })?;
            return Ok(());
        }
        self.tell(findings);
        print(&format!("written: {}", listed(&files)));
        Ok(())
    }

    /// Over a picture: the file and what it recorded, and of the comparison whose controller decided again.
    fn title(&self, picture: &str, recorded: &str) -> String {
        let mut title = self.run.display().to_string();
        if !recorded.is_empty() {
            title += &format!(": {recorded}");
        }
        if picture == COMPARISON {
            title += &format!("; decided again with {}", self.common.robot.display());
        }
        title
    }

    fn tell(&self, findings: &Findings) {
        print(&format!(
            "{}: {} ticks in {:.3} s, {} missed in {} gap(s), {} order(s)",
            self.run.display(),
            findings.rows,
            findings.seconds,
            findings.missed_ticks,
            findings.gaps,
            findings.orders
        ));
        for note in &findings.notes {
            print(&format!("note: {note}"));
        }
        if !findings.compared.is_empty() {
            let header = ["quantity", "compared", "differ", "share / %", "RMS", "worst", "first at / s"];
            print(&table::columns(&header, findings.compared.iter().map(row)));
        }
        for reason in &findings.not_compared {
            print(&format!("not compared: {reason}"));
        }
        print(&findings.verdict);
    }
}

fn row(quantity: &Quantity) -> Vec<String> {
    let scientific = |value: Option<f64>| match value {
        None => "–".to_owned(),
        Some(0.0) => "0".to_owned(),
        Some(value) => format!("{value:.2e}"),
    };
    let name = if quantity.unit.is_empty() {
        quantity.name.to_owned()
    } else {
        format!("{} / {}", quantity.name, quantity.unit)
    };
    vec![
        name,
        quantity.compared.to_string(),
        quantity.different.to_string(),
        format!("{:.2}", 100.0 * quantity.share),
        scientific(quantity.rms),
        scientific(quantity.worst.as_ref().map(|worst| worst.difference)),
        table::or_dash(quantity.first.as_ref().map(|first| first.t_s), 3, ""),
    ]
}
