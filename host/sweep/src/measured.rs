//! Measured speeds to compare with: a CSV with f_hz, alpha_deg, vx_mm_per_s, vy_mm_per_s, yaw_deg_per_s.

use std::path::{Path, PathBuf};

use super::table::{Component, Stat};

/// The columns.
const COLUMNS: [&str; 5] = ["f_hz", "alpha_deg", "vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s"];

/// Why a table cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
#[error("{}{}: {problem}", path.display(), line.map_or(String::new(), |line| format!(":{line}")))]
#[diagnostic(help(
    "columns f_hz (positive clockwise), alpha_deg, vx_mm_per_s, vy_mm_per_s (to the left), yaw_deg_per_s \
     (counter-clockwise); a line a run, repeats as further lines, an empty cell for a missing number"
))]
pub struct MeasuredError {
    path: PathBuf,
    line: Option<u64>,
    problem: String,
}

/// A measured run.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MeasuredRun {
    f_hz: f64,
    alpha_deg: f64,
    speeds: [Option<f64>; 3],
}

/// Measured runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    rows: Vec<MeasuredRun>,
}

impl Measured {
    /// Reads a table.
    ///
    /// # Errors
    /// It cannot be read, a column is missing, or a cell is not a number.
    pub fn read(path: &Path) -> Result<Self, MeasuredError> {
        let wrong = |line, problem: String| MeasuredError { path: path.into(), line, problem };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_path(path)
            .map_err(|error| wrong(None, format!("cannot be read: {error}")))?;
        let header = reader.headers().map_err(|error| wrong(Some(1), error.to_string()))?.clone();
        let place = |name: &str| {
            header
                .iter()
                .position(|cell| cell == name)
                .ok_or_else(|| wrong(Some(1), format!("there is no column {name}")))
        };
        let places = COLUMNS.iter().map(|name| place(name)).collect::<Result<Vec<_>, _>>()?;
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| wrong(error.position().map(csv::Position::line), error.to_string()))?;
            let line = record.position().map(csv::Position::line);
            let number = |column: usize| match record.get(places[column]).unwrap_or("") {
                "" => Ok(None),
                text => match text.parse::<f64>() {
                    Ok(value) if value.is_finite() => Ok(Some(value)),
                    _ => Err(wrong(line, format!("{}: `{text}` is not a finite number", COLUMNS[column]))),
                },
            };
            let (Some(f_hz), Some(alpha_deg)) = (number(0)?, number(1)?) else {
                return Err(wrong(line, "f_hz and alpha_deg must be given".into()));
            };
            rows.push(MeasuredRun { f_hz, alpha_deg, speeds: [number(2)?, number(3)?, number(4)?] });
        }
        if rows.is_empty() {
            return Err(wrong(None, "has no rows".into()));
        }
        Ok(Self { rows })
    }

    /// Over the repeats of a condition.
    #[must_use]
    pub fn speed(&self, f_hz: f64, alpha_deg: f64, component: Component) -> Stat {
        let here = |row: &&MeasuredRun| (row.f_hz - f_hz).abs() < 1e-9 && (row.alpha_deg - alpha_deg).abs() < 1e-9;
        Stat::of(self.rows.iter().filter(here).map(|row| row.speeds[component as usize]))
    }

    /// Largest |mean| of all conditions: the denominator of (5.1).
    #[must_use]
    pub fn largest(&self, component: Component) -> f64 {
        let mean = |row: &MeasuredRun| self.speed(row.f_hz, row.alpha_deg, component).mean;
        self.rows.iter().filter_map(mean).fold(0.0, |largest, mean| largest.max(mean.abs()))
    }

    /// The conditions (f, α) that are in the table, each once.
    #[must_use]
    pub fn conditions(&self) -> Vec<(f64, f64)> {
        let mut found: Vec<(f64, f64)> = Vec::new();
        for row in &self.rows {
            if !found.contains(&(row.f_hz, row.alpha_deg)) {
                found.push((row.f_hz, row.alpha_deg));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Measured, MeasuredError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Measured::read(file.path())
    }

    const HEADER: &str = "alpha_deg,f_hz,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s\n";

    #[test]
    fn repeats_are_averaged_and_missing_cells_left_out() {
        let table = read(&format!("{HEADER}90,7,10,-1,\n90,7,14,-3,\n60,-8,-20,,5\n")).unwrap();
        let speed = table.speed(7.0, 90.0, Component::Longitudinal);
        assert_eq!(speed.mean, Some(12.0));
        assert!((speed.spread.unwrap() - 8.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(table.speed(7.0, 90.0, Component::Rotational), Stat::default());
        assert_eq!(table.largest(Component::Longitudinal), 20.0);
        assert_eq!(table.conditions(), [(7.0, 90.0), (-8.0, 60.0)]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (text, says) in [
            ("f_hz,alpha_deg\n7,90\n", ":1: there is no column vx_mm_per_s"),
            (&format!("{HEADER}90,7,10,0,0\n90,7,ten,0,0\n") as &str, ":3: vx_mm_per_s: `ten`"),
            (&format!("{HEADER}90,7,NaN,0,0\n"), ":2: vx_mm_per_s: `NaN`"),
            (&format!("{HEADER}90,,1,0,0\n"), ":2: f_hz and alpha_deg"),
            (HEADER, "no rows"),
            (&format!("{HEADER}90,7\n"), ":2:"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(says), "{message}");
        }
        assert!(Measured::read(Path::new("/nowhere/t.csv")).unwrap_err().to_string().contains("cannot be read"));
    }
}
