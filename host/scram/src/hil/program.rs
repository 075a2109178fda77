//! The program that QEMU runs.

use std::io::{self, IsTerminal, Read, Write};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use super::HilError;

/// Builds the program from `firmware/pil`, in the project's folder; where it is. What cargo has to say goes to stderr.
///
/// # Errors
/// It does not build, or this is not the project's folder.
pub fn build_program() -> Result<PathBuf, HilError> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["run", "--quiet", "--package", "xtask", "--", "build-pil"]).stdin(Stdio::null());
    // On a terminal cargo draws how far it is.
    let output = if io::stderr().is_terminal() {
        cargo.stderr(Stdio::inherit()).output()
    } else {
        output_with_messages(&mut cargo, &mut io::stderr())
    };
    let output = output.map_err(|error| HilError::Build(error.to_string()))?;
    let printed = String::from_utf8_lossy(&output.stdout);
    match printed.lines().last() {
        Some(path) if output.status.success() => Ok(PathBuf::from(path)),
        _ => Err(HilError::Build(output.status.to_string())),
    }
}

/// Runs a command to its end and passes on what it says on its stderr while it says it. With a stderr whose reader has gone
/// away cargo would end with an error; behind a pipe of ours it does not notice.
fn output_with_messages(command: &mut Command, messages: &mut impl Write) -> io::Result<Output> {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    // Read beside stderr: of two full pipes the one that nobody reads would stop the command.
    let printed = std::thread::spawn(move || {
        let mut printed = Vec::new();
        stdout.map_or(Ok(0), |mut pipe| pipe.read_to_end(&mut printed)).map(|_| printed)
    });
    if let Some(mut pipe) = stderr {
        let mut buffer = [0; 4096];
        while let count @ 1.. = pipe.read(&mut buffer)? {
            // Nobody is left to be told that nobody listens.
            let _ = messages.write_all(&buffer[..count]).and_then(|()| messages.flush());
        }
    }
    let stdout = printed.join().unwrap_or_else(|_| Err(io::Error::other("its output was not read")))?;
    Ok(Output { status: child.wait()?, stdout, stderr: Vec::new() })
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// More than a pipe holds.
    const TALK: &str = "i=0; while [ $i -lt 3000 ]; do echo 'message of a build, one of many' >&2; echo line; \
                        i=$((i+1)); done; echo path; exit 3";

    fn talk(messages: &mut impl Write) -> Output {
        output_with_messages(Command::new("sh").args(["-c", TALK]), messages).unwrap()
    }

    #[test]
    fn what_is_built_does_not_notice_that_nobody_reads_its_messages() {
        let (reader, mut writer) = io::pipe().unwrap();
        drop(reader);
        let output = talk(&mut writer);
        assert!(output.stdout.ends_with(b"line\npath\n"));
        assert_eq!(output.status.code(), Some(3));
    }

    #[test]
    fn messages_are_passed_on_whole() {
        let mut messages = Vec::new();
        let output = talk(&mut messages);
        assert_eq!(messages.len(), 3000 * "message of a build, one of many\n".len());
        assert_eq!(output.stdout.len(), 3000 * "line\n".len() + "path\n".len());
    }
}
