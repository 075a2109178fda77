//! How fast robots of several designs walk and turn.

use plotters::prelude::*;

use super::{Drawn, FigureError, Margins, Scale, axes, font, sheet};

/// What a design can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignDot {
    /// mm/s.
    pub speed_mm_per_s: f64,
    /// °/s, positive in the direction that was learned.
    pub turning_deg_per_s: f64,
}

const ALL: RGBColor = RGBColor(160, 160, 160);
const FRONT: RGBColor = RGBColor(33, 102, 172);
const FILE: RGBColor = RGBColor(214, 96, 20);
const SIZE: (u32, u32) = (640, 420);
const MARGINS: Margins = Margins { left: 74, right: 20, top: 40, bottom: 50 };

/// Turning over speed: all designs (grey), those that nothing beats in both (blue, joined, in the order of `front`), and the first one, the
/// file's own (orange).
///
/// # Errors
/// The drawing library refuses.
pub fn designs_svg(all: &[DesignDot], front: &[usize]) -> Result<String, FigureError> {
    sheet("designs", SIZE, |root| {
        let ends = |part: fn(&DesignDot) -> f64| {
            let values = || all.iter().map(part);
            let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
            let margin = 0.08 * (high - low).max(1e-3);
            (if low < 0.0 { low - margin } else { 0.0 }, high + margin)
        };
        let x = Scale { range: ends(|one| one.speed_mm_per_s), words: "walking / mm/s", marks: 8 };
        let y = Scale { range: ends(|one| one.turning_deg_per_s), words: "learned turning / °/s", marks: 6 };
        let mut chart = axes(root, MARGINS, &x, &y)?;
        let at = |one: &DesignDot| (one.speed_mm_per_s, one.turning_deg_per_s);
        chart.draw_series(all.iter().map(|one| Circle::new(at(one), 3, ALL.filled())))?;
        let best: Vec<_> = front.iter().filter_map(|&place| all.get(place)).map(at).collect();
        chart.draw_series(LineSeries::new(best.clone(), FRONT.stroke_width(2)))?;
        chart.draw_series(best.into_iter().map(|at| Circle::new(at, 4, FRONT.filled())))?;
        chart.draw_series(all.first().map(|one| Circle::new(at(one), 5, FILE.filled())))?;
        legend(root)
    })
}

fn legend(root: &super::Area<'_>) -> Drawn {
    let entries = [(ALL, "a design"), (FRONT, "none walks and turns faster"), (FILE, "the file's own")];
    for (place, (colour, words)) in entries.into_iter().enumerate() {
        let x = MARGINS.left + 10 + 185 * place as i32;
        root.draw(&Circle::new((x, 20), 4, colour.filled()))?;
        root.draw(&Text::new(words, (x + 10, 12), font(13)))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_design_has_its_dot() {
        let one = |speed_mm_per_s, turning_deg_per_s| DesignDot { speed_mm_per_s, turning_deg_per_s };
        let svg = designs_svg(&[one(3.0, -0.5), one(2.0, 1.0), one(1.0, 0.3)], &[0, 1]).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let dots = document.descendants().filter(|node| node.has_tag_name("circle")).count();
        // Three of a legend, three designs, two on the front, the file's.
        assert_eq!(dots, 3 + 3 + 2 + 1);
    }
}
