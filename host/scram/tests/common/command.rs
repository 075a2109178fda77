//! The command as a person runs it: words in, exit code, text and files out.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use super::root;

/// `scram` with words, to be run in a directory; `@/` stands for the project's root.
pub fn command(directory: &Path, words: &str) -> Command {
    let place = |word: &str| word.replace("@/", &format!("{}/", root().display()));
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("scram"));
    command.args(words.split_whitespace().map(place)).current_dir(directory);
    command
}

/// Runs it to its end.
pub fn scram(directory: &Path, words: &str) -> Output {
    command(directory, words).output().unwrap()
}

/// What a command prints that must do what it is told.
#[track_caller]
pub fn succeeds(directory: &Path, words: &str) -> String {
    succeeds_saying(directory, words).0
}

/// The same, and what it says beside it.
#[track_caller]
pub fn succeeds_saying(directory: &Path, words: &str) -> (String, String) {
    let output = scram(directory, words);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{words}: {message}");
    (String::from_utf8(output.stdout).unwrap(), message)
}

/// The message of a command that must end with a code.
#[track_caller]
pub fn refuses(directory: &Path, words: &str, code: i32, says: &[&str]) -> Output {
    let output = scram(directory, words);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{words}: {message}");
    for part in says {
        assert!(message.contains(part), "{words}: `{message}` does not say `{part}`");
    }
    output
}

/// [`refuses`], having printed and written nothing.
#[track_caller]
pub fn fails(directory: &Path, words: &str, code: i32, says: &[&str]) {
    let output = refuses(directory, words, code, says);
    assert!(output.stdout.is_empty(), "{words} printed {}", String::from_utf8_lossy(&output.stdout));
    assert!(!directory.join("out").exists(), "{words} left something in out/");
}

/// A shell that runs a script with a disk of a size (`64k`) mounted on a directory, which the script finds in `TINY`; its
/// words follow. In a namespace of its own: nobody else sees the disk, and it goes with the shell. Nothing where this user
/// may not do that.
#[cfg(target_os = "linux")]
pub fn on_a_disk_of(directory: &Path, size: &str, script: &str) -> Option<Command> {
    let shell = |script: &str| {
        let mount = "mount -t tmpfs -o size=\"$SIZE\" none \"$TINY\" || exit 99";
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c", &format!("{mount}\n{script}"), "sh"]);
        command.env("TINY", directory).env("SIZE", size);
        command
    };
    shell("exit 0").status().is_ok_and(|status| status.success()).then(|| shell(script))
}

/// Runs with its stdout in a file.
pub fn to_file(directory: &Path, words: &str, stdout: std::fs::File) -> Output {
    command(directory, words).stdout(stdout).output().unwrap()
}

pub fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// What `--json` prints.
#[track_caller]
pub fn json(text: &str) -> Value {
    assert_eq!(text.trim_end().lines().count(), 1, "one object on one line");
    serde_json::from_str(text).unwrap()
}
