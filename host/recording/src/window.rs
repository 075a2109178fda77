//! A part of a run, by the run's own time.

/// The part of a run that is looked at. Both ends belong to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Nothing before this time of the recording, s.
    pub from_s: Option<f64>,
    /// Nothing after this time of the recording, s.
    pub to_s: Option<f64>,
}

impl Window {
    pub(super) fn is_before(&self, t_s: f64) -> bool {
        self.from_s.is_some_and(|from| t_s < from)
    }

    pub(super) fn is_after(&self, t_s: f64) -> bool {
        self.to_s.is_some_and(|to| t_s > to)
    }
}
