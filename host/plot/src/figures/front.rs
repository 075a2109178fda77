//! What nothing beats in two respects, among everything that was tried.

use plotters::prelude::*;

use super::{Area, Chart, Drawn, FigureError, Margins, Scale, axes, font, sheet};

const ALL: RGBColor = RGBColor(160, 160, 160);
const FRONT: RGBColor = RGBColor(33, 102, 172);
const MARKED: RGBColor = RGBColor(214, 96, 20);
const SIZE: (u32, u32) = (640, 420);
const MARGINS: Margins = Margins { left: 74, right: 20, top: 40, bottom: 50 };

/// Dots of what was tried.
pub(super) struct Front<'a> {
    /// Everything (grey).
    pub all: Vec<(f64, f64)>,
    /// Places in `all` of what nothing beats (blue, joined in this order).
    pub best: &'a [usize],
    /// What it is compared with (orange).
    pub marked: Vec<(f64, f64)>,
    /// What the three are called.
    pub words: [&'a str; 3],
}

impl Front<'_> {
    /// Draws it over axes; `under` is drawn first.
    pub(super) fn svg(
        &self,
        title: &str,
        [x, y]: [&Scale<'_>; 2],
        under: impl FnOnce(&mut Chart<'_, '_>) -> Drawn,
    ) -> Result<String, FigureError> {
        sheet(title, SIZE, |root| {
            let mut chart = axes(root, MARGINS, x, y)?;
            under(&mut chart)?;
            chart.draw_series(self.all.iter().map(|at| Circle::new(*at, 3, ALL.filled())))?;
            let best: Vec<_> = self.best.iter().filter_map(|&place| self.all.get(place)).copied().collect();
            chart.draw_series(LineSeries::new(best.clone(), FRONT.stroke_width(2)))?;
            chart.draw_series(best.into_iter().map(|at| Circle::new(at, 4, FRONT.filled())))?;
            chart.draw_series(self.marked.iter().map(|at| Circle::new(*at, 5, MARKED.filled())))?;
            self.legend(root)
        })
    }

    fn legend(&self, root: &Area<'_>) -> Drawn {
        for (place, (colour, words)) in [ALL, FRONT, MARKED].into_iter().zip(self.words).enumerate() {
            let x = MARGINS.left + 10 + 185 * place as i32;
            root.draw(&Circle::new((x, 20), 4, colour.filled()))?;
            root.draw(&Text::new(words, (x + 10, 12), font(13)))?;
        }
        Ok(())
    }
}
