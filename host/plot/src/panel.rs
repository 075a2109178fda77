//! One style for every plot: a panel has a title, a legend beside it, labelled axes, and lines over shaded bands.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{BoldPoints, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::timeline::Timeline;

/// Ink of axes and text.
pub(super) const INK: RGBColor = RGBColor(40, 40, 40);
/// Grid.
pub(super) const GRID: RGBColor = RGBColor(225, 225, 225);
/// Shade of a band.
const SHADE: RGBColor = RGBColor(229, 232, 240);
/// Left of what is drawn, pixels.
const LEFT: i32 = 82;
/// Of them, for the marks of the y axis.
const Y_LABELS: i32 = 74;
/// Right of what is drawn, pixels.
const RIGHT: i32 = 24;
/// Marks of the axes at most.
const X_MARKS: usize = 11;
const Y_MARKS: usize = 6;
/// Points that a line keeps: more than a screen has columns.
const MOST_POINTS: usize = 4000;
/// Height of the bar along the edge where a line is beyond it, as a share of the panel's.
const BEYOND: f64 = 0.025;
/// Bands that still tell something apart.
const MOST_BANDS: usize = 80;

/// A drawing could not be made.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("the plot `{title}` cannot be drawn: {problem}")]
#[diagnostic(help("this is a defect of scram: please report the command that led here"))]
pub struct PlotError {
    title: String,
    problem: String,
}

/// Width and height of one panel, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Width.
    pub width: u32,
    /// Height of each panel.
    pub height: u32,
}

/// One line; a `None` breaks it.
#[derive(Clone, Debug)]
pub struct Line {
    /// Text in the legend.
    pub label: String,
    /// Colour.
    pub colour: RGBColor,
    /// Drawn with gaps.
    pub dashed: bool,
    /// Width, pixels.
    pub width: u32,
    /// (x, y); a y of `None` breaks the line.
    pub points: Vec<(f64, Option<f64>)>,
}

/// Shaded ranges of x.
#[derive(Clone, Debug, Default)]
pub struct Band {
    /// Text in the legend.
    pub label: String,
    /// Shaded ranges `(from, to)` on the x axis.
    pub ranges: Vec<(f64, f64)>,
}

/// One plot.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Says what is seen.
    pub title: String,
    /// Quantity and unit of the y axis.
    pub y_label: String,
    /// Range of x.
    pub x: (f64, f64),
    /// Range of y; `None` fits the lines.
    pub y: Option<(f64, f64)>,
    /// Shaded ranges.
    pub band: Option<Band>,
    /// The lines, later ones on top.
    pub lines: Vec<Line>,
}

/// Draws panels one above the other.
///
/// # Errors
/// The drawing library refuses.
pub fn render(panels: &[Panel], size: Size) -> Result<String, PlotError> {
    render_under(&Timeline::default(), panels, size)
}

/// Draws panels that share one range of x under a timeline, whose marks go through all of them.
///
/// # Errors
/// The drawing library refuses.
pub fn render_under(timeline: &Timeline, panels: &[Panel], size: Size) -> Result<String, PlotError> {
    let mut text = String::new();
    {
        let above = timeline.height();
        let height = above + size.height * u32::try_from(panels.len()).unwrap_or(1).max(1);
        let root = SVGBackend::with_string(&mut text, (size.width, height)).into_drawing_area();
        let fail = |title: &str, problem: String| PlotError { title: title.to_owned(), problem };
        root.fill(&WHITE).map_err(|e| fail("background", e.to_string()))?;
        let (_, below) = root.split_vertically(above);
        let areas = below.split_evenly((panels.len().max(1), 1));
        for (index, (panel, area)) in panels.iter().zip(&areas).enumerate() {
            let last = index + 1 == panels.len();
            draw(panel, area, last).map_err(|e| fail(&panel.title, e.to_string()))?;
        }
        if let Some(panel) = panels.first() {
            let inside = (LEFT, i32::try_from(size.width).unwrap_or(i32::MAX) - RIGHT);
            timeline.draw(&root, panel.x, inside).map_err(|e| fail("timeline", e.to_string()))?;
        }
        root.present().map_err(|e| fail("file", e.to_string()))?;
    }
    Ok(text)
}

