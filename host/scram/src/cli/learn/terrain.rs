//! `scram learn terrain`

use std::path::Path;

use ::learn::sides;
use ::learn::terrain::{self, Crossed};
use clap::Args;
use miette::{IntoDiagnostic, Report};
use serde::Serialize;

use super::super::run_directory::LEARNED;
use super::super::{Done, print, print_json, say, table, write};
use super::{Options, SETTINGS, bar, written};

/// What is written.
const FOUND: &str = "terrain.json";
/// A robot that came less far than this has not passed what lies ahead of it, nor walked at all, mm.
const STANDS_MM: f64 = 5.0;

/// Walk over slopes, steps and patches by the pose and without
///
/// Robots drawn from the file's spreads walk along a line over every terrain of the learning file, with controller, motor and sensor: by their pose, +F or −F,
/// whichever turns towards the line; and the same robots by +F and −F in turn. Says how far they come and how far off the line, and writes
/// every robot's into a directory of its own, out/learn-0001 and so on.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(LEARNED.numbered)))]
#[command(after_help = "Examples:\n  \
    scram learn terrain --robots 100\n\n\
    docs/learning.md describes the learning file, the method and what is reached.")]
pub struct TerrainCommand {
    /// Robots drawn from the file's spreads
    #[arg(long, value_name = "COUNT", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..))]
    robots: u32,
    #[command(flatten)]
    options: Options,
}

/// What came of all robots on a terrain.
#[derive(Serialize)]
struct Row {
    terrain: String,
    by_pose: Vec<Crossed>,
    in_turn: Vec<Crossed>,
}

impl TerrainCommand {
    pub fn run(&self) -> Done {
        self.options.fill(|out| self.walk(out))
    }

    fn walk(&self, out: &Path) -> Result<(), Report> {
        let settings = self.options.settings()?;
        let told = &settings.terrain;
        told.check()?;
        write(&out.join(SETTINGS), &settings.text())?;
        let sides = sides(&self.options.robot()?, &told.definition(), self.options.threads)?;
        let terrains = told.all();
        let bar = bar(2 * terrains.len(), 0);
        let mut rows = Vec::with_capacity(terrains.len());
        for terrain in terrains {
            bar.set_message(terrain.words());
            let on = terrain.robot(&self.options.common.robot, told.begins_m)?;
            let walked = |by_pose: bool| {
                let crossed = terrain::cross(&on, told, (sides, by_pose), self.robots as usize, self.options.threads);
                bar.inc(1);
                crossed
            };
            let row = Row { terrain: terrain.words(), by_pose: walked(true)?, in_turn: walked(false)? };
            if bar.is_hidden() {
                say(&row.terrain);
            }
            rows.push(row);
        }
        bar.finish_and_clear();
        write(&out.join(FOUND), &serde_json::to_string_pretty(&rows).into_diagnostic()?)?;
        if self.options.common.json {
            return print_json(&rows);
        }
        print(&shown(&rows, told.episode_s));
        written(out, &[FOUND, SETTINGS]);
        Ok(())
    }
}

fn shown(rows: &[Row], episode_s: f64) -> String {
    let header =
        ["terrain", "", "ahead / mm", "a tenth below", "off the line / mm", "a tenth above", "stood", "stopped"];
    let row = |terrain: &str, how: &str, crossed: &[Crossed]| {
        let quantile = |share: f64, of: fn(&Crossed) -> f64| {
            let mut values: Vec<f64> = crossed.iter().map(of).collect();
            common::statistics::quantile(&mut values, share).unwrap_or(f64::NAN)
        };
        let count = |is: &dyn Fn(&Crossed) -> bool| crossed.iter().filter(|one| is(one)).count().to_string();
        let ahead = |one: &Crossed| one.ahead_mm;
        let off = |one: &Crossed| one.off_mm;
        vec![
            terrain.to_owned(),
            how.to_owned(),
            // What is rounded to −0 is 0.
            format!("{:.0}", quantile(0.5, ahead).round() + 0.0),
            format!("{:.0}", quantile(0.1, ahead).round() + 0.0),
            format!("{:.1}", quantile(0.5, off)),
            format!("{:.1}", quantile(0.9, off)),
            count(&|one| one.ahead_mm.abs() < STANDS_MM),
            count(&|one| one.seconds < episode_s - 1e-6),
        ]
    };
    let both = |one: &Row| [row(&one.terrain, "by the pose", &one.by_pose), row("", "in turn", &one.in_turn)];
    table::columns(&header, rows.iter().flat_map(both))
}
