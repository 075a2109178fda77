//! The console's screen at work, and what it costs: five robots, a hundred telemetry messages a second each, on a real terminal in real time.
//! And what their telemetry loses, in virtual time.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use link::Keys;
use recording::{Entry, entries};
use scram::console::Engine;
use serde_json::json;
use testbed::event_log::Detail;
use testbed::realtime::{self, Simulation};
use testbed::setup::{DONGLE, address};

use super::Options;
use super::mode::Mode;
use super::rig::{Rig, Template};
use crate::figures::run::DesignedRobot;
use crate::row::FigureRow;

const ROBOTS: usize = 5;
/// Time for which the screen is watched.
const WATCHED: Duration = Duration::from_secs(20);
/// Until every robot is there and drives.
const SETTLED: Duration = Duration::from_secs(5);
/// Of `/proc/PID/stat`: Linux's `CLK_TCK`, 100 wherever it runs on a PC.
const TICKS_PER_S: f64 = 100.0;
/// In virtual time a picture takes so long, during which nobody polls: twice what the slowest one takes.
const PICTURE: Duration = Duration::from_millis(10);
/// Interval between pictures.
const PICTURES: Duration = Duration::from_millis(100);

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, _: &Options) -> Vec<FigureRow> {
    vec![cost(bench).unwrap_or_else(|problem| FigureRow::new(WHAT, REQUIRED, problem, false, json!({}))), lost(bench)]
}

const WHAT: &str = "console's screen, 5 robots with 100 messages a second each";
/// What it costs depends on the machine, and is only told: `cargo bench -p scram --bench screen` measures a picture.
const REQUIRED: &str = "all drive, are drawn and recorded";

fn cost(bench: &DesignedRobot) -> Result<FigureRow, String> {
    let console = build()?;
    let directory = tempfile::tempdir().map_err(|error| error.to_string())?;
    let (simulation, keys) = simulate(bench, directory.path())?;
    let mut screen = Screen::open(&console, &simulation, &keys, directory.path())?;
    std::thread::sleep(SETTLED / 2);
    for robot in 1..=ROBOTS {
        screen.type_(&format!("robot {robot}; clear; freq 7\r"))?;
        std::thread::sleep(SETTLED / 10);
    }
    let driven: Vec<u64> = simulation.robots().iter().map(|robot| robot.driven).collect();
    let (used, start) = (screen.used_s()?, Instant::now());
    std::thread::sleep(WATCHED);
    let (share, seconds) = ((screen.used_s()? - used) / start.elapsed().as_secs_f64(), start.elapsed().as_secs_f64());
    let driving = simulation.robots().iter().zip(&driven).filter(|(now, before)| now.driven > **before).count();
    let drawn = screen.quit()?;
    let (rows, gaps) = recorded(directory.path())?;
    Ok(FigureRow::new(
        WHAT,
        REQUIRED,
        format!(
            "{:.1} % over {seconds:.0} s, {driving} of {ROBOTS} driving, {drawn} bytes drawn; {rows} rows recorded, {gaps} missing",
            100.0 * share
        ),
        driving == ROBOTS && drawn > 0 && rows > 0,
        json!({ "share": share, "seconds": seconds, "driving": driving, "bytes": drawn, "rows": rows, "missing": gaps }),
    ))
}

/// The console, built as this program was.
fn build() -> Result<PathBuf, String> {
    let this = std::env::current_exe().map_err(|error| error.to_string())?;
    let directory = this.parent().ok_or("this program has no directory")?;
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "-p", "scram", "--bin", "scram"]);
    cargo.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."));
    if directory.ends_with("release") {
        cargo.arg("--release");
    }
    let built = cargo.status().map_err(|error| format!("cargo: {error}"))?;
    let console = directory.join("scram");
    if built.success() && console.is_file() { Ok(console) } else { Err(format!("{}: not built", console.display())) }
}

fn simulate(bench: &DesignedRobot, directory: &Path) -> Result<(Simulation, PathBuf), String> {
    let mut keys = Keys::generate().map_err(|error| error.to_string())?;
    let mut pairings = Vec::new();
    for index in 0..ROBOTS {
        let name = format!("robot-{}", index + 1);
        let known = keys.pair(&name, address(index), DONGLE).map_err(|error| error.to_string())?;
        pairings.push(Some(known.pairing.clone()));
    }
    let file = directory.join("keys.toml");
    keys.save(&file).map_err(|error| error.to_string())?;
    let options = realtime::Options { robots: ROBOTS, pairings, ..realtime::Options::default() };
    let simulation = Simulation::start(&bench.robot, options).map_err(|error| error.to_string())?;
    Ok((simulation, file))
}

/// A console on a terminal of its own, which `script` makes.
struct Screen {
    script: Child,
    pid: PathBuf,
    drawn: std::thread::JoinHandle<usize>,
}

