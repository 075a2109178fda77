//! The blind campaign: hides effects, lets `diagnose` find them, and counts.
//!
//! `cargo blind` runs it on data sets as people record them ([`Setting::drawn`]), from seeds that are drawn from the operating
//! system's entropy and printed; `--seed` takes them again. Exit code 0: every bar is reached, 1: one is missed or it could not
//! be done, 2: wrong usage.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use system_tests::blind::case::{self, Case, Category};
use system_tests::blind::files::Decimals;
use system_tests::blind::hidden::Effect;
use system_tests::blind::noise::Noise;
use system_tests::blind::report;
use system_tests::blind::rig;
use system_tests::blind::score::{self, Outcome};
use system_tests::blind::setting::Setting;
use system_tests::journal::Journal;
use system_tests::page;
use system_tests::seeds;

/// Hide an effect in simulated recordings and see whether the diagnosis finds it.
#[derive(Parser)]
#[command(after_help = "Examples:
  blind                                   the long campaign, on fresh seeds
  blind --journal campaign.jsonl          the same, and it goes on where it was interrupted
  blind --hidden 8 --weak 0 --nothing 0 --two 0 --outside 0 --mistaken 0 --seed 1
  blind --hidden 4 --weak 4 --nothing 4 --two 4 --outside 4 --mistaken 12 --show    a look at fresh seeds
  blind --hidden 4 --only stribeck_friction --weak 0 --nothing 0 --two 0 --outside 0 --mistaken 0 --seed 1
  blind --export 20268 /tmp/set --category hidden --plain")]
struct Arguments {
    /// Data sets with one effect of the library hidden
    #[arg(long, default_value_t = 120)]
    hidden: u64,
    /// Data sets with one that hardly shows
    #[arg(long, default_value_t = 60)]
    weak: u64,
    /// Data sets with wrong parameters and nothing hidden
    #[arg(long, default_value_t = 300)]
    nothing: u64,
    /// Data sets with two effects hidden
    #[arg(long, default_value_t = 60)]
    two: u64,
    /// Data sets with an effect outside the library
    #[arg(long, default_value_t = 40)]
    outside: u64,
    /// Data sets with a mistake in their files
    #[arg(long, default_value_t = 40)]
    mistaken: u64,
    /// Data sets of a rig whose file lists effects, with one more hidden (no bar of their own)
    #[arg(long, default_value_t = 0)]
    beside: u64,
    /// First seed instead of one from the operating system's entropy; below 1000 for tuning
    #[arg(long)]
    seed: Option<u64>,
    /// Every data set at 1 kHz over 8 s, 12 to 14 bit, white noise, a file that is 10 to 30 % off, the first law of an effect
    #[arg(long)]
    plain: bool,
    /// Hide this effect in every data set instead of drawing one
    #[arg(long, value_parser = effect)]
    only: Option<Effect>,
    /// What the reading's noise is like: white, coloured:MS (how long it remembers), heavy (tails), speed:RAD_PER_S (where
    /// it has doubled)
    #[arg(long, value_parser = Noise::from_words)]
    noise: Option<Noise>,
    /// How visible the hidden effect is, LOW:HIGH times the noise floor
    #[arg(long, value_parser = ratio)]
    ratio: Option<(f64, f64)>,
    /// Runs of this share of 8 s; --export writes them with fewer decimals
    #[arg(long, value_name = "SHARE", value_parser = share)]
    short: Option<f64>,
    /// Keep every data set's files here, a directory each
    #[arg(long)]
    keep: Option<PathBuf>,
    /// Write every outcome into this file as it comes, and take from it those that are there
    #[arg(long, requires = "seed")]
    journal: Option<PathBuf>,
    /// Write the scores into their section of docs/figures.md
    #[arg(long, conflicts_with_all = ["export", "only", "noise", "ratio", "plain"])]
    write: bool,
    /// Only show what is reached: of few data sets a bar says little
    #[arg(long)]
    show: bool,
    /// Only write the data set of a seed into a directory
    #[arg(long, num_args = 2, value_names = ["SEED", "DIR"])]
    export: Option<Vec<String>>,
    /// Which kind of data set --export writes: hidden, weak, nothing, two, outside, beside, mistaken
    #[arg(long, default_value = "hidden", value_parser = category)]
    category: Category,
    /// The rig's robot file
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/bench-linear.toml"))]
    robot: PathBuf,
}

fn effect(name: &str) -> Result<Effect, String> {
    Effect::from_name(name).ok_or_else(|| {
        let names: Vec<_> = Effect::ALL.iter().map(|effect| effect.name()).collect();
        format!("unknown effect, expected one of {}", names.join(", "))
    })
}

fn share(word: &str) -> Result<f64, String> {
    word.parse().ok().filter(|share| (0.2..=3.0).contains(share)).ok_or_else(|| "expected 0.2 to 3".to_owned())
}

fn ratio(words: &str) -> Result<(f64, f64), String> {
    let ends = words.split_once(':').and_then(|(low, high)| Some((low.parse().ok()?, high.parse().ok()?)));
    ends.filter(|(low, high): &(f64, f64)| 1.0 < *low && low <= high)
        .ok_or_else(|| "expected LOW:HIGH, above 1".to_owned())
}

fn category(word: &str) -> Result<Category, String> {
    let words: Vec<_> = Category::ALL.iter().map(|category| category.word()).collect();
    Category::from_word(word).ok_or_else(|| format!("expected one of {}", words.join(", ")))
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(words) => {
            eprintln!("error: {words}");
            ExitCode::from(1)
        }
    }
}

