//! `pil`: the decisions on the ESP32-C3's instruction set, in QEMU. Ends with 1 if something does not hold.

use std::path::PathBuf;
use std::process::{Command, ExitCode};

use clap::{Parser, ValueEnum};
use comfy_table::{CellAlignment, LineStyle, Table, TableStyle};
use scram::hil::{HilError, Qemu, Remote, build_program};
use system_tests::pil::bits::Compared;
use system_tests::pil::cost::{Cost, RAM_BUDGET, Robots, SCENARIOS, SEARCH_BUDGET, STACK_BUDGET, measure};
use system_tests::pil::equal::compare;
use system_tests::pil::search::search;

/// Compares the host's decisions with RISC-V machine code bit for bit, measures what a tick costs there, and looks for
/// panics that it can reach.
#[derive(Parser)]
#[command(after_help = "Example: cargo pil --only costs")]
struct Arguments {
    /// Only this part.
    #[arg(long)]
    only: Option<Part>,
    /// The program for QEMU [default: built from firmware/pil]
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Runs of the search for the dearest tick.
    #[arg(long, default_value_t = 400)]
    search: u32,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Bit for bit over a minute
    Bits,
    /// Instructions, stack and RAM
    Costs,
    /// Panics that can be reached
    Panics,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{:?}", miette::Report::from(error));
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<bool, HilError> {
    let wanted = |part| arguments.only.is_none_or(|only| only == part);
    let mut holds = true;
    if wanted(Part::Bits) || wanted(Part::Costs) {
        Qemu::is_installed()?;
        let elf = arguments.elf.clone().map_or_else(build_program, Ok)?;
        let robots = Robots::new();
        let mut chip = system_tests::pil::chip(&elf, &robots.calibrated)?;
        if wanted(Part::Bits) {
            holds &= bits(&robots, &mut chip)?;
        }
        if wanted(Part::Costs) {
            holds &= costs(&robots, arguments.search, &mut chip)?;
        }
        let counts = chip.counts();
        eprintln!(
            "on the line: {} requests sent again, {} bad frames",
            counts.resent,
            counts.bad_here + counts.bad_there
        );
    }
    if wanted(Part::Panics) {
        holds &= panics();
    }
    Ok(holds)
}

fn bits(robots: &Robots, chip: &mut Remote<Qemu>) -> Result<bool, HilError> {
    let compared = compare(robots, chip)?;
    let Compared { ticks, answers, refusals, different, .. } = compared;
    let what = format!("{ticks} ticks, {answers} answers to commands ({refusals} refusals)");
    Ok(same(&format!("bit for bit over a minute: {what}"), different, &compared))
}

/// Prints whether host and chip agree.
fn same(what: &str, different: u64, compared: &Compared) -> bool {
    let verdict = if different == 0 { "ok  " } else { "FAIL" };
    println!("{verdict} {what}: {different} different");
    if let Some(first) = &compared.first {
        println!("     the first: {first:#?}");
    }
    different == 0
}

fn costs(robots: &Robots, courses: u32, chip: &mut Remote<Qemu>) -> Result<bool, HilError> {
    let mut rows = Vec::new();
    let mut compared = Compared::default();
    for scenario in &SCENARIOS {
        eprintln!("{} …", scenario.what);
        let (cost, outcomes) = measure(scenario, robots, chip)?;
        rows.push(cost);
        for outcome in outcomes {
            compared.add(outcome.compared);
        }
    }
    if courses > 0 {
        eprintln!("searching in {courses} runs …");
        let found = search(robots, courses, chip)?;
        eprintln!("found after {} missed ticks", found.missed);
        rows.push(Cost {
            what: "dearest that a search finds",
            ticks: usize::try_from(found.compared.ticks).unwrap_or(usize::MAX),
            median: None,
            worst: found.cost,
            budget: SEARCH_BUDGET,
            stack: found.stack,
        });
        compared.add(found.compared);
    }
    println!("{}", table(&rows));
    let stack = rows.iter().map(|row| row.stack).max().unwrap_or(0);
    let ram = chip.hello().controller_bytes;
    let mut holds = same(&format!("bit for bit on the way: {} ticks", compared.ticks), compared.different, &compared);
    holds &= within("stack of a tick", stack, STACK_BUDGET);
    holds &= within("RAM of the controller", ram, RAM_BUDGET);
    Ok(holds && rows.iter().all(|row| row.holds()))
}

fn within(what: &str, bytes: u32, budget: u32) -> bool {
    println!("{} {what}: {bytes} bytes of {budget}", if bytes <= budget { "ok  " } else { "FAIL" });
    bytes <= budget
}

/// A rule above, below, and under the header.
const STYLE: TableStyle = TableStyle::new()
    .top_border(LineStyle::none().fill('─').junction('─'))
    .header_separator(LineStyle::none().fill('─').junction('─'))
    .bottom_border(LineStyle::none().fill('─').junction('─'));

fn table(rows: &[Cost]) -> Table {
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_header(["RV32IMC, instructions a tick", "ticks", "median", "worst", "budget", "holds"]);
    for row in rows {
        table.add_row([
            row.what.to_owned(),
            row.ticks.to_string(),
            row.median.map_or_else(String::new, |median| median.to_string()),
            row.worst.to_string(),
            row.budget.to_string(),
            if row.holds() { "yes" } else { "NO" }.to_owned(),
        ]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Links `control` alone, once as it is and once with a panic that must be found.
fn panics() -> bool {
    let link = |extra: &[&str]| {
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.args(["run", "--quiet", "--package", "xtask", "--", "no-panic"]).args(extra);
        cargo.status().is_ok_and(|status| status.success())
    };
    let holds = link(&[]) & link(&["--planted"]);
    println!(
        "{} panics that can be reached: {}",
        if holds { "ok  " } else { "FAIL" },
        if holds { "none" } else { "see above" }
    );
    holds
}