/// Fills a picture of this size (pixels) with whatever `fill` draws on white.
pub(super) fn picture(
    title: &str,
    size: (u32, u32),
    fill: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<String, PlotError> {
    let fail = |problem: String| PlotError { title: title.to_owned(), problem };
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| fail(e.to_string()))?;
        fill(&root).map_err(|e| fail(e.to_string()))?;
        root.present().map_err(|e| fail(e.to_string()))?;
    }
    Ok(text)
}

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw(panel: &Panel, area: &Area<'_>, x_label: bool) -> Drawn {
    heading(panel, area)?;
    let (low, high) = panel.y.unwrap_or_else(|| fitted(panel));
    let mut chart = ChartBuilder::on(area)
        .margin_top(34)
        .margin_right(RIGHT)
        .margin_left(LEFT - Y_LABELS)
        .margin_bottom(6)
        .x_label_area_size(if x_label { 44 } else { 26 })
        .y_label_area_size(Y_LABELS)
        .build_cartesian_2d(panel.x.0..panel.x.1, low..high)?;

    if let Some(band) = shaded(panel) {
        let inside = band.ranges.iter().map(|&(from, to)| (from.max(panel.x.0), to.min(panel.x.1)));
        chart.draw_series(
            inside
                .filter(|(from, to)| from < to)
                .map(|(from, to)| Rectangle::new([(from, low), (to, high)], SHADE.filled())),
        )?;
    }
    let (x_digits, y_digits) = (decimals(&marks(panel.x, X_MARKS)), decimals(&marks((low, high), Y_MARKS)));
    let (x_mark, y_mark) = (|x: &f64| tick_label(*x, x_digits), |y: &f64| tick_label(*y, y_digits));
    let mut mesh = chart.configure_mesh();
    mesh.label_style(("sans-serif", 15).into_font().color(&INK))
        .axis_desc_style(("sans-serif", 16).into_font().color(&INK))
        .axis_style(INK)
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .x_labels(X_MARKS)
        .y_labels(Y_MARKS)
        .y_label_formatter(&y_mark)
        .x_label_formatter(&x_mark)
        .y_desc(&panel.y_label);
    if x_label {
        mesh.x_desc("time / s");
    }
    mesh.draw()?;

    for line in &panel.lines {
        let style = line.colour.stroke_width(line.width);
        for piece in pieces(line, panel.x, (low, high)) {
            if line.dashed {
                chart.draw_series(DashedLineSeries::new(piece, 8, 5, style))?;
            } else {
                chart.draw_series(LineSeries::new(piece, style))?;
            }
        }
        let bars = beyond(line, panel.x, (low, high)).into_iter().map(|(from, to, above)| {
            let thick = BEYOND * (high - low);
            let (bottom, top) = if above { (high - thick, high) } else { (low, low + thick) };
            Rectangle::new([(from, bottom), (to, top)], line.colour.mix(0.55).filled())
        });
        chart.draw_series(bars)?;
    }
    Ok(())
}

/// Where a line leaves the range of y: from, to, and whether it is above. A line that breaks ends it.
fn beyond(line: &Line, x: (f64, f64), y: (f64, f64)) -> Vec<(f64, f64, bool)> {
    let mut bars: Vec<(f64, f64, bool)> = Vec::new();
    let mut outside = None;
    for &(at, value) in line.points.iter().filter(|(at, _)| (x.0..=x.1).contains(at)) {
        let now = value.and_then(|value| if value > y.1 { Some(true) } else { (value < y.0).then_some(false) });
        match (now, bars.last_mut()) {
            (Some(above), Some(bar)) if outside == now => *bar = (bar.0, at, above),
            (Some(above), _) => bars.push((at, at, above)),
            _ => {}
        }
        outside = now;
    }
    bars
}

fn shaded(panel: &Panel) -> Option<&Band> {
    panel.band.as_ref().filter(|band| !band.ranges.is_empty() && band.ranges.len() <= MOST_BANDS)
}

/// Title at the left, legend at the right of the same row.
fn heading(panel: &Panel, area: &Area<'_>) -> Drawn {
    let font = |size: i32| ("sans-serif", size).into_font().color(&INK);
    area.draw(&Text::new(panel.title.clone(), (84, 9), font(18)))?;
    let mut x = i32::try_from(area.dim_in_pixel().0).unwrap_or(i32::MAX) - 24;
    // 8 pixels a character is the mean width of the font at this size.
    let width = |label: &str| 8 * i32::try_from(label.chars().count()).unwrap_or(0);
    if let Some(band) = shaded(panel) {
        x -= width(&band.label);
        area.draw(&Text::new(band.label.clone(), (x, 11), font(15)))?;
        x -= 26;
        area.draw(&Rectangle::new([(x, 12), (x + 20, 24)], SHADE.filled()))?;
        x -= 18;
    }
    for line in panel.lines.iter().rev().filter(|line| !line.label.is_empty()) {
        x -= width(&line.label);
        area.draw(&Text::new(line.label.clone(), (x, 11), font(15)))?;
        x -= 34;
        let strokes =
            if line.dashed { vec![(x, x + 8), (x + 13, x + 21), (x + 25, x + 28)] } else { vec![(x, x + 28)] };
        for (from, to) in strokes {
            area.draw(&PathElement::new(vec![(from, 18), (to, 18)], line.colour.stroke_width(line.width.max(2))))?;
        }
        x -= 18;
    }
    Ok(())
}

/// The marks of an axis over a range: round numbers, so many at most.
pub(super) fn marks((low, high): (f64, f64), most: usize) -> Vec<f64> {
    RangedCoordf64::from(low..high).key_points(BoldPoints(most))
}

