//! QEMU as a child, its serial port on pipes.

use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use super::{HilError, Transport};

/// The emulator.
pub const PROGRAM: &str = "qemu-system-riscv32";

/// The ESP32-C3's instruction set, and counters that tell instructions: one a nanosecond of virtual time.
const MACHINE: [&str; 15] = [
    "-M",
    "virt",
    "-cpu",
    "rv32,f=false,d=false",
    "-bios",
    "none",
    "-icount",
    "shift=0",
    "-display",
    "none",
    "-monitor",
    "none",
    "-serial",
    "stdio",
    "-kernel",
];

/// A running emulator; it is ended when this goes.
pub struct Qemu {
    child: Child,
    input: Option<ChildStdin>,
    output: Receiver<Vec<u8>>,
    /// Received and not yet asked for.
    waiting: Vec<u8>,
}

impl Qemu {
    /// Whether the emulator can be run at all.
    ///
    /// # Errors
    /// It is not on the PATH, or does not run.
    pub fn is_installed() -> Result<(), HilError> {
        let status = Command::new(PROGRAM).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.map(|_| ()).map_err(not_started)
    }

    /// Starts a program.
    ///
    /// # Errors
    /// There is no QEMU, or no such program.
    pub fn start(elf: &Path) -> Result<Self, HilError> {
        if !elf.is_file() {
            return Err(HilError::NoElf(elf.to_owned()));
        }
        let mut command = Command::new(PROGRAM);
        command.args(MACHINE).arg(elf).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(not_started)?;
        let (sender, output) = channel();
        if let Some(mut pipe) = child.stdout.take() {
            // Pipes have no timeout: a thread reads, and ends with the pipe.
            std::thread::spawn(move || {
                let mut buffer = [0; 4096];
                while let Ok(count @ 1..) = pipe.read(&mut buffer) {
                    if sender.send(buffer[..count].to_vec()).is_err() {
                        return;
                    }
                }
            });
        }
        let input = child.stdin.take();
        Ok(Self { child, input, output, waiting: Vec::new() })
    }

    /// Why the pipes have closed.
    fn ended(&mut self) -> HilError {
        let _ = self.child.kill();
        let status = self.child.wait();
        let mut output = String::new();
        if let Some(mut pipe) = self.child.stderr.take() {
            let _ = pipe.read_to_string(&mut output);
        }
        HilError::QemuEnded { why: status.map_or_else(|error| error.to_string(), meaning), output }
    }
}

fn not_started(error: std::io::Error) -> HilError {
    match error.kind() {
        ErrorKind::NotFound => HilError::NoQemu,
        _ => HilError::Spawn(error),
    }
}

/// What an exit code means; those of `firmware/pil/src/machine.rs` among them.
fn meaning(status: ExitStatus) -> String {
    match status.code() {
        Some(101) => "the program panicked".to_owned(),
        Some(102) => "the processor took a trap".to_owned(),
        Some(103) => "the program waited too long for a request".to_owned(),
        _ => status.to_string(),
    }
}

impl Transport for Qemu {
    fn send(&mut self, bytes: &[u8]) -> Result<(), HilError> {
        let sent = match &mut self.input {
            Some(input) => input.write_all(bytes).and_then(|()| input.flush()),
            None => Err(ErrorKind::BrokenPipe.into()),
        };
        sent.map_err(|_| self.ended())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, HilError> {
        if self.waiting.is_empty() {
            match self.output.recv_timeout(timeout) {
                Ok(bytes) => self.waiting = bytes,
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => return Err(self.ended()),
            }
        }
        let count = self.waiting.len().min(buffer.len());
        for (slot, byte) in buffer.iter_mut().zip(self.waiting.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
