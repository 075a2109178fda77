//! Files that are whole or not there: the one place where outputs are written.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

/// Writes a file through a temporary one in the same directory and renames it when everything is on disk: a crash, a
/// full disk or an error of `fill` leaves what was there before. Missing directories are made. On Unix the new name is on
/// disk, too, when this returns: a power cut afterwards does not bring the old file back.
///
/// A link stays one: what it leads to is replaced. A device, a pipe, a socket or an open file of a process
/// (`/dev/stdout`) is not replaced but written into, after `fill` is done.
///
/// # Errors
/// Whatever the file system or `fill` says.
pub fn write_atomically<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), E>,
) -> Result<(), E> {
    // What a plain create would give; the process's umask still applies.
    write_with_mode(path, 0o666, fill)
}

/// [`write_atomically`], and on Unix only the user can read the file, from its beginning on.
///
/// # Errors
/// Whatever the file system or `fill` says.
pub fn write_atomically_private<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), E>,
) -> Result<(), E> {
    write_with_mode(path, 0o600, fill)
}

/// Removes the file that a name leads to, if there is one: a link to it stays, and so does a device or a pipe.
///
/// # Errors
/// Whatever the file system says.
pub fn remove(path: &Path) -> io::Result<()> {
    match place(path)? {
        Place::Stream(_) => Ok(()),
        Place::File(file) => match fs::remove_file(file) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            done => done,
        },
    }
}

fn write_with_mode<E: From<io::Error>>(
    path: &Path,
    mode: u32,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), E>,
) -> Result<(), E> {
    match place(path)? {
        Place::File(file) => replace(&file, mode, fill, &mut sync_directory),
        Place::Stream(stream) => pass_on(&stream, fill),
    }
}

/// What a name leads to.
enum Place {
    /// A file, or where one will be: no link any more.
    File(PathBuf),
    /// Something that is opened and written into.
    Stream(PathBuf),
}

fn place(path: &Path) -> io::Result<Place> {
    // Also says so where links go in a circle.
    let is_stream = match fs::metadata(path) {
        Ok(there) => !there.is_file() && !there.is_dir(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => false,
        Err(error) => return Err(error),
    };
    let mut at = path.to_owned();
    loop {
        if is_descriptor(&at) {
            return Ok(Place::Stream(at));
        }
        match fs::read_link(&at) {
            Ok(target) => at = directory(&at).join(target),
            Err(_) => return Ok(if is_stream { Place::Stream(at) } else { Place::File(at) }),
        }
    }
}

/// Where systems keep links to the open files of processes. Those look like links to files, but the file has a place to
/// write at, and may have no name any more.
const DESCRIPTORS: [&str; 2] = ["/proc", "/dev/fd"];
/// Of these, where this process's own are.
const OWN_DESCRIPTORS: [&str; 2] = ["/proc/self/fd", "/dev/fd"];

fn is_descriptor(path: &Path) -> bool {
    let directory = fs::canonicalize(directory(path));
    directory.is_ok_and(|directory| DESCRIPTORS.iter().any(|known| directory.starts_with(known)))
}

fn directory(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn replace<E: From<io::Error>>(
    path: &Path,
    mode: u32,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), E>,
    sync: &mut dyn FnMut(&Path) -> io::Result<()>,
) -> Result<(), E> {
    let directory = directory(path);
    let changed = make(directory)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".scram-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    let mut file = builder.tempfile_in(directory)?;
    fill_file(file.as_file_mut(), fill)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(changed.iter().try_for_each(|directory| sync(directory))?)
}

/// Makes a directory where there is none. Every directory that a name in it needs on disk: itself, those that were made
/// on the way, and the one in which they were.
fn make(directory: &Path) -> io::Result<Vec<PathBuf>> {
    let mut changed = Vec::new();
    for at in directory.ancestors() {
        let at = if at.as_os_str().is_empty() { Path::new(".") } else { at };
        changed.push(at.to_owned());
        if at.exists() {
            break;
        }
    }
    fs::create_dir_all(directory)?;
    Ok(changed)
}

/// Waits until the names in a directory are on disk: on Unix a file that was synced may still have no name after a power
/// cut. Elsewhere, in a directory that may not be read, and on a file system that cannot do it, this does nothing.
///
/// # Errors
/// Whatever the file system says, such as that the disk is full or gone.
pub fn sync_directory(directory: &Path) -> io::Result<()> {
    #[cfg(unix)]
    {
        use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
        let synced = File::open(directory).and_then(|directory| directory.sync_all());
        match synced {
            Err(error) if matches!(error.kind(), InvalidInput | PermissionDenied | Unsupported) => Ok(()),
            synced => synced,
        }
    }
    #[cfg(not(unix))]
    {
        let _ = directory;
        Ok(())
    }
}

/// By way of a file without a name: formats go back in what they have written, which a pipe cannot.
fn pass_on<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), E>,
) -> Result<(), E> {
    let mut file = tempfile::tempfile()?;
    fill_file(&mut file, fill)?;
    file.rewind()?;
    let mut stream = open_stream(path)?;
    io::copy(&mut file, &mut stream)?;
    stream.flush()?;
    Ok(())
}

