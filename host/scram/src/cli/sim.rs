//! `scram sim`

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Args;
use control::Sensor;
use miette::Report;
use plot::{PLOT_NAMES, WALK_PLOT_NAMES, plots, under_title};
use serde::Serialize;
use simulation::{
    Break, ClampedMetrics, Comparison, Drive, DriveCommand, DriveError, ExpectedReaction, FaultReport, LONGEST_S,
    Metrics, Plan, Ran, Scheduled, Trace, USUAL_S, WalkMetrics,
};

use super::on_chip::OnChip;
use super::run_directory::{RUNS, warn_older};
use super::settings::Settings;
use super::walk::{self, Ground};
use super::{Common, Done, Failure, load_robot, print, print_json, table, write};

/// Run the firmware's decisions on the simulated robot
///
/// Writes a recording (run.mcap, run.csv with run.toml) and plots (SVG) and says what happened. A robot with a body walks:
/// also its track (track.csv), its path, the traces of its feet and its gait. Every run has a directory of its own,
/// out/run-0001 and so on; out/latest leads to the last. With --out DIR the files go there, and a recording that is there
/// already is written over only with --overwrite.
/// Frequencies are positive clockwise seen from above, angles positive counter-clockwise.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    scram sim                                        walk at 7 Hz for 2 s\n  \
    scram sim --drive freq:-8 --alpha 90 --view walk.html\n  \
    scram sim --bench                                the motor alone\n  \
    scram sim --drive oscillate:-100..100 --seconds 5\n  \
    scram sim --drive freq:-6.5 --faults sensor-open@1.0 --json\n  \
    scram sim --drive duty:1 --seconds 2.5           open loop, for `scram identify`\n  \
    scram sim --drive gait:turn-left --view walk.html
  \
    scram sim --out weak --overwrite                 into a directory of your own, again\n  \
    scram sim --set motor.resistance_ohm=18          another motor, without another file\n  \
    scram sim --robot out/latest-diagnose/robot.toml --before robot.toml\n  \
    \x20                                                what the extended model is worth to the controller\n  \
    scram sim --drive script:steps.txt               one order a line, see docs/recordings.md")]
pub struct Sim {
    /// Run the same robot under the controller of this robot file as well, and compare what both track: the file before its
    /// model was extended, say
    #[arg(long, value_name = "FILE")]
    before: Option<PathBuf>,
    #[command(flatten)]
    run: Run,
}

/// What is run, wherever the decisions are made.
#[derive(Args)]
#[command(
    mut_arg("out", |arg| arg.default_value(RUNS.numbered).help("Directory for what is written")),
    mut_arg("seed", |arg| arg.help("Seed of the specimen, its sensor's errors, say, and of the noise: recordings of one robot have one seed"))
)]
pub struct Run {
    /// freq:HZ, oscillate:FROM..TO, position:DEG, duty:SHARE (open loop), gait:NAME (of robots/gaits, or a file), or script:FILE
    #[arg(long, default_value = "freq:7", allow_hyphen_values = true)]
    drive: String,
    /// Length of the run, s [default: 2, or what the script or gait says]
    #[arg(long, value_parser = seconds)]
    seconds: Option<f64>,
    /// What breaks and when: NAME@SECONDS, several with commas, e.g. sensor-open@1.0,stall@1.5
    #[arg(long, default_value = "", hide_default_value = true, help = faults_help())]
    faults: String,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    pub ground: Ground,
    #[command(flatten)]
    pub common: Common,
    /// Write over a recording that is in --out already
    #[arg(long)]
    overwrite: bool,
}

/// What is to run, as the command line and the robot file say it.
pub struct Task {
    pub robot: robot_file::Robot,
    pub plan: Plan,
    /// On the ground; otherwise on the bench.
    pub walks: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= LONGEST_S => Ok(value),
        _ => Err(format!("seconds must be a number above 0 and up to {LONGEST_S}")),
    }
}

