//! `scram calibrate`

use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Duration;

use ::identify::potentiometer::{PotentiometerError, PotentiometerFit, potentiometer, require_potentiometer};
use clap::Args;
use control::protocol::dongle::Address;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use link::{LinkError, Recorder, RobotId, SerialLine, Session, Spin};
use miette::{IntoDiagnostic, Report, WrapErr, miette};
use recording::{Metadata, Recording, write_csv_with, write_mcap_with};
use robot_file::Robot;
use robot_file::design::design;
use serde::Serialize;

use super::pair::KeysFile;
use super::run_directory::CALIBRATED;
use super::sim::listed;
use super::{Common, Done, ask, identify, print, print_json, say};

/// Everything the motor gets: the speed is highest, and the supply's ripple of a switching bridge is not there.
const DUTY: f32 = 1.0;
/// Length of the run, s: some twenty turns of the 26:1 motor.
const SPIN_S: f64 = 2.5;
/// A dongle that was just restarted by opening its port needs a second to boot.
const DONGLE_PATIENCE: Duration = Duration::from_secs(4);
/// A battery may still have to go in.
const ROBOT_PATIENCE: Duration = Duration::from_secs(20);
/// It answers within milliseconds.
const COUNT_PATIENCE: Duration = Duration::from_millis(300);
/// Below this share of the speed that the robot file promises something is wrong with motor or battery.
const SLOW: f64 = 0.7;
/// Share of lost ticks that is worth a word: the fit bears it, but the radio is too far away.
const LOSSY: f64 = 0.05;
/// Share of lost ticks that is too much: at a half the zero was found 0.7° off in one of five simulated robots, at 0.3
/// not worse than without any loss.
const MOST_LOST: f64 = 0.3;

/// Calibrate the angle sensor of a real robot: spin it once through a dongle and correct its potentiometer
///
/// Guides through it on stderr. Writes the robot file with [sensor.correction], the recording and a plot into a directory
/// of their own, out/calibrate-0001 and so on; out/latest-calibrate leads to the last that gave a correction. With --out DIR
/// they go there, and files of another calibration that are there already are written over only with --overwrite.
#[derive(Args)]
#[command(
    mut_arg("out", |arg| arg.default_value(CALIBRATED.numbered)),
    mut_arg("seed", |arg| arg.hide(true)),
    after_help = "Examples:\n  \
        scram calibrate --port /dev/ttyUSB0\n  \
        scram calibrate --port COM5 --robot mine.toml --address 7c:df:a1:00:11:22\n  \
        SCRAM_ROBOT=$PWD/out/latest-calibrate/robot.toml cargo flash-robot esp32"
)]
pub struct Calibrate {
    /// The dongle's serial port
    #[arg(long, value_name = "PORT")]
    port: String,
    /// The robot's radio address, where more than one is switched on
    #[arg(long, value_name = "MAC", value_parser = link::parse_address)]
    address: Option<Address>,
    #[command(flatten)]
    keys: KeysFile,
    /// Start without asking
    #[arg(long, short)]
    yes: bool,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
}

/// JSON object that `--json` prints to stdout.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    fit: &'a PotentiometerFit,
    address: String,
    ticks: u64,
    lost_ticks: u64,
    files: &'a [PathBuf],
}

/// What the robot file says about this run.
struct Expected {
    robot: Robot,
    tick_s: f64,
    ceiling_hz: f64,
}

impl Calibrate {
    pub fn run(&self) -> Done {
        // Whatever can be refused is refused before anything moves.
        let expected = self.expected()?;
        let keys = self.keys.load()?;
        let line = SerialLine::open(&self.port).map_err(Report::from)?;
        say(&format!("1/4  Looking for the dongle on {}", self.port));
        let mut session =
            Session::open(line, &keys, link::nonces().map_err(Report::from)?, DONGLE_PATIENCE).map_err(Report::from)?;
        say(&format!("     dongle {}, channel {}", link::address(&session.address()), session.channel()));
        let robot = self.find(&mut session, &expected.robot)?;
        self.ask(&mut session)?;
        let spin = spin(&mut session, robot, &expected)?;
        if spin.recorder.lost_share() > LOSSY {
            say(&losses(&mut session, robot));
        }
        let address = session.robot(robot).address();
        let mut recording = spin.recorder.recording(expected.tick_s);
        // What the correction names as its source.
        recording.path = PathBuf::from("run.mcap");
        match spin.end.map_err(Report::from).and_then(|()| evaluate(&spin.recorder, &recording, &expected)) {
            Ok(fit) => self.succeed(&fit, &recording, &spin.recorder, address, &expected.robot),
            Err(error) => Err(self.fail(error, &recording, &spin.recorder, address, &expected.robot).into()),
        }
    }

