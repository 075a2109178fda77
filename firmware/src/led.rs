//! The status LED, lit by a high pin.

use esp_hal::gpio::{AnyPin, Level, Output, OutputConfig};
use shell::board::Led;

/// The LED on its pin.
pub struct StatusLed(Output<'static>);

impl StatusLed {
    /// Creates the LED, off.
    #[must_use]
    pub fn new(pin: AnyPin<'static>) -> Self {
        Self(Output::new(pin, Level::Low, OutputConfig::default()))
    }
}

impl Led for StatusLed {
    fn set(&mut self, on: bool) {
        self.0.set_level(on.into());
    }
}
