//! The file under a recording that grows: whole records are collected here and handed to the operating system together.

use std::fs::File;
use std::io::{self, Write};

/// Collects what is written until [`Sink::flush`]; after a failed write it takes nothing any more, because half a record
/// may be in the file and nothing readable can follow it.
pub(super) struct Sink {
    file: File,
    waiting: Vec<u8>,
    failed: bool,
}

impl Sink {
    pub(super) fn new(file: File) -> Self {
        Self { file, waiting: Vec::new(), failed: false }
    }

    /// To the disk itself.
    pub(super) fn sync(&mut self) -> io::Result<()> {
        self.flush()?;
        self.file.sync_all()
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failed {
            return Err(io::Error::other("an earlier write failed"));
        }
        self.waiting.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.failed {
            return Err(io::Error::other("an earlier write failed"));
        }
        let written = self.file.write_all(&self.waiting);
        self.failed = written.is_err();
        self.waiting.clear();
        written
    }
}

impl Drop for Sink {
    /// A recorder that is dropped without its end (a panic) keeps what it was given.
    fn drop(&mut self) {
        if !self.failed {
            let _ = self.flush();
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn nothing_follows_half_a_record() {
        let mut sink = Sink::new(File::options().write(true).open("/dev/full").unwrap());
        sink.write_all(b"one").unwrap();
        assert_eq!(sink.flush().unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert!(sink.write_all(b"two").is_err() && sink.flush().is_err());
    }
}
