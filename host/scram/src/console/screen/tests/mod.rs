//! The screen with a console that follows a script, on a terminal of any size.

mod keys;
mod pictures;
mod rounds;

use std::path::PathBuf;
use std::time::Duration;

use control::{Fault, State};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};

use super::{Console, History, Prompt, Screen, Theme, draw};
use crate::console::model::{Level, Model, RecordingModel, RobotModel, Series};
use crate::console::{Candidate, Completion};
use link::{LinkError, Quality};

/// A console that notes what is asked of it.
#[derive(Default)]
struct Scripted {
    model: Model,
    asked: Vec<String>,
    /// What `poll` says, the next first; then that nothing happened.
    polls: Vec<Result<bool, LinkError>>,
    quits: bool,
}

impl Console for Scripted {
    fn poll(&mut self) -> Result<bool, LinkError> {
        self.asked.push("poll".into());
        if self.polls.is_empty() { Ok(false) } else { self.polls.remove(0) }
    }

    fn model(&self) -> &Model {
        &self.model
    }

    fn submit(&mut self, line: &str) -> Result<(), String> {
        self.asked.push(format!("submit {line}"));
        self.quits = line == "quit";
        if line.starts_with("bad") { Err(format!("`{line}` is no command")) } else { Ok(()) }
    }

    fn complete(&self, line: &str, cursor: usize) -> Completion {
        let all = ["freq ", "factory", "get ", "stop"];
        let fits = all.iter().filter(|text| text.starts_with(&line[..cursor]));
        let candidates = fits.map(|text| Candidate { text: (*text).into(), help: format!("what {text} does") });
        Completion { start: 0, candidates: candidates.collect() }
    }

    fn stop_all(&mut self) {
        self.asked.push("stop all".into());
    }

    fn select(&mut self, index: usize) {
        self.model.selected = index;
    }

    fn undo(&mut self) -> Result<(), String> {
        self.asked.push("undo".into());
        Err("there is no `set` to take back".into())
    }

    fn wants_to_quit(&self) -> bool {
        self.quits
    }

    fn finish(&mut self) {
        self.asked.push("finish".into());
    }
}

impl Scripted {
    fn with(robots: usize) -> Self {
        Self { model: model(robots), ..Self::default() }
    }

    /// What was asked of it, without the polls.
    fn deeds(&self) -> Vec<&str> {
        self.asked.iter().map(String::as_str).filter(|deed| *deed != "poll").collect()
    }
}

const NOW_S: f64 = 75.0;

/// Robots that hold 7 Hz, with 30 s behind them.
fn model(robots: usize) -> Model {
    let names = ["alpha", "beta", "gamma", "delta", "epsilon"];
    let robot = |index: usize| RobotModel {
        name: names[index % names.len()].to_owned(),
        present: true,
        state: Some(State::Speed),
        tracking: true,
        failed_sensor: None,
        target: Some("freq 7".into()),
        battery_v: Some(3.92),
        quality: Quality {
            rate_hz: 99.5,
            loss: Some(0.021),
            round_trip: Some(Duration::from_millis(12)),
            rssi_dbm: Some(-52),
        },
        ticks: (74_990, 10),
        uptime: Some(Duration::from_secs(3_725)),
        series: series(),
        ..RobotModel::default()
    };
    let mut model = Model {
        now: Duration::from_secs_f64(NOW_S),
        robots: (0..robots).map(robot).collect(),
        dongle: Some(([0x7c, 0xdf, 0xa1, 0, 0x11, 0x22], 6)),
        port: "/dev/ttyACM0".into(),
        recording: Some(RecordingModel { path: PathBuf::from("out/walk.mcap"), bytes: 1_230_000, failed: None }),
        ..Model::default()
    };
    for number in 0..40 {
        model.now = Duration::from_secs(number + 1);
        model.log(Some(0), Level::Note, format!("event {number}"));
    }
    model.now = Duration::from_secs_f64(NOW_S);
    model
}

fn series() -> Series {
    let mut series = Series::default();
    for point in 0..3000 {
        let t = NOW_S - 29.99 + f64::from(point) / 100.0;
        series.frequency.push(t, 7.0 + 0.1 * (3.0 * t).sin());
        series.angle.push(t, (t * 2520.0).rem_euclid(360.0) - 180.0);
        series.duty.push(t, -0.6 + 0.1 * (9.0 * t).sin());
        series.battery.push(t, 3.92);
        series.loss.push(t, 0.021);
        series.round_trip.push(t, 12.0);
    }
    series
}

const UNICODE: Theme = Theme { colour: true, ascii: false };
const ASCII: Theme = Theme { colour: false, ascii: true };

fn screen(theme: Theme) -> Screen {
    Screen::new(theme, Prompt::new(History::default()))
}

fn terminal(width: u16, height: u16) -> Terminal<TestBackend> {
    Terminal::new(TestBackend::new(width, height)).expect("it cannot fail")
}

/// The rows of a picture.
fn picture(model: &Model, screen: &mut Screen, width: u16, height: u16) -> Vec<String> {
    let mut terminal = terminal(width, height);
    terminal.draw(|frame| draw(frame, model, screen)).expect("it cannot fail");
    let cells = terminal.backend().buffer().content().chunks(usize::from(width).max(1));
    cells.map(|row| row.iter().map(ratatui::buffer::Cell::symbol).collect()).collect()
}

fn key(code: KeyCode) -> Event {
    Event::Key(KeyEvent::new(code, KeyModifiers::NONE))
}

fn control_and(c: char) -> Event {
    Event::Key(KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL))
}

fn fault(model: &mut Model, fault: Fault) {
    model.robots[0].state = Some(State::Fault);
    model.robots[0].fault = Some(fault);
    model.robots[0].target = None;
}
