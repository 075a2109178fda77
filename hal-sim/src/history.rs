//! The last milliseconds of an angle, so that a sensor can be read at its true instant.

/// Evenly spaced angles, newest last. Before the first step the angle was the initial one.
#[derive(Clone, Debug)]
pub struct History {
    angles: Vec<f64>,
    newest: usize,
}

impl History {
    /// Room for `steps` steps back, filled with one angle (rad).
    pub fn new(angle: f64, steps: usize) -> Self {
        Self { angles: vec![angle; steps.max(2) + 1], newest: 0 }
    }

    /// One step on.
    #[inline]
    pub fn push(&mut self, angle: f64) {
        self.newest += 1;
        if self.newest == self.angles.len() {
            self.newest = 0;
        }
        self.angles[self.newest] = angle;
    }

    /// The angle `back` steps ago (any real number), on the straight line between its neighbours; a negative `back` goes
    /// on with the last step's speed; beyond the memory the oldest angle.
    #[inline]
    pub fn angle(&self, back: f64) -> f64 {
        let whole = back.max(0.0).floor().min((self.angles.len() - 2) as f64);
        let share = (back - whole).min(1.0);
        let newer = self.at(whole as usize);
        let older = self.at(whole as usize + 1);
        newer + (older - newer) * share
    }

    fn at(&self, back: usize) -> f64 {
        let length = self.angles.len();
        self.angles[(self.newest + length - back) % length]
    }
}

#[cfg(test)]
mod tests {
    use super::History;

    #[test]
    fn the_past_is_found_between_the_steps() {
        let mut history = History::new(0.0, 5);
        for step in 1..=13 {
            history.push(f64::from(step));
        }
        for (back, angle) in [(0.0, 13.0), (0.25, 12.75), (4.5, 8.5), (5.0, 8.0), (99.0, 8.0), (-0.5, 13.5)] {
            assert_eq!(history.angle(back), angle, "{back} steps ago");
        }
    }
}
