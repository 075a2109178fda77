//! `cargo images`: flashable images of the firmware, their sizes, and whether these keep within their budgets.

use std::path::{Path, PathBuf};
use std::process::Command;

use comfy_table::{Cell, CellAlignment, LineStyle, Table, TableStyle};
use miette::{IntoDiagnostic, Result, WrapErr, miette};

use crate::budget::{Budget, Budgets, grouped, over};
use crate::cargo;
use crate::chip::{BINARIES, Chip, has_radio};
use crate::flash::espflash;
use crate::heap::{self, Heap};
use crate::injection;
use crate::overrides;
use crate::project::Project;
use crate::sections::Sections;
use crate::toolchain::output_of;

/// Sizes of one binary.
struct Measured {
    binary: String,
    image: u64,
    sections: Sections,
    /// The radio's
    heap: Option<Heap>,
    budget: Budget,
}

impl Measured {
    /// What goes over a budget.
    fn violations(&self) -> impl Iterator<Item = String> {
        let image = over("image", self.image, self.budget.image_bytes);
        let ram = over("static RAM", self.sections.static_ram(), self.budget.static_ram_bytes);
        let heap = heap::violation(self.heap, self.budget.heap_least_free_bytes);
        [image, ram, heap].into_iter().flatten().map(|text| format!("{}: {text}", self.binary))
    }
}

/// Builds, writes, measures and judges.
pub fn run(project: &Project, chip: Chip, only: Option<&str>) -> Result<()> {
    let espflash = espflash()?;
    let budget_file = project.firmware().join("budgets.toml");
    let budgets = Budgets::read(&budget_file)?;
    let toolchain = cargo::linking_toolchain(chip)?;
    let binaries: Vec<&str> = BINARIES.into_iter().filter(|name| only.is_none_or(|only| only == *name)).collect();
    let mut command = cargo::command(project, &toolchain, "build", chip);
    command.args(binaries.iter().flat_map(|name| ["--bin", name]));
    let executables = cargo::build(project, &mut command)?;

    let folder = project.output("images");
    std::fs::create_dir_all(&folder).into_diagnostic().wrap_err_with(|| folder.display().to_string())?;
    let mut measured = Vec::new();
    for &binary in &binaries {
        let elf = executables.get(binary).ok_or_else(|| miette!("cargo built no binary `{binary}`"))?;
        overrides::check(chip, binary, elf)?;
        injection::refuse(binary, elf)?;
        let image = save(project, &espflash, chip, elf, &folder.join(format!("{}-{binary}", chip.name())))?;
        let sections = Sections::read(chip, elf)?;
        let heap = if has_radio(binary) { Heap::read(elf)? } else { None };
        let budget = budgets.of(chip, binary)?;
        measured.push(Measured { binary: binary.to_owned(), image, sections, heap, budget });
    }
    println!("{}, release, by {}; sizes in bytes", chip.name(), toolchain.describe());
    println!("{}\n{}", flash_table(&measured), ram_table(&measured));
    measured.iter().filter_map(heap_line).for_each(|line| println!("{line}"));
    println!("{}", written(project.short(&folder), chip, &binaries));
    let violations: Vec<String> = measured.iter().flat_map(Measured::violations).collect();
    if violations.is_empty() {
        return Ok(());
    }
    Err(miette!(
        help = "make it smaller, or raise the budget in firmware/budgets.toml and say there why",
        "over budget: {}",
        violations.join("; ")
    ))
}

/// Writes the application image and the whole flash's image; returns the application's size.
fn save(project: &Project, espflash: &Path, chip: Chip, elf: &Path, stem: &Path) -> Result<u64> {
    let application = with_ending(stem, "-app.bin");
    for (file, options) in [(&application, &[][..]), (&with_ending(stem, ".bin"), &["--merge", "--skip-padding"])] {
        let mut command = Command::new(espflash);
        // In the firmware's folder espflash finds espflash.toml, where there is one.
        command.current_dir(project.firmware()).args(["save-image", "--skip-update-check", "--chip", chip.name()]);
        output_of(command.args(options).arg(elf).arg(file))?;
    }
    let written = std::fs::metadata(&application);
    Ok(written.into_diagnostic().wrap_err_with(|| application.display().to_string())?.len())
}

fn with_ending(stem: &Path, ending: &str) -> PathBuf {
    let mut path = stem.as_os_str().to_owned();
    path.push(ending);
    path.into()
}

/// What was written, and how to put it on a board without building it.
fn written(folder: &Path, chip: Chip, binaries: &[&str]) -> String {
    let (folder, chip) = (folder.display(), chip.name());
    let binary = match binaries {
        [one] => (*one).to_owned(),
        several => format!("{{{}}}", several.join(",")),
    };
    format!(
        "written to {folder}:\n  \
         {chip}-{binary}-app.bin  the application alone, for address 0x10000\n  \
         {chip}-{binary}.bin      with bootloader and partition table, for 0x0\n\
         to write one:  espflash write-bin --chip {chip} 0x0 {folder}/{chip}-{}.bin",
        binaries.first().unwrap_or(&"robot")
    )
}