/// JSON object that `--json` prints to stdout.
#[derive(Serialize)]
struct Output<'a> {
    robot: &'a str,
    drive: &'a str,
    seconds: f64,
    seed: u64,
    #[serde(flatten)]
    metrics: &'a Metrics,
    #[serde(skip_serializing_if = "Option::is_none")]
    walk: Option<&'a WalkMetrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    clamped: Option<&'a ClampedMetrics>,
    #[serde(flatten)]
    beside: &'a Beside<'a>,
    refused: Vec<String>,
    files: Vec<PathBuf>,
}

/// What is told beside the run itself.
#[derive(Serialize)]
pub struct Beside<'a> {
    /// The chip that decided.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chip: Option<&'a OnChip>,
    /// What the same robot tracks under another controller.
    #[serde(skip_serializing_if = "Option::is_none", rename = "tracking")]
    pub before: Option<&'a Comparison>,
}

impl Sim {
    pub fn run(&self) -> Done {
        let before = self.before.as_deref().map(load_robot).transpose()?;
        let task = self.run.task()?;
        let ran = self.simulate(&task, &task.robot)?;
        let was = before.map(|designed_from| self.simulate(&task, &designed_from)).transpose()?;
        let compared = was.map(|was| {
            let [was, is] = [&was, &ran].map(|ran| [simulation::metrics(&ran.trace)]);
            simulation::compare(&self.run.drive, &was, &is)
        });
        self.run.tell(&task, &ran, &Beside { chip: None, before: compared.as_ref() })?;
        if let (Some(compared), Some(file), false) = (&compared, &self.before, self.run.common.json) {
            let [was, is] = [file, &self.run.common.robot].map(|file| format!("controller of {}", file.display()));
            print(&tracked(std::slice::from_ref(compared), &was, &is));
        }
        Ok(())
    }

    /// Runs the robot under the controller of a robot file.
    fn simulate(&self, task: &Task, designed_from: &robot_file::Robot) -> Result<Ran, Report> {
        let place = if task.walks { simulation::Place::Ground } else { simulation::Place::Bench };
        let (never, seed) = (AtomicBool::new(false), self.run.common.seed);
        Ok(simulation::simulate(designed_from, &task.robot, place, seed, &task.plan, &never)?)
    }
}

/// What drives tracked under two controllers, as a table.
pub(super) fn tracked(compared: &[Comparison], was: &str, is: &str) -> String {
    let rows = compared.iter().flat_map(|one| {
        let figures = one.rows.iter().map(|row| {
            let value = |value: Option<f64>| table::or_dash(value, 3, if row.unit == "deg" { "°" } else { row.unit });
            vec![one.drive.clone(), row.what.to_owned(), value(row.before), value(row.after)]
        });
        let ended = |why: &Option<String>| why.clone().unwrap_or_else(|| "–".to_owned());
        let is_stopped = one.stopped.iter().any(Option::is_some);
        let [was, is] = &one.stopped;
        let stopped = is_stopped.then(|| vec![one.drive.clone(), "stopped by".to_owned(), ended(was), ended(is)]);
        figures.chain(stopped).collect::<Vec<_>>()
    });
    table::columns(&["drive", "tracking", was, is], rows)
}

impl Run {
    /// Reads the arguments and the robot file.
    pub fn task(&self) -> Result<Task, Failure> {
        let drive = Drive::parse_for(&self.drive, Some(&self.common.robot)).map_err(|e| match e {
            DriveError::Drive { .. } => Failure::Usage(e.into()),
            DriveError::Script { .. } | DriveError::Io { .. } | DriveError::NoGait { .. } | DriveError::Gait(_) => {
                Failure::Failed(e.into())
            }
        })?;
        let seconds = self.seconds.or(drive.end_s).unwrap_or(USUAL_S).min(LONGEST_S);
        let faults = Scheduled::parse_list_within(&self.faults, seconds).map_err(|e| Failure::Usage(e.into()))?;
        let mut robot = self.settings.robot(&self.common.robot)?;
        Scheduled::check_parts(&faults, &robot).map_err(|e| Failure::Usage(e.into()))?;
        let walks = self.ground.prepare(&mut robot)?;
        RUNS.refuse(&self.common.out, self.overwrite)?;
        Ok(Task { robot, plan: Plan { drive, seconds, faults }, walks })
    }

