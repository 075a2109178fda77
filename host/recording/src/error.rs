//! What can be wrong with a recording, said so that a person can mend it.

use std::path::{Path, PathBuf};

/// Where in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Path of the file, as given.
    pub path: PathBuf,
    /// The row within it.
    pub row: RowNumber,
}

/// A row, as the kind of file counts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowNumber {
    /// Line of a text file, from 1.
    Line(u64),
    /// Message of an MCAP file, from 1.
    Message(u64),
    /// Entry of a list, from 1.
    Entry(u64),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.row {
            RowNumber::Line(line) => write!(f, "{}, line {line}", self.path.display()),
            RowNumber::Message(message) => write!(f, "{}, message {message}", self.path.display()),
            RowNumber::Entry(entry) => write!(f, "{}, entry {entry}", self.path.display()),
        }
    }
}

/// Why a recording could not be read or written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum RecordingError {
    /// The operating system refused.
    #[error("{path}: {source}", path = path.display())]
    #[diagnostic(help("check the name and the permissions"))]
    Io {
        /// Path of the file, as given.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// Neither CSV nor MCAP.
    #[error("{}: a recording's name ends with .csv or .mcap", path.display())]
    #[diagnostic(help("docs/recordings.md describes both formats"))]
    UnknownKind {
        /// Path of the file, as given.
        path: PathBuf,
    },
    /// A file of 0 bytes, or without a header line.
    #[error("{}: the file is empty", path.display())]
    #[diagnostic(help(
        "a recording has one header line and one line a sample, e.g. `t_s,duty,angle_rad`; see docs/recordings.md"
    ))]
    Empty {
        /// Path of the file, as given.
        path: PathBuf,
    },
    /// A header and nothing else.
    #[error("{}: there is a header and no sample", path.display())]
    #[diagnostic(help("was the recorder stopped before its first sample? Record the run again"))]
    NoSamples {
        /// Path of the file, as given.
        path: PathBuf,
    },
    /// Fewer samples than the use needs.
    #[error("{}: {samples} sample(s), at least {needed} are needed", path.display())]
    #[diagnostic(help("a run of some seconds at 1 kHz is what the commands are made for"))]
    TooShort {
        /// Path of the file, as given.
        path: PathBuf,
        /// How many there are.
        samples: usize,
        /// How many are needed.
        needed: usize,
    },
    /// Columns that every recording has are not there.
    #[error("{}: no column {needed}; there is {found}", path.display())]
    #[diagnostic(help(
        "needed are `t_s`, `duty` or `voltage_v`, and `angle_rad` or `adc`, spelled so in the header line"
    ))]
    MissingColumns {
        /// Path of the file, as given.
        path: PathBuf,
        /// What is needed and not there.
        needed: String,
        /// Header or content that was found.
        found: String,
    },
    /// Two columns that say the same thing.
    #[error("{}: both `{first}` and `{second}`, which say the same thing twice", path.display())]
    #[diagnostic(help("keep the one that was measured and delete the other"))]
    Conflict {
        /// Path of the file, as given.
        path: PathBuf,
        /// Name of the first column.
        first: &'static str,
        /// Name of the column that contradicts it.
        second: &'static str,
    },
    /// A column that occurs twice.
    #[error("{}: column `{column}` occurs twice in the header", path.display())]
    #[diagnostic(help("rename or delete one of the two"))]
    Duplicate {
        /// Path of the file, as given.
        path: PathBuf,
        /// Name of the column.
        column: String,
    },
    /// One cell is wrong.
    #[error("{place}, column `{column}`: {problem}")]
    #[diagnostic(help("{help}"))]
    Cell {
        /// File and row.
        place: Place,
        /// Name of the column.
        column: String,
        /// What is wrong and what was expected.
        problem: String,
        /// Advice: what to change, where.
        help: String,
    },
    /// A whole row is wrong.
    #[error("{place}: {problem}")]
    #[diagnostic(help("{help}"))]
    RowNumber {
        /// File and row.
        place: Place,
        /// What is wrong and what was expected.
        problem: String,
        /// Advice: what to change, where.
        help: String,
    },
    /// The file as a whole is not what its name says.
    #[error("{}: {problem}", path.display())]
    #[diagnostic(help("{help}"))]
    Format {
        /// Path of the file, as given.
        path: PathBuf,
        /// What is wrong and what was expected.
        problem: String,
        /// Advice: what to change, where.
        help: String,
    },
    /// A recording is never written over.
    #[error("{}: there is such a file already", path.display())]
    #[diagnostic(help("a recording is never written over: choose another name"))]
    Exists {
        /// Path of the file, as given.
        path: PathBuf,
    },
    /// There is no room for it.
    #[error("{}: the disk is full: {kept}", path.display())]
    #[diagnostic(help("make room on the disk, or choose another one with --out"))]
    DiskFull {
        /// Path of the file, as given.
        path: PathBuf,
        /// What there is of it.
        kept: Left,
    },
    /// There is room, but not for so large a file.
    #[error("{}: the file is larger than it may be here: {kept}", path.display())]
    #[diagnostic(help(
        "a limit of this shell (`ulimit -f`) or of the file system (4 GiB on FAT) is reached: raise it, choose another \
         directory with --out, or make a shorter run"
    ))]
    TooLarge {
        /// Path of the file, as given.
        path: PathBuf,
        /// What there is of it.
        kept: Left,
    },
    /// A recording that grew cannot go on.
    #[error("{}: the recording has stopped: {why}", path.display())]
    #[diagnostic(help("what was recorded until then is readable; begin a new recording once that is mended"))]
    Stopped {
        /// Path of the file, as given.
        path: PathBuf,
        /// What the operating system said.
        why: String,
    },
    /// Several robots, and none was chosen.
    #[error("{}: this session has several robots: {}", path.display(), names.join(", "))]
    #[diagnostic(help("choose one by its name: --robot-name NAME, in Python robot=NAME"))]
    SeveralRobots {
        /// Path of the file, as given.
        path: PathBuf,
        /// Those with samples.
        names: Vec<String>,
    },
    /// Not the robot that was asked for.
    #[error("{}: no samples of a robot `{wanted}`; there is {}", path.display(), names.join(", "))]
    #[diagnostic(help("names are spelled as in the recording's topics"))]
    NoSuchRobot {
        /// Path of the file, as given.
        path: PathBuf,
        /// Who was asked for.
        wanted: String,
        /// Those with samples.
        names: Vec<String>,
    },
    /// The recording is of a rig that the robot file does not describe.
    #[error("{}: {problem}", path.display())]
    #[diagnostic(help("{help}"))]
    OtherRig {
        /// The recording.
        path: PathBuf,
        /// How the two disagree.
        problem: String,
        /// Advice: what to change, where.
        help: String,
    },
}

/// What a full disk has left of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// It is written whole or not at all.
    Before,
    /// Rows were added before the first.
    Beginning,
}

impl std::fmt::Display for Left {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Before => "nothing of it is kept, and what was there before is as it was",
            Self::Beginning => "what was recorded until then is kept and can be read, nothing after it is",
        })
    }
}

/// Whether there is no room left, on the disk or for this user.
#[must_use]
pub fn is_disk_full(error: &std::io::Error) -> bool {
    matches!(error.kind(), std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded)
}

/// Whether a file does not fit: no room is left, or it would be larger than a file may be.
#[must_use]
pub fn does_not_fit(error: &std::io::Error) -> bool {
    is_disk_full(error) || error.kind() == std::io::ErrorKind::FileTooLarge
}

impl RecordingError {
    /// Why a file that is whole or not there could not be read or written.
    #[must_use]
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        if is_disk_full(&source) {
            return Self::DiskFull { path, kept: Left::Before };
        }
        if does_not_fit(&source) {
            return Self::TooLarge { path, kept: Left::Before };
        }
        Self::Io { path, source }
    }
}
