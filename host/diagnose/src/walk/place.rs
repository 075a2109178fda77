//! Where a simulated walk is wrong: by frequency, direction of the eccentric, α and speed.

use identify::robot::Table;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// A share of the speeds, and how far they are off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// What divides the speeds: `frequency_hz`, `direction`, `alpha_deg` or `speed`.
    pub by: String,
    /// Which part of them this is.
    pub at: String,
    /// Root mean square of their deviations, in units of what the means are known to.
    pub misfit: f64,
    /// That of all others.
    pub elsewhere: f64,
    /// How probable it is that deviations that are alike everywhere differ so much here.
    pub probability: f64,
}

/// A part is pointed to where chance does so once in twenty tables.
const POINTED: f64 = 0.05;
/// Names of the three speeds.
pub const SPEEDS: [&str; 3] = ["vx", "vy", "yaw"];

/// All parts, those where the walk is most clearly wrong first.
pub fn places(table: &Table, speeds: &[f64]) -> Vec<Place> {
    let squared = |(k, part, deviation): (usize, usize, f64)| {
        let (f, alpha) = table.conditions[k];
        (deviation * deviation, parts_of(f, alpha, part))
    };
    let all: Vec<(f64, [(&'static str, String); 4])> = table.deviations(speeds).map(squared).collect();
    let mut found = Vec::new();
    for by in 0..4 {
        let mut names: Vec<&String> = all.iter().map(|(_, parts)| &parts[by].1).collect();
        names.sort();
        names.dedup();
        if names.len() > 1 {
            found.extend(names.iter().map(|at| place(&all, by, at)));
        }
    }
    found.sort_by(|a, b| a.probability.total_cmp(&b.probability));
    found
}

/// The first of some places, if it is more than an accident among as many.
pub fn pointed(places: &[Place]) -> Option<&Place> {
    places.first().filter(|first| stands_out(first.probability, places.len()))
}

/// Whether the least of so many probabilities is more than an accident.
pub fn stands_out(probability: f64, of: usize) -> bool {
    probability * (of as f64) < POINTED
}

fn parts_of(f: f64, alpha: f64, part: usize) -> [(&'static str, String); 4] {
    let direction = if f > 0.0 { "clockwise" } else { "counter-clockwise" };
    [
        ("frequency_hz", f.abs().to_string()),
        ("direction", direction.into()),
        ("alpha_deg", alpha.to_string()),
        ("speed", SPEEDS[part].into()),
    ]
}

fn place(all: &[(f64, [(&'static str, String); 4])], by: usize, at: &str) -> Place {
    let mean = |here: bool| {
        let some: Vec<f64> =
            all.iter().filter(|(_, parts)| (parts[by].1 == at) == here).map(|(square, _)| *square).collect();
        (some.iter().sum::<f64>() / some.len().max(1) as f64, some.len() as f64)
    };
    let ((here, count), (elsewhere, others)) = (mean(true), mean(false));
    let probability = FisherSnedecor::new(count, others).map_or(1.0, |f| f.sf(here / elsewhere.max(f64::MIN_POSITIVE)));
    Place { by: all[0].1[by].0.into(), at: at.into(), misfit: here.sqrt(), elsewhere: elsewhere.sqrt(), probability }
}

#[cfg(test)]
mod tests {
    use identify::robot::Held;
    use sweep::Measured;

    use super::*;

    #[test]
    fn a_walk_that_is_wrong_at_one_frequency_is_wrong_there() {
        let conditions: Vec<(f64, f64)> = [6.0, -6.0, 7.0, -7.0, 8.0, -8.0]
            .iter()
            .flat_map(|f| [30.0, 60.0, 90.0].map(|alpha| (*f, alpha)))
            .collect();
        let runs = conditions.iter().flat_map(|at| (0..3).map(|k| (*at, [Some(10.0 + f64::from(k) - 1.0); 3])));
        let table = Table::new(&Measured::of_runs(runs), &Held::None).unwrap();
        let off = |wrong: &dyn Fn(f64, f64, usize) -> bool| -> Vec<Place> {
            let speed = |(n, (f, alpha)): (usize, &(f64, f64))| {
                [0, 1, 2].map(|part| {
                    10.0 + if n % 2 == 0 { 0.5 } else { -0.5 } * if wrong(*f, *alpha, part) { 5.0 } else { 1.0 }
                })
            };
            places(&table, &table.conditions.iter().enumerate().flat_map(speed).collect::<Vec<_>>())
        };
        let found = off(&|f, _, _| f.abs() == 6.0);
        let first = pointed(&found).expect("a place");
        assert_eq!((first.by.as_str(), first.at.as_str()), ("frequency_hz", "6"));
        assert!((first.misfit / first.elsewhere - 5.0).abs() < 1e-9, "{first:?}");
        let found = off(&|_, _, part| part == 2);
        assert_eq!(pointed(&found).map(|place| place.at.as_str()), Some("yaw"));
        assert_eq!(pointed(&off(&|_, _, _| true)), None, "wrong everywhere alike");
    }
}
