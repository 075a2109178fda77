//! `scram console`

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

use clap::Args;
use link::serial;
use link::{Keys, SerialLine, Session};
use miette::{IntoDiagnostic, Report, WrapErr, miette};
use robot_file::Robot;
use scram::console::runner::{self, End, Output};
use scram::console::screen::{self, ScreenOptions};
use scram::console::{Engine, HELP, Poses};
use testbed::realtime::{Options, Simulation};

use super::pair::KeysFile;
use super::simulated::{send_poses, simulate};
use super::{Common, Failure, load_robot, print, print_json, push, say, walk};

/// A dongle that was just restarted by opening its port needs a second to boot.
pub(super) const DONGLE_PATIENCE: Duration = Duration::from_secs(4);
/// A robot that is switched on answers within a second.
pub(super) const ROBOT_PATIENCE: Duration = Duration::from_secs(5);
/// What a robot does shows in its telemetry within this time.
const SHOWS: Duration = Duration::from_millis(60);
/// For a list of robots: those that are there have answered by then.
const LIST_PATIENCE: Duration = Duration::from_secs(2);

/// Drive robots: on a screen, or with commands and scripts
///
/// Without --port or --sim it lists the serial ports that it finds. Everything is recorded from the start into
/// console-NNNN.mcap in --out. Esc stops every robot, whatever is on the screen.
#[derive(Args)]
#[command(
    mut_arg("json", |arg| arg.help("One JSON object a line on stdout, with --command or --script")),
    mut_arg("seed", |arg| arg.help("Seed of the simulation")),
    after_help = "Examples:\n  \
        scram console --sim\n  \
        scram console --port /dev/ttyACM0\n  \
        scram console --port /dev/ttyACM0 --command \"freq 7; wait 2s; oscillate -100 100; wait 2s; stop\"\n  \
        scram console --sim --json --command \"get controller.limits.frequency_hz; status\"\n  \
        scram console --port /dev/ttyACM0 --push out/latest-diagnose/robot.toml\n  \
        scram console --sim --poses 7701 --alpha 90 --command \"clear; policy out/latest-learn/policy.json; wait 20s\"\n\n\
        `scram console --commands` lists the commands.\n\n\
        Exit codes with --command and --script: 0 done, 1 it could not be done (no dongle, no robot, a full disk: not\n\
        everything was recorded), 2 wrong usage, 3 refused by the robot or too late, 4 no answer or no longer heard, 5 the robot stopped itself. However it ends, the\n\
        robots are told to stop."
)]
pub struct Console {
    /// The dongle's serial port
    #[arg(long, value_name = "PORT", conflicts_with = "sim")]
    port: Option<String>,
    /// A simulated robot behind a simulated radio and dongle, in real time
    #[arg(long)]
    sim: bool,
    /// How many simulated robots
    #[arg(long, value_name = "N", requires = "sim", default_value_t = 1,
          value_parser = clap::value_parser!(u16).range(1..=7))]
    robots: u16,
    /// Run commands without a screen, `;` between them
    #[arg(long, short, value_name = "COMMANDS")]
    command: Option<String>,
    /// Run a script without a screen: a command a line, `#` begins a comment, a number before a command is its time in s
    #[arg(long, value_name = "FILE", conflicts_with = "command")]
    script: Option<PathBuf>,
    /// Send the parameters of a robot file to the robot, the extended file of a diagnosis, say, and save them there. --robot is
    /// the file that it was flashed with
    #[arg(long, value_name = "FILE", conflicts_with_all = ["command", "script"])]
    push: Option<PathBuf>,
    /// Pick the robot that commands are for: by name or address
    #[arg(long, value_name = "ROBOT")]
    pick: Option<String>,
    /// Where the robots' poses come by UDP, for `policy`: a port of this computer alone, or an address of its own and a port. With
    /// --sim the simulated robots walk and send them there
    #[arg(long, value_name = "[ADDRESS:]PORT", value_parser = listen)]
    poses: Option<SocketAddr>,
    /// Of the simulated robots that walk, angle α by which their backbones are rolled, degrees, instead of the robot file's
    #[arg(long, value_name = "DEG", value_parser = walk::alpha, allow_negative_numbers = true, requires_all = ["sim", "poses"])]
    alpha: Option<f64>,
    /// List the commands
    #[arg(long)]
    commands: bool,
    /// Plots and frames in ASCII
    #[arg(long)]
    ascii: bool,
    /// No colours (as with NO_COLOR=1)
    #[arg(long)]
    no_color: bool,
    #[command(flatten)]
    keys: KeysFile,
    #[command(flatten)]
    common: Common,
}