    fn expected(&self) -> Result<Expected, Report> {
        let robot = self.common.robot()?;
        require_potentiometer(&robot)?;
        self.common.keeps_robot_file(&self.common.out.join("robot.toml"))?;
        CALIBRATED.refuse(&self.common.out, self.overwrite)?;
        let designed = design(&robot).map_err(|e| {
            miette!(
                help = "the robot's firmware is built from this file's [controller]: it has every number that a design needs",
                "{}: {e}",
                self.common.robot.display()
            )
        })?;
        let (tick_s, ceiling_hz) = (f64::from(designed.parameters.tick), designed.ceiling / std::f64::consts::TAU);
        // As the file says it, without the rounding to f32.
        let tick_s = robot.controller.as_ref().map_or(tick_s, |controller| controller.tick_s.value);
        Ok(Expected { robot, tick_s, ceiling_hz })
    }

    fn find(&self, session: &mut Session<SerialLine>, robot: &Robot) -> Result<RobotId, Report> {
        say("2/4  Put the battery in. Looking for the robot");
        let found = session.find(self.address, ROBOT_PATIENCE)?;
        let (found_robot, now) = (session.robot(found), session.now());
        for line in link::robot(found_robot, now) {
            say(&format!("     {line}"));
        }
        if let Some(status) = found_robot.status()
            && status.name != robot.name.as_str()
        {
            let (name, expected) = (status.name.to_string(), robot.name.clone());
            return Err(LinkError::OtherRobot { name, expected }.into());
        }
        if let Some(fault) = found_robot.telemetry().and_then(|batch| batch.fault) {
            say(&format!("     Fault: {}.", link::fault(fault).0));
            say("     It is cleared before the motor starts.");
        }
        Ok(found)
    }

    /// Waits for Enter, and meanwhile keeps the robot idle.
    fn ask(&self, session: &mut Session<SerialLine>) -> Result<(), Report> {
        say("3/4  Robot on its stand, axis upright, the mass free to turn all around.");
        say(&format!("     The motor will run at full voltage for {SPIN_S} s. Hands and cables away."));
        if self.yes {
            return Ok(());
        }
        if std::io::stdin().is_terminal() {
            ask("     Press Enter to start, Ctrl-C to leave. ");
        }
        let enter = enter_pressed();
        loop {
            session.poll()?;
            match enter.try_recv() {
                Ok(true) => return Ok(()),
                Ok(false) | Err(TryRecvError::Disconnected) => {
                    return Err(miette!(help = "--yes starts without asking", "not started: nobody pressed Enter"));
                }
                Err(TryRecvError::Empty) => {}
            }
        }
    }

    fn succeed(
        &self,
        fit: &PotentiometerFit,
        recording: &Recording,
        recorder: &Recorder,
        address: Address,
        robot: &Robot,
    ) -> Done {
        let files = CALIBRATED.fill(&self.common.out, self.overwrite, |out| {
            let title = format!("{} at {}, run.mcap", robot.name, link::address(&address));
            let mut files = identify::potentiometer::save(&self.common, fit, &title, out)?.to_vec();
            files.extend(save(out, "run", recording, recorder, address, robot)?);
            CALIBRATED.warn_older(out, &files);
            Ok(files)
        })?;
        if self.common.json {
            let (ticks, lost_ticks) = (recorder.received(), recorder.lost().0);
            print_json(&Output { fit, address: link::address(&address), ticks, lost_ticks, files: &files })?;
            return Ok(());
        }
        print(&identify::potentiometer::facts(fit));
        print(&format!("written: {}", listed(&files)));
        print(&format!("flash it: SCRAM_ROBOT={} cargo flash-robot esp32", for_shell(&files[0])));
        Ok(())
    }

    /// Keeps what was received, if anything was, without touching an earlier calibration and its recording.
    fn fail(
        &self,
        error: Report,
        recording: &Recording,
        recorder: &Recorder,
        address: Address,
        robot: &Robot,
    ) -> Report {
        if recording.is_empty() {
            return error.wrap_err("no calibration");
        }
        let kept = CALIBRATED.fill_unfinished(&self.common.out, self.overwrite, |out| {
            let files = save(out, "failed", recording, recorder, address, robot)?;
            CALIBRATED.warn_older(out, &files);
            Ok(files)
        });
        match kept {
            Ok(files) => error.wrap_err(format!("no calibration; the recording is {}", files[0].display())),
            Err(unsaved) => error.wrap_err(format!("no calibration, and the recording is lost: {unsaved}")),
        }
    }
}

/// Writes what was received, as MCAP and CSV.
fn save(
    out: &Path,
    name: &str,
    recording: &Recording,
    recorder: &Recorder,
    address: Address,
    robot: &Robot,
) -> Result<[PathBuf; 2], Report> {
    let (lost, gaps) = recorder.lost();
    let metadata = Metadata {
        robot: Some(robot.name.clone()),
        excitation: Some(format!("duty:{DUTY}")),
        notes: Some(format!("scram calibrate, robot {}, {lost} ticks lost in {gaps} gaps", link::address(&address))),
        ..Metadata::default()
    };
    let files = ["mcap", "csv"].map(|ending| out.join(name).with_extension(ending));
    write_mcap_with(&files[0], recording, &[], &metadata)?;
    write_csv_with(&files[1], recording, &[], &metadata)?;
    Ok(files)
}

