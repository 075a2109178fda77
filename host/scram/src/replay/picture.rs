//! The pictures of a replay.

use plotters::style::RGBColor;

use super::history::{Held, History, Side, Why};
use super::trail::Trail;
use plot::{Line, Mark, Panel, PlotError, Size, Span, Strip, Timeline, render_under};

/// What was recorded.
pub const OVERVIEW: &str = "replay";
/// Recorded against replayed.
pub const COMPARISON: &str = "replay-comparison";

// Colours that the colour-blind tell apart (Okabe and Ito).
const RECORDED: RGBColor = RGBColor(30, 30, 30);
const REPLAYED: RGBColor = RGBColor(213, 94, 0);
const TARGET: RGBColor = RGBColor(0, 114, 178);
const READING: RGBColor = RGBColor(86, 180, 233);
const SUPPLY: RGBColor = RGBColor(0, 158, 115);
const LINK: RGBColor = RGBColor(204, 121, 167);
const FAULT: RGBColor = RGBColor(190, 30, 30);
const QUIET: RGBColor = RGBColor(120, 120, 120);

const PANEL: Size = Size { width: 1100, height: 210 };
const SIDE_BY_SIDE: Size = Size { width: 1100, height: 300 };

fn line(label: &str, colour: RGBColor, trail: &Trail) -> Line {
    Line { label: label.into(), colour, dashed: false, width: 2, points: trail.points().to_vec() }
}

impl History {
    fn whole(&self) -> (f64, f64) {
        let (from, to) = self.x;
        // The first sample comes microseconds after the start.
        let from = if from > 0.0 && from < 1e-3 * to { 0.0 } else { from };
        if from < to { (from, to) } else { (from - 0.5, from + 0.5) }
    }

    fn panel(&self, title: &str, y_label: &str, lines: Vec<Line>) -> Option<Panel> {
        let lines: Vec<Line> = lines.into_iter().filter(|line| line.points.iter().any(|(_, y)| y.is_some())).collect();
        let panel = Panel { title: title.into(), y_label: y_label.into(), x: self.whole(), y: None, band: None, lines };
        (!panel.lines.is_empty()).then_some(panel)
    }

    /// Everything that the file holds.
    pub(super) fn overview(&self) -> Result<String, PlotError> {
        let panels = [
            self.speed(),
            self.panel("Phase: reference minus estimate", "phase error / °", vec![line("", RECORDED, &self.phase_deg)]),
            self.angle(),
            self.panel("Duty, counter-clockwise positive", "duty", vec![line("", RECORDED, &self.recorded.duty)]),
            self.panel(
                "Voltage at the motor, counter-clockwise positive",
                "voltage / V",
                vec![line("", RECORDED, &self.voltage_v)],
            ),
            self.panel(
                "Supply",
                "voltage / V",
                vec![line("bridge", SUPPLY, &self.supply_v), line("battery", TARGET, &self.battery_v)],
            ),
            self.panel("Link: telemetry messages received", "rate / 1/s", vec![line("", LINK, &self.rate_hz)]),
            self.panel("Link: ticks lost", "loss / %", vec![line("", LINK, &self.loss_percent)]),
            self.panel("Link: from an order to its answer", "delay / ms", vec![line("", LINK, &self.latency_ms)]),
            self.panel("Link: signal strength", "RSSI / dBm", vec![line("", LINK, &self.rssi_dbm)]),
        ];
        let panels: Vec<Panel> = panels.into_iter().flatten().collect();
        let strips = vec![strip("state", &self.recorded)];
        render_under(&self.timeline(strips), &panels, PANEL)
    }

    /// Both sides over each other.
    pub(super) fn comparison(&self) -> Result<String, PlotError> {
        let (then, now) = (&self.recorded, &self.replayed);
        let both = |then: &Trail, now: &Trail| {
            let now = Line { dashed: true, ..line("current controller", REPLAYED, now) };
            vec![Line { width: 3, ..line("recorded", RECORDED, then) }, now]
        };
        let panels = [
            self.panel("Duty, counter-clockwise positive", "duty", both(&then.duty, &now.duty)),
            self.panel(
                "Estimated speed, clockwise positive",
                "frequency / Hz",
                both(&then.frequency_hz, &now.frequency_hz),
            ),
            self.panel(
                "Estimated angle, counter-clockwise positive",
                "angle / °",
                both(&then.angle_deg, &now.angle_deg),
            ),
        ];
        let panels: Vec<Panel> = panels.into_iter().flatten().collect();
        let strips = vec![strip("recorded", then), strip("now", now)];
        render_under(&self.timeline(strips), &panels, SIDE_BY_SIDE)
    }

    fn speed(&self) -> Option<Panel> {
        let recorded = &self.recorded.frequency_hz;
        let measured = if recorded.is_empty() {
            line("from the angle", READING, &self.speed_from_angle)
        } else {
            line("estimate", RECORDED, recorded)
        };
        let targets = self.targets("target", |(_, hz, _)| *hz);
        self.panel("Speed of the shaft, clockwise positive", "frequency / Hz", vec![measured, targets])
    }

    fn angle(&self) -> Option<Panel> {
        let recorded = &self.recorded.angle_deg;
        let measured = if recorded.is_empty() {
            line("reading", READING, &self.reading_deg)
        } else {
            line("estimate", RECORDED, recorded)
        };
        let lower = self.targets("target", |(.., angles)| angles[0]);
        let upper = self.targets("", |(.., angles)| angles[1]);
        self.panel("Angle of the shaft, counter-clockwise positive", "angle / °", vec![measured, lower, upper])
    }

    /// A constant from each command to the next.
    fn targets(&self, label: &str, value: impl Fn(&(f64, Option<f64>, [Option<f64>; 2])) -> Option<f64>) -> Line {
        let ends = self.targets.iter().skip(1).map(|target| target.0).chain([self.whole().1]);
        let levels = self.targets.iter().zip(ends).flat_map(|(target, end)| {
            let level = value(target);
            [(target.0, level), (end, level), (end, None)]
        });
        Line { label: label.into(), colour: TARGET, dashed: true, width: 2, points: levels.collect() }
    }

    fn timeline(&self, strips: Vec<Strip>) -> Timeline {
        let mark = |(at, text, why): &(f64, String, Why)| {
            let colour = match why {
                Why::Command => TARGET,
                Why::Fault => FAULT,
                Why::Link => LINK,
                Why::Note => QUIET,
            };
            Mark { at: *at, label: text.clone(), colour }
        };
        Timeline {
            strips: strips.into_iter().filter(|strip| !strip.spans.is_empty()).collect(),
            marks: self.marks.iter().map(mark).collect(),
        }
    }
}

fn strip(label: &str, side: &Side) -> Strip {
    Strip { label: label.into(), spans: side.states.iter().map(span).collect() }
}

fn span(held: &Held) -> Span {
    use control::State;
    let colour = match held.state {
        State::Idle => RGBColor(226, 226, 226),
        State::Coast => RGBColor(208, 208, 190),
        State::Speed => RGBColor(178, 214, 240),
        State::Oscillate => RGBColor(180, 226, 205),
        State::Position => RGBColor(240, 224, 160),
        State::Duty => RGBColor(226, 200, 224),
        State::Gait => RGBColor(190, 200, 250),
        State::Fault => RGBColor(244, 170, 150),
    };
    let label = held.fault.map_or_else(|| format!("{:?}", held.state), |fault| format!("Fault: {fault:?}"));
    Span { from: held.from, to: held.to, label, colour }
}
