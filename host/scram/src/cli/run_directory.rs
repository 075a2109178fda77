//! Where the files of a run or of its evaluation go: a numbered directory of its own, or one that was named, in which
//! nothing of an earlier one is written over unasked.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Report, WrapErr, miette};
use recording::{RecordingError, is_disk_full};

use super::say;

/// Directories that are counted together, and what is in each of them.
pub struct Series {
    /// Stands for the first free number. What `--out` is when nothing is said.
    pub numbered: &'static str,
    /// How a numbered directory is called before its number.
    prefix: &'static str,
    /// Beside the numbered directories: leads to the last of them.
    latest: &'static str,
    /// What is not written over unasked.
    kept: &'static [&'static str],
    /// What these files are.
    are: &'static str,
}

/// Recordings of `scram sim` and `scram hil`.
pub const RUNS: Series = Series {
    numbered: "out/run-NNNN",
    prefix: "run-",
    latest: "latest",
    kept: &["run.mcap", "run.csv"],
    are: "the recording of another run",
};

/// What `scram identify` found. Has a link of its own, as those below: `latest` goes on leading to the recording.
pub const IDENTIFIED: Series = Series {
    numbered: "out/identify-NNNN",
    prefix: "identify-",
    latest: "latest-identify",
    kept: &["robot.toml", "potentiometer.svg", "backbone.svg", "robot.svg"],
    are: "perhaps what another run found",
};

/// What `scram replay` drew.
pub const REPLAYED: Series = Series {
    numbered: "out/replay-NNNN",
    prefix: "replay-",
    latest: "latest-replay",
    kept: &["replay.svg", "replay-comparison.svg"],
    are: "the picture of another replay",
};

/// What `scram calibrate` found, and the recordings that it is from or that gave nothing.
pub const CALIBRATED: Series = Series {
    numbered: "out/calibrate-NNNN",
    prefix: "calibrate-",
    latest: "latest-calibrate",
    kept: &["robot.toml", "potentiometer.svg", "run.mcap", "run.csv", "failed.mcap", "failed.csv"],
    are: "perhaps of another calibration",
};

/// What `scram diagnose` found.
pub const DIAGNOSED: Series = Series {
    numbered: "out/diagnose-NNNN",
    prefix: "diagnose-",
    latest: "latest-diagnose",
    kept: &["robot.toml", "robot-2.toml", "report.html", "diagnosis.json"],
    are: "perhaps what another run found",
};

/// What `scram learn` learned.
pub const LEARNED: Series = Series {
    numbered: "out/learn-NNNN",
    prefix: "learn-",
    latest: "latest-learn",
    kept: &["policy.json", "training.json", "straight.json", "learn.toml"],
    are: "of another training",
};

/// What `scram design-experiment` proposed.
pub const DESIGNED: Series = Series {
    numbered: "out/experiment-NNNN",
    prefix: "experiment-",
    latest: "latest-experiment",
    kept: &["experiment.txt"],
    are: "the proposal of another run",
};

/// Recordings that `scram import` made. They are called as their sources: the command itself looks for older ones.
pub const IMPORTED: Series = Series {
    numbered: "out/import-NNNN",
    prefix: "import-",
    latest: "latest-import",
    kept: &[],
    are: "another import's recording",
};

/// A directory that is this run's while this lives.
pub struct RunDirectory {
    path: PathBuf,
    /// Of a numbered one: the link to it.
    latest: Option<&'static str>,
    /// Two runs into one named directory: the second waits for the first, and finds its recording.
    _lock: Option<File>,
}

impl RunDirectory {
    /// Makes the directory of a run: `out` itself, or the next number for [`Series::numbered`].
    ///
    /// # Errors
    /// It cannot be made, or there is something in it that may not be written over.
    fn claim(series: &Series, out: &Path, overwrite: bool) -> Result<Self, Report> {
        if out != Path::new(series.numbered) {
            make(|| fs::create_dir_all(out), out)?;
            let lock = lock(out);
            series.refuse(out, overwrite)?;
            return Ok(Self { path: out.to_owned(), latest: None, _lock: lock });
        }
        let parent = out.parent().unwrap_or(Path::new(""));
        make(|| fs::create_dir_all(parent), parent)?;
        let path = next(parent, series.prefix).map_err(|error| cannot_be_made(out, error))?;
        Ok(Self { path, latest: Some(series.latest), _lock: None })
    }

    /// Ends a run of which everything is written: the link leads to it from now on. What cannot be linked is said; the run
    /// is there all the same.
    fn keep(self) {
        let Some(latest) = self.latest else { return };
        let Some((parent, name)) = self.path.parent().zip(self.path.file_name()) else { return };
        if let Err(error) = lead_to(&parent.join(latest), Path::new(name)) {
            say(&format!("warning: {} does not lead to this run: {error}", parent.join(latest).display()));
        }
    }