/// The correction, or why a whole run gives none.
fn evaluate(recorder: &Recorder, recording: &Recording, expected: &Expected) -> Result<PotentiometerFit, Report> {
    recorder.check_tick(expected.tick_s)?;
    if recorder.lost_share() > MOST_LOST {
        return Err(miette!(
            help = "bring the dongle nearer, away from Wi-Fi routers, and plug it into the computer itself",
            "{:.0} % of the ticks were lost on the radio",
            100.0 * recorder.lost_share()
        ));
    }
    let fit = potentiometer(&expected.robot, recording).map_err(|e| advise(&e))?;
    let hz = fit.speed_rad_per_s / std::f64::consts::TAU;
    if hz < 0.0 {
        return Err(miette!(
            help = "look from above while it spins: clockwise, and the motor's two wires are swapped; counter-clockwise, \
                    and the outer two of the potentiometer are",
            "the angle falls, but positive duty turns counter-clockwise"
        ));
    }
    if hz < SLOW * expected.ceiling_hz {
        let promised = expected.ceiling_hz;
        say(&format!("note: {hz:.2} Hz where the robot file promises {promised:.2} Hz: battery? friction?"));
    }
    Ok(fit)
}

/// Spins the robot behind a progress bar. Ctrl-C, the end of the terminal and `kill` stop the motor first.
fn spin(session: &mut Session<SerialLine>, robot: RobotId, expected: &Expected) -> Result<Spin, Report> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&cancelled);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .into_diagnostic()
        .wrap_err("Ctrl-C cannot be caught, so the motor is not started")?;
    let ticks = (SPIN_S / expected.tick_s).round() as u64;
    let bar = ProgressBar::with_draw_target(Some(ticks), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("4/4  Spinning {bar:40} {msg}") {
        bar.set_style(style);
    }
    let spin = link::spin(session, robot, DUTY, ticks, &mut |done| {
        bar.set_position(done);
        bar.set_message(format!("{:.1} s", done as f64 * expected.tick_s));
        !cancelled.load(Ordering::Relaxed)
    });
    bar.finish_and_clear();
    let (lost, gaps) = spin.recorder.lost();
    say(&format!("4/4  {} ticks received, {lost} lost in {gaps} gaps", spin.recorder.received()));
    if !spin.stopped {
        say("     The robot did not say that it stopped. IF IT TURNS, TAKE THE BATTERY OUT.");
    }
    Ok(spin)
}

/// Where telemetry got lost, in words.
fn losses(session: &mut Session<SerialLine>, robot: RobotId) -> String {
    let dongle = session.count(COUNT_PATIENCE).ok().flatten().unwrap_or_default();
    let bad_frames = session.counts().bad_frames;
    let robot = session.robot(robot);
    let missing = robot.missing();
    let robot = robot.status().map(|status| status.counters).unwrap_or_default();
    format!(
        "     Many. Since they were switched on, the robot missed {} ticks and dropped {},\n     \
         the dongle dropped {} messages, {bad_frames} were damaged on the cable. In this session\n     \
         {missing} of the robot's messages did not arrive. What is not the dongle's or the\n     \
         cable's of them was lost on the radio: bring the dongle nearer.",
        robot.missed_deadlines, robot.rows_dropped, dongle.received_dropped,
    )
}

/// What to do at the bench about a recording that gives no correction.
fn advise(error: &PotentiometerError) -> Report {
    let help = match error {
        PotentiometerError::NotTurning { .. } => {
            "did it spin? If not: is the mass free, the motor plugged in, the battery charged? If it did: the \
             potentiometer does not turn with the shaft, or its wiper is not connected"
        }
        PotentiometerError::TooShort { .. } => {
            "it turned too slowly or for too short: charge the battery, free the mass, repeat"
        }
        PotentiometerError::SpeedVaries { .. } => {
            "the supply breaks down or something rubs: charge the battery, let the gearbox run warm, repeat"
        }
        PotentiometerError::RoughTurns { .. } | PotentiometerError::Undetermined { .. } => {
            "spikes on the wiper or a shaft that is braked now and then: shorten the wiper's wire, keep it away from the \
             motor's, check the mass, repeat"
        }
        PotentiometerError::NoArc { .. } => {
            "is it the potentiometer of the robot file, wired between 3.3 V and ground? Check \
             sensor.electrical_angle_deg and sensor.adc"
        }
        PotentiometerError::NoSecond
        | PotentiometerError::CodeTooLarge { .. }
        | PotentiometerError::NoCodes { .. }
        | PotentiometerError::NoPotentiometer { .. } => {
            "the robot's firmware was built from another robot file: name that one with --robot"
        }
        PotentiometerError::DriveVaries { .. } => "is another computer commanding the same robot? Repeat",
    };
    miette!(help = help, "{error}")
}

/// A line on stdin, read beside the session; false at its end.
fn enter_pressed() -> Receiver<bool> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let read = std::io::stdin().lock().read_line(&mut String::new());
        let _ = sender.send(read.is_ok_and(|bytes| bytes > 0));
    });
    receiver
}

/// The firmware is built in another directory: a path from here.
fn for_shell(path: &Path) -> String {
    if path.is_absolute() { path.display().to_string() } else { format!("$PWD/{}", path.display()) }
}

#[cfg(test)]
mod tests;
