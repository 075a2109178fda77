//! `scram bring-up`

use std::io::{self, BufRead, Read, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Duration;

use clap::{Args, ValueEnum};
use control::protocol::dongle::Address;
use link::{Line, LinkError, SerialLine, Session};
use miette::{IntoDiagnostic, Report as Trouble, WrapErr, miette};
use robot_file::Robot;
use robot_file::design::DesignError;
use scram::bring_up::operator::{Expected, Keep};
use scram::bring_up::report::lines;
use scram::bring_up::{
    Absent, Act, Answers, Checked, Chip, Observation, Operator, Options, Report, Seen, Step, StepResult, simulated,
    steps, walk,
};

use super::console::list_of_ports;
use super::pair::KeysFile;
use super::sim::listed;
use super::{Common, Done, Failure, ask, print, print_json, say};

/// A dongle that was just restarted by opening its port needs a second to boot.
const DONGLE_PATIENCE: Duration = Duration::from_secs(4);
/// A battery may still have to go in.
const ROBOT_PATIENCE: Duration = Duration::from_secs(20);
/// Columns of what is told.
const WIDTH: usize = 80;
/// Where text begins under a step's number.
const INDENT: usize = 5;

/// Bring a board up: walk the steps of firmware/UNVERIFIED.md one by one, and write a report to send in
///
/// Says what to connect, does what can be done over the link, measures, and asks for what takes hands or an oscilloscope.
/// What nobody looked at is not checked, never passed. Best with an image that makes faults on request: cargo flash-robot
/// CHIP --inject. Writes bring-up.json and bring-up.md into --out.
#[derive(Args)]
#[command(
    mut_arg("out", |arg| arg.default_value("out/bring-up")),
    mut_arg("json", |arg| arg.help("The report as one JSON object on stdout")),
    mut_arg("seed", |arg| arg.help("Seed of the simulation")),
    after_help = "Examples:\n  \
        scram bring-up --sim\n  \
        scram bring-up --port /dev/ttyACM0 --chip esp32\n  \
        scram bring-up --port /dev/ttyACM0 --steps 6-9,24 --length 10m\n  \
        scram bring-up --port /dev/ttyACM0 --skip-manual --json\n\n\
        Exit codes: 0 no step failed, 1 a step failed or it could not be done, 2 wrong usage."
)]
pub struct BringUp {
    /// The dongle's serial port
    #[arg(long, value_name = "PORT", conflicts_with = "sim")]
    port: Option<String>,
    /// A simulated board, and a simulated person who reads its pins
    #[arg(long)]
    sim: bool,
    /// The robot's chip
    #[arg(long, value_enum, default_value_t = ChipName::Esp32c3)]
    chip: ChipName,
    /// Only these steps, by their numbers: 6-9,24
    #[arg(long, value_name = "LIST", value_parser = parse_steps)]
    steps: Option<Numbers>,
    /// How long the long traffic takes, e.g. 90s, 10m, 1h [default: 1h; with --sim 20s]
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    length: Option<Duration>,
    /// How often a step repeats that wants it often [default: 50; with --sim 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: Option<u32>,
    /// Ask nobody: what takes hands or instruments is not checked
    #[arg(long)]
    skip_manual: bool,
    /// Ask nobody: what was noted earlier is in a file. [6] begins a step, en-falls = 0.4 answers a question
    #[arg(long, value_name = "FILE", conflicts_with_all = ["skip_manual", "sim"])]
    answers: Option<PathBuf>,
    /// List the steps
    #[arg(long)]
    list: bool,
    /// The robot's radio address, where more than one is switched on
    #[arg(long, value_name = "MAC", value_parser = link::parse_address)]
    address: Option<Address>,
    #[command(flatten)]
    keys: KeysFile,
    #[command(flatten)]
    common: Common,
}

/// Numbers of steps.
#[derive(Clone, Debug, PartialEq)]
struct Numbers(Vec<u16>);

