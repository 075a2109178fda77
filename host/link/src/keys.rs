//! The console's keys: which robots it is paired with, in a file that only its user can read.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use common::atomic::write_atomically_private;
use control::protocol::dongle::{Address, RadioKey};
use control::protocol::pairing::Pairing;
use control::protocol::secure::Key;
use miette::Diagnostic;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::words;

/// Why the keys are not to be had.
#[derive(Debug, Error, Diagnostic)]
pub enum KeysError {
    /// No place for them.
    #[error("there is no directory for the keys: neither XDG_CONFIG_HOME nor HOME is set")]
    #[diagnostic(help("name the file with --keys FILE"))]
    NoHome,
    /// Nothing there.
    #[error("no robot is paired with this computer: there is no {}", path.display())]
    #[diagnostic(help(
        "pair one, once, over its USB cable: `scram pair --port PORT --dongle PORT`; \
                       or try the simulated one: `scram console --sim`"
    ))]
    NoFile {
        /// Where they should be.
        path: PathBuf,
    },
    /// Others can read it.
    #[error("{}: others than you may read it (mode {mode:o})", path.display())]
    #[diagnostic(help("whoever has the keys can drive the robots: `chmod 600 {}`, and pair again if somebody may have \
                       read them", path.display()))]
    Exposed {
        /// Path of the file, as given.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// The system refuses.
    #[error("{}: {source}", path.display())]
    #[diagnostic(help("check the name after --keys, and that you may read and write there"))]
    Io {
        /// Path of the file, as given.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// It holds something else. What, is not said: it may be half a key.
    #[error("{}:{line}: this is no file of keys", path.display())]
    #[diagnostic(help("it is written by `scram pair`: restore it, or move it away and pair the robots again"))]
    Malformed {
        /// Path of the file, as given.
        path: PathBuf,
        /// The line of the first mistake, from 1.
        line: usize,
    },
    /// The system has no randomness.
    #[error("no keys can be made: {0}")]
    #[diagnostic(help("the operating system's random generator does not answer"))]
    Entropy(getrandom::Error),
}

/// A robot that obeys this console.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KnownRobot {
    /// Its name, from its robot file.
    pub name: String,
    /// ESP-NOW (MAC) address.
    pub address: Address,
    /// What its firmware keeps.
    pub pairing: Pairing,
}

/// Everything that a console needs to drive its robots. Its `Debug` shows no key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keys {
    /// ESP-NOW's primary master key.
    primary: Secret<16>,
    /// The robots.
    pub robots: Vec<KnownRobot>,
}

#[derive(Clone, PartialEq, Eq)]
struct Secret<const N: usize>([u8; N]);

impl<const N: usize> std::fmt::Debug for Secret<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("secret")
    }
}

/// The file, as TOML has it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    primary: String,
    #[serde(default)]
    robot: Vec<Entry>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: String,
    address: String,
    dongle: String,
    local: String,
    key: String,
}

/// Random bytes that nobody can guess.
///
/// # Errors
/// [`KeysError::Entropy`].
pub fn random<const N: usize>() -> Result<[u8; N], KeysError> {
    let mut bytes = [0; N];
    getrandom::fill(&mut bytes).map_err(KeysError::Entropy)?;
    Ok(bytes)
}

impl Keys {
    /// Where the keys are when nothing else is said: `scram/keys.toml` in the user's configuration.
    ///
    /// # Errors
    /// [`KeysError::NoHome`].
    pub fn default_path() -> Result<PathBuf, KeysError> {
        let set = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let base = set("XDG_CONFIG_HOME")
            .or_else(|| set("APPDATA"))
            .or_else(|| set("HOME").map(|home| home.join(".config")))
            .ok_or(KeysError::NoHome)?;
        Ok(base.join("scram").join("keys.toml"))
    }

    /// Keys for nobody yet.
    ///
    /// # Errors
    /// [`KeysError::Entropy`].
    pub fn generate() -> Result<Self, KeysError> {
        Ok(Self { primary: Secret(random()?), robots: Vec::new() })
    }

    /// Keys of robots that are known already, e.g. simulated ones.
    #[must_use]
    pub fn of(primary: RadioKey, robots: Vec<KnownRobot>) -> Self {
        Self { primary: Secret(primary), robots }
    }

    /// ESP-NOW's primary master key.
    #[must_use]
    pub fn primary(&self) -> RadioKey {
        self.primary.0
    }

    /// New keys for a robot; those that it had are forgotten once these are saved.
    ///
    /// # Errors
    /// [`KeysError::Entropy`].
    pub fn pair(&mut self, name: &str, address: Address, console: Address) -> Result<&KnownRobot, KeysError> {
        let pairing = Pairing { console, primary: self.primary.0, local: random()?, key: Key(random()?) };
        self.robots.retain(|robot| robot.address != address);
        self.robots.push(KnownRobot { name: name.to_owned(), address, pairing });
        Ok(&self.robots[self.robots.len() - 1])
    }

