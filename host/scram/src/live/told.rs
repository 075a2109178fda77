//! What the pages are told, as JSON: everything when a page comes, then what is new. Frequencies in Hz with the thesis's sign,
//! angles in degrees counter-clockwise, times in s on the line's clock; the body's times are the simulation's.

use std::collections::VecDeque;

use hal_sim::body::Snapshot;
use serde_json::{Value, json};

use super::level;
use crate::console::model::{Model, PLOTTED, Plot, RobotModel};

/// Lines of the log that a page gets when it comes.
const LINES: usize = 100;
/// Snapshots of a body that wait to be told, a second of them: of a loop that was kept off the latest count.
const MOST_BODIES: usize = 100;

/// What was told already.
#[derive(Debug, Default)]
pub struct Told {
    /// Lines of the log.
    logged: u64,
    /// Time of the newest point of each of the selected robot's plots, in the order of [`plots`], and which robot that is.
    newest: [f64; 5],
    selected: usize,
    bodies: VecDeque<Value>,
}

impl Told {
    /// Takes snapshots of the first robot.
    pub fn bodies(&mut self, snapshots: impl Iterator<Item = Vec<Snapshot>>) {
        for snapshot in snapshots.filter_map(|of_robots| of_robots.into_iter().next()) {
            if self.bodies.len() == MOST_BODIES {
                self.bodies.pop_front();
            }
            let channels = plot::view::channels(&snapshot).into_iter().map(|value| rounded(value, 1e6));
            self.bodies.push_back(json!([rounded(snapshot.time_s, 1e6), channels.collect::<Vec<_>>()]));
        }
    }

    /// For a page that comes: the plots and the log so far. What is new follows with the next [`Told::news`].
    pub fn all(&self, model: &Model) -> String {
        let from = (model.now.as_secs_f64() - PLOTTED.as_secs_f64()).max(0.0);
        let points = model.robot().map(|robot| {
            let plots = plots(robot).into_iter().zip(self.newest);
            let told =
                plots.map(|((name, plot), newest)| (name.to_owned(), points(plot, |t| from <= t && t <= newest)));
            Value::Object(told.collect())
        });
        let untold = usize::try_from(model.logged - self.logged).unwrap_or(usize::MAX);
        let told = model.log.len().saturating_sub(untold);
        let lines = model.log.iter().take(told).skip(told.saturating_sub(LINES)).map(line);
        json!({ "kind": "all", "plotted_s": PLOTTED.as_secs_f64(), "points": points, "log": lines.collect::<Vec<_>>() })
            .to_string()
    }

    /// What is new since the last time, for every page.
    pub fn news(&mut self, model: &Model) -> String {
        if std::mem::replace(&mut self.selected, model.selected) != model.selected {
            self.newest = [f64::NEG_INFINITY; 5];
        }
        let points = model.robot().map(|robot| {
            let plots = plots(robot).into_iter().zip(&mut self.newest);
            let told = plots.map(|((name, plot), newest)| {
                let news = points(plot, |t| t > *newest);
                *newest = plot.last_time().unwrap_or(*newest);
                (name.to_owned(), news)
            });
            Value::Object(told.collect())
        });
        let new = usize::try_from(model.logged - self.logged).unwrap_or(usize::MAX).min(model.log.len());
        self.logged = model.logged;
        let lines = model.log.iter().skip(model.log.len() - new).map(line);
        let bodies: Vec<Value> = self.bodies.drain(..).collect();
        json!({
            "kind": "news",
            "t_s": model.now.as_secs_f64(),
            "selected": model.selected,
            "robots": model.robots.iter().map(state).collect::<Vec<_>>(),
            "points": points,
            "body": bodies,
            "log": lines.collect::<Vec<_>>(),
            "recording": model.recording.as_ref().map(|recording| json!({
                "path": recording.path.display().to_string(), "bytes": recording.bytes, "failed": recording.failed,
            })),
        })
        .to_string()
    }
}

/// A command that was not taken.
pub fn refused(why: &str) -> String {
    json!({ "kind": "refused", "text": why }).to_string()
}

fn plots(robot: &RobotModel) -> [(&'static str, &Plot); 5] {
    let series = &robot.series;
    [
        ("frequency_hz", &series.frequency),
        ("angle_deg", &series.angle),
        ("duty", &series.duty),
        ("battery_v", &series.battery),
        ("round_trip_ms", &series.round_trip),
    ]
}

fn points(plot: &Plot, wanted: impl Fn(f64) -> bool) -> Value {
    let points = plot.since(f64::NEG_INFINITY).filter(|(t_s, _)| wanted(*t_s));
    points.map(|(t_s, value)| json!([rounded(t_s, 1e4), rounded(value, 1e4)])).collect()
}

/// To so many parts of one: a page draws no more.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}

fn state(robot: &RobotModel) -> Value {
    json!({
        "name": robot.name,
        "address": link::address(&robot.address),
        "present": robot.present,
        "state": robot.state.map(link::state),
        "is_fault": robot.fault.is_some(),
        "fault": robot.fault.map(|fault| link::fault(fault).0),
        "advice": robot.fault.map(|fault| link::fault(fault).1),
        "tracking": robot.tracking,
        "target": robot.target,
        "battery_v": robot.battery_v,
        "rate_hz": robot.quality.rate_hz,
        "loss": robot.quality.loss,
        "round_trip_ms": robot.quality.round_trip.map(|trip| trip.as_secs_f64() * 1e3),
        "rssi_dbm": robot.quality.rssi_dbm,
    })
}

fn line(line: &crate::console::model::LogLine) -> Value {
    json!({ "t_s": line.at.as_secs_f64(), "robot": line.robot, "level": level(line.level), "text": line.text })
}
