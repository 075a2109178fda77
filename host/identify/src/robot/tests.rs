//! Mechanics, on speeds that the simulation itself made with other numbers. Whether it holds against other simulators is the
//! campaigns' business (`cargo body-figures --only robots`).

use std::path::Path;

use hal_sim::random::{Source, Stream};
use robot_file::edit::Document;
use sweep::{ALPHAS, FREQUENCIES, Measured};

use super::numbers::Numbers;
use super::walk::{Run, speeds};
use super::*;

fn conditions() -> Vec<(f64, f64)> {
    ALPHAS.iter().flat_map(|alpha| FREQUENCIES.map(|f| (f, *alpha))).collect()
}

const SHORT: Options = Options {
    held: Held::OneInFour,
    uneven: false,
    window_s: (0.3, 0.6),
    step_s: 2e-4,
    seed: 1,
    draws: 30,
    threads: 0,
    keep_in: None,
    progress: None,
};

fn document() -> Document {
    Document::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap()
}

/// Three repeats, 0.15 mm/s or °/s apart, of a robot whose numbers lie at these deviations from the file's.
fn measured(coordinates: &[(&str, f64)]) -> Measured {
    let numbers = Numbers::new(&document(), false).unwrap();
    let at: Vec<f64> = numbers
        .all
        .iter()
        .map(|number| coordinates.iter().find(|(path, _)| *path == number.path).map_or(0.0, |(_, at)| *at))
        .collect();
    let run = Run::new(SHORT.window_s, SHORT.step_s).unwrap();
    let all = speeds(&[numbers.plan(&at).ok()], &conditions(), run).remove(0).unwrap();
    let mut draws = Stream::new(5, Source::Variation);
    let mut repeat =
        || all.iter().map(|speeds| speeds.map(|speed| Some(speed + 0.15 * draws.normal()))).collect::<Vec<_>>();
    Measured::of_runs((0..3).flat_map(|_| conditions().into_iter().zip(repeat())).collect::<Vec<_>>())
}

#[test]
fn speeds_are_told_between_two_times_that_lie_apart() {
    let few = Measured::of_runs([]);
    for window_s in [(2.0, 1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, 1.02), (0.0, f64::INFINITY), (f64::NAN, 1.0)] {
        let error = Run::new(window_s, 2e-4).unwrap_err();
        assert!(matches!(error, RobotError::Window { .. }), "{window_s:?}: {error}");
        // Whatever else is wrong.
        let error = identify(&document(), &few, &Options { window_s, ..SHORT }).unwrap_err();
        assert!(matches!(error, RobotError::Window { .. }), "{window_s:?}: {error}");
    }
    for window_s in [(0.0, 0.05), (0.3, 0.35), (1.0, 2.0)] {
        assert!(Run::new(window_s, 2e-4).is_ok(), "{window_s:?}");
    }
}

#[test]
fn another_robots_friction_and_stiffness_show_in_its_speeds() {
    let truth = [("ground.friction", -0.8), ("backbone.soft_nm_per_rad", 0.7), ("eccentric.mass_kg", -0.5)];
    let directory = tempfile::tempdir().unwrap();
    let options = Options { keep_in: Some(directory.path().into()), ..SHORT };
    let fit = identify(&document(), &measured(&truth), &options).unwrap();
    let errors: Vec<&ComponentError> = fit.held_out.iter().flatten().collect();
    assert!(errors.iter().all(|error| error.after < 0.05), "{errors:?}");
    let sum = |of: fn(&ComponentError) -> f64| errors.iter().map(|error| of(error)).sum::<f64>();
    assert!(sum(|error| error.before) > 3.0 * sum(|error| error.after), "{errors:?}");
    assert!(fit.thesis_loss[1] < 0.3 * fit.thesis_loss[0], "{:?}", fit.thesis_loss);
    assert!((0.2..3.0).contains(&fit.misfit), "{}", fit.misfit);
    let mass = fit.parameters.iter().find(|one| one.path == "eccentric.mass_kg").unwrap();
    assert!(mass.low < mass.value && mass.value < mass.file, "{mass:?}");
    assert!(fit.document.robot().unwrap().eccentric.unwrap().mass_kg.source.contains("identify robot"));
    assert_eq!(fit.conditions.iter().filter(|one| one.held_out).count(), 6);
    // Once more: everything is known already, and the same comes out.
    let again = identify(&document(), &measured(&truth), &options).unwrap();
    assert_eq!((again.simulated, again.parameters), (fit.simulated, fit.parameters));
}

#[test]
fn what_cannot_be_used_is_said() {
    let few = Measured::of_runs([((7.0, 60.0), [Some(1.0); 3]), ((8.0, 60.0), [Some(2.0); 3])]);
    assert!(identify(&document(), &few, &SHORT).unwrap_err().to_string().contains("2 conditions"));
    let bench = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-linear.toml");
    let error = identify(&Document::load(&bench).unwrap(), &measured(&[]), &SHORT).unwrap_err();
    assert!(error.to_string().contains("no [body]"), "{error}");
    let options = Options { step_s: 5e-3, ..SHORT };
    let error = identify(&document(), &measured(&[]), &options).unwrap_err().to_string();
    assert!(error.contains("cannot be simulated"), "{error}");
}
