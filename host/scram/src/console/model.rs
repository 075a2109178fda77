//! What the console knows, for whoever shows it: plain data, brought up to date by the [engine](super::engine).

use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::Duration;

use control::protocol::dongle::Address;
use control::protocol::radio::{Batch, Counters};
use control::{Fault, Sensor, State};

use common::conventions;
use link::Quality;

/// Length of the plots.
pub const PLOTTED: Duration = Duration::from_secs(30);
/// Points of a plot: one a telemetry message, a hundred a second.
const POINTS: usize = 3000;
/// Lines of the log that are kept to be shown.
const LINES: usize = 500;

/// State of the console that a screen shows.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Time on the line's clock.
    pub now: Duration,
    /// Every robot that is paired with this console, in the order of its keys.
    pub robots: Vec<RobotModel>,
    /// The one that commands are for.
    pub selected: usize,
    /// What happened, the latest last.
    pub log: VecDeque<LogLine>,
    /// Lines that were ever in the log.
    pub logged: u64,
    /// The dongle's address and channel.
    pub dongle: Option<(Address, u8)>,
    /// The dongle's port, or what it is called in a simulation.
    pub port: String,
    /// Where everything is recorded.
    pub recording: Option<RecordingModel>,
    /// A gait script that runs: its file and the line that is next.
    pub script: Option<(PathBuf, usize)>,
}

/// The recording.
#[derive(Clone, Debug, Default)]
pub struct RecordingModel {
    /// Path of the file, as given.
    pub path: PathBuf,
    /// Its size so far.
    pub bytes: u64,
    /// Why nothing is recorded any more.
    pub failed: Option<String>,
}

/// State of a robot that a screen shows.
#[derive(Clone, Debug, Default)]
pub struct RobotModel {
    /// Its name.
    pub name: String,
    /// ESP-NOW (MAC) address.
    pub address: Address,
    /// There is a session with it.
    pub present: bool,
    /// It speaks another version of the protocol.
    pub other_version: Option<u32>,
    /// `Stop` is on its way.
    pub stopping: bool,
    /// Its state, as it last told.
    pub state: Option<State>,
    /// Cause of the fault; `None` outside `State::Fault`.
    pub fault: Option<Fault>,
    /// An angle has been acquired.
    pub tracking: bool,
    /// Of two angle sensors the one that has failed.
    pub failed_sensor: Option<Sensor>,
    /// The command that it follows, as typed: the last one that drives and that it has done.
    pub target: Option<String>,
    /// Battery voltage, V; `None` where it is not measured.
    pub battery_v: Option<f64>,
    /// The way from and to it.
    pub quality: Quality,
    /// Ticks that came, and that are missing among them.
    pub ticks: (u64, u64),
    /// What it counts, as it last told.
    pub counters: Option<Counters>,
    /// Since its boot.
    pub uptime: Option<Duration>,
    /// What is plotted.
    pub series: Series,
}

/// What is plotted, one point a telemetry message. Times in s on the line's clock.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Frequency, Hz, the thesis's sign: positive is clockwise from above.
    pub frequency: Plot,
    /// Shaft angle, deg, −180 … 180, counter-clockwise; nothing while it is not known.
    pub angle: Plot,
    /// Duty, −1 … 1, counter-clockwise; 0 while the bridge is off.
    pub duty: Plot,
    /// Battery voltage, V.
    pub battery: Plot,
    /// Share of frames that are missing, 0 … 1.
    pub loss: Plot,
    /// Round trip, ms.
    pub round_trip: Plot,
}

/// A plot's points, oldest first. Bounded.
#[derive(Clone, Debug, Default)]
pub struct Plot(VecDeque<(f64, f64)>);

impl Plot {
    /// Adds a point; the oldest goes where there is no room.
    pub fn push(&mut self, t_s: f64, value: f64) {
        if self.0.len() == POINTS {
            self.0.pop_front();
        }
        self.0.push_back((t_s, value));
    }

    /// The points from a time on.
    pub fn since(&self, t_s: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.0.iter().copied().skip_while(move |(t, _)| *t < t_s)
    }

    /// Time of the latest point, s.
    #[must_use]
    pub fn last_time(&self) -> Option<f64> {
        self.0.back().map(|(t_s, _)| *t_s)
    }

    /// The latest value.
    #[must_use]
    pub fn last(&self) -> Option<f64> {
        self.0.back().map(|(_, value)| *value)
    }
}

/// How much a line of the log matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Information only.
    Note,
    /// The command was carried out.
    Good,
    /// Something that a person should look at.
    Warning,
    /// Something stopped, or did not work.
    Bad,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// When, on the line's clock.
    pub at: Duration,
    /// Name of the robot, or `None` for the console itself.
    pub robot: Option<String>,
    /// How much it matters.
    pub level: Level,
    /// Message.
    pub text: String,
    /// It answers a command that is answered nowhere else, such as a list.
    pub only_said: bool,
}

impl Model {
    /// Adds a line to the log.
    pub fn log(&mut self, robot: Option<usize>, level: Level, text: impl Into<String>) {
        if self.log.len() == LINES {
            self.log.pop_front();
        }
        let robot = robot.and_then(|index| self.robots.get(index)).map(|robot| robot.name.clone());
        self.logged += 1;
        self.log.push_back(LogLine { at: self.now, robot, level, text: text.into(), only_said: false });
    }

    /// Adds a line that answers a command.
    pub fn say(&mut self, robot: Option<usize>, text: impl Into<String>) {
        self.log(robot, Level::Note, text);
        if let Some(line) = self.log.back_mut() {
            line.only_said = true;
        }
    }

    /// The robot that commands are for.
    #[must_use]
    pub fn robot(&self) -> Option<&RobotModel> {
        self.robots.get(self.selected)
    }
}

impl Series {
    /// Takes a telemetry message.
    pub fn take(&mut self, batch: &Batch, t_s: f64) {
        let count = batch.rows.len().max(1) as f64;
        let mean = |value: &dyn Fn(&control::protocol::radio::PackedTick) -> f64| {
            batch.rows.iter().map(value).sum::<f64>() / count
        };
        self.frequency.push(t_s, conventions::frequency_from_omega(mean(&|row| f64::from(row.speed()))));
        self.duty.push(t_s, mean(&|row| f64::from(row.duty().unwrap_or(0.0))));
        if let (true, Some(row)) = (batch.tracking, batch.rows.last()) {
            self.angle.push(t_s, f64::from(row.angle()).to_degrees());
        }
        if batch.battery_mv > 0 {
            self.battery.push(t_s, f64::from(batch.battery_mv) / 1e3);
        }
    }
}
