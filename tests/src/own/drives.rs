//! What the shaft is told in a run: every drive of `scram sim`, and scripts that mix them.

use std::path::Path;

use simulation::Drive;

/// Length of a run, s.
pub const RUN_S: f64 = 4.0;

/// Kinds of runs, as `--drive` takes them or as the lines of a script; frequencies for a shaft that reaches `top` Hz.
pub const KINDS: usize = 12;

/// A kind of run for a shaft that reaches `top` Hz, every time the same.
///
/// # Panics
/// A script of this file has a mistake.
#[must_use]
pub fn drive(kind: usize, top: f64) -> Drive {
    let f = |share: f64| format!("{:.2}", share * top);
    let text = match kind % KINDS {
        0 => format!("freq:{}", f(0.85)),
        1 => "duty:1".to_owned(),
        2 => "oscillate:-100..100".to_owned(),
        3 => format!("freq:-{}", f(0.75)),
        4 => format!("script: 0 freq {}; 1.5 freq -{}; 3 freq {}; 4.5 coast", f(0.9), f(0.6), f(0.45)),
        5 => "duty:-0.8".to_owned(),
        6 => "script: 0 duty 0.9; 1 duty 0.6; 2 duty -0.7; 3 duty -1; 4 duty 0.75; 5 coast".to_owned(),
        7 => "script: 0 oscillate -60..60; 2 oscillate -150..20; 4 oscillate -90..90".to_owned(),
        8 => "script: 0 position 90; 1 position -60; 2 position 150; 3 position 20; 4 position -120; 5 position 45"
            .to_owned(),
        9 => format!("script: 0 freq {}; 1 coast; 2 freq -{}; 3 idle; 4 freq {}; 5 coast", f(0.85), f(0.85), f(0.7)),
        10 => format!("freq:{}", f(0.6)),
        _ => "script: 0 duty 1; 0.6 duty -1; 1.2 duty 1; 2.0 duty -0.65; 3 duty 0.65; 4 duty 1; 5 coast".to_owned(),
    };
    let parsed = match text.strip_prefix("script:") {
        Some(lines) => Drive::parse_script(&lines.replace(';', "\n"), Path::new("drives.rs")),
        None => Drive::parse(&text),
    };
    parsed.unwrap_or_else(|error| panic!("{text}: {error}"))
}