impl Screen {
    fn open(console: &Path, simulation: &Simulation, keys: &Path, directory: &Path) -> Result<Self, String> {
        let pid = directory.join("pid");
        let command = format!(
            "stty rows 40 cols 120; echo $$ > '{}'; exec '{}' console --port '{}' --keys '{}' --out '{}' --robot '{}'",
            pid.display(),
            console.display(),
            simulation.port().display(),
            keys.display(),
            directory.display(),
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml").display()
        );
        let mut script = Command::new("script")
            .args(["-qfc", &command, "/dev/null"])
            .env("TERM", "xterm-256color")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("script (of util-linux), which makes a terminal: {error}"))?;
        let mut out = script.stdout.take().ok_or("no output")?;
        let drawn = std::thread::spawn(move || {
            let (mut drawn, mut buffer) = (0, [0; 4096]);
            while let Ok(count @ 1..) = out.read(&mut buffer) {
                drawn += count;
            }
            drawn
        });
        Ok(Self { script, pid, drawn })
    }

    fn type_(&mut self, text: &str) -> Result<(), String> {
        let input = self.script.stdin.as_mut().ok_or("no input")?;
        input.write_all(text.as_bytes()).and_then(|()| input.flush()).map_err(|error| format!("the console: {error}"))
    }

    /// Processor time of the console until now, s.
    fn used_s(&self) -> Result<f64, String> {
        let pid = fs::read_to_string(&self.pid).map_err(|error| format!("the console did not start: {error}"))?;
        let stat = fs::read_to_string(format!("/proc/{}/stat", pid.trim()))
            .map_err(|error| format!("the console has ended: {error}"))?;
        // Behind the name, which may hold anything: user's time is the 12th field, the system's the 13th.
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
        let ticks = |index: usize| fields.get(index).and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN);
        Ok((ticks(11) + ticks(12)) / TICKS_PER_S)
    }

    /// Ends the console as a person does; how many bytes it drew.
    fn quit(mut self) -> Result<usize, String> {
        self.type_("\x1b")?;
        std::thread::sleep(Duration::from_millis(500));
        self.type_("quit\r")?;
        self.script.wait().map_err(|error| error.to_string())?;
        self.drawn.join().map_err(|_| "the terminal".to_owned())
    }
}

/// Rows of every robot in the recording of a directory, and ticks that are missing between them.
fn recorded(directory: &Path) -> Result<(u64, u64), String> {
    let files = fs::read_dir(directory).map_err(|error| error.to_string())?;
    let path = files.flatten().map(|file| file.path()).find(|path| path.extension().is_some_and(|end| end == "mcap"));
    let path = path.ok_or("no recording")?;
    let (mut rows, mut missing) = (0, 0);
    for robot in 1..=ROBOTS {
        let mut last: Option<u64> = None;
        let mut each = |entry| {
            if let Entry::Row(row) = entry
                && let Some(tick) = row.tick
            {
                rows += 1;
                missing += last.map_or(0, |last| tick.saturating_sub(last + 1));
                last = Some(tick);
            }
        };
        let name = format!("robot-{robot}");
        entries(&path, Some(&name), &mut each).map_err(|error| error.to_string())?;
    }
    Ok((rows, missing))
}

/// Telemetry of five robots through a console that draws: what is missing is what the air lost.
fn lost(bench: &DesignedRobot) -> FigureRow {
    let mut perfect = bench.robot.clone();
    if let Some(radio) = &mut perfect.radio {
        (radio.loss_share.value, radio.quiet_loss_share.value) = (0.0, 0.0);
        (radio.corruption_share.value, radio.reorder_share.value) = (0.0, 0.0);
    }
    let (shown, missing, ..) = watch(&perfect);
    let (shown_lossy, missing_lossy, unacknowledged, dropped) = watch(&bench.robot);
    let by_radio = 10 * unacknowledged + dropped;
    FigureRow::new(
        "telemetry of 5 robots through a console that draws",
        "no lost telemetry but what the radio lost",
        format!(
            "through a perfect air {shown} ticks came, {missing} are missing; through the usual one {shown_lossy} came, \
             {missing_lossy} are missing, and the radio lost up to {by_radio}"
        ),
        shown > 0 && missing == 0 && missing_lossy <= by_radio,
        json!({
            "perfect": { "ticks": shown, "missing": missing },
            "usual": { "ticks": shown_lossy, "missing": missing_lossy, "lost_by_radio": by_radio },
        }),
    )
}

/// Ticks that came, ticks that are missing, frames that nobody acknowledged, ticks that the robots dropped as their radio did
/// not keep up.
fn watch(file: &robot_file::Robot) -> (u64, u64, u64, u64) {
    let mut rig = Rig::new(Template::new(file, ROBOTS, Detail::Nothing).seeded(1));
    rig.meet();
    (0..ROBOTS).for_each(|robot| rig.order(robot, Mode::Forward.command(0)));
    let Rig { session, end, .. } = rig;
    let mut engine = Engine::new(session, "the bench");
    let directory = tempfile::tempdir().expect("a directory for the recording");
    engine.record(directory.path(), 1e-3).expect("room for a recording");
    let until = end.now() + WATCHED;
    while end.now() < until {
        let picture = end.now() + PICTURES;
        while end.now() < picture {
            engine.poll().expect("a healthy line");
        }
        end.wait(PICTURE);
    }
    let came = engine.model().robots.iter().map(|robot| robot.ticks.0).sum();
    let missing = engine.model().robots.iter().map(|robot| robot.ticks.1).sum();
    let bench = end.bench();
    let dropped = bench.robots.iter().map(|robot| u64::from(robot.counters().rows_dropped)).sum();
    let unacknowledged = bench.ether.counts().unacknowledged;
    drop(bench);
    engine.finish();
    (came, missing, unacknowledged, dropped)
}