    /// Ends a run that failed: a number that holds nothing is given back.
    fn abandon(self) {
        if self.latest.is_some() {
            // Where something is in it, it stays.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

impl Series {
    /// Fails before a run whose files would replace others.
    ///
    /// # Errors
    /// One of them is there, and it may not be written over.
    pub fn refuse(&self, out: &Path, overwrite: bool) -> Result<(), Report> {
        let there = self.kept.iter().map(|name| out.join(name)).find(|file| file.exists());
        match there {
            Some(file) if !overwrite => Err(miette!(
                help = "name another directory with --out, leave --out away for a new one, or say --overwrite",
                "{} is there already, {}; it is not written over",
                file.display(),
                self.are
            )),
            _ => Ok(()),
        }
    }

    /// Says which of the files that are not written over unasked lie in a directory and are not of this run, which wrote
    /// `files`: see [`warn_older`].
    pub fn warn_older(&self, out: &Path, files: &[PathBuf]) {
        warn_older(out, self.kept, files);
    }

    /// Writes a run's files into its directory.
    ///
    /// # Errors
    /// Those of [`Series::refuse`] and of `write`; a directory that cannot be made.
    pub fn fill<T>(
        &self,
        out: &Path,
        overwrite: bool,
        write: impl FnOnce(&Path) -> Result<T, Report>,
    ) -> Result<T, Report> {
        self.end(out, overwrite, write, RunDirectory::keep)
    }

    /// The same for a run that came to nothing but leaves files: the link goes on leading to the last that did.
    ///
    /// # Errors
    /// Those of [`Series::fill`].
    pub fn fill_unfinished<T>(
        &self,
        out: &Path,
        overwrite: bool,
        write: impl FnOnce(&Path) -> Result<T, Report>,
    ) -> Result<T, Report> {
        self.end(out, overwrite, write, drop)
    }

    fn end<T>(
        &self,
        out: &Path,
        overwrite: bool,
        write: impl FnOnce(&Path) -> Result<T, Report>,
        keep: impl FnOnce(RunDirectory),
    ) -> Result<T, Report> {
        let directory = RunDirectory::claim(self, out, overwrite)?;
        let written = write(&directory.path);
        match &written {
            Ok(_) => keep(directory),
            Err(_) => directory.abandon(),
        }
        written
    }
}

/// Says which files of these names lie in a directory and are not among those that a run has written: an earlier run's
/// plot beside this run's would mislead. They are left there, for they may be somebody's own.
pub fn warn_older(out: &Path, names: &[impl AsRef<str>], files: &[PathBuf]) {
    let others = names.iter().map(AsRef::as_ref).filter(|name| !files.contains(&out.join(name)));
    let older: Vec<&str> = others.filter(|name| out.join(name).exists()).collect();
    if !older.is_empty() {
        say(&format!("warning: not of this run, but in {}: {}", out.display(), older.join(", ")));
    }
}

fn make(create: impl Fn() -> io::Result<()>, directory: &Path) -> Result<(), Report> {
    create().map_err(|error| cannot_be_made(directory, error))
}

fn cannot_be_made(directory: &Path, error: io::Error) -> Report {
    if is_disk_full(&error) {
        return RecordingError::io(directory, error).into();
    }
    let made: Result<(), Report> =
        Err(error).into_diagnostic().wrap_err_with(|| format!("{} cannot be made", directory.display()));
    made.err().unwrap_or_else(|| miette!("{} cannot be made", directory.display()))
}

/// Makes the directory behind the highest number. Of several processes each gets another one: a directory is made once.
fn next(parent: &Path, prefix: &str) -> io::Result<PathBuf> {
    let numbers = fs::read_dir(parent)?.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        name.strip_prefix(prefix)?.parse::<u32>().ok()
    });
    let mut number = numbers.max().unwrap_or(0);
    loop {
        number = number.checked_add(1).ok_or_else(|| io::Error::other("there is no number left"))?;
        let path = parent.join(format!("{prefix}{number:04}"));
        match fs::create_dir(&path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|()| path),
        }
    }
}

/// Replaces a symbolic link in one step: whoever follows it finds the run before or this one.
#[cfg(unix)]
fn lead_to(link: &Path, target: &Path) -> io::Result<()> {
    if fs::symlink_metadata(link).is_ok_and(|there| !there.is_symlink()) {
        return Err(io::Error::other("something else is called so"));
    }
    let directory = link.parent().unwrap_or(Path::new("."));
    let new = tempfile::Builder::new()
        .prefix(".scram-")
        .make_in(directory, |path| std::os::unix::fs::symlink(target, path))?
        .into_temp_path();
    new.persist(link).map_err(|error| error.error)
}

/// Elsewhere links to directories take rights that few users have.
#[cfg(not(unix))]
fn lead_to(_: &Path, _: &Path) -> io::Result<()> {
    Ok(())
}

/// Waits for whoever else writes into a directory. Without a file system that locks, nothing is held.
fn lock(directory: &Path) -> Option<File> {
    // Only Unix opens directories.
    let file = File::open(directory).ok()?;
    file.lock().ok()?;
    Some(file)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn of_several_at_once_each_has_a_number_of_its_own() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["run-0007", "run-x", "latest", "replay-0009"] {
            fs::create_dir(directory.path().join(name)).unwrap();
        }
        let claim = || (0..25).map(|_| next(directory.path(), "run-").unwrap()).collect::<Vec<_>>();
        let made: Vec<PathBuf> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..4).map(|_| scope.spawn(claim)).collect();
            threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
        });
        let distinct: BTreeSet<_> = made.iter().collect();
        assert_eq!((made.len(), distinct.len()), (100, 100));
        let first = directory.path().join("run-0008");
        assert!(distinct.contains(&first) && !directory.path().join("run-0001").exists(), "behind the highest");
    }

    #[cfg(unix)]
    #[test]
    fn the_link_leads_to_the_last_and_replaces_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        let link = directory.path().join(RUNS.latest);
        for name in ["run-0001", "run-0002"] {
            lead_to(&link, Path::new(name)).unwrap();
            assert_eq!(fs::read_link(&link).unwrap(), Path::new(name));
        }
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1, "no temporary link is left");
        fs::remove_file(&link).unwrap();
        fs::write(&link, "mine").unwrap();
        assert!(lead_to(&link, Path::new("run-0003")).is_err());
        assert_eq!(fs::read_to_string(&link).unwrap(), "mine");
    }
}
