//! How far the reading of a file has come, for whoever shows it.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Begins to watch the reading of a file, of which it is given the path and the length in bytes. What it returns is called
/// with the bytes that are read so far, and dropped when the reading ends, with or without an error.
pub type Progress = fn(&Path, u64) -> Box<dyn FnMut(u64)>;

/// A file whose reading is watched.
pub(super) struct Watched {
    file: File,
    watch: Option<Box<dyn FnMut(u64)>>,
    read: u64,
}

impl Read for Watched {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.read += count as u64;
        if let Some(watch) = &mut self.watch {
            watch(self.read);
        }
        Ok(count)
    }
}

/// Opens a file to be read from its beginning.
pub(super) fn open(path: &Path, progress: Option<Progress>) -> io::Result<Watched> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    Ok(Watched { file, watch: progress.map(|begin| begin(path, length)), read: 0 })
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};

    use super::*;

    thread_local! {
        static SEEN: RefCell<Vec<u64>> = const { RefCell::new(Vec::new()) };
        static ENDED: Cell<bool> = const { Cell::new(false) };
    }

    struct End;
    impl Drop for End {
        fn drop(&mut self) {
            ENDED.set(true);
        }
    }

    fn begin(_: &Path, length: u64) -> Box<dyn FnMut(u64)> {
        SEEN.with_borrow_mut(|seen| seen.push(length));
        let end = End;
        Box::new(move |read| {
            let _ = &end;
            SEEN.with_borrow_mut(|seen| seen.push(read));
        })
    }

    #[test]
    fn the_watcher_sees_the_length_each_read_and_the_end() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        std::fs::write(&path, [0; 10]).unwrap();
        let mut file = open(&path, Some(begin)).unwrap();
        let mut buffer = [0; 7];
        while file.read(&mut buffer).unwrap() > 0 {}
        assert!(!ENDED.get());
        drop(file);
        assert!(ENDED.get());
        assert_eq!(SEEN.take(), [10, 7, 10, 10]);
    }
}
