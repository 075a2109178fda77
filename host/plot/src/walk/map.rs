//! Axes on which a millimetre is as long across as up.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::panel::{Area, Drawn, GRID, INK, decimals, marks, tick_label};

/// Where the plot's own ground is within its area, pixels.
#[derive(Clone, Copy, Debug)]
pub struct Margins {
    pub left: u32,
    pub right: u32,
    pub top: u32,
    pub bottom: u32,
}

/// Width of the marks and the name of the y axis, pixels.
const Y_LABELS: u32 = 62;

/// What is written at the axes.
#[derive(Clone, Copy, Debug)]
pub struct Words<'a> {
    pub title: &'a str,
    pub x: &'a str,
    pub y: &'a str,
}

pub type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// The least ranges of x and y that hold two corners, a share of margin around them, and have one scale in an area.
pub fn ranges(area: &Area<'_>, margins: Margins, (low, high): ([f64; 2], [f64; 2]), margin: f64) -> [(f64, f64); 2] {
    let (width, height) = area.dim_in_pixel();
    let pixels = [
        f64::from(width.saturating_sub(margins.left + margins.right).max(1)),
        f64::from(height.saturating_sub(margins.top + margins.bottom).max(1)),
    ];
    let spans = [0, 1].map(|axis| (high[axis] - low[axis]).max(1e-3) * (1.0 + 2.0 * margin));
    let scale = (spans[0] / pixels[0]).max(spans[1] / pixels[1]);
    [0, 1].map(|axis| {
        let (middle, half) = (0.5 * (low[axis] + high[axis]), 0.5 * scale * pixels[axis]);
        (middle - half, middle + half)
    })
}

/// The corners of what two coordinates reach.
pub fn corners(points: impl IntoIterator<Item = [f64; 2]>) -> ([f64; 2], [f64; 2]) {
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) = points.into_iter().fold(start, |(low, high), point| {
        ([0, 1].map(|i| f64::min(low[i], point[i])), [0, 1].map(|i| f64::max(high[i], point[i])))
    });
    if low[0] > high[0] { ([-1.0; 2], [1.0; 2]) } else { (low, high) }
}

/// Axes with a grid and a title.
///
/// # Errors
/// The drawing library refuses.
pub fn axes<'a, 'b>(
    area: &'b Area<'a>,
    margins: Margins,
    [x, y]: [(f64, f64); 2],
    words: Words<'_>,
) -> Result<Chart<'a, 'b>, Box<dyn std::error::Error>> {
    let title = ("sans-serif", 16).into_font().color(&INK);
    area.draw(&Text::new(words.title.to_owned(), (i32::try_from(margins.left)?, 8), title))?;
    let mut chart = ChartBuilder::on(area)
        .margin_top(margins.top)
        .margin_right(margins.right)
        .margin_left(margins.left.saturating_sub(Y_LABELS))
        .x_label_area_size(margins.bottom)
        .y_label_area_size(margins.left.min(Y_LABELS))
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    let (width, height) = chart.plotting_area().dim_in_pixel();
    // A mark every 60 pixels or so.
    let (x_marks, y_marks) = (two_marks(x, (width / 60).max(3)), two_marks(y, (height / 45).max(3)));
    let (x_digits, y_digits) = (decimals(&marks(x, x_marks)), decimals(&marks(y, y_marks)));
    let (x_mark, y_mark) = (|v: &f64| tick_label(*v, x_digits), |v: &f64| tick_label(*v, y_digits));
    chart
        .configure_mesh()
        .label_style(("sans-serif", 13).into_font().color(&INK))
        .axis_desc_style(("sans-serif", 14).into_font().color(&INK))
        .axis_style(INK)
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .x_labels(x_marks)
        .y_labels(y_marks)
        .x_label_formatter(&x_mark)
        .y_label_formatter(&y_mark)
        .x_desc(words.x)
        .y_desc(words.y)
        .draw()?;
    Ok(chart)
}

/// How many marks an axis is asked to have at most for it to have two, without which it tells no length.
fn two_marks(range: (f64, f64), wanted: u32) -> usize {
    let wanted = wanted as usize;
    (wanted..wanted + 4).find(|most| marks(range, *most).len() >= 2).unwrap_or(wanted)
}

/// A line through points.
///
/// # Errors
/// The drawing library refuses.
pub fn line(chart: &mut Chart<'_, '_>, points: &[[f64; 2]], style: ShapeStyle) -> Drawn {
    chart.draw_series(std::iter::once(PathElement::new(
        points.iter().map(|p| (p[0], p[1])).collect::<Vec<_>>(),
        style,
    )))?;
    Ok(())
}
