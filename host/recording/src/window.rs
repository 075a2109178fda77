//! A part of a run, cut by its own time.

use super::{AngleReading, Drive, Recording, RecordingError};

/// The part of a run that is looked at. Both ends belong to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Nothing before this time of the recording, s.
    pub from_s: Option<f64>,
    /// Nothing after this time of the recording, s.
    pub to_s: Option<f64>,
}

impl Window {
    /// Whether it is the whole run.
    #[must_use]
    pub fn is_all(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a time is in it.
    #[must_use]
    pub fn contains(&self, t_s: f64) -> bool {
        self.from_s.is_none_or(|from| t_s >= from) && self.to_s.is_none_or(|to| t_s <= to)
    }
}

impl Recording {
    /// Leaves only what is in a window, and says how many samples are gone.
    ///
    /// # Errors
    /// [`RecordingError::Format`] where nothing would be left.
    pub fn cut(&mut self, window: &Window) -> Result<usize, RecordingError> {
        let inside: Vec<bool> = self.t_s.iter().map(|t_s| window.contains(*t_s)).collect();
        let gone = inside.iter().filter(|inside| !**inside).count();
        if gone == inside.len() && gone > 0 {
            let (first, last) = (self.t_s[0], self.t_s[gone - 1]);
            return Err(RecordingError::Format {
                path: self.path.clone(),
                problem: format!("no sample is within --from and --to: the recording goes from {first} s to {last} s"),
                help: "choose them within the recording's own time, in s".into(),
            });
        }
        keep(&mut self.t_s, &inside);
        keep(&mut self.enable, &inside);
        match &mut self.drive {
            Drive::Duty(column) | Drive::Voltage(column) => keep(column, &inside),
        }
        match &mut self.angle {
            AngleReading::Angle(column) => keep(column, &inside),
            AngleReading::Adc(column) => keep(column, &inside),
        }
        keep(&mut self.adc_second, &inside);
        keep(&mut self.supply_v, &inside);
        keep(&mut self.current_a, &inside);
        keep(&mut self.temperature_c, &inside);
        Ok(gone)
    }
}

/// Keeps some values of a column; an optional one that is empty stays so.
fn keep<T>(column: &mut Vec<T>, inside: &[bool]) {
    let mut row = 0;
    column.retain(|_| {
        row += 1;
        inside[row - 1]
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run() -> Recording {
        Recording {
            t_s: vec![0.0, 0.5, 1.0, 1.5],
            enable: vec![true, false, true, true],
            drive: Drive::Duty(vec![0.0, 0.1, 0.2, 0.3]),
            angle: AngleReading::Angle(vec![Some(0.0), None, Some(2.0), Some(3.0)]),
            supply_v: vec![5.0, 5.1, 5.2, 5.3],
            ..Recording::default()
        }
    }

    #[test]
    fn every_column_is_cut_and_the_ends_belong_to_the_window() {
        let mut cut = run();
        assert_eq!(cut.cut(&Window { from_s: Some(0.5), to_s: Some(1.0) }).unwrap(), 2);
        let expected = Recording {
            t_s: vec![0.5, 1.0],
            enable: vec![false, true],
            drive: Drive::Duty(vec![0.1, 0.2]),
            angle: AngleReading::Angle(vec![None, Some(2.0)]),
            supply_v: vec![5.1, 5.2],
            ..Recording::default()
        };
        assert_eq!(cut, expected);
        assert_eq!(run().cut(&Window::default()).unwrap(), 0);
    }

    #[test]
    fn a_window_beside_the_run_is_refused() {
        let error = run().cut(&Window { from_s: Some(2.0), to_s: None }).unwrap_err().to_string();
        assert!(error.contains("from 0 s to 1.5 s"), "{error}");
    }
}
