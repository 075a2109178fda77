//! Plots of a sweep as SVG: maps as in the thesis's Figs 5.1 and 5.2, paths as in Figs 3.4 and 3.5, lines.

mod heat;
mod lines;
mod maps;
mod paths;

use plotters::prelude::*;

pub use maps::{Figure, draw};

/// Ink of axes and text.
const INK: RGBColor = RGBColor(40, 40, 40);
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

/// Draws on a white sheet.
fn sheet(
    title: &str,
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, plotters::coord::Shift>) -> Drawn,
) -> Result<String, FigureError> {
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
    format!("{}", super::axis::significant(value, 6)).replace('-', "−")
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