    /// Reads a file.
    ///
    /// # Errors
    /// See [`KeysError`].
    pub fn load(path: &Path) -> Result<Self, KeysError> {
        let io = |source| KeysError::Io { path: path.to_owned(), source };
        let metadata = match fs::metadata(path) {
            Ok(metadata) => metadata,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Err(KeysError::NoFile { path: path.to_owned() });
            }
            Err(error) => return Err(io(error)),
        };
        check_private(path, &metadata)?;
        let text = fs::read_to_string(path).map_err(io)?;
        // The parser's own message would quote the line, and with it a key.
        let malformed = |offset: usize| KeysError::Malformed {
            path: path.to_owned(),
            line: 1 + text[..offset.min(text.len())].matches('\n').count(),
        };
        let file: File = toml::from_str(&text).map_err(|error| malformed(error.span().map_or(0, |span| span.start)))?;
        file.read().ok_or_else(|| malformed(0))
    }

    /// Writes the file, whole or not at all, for this user alone.
    ///
    /// # Errors
    /// [`KeysError::Io`].
    pub fn save(&self, path: &Path) -> Result<(), KeysError> {
        let io = |source| KeysError::Io { path: path.to_owned(), source };
        let robot = self.robots.iter().map(|robot| Entry {
            name: robot.name.clone(),
            address: words::address(&robot.address),
            dongle: words::address(&robot.pairing.console),
            local: base16ct::lower::encode_string(&robot.pairing.local),
            key: base16ct::lower::encode_string(&robot.pairing.key.0),
        });
        let file = File { primary: base16ct::lower::encode_string(&self.primary.0), robot: robot.collect() };
        let text = toml::to_string(&file).map_err(|error| io(std::io::Error::other(error)))?;
        let text = format!("# Whoever has these keys can drive the robots. Written by `scram pair`.\n{text}");
        write_atomically_private::<std::io::Error>(path, |file| file.write_all(text.as_bytes())).map_err(io)
    }
}

impl File {
    fn read(&self) -> Option<Keys> {
        let primary = bytes(&self.primary)?;
        let robots = self.robot.iter().map(|entry| entry.read(primary));
        Some(Keys { primary: Secret(primary), robots: robots.collect::<Option<_>>()? })
    }
}

impl Entry {
    fn read(&self, primary: RadioKey) -> Option<KnownRobot> {
        let pairing = Pairing {
            console: words::parse_address(&self.dongle).ok()?,
            primary,
            local: bytes(&self.local)?,
            key: Key(bytes(&self.key)?),
        };
        Some(KnownRobot { name: self.name.clone(), address: words::parse_address(&self.address).ok()?, pairing })
    }
}

fn bytes<const N: usize>(text: &str) -> Option<[u8; N]> {
    base16ct::mixed::decode_vec(text).ok()?.try_into().ok()
}

#[cfg(unix)]
fn check_private(path: &Path, metadata: &fs::Metadata) -> Result<(), KeysError> {
    use std::os::unix::fs::PermissionsExt;
    let mode = metadata.permissions().mode() & 0o777;
    if mode & 0o077 == 0 { Ok(()) } else { Err(KeysError::Exposed { path: path.to_owned(), mode }) }
}

/// Elsewhere a user's configuration directory is closed to others by the system.
#[cfg(not(unix))]
fn check_private(_: &Path, _: &fs::Metadata) -> Result<(), KeysError> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: Address = [0x7c, 0xdf, 0xa1, 0, 0x11, 0x22];
    const DONGLE: Address = [2, 0, 0, 0, 0, 1];

    fn saved() -> (tempfile::TempDir, PathBuf, Keys) {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("below/keys.toml");
        let mut keys = Keys::generate().expect("randomness");
        keys.pair("one", ROBOT, DONGLE).expect("randomness");
        keys.save(&path).expect("writes");
        (directory, path, keys)
    }

    #[test]
    fn keys_come_back_and_a_robot_has_one_pairing() {
        let (_directory, path, mut keys) = saved();
        assert_eq!(Keys::load(&path).expect("reads"), keys);
        let before = keys.robots[0].pairing.clone();
        keys.pair("renamed", ROBOT, DONGLE).expect("randomness");
        assert_eq!(keys.robots.len(), 1);
        assert_ne!(keys.robots[0].pairing, before);
    }

    #[cfg(unix)]
    #[test]
    fn only_its_user_can_read_it_and_otherwise_it_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let (_directory, path, _) = saved();
        assert_eq!(fs::metadata(&path).expect("is there").permissions().mode() & 0o777, 0o600);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("chmod");
        assert!(matches!(Keys::load(&path), Err(KeysError::Exposed { mode: 0o640, .. })));
    }

    #[test]
    fn no_message_holds_a_key() {
        let (_directory, path, keys) = saved();
        let text = fs::read_to_string(&path).expect("reads");
        let secret = base16ct::lower::encode_string(&keys.robots[0].pairing.key.0);
        assert!(text.contains(&secret) && !format!("{keys:?}").contains(&secret));
        for broken in [text.replace(&secret, &secret[..60]), text.replace("key = \"", "key = \"\" \""), "x".repeat(9)] {
            fs::write(&path, &broken).expect("writes");
            let error = Keys::load(&path).expect_err("broken");
            let shown = format!("{:?}", miette::Report::new(error));
            assert!(shown.contains("no file of keys") && !shown.contains(&secret[..16]), "{shown}");
        }
        fs::remove_file(&path).expect("removes");
        assert!(matches!(Keys::load(&path), Err(KeysError::NoFile { .. })));
    }
}
