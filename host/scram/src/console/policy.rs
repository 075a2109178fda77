//! A policy that drives a robot by its poses.

use std::path::Path;
use std::time::Duration;

use learn::{PolicyFile, PolicyPlayer};
use miette::Diagnostic;
use robot_file::gait::GaitStep;

use super::poses::Received;

/// A robot whose poses stay away for so long is stopped: what drives it no longer knows where it is.
pub(super) const PATIENCE: Duration = Duration::from_millis(300);

/// A policy that drives.
pub(super) struct PolicyDrive {
    /// The robot that it drives.
    pub robot: usize,
    /// The policy's file.
    pub name: String,
    /// Who learned it, for people.
    pub learned_by: String,
    player: PolicyPlayer,
    /// When it chooses next.
    due: Option<Duration>,
    chosen: Option<GaitStep>,
}

/// What a policy wants of its robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Choice {
    /// To go on as before.
    Same,
    /// To do this from now on.
    New(GaitStep),
    /// There is no pose to choose by.
    NoPose,
}

impl PolicyDrive {
    /// Reads a policy for a robot.
    pub fn load(path: &str, robot: usize) -> Result<Self, String> {
        let said = |error: &dyn Diagnostic| match error.help() {
            Some(help) => format!("{error}: {help}"),
            None => error.to_string(),
        };
        let file = PolicyFile::load(Path::new(path)).map_err(|error| said(&error))?;
        let alpha = file.settings.turn.alpha_deg.map(|alpha| format!(" at α {alpha}°")).unwrap_or_default();
        let learned_by = format!("{}{alpha}", file.robot);
        let player = PolicyPlayer::new(file).map_err(|error| said(&error))?;
        Ok(Self { robot, name: path.to_owned(), learned_by, player, due: None, chosen: None })
    }

    /// What it wants now, with the robot's last pose; `settled` says that what it wanted before has come to its end.
    pub fn choose(&mut self, now: Duration, last: Option<Received>, settled: bool) -> Choice {
        let Some(last) = last.filter(|last| now.saturating_sub(last.at) <= PATIENCE) else { return Choice::NoPose };
        if !settled || self.due.is_some_and(|due| now < due) {
            return Choice::Same;
        }
        let interval = Duration::from_secs_f64(self.player.interval_s());
        // Late once is not late for ever, but what was missed is not made up for.
        self.due = Some(self.due.map_or(now, |due| due.max(now.saturating_sub(interval))) + interval);
        let step = self.player.act(last.pose);
        if self.chosen.replace(step) == Some(step) { Choice::Same } else { Choice::New(step) }
    }
}
