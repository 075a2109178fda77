//! What happened, above the panels: strips of states, and marks that go through everything below.

use plotters::prelude::*;

use super::panel::{Area, Drawn, INK};

/// Height of a strip with its gap, pixels.
const STRIP: u32 = 24;
/// Height of a line of text, pixels.
const TEXT: u32 = 17;
/// Lines of labels; a label that finds no room is left out, its mark stays.
const LABEL_LINES: usize = 3;
/// Marks that still tell something apart.
const MOST_MARKS: usize = 150;
/// Mean width of a character of the labels, pixels.
const CHARACTER: i32 = 7;

/// Strips above, marks through everything.
#[derive(Clone, Debug, Default)]
pub struct Timeline {
    /// From top to bottom.
    pub strips: Vec<Strip>,
    /// In the order of time.
    pub marks: Vec<Mark>,
}

/// A row of spans.
#[derive(Clone, Debug)]
pub struct Strip {
    /// At its left.
    pub label: String,
    /// In the order of time.
    pub spans: Vec<Span>,
}

/// A time with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Begin on the x axis.
    pub from: f64,
    /// End on the x axis.
    pub to: f64,
    /// Written into it where there is room.
    pub label: String,
    /// Fill.
    pub colour: RGBColor,
}

/// A moment with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Position on the x axis.
    pub at: f64,
    /// Written beside it where there is room.
    pub label: String,
    /// Of line and text.
    pub colour: RGBColor,
}

impl Timeline {
    /// Pixels above the panels.
    pub(super) fn height(&self) -> u32 {
        let labels = if self.marks.is_empty() { 0 } else { LABEL_LINES as u32 * TEXT + 6 };
        let strips = STRIP * u32::try_from(self.strips.len()).unwrap_or(0);
        if labels + strips == 0 { 0 } else { labels + strips + 8 }
    }

    /// Draws over the panels, whose axes go from `inside.0` to `inside.1` pixels for the range `x`.
    pub(super) fn draw(&self, root: &Area<'_>, x: (f64, f64), inside: (i32, i32)) -> Drawn {
        let width = f64::from(inside.1 - inside.0);
        let pixel = |at: f64| inside.0 + (((at - x.0) / (x.1 - x.0)).clamp(0.0, 1.0) * width).round() as i32;
        let bottom = i32::try_from(root.dim_in_pixel().1).unwrap_or(i32::MAX) - 44;
        let font = |colour: &RGBColor| ("sans-serif", 14).into_font().color(colour);
        let mut ends = [i32::MIN; LABEL_LINES];
        let strips_top = if self.marks.is_empty() { 6 } else { (LABEL_LINES as u32 * TEXT + 10) as i32 };
        for mark in self.marks.iter().filter(|mark| (x.0..=x.1).contains(&mark.at)).take(MOST_MARKS) {
            let at = pixel(mark.at);
            let long = CHARACTER * i32::try_from(mark.label.chars().count()).unwrap_or(i32::MAX / 8);
            let free = ends.iter().position(|end| at > *end + 8 && at + 4 + long < inside.1 + 20);
            let mut top = strips_top;
            if let Some(line) = free {
                ends[line] = at + long;
                top = 5 + line as i32 * TEXT as i32;
                root.draw(&Text::new(mark.label.clone(), (at + 4, top), font(&mark.colour)))?;
            }
            root.draw(&PathElement::new(vec![(at, top), (at, bottom)], mark.colour.mix(0.45).stroke_width(1)))?;
        }
        for (index, strip) in self.strips.iter().enumerate() {
            let top = strips_top + index as i32 * STRIP as i32;
            root.draw(&Text::new(strip.label.clone(), (8, top + 3), font(&INK)))?;
            for span in &strip.spans {
                let (from, to) = (pixel(span.from), pixel(span.to));
                root.draw(&Rectangle::new([(from, top), (to.max(from + 1), top + 18)], span.colour.filled()))?;
                if CHARACTER * i32::try_from(span.label.chars().count()).unwrap_or(i32::MAX / 8) + 8 < to - from {
                    root.draw(&Text::new(span.label.clone(), (from + 5, top + 2), font(&INK)))?;
                }
            }
        }
        Ok(())
    }
}
