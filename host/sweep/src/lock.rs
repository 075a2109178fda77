//! One sweep a directory at a time.

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// Why a directory is not to be had for oneself.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum LockError {
    /// Another process has it.
    #[error("a sweep is running in {}", directory.display())]
    #[diagnostic(help("wait for its end, or choose another directory with --out"))]
    Busy {
        /// Directory of the sweep.
        directory: PathBuf,
    },
    /// The file system has no locks, or refuses.
    #[error("{} cannot be locked: {error}", directory.display())]
    #[diagnostic(help("run one sweep at a time there"))]
    Unavailable {
        /// Directory of the sweep.
        directory: PathBuf,
        /// Error of the operating system.
        error: io::Error,
    },
}

/// A directory that no other sweep may write into while this lives. The operating system gives it back however the
/// process ends.
#[derive(Debug)]
pub struct Lock {
    /// Locked as long as it is open.
    _open: File,
}

impl Lock {
    /// Of a directory that is there.
    ///
    /// # Errors
    /// Another sweep is at work there, or the system has no locks for it.
    pub fn take(directory: &Path) -> Result<Self, LockError> {
        let unavailable = |error| LockError::Unavailable { directory: directory.into(), error };
        let open = open(directory).map_err(unavailable)?;
        match open.try_lock() {
            Ok(()) => Ok(Self { _open: open }),
            Err(TryLockError::WouldBlock) => Err(LockError::Busy { directory: directory.into() }),
            Err(TryLockError::Error(error)) => Err(unavailable(error)),
        }
    }
}

/// The directory itself: nothing is left in it.
#[cfg(unix)]
fn open(directory: &Path) -> io::Result<File> {
    File::open(directory)
}

/// Where directories cannot be locked, a file in it.
#[cfg(not(unix))]
fn open(directory: &Path) -> io::Result<File> {
    File::options().create(true).write(true).truncate(false).open(directory.join(".sweep.lock"))
}
