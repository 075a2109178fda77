//! A way on the plane that a robot is to follow.

use serde::{Deserialize, Serialize};

/// Straight lines from point to point; the last one goes on for ever.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Way(Vec<[f64; 2]>);

impl Way {
    /// Through these points.
    ///
    /// # Panics
    /// If there are not at least two, or two that follow one another are the same.
    #[must_use]
    pub fn new(points: Vec<[f64; 2]>) -> Self {
        let apart = points.windows(2).all(|pair| length(pair) > 0.0);
        assert!(points.len() > 1 && apart, "a way goes from one point to another");
        Self(points)
    }

    /// The x axis from the start on.
    #[must_use]
    pub fn along_x() -> Self {
        Self(vec![[0.0, 0.0], [1.0, 0.0]])
    }

    /// The point of the way that is so far along it from where it is nearest to a point. Of two that are equally near it is the one
    /// closer to the end.
    #[must_use]
    pub fn ahead(&self, from: [f64; 2], distance: f64) -> [f64; 2] {
        let (mut nearest, mut place, mut left) = (f64::INFINITY, 0, distance);
        let last = self.0.len() - 2;
        for (index, pair) in self.0.windows(2).enumerate() {
            let end = if index == last { f64::INFINITY } else { length(pair) };
            let along = projection(pair, from).clamp(0.0, end);
            let [x, y] = on(pair, along);
            let off = (x - from[0]).hypot(y - from[1]);
            if off <= nearest {
                (nearest, place, left) = (off, index, along + distance);
            }
        }
        while place < last && left > length(&self.0[place..place + 2]) {
            left -= length(&self.0[place..place + 2]);
            place += 1;
        }
        on(&self.0[place..place + 2], left)
    }
}

fn length(pair: &[[f64; 2]]) -> f64 {
    (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])
}

/// How far along a line a point lies.
fn projection(pair: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let [from, to] = [pair[0], pair[1]];
    ((x - from[0]) * (to[0] - from[0]) + (y - from[1]) * (to[1] - from[1])) / length(pair)
}

/// The point so far along a line.
fn on(pair: &[[f64; 2]], along: f64) -> [f64; 2] {
    let share = along / length(pair);
    [0, 1].map(|axis| pair[0][axis] + share * (pair[1][axis] - pair[0][axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ahead_goes_round_corners_and_on_behind_the_end() {
        let way = Way::new(vec![[0.0, 0.0], [4.0, 0.0], [4.0, -3.0]]);
        assert_eq!(way.ahead([1.0, 0.5], 2.0), [3.0, 0.0]);
        assert_eq!(way.ahead([3.0, -0.5], 2.0), [4.0, -1.0]);
        assert_eq!(way.ahead([4.5, -2.5], 2.0), [4.0, -4.5]);
        assert_eq!(way.ahead([3.9, -8.0], 2.0), [4.0, -10.0]);
        // Behind its start.
        assert_eq!(way.ahead([-2.0, 0.1], 1.0), [1.0, 0.0]);
        // As far from both lines: the later one.
        assert_eq!(way.ahead([3.0, -1.0], 0.0), [4.0, -1.0]);
    }

    #[test]
    #[should_panic(expected = "a way goes from one point to another")]
    fn a_way_that_stands_is_none() {
        let _ = Way::new(vec![[1.0, 1.0], [1.0, 1.0]]);
    }
}
