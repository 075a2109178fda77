//! A table that is written as its rows come, and taken up again after a kill.
//!
//! A sweep keeps `STEM.toml`, which says what is swept, and one or more journals beside it: CSV files whose first column
//! is the number of the row. Rows are appended in whatever order they come, a group in one write. When all are there the
//! file is written anew, sorted, as a whole. What a kill or a full disk left of a row is cut off and made again.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use common::atomic::{remove, write_atomically};
use toml::{Table, Value};

/// Why a table cannot be written or taken up.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum JournalError {
    /// The directory holds something else.
    #[error("{} is of another sweep: {difference}", path.display())]
    #[diagnostic(help("choose another directory with --out, or begin anew with --fresh, which deletes it"))]
    Other {
        /// The table.
        path: PathBuf,
        /// What differs first.
        difference: String,
    },
    /// A table, and nothing that says what it is of.
    #[error("{} is there, but nothing says what it is of", path.display())]
    #[diagnostic(help("choose another directory with --out, or begin anew with --fresh, which deletes it"))]
    Unknown {
        /// The table.
        path: PathBuf,
    },
    /// A row that the program did not write so.
    #[error("{}, line {line}: row {number} has a cell that cannot be read", path.display())]
    #[diagnostic(help("delete the line, and the row is made again, or begin anew with --fresh"))]
    Row {
        /// The table.
        path: PathBuf,
        /// Its line, from 1.
        line: usize,
        /// The row's number.
        number: usize,
    },
    /// The file system refuses.
    #[error("{} cannot be written: {error}", path.display())]
    #[diagnostic(help(
        "every row that is in the table stays; free the disk or mend the directory and run the same again"
    ))]
    Io {
        /// Path of the file, as given.
        path: PathBuf,
        /// Error of the operating system.
        error: io::Error,
    },
}

/// Says in `STEM.toml` what a directory's tables are of, or checks that it is the same.
///
/// # Errors
/// It is something else, or cannot be written.
pub fn claim(directory: &Path, stem: &str, about: &Table, journals: &[&str], fresh: bool) -> Result<(), JournalError> {
    let path = directory.join(format!("{stem}.toml"));
    let io = |error| JournalError::Io { path: path.clone(), error };
    let tables = journals.iter().map(|name| directory.join(name));
    if fresh {
        // The tables first: without their description they would be of nothing.
        for table in tables.clone().chain([path.clone()]) {
            remove(&table).map_err(|error| JournalError::Io { path: table, error })?;
        }
    }
    match contents(&path) {
        Ok(bytes) => {
            let there: Table = String::from_utf8_lossy(&bytes).parse().unwrap_or_default();
            match first_difference(there, about.clone()) {
                Some(difference) => Err(JournalError::Other { path, difference }),
                None => Ok(()),
            }
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            if let Some(path) = tables.into_iter().find(|table| table.exists()) {
                return Err(JournalError::Unknown { path });
            }
            let text = about.to_string();
            write_atomically::<io::Error>(&path, |file| file.write_all(text.as_bytes())).map_err(io)
        }
        Err(error) => Err(io(error)),
    }
}

/// What a file has. Not a device, which might go on for ever.
fn contents(path: &Path) -> io::Result<Vec<u8>> {
    if fs::metadata(path)?.is_file() { fs::read(path) } else { Err(io::Error::other("it is no file")) }
}

/// Of a description: what a short run measures. It follows from the rest, so what else differs is said rather.
pub const PHYSICS: &str = "physics";

fn first_difference(mut there: Table, mut here: Table) -> Option<String> {
    let physics = there.remove(PHYSICS) != here.remove(PHYSICS);
    difference(&Value::Table(there), &Value::Table(here), "").or_else(|| {
        let words = "the same robot moves otherwise in this version of the program, or on this machine";
        physics.then(|| words.to_owned())
    })
}

/// Where two descriptions differ first, in words.
fn difference(there: &Value, here: &Value, at: &str) -> Option<String> {
    let (Value::Table(a), Value::Table(b)) = (there, here) else {
        return (there != here).then(|| format!("`{at}` is {} there and {} here", short(there), short(here)));
    };
    let inner = |key: &str| if at.is_empty() { key.to_owned() } else { format!("{at}.{key}") };
    for (key, value) in b {
        match a.get(key) {
            None => return Some(format!("`{}` is not there", inner(key))),
            Some(other) => {
                if let Some(found) = difference(other, value, &inner(key)) {
                    return Some(found);
                }
            }
        }
    }
    a.keys().find(|key| !b.contains_key(*key)).map(|key| format!("`{}` is there and not here", inner(key)))
}

fn short(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() > 60 { text.chars().take(57).chain("…".chars()).collect() } else { text }
}

/// Rows by their number, without it.
pub type Rows = BTreeMap<usize, Vec<String>>;

