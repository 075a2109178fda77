//! How fast and how straight ways to walk are.

use plotters::prelude::*;

use super::front::Front;
use super::{FigureError, INK, Scale};

/// A way to walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Straightness {
    /// mm/s.
    pub speed_mm_per_s: f64,
    /// Turns a metre, counter-clockwise positive.
    pub turns_per_m: f64,
}

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
    let of = |part: fn(&Straightness) -> f64| all.iter().chain(constant).map(part).fold(0.0_f64, f64::max).max(1e-3);
    let (fastest, most) = (of(|one| one.speed_mm_per_s), of(|one| one.turns_per_m.abs()).max(bar_turns_per_m));
    let x = Scale { range: (0.0, 1.05 * most), words: "curvature of the path / turns a metre", marks: 8 };
    let y = Scale { range: (0.0, 1.15 * fastest), words: "speed / mm/s", marks: 6 };
    let bar = [(bar_turns_per_m, 0.0), (bar_turns_per_m, 1.15 * fastest)];
    let at = |one: &Straightness| (one.turns_per_m.abs(), one.speed_mm_per_s);
    let words = ["+F and −F in turn", "none is faster and straighter", "one frequency alone"];
    let dots =
        Front { all: all.iter().map(at).collect(), best: front, marked: constant.iter().map(at).collect(), words };
    dots.svg("straightness", [&x, &y], |chart| {
        chart.draw_series(LineSeries::new(bar, INK.stroke_width(1)))?;
        Ok(())
    })
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
