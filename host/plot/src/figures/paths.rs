//! Paths of the centroid: a panel an α, a colour a frequency, as in the thesis's Figs 3.4 and 3.5.

use plotters::prelude::*;

use super::{Area, Drawn, FigureError, Margins, Scale, axes, font, sheet, tick, width};

/// From the lowest |f| to the highest: light to dark.
const BLUES: [[u8; 3]; 2] = [[146, 197, 222], [5, 48, 97]];
const REDS: [[u8; 3]; 2] = [[244, 165, 130], [103, 0, 31]];
/// Inside of a panel, pixels.
const SIDE: i32 = 380;
/// Round it.
const MARGINS: Margins = Margins { left: 74, right: 16, top: 40, bottom: 50 };
/// Title and legend.
const HEAD: i32 = 70;

/// A path, mm.
pub struct Path {
    pub f_hz: f64,
    pub points: Vec<[f64; 2]>,
}

/// One panel.
pub struct Panel {
    pub title: String,
    pub paths: Vec<Path>,
}

/// Draws panels two abreast, all to one scale.
///
/// # Errors
/// The drawing library refuses.
pub fn draw(title: &str, panels: &[Panel]) -> Result<String, FigureError> {
    let ((x0, x1), (y0, y1)) = extent(panels);
    let wide = SIDE;
    let high = ((f64::from(SIDE) * (y1 - y0) / (x1 - x0)).round() as i32).clamp(120, 2 * SIDE);
    let across = panels.len().clamp(1, 2) as i32;
    let down = (panels.len() as i32 + across - 1) / across;
    let cell = (MARGINS.left + wide + MARGINS.right, MARGINS.top + high + MARGINS.bottom);
    let mut frequencies: Vec<f64> = panels.iter().flat_map(|panel| panel.paths.iter().map(|path| path.f_hz)).collect();
    frequencies.sort_by(f64::total_cmp);
    frequencies.dedup();
    let size = ((cell.0 * across).max(width(title, 20) + 40) as u32, (HEAD + cell.1 * down) as u32);
    sheet(title, size, |root| {
        root.draw(&Text::new(title.to_owned(), (20, 12), font(20)))?;
        legend(root, &frequencies)?;
        for (index, panel) in panels.iter().enumerate() {
            let (column, row) = (index as i32 % across, index as i32 / across);
            let area = root.clone().shrink((column * cell.0, HEAD + row * cell.1), (cell.0, cell.1));
            draw_panel(&area, panel, &frequencies, (x0, x1), (y0, y1))?;
        }
        Ok(())
    })
}

fn draw_panel(area: &Area<'_>, panel: &Panel, frequencies: &[f64], x: (f64, f64), y: (f64, f64)) -> Drawn {
    area.draw(&Text::new(panel.title.clone(), (MARGINS.left, 14), font(16)))?;
    let x = Scale { range: x, words: "forward / mm", marks: 7 };
    let y = Scale { range: y, words: "to the left / mm", marks: 7 };
    let mut chart = axes(area, MARGINS, &x, &y)?;
    for path in &panel.paths {
        let style = colour(path.f_hz, frequencies).stroke_width(1);
        chart.draw_series(LineSeries::new(path.points.iter().map(|p| (p[0], p[1])), style))?;
        if let Some(end) = path.points.last() {
            chart.draw_series([Circle::new((end[0], end[1]), 3, style.filled())])?;
        }
    }
    Ok(())
}

fn legend(root: &Area<'_>, frequencies: &[f64]) -> Drawn {
    let mut x = 20;
    for f in frequencies {
        root.draw(&PathElement::new(vec![(x, 52), (x + 24, 52)], colour(*f, frequencies).stroke_width(3)))?;
        let label = format!("{} Hz", tick(*f));
        root.draw(&Text::new(label.clone(), (x + 30, 45), font(15)))?;
        x += 30 + width(&label, 15) + 22;
    }
    Ok(())
}

/// Blue for positive frequencies, red for negative ones, darker the faster.
fn colour(f: f64, all: &[f64]) -> RGBColor {
    let fastest = all.iter().fold(0.0_f64, |fastest, f| fastest.max(f.abs()));
    let slowest = all.iter().fold(fastest, |slowest, f| slowest.min(f.abs()));
    let share = if fastest > slowest { (f.abs() - slowest) / (fastest - slowest) } else { 1.0 };
    let [light, dark] = if f < 0.0 { REDS } else { BLUES };
    let mix = |index: usize| (f64::from(light[index]) * (1.0 - share) + f64::from(dark[index]) * share).round() as u8;
    RGBColor(mix(0), mix(1), mix(2))
}

/// A range round all paths, with room, not much wider than high or higher than wide.
fn extent(panels: &[Panel]) -> ((f64, f64), (f64, f64)) {
    let points = || panels.iter().flat_map(|panel| panel.paths.iter().flat_map(|path| &path.points));
    let range = |axis: usize| {
        let (low, high) = points().fold((0.0_f64, 0.0_f64), |(low, high), p| (low.min(p[axis]), high.max(p[axis])));
        (low, high)
    };
    let (x, y) = (range(0), range(1));
    let longest = (x.1 - x.0).max(y.1 - y.0).max(1e-3);
    let widen = |(low, high): (f64, f64)| {
        let more = 0.5 * (0.5 * longest - (high - low)).max(0.0) + 0.05 * longest;
        (low - more, high + more)
    };
    (widen(x), widen(y))
}
