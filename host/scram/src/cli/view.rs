//! `scram view`

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use clap::Args;
use hal_sim::body::{Plan, Snapshot, WalkingRobots};
use link::{Keys, SerialLine, Session};
use miette::{IntoDiagnostic, Report, WrapErr, miette};
use plot::view::{Setup, live_page};
use robot_file::Robot;
use scram::console::Engine;
use scram::console::screen::Signals;
use scram::live::hub::Hub;
use scram::live::server::Server;
use scram::live::{self, Live};
use testbed::realtime::{Options, Simulation};

use super::console::{DONGLE_PATIENCE, ROBOT_PATIENCE, conclude, list_of_ports};
use super::pair::KeysFile;
use super::simulated::simulate;
use super::{Common, Failure, load_robot, print, print_json};

/// Where nothing else is said.
const PORT: u16 = 7700;
/// Of the slider where the robot file has no limit, Hz.
const USUAL_LIMIT_HZ: f64 = 12.0;

/// See robots while they run: in 3D and as plots, in a browser
///
/// Serves one page on this computer and prints its address. A simulated robot shows how its body walks; a real one tells how its
/// shaft turns, and where its body is nobody measures. The page looks on; with --drive it also gives commands, and then the
/// robots are told to stop when the page that drives is closed, hidden or silent for a second. Everything is recorded as by
/// `scram console`. Ctrl-C ends it and stops every robot. docs/viewers.md
#[derive(Args)]
#[command(
    mut_arg("json", |arg| arg.help("One JSON object with the page's address on stdout")),
    mut_arg("seed", |arg| arg.help("Seed of the simulation")),
    after_help = "Examples:\n  \
        scram view --live --sim --command \"clear; freq 7\"   look on while a simulated robot walks\n  \
        scram view --live --sim --drive                       drive it from the page\n  \
        scram view --live --port /dev/ttyACM0                 robots behind a dongle\n  \
        scram view --live --sim --listen 0.0.0.0              for other computers, with a token in the address\n\n\
        A run that is over: `scram sim --view walk.html`, and docs/viewers.md for Foxglove and Rerun."
)]
pub struct View {
    /// Robots that run, now
    #[arg(long, required = true)]
    live: bool,
    /// A simulated robot behind a simulated radio and dongle, in real time
    #[arg(long, conflicts_with = "port")]
    sim: bool,
    /// The motor alone, without the simulated robot's body
    #[arg(long, requires = "sim")]
    bench: bool,
    /// The dongle's serial port
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Take commands from the page
    #[arg(long)]
    drive: bool,
    /// Commands of the console to begin with, `;` between them
    #[arg(long, short, value_name = "COMMANDS")]
    command: Option<String>,
    /// Where the page is served: a number of this computer, a port behind it where 7700 is taken
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1", value_parser = listen)]
    listen: SocketAddr,
    #[command(flatten)]
    keys: KeysFile,
    #[command(flatten)]
    common: Common,
}

/// `127.0.0.1`, `127.0.0.1:8080`, `[::1]:8080`, `localhost`.
fn listen(text: &str) -> Result<SocketAddr, String> {
    let text = if text == "localhost" { "127.0.0.1" } else { text };
    let alone = text.parse::<IpAddr>().map(|number| SocketAddr::new(number, PORT));
    alone.or_else(|_| text.parse()).map_err(|_| {
        "an address is this computer's number, and a port where another is wanted: 127.0.0.1, 0.0.0.0:8080, [::1]:8080".into()
    })
}

/// What is at the other end.
struct Connected {
    /// Alive as long as the view: it ends the simulation when it is dropped.
    _simulation: Option<Simulation>,
    keys: Keys,
    port: String,
    bodies: Option<Receiver<Vec<Snapshot>>>,
}

