//! On recordings of a real geared motor: a Dynamixel XL330 swinging a pendulum (Rhoban), position gains left out in turn.

use std::path::{Path, PathBuf};

use robot_file::Robot;
use testbed::peers::skip_anywhere;

use super::*;

const TRAJECTORIES: [&str; 4] = ["lift_and_drop", "sin_sin", "sin_time_square", "up_and_down"];
const GAINS: [u32; 4] = [100, 200, 400, 800];

/// The data, or `None` where they are missing: they belong to others and are no part of this project.
fn data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/xl330_csv");
    if folder.is_dir() {
        return Some(folder);
    }
    skip_anywhere(&format!("{} is missing", folder.display()));
    None
}

/// Every run whose position gain is wanted.
fn runs(folder: &Path, wanted: impl Fn(u32) -> bool) -> Vec<Recording> {
    GAINS
        .into_iter()
        .filter(|gain| wanted(*gain))
        .flat_map(|gain| TRAJECTORIES.map(|name| folder.join(format!("{name}_kp{gain}.csv"))))
        .map(|path| recording::read_csv(&path).unwrap())
        .collect()
}

#[test]
#[ignore = "six minutes: .ci/long"]
fn load_friction_is_named_on_the_xl330_whichever_gain_is_held_out() {
    let Some(folder) = data() else { return };
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-xl330.toml")).unwrap();
    for left_out in GAINS {
        let (fit, held_out) = (runs(&folder, |gain| gain != left_out), runs(&folder, |gain| gain == left_out));
        let clock = std::time::Instant::now();
        let diagnosis = diagnose(&robot, &fit, &held_out, &Options::default()).unwrap();
        eprintln!(
            "gain {left_out} held out: {:?} {:?}, floor {:.3}°, before {:.3}°, after {:.3}°, {:.1?}",
            diagnosis.verdict,
            diagnosis.causes.iter().map(|cause| (&cause.effect, &cause.also)).collect::<Vec<_>>(),
            diagnosis.noise_floor.to_degrees(),
            diagnosis.before.to_degrees(),
            diagnosis.after.to_degrees(),
            clock.elapsed()
        );
        for one in &diagnosis.detail.nominal {
            eprintln!("    {} {:.5} [{:.5} {:.5}]", one.path, one.value, one.low, one.high);
        }
        for one in diagnosis.detail.candidates.iter().take(10) {
            eprintln!("    {:?} {:.2} {:.0?}", one.effects, one.ratio_to_floor, one.improvement_percent);
        }
        let [cause] = diagnosis.causes.as_slice() else { panic!("one cause, not {:?}", diagnosis.causes) };
        assert_eq!((cause.effect.as_str(), cause.also.len()), ("load_friction", 0));
        assert_eq!(diagnosis.verdict, Verdict::Unexplained, "something is left, and is said to be");
        assert!(diagnosis.left_over.is_some());
        assert!(diagnosis.after < 0.85 * diagnosis.before, "removes at least 15 %");
    }
}

#[test]
fn the_xl330_passes_the_check_of_its_rig_and_its_mistakes_do_not() {
    let Some(folder) = data() else { return };
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-xl330.toml")).unwrap();
    let recorded = runs(&folder, |_| true);
    let right = check_rig(&robot, &recorded);
    assert_eq!((right.findings.as_slice(), right.unchecked.len()), (&[][..], 0), "{:?}", right.unchecked);
    let with = |factor: f64, time: f64| {
        let mut runs = recorded.clone();
        for run in &mut runs {
            let recording::AngleReading::Angle(angles) = &mut run.angle else { panic!("angles") };
            angles.iter_mut().for_each(|angle| *angle = angle.map(|angle| factor * angle));
            run.t_s.iter_mut().for_each(|t_s| *t_s *= time);
        }
        check_rig(&robot, &runs).findings
    };
    let causes = |findings: &[Finding]| format!("{:?}", findings.iter().map(|one| &one.mends).collect::<Vec<_>>());
    for (factor, time, cause) in [
        (-1.0, 1.0, "ReversedSign"),
        (180.0 / std::f64::consts::PI, 1.0, "AngleUnit(\"deg\")"),
        (1.0, 1000.0, "TimeUnit(\"ms\")"),
    ] {
        let findings = with(factor, time);
        assert!(causes(&findings).contains(cause), "{cause}: {}", causes(&findings));
    }
}
