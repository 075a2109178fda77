//! A file for decoders that read files: in memory where the system has such a place, gone when it is dropped.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

const MEMORY: &str = "/dev/shm";

/// A directory with nothing but what is put there.
pub struct Scratch(TempDir);

impl Scratch {
    pub fn new() -> Self {
        let place = Path::new(MEMORY);
        let place = if place.is_dir() { place.to_owned() } else { std::env::temp_dir() };
        Self(tempfile::Builder::new().prefix("scram-fuzz-").tempdir_in(place).expect("a directory for temporary files"))
    }

    /// Writes a file that only its user can read.
    pub fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        use std::io::Write;
        let path = self.0.path().join(name);
        let mut options = std::fs::OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        options.open(&path).and_then(|mut file| file.write_all(bytes)).expect("a temporary file");
        path
    }
}
