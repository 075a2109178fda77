//! `scram identify robot` on mean speeds of robots whose numbers differ from the file's, with the scatter of three repeats: speeds that
//! this simulator made, and speeds that MuJoCo's multibody made under another law of the feet. The seeds decide everything and were not
//! looked at.

use identify::robot::{Numbers, Options, RobotFit, Run, identify, simulate};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use robot_file::edit::Document;
use serde_json::json;
use sweep::Measured;

use super::PeerSetup;
use super::error_measures::{largest, percent};
use super::multibody::{Multibody, OtherLaw};
use super::peer::{PeerError, not_compared, root};
use crate::row::FigureRow;
use crate::walks::tables::{conditions, repeated, walked};
use crate::walks::truth::coordinate;

/// Where the seeds begin.
const FIRST_SEED: u64 = 83_000;
/// Robots of each kind: of the quick campaign, and of the whole.
const FEW: u64 = 1;
const ALL: u64 = 6;
/// What a held-out speed may be off by, root mean square, as a share of the largest.
const MOST: f64 = 0.05;
/// How many of the 90 % intervals must hold the truth.
const COVERAGE: std::ops::RangeInclusive<f64> = 0.85..=0.95;
/// MuJoCo's coarser step, s; the other one is half of it.
const COARSE_S: f64 = 5e-5;
/// A sphere's spring, and friction that is a fifth higher at rest.
const OTHER_LAW: OtherLaw<'static> = &[("exponent", 1.5), ("excess", 0.2), ("speed", 0.02)];

/// A robot, its truth and what was found.
struct Found {
    seed: u64,
    fit: RobotFit,
    /// By the numbers' paths, in the file's units.
    truth: Vec<(String, f64)>,
    /// Of the held-out conditions against the speeds without scatter, root mean square, share of the largest: vx, vy, yaw.
    off: [f64; 3],
}

/// One robot of each kind.
#[must_use]
pub fn quick_rows(bench: &PeerSetup) -> Vec<FigureRow> {
    rows_of(bench, FEW)
}

/// Six robots of each kind, with how many intervals hold the truth.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    rows_of(bench, ALL)
}

fn rows_of(bench: &PeerSetup, robots: u64) -> Vec<FigureRow> {
    let own: Vec<Found> = (FIRST_SEED..FIRST_SEED + robots).map(own).collect();
    let mut rows = vec![
        errors(
            &format!("{robots} robots identified from speeds of this simulator: held-out error vx/vy/yaw, worst"),
            &own,
        ),
        coverage(&own),
    ];
    let what = format!(
        "{robots} robots identified from speeds of MuJoCo's multibody with a sphere's foot spring and Stribeck friction: held-out \
         error vx/vy/yaw, worst"
    );
    let peers: Result<Vec<Found>, PeerError> = match &bench.peer {
        Ok(peer) => Multibody::build(peer).and_then(|multibody| {
            (FIRST_SEED + 500..FIRST_SEED + 500 + robots).map(|seed| theirs(peer, &multibody, seed)).collect()
        }),
        Err(why) => {
            rows.push(not_compared(&what, REQUIRED, why));
            return rows;
        }
    };
    rows.push(match peers {
        Ok(peers) => errors(&what, &peers),
        Err(why) => not_compared(&what, REQUIRED, &why),
    });
    rows
}

const REQUIRED: &str = "5 %";

