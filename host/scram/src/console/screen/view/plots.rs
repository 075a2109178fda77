//! The plots of the selected robot.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Painter, Shape};

use super::health::value;
use crate::console::model::{Model, PLOTTED, Plot, RobotModel, Series};
use crate::console::screen::text::width;
use crate::console::screen::theme::Theme;

/// Narrower plots are put below each other.
const LEAST_WIDTH: u16 = 38;
/// Columns for the numbers beside the curve, and its edge.
const GUTTER: u16 = 6;
/// Points that are further apart, s, are not joined.
const GAP_S: f64 = 0.25;
/// Spans of the angle's plot, s: at 7 Hz, 30 s of it would be a solid block.
const SPANS_S: [f64; 4] = [30.0, 10.0, 3.0, 1.0];
/// Characters that a turn takes at least.
const TURN: f64 = 3.0;

/// One plot.
struct Kind {
    title: &'static str,
    plot: fn(&Series) -> &Plot,
    /// The latest value in words.
    words: fn(f64) -> String,
    range: Range,
}

/// From where to where.
enum Range {
    /// Fixed range.
    Fixed(f64, f64),
    /// What there is, but 0 is on it and it is so long at least.
    WithZero(f64),
    /// What there is, and so long at least.
    Around(f64),
}

const KINDS: &[Kind] = &[
    Kind {
        title: "frequency",
        plot: |series| &series.frequency,
        words: |hz| format!("{hz:.2} Hz"),
        range: Range::WithZero(1.0),
    },
    Kind {
        title: "angle",
        plot: |series| &series.angle,
        words: |degrees| format!("{degrees:.0} deg"),
        range: Range::Fixed(-180.0, 180.0),
    },
    Kind {
        title: "duty",
        plot: |series| &series.duty,
        words: |share| format!("{:+.0} %", 100.0 * share),
        range: Range::Fixed(-1.0, 1.0),
    },
    Kind {
        title: "cell",
        plot: |series| &series.battery,
        words: |volts| format!("{volts:.2} V"),
        range: Range::Around(0.2),
    },
    Kind {
        title: "frames lost",
        plot: |series| &series.loss,
        words: |share| format!("{:.1} %", 100.0 * share),
        range: Range::WithZero(0.1),
    },
    Kind {
        title: "round trip",
        plot: |series| &series.round_trip,
        words: |ms| format!("{ms:.0} ms"),
        range: Range::WithZero(20.0),
    },
];

/// Rows that a plot needs to tell something: braille has four points above each other in a row.
pub fn least_height(theme: Theme) -> u16 {
    if theme.ascii { 5 } else { 3 }
}

/// Draws as many as there is room for.
pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, theme: Theme) {
    let Some(robot) = model.robot() else { return };
    let across = (area.width / LEAST_WIDTH).clamp(1, 3);
    let most = (KINDS.len() as u16).div_ceil(across);
    let down = (area.height / least_height(theme)).min(most);
    for (kind, index) in KINDS.iter().zip(0..across * down) {
        let (column, row) = (index % across, index / across);
        let (left, right) = (column * area.width / across, (column + 1) * area.width / across);
        let (top, bottom) = (row * area.height / down, (row + 1) * area.height / down);
        // A blank column between neighbours.
        let gap = u16::from(column + 1 < across);
        let room = Rect { x: area.x + left, y: area.y + top, width: right - left - gap, height: bottom - top };
        one(frame, room, kind, robot, model.now, theme);
    }
}

fn one(frame: &mut Frame<'_>, area: Rect, kind: &Kind, robot: &RobotModel, now: Duration, theme: Theme) {
    let plot = (kind.plot)(&robot.series);
    let is_angle = kind.title == "angle";
    let cells = area.width.saturating_sub(GUTTER);
    let span = if is_angle { angle_span(robot, now, cells) } else { PLOTTED.as_secs_f64() };
    let from = now.as_secs_f64() - span;
    let ends = ends(&kind.range, plot.since(from));
    title(frame, area, kind, value(plot, now), span, theme);
    gutter(frame, area, kind, ends, theme);
    let (beside, above) = theme.points();
    let room = Rect { x: area.x + GUTTER, y: area.y + 1, width: cells, height: area.height.saturating_sub(1) };
    let half_turn = if is_angle { 180.0 } else { f64::INFINITY };
    let columns = columns(plot.since(from), from, span, usize::from(cells) * beside, half_turn);
    if columns.iter().all(Option::is_none) {
        frame.render_widget(Paragraph::new(" nothing to show").style(theme.faint()), room);
        return;
    }
    let rows = usize::from(room.height) * above;
    let colour = theme.curve().fg.unwrap_or(Color::Reset);
    let curve = Curve { columns: &columns, ends, rows, colour };
    let (x, y) = ([0.0, 1.0], [0.0, 1.0]);
    frame.render_widget(
        Canvas::default().marker(theme.marker()).x_bounds(x).y_bounds(y).paint(|context| context.draw(&curve)),
        room,
    );
}