    /// Writes the files of a run and says what happened.
    pub fn tell(&self, task: &Task, ran: &Ran, beside: &Beside<'_>) -> Done {
        let (robot, plan, trace) = (&task.robot, &task.plan, &ran.trace);
        ran.require_accepted().map_err(Report::from)?;
        let title = self.title(robot, plan, ran);
        let mut files = self.save(ran, robot, &title)?;
        let view = self.ground.write_view(ran.walk.as_ref(), &title)?;
        let metrics = simulation::metrics(trace);
        let track = ran.walk.as_ref().map(|walk| &walk.track);
        let (walked, clamped) = (track.and_then(simulation::walk_metrics), track.and_then(simulation::clamped_metrics));
        let refused: Vec<String> = refusals(trace).collect();
        if self.common.json {
            files.extend(view.map(PathBuf::from));
            print_json(&Output {
                robot: &robot.name,
                drive: &self.drive,
                seconds: plan.seconds,
                seed: self.common.seed,
                metrics: &metrics,
                walk: walked.as_ref(),
                clamped: clamped.as_ref(),
                beside,
                refused,
                files,
            })?;
            return Ok(());
        }
        print(&title);
        if trace.segments().len() > 1 {
            print(&commands(trace));
        }
        let body = walked.iter().flat_map(walk::facts).chain(clamped.iter().flat_map(walk::clamped_facts));
        print(&table::facts(happened(trace, &metrics).into_iter().chain(body)));
        if let Some(chip) = beside.chip {
            print(&table::facts(chip.facts()));
        }
        for line in refused {
            print(&line);
        }
        for fault in &metrics.faults {
            print(&fault_line(fault));
        }
        if let Some(line) = failed_sensor(trace) {
            print(&line);
        }
        let page = view.map(|page| format!("; to look at in a browser: {}", page.display()));
        print(&format!("written: {}{}", listed(&files), page.unwrap_or_default()));
        Ok(())
    }

    /// "scram-26, freq:7 for 2 s, seed 1", what is set and what breaks, and whether and how it stands on the ground.
    fn title(&self, robot: &robot_file::Robot, plan: &Plan, ran: &Ran) -> String {
        let mut what = format!("{}, {} for {} s, seed {}", robot.name, self.drive, plan.seconds, self.common.seed);
        let broken = self.faults.split(',').map(|fault| fault.trim().to_owned()).filter(|fault| !fault.is_empty());
        for other in self.settings.words().chain(broken) {
            what += ", ";
            what += &other;
        }
        let place = ran.walk.as_ref().map_or_else(|| "the motor alone".to_owned(), |walk| walk::place(walk, robot));
        format!("{what}, {place}")
    }

    /// Writes the files of a run into its directory.
    fn save(&self, ran: &Ran, robot: &robot_file::Robot, title: &str) -> Result<Vec<PathBuf>, Report> {
        RUNS.fill(&self.common.out, self.overwrite, |out| self.write(ran, robot, title, out))
    }

    fn write(&self, ran: &Ran, robot: &robot_file::Robot, title: &str, out: &Path) -> Result<Vec<PathBuf>, Report> {
        let (trace, walk) = (&ran.trace, ran.walk.as_ref());
        let run = ran.recorded(robot, &self.drive, self.common.seed);
        let drawn = plots(trace)?;
        let mut files = vec![out.join("run.mcap"), out.join("run.csv")];
        for file in &files {
            run.write(file)?;
        }
        for (name, svg) in &drawn {
            let file = out.join(format!("{name}.svg"));
            write(&file, &under_title(title, svg))?;
            files.push(file);
        }
        files.extend(self.ground.write(walk, title, out)?);
        let plots = PLOT_NAMES.into_iter().chain(WALK_PLOT_NAMES).map(|name| format!("{name}.svg"));
        let names: Vec<String> = plots.chain([walk::TRACK.to_owned()]).collect();
        warn_older(out, &names, &files);
        Ok(files)
    }
}

