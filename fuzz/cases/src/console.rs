//! What a person types, and scripts.

use std::path::Path;
use std::time::Duration;

use scram::console::check;
use simulation::Drive;

use crate::scratch::Scratch;
use crate::scripted_peer::console;

/// Any text in the line, as far as it is UTF-8; before it a byte for the cursor.
pub fn console_line(data: &[u8]) {
    let Some((cursor, text)) = data.split_first() else { return };
    let Ok(line) = std::str::from_utf8(text) else { return };
    if let Err(problem) = check(line) {
        assert!(!problem.is_empty());
    }
    // What begins with a slash would list directories of this computer.
    if line.contains('/') {
        return;
    }
    let (console, _) = console();
    let cursor = usize::from(*cursor);
    let completion = console.complete(line, cursor);
    let end = (0..=cursor.min(line.len())).rev().find(|at| line.is_char_boundary(*at)).unwrap_or(0);
    assert!(completion.start <= end && line.is_char_boundary(completion.start), "{completion:?} at {cursor}");
    for candidate in completion.candidates.iter().take(3) {
        let chosen = format!("{}{}{}", &line[..completion.start], candidate.text, &line[end..]);
        let _ = check(&chosen);
    }
}

/// Any bytes as a gait script, for the console and for the simulation.
pub fn script(data: &[u8]) {
    let scratch = Scratch::new();
    let path = scratch.file("gait", data);
    let (mut console, cable) = console();
    if console.run_script(&path).is_ok() {
        // No robot is there: every command ends by itself, and the times pass.
        for _ in 0..50 {
            cable.scripted_peer().wait(Duration::from_millis(300));
            if console.poll().is_err() {
                break;
            }
        }
        console.stop_all();
    }
    if let Ok(text) = std::str::from_utf8(data) {
        let _ = Drive::parse_script(text, Path::new("gait"));
    }
}
