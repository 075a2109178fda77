//! Tables that the command writes.

use std::path::Path;

/// A CSV file.
pub struct Csv {
    /// Of the columns.
    pub names: Vec<String>,
    /// Cells.
    pub rows: Vec<Vec<String>>,
}

impl Csv {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines().map(|line| line.split(',').map(String::from).collect::<Vec<_>>());
        let names = lines.next().unwrap();
        let rows: Vec<Vec<String>> = lines.collect();
        assert!(rows.iter().all(|row| row.len() == names.len()), "{}", path.display());
        Self { names, rows }
    }

    pub fn column(&self, name: &str) -> Vec<f64> {
        let index = self.names.iter().position(|known| known == name).unwrap_or_else(|| panic!("no column {name}"));
        self.rows.iter().map(|row| row[index].parse().unwrap()).collect()
    }
}
