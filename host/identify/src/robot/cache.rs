//! What was simulated already, kept in a file: a fit that was stopped goes on where it was.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::RobotError;

/// Speeds by coordinates, bit for bit.
pub struct Cache {
    known: HashMap<Vec<u64>, Option<Vec<f64>>>,
    file: Option<(File, PathBuf)>,
}

impl Cache {
    /// In memory, or in a file of a directory. What it is `about` is in its name and its first line: another fit has another file.
    pub fn open(directory: Option<&Path>, about: &str) -> Result<Self, RobotError> {
        let Some(directory) = directory else { return Ok(Self { known: HashMap::new(), file: None }) };
        let path = directory.join(name(about));
        let wrong = |problem: String| RobotError::Cache { path: path.clone(), problem };
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(wrong(error.to_string())),
        };
        let mut lines = text.split_inclusive('\n');
        if let Some(first) = lines.next()
            && first.trim_end() != about
        {
            return Err(wrong("it is of another robot file, table or setting".into()));
        }
        // A line that was cut off by a kill is not there.
        let known = lines.filter(|line| line.ends_with('\n')).filter_map(parsed).collect();
        let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(|e| wrong(e.to_string()))?;
        if text.is_empty() {
            writeln!(file, "{about}").map_err(|e| wrong(e.to_string()))?;
        } else if !text.ends_with('\n') {
            writeln!(file).map_err(|e| wrong(e.to_string()))?;
        }
        Ok(Self { known, file: Some((file, path)) })
    }

    /// The file.
    pub fn path(&self) -> Option<PathBuf> {
        self.file.as_ref().map(|(_, path)| path.clone())
    }

    /// What is known of a point: speeds, or that nothing can be simulated there.
    pub fn get(&self, point: &[f64]) -> Option<&Option<Vec<f64>>> {
        self.known.get(&bits(point))
    }

    /// How many points are known.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// Keeps another point.
    pub fn put(&mut self, point: &[f64], speeds: Option<Vec<f64>>) -> Result<(), RobotError> {
        if let Some((file, path)) = &mut self.file {
            let words =
                |values: &[f64]| values.iter().map(|x| format!("{:016x}", x.to_bits())).collect::<Vec<_>>().join(" ");
            let line = format!("{}:{}\n", words(point), speeds.as_deref().map_or("-".into(), words));
            file.write_all(line.as_bytes())
                .map_err(|error| RobotError::Cache { path: path.clone(), problem: error.to_string() })?;
        }
        self.known.insert(bits(point), speeds);
        Ok(())
    }
}

/// FNV-1a: the same for the same words on every machine.
fn name(about: &str) -> String {
    let hash = about
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("identify-robot-{hash:016x}.part")
}

fn bits(point: &[f64]) -> Vec<u64> {
    point.iter().map(|x| x.to_bits()).collect()
}

fn parsed(line: &str) -> Option<(Vec<u64>, Option<Vec<f64>>)> {
    let (point, speeds) = line.trim_end().split_once(':')?;
    let words =
        |text: &str| text.split(' ').map(|word| u64::from_str_radix(word, 16).ok()).collect::<Option<Vec<u64>>>();
    let speeds = if speeds == "-" { None } else { Some(words(speeds)?.into_iter().map(f64::from_bits).collect()) };
    Some((words(point)?, speeds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_there_after_a_kill_and_for_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        let open = |about: &str| Cache::open(Some(directory.path()), about).unwrap();
        let mut cache = open("about 1");
        let path = cache.path().unwrap();
        cache.put(&[0.1, -2.0], Some(vec![1.0 / 3.0])).unwrap();
        cache.put(&[0.3, 0.0], None).unwrap();
        drop(cache);
        let mut text = std::fs::read_to_string(&path).unwrap();
        text.push_str("3fb999999999999a 40000");
        std::fs::write(&path, text).unwrap();
        let mut cache = open("about 1");
        assert_eq!((cache.len(), cache.get(&[0.1, -2.0])), (2, Some(&Some(vec![1.0 / 3.0]))));
        assert_eq!((cache.get(&[0.3, 0.0]), cache.get(&[0.1, 2.0])), (Some(&None), None));
        cache.put(&[9.0, 9.0], None).unwrap();
        assert_eq!((open("about 1").len(), open("about 2").len()), (3, 0));
        // A file of this name that is about something else is not used.
        std::fs::write(&path, "about 3\n").unwrap();
        assert!(Cache::open(Some(directory.path()), "about 1").is_err());
    }
}
