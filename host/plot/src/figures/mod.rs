//! Plots of a sweep as SVG: maps as in the thesis's Figs 5.1 and 5.2, paths as in Figs 3.4 and 3.5, lines.

mod designs;
mod front;
mod heat;
mod lines;
mod maps;
mod maze;
mod paths;
mod speeds;
mod straightness;
mod turning;

use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

pub use designs::{DesignDot, designs_svg};
pub use maps::{Figure, draw};
pub use maze::maze_svg;
pub use speeds::speeds_svg;
pub use straightness::{Straightness, straightness_svg};
pub use turning::{TurningRun, turning_svg};

/// Ink of axes and text.
const INK: RGBColor = RGBColor(40, 40, 40);
/// Grid.
const GRID: RGBColor = RGBColor(225, 225, 225);
/// What is missing.
const MISSING: RGBColor = RGBColor(235, 235, 235);

/// A drawing could not be made.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("the plot `{title}` cannot be drawn: {problem}")]
#[diagnostic(help("this is a defect of scram: please report the command that led here"))]
pub struct FigureError {
    title: String,
    problem: String,
}

type Drawn = Result<(), Box<dyn std::error::Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws on a white sheet.
fn sheet(title: &str, size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<String, FigureError> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let fail = |problem: String| FigureError { title: title.into(), problem };
        root.fill(&WHITE).map_err(|error| fail(error.to_string()))?;
        draw(&root).map_err(|error| fail(error.to_string()))?;
        root.present().map_err(|error| fail(error.to_string()))?;
    }
    Ok(text)
}

/// Room round a chart's own ground, pixels.
#[derive(Clone, Copy)]
struct Margins {
    left: i32,
    right: i32,
    top: i32,
    bottom: i32,
}

/// A range of values and what is written at it.
struct Scale<'s> {
    range: (f64, f64),
    words: &'s str,
    /// Marks, about.
    marks: usize,
}

/// Axes with a grid.
fn axes<'a, 'b>(
    area: &'b Area<'a>,
    margins: Margins,
    x: &Scale<'_>,
    y: &Scale<'_>,
) -> Result<Chart<'a, 'b>, Box<dyn std::error::Error>> {
    /// Left of the marks, pixels.
    const EDGE: i32 = 10;
    let mut chart = ChartBuilder::on(area)
        .margin_top(margins.top)
        .margin_right(margins.right)
        .margin_left(EDGE)
        .x_label_area_size(margins.bottom)
        .y_label_area_size(margins.left - EDGE)
        .build_cartesian_2d(x.range.0..x.range.1, y.range.0..y.range.1)?;
    let mark = |value: &f64| tick(*value);
    chart
        .configure_mesh()
        .label_style(font(14))
        .axis_desc_style(font(15))
        .axis_style(INK)
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .x_labels(x.marks)
        .y_labels(y.marks)
        .x_label_formatter(&mark)
        .y_label_formatter(&mark)
        .x_desc(x.words)
        .y_desc(y.words)
        .draw()?;
    Ok(chart)
}

fn font(size: i32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

/// With the digits that tell at a scale; a typographic minus, and none before a zero.
fn shown(value: f64, scale: f64) -> String {
    let decimals = match scale {
        scale if scale >= 99.5 => 0,
        scale if scale >= 9.95 => 1,
        _ => 2,
    };
    let text = format!("{value:.decimals$}");
    let zero = text.strip_prefix('-').filter(|rest| rest.chars().all(|c| c == '0' || c == '.'));
    zero.map_or_else(|| text.replace('-', "−"), String::from)
}

/// A value of an axis, with no more digits than it has.
fn tick(value: f64) -> String {
    format!("{}", sweep::significant(value, 6)).replace('-', "−")
}

/// Width of a text, pixels: the mean width of a character is some 0.55 of the font's size.
fn width(text: &str, size: i32) -> i32 {
    (0.55 * f64::from(size) * text.chars().count() as f64) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_tell() {
        let found = [(12.345, 20.0), (-0.5, 20.0), (-0.5, 8.0), (-0.001, 20.0), (123.4, 180.0)];
        assert_eq!(found.map(|(value, scale)| shown(value, scale)), ["12.3", "−0.5", "−0.50", "0.0", "123"]);
        assert_eq!(tick(-8.0), "−8");
    }
}
