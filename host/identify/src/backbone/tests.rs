//! Mechanics, on oscillations that the model itself made: what was put in comes out. Whether it holds against another simulator's
//! is the system tests' business (`tests/src/body/backbone.rs`).

use std::path::Path;
use std::sync::atomic::AtomicBool;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use robot_file::Robot;

use super::rig::{Release, Rig, START, between, rotation_vector};
use super::*;

/// Gravity would make an axis swing that nobody pulled at.
const WITHOUT: Options = Options { module: None, gravity: Gravity::None, method: Method::LeastSquares };

fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap()
}

/// The oscillation of hinges that are these factors on the file's, at 150 frames a second, one in ten of them lost.
fn made(factors: [f64; 6], start: [f64; START], noise: f64, held_s: f64, seed: u64) -> Oscillation {
    let stop = AtomicBool::new(false);
    let rig = Rig::new(&robot(), None, WITHOUT.gravity, &stop).unwrap();
    let file = rig.file();
    let hinges = std::array::from_fn(|k| file[k] * factors[k]);
    let points = rig.oscillations(&[Release { hinges, start, seconds: 1.5 }]).unwrap().remove(0);
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let normal = Normal::new(0.0, noise).unwrap();
    let mut run = Oscillation { name: format!("run {seed}"), t_s: Vec::new(), angles: Vec::new() };
    for k in 0..225 {
        let t = k as f64 / 150.0;
        let angles = if t < held_s { points[0] } else { between(&points, t - held_s) };
        if random.random_range(0..10) == 0 {
            continue;
        }
        run.t_s.push(t);
        run.angles.push(angles.map(|angle| angle + 0.01 + normal.sample(&mut random)));
    }
    run
}

#[test]
fn what_was_put_in_comes_out_of_one_run_with_all_axes_at_once() {
    let factors = [1.7, 0.6, 0.5, 0.5, 1.3, 0.7];
    let mut start = [0.0; START];
    (start[0], start[1], start[3], start[4]) = (0.25, 0.1, 0.2, 0.05);
    let runs: Vec<Oscillation> = (1..=3).map(|seed| made(factors, start, 1e-3, 0.2, seed)).collect();
    let fit = identify(&robot(), &runs[..2], &runs[2..], WITHOUT).unwrap();
    for (k, (hinge, factor)) in fit.hinges.iter().zip(factors).enumerate() {
        let truth = hinge.file * factor;
        let bar = if k < 3 { 0.005 } else { 0.03 };
        assert!((hinge.value / truth - 1.0).abs() < bar, "{}: {} for {truth}", hinge.field, hinge.value);
        let Interval { low, high } = hinge.interval.unwrap();
        assert!(hinge.told && low < hinge.value && hinge.value < high && high / low < 1.3, "{hinge:?}");
    }
    assert!((0.9..1.1).contains(&(fit.noise_rad[1].unwrap() / 1e-3)), "{:?}", fit.noise_rad);
    let held_out = &fit.held_out[0];
    assert!(held_out.after_rad < 1.15 * fit.floor_rad && held_out.before_rad > 5.0 * fit.floor_rad, "{held_out:?}");
}

#[test]
fn an_axis_that_does_not_swing_tells_nothing() {
    let mut start = [0.0; START];
    start[3] = 0.2;
    let runs = [made([1.0, 1.0, 1.2, 1.0, 1.0, 1.0], start, 2e-3, 0.0, 5)];
    let fit = identify(&robot(), &runs, &[], WITHOUT).unwrap();
    let told: Vec<bool> = fit.hinges.iter().map(|hinge| hinge.told).collect();
    assert_eq!(told, [false, false, true, false, false, true], "{:#?}", fit.hinges);
    assert!((fit.hinges[2].value / (1.2 * fit.hinges[2].file) - 1.0).abs() < 0.01);
}

/// Bayesian optimisation with a seed and so many sets of numbers.
fn by_bayes(seed: u64, evaluations: usize) -> Options {
    Options { method: Method::Bayes(Search { seed, evaluations }), ..WITHOUT }
}

#[cfg(not(feature = "bayes"))]
#[test]
fn a_program_without_bayesian_optimisation_says_how_to_get_it() {
    let error = identify(&robot(), &[made([1.0; 6], [0.1; START], 1e-3, 0.0, 1)], &[], by_bayes(1, 120)).unwrap_err();
    assert_eq!(error, BackboneError::WithoutBayes);
    assert!(miette::Diagnostic::help(&error).unwrap().to_string().contains("--features bayes"));
}

