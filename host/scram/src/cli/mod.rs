//! The command line: one file per subcommand. Results go to stdout, progress and messages to stderr.

mod bring_up;
mod calibrate;
mod completions;
mod console;
mod design;
mod design_experiment;
mod diagnose;
mod diagnose_walk;
mod export;
mod hil;
mod identify;
mod import;
mod learn;
mod measured;
mod new_rig;
mod on_chip;
mod pair;
mod push;
mod replay;
mod run_directory;
mod runs;
mod settings;
mod sim;
mod simulated;
mod sweep;
mod table;
mod then_run;
mod view;
mod walk;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::OnceLock;

use clap::{Args, Parser, Subcommand};
use common::atomic::write_atomically;
use miette::{IntoDiagnostic, Report, WrapErr, miette};
use recording::{Loaded, ReadOptions, RecordingError, does_not_fit, is_disk_full, load_with, require_same_rig};
use robot_file::Robot;
use robot_file::edit::Document;

/// Simulates, designs, identifies and diagnoses a miniature robot with one actuator.
#[derive(Parser)]
#[command(name = "scram", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Sub,
}

#[derive(Subcommand)]
enum Sub {
    Sim(sim::Sim),
    Hil(hil::Hil),
    Design(design::Design),
    DesignExperiment(design_experiment::DesignExperiment),
    #[command(subcommand)]
    Identify(identify::Identify),
    Pair(pair::Pair),
    BringUp(bring_up::BringUp),
    Calibrate(calibrate::Calibrate),
    Console(console::Console),
    Diagnose(diagnose::Diagnose),
    Import(import::Import),
    NewRig(Box<new_rig::NewRig>),
    Completions(completions::Completions),
    #[command(subcommand)]
    Learn(learn::Learn),
    Replay(replay::Replay),
    View(view::View),
    Sweep(sweep::Sweep),
    #[command(subcommand)]
    Export(export::Export),
}

/// What every subcommand takes.
#[derive(Args)]
struct Common {
    /// The robot file
    #[arg(long, value_name = "FILE", default_value = "robot.toml")]
    robot: PathBuf,
    /// Directory for what is written
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One JSON object on stdout instead of a table
    #[arg(long)]
    json: bool,
}

/// Why a command ends without success.
enum Failure {
    /// The command line is wrong: exit code 2.
    Usage(Report),
    /// It could not be done: exit code 1.
    Failed(Report),
}

impl From<Report> for Failure {
    fn from(report: Report) -> Self {
        Self::Failed(report)
    }
}

type Done = Result<(), Failure>;

/// Parses the command line and runs it.
pub fn run() -> ExitCode {
    // Messages are not folded: a path or a number broken over two lines cannot be searched for.
    let _ = miette::set_hook(Box::new(|_| {
        Box::new(miette::MietteHandlerOpts::new().wrap_lines(false).break_words(false).build())
    }));
    let cli = Cli::parse();
    let done = match cli.command {
        Sub::Sim(command) => command.run(),
        Sub::Hil(command) => command.run(),
        Sub::Design(command) => command.run(),
        Sub::DesignExperiment(command) => command.run(),
        Sub::Identify(command) => command.run(),
        Sub::Pair(command) => command.run(),
        Sub::BringUp(command) => command.run(),
        Sub::Calibrate(command) => command.run(),
        Sub::Console(command) => match command.run() {
            Ok(code) if code == ExitCode::SUCCESS => Ok(()),
            Ok(code) => return code,
            Err(failure) => Err(failure),
        },
        Sub::Diagnose(command) => command.run(),
        Sub::Import(command) => command.run(),
        Sub::NewRig(command) => match command.run() {
            Ok(code) if code == ExitCode::SUCCESS => Ok(()),
            Ok(code) => return code,
            Err(failure) => Err(failure),
        },
        Sub::Completions(command) => command.run(),
        Sub::Learn(command) => command.run(),
        Sub::Replay(command) => command.run(),
        Sub::View(command) => match command.run() {
            Ok(code) if code == ExitCode::SUCCESS => Ok(()),
            Ok(code) => return code,
            Err(failure) => Err(failure),
        },
        Sub::Sweep(command) => command.run(),
        Sub::Export(command) => command.run(),
    };
    match done.and_then(|()| lost_output().map_or(Ok(()), |lost| Err(lost.into()))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Usage(report)) => {
            say(&format!("{report:?}"));
            ExitCode::from(2)
        }
        Err(Failure::Failed(report)) => {
            say(&format!("{report:?}"));
            ExitCode::FAILURE
        }
    }
}

