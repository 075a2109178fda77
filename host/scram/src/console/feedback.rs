//! A policy that drives a robot by its poses.

use std::path::Path;
use std::time::Duration;

use learn::{PolicyFile, PolicyPlayer};
use miette::Diagnostic;
use robot_file::gait::GaitStep;

use super::poses::Seen;

/// A robot whose poses stay away for so long is stopped: what drives it no longer knows where it is.
const PATIENCE: Duration = Duration::from_millis(300);

/// A policy in play.
pub(super) struct Feedback {
    /// The robot that it drives.
    pub robot: usize,
    /// The policy's file.
    pub name: String,
    player: PolicyPlayer,
    /// When it acts next.
    due: Option<Duration>,
    given: Option<GaitStep>,
}

/// What a policy does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Act {
    /// The robot goes on as it is.
    Nothing,
    /// It is given this.
    Give(GaitStep),
    /// There is no pose to act by.
    Blind,
}

impl Feedback {
    /// Reads a policy for a robot.
    pub fn load(path: &str, robot: usize) -> Result<Self, String> {
        let said = |error: &dyn Diagnostic| match error.help() {
            Some(help) => format!("{error}: {help}"),
            None => error.to_string(),
        };
        let player = PolicyFile::load(Path::new(path)).and_then(PolicyPlayer::new).map_err(|error| said(&error))?;
        Ok(Self { robot, name: path.to_owned(), player, due: None, given: None })
    }

    /// What it does now, with the robot's last pose; `settled` says that what it gave before has come to its end.
    pub fn act(&mut self, now: Duration, last: Option<Seen>, settled: bool) -> Act {
        let Some(seen) = last.filter(|seen| now.saturating_sub(seen.at) <= PATIENCE) else { return Act::Blind };
        if !settled || self.due.is_some_and(|due| now < due) {
            return Act::Nothing;
        }
        let interval = Duration::from_secs_f64(self.player.interval_s());
        // Late once is not late for ever, but what was missed is not made up for.
        self.due = Some(self.due.map_or(now, |due| due.max(now.saturating_sub(interval))) + interval);
        let step = self.player.act(seen.pose);
        if self.given.replace(step) == Some(step) { Act::Nothing } else { Act::Give(step) }
    }
}
