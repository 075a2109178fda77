//! Measured speeds: a CSV with f_hz, alpha_deg, vx_mm_per_s, vy_mm_per_s, yaw_deg_per_s, or with the file that shows each run.

use std::path::{Path, PathBuf};

use super::table::{Component, Stat};

const F: &str = "f_hz";
const ALPHA: &str = "alpha_deg";
const SPEEDS: [&str; 3] = ["vx_mm_per_s", "vy_mm_per_s", "yaw_deg_per_s"];
/// In place of the speeds.
const FILE: &str = "file";

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

impl MeasuredError {
    fn new(path: &Path, line: Option<u64>, problem: String) -> Self {
        Self { path: path.into(), line, problem }
    }
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
    /// Runs by their conditions (f in Hz, positive clockwise; α in degrees): longitudinal and lateral speed, mm/s, yaw, °/s.
    #[must_use]
    pub fn of_runs(runs: impl IntoIterator<Item = ((f64, f64), [Option<f64>; 3])>) -> Self {
        let row = |((f_hz, alpha_deg), speeds)| MeasuredRun { f_hz, alpha_deg, speeds };
        Self { rows: runs.into_iter().map(row).collect() }
    }

    /// Reads a table of speeds.
    ///
    /// # Errors
    /// It cannot be read, a column is missing, or a cell is not a number.
    pub fn read(path: &Path) -> Result<Self, MeasuredError> {
        let unfilmed =
            |_: &Path| Err(MeasuredError::new(path, None, "it names files where speeds are expected".into()));
        Self::read_with(path, unfilmed)
    }

    /// Reads a table of speeds, or of files that show the runs: a column `file` in place of the speeds, with paths that begin where
    /// the table is. `filmed` tells their speeds.
    ///
    /// # Errors
    /// It cannot be read, a column is missing, a cell is not a number, or those of `filmed`.
    pub fn read_with<E: From<MeasuredError>>(
        path: &Path,
        mut filmed: impl FnMut(&Path) -> Result<[f64; 3], E>,
    ) -> Result<Self, E> {
        let table = Table::open(path)?;
        let directory = path.parent().unwrap_or(Path::new(""));
        let mut rows = Vec::new();
        for (line, cells) in &table.lines {
            let number = |column: &str| table.number(column, *line, cells);
            let (Some(f_hz), Some(alpha_deg)) = (number(F)?, number(ALPHA)?) else {
                return Err(table.wrong(Some(*line), "f_hz and alpha_deg must be given".into()).into());
            };
            let speeds = match table.cell(FILE, cells) {
                Some("") => return Err(table.wrong(Some(*line), "file must be given".into()).into()),
                Some(file) => filmed(&directory.join(file))?.map(Some),
                None => [number(SPEEDS[0])?, number(SPEEDS[1])?, number(SPEEDS[2])?],
            };
            rows.push(MeasuredRun { f_hz, alpha_deg, speeds });
        }
        if rows.is_empty() {
            return Err(table.wrong(None, "has no rows".into()).into());
        }
        Ok(Self { rows })
    }

    /// These runs and further ones.
    #[must_use]
    pub fn and(mut self, further: Self) -> Self {
        self.rows.extend(further.rows);
        self
    }

    /// Over the repeats of a condition.
    #[must_use]
    pub fn speed(&self, f_hz: f64, alpha_deg: f64, component: Component) -> Stat {
        self.repeats(f_hz, alpha_deg, component).0
    }

    /// The same, with how many repeats have the number.
    #[must_use]
    pub fn repeats(&self, f_hz: f64, alpha_deg: f64, component: Component) -> (Stat, usize) {
        let here = |row: &&MeasuredRun| (row.f_hz - f_hz).abs() < 1e-9 && (row.alpha_deg - alpha_deg).abs() < 1e-9;
        let speeds = || self.rows.iter().filter(here).map(|row| row.speeds[component as usize]);
        (Stat::of(speeds()), speeds().flatten().count())
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

/// A table's cells.
struct Table<'a> {
    path: &'a Path,
    header: Vec<String>,
    /// With the line they stand in.
    lines: Vec<(u64, Vec<String>)>,
}

impl<'a> Table<'a> {
    /// Reads all cells, and checks that the columns are there.
    fn open(path: &'a Path) -> Result<Self, MeasuredError> {
        let wrong = |line, problem: String| MeasuredError::new(path, line, problem);
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_path(path)
            .map_err(|error| wrong(None, format!("cannot be read: {error}")))?;
        let header = reader.headers().map_err(|error| wrong(Some(1), error.to_string()))?;
        let header: Vec<String> = header.iter().map(str::to_owned).collect();
        let there = |name: &str| header.iter().any(|cell| cell == name);
        let speeds = if there(FILE) { &[][..] } else { &SPEEDS[..] };
        if let Some(missing) = [F, ALPHA].iter().chain(speeds).find(|name| !there(name)) {
            return Err(wrong(Some(1), format!("there is no column {missing}")));
        }
        let mut lines = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| wrong(error.position().map(csv::Position::line), error.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            lines.push((line, record.iter().map(str::to_owned).collect()));
        }
        Ok(Self { path, header, lines })
    }

    fn wrong(&self, line: Option<u64>, problem: String) -> MeasuredError {
        MeasuredError::new(self.path, line, problem)
    }

    /// A cell, empty where a line ends before it; none without such a column.
    fn cell<'c>(&self, column: &str, cells: &'c [String]) -> Option<&'c str> {
        let place = self.header.iter().position(|name| name == column)?;
        Some(cells.get(place).map_or("", String::as_str))
    }

    fn number(&self, column: &str, line: u64, cells: &[String]) -> Result<Option<f64>, MeasuredError> {
        match self.cell(column, cells).unwrap_or("") {
            "" => Ok(None),
            text => match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Some(value)),
                _ => Err(self.wrong(Some(line), format!("{column}: `{text}` is not a finite number"))),
            },
        }
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