fn title(frame: &mut Frame<'_>, area: Rect, kind: &Kind, value: Option<f64>, span: f64, theme: Theme) {
    let value = value.map_or_else(|| "-".into(), kind.words);
    let ago = format!("{span:.0} s");
    let gap =
        usize::from(area.width).saturating_sub(usize::from(GUTTER) + kind.title.len() + 2 + width(&value) + ago.len());
    let line = Line::from(vec![
        Span::raw(format!("{:>1$}", kind.title, usize::from(GUTTER) + kind.title.len())),
        Span::styled(format!("  {value}"), theme.strong()),
        Span::styled(format!("{:gap$}{ago}", ""), theme.faint()),
    ]);
    frame.render_widget(Paragraph::new(line), Rect { height: 1, ..area });
}

/// The numbers at the curve's ends, and an edge.
fn gutter(frame: &mut Frame<'_>, area: Rect, kind: &Kind, (low, high): (f64, f64), theme: Theme) {
    let rows = area.height.saturating_sub(1);
    let edge = if theme.ascii { '|' } else { '▏' };
    let lines = (0..rows).map(|row| {
        let number = match row {
            0 => Some(high),
            _ if row + 1 == rows => Some(low),
            _ => None,
        };
        let number = number.map(|number| (kind.words)(number)).unwrap_or_default();
        // The unit stands in the title.
        let number = number.split(' ').next().unwrap_or_default();
        let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
        Line::styled(format!("{number:>5}{edge}"), theme.faint())
    });
    let room = Rect { y: area.y + 1, height: rows, width: GUTTER.min(area.width), ..area };
    frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()), room);
}

/// As much of the angle as can be told apart, by the fastest turning of the time that is plotted.
fn angle_span(robot: &RobotModel, now: Duration, cells: u16) -> f64 {
    let from = now.as_secs_f64() - PLOTTED.as_secs_f64();
    let fastest = robot.series.frequency.since(from).fold(0.0_f64, |fastest, (_, hz)| fastest.max(hz.abs()));
    let fits = |span: &f64| span * fastest * TURN <= f64::from(cells);
    SPANS_S.into_iter().find(fits).unwrap_or(SPANS_S[SPANS_S.len() - 1])
}

/// Round numbers below and above everything that is shown.
fn ends(range: &Range, points: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let (start, least) = match range {
        Range::Fixed(low, high) => return (*low, *high),
        Range::WithZero(least) => ((0.0, 0.0), *least),
        Range::Around(least) => ((f64::INFINITY, f64::NEG_INFINITY), *least),
    };
    let finite = points.map(|(_, value)| value).filter(|value| value.is_finite());
    let (mut low, mut high) = finite.fold(start, |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return (0.0, least);
    }
    let missing = (least - (high - low)).max(0.0);
    match range {
        Range::Around(_) => (low, high) = (low - missing / 2.0, high + missing / 2.0),
        _ if -low > high => low -= missing,
        _ => high += missing,
    }
    // Steps of 1, 2 or 5 of a power of ten, so that the numbers do not change with every point.
    let raw = (high - low) / 4.0 * (1.0 - 1e-9);
    let power = 10.0_f64.powf(raw.log10().floor());
    let step =
        [1.0, 2.0, 5.0].map(|factor| factor * power).into_iter().find(|step| *step >= raw).unwrap_or(10.0 * power);
    ((low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step)
}

/// The lowest and the highest value in each of `count` columns, with what joins a point to the one before. At most two
/// numbers a column are left, however many points there are.
fn columns(
    points: impl Iterator<Item = (f64, f64)>,
    from: f64,
    span: f64,
    count: usize,
    most_apart: f64,
) -> Vec<Option<(f64, f64)>> {
    let mut columns = vec![None; count];
    let mut extend = |at: usize, value: f64| {
        if let Some(column) = columns.get_mut(at) {
            let (low, high) = column.unwrap_or((value, value));
            *column = Some((value.min(low), value.max(high)));
        }
    };
    let mut before: Option<(f64, f64, usize)> = None;
    for (t, value) in points.filter(|(t, value)| t.is_finite() && value.is_finite()) {
        let at = (((t - from) / span * count as f64).max(0.0) as usize).min(count.saturating_sub(1));
        let joined = before.filter(|(then, was, _)| t - then <= GAP_S && (value - was).abs() < most_apart);
        if let Some((_, was, column)) = joined {
            let steps = at.saturating_sub(column);
            for step in 1..=steps {
                let share = |step: usize| was + (value - was) * step as f64 / steps as f64;
                extend(column + step, share(step - 1));
                extend(column + step, share(step));
            }
        }
        extend(at, value);
        before = Some((t, value, at));
    }
    columns
}

/// A curve on a grid of points.
struct Curve<'a> {
    columns: &'a [Option<(f64, f64)>],
    ends: (f64, f64),
    /// Points above each other.
    rows: usize,
    colour: Color,
}

