//! Every decoder on seeded inputs, without libFuzzer: in the ordinary tests for some seconds, and for a minute as
//! `cargo fuzz-minute`. Longer, and led by what the inputs reach: `fuzz/README.md`.

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use fuzz_cases::Target;

mod mutate;
pub mod watch;

use mutate::Inputs;

/// Longest that an input may take.
pub const HANG: Duration = Duration::from_secs(5);

/// When a target has been run enough.
#[derive(Clone, Copy, Debug)]
pub enum Until {
    /// Ends after this number of inputs beside the corpus.
    Inputs(u64),
    /// Ends after this time.
    Time(Duration),
}

/// What a target did.
#[derive(Clone, Debug)]
pub struct Report {
    /// Inputs decoded, those of the corpus among them.
    pub executions: u64,
    /// Total time.
    pub time: Duration,
    /// The slowest one.
    pub slowest: Duration,
    /// The first input that was not borne, and what was said.
    pub crash: Option<(Vec<u8>, String)>,
}

/// `fuzz/` of this tree.
#[must_use]
pub fn room() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz")
}

/// The inputs that are committed for a target, in the order of their names.
///
/// # Errors
/// The directory is missing or cannot be read.
pub fn corpus(target: &Target) -> io::Result<Vec<Vec<u8>>> {
    let directory = room().join("corpus-seed").join(target.name);
    let files = std::fs::read_dir(directory)?.map(|entry| Ok(entry?.path()));
    let mut files: Vec<PathBuf> = files.collect::<io::Result<_>>()?;
    files.sort();
    files.iter().map(std::fs::read).collect()
}

/// Runs a target on its corpus and on inputs from a seed, to the first that it does not bear.
///
/// # Errors
/// The corpus cannot be read.
pub fn run(target: &Target, seed: u64, until: Until, watch: &watch::Watch) -> io::Result<Report> {
    let corpus = corpus(target)?;
    let start = Instant::now();
    let mut report = Report { executions: 0, time: Duration::ZERO, slowest: Duration::ZERO, crash: None };
    for input in corpus.iter().cloned().chain(Inputs::new(&corpus, seed)) {
        let enough = match until {
            Until::Inputs(count) => report.executions >= count + corpus.len() as u64,
            Until::Time(time) => report.executions >= corpus.len() as u64 && start.elapsed() >= time,
        };
        if enough {
            break;
        }
        let begun = Instant::now();
        watch.begin(target.name, &input);
        let borne = catch_unwind(AssertUnwindSafe(|| (target.run)(&input)));
        watch.end();
        report.executions += 1;
        report.slowest = report.slowest.max(begun.elapsed());
        if let Err(panic) = borne {
            report.crash = Some((input, words(panic.as_ref())));
            break;
        }
    }
    report.time = start.elapsed();
    Ok(report)
}

/// Keeps an input that was not borne where `cargo fuzz` does.
///
/// # Errors
/// The file system refuses.
pub fn keep(target: &str, input: &[u8]) -> io::Result<PathBuf> {
    let directory = room().join("artifacts").join(target);
    std::fs::create_dir_all(&directory)?;
    let path = directory.join("from-a-seed");
    std::fs::write(&path, input)?;
    Ok(path)
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without words").to_owned()
}
