//! What a command acts on: the robots, what is shown of them, and the recording.

use link::{Line, Session};
use recording::SessionEvent;

use super::model::Model;
use super::session_log::SessionLog;

/// The parts of the console that a command may use.
pub(super) struct Context<'a, L: Line> {
    pub session: &'a mut Session<L>,
    pub model: &'a mut Model,
    /// Where nothing is recorded, there is none.
    pub session_log: Option<&'a mut SessionLog>,
}

impl<L: Line> Context<'_, L> {
    /// Adds an event to the recording, of one robot or of the console.
    pub fn record_event(&mut self, robot: Option<usize>, event: &SessionEvent) {
        let now = self.session.now();
        if let Some(session_log) = &mut self.session_log {
            session_log.event(robot, event, now);
        }
    }
}