/// A table on its way.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    header: Vec<String>,
    file: File,
    /// What is whole, bytes.
    length: u64,
}

impl Journal {
    /// Opens or begins a table of so many rows (numbers from 1). Gives the rows that are there; what follows the last
    /// whole row is cut off.
    ///
    /// # Errors
    /// The file cannot be read or written.
    pub fn open(path: &Path, header: &[String], rows: usize) -> Result<(Self, Rows), JournalError> {
        let io = |error| JournalError::Io { path: path.into(), error };
        let head = line(header);
        let there = match contents(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(io(error)),
        };
        let (whole, found) = read(&there, &head, header.len(), rows);
        let mut file = OpenOptions::new().create(true).append(true).open(path).map_err(io)?;
        if there.len() as u64 != whole {
            file.set_len(whole).map_err(io)?;
        }
        let mut length = whole;
        if length == 0 {
            file.write_all(head.as_bytes()).map_err(io)?;
            length = head.len() as u64;
        }
        Ok((Self { path: path.into(), header: header.to_vec(), file, length }, found))
    }

    /// Appends rows.
    ///
    /// # Errors
    /// They cannot be written; what was there before stays whole.
    pub fn append(&mut self, rows: &[(usize, Vec<String>)]) -> Result<(), JournalError> {
        let text: String = rows.iter().map(|(number, cells)| numbered(*number, cells)).collect();
        match self.file.write_all(text.as_bytes()) {
            Ok(()) => {
                self.length += text.len() as u64;
                Ok(())
            }
            Err(error) => {
                // A full disk may have taken a part.
                let _ = self.file.set_len(self.length);
                Err(JournalError::Io { path: self.path.clone(), error })
            }
        }
    }

    /// Says where a row is whose cells mean nothing.
    #[must_use]
    pub fn unreadable(&self, number: usize) -> JournalError {
        let text = fs::read_to_string(&self.path).unwrap_or_default();
        let start = format!("{number},");
        // Of a row that is there twice the last one counts.
        let line = text.lines().enumerate().filter(|(_, line)| line.starts_with(&start)).map(|(index, _)| index + 1);
        JournalError::Row { path: self.path.clone(), line: line.last().unwrap_or(0), number }
    }

    /// Writes the table anew, sorted, as a whole or not at all.
    ///
    /// # Errors
    /// It cannot be written; the unsorted one stays.
    pub fn finish(self, rows: &Rows) -> Result<PathBuf, JournalError> {
        let mut text = line(&self.header);
        text.extend(rows.iter().map(|(number, cells)| numbered(*number, cells)));
        write_atomically::<io::Error>(&self.path, |file| file.write_all(text.as_bytes()))
            .map_err(|error| JournalError::Io { path: self.path.clone(), error })?;
        Ok(self.path)
    }
}

fn numbered(number: usize, cells: &[String]) -> String {
    let mut row = vec![number.to_string()];
    row.extend_from_slice(cells);
    line(&row)
}

/// A line of CSV with its end.
fn line(cells: &[String]) -> String {
    let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
    // Into memory, and every record has its own length: nothing can fail.
    let _ = writer.write_record(cells);
    writer.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}

/// Bytes that are whole rows, and the rows.
fn read(bytes: &[u8], head: &str, columns: usize, count: usize) -> (u64, Rows) {
    let mut rows = Rows::new();
    let Some(body) = bytes.strip_prefix(head.as_bytes()) else { return (0, rows) };
    let mut whole = head.len();
    for row in body.split_inclusive(|byte| *byte == b'\n') {
        let Some((number, cells)) = parse(row, columns).filter(|(number, _)| (1..=count).contains(number)) else {
            break;
        };
        rows.insert(number, cells);
        whole += row.len();
    }
    (whole as u64, rows)
}

