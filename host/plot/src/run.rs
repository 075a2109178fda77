//! The plots of a simulated run: one file a subject, and an overview.

use plotters::style::RGBColor;

use super::panel::{Band, Line, Panel, PlotError, Size, render};
use common::conventions::{degrees, frequency_from_omega};
use common::wrap;
use simulation::{DriveCommand, Tick, Trace};

// Colours that the colour-blind tell apart (Okabe and Ito).
const TRUTH: RGBColor = RGBColor(30, 30, 30);
const ESTIMATE: RGBColor = RGBColor(213, 94, 0);
const TARGET: RGBColor = RGBColor(0, 114, 178);
const READING: RGBColor = RGBColor(86, 180, 233);
const VOLTAGE: RGBColor = RGBColor(0, 158, 115);
const CURRENT: RGBColor = RGBColor(204, 121, 167);

/// One subject a file.
const SINGLE: Size = Size { width: 1100, height: 420 };
/// The overview's panels.
const OVERVIEW: Size = Size { width: 1100, height: 250 };
/// Turns that the close-up of the estimate shows at most.
const CLOSE_UP_S: f64 = 0.5;

/// Every name (without `.svg`) that [`plots`] can give.
pub const PLOT_NAMES: [&str; 7] = ["overview", "speed", "phase", "angle", "estimate", "voltage", "current"];

/// The plots of a run by name, without `.svg`.
///
/// # Errors
/// The drawing library refuses.
pub fn plots(trace: &Trace) -> Result<Vec<(&'static str, String)>, PlotError> {
    let view = View::new(trace);
    let holds_speed = trace.commands.iter().any(|given| matches!(given.command, DriveCommand::Freq { .. }));
    let mut subjects = vec![("speed", vec![view.speed()])];
    if holds_speed {
        subjects.push(("phase", vec![view.phase()]));
    }
    if !holds_speed || trace.commands.len() > 1 {
        subjects.push(("angle", vec![view.angle()]));
    }
    subjects.push(("estimate", vec![view.close_up(), view.estimate_error()]));
    subjects.push(("voltage", vec![view.voltage()]));
    subjects.push(("current", vec![view.current()]));

    let mut overview: Vec<Panel> = subjects.iter().filter_map(|(_, panels)| panels.last().cloned()).collect();
    for panel in &mut overview {
        panel.x = view.whole();
    }
    let mut drawn = vec![("overview", render(&overview, OVERVIEW)?)];
    for (name, panels) in &subjects {
        drawn.push((*name, render(panels, SINGLE)?));
    }
    Ok(drawn)
}

struct View<'a> {
    trace: &'a Trace,
    blind: Band,
}

impl<'a> View<'a> {
    fn new(trace: &'a Trace) -> Self {
        Self { trace, blind: Band { label: "blind arc".into(), ranges: blind_ranges(&trace.ticks) } }
    }

    fn whole(&self) -> (f64, f64) {
        let end = self.trace.ticks.last().map_or(1.0, |t| t.time_s + self.trace.tick_s);
        (0.0, end)
    }

    fn line(&self, label: &str, colour: RGBColor, value: impl Fn(&Tick) -> Option<f64>) -> Line {
        let points = self.trace.ticks.iter().map(|t| (t.time_s, value(t))).collect();
        Line { label: label.into(), colour, dashed: false, width: 2, points }
    }

    fn panel(&self, title: &str, y_label: &str, lines: Vec<Line>) -> Panel {
        let band = Some(self.blind.clone());
        Panel { title: title.into(), y_label: y_label.into(), x: self.whole(), y: None, band, lines }
    }

    fn speed(&self) -> Panel {
        let truth = self.line("truth", TRUTH, |t| Some(frequency_from_omega(t.truth.speed)));
        let estimate = self.line("estimate", ESTIMATE, |t| {
            t.telemetry.tracking.then(|| frequency_from_omega(f64::from(t.telemetry.speed)))
        });
        let points = self.targets(|command| match command {
            DriveCommand::Freq { hz } => Some(hz),
            _ => None,
        });
        let mut lines = vec![estimate, truth];
        if points.iter().any(|(_, hz)| hz.is_some()) {
            lines.push(Line { label: "target".into(), colour: TARGET, dashed: true, width: 2, points });
        }
        let plays = |t: &Tick| t.telemetry.state == control::State::Gait;
        if self.trace.ticks.iter().any(plays) {
            let step = |t: &Tick| plays(t).then(|| frequency_from_omega(f64::from(t.telemetry.reference_speed)));
            lines.push(Line { dashed: true, ..self.line("gait", TARGET, step) });
        }
        Panel { band: None, ..self.panel("Speed of the shaft, clockwise positive", "frequency / Hz", lines) }
    }

    /// A constant per order, as a line.
    fn targets(&self, value: impl Fn(DriveCommand) -> Option<f64>) -> Vec<(f64, Option<f64>)> {
        let time = |tick: usize| tick as f64 * self.trace.tick_s;
        let per_command = self.trace.segments().into_iter().flat_map(|(command, from, to)| {
            let level = value(command);
            [(time(from), level), (time(to), level), (time(to), None)]
        });
        per_command.collect()
    }