/// "out/run-0001/run.mcap, run.csv, …": the directory once.
pub(super) fn listed(files: &[PathBuf]) -> String {
    let names = files.iter().skip(1).filter_map(|file| file.file_name()).map(|name| name.to_string_lossy());
    let first = files.first().map(|file| file.display().to_string());
    first.into_iter().chain(names.map(String::from)).collect::<Vec<_>>().join(", ")
}

fn refusals(trace: &Trace) -> impl Iterator<Item = String> + '_ {
    trace.commands.iter().filter_map(|given| {
        let why = given.refusal.as_ref()?;
        Some(format!("refused at {:.3} s: {}: {why}", given.at_s, given.command))
    })
}

fn faults_help() -> String {
    let names = |expected_reaction| Break::names(expected_reaction).join(", ");
    format!(
        "What breaks and when: NAME@SECONDS, several with commas, e.g. sensor-open@1.0,stall@1.5. The supervisor finds {}. \
         A held speed bears {}. Nothing is made to find {}",
        names(ExpectedReaction::Found),
        names(ExpectedReaction::Borne),
        names(ExpectedReaction::NotFound)
    )
}

/// Of two angle sensors the one that was given up.
fn failed_sensor(trace: &Trace) -> Option<String> {
    let (time_s, failed) = trace.ticks.iter().find_map(|t| Some((t.time_s, t.telemetry.failed_sensor?)))?;
    let (broken, other) = match failed {
        Sensor::First => ("first", "second"),
        Sensor::Second => ("second", "first"),
    };
    Some(format!("at {time_s:.3} s the {broken} angle sensor is given up: the robot goes on with the {other} one"))
}

fn fault_line(fault: &FaultReport) -> String {
    let off = match fault.bridge_off_after_s {
        Some(0.0) if !fault.bridge_was_on => "the bridge was off already".to_owned(),
        Some(0.0) => "bridge off in the same tick".to_owned(),
        Some(after) => format!("bridge off {:.0} ms later", after * 1e3),
        None => "the bridge stays on".to_owned(),
    };
    let cause = fault.cause.as_deref().unwrap_or("not noticed");
    match &fault.injected {
        Some(injected) => {
            let line = format!("fault at {:.3} s: {injected}: {cause}, {off}", fault.at_s);
            unnoticed(fault, injected).map_or(line.clone(), |more| format!("{line}; {more}"))
        }
        None => format!("fault at {:.3} s: {cause}, {off}", fault.at_s),
    }
}

/// Of a fault that the supervisor said nothing about: what it has done to the estimate, and whether it was to be found.
fn unnoticed(fault: &FaultReport, injected: &str) -> Option<String> {
    if fault.cause.is_some() || fault.bridge_off_after_s == Some(0.0) && !fault.bridge_was_on {
        return None;
    }
    let expected_reaction = match Break::all().find(|what| what.name() == injected)?.expected_reaction() {
        ExpectedReaction::Found => "the supervisor is to find it: was there time?",
        ExpectedReaction::Borne => "a held speed is to bear it",
        ExpectedReaction::NotFound => "nothing is made to find it",
    };
    let error = fault.estimate_rms_deg.map(|deg| format!("estimate off by {deg:.1}° RMS since; "));
    Some(error.unwrap_or_default() + expected_reaction)
}

