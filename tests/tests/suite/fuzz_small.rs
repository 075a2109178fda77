//! Every decoder on its corpus and some seeded inputs. More of them: `cargo fuzz-minute`; much more: `fuzz/README.md`.

use fuzz_cases::TARGETS;
use system_tests::fuzz::watch::Watch;
use system_tests::fuzz::{Until, keep, run};

const SEED: u64 = 20;

#[track_caller]
fn bears(name: &str, inputs: u64) {
    let target = TARGETS.iter().find(|target| target.name == name).expect("a target");
    let report = run(target, SEED, Until::Inputs(inputs), &Watch::start()).expect("its corpus");
    println!("{name}: {} inputs in {:?}, the slowest in {:?}", report.executions, report.time, report.slowest);
    if let Some((input, problem)) = report.crash {
        let file = keep(name, &input).map_or_else(|error| error.to_string(), |path| path.display().to_string());
        panic!("{problem}\non {file}");
    }
}

/// One test a target: they run beside each other, and a failure says whose it is.
macro_rules! targets {
    ($($name:ident: $inputs:literal),* $(,)?) => {
        $(#[test]
        fn $name() {
            bears(stringify!($name), $inputs);
        })*

        #[test]
        fn none_is_forgotten() {
            let here = [$(stringify!($name)),*];
            assert_eq!(TARGETS.iter().map(|target| target.name).collect::<Vec<_>>(), here);
            for name in here {
                let file = system_tests::fuzz::room().join("fuzz_targets").join(name).with_extension("rs");
                assert!(file.is_file(), "{} is missing", file.display());
            }
        }
    };
}

targets! {
    serial: 5000,
    air_robot: 3000,
    air_console: 3000,
    session: 2000,
    robot_commands: 2000,
    recording_mcap: 3000,
    recording_csv: 3000,
    import: 3000,
    robot_file: 1000,
    console_line: 3000,
    script: 2000,
    keys_file: 3000,
    store: 2000,
}