fn fill_file<E: From<io::Error>>(
    file: &mut File,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), E>,
) -> Result<(), E> {
    let mut buffered = BufWriter::new(file);
    fill(&mut buffered)?;
    Ok(buffered.flush()?)
}

fn open_stream(path: &Path) -> io::Result<Box<dyn Write>> {
    let here = fs::canonicalize(directory(path))?;
    let own = OWN_DESCRIPTORS.iter().any(|own| fs::canonicalize(own).is_ok_and(|own| own == here));
    match path.file_name().and_then(|name| name.to_str()) {
        // Opened anew, a file behind them would be written from its beginning on.
        Some("1") if own => return Ok(Box::new(io::stdout())),
        Some("2") if own => return Ok(Box::new(io::stderr())),
        _ => {}
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if fs::metadata(path)?.file_type().is_socket() {
            return Ok(Box::new(std::os::unix::net::UnixStream::connect(path)?));
        }
    }
    Ok(Box::new(File::options().append(true).open(path)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn write(path: &Path, text: &str) -> io::Result<()> {
        write_atomically(path, |file| file.write_all(text.as_bytes()))
    }

    #[test]
    fn an_error_half_way_leaves_what_was_there() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("new/run.csv");
        write(&path, "whole").unwrap();
        let failed = write_atomically::<io::Error>(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "no temporary file is left");
    }

    #[test]
    fn the_new_name_is_on_disk_before_anybody_hears_that_it_is_done() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("new/newer/run.csv");
        let mut synced = Vec::new();
        let fill = |file: &mut BufWriter<&mut File>| file.write_all(b"whole");
        replace::<io::Error>(&path, 0o666, fill, &mut |at| {
            assert_eq!(fs::read(&path).unwrap(), b"whole", "synced before it has its name");
            synced.push(at.to_owned());
            sync_directory(at)
        })
        .unwrap();
        let at = |name: &str| directory.path().join(name);
        assert_eq!(synced, [at("new/newer"), at("new"), directory.path().to_owned()]);
        // Where the directory was there already, it alone has changed.
        synced.clear();
        replace::<io::Error>(&path, 0o666, fill, &mut |at| {
            synced.push(at.to_owned());
            Ok(())
        })
        .unwrap();
        assert_eq!(synced, [at("new/newer")]);
        let failed = replace::<io::Error>(&path, 0o666, fill, &mut |_| Err(io::ErrorKind::StorageFull.into()));
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
    }

    #[test]
    fn a_directory_can_be_synced_and_one_that_is_gone_cannot() {
        let directory = tempfile::tempdir().unwrap();
        sync_directory(directory.path()).unwrap();
        if cfg!(unix) {
            assert_eq!(sync_directory(&directory.path().join("gone")).unwrap_err().kind(), io::ErrorKind::NotFound);
        }
    }
}

/// What only Unix has.
#[cfg(all(test, unix))]
mod unix_tests {
    use std::io::Read;
    use std::os::unix::fs::{FileTypeExt, symlink};
    use std::process::Command;