fn document() -> Document {
    Document::load(&root().join("robot.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// Numbers drawn from what the file says of them.
fn drawn(random: &mut Pcg64, numbers: &Numbers) -> Vec<f64> {
    numbers.all.iter().map(|_| coordinate(random)).collect()
}

fn own(seed: u64) -> Found {
    let mut random = Pcg64::seed_from_u64(seed);
    let numbers = Numbers::new(&document(), false).unwrap_or_else(|error| panic!("{error}"));
    let run = Run { from_s: 1.0, to_s: 2.0, step_s: 1e-4 };
    // Of what is believed, what can be simulated: a foot that would sink is no robot.
    loop {
        let truth = drawn(&mut random, &numbers);
        let plan = numbers.plan(&truth).ok();
        if let Some(Some(speeds)) = simulate(&[plan], &conditions(), run).pop() {
            return found(&mut random, seed, (&numbers, &truth), &speeds);
        }
    }
}

fn theirs(peer: &super::peer::Peer, multibody: &Multibody, seed: u64) -> Result<Found, PeerError> {
    let mut random = Pcg64::seed_from_u64(seed);
    let numbers = Numbers::new(&document(), false).unwrap_or_else(|error| panic!("{error}"));
    let truth = drawn(&mut random, &numbers);
    let plan = numbers.plan(&truth).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
    let speeds = walked((peer, multibody), &format!("robot {seed}"), &plan, OTHER_LAW, COARSE_S)?;
    Ok(found(&mut random, seed, (&numbers, &truth), &speeds))
}

/// Three repeats of every condition, identified.
fn found(random: &mut Pcg64, seed: u64, (numbers, at): (&Numbers, &[f64]), speeds: &[[f64; 3]]) -> Found {
    let largest = largest(speeds);
    let runs = repeated(random, speeds).into_iter().map(|(at, speeds)| (at, speeds.map(Some)));
    let options = Options { seed: random.random(), ..Options::default() };
    let fit = identify(&document(), &Measured::of_runs(runs), &options).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
    let truth = numbers.all.iter().zip(at).map(|(number, at)| (number.path.clone(), number.at(*at))).collect();
    let held_out: Vec<_> = fit.conditions.iter().filter(|one| one.held_out).collect();
    let off = [0, 1, 2].map(|part| {
        let square = |one: &&identify::robot::ConditionFit| {
            let place = conditions().iter().position(|at| *at == (one.f_hz, one.alpha_deg)).unwrap_or(0);
            ((one.after[part] - speeds[place][part]) / largest[part]).powi(2)
        };
        (held_out.iter().map(square).sum::<f64>() / held_out.len() as f64).sqrt()
    });
    Found { seed, fit, truth, off }
}

fn errors(what: &str, found: &[Found]) -> FigureRow {
    let worst = |one: &Found| one.off.into_iter().fold(0.0, f64::max);
    let passed = found.iter().filter(|one| worst(one) <= MOST).count();
    let told = found.iter().map(|one| format!("{} {}", one.seed, percent(one.off))).collect::<Vec<_>>().join("; ");
    let misfits = found.iter().map(|one| format!("{:.2}", one.fit.misfit)).collect::<Vec<_>>().join(", ");
    let sets = found.iter().map(|one| one.fit.simulated).sum::<usize>() / found.len().max(1);
    FigureRow::new(
        what,
        REQUIRED,
        format!(
            "{passed} of {} within; {told}; misfit over repeats {misfits}; {sets} sets simulated each",
            found.len()
        ),
        passed == found.len(),
        json!({ "off": found.iter().map(|one| one.off).collect::<Vec<_>>() }),
    )
}

fn coverage(found: &[Found]) -> FigureRow {
    let holds = |(one, told_only): (&Found, bool)| {
        let of = one.fit.parameters.iter().filter(move |parameter| parameter.told || !told_only);
        let inside = |parameter: &&identify::robot::Parameter| {
            let truth =
                one.truth.iter().find(|(path, _)| *path == parameter.path).map_or(f64::NAN, |(_, truth)| *truth);
            (parameter.low..=parameter.high).contains(&truth)
        };
        (of.clone().filter(inside).count(), of.count())
    };
    let count = |told_only: bool| {
        let all = found.iter().map(|one| holds((one, told_only)));
        all.fold((0, 0), |total, one| (total.0 + one.0, total.1 + one.1))
    };
    let ((inside, all), (told_inside, told)) = (count(false), count(true));
    let share = inside as f64 / all.max(1) as f64;
    FigureRow::new(
        "of their numbers, 90 % intervals that hold the truth",
        "85 to 95 %",
        format!("{:.0} % of {all}; of the {told} that are told, {told_inside}", 100.0 * share),
        COVERAGE.contains(&share),
        json!({ "inside": inside, "all": all, "told_inside": told_inside, "told": told }),
    )
}
