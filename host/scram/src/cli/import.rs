//! `scram import`, and the mapping that `scram diagnose` takes, too.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use miette::{Report, miette};
use recording::import::{Imported, Mapping, PositionControl, import};
use recording::{ReadOptions, Window, write_csv_with, write_mcap_with};
use scram::progress::bar;

use super::run_directory::IMPORTED;
use super::{Done, Failure, print, print_json, same_file, say};

/// Read another rig's files into recordings
///
/// A mapping says which column holds what, in which unit: --map QUANTITY=[-]COLUMN:UNIT[+OFFSET], or a file (--mapping).
/// The value is unit · (±number + offset); - turns a reversed sensor round.
#[derive(Args)]
#[command(after_help = "Quantities and their units:\n  \
    time              s, ms, us, ns, min; without a time column --rate HZ\n  \
    angle, goal       rad, deg, turns, counts/N with N counts a turn\n  \
    speed             rad/s, deg/s, rpm, turns/s; integrated where there is no angle\n  \
    duty              percent, or the number at full scale: 255, 1\n  \
    voltage           V, mV; commanded: over the supply it is the duty\n  \
    terminal_voltage  V, mV; measured at the motor\n  \
    supply            V, mV; one that holds its voltage: --supply V\n  \
    current           A, mA, of the motor\n  \
    temperature       C, K\n  \
    enable            1 or 0: the bridge drives or is open; no unit\n\n\
    Examples:\n  \
    scram import rig.csv --map time=Time:ms --map angle=Pos:deg --map duty=PWM:255 --map supply=Vbat:mV\n  \
    scram import runs/*.csv --mapping rig.toml --from 2 --to 8 --out runs/imported\n  \
    scram import servo.csv --rate 200 --map angle=-Enc:counts/4096 --map goal=Goal:deg --p-gain 32 --p-full-scale 6.33\n\n\
    docs/import.md describes mapping files, what is refused and what is left out.")]
pub struct Import {
    /// Files of another rig: tables of text (.csv, .tsv, .txt, .dat), MATLAB's .mat, logs of BAM (.json)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    mapping: MappingArgs,
    #[command(flatten)]
    window: WindowArgs,
    /// What is written
    #[arg(long, value_enum, default_value_t = Format::Mcap)]
    format: Format,
    /// Directory for the recordings, each called as its file
    #[arg(long, value_name = "DIR", default_value = IMPORTED.numbered)]
    out: PathBuf,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
    /// One JSON object on stdout instead of text
    #[arg(long)]
    json: bool,
}

/// What a recording is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// With metadata, for viewers
    Mcap,
    /// Text, the metadata in a .toml beside it
    Csv,
}

/// Which column is what.
#[derive(Args)]
pub struct MappingArgs {
    /// A column: QUANTITY=[-]COLUMN:UNIT[+OFFSET]; repeatable
    #[arg(long, value_name = "WORDS")]
    map: Vec<String>,
    /// A file with the mapping (TOML); --map and the options below go before what it says
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    /// Rows a second, where no column holds the time
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// The bridge's supply, V, where no column holds it and it does not change
    #[arg(long, value_name = "V")]
    supply: Option<f64>,
    /// Gain of a servo's position control: the duty is KP · (goal − angle) / full scale
    #[arg(long, value_name = "KP")]
    p_gain: Option<f64>,
    /// Gain times error, rad, that gives a duty of 1 [default: 1]
    #[arg(long, value_name = "RAD")]
    p_full_scale: Option<f64>,
    /// Largest duty of a servo's position control [default: 1]
    #[arg(long, value_name = "DUTY")]
    p_max_duty: Option<f64>,
}

/// Which part of a run.
#[derive(Args)]
pub struct WindowArgs {
    /// Nothing before this time of the recording, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Nothing after this time of the recording, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
}

impl MappingArgs {
    /// `--map` and `--rate` as they were typed.
    pub fn words(&self) -> (&[String], Option<f64>) {
        (&self.map, self.rate)
    }

    /// The mapping; `None` where nothing was said about one.
    pub fn read(&self) -> Result<Option<Mapping>, Failure> {
        let mut said = Mapping {
            rate_hz: self.rate,
            supply_v: self.supply,
            control: PositionControl {
                gain: self.p_gain,
                full_scale_rad: self.p_full_scale,
                most_duty: self.p_max_duty,
            },
            ..Mapping::default()
        };
        for words in &self.map {
            said.map(words).map_err(|error| Failure::Usage(error.into()))?;
        }
        let nothing = said == Mapping::default();
        said.check().map_err(|error| Failure::Usage(error.into()))?;
        let Some(file) = &self.mapping else { return Ok((!nothing).then_some(said)) };
        let mapping = Mapping::load(file).map_err(Report::from)?.overridden_by(&said);
        Ok(Some(mapping))
    }
}

impl WindowArgs {
    /// The part of a run that was asked for.
    pub fn read(&self) -> Result<Window, Failure> {
        let window = Window { from_s: self.from, to_s: self.to };
        if [self.from, self.to].into_iter().flatten().any(|at| !at.is_finite()) {
            return Err(Failure::Usage(miette!("--from and --to are times in s")));
        }
        match (self.from, self.to) {
            (Some(from), Some(to)) if from >= to => Err(Failure::Usage(miette!(
                help = "--from is the earlier one",
                "nothing is between --from {from} and --to {to}"
            ))),
            _ => Ok(window),
        }
    }
}

/// Reads a file of another rig; what was left out and what looks wrong goes to stderr.
pub fn read(path: &Path, mapping: &Mapping, options: &ReadOptions) -> Result<Imported, Report> {
    let imported = import(path, mapping, options)?;
    for note in &imported.loaded.notes {
        say(&format!("{}: {note}", path.display()));
    }
    for warning in &imported.warnings {
        say(&format!("warning: {}: {warning}", path.display()));
    }
    Ok(imported)
}

impl Import {
    pub fn run(&self) -> Done {
        let mapping = self.mapping.read()?.unwrap_or_default();
        let window = self.window.read()?;
        let names = self.names()?;
        refuse(&self.out, &names, self.overwrite)?;
        // Everything is kept: what is thinned is thinned where it is read.
        let options = ReadOptions { limit: usize::MAX, progress: Some(bar), window, ..ReadOptions::default() };
        let mut all = Vec::new();
        for path in &self.files {
            all.push(read(path, &mapping, &options)?);
        }
        let written = IMPORTED.fill(&self.out, self.overwrite, |out| {
            refuse(out, &names, self.overwrite)?;
            let paths: Vec<PathBuf> = names.iter().map(|name| out.join(name)).collect();
            for (imported, path) in all.iter().zip(&paths) {
                self.write(imported, path)?;
            }
            Ok(paths)
        })?;
        self.tell(&all, &written)
    }

    fn write(&self, imported: &Imported, path: &Path) -> Result<(), Report> {
        if let Some(source) = self.files.iter().find(|source| same_file(source, path)) {
            return Err(miette!(
                help = "choose another directory with --out",
                "{} is a file that was read; it is not written over",
                source.display()
            ));
        }
        let loaded = &imported.loaded;
        match self.format {
            Format::Mcap => write_mcap_with(path, &loaded.recording, &[], &loaded.metadata)?,
            Format::Csv => write_csv_with(path, &loaded.recording, &[], &loaded.metadata)?,
        }
        Ok(())
    }

    /// What the recordings are called, one a file.
    fn names(&self) -> Result<Vec<String>, Failure> {
        let extension = if self.format == Format::Mcap { "mcap" } else { "csv" };
        let mut names: Vec<String> = Vec::new();
        for path in &self.files {
            let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            let name = format!("{stem}.{extension}");
            if names.contains(&name) {
                return Err(Failure::Usage(miette!(
                    help = "import them one by one into different directories (--out)",
                    "{}: another of the files would be {name}, too",
                    path.display()
                )));
            }
            names.push(name);
        }
        Ok(names)
    }

    fn tell(&self, all: &[Imported], written: &[PathBuf]) -> Done {
        if self.json {
            let objects: Vec<_> = all
                .iter()
                .zip(written)
                .map(|(imported, path)| {
                    serde_json::json!({
                        "written": path,
                        "import": imported.loaded.metadata.import,
                        "warnings": imported.warnings,
                    })
                })
                .collect();
            print_json(&serde_json::json!({ "recordings": objects }))?;
            return Ok(());
        }
        for (imported, path) in all.iter().zip(written) {
            let recording = &imported.loaded.recording;
            let (first, last) = (recording.t_s.first().unwrap_or(&0.0), recording.t_s.last().unwrap_or(&0.0));
            let record = imported.loaded.metadata.import.clone().unwrap_or_default();
            print(&format!("{}: {}", record.source, record.mapping.join(", ")));
            print(&format!(
                "{} of {} rows, {first:.3} … {last:.3} s, written: {}",
                record.samples,
                record.rows,
                path.display()
            ));
        }
        Ok(())
    }
}

/// Fails before anything would be written over.
fn refuse(out: &Path, names: &[String], overwrite: bool) -> Result<(), Report> {
    if overwrite {
        return Ok(());
    }
    match names.iter().map(|name| out.join(name)).find(|file| file.exists()) {
        Some(file) => Err(miette!(
            help = "name another directory with --out, leave --out away for a new one, or say --overwrite",
            "{} is there already; it is not written over",
            file.display()
        )),
        None => Ok(()),
    }
}