    use super::tests::write;
    use super::*;

    /// A node of a kind that `mknod` makes: `p`, or `c 1 7`, the device that is always full.
    fn node(path: &Path, kind: &str) -> bool {
        let made = Command::new("mknod").arg(path).args(kind.split(' ')).output();
        made.is_ok_and(|made| made.status.success())
    }

    #[test]
    fn a_link_stays_one_and_what_it_leads_to_is_replaced() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::create_dir(at("far")).unwrap();
        fs::write(at("far/file"), "before").unwrap();
        // Relative to the link's own directory, by way of another link.
        symlink("far/second", at("first")).unwrap();
        symlink("file", at("far/second")).unwrap();
        symlink("far/none", at("dangling")).unwrap();
        write(&at("first"), "after").unwrap();
        write(&at("dangling"), "new").unwrap();
        for link in ["first", "far/second", "dangling"] {
            assert!(at(link).is_symlink(), "{link}");
        }
        assert!(!at("far/file").is_symlink());
        assert_eq!(fs::read_to_string(at("far/file")).unwrap(), "after");
        assert_eq!(fs::read_to_string(at("far/none")).unwrap(), "new");
        assert_eq!(fs::read_dir(at("far")).unwrap().count(), 3, "no temporary file is left");
        symlink("circle", at("circle")).unwrap();
        assert!(write(&at("circle"), "nowhere").is_err());
        assert!(at("circle").is_symlink());
    }

    #[test]
    fn what_is_removed_is_the_file_and_not_the_link() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::write(at("file"), "").unwrap();
        symlink("file", at("link")).unwrap();
        remove(&at("link")).unwrap();
        assert!(at("link").is_symlink() && !at("file").exists());
        remove(&at("link")).unwrap();
        assert!(node(&at("pipe"), "p"));
        remove(&at("pipe")).unwrap();
        assert!(at("pipe").exists());
    }

    #[test]
    fn a_pipe_is_written_into_whole_or_not_at_all() {
        let directory = tempfile::tempdir().unwrap();
        let pipe = directory.path().join("pipe");
        assert!(node(&pipe, "p"));
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read_to_string(pipe)
        });
        let failed = write_atomically::<io::Error>(&pipe, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.is_err());
        write_atomically::<io::Error>(&pipe, |w| {
            w.write_all(b"before")?;
            // As a format does whose beginning tells its length.
            w.rewind()?;
            w.write_all(b"after!")
        })
        .unwrap();
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        assert_eq!(reader.join().unwrap().unwrap(), "after!");
    }

    #[test]
    fn a_socket_is_written_into() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("socket");
        let listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
        write(&path, "said").unwrap();
        // What has not come by now never will.
        listener.set_nonblocking(true).unwrap();
        let mut heard = String::new();
        listener.accept().unwrap().0.read_to_string(&mut heard).unwrap();
        assert_eq!(heard, "said");
        assert!(fs::metadata(&path).unwrap().file_type().is_socket());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_says_so_and_stays_a_device() {
        let directory = tempfile::tempdir().unwrap();
        // A node of our own where that is allowed: only who may make one can lose the system's.
        let own = directory.path().join("full");
        let usable = node(&own, "c 1 7") && File::options().append(true).open(&own).is_ok();
        let full = if usable { own } else { "/dev/full".into() };
        let link = directory.path().join("link");
        symlink(&full, &link).unwrap();
        for name in [&full, &link] {
            assert_eq!(write(name, "more").unwrap_err().kind(), io::ErrorKind::StorageFull, "{}", name.display());
            assert!(fs::metadata(name).unwrap().file_type().is_char_device(), "{}", name.display());
        }
        assert!(link.is_symlink());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_a_process_has_open_is_written_on() {
        use std::os::fd::AsRawFd;
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("open");
        let mut open = File::options().create_new(true).append(true).open(&path).unwrap();
        open.write_all(b"one ").unwrap();
        write(Path::new(&format!("/proc/self/fd/{}", open.as_raw_fd())), "two ").unwrap();
        open.write_all(b"three").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "one two three");
    }
}