fn run(arguments: &Arguments) -> Result<bool, String> {
    let robot_file = rig::flatten(&arguments.robot).map_err(|error| error.to_string())?;
    if let Some(export) = &arguments.export {
        return export_one(arguments, export, &robot_file).map(|()| true);
    }
    let first = match arguments.seed {
        Some(seed) => seed,
        None => seeds::fresh().map_err(|why| format!("the operating system has no entropy: {why}"))?,
    };
    println!("seeds from {first}; the same again: --seed {first}");
    let mut journal = arguments.journal.as_deref().map(Journal::open).transpose()?;
    let plan = [
        (Category::Hidden, arguments.hidden),
        (Category::Weak, arguments.weak),
        (Category::Nothing, arguments.nothing),
        (Category::Two, arguments.two),
        (Category::Outside, arguments.outside),
        (Category::Mistaken, arguments.mistaken),
        (Category::Beside, arguments.beside),
    ];
    let total: u64 = plan.iter().map(|(_, count)| count).sum();
    let mut outcomes = Vec::new();
    for (category, count) in plan {
        for seed in (0..count).map(|n| first.wrapping_add(n)) {
            let same = |one: &&Outcome| one.category == category && one.seed == seed;
            let known = journal.as_ref().and_then(|journal| journal.before.iter().find(same)).cloned();
            let outcome = match known {
                Some(outcome) => outcome,
                None => {
                    let outcome = examine(&draw(seed, category, arguments, &robot_file)?, arguments.keep.as_deref())?;
                    journal.as_mut().map_or(Ok(()), |journal| journal.add(&outcome))?;
                    outcome
                }
            };
            eprintln!("[{}/{total}] {}", outcomes.len() + 1, outcome.line());
            outcomes.push(outcome);
        }
    }
    let sizes = plan.map(|(category, count)| format!(" --{} {count}", category.word())).concat();
    tell(&outcomes, arguments, &format!("cargo blind --seed {first}{sizes}"))
}

/// Prints, and writes where asked to, what a command has reached; whether all of it was.
fn tell(outcomes: &[Outcome], arguments: &Arguments, command: &str) -> Result<bool, String> {
    println!("{}\n", report::table(outcomes));
    let bars = report::bars(outcomes);
    for bar in &bars {
        println!("{}", bar.line);
    }
    if let Some(line) = report::lowest_wins(outcomes) {
        println!("{line}");
    }
    for outcome in outcomes.iter().filter(|outcome| !outcome.passed()) {
        println!("\nfailed: {}", outcome.line());
        println!("  files: … --export {} DIR --category {}", outcome.seed, outcome.category.word());
    }
    if arguments.write && !outcomes.is_empty() {
        let lines: Vec<_> = bars.iter().map(|bar| bar.line.as_str()).collect();
        let body = format!("```text\n{}\n```", lines.join("\n"));
        page::write("blind", command, ("data sets", outcomes.len() as u64), &body)
            .map_err(|error| error.to_string())?;
    }
    Ok(arguments.show || bars.iter().all(|bar| bar.reached))
}

fn setting(arguments: &Arguments, seed: u64, category: Category) -> Setting {
    let mut setting = if arguments.plain { Setting::default() } else { category.setting(seed) };
    setting.share = arguments.short.unwrap_or(setting.share);
    setting.noise = arguments.noise.unwrap_or(setting.noise);
    setting.ratio = arguments.ratio;
    setting
}

fn draw(seed: u64, category: Category, arguments: &Arguments, robot_file: &str) -> Result<Case, String> {
    let only = hideable(arguments.only, category);
    case::draw_with(seed, category, only, robot_file, &setting(arguments, seed, category))
        .map_err(|error| format!("seed {seed}: {error}"))
}

/// An effect to hide only goes where its kind is hidden.
fn hideable(only: Option<Effect>, category: Category) -> Option<Effect> {
    only.filter(|effect| effect.in_library() != (category == Category::Outside))
}

fn examine(case: &Case, keep: Option<&Path>) -> Result<Outcome, String> {
    let scratch = tempfile::tempdir().map_err(|error| format!("no temporary directory: {error}"))?;
    let directory = match keep {
        Some(keep) => keep.join(format!("{}-{}", case.category.word(), case.seed)),
        None => scratch.path().to_owned(),
    };
    score::run(case, &directory).map_err(|error| format!("{}: {error}", directory.display()))
}

fn export_one(arguments: &Arguments, export: &[String], robot_file: &str) -> Result<(), String> {
    let [seed, directory] = export else { return Err("--export wants SEED and DIR".to_owned()) };
    let seed = seed.parse().map_err(|_| format!("--export: `{seed}` is not a seed (a whole number)"))?;
    let case = draw(seed, arguments.category, arguments, robot_file)?;
    let decimals = if arguments.short.is_some() { Decimals::FEW } else { Decimals::FULL };
    let paths = case.write_with(Path::new(directory), decimals).map_err(|error| format!("{directory}: {error}"))?;
    let hidden = case.truth();
    let hidden = if hidden.is_empty() { "nothing".to_owned() } else { hidden.join(" + ") };
    println!("hidden: {hidden}, visible at {:.2} times the noise floor ({})", case.size.ratio(), case.setting.words());
    println!("truth: {:#?}\n{:#?}", case.world, case.sensor);
    let hold: Vec<_> = paths.held_out.iter().map(|path| format!("--holdout {}", path.display())).collect();
    let fit: Vec<_> = paths.fit.iter().map(|path| path.display().to_string()).collect();
    println!("scram diagnose --robot {} {} {}", paths.robot.display(), fit.join(" "), hold.join(" "));
    Ok(())
}