impl View {
    pub fn run(&self) -> Result<ExitCode, Failure> {
        debug_assert!(self.live, "it is required");
        if let Some(text) = &self.command {
            scram::console::check(text).map_err(|problem| Failure::Usage(miette!("--command: {problem}")))?;
        }
        let robot = load_robot(&self.common.robot)?;
        let hub = Arc::new(Hub::default());
        // A port that is taken is said before a robot is called.
        let page = self.page(&robot)?;
        let server =
            Server::start(self.listen, self.drive, page, Arc::clone(&hub)).map_err(|error| self.unserved(&error))?;
        let connected = self.connect(&robot)?;
        let line = SerialLine::open(&connected.port).map_err(Report::from)?;
        let nonces = link::nonces().map_err(Report::from)?;
        let session = Session::open(line, &connected.keys, nonces, DONGLE_PATIENCE).map_err(Report::from)?;
        let mut engine = Engine::new(session, if self.sim { "simulation".to_owned() } else { connected.port.clone() });
        let tick_s = robot.controller.as_ref().map_or(1e-3, |controller| controller.tick_s.value);
        engine.record(&self.common.out, tick_s).map_err(Report::from)?;
        let signals =
            Signals::listen().into_diagnostic().wrap_err("Ctrl-C cannot be caught, so no motor is started")?;
        self.say_where(&server)?;
        let live = Live { hub: &hub, drive: self.drive, bodies: connected.bodies };
        let ended = self.begin(&mut engine, &signals).and_then(|()| {
            live::run(&mut engine, &live, &|| signals.asked()).map_err(|error| Failure::Failed(error.into()))
        });
        engine.finish();
        conclude(&engine, ended.map(|()| ExitCode::SUCCESS))
    }

    /// Runs the commands to begin with.
    fn begin(&self, engine: &mut Engine<SerialLine>, signals: &Signals) -> Result<(), Failure> {
        let Some(text) = &self.command else { return Ok(()) };
        let here = scram::console::runner::wait_for_robots(engine, false, ROBOT_PATIENCE, &|| signals.asked());
        if !here.map_err(Report::from)? && !signals.asked() {
            let name = engine.model().robot().map(|robot| robot.name.clone()).unwrap_or_default();
            return Err(
                miette!(help = "is its battery in?", "robot {name} does not answer: `{text}` was not sent").into()
            );
        }
        engine.submit(text).map_err(|problem| Failure::Usage(miette!("--command: {problem}")))
    }

    fn connect(&self, robot: &Robot) -> Result<Connected, Failure> {
        if !self.sim {
            let Some(port) = &self.port else { return Err(Failure::Usage(list_of_ports())) };
            return Ok(Connected { _simulation: None, keys: self.keys.load()?, port: port.clone(), bodies: None });
        }
        let (watcher, bodies) = channel();
        let walks = self.walks(robot);
        let watched = Options { on_ground: walks, watcher: walks.then_some(watcher), ..Options::default() };
        let options = Options { seed: self.common.seed, ..watched };
        let (simulation, keys) = simulate(robot, &self.common.robot, 1, options)?;
        let port = simulation.port().display().to_string();
        Ok(Connected { _simulation: Some(simulation), keys, port, bodies: walks.then_some(bodies) })
    }

    /// Whether the body is simulated.
    fn walks(&self, robot: &Robot) -> bool {
        self.sim && !self.bench && robot.body.is_some()
    }

    fn page(&self, robot: &Robot) -> Result<String, Report> {
        let body = match &robot.body {
            None => None,
            Some(_) => {
                let plan = Plan::new(robot).into_diagnostic()?;
                let resting = WalkingRobots::alone(robot, self.common.seed, &hal_sim::Settings::default());
                Some((plan, resting.into_diagnostic()?.snapshot(0)))
            }
        };
        let limit = robot.controller.as_ref().and_then(|controller| controller.numbers.get("limits.frequency_hz"));
        Ok(live_page(&Setup {
            title: &robot.name,
            body: body.as_ref().map(|(plan, rest)| (plan, rest)),
            moves: self.walks(robot),
            drive: self.drive,
            frequency_limit_hz: limit.map_or(USUAL_LIMIT_HZ, |limit| limit.value),
        }))
    }

    fn unserved(&self, error: &std::io::Error) -> Report {
        let taken = error.kind() == std::io::ErrorKind::AddrInUse;
        let help = if taken {
            "name another port, for example --listen 127.0.0.1:7701"
        } else {
            "is it a number of this computer?"
        };
        miette!(help = help, "the page cannot be served at {}: {error}", self.listen)
    }

    fn say_where(&self, server: &Server) -> Result<(), Report> {
        let url = server.url();
        if self.common.json {
            return print_json(&serde_json::json!({ "url": url, "drive": self.drive }));
        }
        print(&url);
        if self.listen.ip() == IpAddr::V4(Ipv4Addr::UNSPECIFIED) {
            print("from another computer: the same with this computer's number in it");
        }
        Ok(())
    }
}
