//! How fast and how straight ways to walk are.

use plotters::prelude::*;

use super::{Drawn, FigureError, INK, Margins, Scale, axes, font, sheet};

/// A way to walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Straightness {
    /// mm/s.
    pub speed_mm_per_s: f64,
    /// Turns a metre, counter-clockwise positive.
    pub turns_per_m: f64,
}

const ALL: RGBColor = RGBColor(160, 160, 160);
const FRONT: RGBColor = RGBColor(33, 102, 172);
const CONSTANT: RGBColor = RGBColor(214, 96, 20);
const SIZE: (u32, u32) = (640, 420);
const MARGINS: Margins = Margins { left: 74, right: 20, top: 40, bottom: 50 };

/// Speed over curvature: all ways (grey), those that nothing beats in both (blue, joined, the straightest first in `front`), constant
/// frequencies (orange), and the curvature under which a path is called straight (line).
///
/// # Errors
/// The drawing library refuses.
pub fn straightness_svg(
    all: &[Straightness],
    front: &[usize],
    constant: &[Straightness],
    bar_turns_per_m: f64,
) -> Result<String, FigureError> {
    sheet("straightness", SIZE, |root| {
        let of =
            |part: fn(&Straightness) -> f64| all.iter().chain(constant).map(part).fold(0.0_f64, f64::max).max(1e-3);
        let curvature = |one: &Straightness| one.turns_per_m.abs();
        let (fastest, most) = (of(|one| one.speed_mm_per_s), of(|one| one.turns_per_m.abs()).max(bar_turns_per_m));
        let x = Scale { range: (0.0, 1.05 * most), words: "curvature of the path / turns a metre", marks: 8 };
        let y = Scale { range: (0.0, 1.15 * fastest), words: "speed / mm/s", marks: 6 };
        let mut chart = axes(root, MARGINS, &x, &y)?;
        let bar = [(bar_turns_per_m, 0.0), (bar_turns_per_m, 1.15 * fastest)];
        chart.draw_series(LineSeries::new(bar, INK.stroke_width(1)))?;
        let at = |one: &Straightness| (curvature(one), one.speed_mm_per_s);
        chart.draw_series(all.iter().map(|one| Circle::new(at(one), 3, ALL.filled())))?;
        let best: Vec<_> = front.iter().filter_map(|&place| all.get(place)).map(at).collect();
        chart.draw_series(LineSeries::new(best.clone(), FRONT.stroke_width(2)))?;
        chart.draw_series(best.into_iter().map(|at| Circle::new(at, 4, FRONT.filled())))?;
        chart.draw_series(constant.iter().map(|one| Circle::new(at(one), 5, CONSTANT.filled())))?;
        legend(root)
    })
}

fn legend(root: &super::Area<'_>) -> Drawn {
    let entries =
        [(ALL, "+F and −F in turn"), (FRONT, "none is faster and straighter"), (CONSTANT, "one frequency alone")];
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
    fn every_way_has_its_dot() {
        let one = |speed_mm_per_s, turns_per_m| Straightness { speed_mm_per_s, turns_per_m };
        let all = [one(3.0, -0.5), one(2.0, 0.1), one(1.0, 0.3)];
        let svg = straightness_svg(&all, &[1, 0], &[one(4.0, 2.0)], 0.2).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let dots = document.descendants().filter(|node| node.has_tag_name("circle")).count();
        // Three of a legend, three ways, two on the front, one constant.
        assert_eq!(dots, 3 + 3 + 2 + 1);
    }
}