/// A whole line of so many cells that begins with a number.
fn parse(row: &[u8], columns: usize) -> Option<(usize, Vec<String>)> {
    row.strip_suffix(b"\n")?;
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(row);
    let record = reader.records().next()?.ok()?;
    if record.len() != columns {
        return None;
    }
    let number = record.get(0)?.parse().ok()?;
    Some((number, record.iter().skip(1).map(String::from).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Vec<String> {
        ["run", "x", "note"].map(String::from).to_vec()
    }

    fn row(x: &str, note: &str) -> Vec<String> {
        vec![x.into(), note.into()]
    }

    #[test]
    fn every_cut_gives_the_whole_rows_before_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("t.csv");
        let (mut journal, none) = Journal::open(&path, &header(), 9).unwrap();
        assert!(none.is_empty());
        journal.append(&[(3, row("1.5", "a, \"b\"")), (1, row("", ""))]).unwrap();
        journal.append(&[(2, row("-2", "c"))]).unwrap();
        drop(journal);
        let full = fs::read(&path).unwrap();
        let ends: Vec<usize> = (0..full.len()).filter(|&at| full[at] == b'\n').map(|at| at + 1).collect();
        for cut in 0..=full.len() {
            fs::write(&path, &full[..cut]).unwrap();
            let (mut journal, rows) = Journal::open(&path, &header(), 9).unwrap();
            let whole = ends.iter().filter(|&&end| end <= cut).count().saturating_sub(1);
            assert_eq!(rows.len(), whole, "cut at {cut}");
            // What is made again stands on a line of its own.
            journal.append(&[(7, row("7", "again"))]).unwrap();
            drop(journal);
            let (_, rows) = Journal::open(&path, &header(), 9).unwrap();
            assert_eq!(rows.len(), whole + 1, "cut at {cut}");
            assert_eq!(rows[&7], row("7", "again"));
            if whole > 0 {
                assert_eq!(rows[&3], row("1.5", "a, \"b\""));
            }
        }
    }

    #[test]
    fn a_line_of_rubbish_and_what_follows_is_made_again() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("t.csv");
        for rubbish in ["2,1\n", "two,1,x\n", "99,1,x\n", "\0\0\0\n", "0,1,x\n"] {
            fs::write(&path, format!("run,x,note\n1,5,\n{rubbish}3,6,\n")).unwrap();
            let (_, rows) = Journal::open(&path, &header(), 9).unwrap();
            assert_eq!(rows.into_keys().collect::<Vec<_>>(), [1], "{rubbish:?}");
            assert_eq!(fs::read_to_string(&path).unwrap(), "run,x,note\n1,5,\n");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_no_table_and_a_link_to_one_that_is_stays() {
        use std::os::unix::fs::symlink;
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        symlink("/dev/null", at("device.csv")).unwrap();
        let refused = Journal::open(&at("device.csv"), &header(), 9).unwrap_err().to_string();
        assert!(refused.contains("device.csv cannot be written: it is no file"), "{refused}");
        symlink("far.csv", at("sweep.csv")).unwrap();
        let claim = |fresh| claim(directory.path(), "sweep", &Table::new(), &["sweep.csv"], fresh);
        claim(false).unwrap();
        for fresh in [false, true] {
            claim(fresh).unwrap();
            let (mut journal, rows) = Journal::open(&at("sweep.csv"), &header(), 9).unwrap();
            assert!(rows.is_empty(), "--fresh deletes what the link leads to");
            journal.append(&[(1, row("5", ""))]).unwrap();
            journal.finish(&Rows::from([(1, row("5", ""))])).unwrap();
            assert!(at("sweep.csv").is_symlink());
            assert_eq!(fs::read_to_string(at("far.csv")).unwrap(), "run,x,note\n1,5,\n");
        }
    }

    #[test]
    fn a_finished_table_is_sorted() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("t.csv");
        let (mut journal, mut rows) = Journal::open(&path, &header(), 9).unwrap();
        for number in [2, 1] {
            journal.append(&[(number, row("5", ""))]).unwrap();
            rows.insert(number, row("5", ""));
        }
        journal.finish(&rows).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "run,x,note\n1,5,\n2,5,\n");
    }

    #[test]
    fn a_sweep_of_something_else_is_refused_with_what_differs() {
        let directory = tempfile::tempdir().unwrap();
        let about = |text: &str| text.parse::<Table>().unwrap();
        let first = about("seconds = 2.0\n[robot.ground]\nfriction = 0.8\n");
        let claim = |about: &Table, fresh| claim(directory.path(), "sweep", about, &["sweep.csv"], fresh);
        claim(&first, false).unwrap();
        claim(&first, false).unwrap();
        let other = about("seconds = 2.0\n[robot.ground]\nfriction = 0.9\n");
        let message = claim(&other, false).unwrap_err().to_string();
        assert!(message.contains("`robot.ground.friction` is 0.8 there and 0.9 here"), "{message}");
        let more = about("seconds = 2.0\nstep_s = 1e-4\n[robot.ground]\nfriction = 0.8\n");
        assert!(claim(&more, false).unwrap_err().to_string().contains("`step_s` is not there"));
        let less = about("[robot.ground]\nfriction = 0.8\n");
        assert!(claim(&less, false).unwrap_err().to_string().contains("`seconds` is there and not here"));
        let version = about("seconds = 2.0\nphysics = [1.0]\n[robot.ground]\nfriction = 0.8\n");
        assert!(claim(&version, false).unwrap_err().to_string().contains("this version of the program"));
        fs::write(directory.path().join("sweep.csv"), "run\n").unwrap();
        claim(&other, true).unwrap();
        assert!(!directory.path().join("sweep.csv").exists(), "--fresh deletes the table");
        fs::write(directory.path().join("sweep.csv"), "run\n").unwrap();
        fs::remove_file(directory.path().join("sweep.toml")).unwrap();
        assert!(claim(&other, false).unwrap_err().to_string().contains("nothing says what it is of"));
    }
}