#[derive(Clone, Copy, ValueEnum)]
enum ChipName {
    Esp32,
    Esp32c3,
}

impl BringUp {
    pub fn run(&self) -> Done {
        if self.list {
            steps().for_each(|step| print(&format!("{:>3}  {}", step.number, step.title)));
            return Ok(());
        }
        let robot = self.common.robot()?;
        let options = self.options(&robot).map_err(|error| miette!("{}: {error}", self.common.robot.display()))?;
        let report = if self.sim {
            simulated::simulate(&robot, &options, self.common.seed, |_| {}, &mut tell)?
        } else {
            let Some(port) = &self.port else { return Err(Failure::Usage(list_of_ports())) };
            self.on_bench(port, &options)?
        };
        let files = [
            self.common.write("bring-up.json", &(json(&report)? + "\n"))?,
            self.common.write("bring-up.md", &report.markdown())?,
        ];
        if self.common.json {
            print_json(&report)?;
        } else {
            print(&summary(&report));
            print(&format!("written: {}", listed(&files)));
        }
        if report.failed > 0 {
            let help = format!("what was found and what was expected is in {}", files[1].display());
            return Err(miette!(help = help, "failed: step {}", report.numbers(StepResult::Failed)).into());
        }
        Ok(())
    }

    fn options(&self, robot: &Robot) -> Result<Options, DesignError> {
        let chip = match self.chip {
            ChipName::Esp32 => Chip::Esp32,
            ChipName::Esp32c3 => Chip::Esp32c3,
        };
        let mut options = if self.sim { Options::simulated(robot, chip)? } else { Options::on_bench(robot, chip)? };
        options.length = self.length.unwrap_or(options.length);
        options.repeats = self.repeats.unwrap_or(options.repeats);
        options.only = self.steps.clone().map(|numbers| numbers.0).unwrap_or_default();
        Ok(options)
    }

    fn on_bench(&self, port: &str, options: &Options) -> Result<Report, Trouble> {
        // Whatever can be refused is refused before anything moves.
        let answers = self.answers.as_deref().map(Answers::load).transpose()?;
        let keys = self.keys.load()?;
        let cancelled = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&cancelled);
        ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
            .into_diagnostic()
            .wrap_err("Ctrl-C cannot be caught, so no motor is started")?;
        let line: Box<dyn Line> = Box::new(Cancellable { line: SerialLine::open(port)?, cancelled });
        say(&format!("Looking for the dongle on {port}"));
        let mut session = Session::open(line, &keys, link::nonces()?, DONGLE_PATIENCE)?;
        say("Looking for the robot");
        let robot = session.find(self.address, ROBOT_PATIENCE)?;
        for line in link::robot(session.robot(robot), session.now()) {
            say(&wrapped(&line, 0));
        }
        if self.skip_manual || answers.is_some() {
            let mut ended = tell;
            let mut absent = Absent::new(answers.unwrap_or_default(), &mut ended);
            let report = walk(session, robot, &mut absent, options);
            for key in absent.unused() {
                say(&format!("warning: {key} was not asked"));
            }
            return Ok(report);
        }
        say("At the beginning: motor unplugged, the potentiometer's wiper on its pin.");
        Ok(walk(session, robot, &mut Person::new(), options))
    }
}

/// A line that breaks when somebody asks for it. It can still be written to, so that the motor is stopped.
struct Cancellable {
    line: SerialLine,
    cancelled: Arc<AtomicBool>,
}

impl Read for Cancellable {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.cancelled.load(Ordering::Relaxed) {
            return Err(io::Error::other("stopped on request"));
        }
        self.line.read(buffer)
    }
}

impl Write for Cancellable {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.line.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.line.flush()
    }
}

impl Line for Cancellable {
    fn now(&self) -> Duration {
        self.line.now()
    }
}

/// Whoever is at the keyboard.
struct Person {
    typed: Receiver<String>,
}