    fn phase(&self) -> Panel {
        let held = |t: &Tick| t.telemetry.tracking && t.telemetry.state == control::State::Speed;
        let error = |t: &Tick| degrees(wrap(f64::from(t.telemetry.reference_angle) - t.truth.angle));
        let line = self.line("", TRUTH, |t| held(t).then(|| error(t)));
        // The range is that of the steady part: finding the phase goes through the whole turn.
        let settled = self.trace.ticks.iter().skip(self.trace.ticks.len() / 2).filter(|t| held(t));
        let reach = (1.5 * settled.map(|t| error(t).abs()).fold(0.0, f64::max)).clamp(3.0, 180.0);
        let all = self.trace.ticks.iter().filter(|t| held(t)).map(error);
        let most = all.fold(0.0, |most: f64, error| most.max(error.abs()));
        let title = if most > reach {
            format!("Phase: reference minus truth; bars at the edge: beyond it, up to {most:.0}°")
        } else {
            "Phase: reference minus truth".to_owned()
        };
        Panel { y: Some((-reach, reach)), ..self.panel(&title, "phase error / °", vec![line]) }
    }

    fn angle(&self) -> Panel {
        let mut lines = vec![wrapped(self.line("truth", TRUTH, |t| Some(degrees(wrap(t.truth.angle)))))];
        let bounds: [fn(DriveCommand) -> Option<f64>; 2] = [
            |command| match command {
                DriveCommand::Oscillate { from_deg, .. } => Some(from_deg),
                DriveCommand::Position { deg } => Some(deg),
                _ => None,
            },
            |command| match command {
                DriveCommand::Oscillate { to_deg, .. } => Some(to_deg),
                _ => None,
            },
        ];
        for (bound, label) in bounds.into_iter().zip(["target", ""]) {
            let points = self.targets(bound);
            if points.iter().any(|(_, deg)| deg.is_some()) {
                lines.push(Line { label: label.into(), colour: TARGET, dashed: true, width: 2, points });
            }
        }
        self.panel("Angle of the shaft, counter-clockwise positive", "angle / °", lines)
    }

    /// Estimate, truth and readings over the last turns.
    fn close_up(&self) -> Panel {
        let whole = self.whole();
        let x = ((whole.1 - CLOSE_UP_S).max(whole.0), whole.1);
        let readings =
            self.line("reading", READING, |t| t.telemetry.reading.map(|angle| degrees(wrap(f64::from(angle)))));
        let truth = self.line("truth", TRUTH, |t| Some(degrees(wrap(t.truth.angle))));
        let estimate =
            self.line("estimate", ESTIMATE, |t| t.telemetry.tracking.then(|| degrees(f64::from(t.telemetry.angle))));
        let lines =
            vec![Line { width: 5, ..wrapped(readings) }, wrapped(truth), Line { dashed: true, ..wrapped(estimate) }];
        let title = format!("Estimate, truth and readings: the last {} s", trimmed(x.1 - x.0));
        Panel { x, y: Some((-185.0, 185.0)), ..self.panel(&title, "angle / °", lines) }
    }

    fn estimate_error(&self) -> Panel {
        let error =
            |t: &Tick| t.telemetry.tracking.then(|| degrees(wrap(f64::from(t.telemetry.angle) - t.truth.angle)));
        self.panel("Estimate minus truth", "angle error / °", vec![self.line("", ESTIMATE, error)])
    }

    fn voltage(&self) -> Panel {
        let asked = |t: &Tick| f64::from(t.actuation.duty) * t.truth.bridge_supply_v;
        let lines = vec![
            self.line("bridge, duty × supply", VOLTAGE, |t| t.actuation.enable.then(|| asked(t))),
            self.line("motor, behind the drop", TRUTH, |t| Some(t.truth.terminal_v)),
        ];
        Panel { band: None, ..self.panel("Voltage, counter-clockwise positive", "voltage / V", lines) }
    }

    fn current(&self) -> Panel {
        let line = self.line("", CURRENT, |t| Some(1e3 * t.truth.current));
        Panel { band: None, ..self.panel("Winding current, counter-clockwise positive", "current / mA", vec![line]) }
    }
}

fn trimmed(seconds: f64) -> String {
    format!("{:.3}", seconds).trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Breaks a line where the angle wraps.
fn wrapped(mut line: Line) -> Line {
    let mut last: Option<f64> = None;
    let mut points = Vec::with_capacity(line.points.len());
    for (x, y) in line.points {
        if let (Some(from), Some(to)) = (last, y)
            && (to - from).abs() > 180.0
        {
            points.push((x, None));
        }
        last = y.or(last);
        points.push((x, y));
    }
    line.points = points;
    line
}

/// When the controller believed to be in the blind arc.
fn blind_ranges(ticks: &[Tick]) -> Vec<(f64, f64)> {
    let mut ranges: Vec<(f64, f64)> = Vec::new();
    let mut inside = false;
    for tick in ticks {
        let blind = tick.telemetry.tracking && tick.telemetry.blind;
        match (blind, inside, ranges.last_mut()) {
            (true, false, _) => ranges.push((tick.time_s, tick.time_s)),
            (_, true, Some(range)) => range.1 = tick.time_s,
            _ => {}
        }
        inside = blind;
    }
    ranges
}