fn flash_table(measured: &[Measured]) -> Table {
    let header = ["flash", "image", "budget", "used", "code", "constants", "holds"];
    table(&header, measured, |one| {
        let limit = one.budget.image_bytes;
        vec![
            grouped(one.image),
            grouped(limit),
            share(one.image, limit),
            grouped(one.sections.flash_code),
            grouped(one.sections.flash_data),
            holds(one.image, limit),
        ]
    })
}

fn ram_table(measured: &[Measured]) -> Table {
    let header = ["RAM", "static RAM", "budget", "used", "code", "data", "zeroed", "RTC", "left for stack", "holds"];
    table(&header, measured, |one| {
        let (sections, limit) = (&one.sections, one.budget.static_ram_bytes);
        let ram = sections.static_ram();
        let parts = [sections.ram_code, sections.ram_data, sections.ram_zeroed, sections.rtc, sections.stack];
        let mut row = vec![grouped(ram), grouped(limit), share(ram, limit)];
        row.extend(parts.map(grouped));
        row.push(holds(ram, limit));
        row
    })
}

/// The radio's heap, in words: it is computed, not measured.
fn heap_line(one: &Measured) -> Option<String> {
    let (heap, limit) = (one.heap?, one.budget.heap_least_free_bytes.unwrap_or_default());
    let [bytes, worst, free, least] = [heap.bytes, heap.worst_case, heap.least_free(), limit].map(grouped);
    let holds = if heap.least_free() >= limit { "yes" } else { "NO" };
    let name = &one.binary;
    Some(format!(
        "{name}: heap {bytes}, computed worst case {worst}, left {free}, budget {least} at the least: {holds}"
    ))
}

fn share(used: u64, limit: u64) -> String {
    format!("{} %", (100 * used).div_ceil(limit.max(1)))
}

fn holds(used: u64, limit: u64) -> String {
    if used <= limit { "yes" } else { "NO" }.to_owned()
}

fn table(header: &[&str], measured: &[Measured], row: impl Fn(&Measured) -> Vec<String>) -> Table {
    const STYLE: TableStyle = TableStyle::new()
        .top_border(LineStyle::none().fill('─').junction('─'))
        .header_separator(LineStyle::none().fill('─').junction('─'))
        .bottom_border(LineStyle::none().fill('─').junction('─'));
    let mut table = Table::new();
    let right = |text: &str| Cell::new(text).set_alignment(CellAlignment::Right);
    table.load_style(STYLE).set_header(
        header.iter().enumerate().map(|(index, text)| if index == 0 { Cell::new(text) } else { right(text) }),
    );
    for one in measured {
        let cells = row(one).into_iter().map(|text| right(&text));
        table.add_row(std::iter::once(Cell::new(&one.binary)).chain(cells.collect::<Vec<_>>()));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot(image: u64, zeroed: u64) -> Measured {
        let sections = Sections { ram_code: 50_000, ram_data: 10_000, ram_zeroed: zeroed, ..Sections::default() };
        let budget = Budget { image_bytes: 500_000, static_ram_bytes: 160_000, heap_least_free_bytes: Some(2000) };
        let heap = Some(Heap { bytes: 73_728, worst_case: 71_728 });
        Measured { binary: "robot".to_owned(), image, sections, heap, budget }
    }

    #[test]
    fn within_the_budget_nothing_is_violated() {
        assert_eq!(robot(500_000, 100_000).violations().count(), 0);
    }

    #[test]
    fn each_violation_names_the_binary_and_the_number() {
        let told: Vec<String> = robot(500_001, 100_016).violations().collect();
        let image = "robot: image 500 001 bytes, budget 500 000: 1 over";
        assert_eq!(told, [image, "robot: static RAM 160 016 bytes, budget 160 000: 16 over"]);
    }

    #[test]
    fn a_heap_that_a_flood_can_fill_is_told() {
        let mut one = robot(1, 1);
        assert!(heap_line(&one).expect("a radio").ends_with("left 2 000, budget 2 000 at the least: yes"));
        one.heap = Some(Heap { bytes: 73_728, worst_case: 71_729 });
        assert_eq!(one.violations().count(), 1);
        assert!(heap_line(&one).expect("a radio").ends_with("NO"));
        one.heap = None;
        assert_eq!((heap_line(&one), one.violations().count()), (None, 1), "and so is a budget for nothing");
    }

    #[test]
    fn tables_fit_a_hundred_columns() {
        let mut large = robot(4_128_768, 300_000);
        large.sections =
            Sections { flash_code: 3_000_000, flash_data: 1_000_000, stack: 300_000, rtc: 8192, ..large.sections };
        for text in [flash_table(&[robot(1, 1), large]).to_string(), ram_table(&[robot(1, 1)]).to_string()] {
            assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        }
    }
}