impl Common {
    /// Reads the robot file.
    fn robot(&self) -> Result<Robot, Report> {
        load_robot(&self.robot)
    }

    /// Reads a recording of this robot; what a person should know goes to stderr.
    fn recording(&self, path: &Path, robot: &Robot, options: &ReadOptions) -> Result<Loaded, Report> {
        let loaded = load_with(path, options)?;
        for note in &loaded.notes {
            say(&format!("{}: {note}", path.display()));
        }
        require_same_rig(&loaded, robot)?;
        Ok(loaded)
    }

    /// Writes the changed robot file, never over the one that was read.
    fn save(&self, document: &Document, file: &Path) -> Result<(), Report> {
        self.keeps_robot_file(file)?;
        Ok(document.save(file)?)
    }

    /// Fails if writing a file would replace the robot file that was read.
    fn keeps_robot_file(&self, file: &Path) -> Result<(), Report> {
        if same_file(file, &self.robot) {
            return Err(miette!(
                help = "choose another directory with --out",
                "{} is the robot file that was read; it is not written over",
                file.display()
            ));
        }
        Ok(())
    }

    /// Writes a text into `--out`, whole or not at all.
    fn write(&self, name: &str, text: &str) -> Result<PathBuf, Report> {
        let path = self.out.join(name);
        write(&path, text)?;
        Ok(path)
    }
}

/// Writes a text, whole or not at all.
fn write(path: &Path, text: &str) -> Result<(), Report> {
    match write_atomically::<std::io::Error>(path, |w| std::io::Write::write_all(w, text.as_bytes())) {
        Err(error) if does_not_fit(&error) => Err(RecordingError::io(path, error).into()),
        written => written.into_diagnostic().wrap_err_with(|| format!("{} cannot be written", path.display())),
    }
}

/// Reads a robot file.
fn load_robot(path: &Path) -> Result<Robot, Report> {
    if !path.exists() {
        return Err(miette!(
            help = "run scram in the project's root, where robot.toml lies, or name one with --robot FILE \
                    (variants are in robots/)",
            "there is no robot file {}",
            path.display()
        ));
    }
    Ok(Robot::load(path)?)
}

/// Whether two paths name one file that exists.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// What came of writing to stdout, the first time that it failed.
static STDOUT: OnceLock<std::io::Error> = OnceLock::new();

/// Prints to stdout. A reader that has gone away (`| head`) is no error; whatever else loses what was printed, as a full
/// disk does, ends the command with exit code 1.
fn print(text: &str) {
    use std::io::Write;
    let mut stdout = std::io::stdout();
    keep_failure(writeln!(stdout, "{text}").and_then(|()| stdout.flush()));
}

/// Remembers that something that goes to stdout is lost.
fn keep_failure(written: std::io::Result<()>) {
    if let Err(error) = written
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        let _ = STDOUT.set(error);
    }
}

/// Why not all of the output has arrived, if so.
fn lost_output() -> Option<Report> {
    let error = STDOUT.get()?;
    let why = if is_disk_full(error) { "the disk is full".to_owned() } else { error.to_string() };
    Some(miette!(help = "what stdout leads to is not complete: write it elsewhere", "stdout: {why}"))
}

/// Says something on stderr. A terminal that is gone is no error: whatever it ended goes on to its orderly end.
fn say(text: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// A question on stderr, which an answer follows on the same line.
fn ask(text: &str) {
    use std::io::Write;
    let _ = write!(std::io::stderr(), "{text}");
}

/// Prints one JSON object to stdout.
fn print_json(value: &impl serde::Serialize) -> Result<(), Report> {
    print(&serde_json::to_string(value).into_diagnostic()?);
    Ok(())
}
