//! Maps: a cell a condition, its colour the value, the value written in it.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{Drawn, FigureError, INK, MISSING, font, sheet, shown, width};

/// Blue, for what is positive (the thesis's colours).
const POSITIVE: [f64; 3] = [33.0, 102.0, 172.0];
/// Red, for what is negative.
const NEGATIVE: [f64; 3] = [190.0, 30.0, 45.0];
/// Green, for what has no sign.
const AMOUNT: [f64; 3] = [0.0, 109.0, 44.0];

/// A value with its spread.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Cell {
    /// None where there is none.
    pub value: Option<f64>,
    /// Standard deviation over the repeats.
    pub spread: Option<f64>,
}

/// How a value becomes a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Blue positive, red negative.
    Signed,
    /// White to green.
    Amount,
}

/// Heat map of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    pub x: Vec<String>,
    /// Labels of the rows, from below.
    pub y: Vec<String>,
    /// `cells[row of y][column of x]`.
    pub cells: Vec<Vec<Cell>>,
    pub scale: Scale,
    /// Value of the full colour; none for the largest of the map.
    pub full: Option<f64>,
}

impl Map {
    fn full(&self) -> f64 {
        let values = self.cells.iter().flatten().filter_map(|cell| cell.value);
        let full = self.full.unwrap_or_else(|| values.fold(0.0_f64, |largest, value| largest.max(value.abs())));
        if full > 0.0 { full } else { 1.0 }
    }
}

/// Height of a cell, pixels.
const CELL_HEIGHT: i32 = 50;
/// Room round the cells of a map, pixels.
const LEFT: i32 = 76;
const RIGHT: i32 = 76;
const TOP: i32 = 40;
const BOTTOM: i32 = 54;
/// Over everything.
const TITLE: i32 = 40;

/// Maps in rows, under a title.
///
/// # Errors
/// The drawing library refuses.
pub fn draw(title: &str, rows: &[Vec<Map>]) -> Result<String, FigureError> {
    let all = || rows.iter().flatten();
    let columns = all().map(|map| map.x.len()).max().unwrap_or(1) as i32;
    let lines = all().map(|map| map.y.len()).max().unwrap_or(1) as i32;
    // Few cells are wide, many narrow.
    let cell_width = (480 / columns).clamp(34, 84);
    let spreads = all().flat_map(|map| map.cells.iter().flatten()).any(|cell| cell.spread.is_some());
    let cell_height = if spreads { CELL_HEIGHT } else { CELL_HEIGHT - 14 };
    let titles = all().map(|map| LEFT + width(&map.title, 16) + 20).max().unwrap_or(0);
    let (wide, high) = ((LEFT + columns * cell_width + RIGHT).max(titles), TOP + lines * cell_height + BOTTOM);
    let across = rows.iter().map(Vec::len).max().unwrap_or(1) as i32;
    let size = ((wide * across).max(width(title, 20) + 40) as u32, (TITLE + high * rows.len() as i32) as u32);
    sheet(title, size, |root| {
        root.draw(&Text::new(title.to_owned(), (20, 12), font(20)))?;
        for (line, row) in rows.iter().enumerate() {
            for (column, map) in row.iter().enumerate() {
                let corner = (column as i32 * wide + LEFT, TITLE + line as i32 * high + TOP);
                draw_map(root, map, corner, (cell_width, cell_height))?;
            }
        }
        Ok(())
    })
}

type Root<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw_map(root: &Root<'_>, map: &Map, (left, top): (i32, i32), (wide, high): (i32, i32)) -> Drawn {
    let centred = |size: i32| font(size).pos(Pos::new(HPos::Center, VPos::Center));
    let full = map.full();
    let rows = map.y.len() as i32;
    root.draw(&Text::new(map.title.clone(), (left, top - 24), font(16)))?;
    for (line, cells) in map.cells.iter().enumerate() {
        let y = top + (rows - 1 - line as i32) * high;
        for (column, cell) in cells.iter().enumerate() {
            let x = left + column as i32 * wide;
            draw_cell(root, cell, (full, map.scale), (x, y), (wide, high))?;
        }
        let middle = y + high / 2;
        let right = font(14).pos(Pos::new(HPos::Right, VPos::Center));
        root.draw(&Text::new(map.y[line].clone(), (left - 8, middle), right))?;
    }
    let (bottom, right) = (top + rows * high, left + map.x.len() as i32 * wide);
    for (column, label) in map.x.iter().enumerate() {
        let x = left + column as i32 * wide + wide / 2;
        root.draw(&Text::new(label.clone(), (x, bottom + 14), centred(14)))?;
    }
    root.draw(&Text::new(map.x_label.clone(), ((left + right) / 2, bottom + 36), centred(15)))?;
    let turned = centred(15).transform(FontTransform::Rotate270);
    root.draw(&Text::new(map.y_label.clone(), (left - 60, (top + bottom) / 2), turned))?;
    root.draw(&Rectangle::new([(left, top), (right, bottom)], INK.stroke_width(1)))?;
    bar(root, map, full, (right + 14, top), bottom - top)
}

