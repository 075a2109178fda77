//! How fast robots of several designs walk and turn.

use super::front::Front;
use super::{FigureError, Scale};

/// What a design can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignDot {
    /// mm/s.
    pub speed_mm_per_s: f64,
    /// °/s, positive in the direction that was learned.
    pub turning_deg_per_s: f64,
}

/// Turning over speed: all designs (grey), those that nothing beats in both (blue, joined, in the order of `front`), and the first one, the
/// file's own (orange).
///
/// # Errors
/// The drawing library refuses.
pub fn designs_svg(all: &[DesignDot], front: &[usize]) -> Result<String, FigureError> {
    let ends = |part: fn(&DesignDot) -> f64| {
        let values = || all.iter().map(part);
        let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let margin = 0.08 * (high - low).max(1e-3);
        (if low < 0.0 { low - margin } else { 0.0 }, high + margin)
    };
    let x = Scale { range: ends(|one| one.speed_mm_per_s), words: "walking / mm/s", marks: 8 };
    let y = Scale { range: ends(|one| one.turning_deg_per_s), words: "learned turning / °/s", marks: 6 };
    let all: Vec<_> = all.iter().map(|one| (one.speed_mm_per_s, one.turning_deg_per_s)).collect();
    let marked = all.first().copied().into_iter().collect();
    let words = ["a design", "none walks and turns faster", "the file's own"];
    Front { all, best: front, marked, words }.svg("designs", [&x, &y], |_| Ok(()))
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