impl Console {
    pub fn run(&self) -> Result<ExitCode, Failure> {
        if self.commands {
            HELP.iter().for_each(|(form, what)| print(&format!("{form:<20} {what}")));
            return Ok(ExitCode::SUCCESS);
        }
        let mut robot = self.common.robot()?;
        walk::roll(&mut robot, self.alpha)?;
        // A port that is taken is said before a robot is called.
        let poses = self.poses.map(|at| Poses::listen(at).map_err(|error| unheard(at, &error))).transpose()?;
        let poses_at = poses.as_ref().map(Poses::address).transpose().into_diagnostic()?;
        // Alive as long as the console: it ends the simulation when it is dropped.
        let (_simulation, keys, port) = self.connect(&robot, poses_at)?;
        let line = SerialLine::open(&port).map_err(Report::from)?;
        let nonces = link::nonces().map_err(Report::from)?;
        let session = Session::open(line, &keys, nonces, DONGLE_PATIENCE).map_err(Report::from)?;
        let mut engine = Engine::new(session, if self.sim { "simulation".to_owned() } else { port });
        if let Some(poses) = poses {
            engine.hear_poses(poses);
        }
        if let Some(which) = &self.pick {
            engine.submit(&format!("robot {which}")).map_err(|problem| Failure::Usage(miette!("--pick: {problem}")))?;
        }
        let tick_s = robot.controller.as_ref().map_or(1e-3, |controller| controller.tick_s.value);
        engine.record(&self.common.out, tick_s).map_err(Report::from)?;
        if self.command.is_some() || self.script.is_some() || self.push.is_some() {
            return self.without_screen(&mut engine, &robot);
        }
        let options = ScreenOptions::detect(self.no_color, self.ascii);
        let ended = screen::run(&mut engine, &options).map(|()| ExitCode::SUCCESS);
        conclude(&engine, ended.map_err(Failure::from))
    }

    /// The port, and the keys of the robots behind it.
    fn connect(&self, robot: &Robot, poses: Option<SocketAddr>) -> Result<(Option<Simulation>, Keys, String), Failure> {
        if self.sim {
            let (watcher, bodies) = channel();
            let watched = Options { on_ground: poses.is_some(), watcher: poses.map(|_| watcher), ..Options::default() };
            let options = Options { seed: self.common.seed, ..watched };
            let (simulation, keys) = simulate(robot, &self.common.robot, usize::from(self.robots), options)?;
            if let Some(to) = poses {
                send_poses(robot, bodies, to).into_diagnostic().wrap_err("no poses can be sent")?;
            }
            let port = simulation.port().display().to_string();
            return Ok((Some(simulation), keys, port));
        }
        let Some(port) = &self.port else { return Err(Failure::Usage(list_of_ports())) };
        Ok((None, self.keys.load()?, port.clone()))
    }