/// One row an order.
fn commands(trace: &Trace) -> String {
    let rows = trace.segments().into_iter().map(|(command, from, to)| {
        let m = simulation::metrics_of(trace, command, from, to);
        let time = |tick: usize| format!("{:.2}", tick as f64 * trace.tick_s);
        vec![
            command.to_string(),
            time(from),
            time(to),
            table::or_dash(m.mean_frequency_hz, 3, ""),
            table::or_dash(m.settling_s, 3, ""),
            table::or_dash(m.turning_error_worst_deg, 1, ""),
            format!("{:.0}", 1e3 * m.peak_current_a),
        ]
    });
    table::columns(&["order", "from / s", "to / s", "mean / Hz", "settled / s", "worst turn / °", "peak / mA"], rows)
}

/// The figures of the last order, those that it has.
fn happened<'a>(trace: &Trace, m: &Metrics) -> Vec<(&'a str, String)> {
    let command = trace.segments().last().map(|(command, ..)| *command);
    let mut rows = Vec::new();
    let mean = table::or_dash(m.mean_frequency_hz, 4, "Hz");
    match command {
        Some(DriveCommand::Freq { hz }) => {
            let off = m.mean_frequency_hz.filter(|_| hz != 0.0).map(|mean| 100.0 * (mean / hz - 1.0));
            let off = off.map_or_else(String::new, |off| format!(" ({off:+.3} % of {hz} Hz)"));
            rows.push(("mean frequency, last second", format!("{mean}{off}")));
            rows.push(("angle known after", table::or_dash(m.acquired_s.map(|s| 1e3 * s), 0, "ms")));
            rows.push(("one-turn average within 2 % after", table::or_dash(m.settling_s, 3, "s")));
            rows.push(("instantaneous speed within 2 % after", table::or_dash(m.settling_instantaneous_s, 3, "s")));
            rows.push(("phase error, last second, RMS", table::or_dash(m.phase_rms_deg, 2, "°")));
        }
        Some(DriveCommand::Oscillate { .. }) => {
            let turns = m.turning_points_deg.len();
            let median = table::or_dash(m.turning_error_median_deg, 1, "°");
            let worst = table::or_dash(m.turning_error_worst_deg, 1, "°");
            rows.push(("angle known after", table::or_dash(m.acquired_s.map(|s| 1e3 * s), 0, "ms")));
            rows.push(("turning points", format!("{turns}, off by {median} (median), {worst} (worst)")));
            rows.push(("strokes that ran away", m.strokes_ran_away.to_string()));
            rows.push(("there and back", table::or_dash(m.oscillation_frequency_hz, 2, "times a second")));
        }
        Some(DriveCommand::Position { .. }) => {
            rows.push(("off the target, last half second, RMS", table::or_dash(m.position_rms_deg, 2, "°")));
        }
        _ => rows.push(("mean frequency, last second", mean)),
    }
    if m.estimate_rms_deg.is_some() {
        let outside = table::or_dash(m.estimate_rms_deg, 2, "°");
        let inside = table::or_dash(m.estimate_rms_blind_deg, 2, "°");
        rows.push(("estimate error outside / inside the blind arc, RMS", format!("{outside} / {inside}")));
    }
    let (peak, mean) = (1e3 * m.peak_current_a, 1e3 * m.rms_current_a);
    rows.push(("current, peak / RMS", format!("{peak:.0} / {mean:.0} mA")));
    rows.push(("energy taken by the bridge", format!("{:.2} J", m.energy_j)));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bridge_that_was_on_until_the_tick_of_the_fault_was_not_off_already() {
        let fault = |was_on, after| FaultReport {
            cause: Some("Stall".into()),
            injected: None,
            at_s: 0.211,
            bridge_off_after_s: after,
            bridge_was_on: was_on,
            estimate_rms_deg: None,
        };
        for (was_on, after, said) in [
            (true, Some(0.0), "bridge off in the same tick"),
            (false, Some(0.0), "the bridge was off already"),
            (true, Some(0.25), "bridge off 250 ms later"),
            (true, None, "the bridge stays on"),
        ] {
            assert_eq!(fault_line(&fault(was_on, after)), format!("fault at 0.211 s: Stall, {said}"));
        }
    }
}