/// What a person says to a step or an act.
enum Word {
    Go,
    Skip,
}

impl Person {
    /// Lines are read beside the session, which goes on.
    fn new() -> Self {
        let (sender, typed) = channel();
        std::thread::spawn(move || {
            for line in io::stdin().lock().lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Self { typed }
    }

    /// The next line; nothing at the end of the input.
    fn line(&mut self, prompt: &str, keep: &mut Keep) -> Result<Option<String>, LinkError> {
        ask(&format!("{:INDENT$}{prompt} ", ""));
        loop {
            match self.typed.try_recv() {
                Ok(line) => return Ok(Some(line.trim().to_owned())),
                Err(TryRecvError::Disconnected) => return Ok(None),
                // It waits for the line some milliseconds.
                Err(TryRecvError::Empty) => keep()?,
            }
        }
    }

    fn word(&mut self, prompt: &str, keep: &mut Keep) -> Result<Word, LinkError> {
        loop {
            match self.line(prompt, keep)?.as_deref() {
                Some("") => return Ok(Word::Go),
                Some("s") | None => return Ok(Word::Skip),
                Some(_) => {}
            }
        }
    }
}

impl Operator for Person {
    fn begin(&mut self, step: &Step, keep: &mut Keep) -> Result<bool, LinkError> {
        say(&format!("\n{:>3}  {}", step.number, step.title));
        say(&wrapped(step.about, INDENT));
        if !step.needs.is_empty() {
            say(&wrapped(&format!("Needs {}.", step.needs), INDENT));
        }
        Ok(matches!(self.word("Enter: begin, s: skip", keep)?, Word::Go))
    }

    fn act(&mut self, act: Act, at_once: bool, keep: &mut Keep) -> Result<bool, LinkError> {
        say(&wrapped(&act.words(), INDENT));
        if at_once {
            return Ok(true);
        }
        Ok(matches!(self.word("Enter: done, s: skip", keep)?, Word::Go))
    }

    fn arm(&mut self) {}

    fn observe(&mut self, _: u16, observation: &Observation, keep: &mut Keep) -> Result<Seen, LinkError> {
        say(&wrapped(&format!("{}?", observation.text), INDENT));
        loop {
            let (prompt, unit) = match observation.expected {
                Expected::Yes => ("y, n, s: skip".to_owned(), false),
                Expected::Between(_, _, unit) | Expected::Number(unit) => {
                    (format!("a number{}{unit}, s: skip", if unit.is_empty() { "" } else { " in " }), true)
                }
            };
            match (self.line(&prompt, keep)?.as_deref(), unit) {
                (Some("s") | None, _) => return Ok(Seen::Nothing("skipped".into())),
                (Some("y"), false) => return Ok(Seen::Is(true)),
                (Some("n"), false) => return Ok(Seen::Is(false)),
                (Some(text), true) => {
                    if let Ok(value) = text.parse::<f64>() {
                        return Ok(Seen::Value(value));
                    }
                }
                _ => {}
            }
        }
    }

    fn silence(&mut self, time: Duration) {
        std::thread::sleep(time);
    }

    fn ended(&mut self, step: &Checked) {
        tell(step);
    }
}

/// A step that has ended, on stderr.
fn tell(step: &Checked) {
    say(&format!("{:>3}  {:<62} {:>12}", step.number, cut(step.title, 62), step.verdict.word()));
    lines(step).iter().for_each(|line| say(&wrapped(line, INDENT)));
}

fn cut(text: &str, columns: usize) -> String {
    text.chars().take(columns).collect()
}

/// Folded at words.
fn wrapped(text: &str, indent: usize) -> String {
    let mut rows = vec![" ".repeat(indent)];
    for word in text.split_whitespace() {
        let row = rows.last_mut().map(|row| (row.chars().count(), row.trim().is_empty()));
        let (length, empty) = row.unwrap_or_default();
        if !empty && length + 1 + word.chars().count() > WIDTH {
            rows.push(" ".repeat(indent));
        }
        if let Some(row) = rows.last_mut() {
            if !row.trim().is_empty() {
                row.push(' ');
            }
            row.push_str(word);
        }
    }
    rows.join("\n")
}

fn summary(report: &Report) -> String {
    let list = |verdict| {
        let numbers = report.numbers(verdict);
        if numbers.is_empty() { "none".to_owned() } else { numbers }
    };
    let simulated = if report.simulated { "simulated: this says nothing about a board" } else { "on a board" };
    let row = |what: &str, count: usize, verdict| format!("{what:<12} {count:>3}  {}", list(verdict));
    let rows = [
        format!("{} ({}), {simulated}", report.robot, report.chip.name()),
        row("passed", report.passed, StepResult::Passed),
        row("failed", report.failed, StepResult::Failed),
        row("not checked", report.not_checked, StepResult::NotChecked),
    ];
    rows.map(|row| wrapped_under(&row, 18)).join("\n")
}

/// Folded at words, what follows the first row further in.
fn wrapped_under(text: &str, indent: usize) -> String {
    let head: String = text.chars().take(indent).collect();
    let tail: String = text.chars().skip(indent).collect();
    head.clone() + wrapped(&tail, indent).trim_start()
}

fn json(report: &Report) -> Result<String, Trouble> {
    serde_json::to_string_pretty(report).into_diagnostic()
}

/// `6-9,24`
fn parse_steps(text: &str) -> Result<Numbers, String> {
    let mut numbers = Vec::new();
    for part in text.split(',') {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        let number = |text: &str| text.trim().parse::<u16>().map_err(|_| format!("`{part}` is no step: 6 or 6-9"));
        let (from, to) = (number(from)?, number(to)?);
        if from > to {
            return Err(format!("`{part}` goes backwards"));
        }
        numbers.extend(steps().map(|step| step.number).filter(|step| (from..=to).contains(step)));
        if !numbers.iter().any(|step| (from..=to).contains(step)) {
            return Err(format!("there is no step {part} in firmware/UNVERIFIED.md; --list lists them"));
        }
    }
    Ok(Numbers(numbers))
}

/// `90s`, `10m`, `1h`; without a unit seconds.
fn parse_time(text: &str) -> Result<Duration, String> {
    let wrong = || format!("`{text}` is no time from 1s to 24h: 90s, 10m, 1h");
    let (digits, unit) = match text.char_indices().last() {
        Some((at, last)) if last.is_ascii_alphabetic() => text.split_at(at),
        _ => (text, "s"),
    };
    let seconds = match unit {
        "s" => 1,
        "m" => 60,
        "h" => 3600,
        _ => return Err(wrong()),
    };
    let count: u64 = digits.parse().map_err(|_| wrong())?;
    let seconds = count.checked_mul(seconds).filter(|seconds| (1..=86_400).contains(seconds)).ok_or_else(wrong)?;
    Ok(Duration::from_secs(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_steps_are_read() {
        assert_eq!(parse_time("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(parse_time("20"), Ok(Duration::from_secs(20)));
        assert_eq!(parse_time("1h"), Ok(Duration::from_secs(3600)));
        for wrong in ["", "0s", "1d", "h", "-1s", "25h", "99999999999999999999h", "é"] {
            assert!(parse_time(wrong).is_err(), "{wrong}");
        }
        assert_eq!(parse_steps("6-9,24"), Ok(Numbers(vec![6, 7, 8, 9, 24])));
        for wrong in ["", "9-6", "six", "999"] {
            assert!(parse_steps(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn text_is_folded_within_eighty_columns() {
        let text = wrapped(&"some words ".repeat(40), INDENT);
        assert!(text.lines().count() > 4 && text.lines().all(|line| line.chars().count() <= WIDTH));
    }
}