    fn without_screen(&self, engine: &mut Engine<SerialLine>, robot: &Robot) -> Result<ExitCode, Failure> {
        let cancelled = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&cancelled);
        ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
            .into_diagnostic()
            .wrap_err("Ctrl-C cannot be caught, so no motor is started")?;
        let ended = self.run_commands(engine, robot, &|| cancelled.load(Ordering::Relaxed));
        engine.finish();
        let ended = if cancelled.load(Ordering::Relaxed) { Err(miette!("stopped on request").into()) } else { ended };
        conclude(engine, ended)
    }

    fn run_commands(
        &self,
        engine: &mut Engine<SerialLine>,
        robot: &Robot,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<ExitCode, Failure> {
        let words: Vec<&str> = self.command.iter().flat_map(|text| text.split(';')).map(str::trim).collect();
        let wrong = |problem: String| Failure::Usage(miette!("{problem}"));
        // What is wrong is said before anything is waited for.
        if let Some(text) = &self.command {
            scram::console::check(text).map_err(wrong)?;
        }
        let pushed = self.push.as_deref().map(load_robot).transpose()?;
        let only_list = !words.is_empty() && words.iter().all(|word| *word == "list");
        let patience = if only_list { LIST_PATIENCE } else { ROBOT_PATIENCE };
        let here = runner::wait_for_robots(engine, only_list, patience, cancelled).map_err(Report::from)?;
        if only_list {
            self.list(engine)?;
            return Ok(ExitCode::SUCCESS);
        }
        if !here {
            let name = engine.model().robot().map(|robot| robot.name.clone()).unwrap_or_default();
            return Err(Failure::Failed(miette!(
                help = "is its battery in? `--command list` lists the robots; `--pick` picks another one",
                "robot {name} does not answer"
            )));
        }
        if let Some(file) = &pushed {
            return Ok(ExitCode::from(self.push(engine, file, robot, cancelled)?.code()));
        }
        let mut end = End::Done;
        match (&self.command, &self.script) {
            (Some(text), _) => {
                // Status and list are told as they are at their place among the others.
                for part in parts(text) {
                    end = self.run_part(engine, &part, cancelled)?;
                    if end != End::Done || cancelled() || engine.wants_to_quit() {
                        break;
                    }
                }
            }
            (None, Some(path)) => {
                engine.run_script(path).map_err(wrong)?;
                end = runner::run(engine, &mut |told| self.tell(&told), cancelled).map_err(Report::from)?;
            }
            (None, None) => {}
        }
        Ok(ExitCode::from(end.code()))
    }

    /// Sends what a robot file asks of the robot's parameters; `built_in` is the file of its image.
    fn push(
        &self,
        engine: &mut Engine<SerialLine>,
        file: &Robot,
        built_in: &Robot,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<End, Failure> {
        let mut answered = Vec::new();
        let mut end = submit(engine, &push::questions(), cancelled, &mut |told| match told {
            Output::Answer { parameter: Some(parameter), .. } => answered.push(parameter),
            other => self.tell(&other),
        })?;
        if end != End::Done {
            return Ok(end);
        }
        let pushed = push::push(file, built_in, &answered).into_diagnostic()?;
        let commands = pushed.commands();
        if commands.is_empty() {
            say("the robot has every parameter that can be sent already");
        } else {
            end = submit(engine, &commands, cancelled, &mut |told| self.tell(&told))?;
        }
        for left in &pushed.left {
            say(&format!("not sent: {left}"));
        }
        if pushed.needs_flashing {
            say(
                "not sent: motor, load, supply, sensor map and the gains that follow from them are built into the firmware: flash \
                 the robot with this file to take them over",
            );
        }
        Ok(if end == End::Done && !pushed.left.is_empty() { End::Refused } else { end })
    }

    fn run_part(
        &self,
        engine: &mut Engine<SerialLine>,
        part: &str,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<End, Failure> {
        match part {
            "list" => self.list(engine)?,
            "status" => {
                // What was just done shows in the next telemetry.
                let until = engine.model().now + SHOWS;
                while engine.model().now < until {
                    engine.poll().map_err(Report::from)?;
                }
                let selected = engine.model().selected;
                self.tell_state(engine, selected)?;
            }
            commands => {
                return submit(engine, commands, cancelled, &mut |told| self.tell(&told));
            }
        }
        Ok(End::Done)
    }

    fn list(&self, engine: &Engine<SerialLine>) -> Result<(), Report> {
        (0..engine.model().robots.len()).try_for_each(|index| self.tell_state(engine, index))
    }

    fn tell_state(&self, engine: &Engine<SerialLine>, index: usize) -> Result<(), Report> {
        let Some(state) = runner::robot_state(engine, index) else { return Ok(()) };
        if self.common.json {
            return print_json(&Output::Robot(Box::new(state)));
        }
        let mut line = format!("{} at {}: ", state.robot, state.address);
        match (state.present, state.state) {
            (false, _) => line += "not heard",
            (true, said) => line += said.unwrap_or("here"),
        }
        if let Some(fault) = state.fault {
            line += &format!(" ({})", link::fault(fault).0);
        }
        let number = |value: Option<f64>, unit: &str, digits: usize| {
            value.map(|value| format!(", {value:.digits$} {unit}")).unwrap_or_default()
        };
        line += &number(state.frequency_hz, "Hz", 2);
        line += &number(state.duty, "duty", 2);
        line += &number(state.battery_v, "V", 2);
        line += &number(state.loss.map(|loss| 100.0 * loss), "% lost", 1);
        line += &number(state.round_trip_ms, "ms there and back", 1);
        line += &state.rssi_dbm.map(|rssi| format!(", {rssi} dBm")).unwrap_or_default();
        print(&line);
        Ok(())
    }

    fn tell(&self, told: &Output) {
        if self.common.json {
            // A value that cannot be written as JSON does not exist here.
            let _ = print_json(told);
            return;
        }
        match told {
            Output::Answer { command, text, parameter, .. } if parameter.is_none() => {
                print(&format!("{command}: {text}"))
            }
            Output::Answer { text, .. } | Output::Note { text, .. } => print(text),
            Output::Fault { robot, text, .. } => print(&format!("{robot} stopped itself: {text}")),
            Output::Robot(_) => {}
        }
    }
}

/// `7701`, `192.168.1.2:7701`, `[::1]:7701`.
fn listen(text: &str) -> Result<SocketAddr, String> {
    let alone = text.parse::<u16>().map(|port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port));
    alone.or_else(|_| text.parse()).map_err(|_| {
        "poses come to a port, or to this computer's number and a port: 7701, 192.168.1.2:7701, [::1]:7701".into()
    })
}

fn unheard(at: SocketAddr, error: &std::io::Error) -> Report {
    miette!(help = "is the port taken, and is it a number of this computer?", "poses cannot be heard at {at}: {error}")
}

/// Runs commands to their end.
fn submit(
    engine: &mut Engine<SerialLine>,
    commands: &str,
    cancelled: &dyn Fn() -> bool,
    told: &mut dyn FnMut(Output),
) -> Result<End, Failure> {
    engine.submit(commands).map_err(|problem| Failure::Usage(miette!("{problem}")))?;
    Ok(runner::run(engine, told, cancelled).map_err(Report::from)?)
}

/// `status` and `list` by themselves, everything between them together: a program keeps its waits.
fn parts(text: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    let mut together: Vec<&str> = Vec::new();
    for word in text.split(';').map(str::trim).filter(|word| !word.is_empty()) {
        if matches!(word, "status" | "list") {
            if !together.is_empty() {
                parts.push(std::mem::take(&mut together).join("; "));
            }
            parts.push(word.to_owned());
        } else {
            together.push(word);
        }
    }
    if !together.is_empty() {
        parts.push(together.join("; "));
    }
    parts
}

/// Says where everything is recorded. If not all of it is, the console has not done what it was asked for; what went wrong
/// with a robot goes before that.
pub(super) fn conclude(engine: &Engine<SerialLine>, ended: Result<ExitCode, Failure>) -> Result<ExitCode, Failure> {
    let Some(recording) = &engine.model().recording else { return ended };
    say(&format!("recorded: {}", recording.path.display()));
    let Some(why) = &recording.failed else { return ended };
    match ended {
        Ok(ExitCode::SUCCESS) => Err(miette!(
            help = "see to the disk, or choose another directory with --out; the next console begins a new file",
            "not everything was recorded: {why}"
        )
        .into()),
        other => {
            say(&format!("warning: not everything was recorded: {why}"));
            other
        }
    }
}

pub(super) fn list_of_ports() -> Report {
    let ports = serial::available();
    let found = ports.iter().map(|(name, product)| match product {
        Some(product) => format!("  --port {name}   ({product})"),
        None => format!("  --port {name}"),
    });
    let list: Vec<String> = found.collect();
    let list = if list.is_empty() { "  this machine has no serial port".to_owned() } else { list.join("\n") };
    miette!(help = "--sim drives a simulated robot", "which dongle? There are\n{list}")
}