fn draw_cell(
    root: &Root<'_>,
    cell: &Cell,
    (full, scale): (f64, Scale),
    (x, y): (i32, i32),
    (wide, high): (i32, i32),
) -> Drawn {
    let fill = colour(cell.value, full, scale);
    root.draw(&Rectangle::new([(x, y), (x + wide, y + high)], fill.filled()))?;
    root.draw(&Rectangle::new([(x, y), (x + wide, y + high)], WHITE.stroke_width(1)))?;
    let ink = readable_on(fill);
    let text = |size: i32| ("sans-serif", size).into_font().color(&ink).pos(Pos::new(HPos::Center, VPos::Center));
    let (middle, centre) = (x + wide / 2, y + high / 2);
    let size = if wide < 44 { 11 } else { 15 };
    let Some(value) = cell.value else {
        root.draw(&Text::new("–", (middle, centre), text(size)))?;
        return Ok(());
    };
    match cell.spread {
        Some(spread) => {
            root.draw(&Text::new(shown(value, full), (middle, centre - 9), text(size)))?;
            root.draw(&Text::new(format!("±{}", shown(spread, full)), (middle, centre + 10), text(size - 2)))?;
        }
        None => root.draw(&Text::new(shown(value, full), (middle, centre), text(size)))?,
    }
    Ok(())
}

/// The colours and what they stand for.
fn bar(root: &Root<'_>, map: &Map, full: f64, (x, top): (i32, i32), height: i32) -> Drawn {
    let low = if map.scale == Scale::Signed { -full } else { 0.0 };
    let steps = 48;
    for step in 0..steps {
        let value = full + (low - full) * (f64::from(step) + 0.5) / f64::from(steps);
        // Each goes down to the end, over the one before: between two that only touch the paper would show.
        let from = top + step * height / steps;
        root.draw(&Rectangle::new([(x, from), (x + 12, top + height)], colour(Some(value), full, map.scale).filled()))?;
    }
    root.draw(&Rectangle::new([(x, top), (x + 12, top + height)], INK.stroke_width(1)))?;
    for (value, at) in [(full, top), (0.5 * (full + low), top + height / 2), (low, top + height)] {
        root.draw(&Text::new(shown(value, full), (x + 17, at), font(12).pos(Pos::new(HPos::Left, VPos::Center))))?;
    }
    Ok(())
}

/// From white at 0 to the full colour.
fn colour(value: Option<f64>, full: f64, scale: Scale) -> RGBColor {
    let Some(value) = value else { return MISSING };
    let end = match scale {
        Scale::Amount => AMOUNT,
        Scale::Signed if value < 0.0 => NEGATIVE,
        Scale::Signed => POSITIVE,
    };
    let share = (value.abs() / full).clamp(0.0, 1.0);
    let [r, g, b] = end.map(|end| (255.0 + share * (end - 255.0)).round() as u8);
    RGBColor(r, g, b)
}

/// The ink with the greater contrast on a ground.
fn readable_on(ground: RGBColor) -> RGBColor {
    if contrast(WHITE, ground) > contrast(INK, ground) { WHITE } else { INK }
}

/// Contrast of two colours, 1 … 21, as WCAG 2.1 defines it.
fn contrast(a: RGBColor, b: RGBColor) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// Relative luminance, 0 … 1, as WCAG 2.1 defines it.
fn luminance(colour: RGBColor) -> f64 {
    let linear = |channel: u8| {
        let share = f64::from(channel) / 255.0;
        if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * linear(colour.0) + 0.7152 * linear(colour.1) + 0.0722 * linear(colour.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blue_is_positive_and_red_negative() {
        let blue = colour(Some(1.0), 2.0, Scale::Signed);
        let red = colour(Some(-1.0), 2.0, Scale::Signed);
        assert!(blue.2 > blue.0 && red.0 > red.2);
        assert_eq!(colour(Some(0.0), 2.0, Scale::Signed), RGBColor(255, 255, 255));
        assert_eq!(colour(Some(9.0), 2.0, Scale::Signed), RGBColor(33, 102, 172), "beyond the scale: the full colour");
        assert_eq!(colour(None, 2.0, Scale::Signed), MISSING);
    }

    #[test]
    fn numbers_can_be_read_on_every_colour() {
        for scale in [Scale::Signed, Scale::Amount] {
            for step in -100..=100 {
                let ground = colour(Some(f64::from(step)), 100.0, scale);
                let found = contrast(readable_on(ground), ground);
                assert!(found > 3.8, "{scale:?} {step}: {found}");
            }
        }
        assert!((contrast(WHITE, BLACK) - 21.0).abs() < 1e-9);
    }
}
