//! Lines over one axis, with the spread of the repeats.

use plotters::prelude::*;

use super::{Area, Drawn, FigureError, Margins, Scale, axes, font, sheet};

const LINE: RGBColor = RGBColor(33, 102, 172);
/// Of a panel, pixels.
const SIZE: (i32, i32) = (760, 260);
const MARGINS: Margins = Margins { left: 80, right: 24, top: 12, bottom: 46 };
/// Over everything.
const TITLE: i32 = 40;

/// A quantity over the axis.
#[derive(Clone)]
pub struct Panel {
    pub y_label: String,
    /// x, mean, spread.
    pub points: Vec<(f64, f64, Option<f64>)>,
}

/// Draws panels one above the other.
///
/// # Errors
/// The drawing library refuses.
pub fn draw(title: &str, x_label: &str, panels: &[Panel]) -> Result<String, FigureError> {
    let size = (SIZE.0 as u32, (TITLE + SIZE.1 * panels.len() as i32) as u32);
    sheet(title, size, |root| {
        root.draw(&Text::new(title.to_owned(), (20, 12), font(20)))?;
        for (index, panel) in panels.iter().enumerate() {
            let area = root.clone().shrink((0, TITLE + index as i32 * SIZE.1), SIZE);
            draw_panel(&area, x_label, panel)?;
        }
        Ok(())
    })
}

fn draw_panel(area: &Area<'_>, x_label: &str, panel: &Panel) -> Drawn {
    let mut points = panel.points.clone();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let reach = |sign: f64| points.iter().map(move |(_, mean, spread)| mean + sign * spread.unwrap_or(0.0));
    let y = padded(
        reach(-1.0).chain([0.0]).fold(f64::INFINITY, f64::min),
        reach(1.0).chain([0.0]).fold(f64::NEG_INFINITY, f64::max),
    );
    let ends = points.iter().map(|(x, ..)| *x);
    let x = padded(ends.clone().fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max));
    let x = Scale { range: x, words: x_label, marks: 11 };
    let y = Scale { range: y, words: &panel.y_label, marks: 6 };
    let mut chart = axes(area, MARGINS, &x, &y)?;
    chart.draw_series(LineSeries::new(points.iter().map(|(x, mean, _)| (*x, *mean)), LINE.stroke_width(2)))?;
    for (x, mean, spread) in &points {
        if let Some(spread) = spread {
            let ends = vec![(*x, mean - spread), (*x, mean + spread)];
            chart.draw_series([PathElement::new(ends, LINE.stroke_width(1))])?;
        }
        chart.draw_series([Circle::new((*x, *mean), 4, LINE.filled())])?;
    }
    Ok(())
}

fn padded(low: f64, high: f64) -> (f64, f64) {
    if low > high {
        return (-1.0, 1.0);
    }
    let more = (0.06 * (high - low)).max(1e-3 * high.abs()).max(1e-9);
    (low - more, high + more)
}
