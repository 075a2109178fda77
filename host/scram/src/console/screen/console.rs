//! What the screen needs of a console; so that it can be tested with one that follows a script.

use crate::console::model::Model;
use crate::console::{Completion, Engine};
use link::{Line, LinkError};

/// A console, as the screen uses it. What each does: [`Engine`].
pub trait Console {
    /// Reads for some milliseconds and sends what is due, heartbeats too; whether something happened.
    ///
    /// # Errors
    /// There is nobody to talk to any more.
    fn poll(&mut self) -> Result<bool, LinkError>;
    /// What there is to show.
    fn model(&self) -> &Model;
    /// Does what was typed.
    ///
    /// # Errors
    /// What is wrong with it, for the person who typed it.
    fn submit(&mut self, line: &str) -> Result<(), String>;
    /// What could be meant at a byte of a line.
    fn complete(&self, line: &str, cursor: usize) -> Completion;
    /// Stops every robot, at once.
    fn stop_all(&mut self);
    /// Picks the robot that commands are for.
    fn select(&mut self, index: usize);
    /// Takes the last `set` of the selected robot back.
    ///
    /// # Errors
    /// There is none.
    fn undo(&mut self) -> Result<(), String>;
    /// `quit` was typed.
    fn wants_to_quit(&self) -> bool;
    /// Stops every robot that may be driving, waits for it, and ends the recording.
    fn finish(&mut self);
}

impl<L: Line> Console for Engine<L> {
    fn poll(&mut self) -> Result<bool, LinkError> {
        self.poll()
    }

    fn model(&self) -> &Model {
        self.model()
    }

    fn submit(&mut self, line: &str) -> Result<(), String> {
        self.submit(line)
    }

    fn complete(&self, line: &str, cursor: usize) -> Completion {
        self.complete(line, cursor)
    }

    fn stop_all(&mut self) {
        self.stop_all();
    }

    fn select(&mut self, index: usize) {
        self.select(index);
    }

    fn undo(&mut self) -> Result<(), String> {
        self.undo()
    }

    fn wants_to_quit(&self) -> bool {
        self.wants_to_quit()
    }

    fn finish(&mut self) {
        self.finish();
    }
}