impl Shape for Curve<'_> {
    fn draw(&self, painter: &mut Painter<'_, '_>) {
        let (low, high) = self.ends;
        let last = self.rows.saturating_sub(1);
        let row = |value: f64| {
            let share = ((high - value) / (high - low)).clamp(0.0, 1.0);
            ((share * last as f64).round() as usize).min(last)
        };
        for (x, column) in self.columns.iter().enumerate() {
            let Some((lowest, highest)) = column else { continue };
            for y in row(*highest)..=row(*lowest) {
                painter.paint(x, y, self.colour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_round_and_hold_everything() {
        let of = |range, values: &[f64]| ends(&range, values.iter().map(|value| (0.0, *value)));
        assert_eq!(of(Range::WithZero(1.0), &[]), (0.0, 1.0));
        assert_eq!(of(Range::WithZero(1.0), &[-0.1]), (-1.0, 0.0));
        let (low, high) = of(Range::WithZero(0.1), &[0.021]);
        assert!(low == 0.0 && (high - 0.1).abs() < 1e-12, "{low} {high}");
        assert_eq!(of(Range::WithZero(1.0), &[7.1]), (0.0, 8.0));
        assert_eq!(of(Range::WithZero(1.0), &[-7.1, 7.0]), (-10.0, 10.0));
        assert_eq!(of(Range::WithZero(20.0), &[0.0, 12.0]), (0.0, 20.0));
        assert_eq!(of(Range::Fixed(-1.0, 1.0), &[5.0]), (-1.0, 1.0));
        let (low, high) = of(Range::Around(0.2), &[3.91, 3.93]);
        assert!(low <= 3.91 && high >= 3.93 && high - low < 0.35, "{low} {high}");
        assert_eq!(of(Range::WithZero(1.0), &[f64::NAN, f64::INFINITY]), (0.0, 1.0));
    }

    #[test]
    fn a_peak_between_two_columns_is_not_lost() {
        let spike = (0..3000).map(|i| (f64::from(i) / 100.0, if i == 1234 { 5.0 } else { 1.0 }));
        let columns = columns(spike, 0.0, 30.0, 60, f64::INFINITY);
        assert_eq!(columns[24], Some((1.0, 5.0)));
        assert!(columns.iter().enumerate().all(|(at, column)| at == 24 || *column == Some((1.0, 1.0))), "{columns:?}");
    }

    #[test]
    fn points_are_joined_but_over_a_gap_and_over_the_turn() {
        let few = [(0.0, 0.0), (0.1, 4.0), (1.0, 4.0)];
        let joined = columns(few.into_iter(), 0.0, 1.0, 40, f64::INFINITY);
        assert_eq!(joined[0], Some((0.0, 0.0)));
        assert_eq!(joined[2], Some((1.0, 2.0)));
        assert_eq!(joined[4], Some((3.0, 4.0)));
        assert_eq!((joined[5], joined[38], joined[39]), (None, None, Some((4.0, 4.0))));
        let turn = [(0.0, 175.0), (0.1, -175.0)];
        assert_eq!(columns(turn.into_iter(), 0.0, 1.0, 10, 180.0)[1], Some((-175.0, -175.0)));
    }
}
