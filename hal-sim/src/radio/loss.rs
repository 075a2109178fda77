//! Losses in bursts: a chain of two states in continuous time (Gilbert 1960, Elliott 1963), in a burst and out of it, both
//! of exponential length.

use crate::random::Stream;

/// How much is lost, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Share lost in the long run.
    pub share: f64,
    /// Share lost out of a burst, at most `share`.
    pub quiet_share: f64,
    /// Share lost in a burst, at least `share`.
    pub burst_share: f64,
    /// Mean length of a burst, µs; 0 for independent losses.
    pub burst_us: f64,
}

impl Loss {
    /// Share of time in a burst: what makes `share` of the two others.
    #[must_use]
    pub fn time_in_bursts(&self) -> f64 {
        let span = self.burst_share - self.quiet_share;
        if span > 0.0 { ((self.share - self.quiet_share) / span).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Probability of being in a burst a time (µs) after a moment in or out of one: the chain forgets exponentially, with
    /// rate `1/burst + 1/gap` where `gap = burst · (1 − share) / share` of time.
    #[must_use]
    pub fn in_burst_after(&self, in_burst: bool, after_us: f64) -> f64 {
        let long_run = self.time_in_bursts();
        let memory_us = self.burst_us * (1.0 - long_run);
        let remembered = if memory_us > 0.0 { (-after_us / memory_us).exp() } else { 0.0 };
        long_run + (f64::from(u8::from(in_burst)) - long_run) * remembered
    }
}

/// One receiver's state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bursts {
    /// In a burst or not, and when that was drawn, µs; nothing before the first draw.
    last: Option<(bool, u64)>,
}

impl Bursts {
    /// Whether a try that ends at this time (µs) is lost. Always draws twice.
    pub fn lose(&mut self, at_us: u64, loss: &Loss, stream: &mut Stream) -> bool {
        let burst_probability = match self.last {
            Some((in_burst, before_us)) => loss.in_burst_after(in_burst, at_us.saturating_sub(before_us) as f64),
            None => loss.time_in_bursts(),
        };
        let in_burst = stream.uniform(0.0, 1.0) < burst_probability;
        self.last = Some((in_burst, at_us));
        stream.uniform(0.0, 1.0) < if in_burst { loss.burst_share } else { loss.quiet_share }
    }
}
