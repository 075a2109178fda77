//! `scram sweep --sensitivity` as it is without other options, files and plots and all, against the clock.

use std::time::Instant;

use hal_sim::body::Precision;
use plot::figures;
use robot_file::edit::Document;
use serde_json::json;
use sweep::{Campaign, Design, DriveKind, RunSettings, SweepError, Target, VariantBuilder};

use super::PeerSetup;
use super::peer::root;
use crate::row::FigureRow;

/// How long it may take, s.
const MOST_S: f64 = 5.0;
/// On so many cores.
const THREADS: usize = 2;

/// Runs the campaign; the table has one row.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let what = "the default `scram sweep --sensitivity` (24 conditions × 3 seeds × 2 s, twice), two threads, wall time";
    let start = Instant::now();
    let done = swept(bench);
    let wall_s = start.elapsed().as_secs_f64();
    let (measured, holds) = match done {
        Ok(runs) => (format!("{wall_s:.2} s for {runs} runs"), wall_s <= MOST_S && runs == 144),
        Err(why) => (why, false),
    };
    vec![FigureRow::new(what, "5 s", measured, holds, json!({ "wall_s": wall_s }))]
}

/// How many runs have speeds.
fn swept(bench: &PeerSetup) -> Result<usize, String> {
    let told = |error: SweepError| error.to_string();
    let file = root().join("robot.toml");
    let document = Document::load(&file).map_err(|error| error.to_string())?;
    let workshop = VariantBuilder::new(document, bench.robot.clone()).map_err(|error| error.to_string())?;
    let mut axes = Design::thesis();
    axes.push(Design::friction_axis());
    let settings = RunSettings { drive: DriveKind::Motor, seconds: 2.0, step_s: 1e-4, precision: Precision::Double };
    let campaign = Campaign::new(&workshop, Design::product(axes, vec![1, 2, 3]), settings).map_err(told)?;
    let directory = bench.out.join("sweep");
    std::fs::create_dir_all(&directory).map_err(|error| error.to_string())?;
    let target = Target { directory: &directory, stem: "sweep", paths: true, fresh: true };
    let swept = campaign.run(&target, Some(THREADS), &mut |_, _| ()).map_err(told)?;
    for (name, svg) in figures::draw(&swept, None).map_err(|error| error.to_string())? {
        std::fs::write(directory.join(format!("{name}.svg")), svg).map_err(|error| error.to_string())?;
    }
    Ok(swept.runs.iter().filter(|run| run.measures.vx.is_some()).count())
}
