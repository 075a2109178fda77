//! The same bits, however a run is shared out.

use hal_sim::body::{Ensemble, Precision, Settings, Snapshot};
use serde_json::json;

use super::PeerSetup;
use super::reference::{Condition, conditions, ensemble, speeds};
use crate::row::FigureRow;

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    [("f64", Precision::Double), ("f32", Precision::Single)].map(|(name, precision)| row(bench, name, precision)).into()
}

fn row(bench: &PeerSetup, name: &str, precision: Precision) -> FigureRow {
    let settings = Settings { precision, ..Settings::default() };
    let all = conditions();
    let one = bits(&speeds(&bench.robot, &all, settings, 1));
    let counts = [2, 3, 5, 24];
    let threads = counts.into_iter().all(|count| bits(&speeds(&bench.robot, &all, settings, count)) == one);
    let clone = cloned(bench, &all, settings);
    let moves = one.iter().flatten().any(|bits| f64::from_bits(*bits).abs() > 1e-3);
    FigureRow::new(
        &format!("speeds of a clone, and of 1, 2, 3, 5 and 24 threads, {name}"),
        "bit for bit the same",
        format!("threads: {}, clone: {}", word(threads), word(clone)),
        threads && clone && moves,
        json!({ "threads": threads, "clone": clone }),
    )
}

fn word(same: bool) -> &'static str {
    if same { "the same" } else { "DIFFERENT" }
}

fn bits(table: &[[f64; 3]]) -> Vec<[u64; 3]> {
    table.iter().map(|row| row.map(f64::to_bits)).collect()
}

/// Whether a clone that is made in mid-run and goes on in another thread does what the original does.
fn cloned(bench: &PeerSetup, all: &[Condition], settings: Settings) -> bool {
    let (mut bodies, drives) = ensemble(&bench.robot, all, settings);
    bodies.advance(3000, &drives);
    let copy = bodies.clone();
    let finish = |mut bodies: Ensemble| -> Vec<Snapshot> {
        bodies.advance(7000, &drives);
        (0..bodies.len()).map(|i| bodies.snapshot(i)).collect()
    };
    let (original, copy) = rayon::join(|| finish(bodies), || finish(copy));
    original == copy
}