/// Decimals that marks have: as many as the roundest writing of all of them takes.
pub(super) fn decimals(marks: &[f64]) -> usize {
    const MOST: usize = 6;
    let whole = |scale: f64| marks.iter().all(|mark| (mark * scale - (mark * scale).round()).abs() < 1e-3);
    (0..MOST).find(|decimals| whole(10f64.powi(*decimals as i32))).unwrap_or(MOST)
}

/// A mark of an axis.
pub(super) fn tick_label(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        "0".into()
    } else {
        text.replace('-', "−")
    }
}

/// A range around what is drawn.
fn fitted(panel: &Panel) -> (f64, f64) {
    let shown = panel.lines.iter().flat_map(|line| &line.points);
    let inside = shown.filter(|(x, _)| (panel.x.0..=panel.x.1).contains(x)).filter_map(|(_, y)| *y);
    let (low, high) = inside.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
    if low > high {
        return (-1.0, 1.0);
    }
    let pad = (0.06 * (high - low)).max(1e-3 * high.abs()).max(1e-6);
    (low - pad, high + pad)
}

/// The unbroken pieces of a line within the range, thinned so that every extreme stays.
fn pieces(line: &Line, x: (f64, f64), y: (f64, f64)) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = vec![Vec::new()];
    for &(at, value) in &line.points {
        match value {
            Some(value) if at >= x.0 && at <= x.1 && value >= y.0 && value <= y.1 => {
                if let Some(piece) = pieces.last_mut() {
                    piece.push((at, value));
                }
            }
            _ if pieces.last().is_some_and(|piece| !piece.is_empty()) => pieces.push(Vec::new()),
            _ => {}
        }
    }
    pieces.retain(|piece| piece.len() > 1);
    let total: usize = pieces.iter().map(Vec::len).sum();
    let per_bucket = 2 * total.div_ceil(MOST_POINTS);
    if per_bucket > 2 { pieces.into_iter().map(|piece| extremes(&piece, per_bucket)).collect() } else { pieces }
}

/// Lowest and highest point of every bucket, in the order of x.
fn extremes(piece: &[(f64, f64)], per_bucket: usize) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    for bucket in piece.chunks(per_bucket) {
        let by_y = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        if let (Some(low), Some(high)) = (bucket.iter().min_by(by_y), bucket.iter().max_by(by_y)) {
            kept.push(if low.0 <= high.0 { *low } else { *high });
            if low.0 != high.0 {
                kept.push(if low.0 <= high.0 { *high } else { *low });
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_extreme() {
        let points: Vec<(f64, Option<f64>)> =
            (0..100_000).map(|i| (f64::from(i), Some(if i == 43_210 { 9.0 } else { f64::from(i % 3) }))).collect();
        let line = Line { label: String::new(), colour: BLACK, dashed: false, width: 1, points };
        let kept = pieces(&line, (0.0, 1e5), (-1.0, 10.0));
        assert_eq!(kept.len(), 1);
        assert!(kept[0].len() <= 2 * MOST_POINTS);
        assert!(kept[0].contains(&(43_210.0, 9.0)));
        assert!(kept[0].windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn what_is_beyond_the_axis_is_marked_at_its_edge() {
        let values = [0.0, 5.0, 6.0, 0.5, -7.0, -8.0, 9.0, 0.0];
        let mut points: Vec<(f64, Option<f64>)> = (0..8).map(f64::from).zip(values.map(Some)).collect();
        points.push((8.0, None));
        let line = Line { label: String::new(), colour: BLACK, dashed: false, width: 1, points };
        let bars = beyond(&line, (0.0, 8.0), (-1.0, 1.0));
        assert_eq!(bars, [(1.0, 2.0, true), (4.0, 5.0, false), (6.0, 6.0, true)]);
        assert!(beyond(&line, (0.0, 8.0), (-10.0, 10.0)).is_empty());
        let panel = |y| Panel {
            title: "phase".into(),
            y_label: String::new(),
            x: (0.0, 8.0),
            y,
            band: None,
            lines: vec![line.clone()],
        };
        let drawn = |y| render(&[panel(y)], Size { width: 400, height: 200 }).unwrap().matches("<rect").count();
        assert_eq!(drawn(Some((-1.0, 1.0))), drawn(None) + 3);
    }

    #[test]
    fn marks_have_as_many_digits_as_they_need() {
        let labels = |range: (f64, f64), most: usize| {
            let marks = marks(range, most);
            let decimals = decimals(&marks);
            marks.iter().map(|mark| tick_label(*mark, decimals)).collect::<Vec<_>>()
        };
        assert_eq!(labels((6.96, 7.03), 6), ["6.96", "6.98", "7.00", "7.02"]);
        assert_eq!(labels((-185.0, 185.0), 6), ["−100", "0", "100"]);
        assert_eq!(labels((-4.0, 9.0), 6), ["0", "5"]);
        assert_eq!(labels((-0.9, 0.9), 6), ["−0.5", "0", "0.5"]);
        assert_eq!(tick_label(-1e-17, 1), "0");
    }
}