#[cfg(feature = "bayes")]
#[test]
fn bayesian_optimisation_finds_what_was_put_in_and_gives_no_intervals() {
    let factors = [0.75, 0.8, 1.35, 0.5, 0.7, 0.8];
    let mut start = [0.0; START];
    (start[0], start[1], start[3], start[4]) = (0.25, 0.1, 0.2, 0.05);
    let runs = [made(factors, start, 1e-3, 0.2, 1), made(factors, start, 1e-3, 0.2, 2)];
    let fit = identify(&robot(), &runs[..1], &runs[1..], by_bayes(7, 120)).unwrap();
    for (k, (hinge, factor)) in fit.hinges.iter().zip(factors).enumerate() {
        let truth = hinge.file * factor;
        let bar = if k < 3 { 0.02 } else { 0.2 };
        assert!((hinge.value / truth - 1.0).abs() < bar, "{}: {} for {truth}", hinge.field, hinge.value);
        assert!(hinge.told && hinge.interval.is_none(), "{hinge:?}");
    }
    assert_eq!(fit.evaluations, Some(120));
    assert!(fit.held_out[0].before_rad > 3.0 * fit.held_out[0].after_rad, "{:?}", fit.held_out);
}

#[cfg(feature = "bayes")]
#[test]
fn bayes_finds_the_same_numbers_with_the_same_seed_leaves_what_does_not_swing_and_refuses_too_few_evaluations() {
    let mut start = [0.0; START];
    start[3] = 0.2;
    let mut run = made([1.0, 1.0, 1.2, 1.0, 1.0, 1.0], start, 2e-3, 0.0, 5);
    run.angles.iter_mut().for_each(|angles| angles[0] = f64::NAN);
    let fewest = Search::FEWEST;
    let by = |seed, evaluations| identify(&robot(), &[run.clone()], &[], by_bayes(seed, evaluations));
    let fit = by(1, fewest).unwrap();
    let told: Vec<bool> = fit.hinges.iter().map(|hinge| hinge.told).collect();
    assert_eq!(told, [false, false, true, false, false, true], "{:#?}", fit.hinges);
    assert!(fit.hinges.iter().all(|hinge| hinge.told || hinge.value == hinge.file), "{:#?}", fit.hinges);
    assert_eq!(by(1, fewest).unwrap().hinges, fit.hinges);
    assert_ne!(by(2, fewest).unwrap().hinges, fit.hinges);
    let refused = by(1, fewest - 1).unwrap_err();
    assert_eq!(refused, BackboneError::TooFew { evaluations: fewest - 1, fewest });
}

#[test]
fn a_fit_that_is_stopped_says_so_and_simulates_nothing_more() {
    let mut start = [0.0; START];
    start[3] = 0.2;
    let runs = [made([1.0; 6], start, 2e-3, 0.0, 5)];
    let error = identify_until(&robot(), &runs, &[], WITHOUT, &AtomicBool::new(true)).unwrap_err();
    assert_eq!(error, BackboneError::Stopped);
}

#[test]
fn unusable_runs_are_refused_by_name() {
    let says = |run: Oscillation, words: &str| {
        let error = identify(&robot(), &[run], &[], Options::default()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let mut start = [0.0; START];
    start[3] = 0.2;
    let good = made([1.0; 6], start, 1e-3, 0.0, 1);
    let short = Oscillation { t_s: good.t_s[..10].to_vec(), angles: good.angles[..10].to_vec(), ..good.clone() };
    says(short, "run 1: 10 samples");
    let degrees = good.angles.iter().map(|angles| angles.map(f64::to_degrees)).collect();
    says(Oscillation { angles: degrees, ..good.clone() }, "rad: a backbone's end does not turn");
    let mut back = good.clone();
    back.t_s[5] = back.t_s[4];
    says(back, "time does not increase at sample 5");
    assert_eq!(identify(&robot(), &[], &[], Options::default()), Err(BackboneError::Nothing));
    let options = Options { module: Some(9), ..Options::default() };
    assert!(identify(&robot(), &[good], &[], options).unwrap_err().to_string().contains("no module 9"));
}

#[test]
fn a_rotation_vector_is_axis_times_angle() {
    let (sin, cos) = 0.7_f64.sin_cos();
    let about_y = rotation_vector([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]);
    assert!((about_y[1] - 0.7).abs() < 1e-12 && about_y[0].abs() + about_y[2].abs() < 1e-12, "{about_y:?}");
}
