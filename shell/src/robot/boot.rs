//! From the parameters in flash to a controller.

use core::ops::Range;

use control::protocol::radio::{NAME, Reset, Source};
use control::{Controller, ParameterError};
use embedded_storage_async::nor_flash::NorFlash;
use heapless::String;

use super::Settings;
use crate::store;

/// What a status says that does not change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct About {
    /// The robot's name.
    pub name: String<NAME>,
    /// Why the processor started.
    pub reset: Reset,
    /// Where the parameters came from.
    pub parameters: Source,
}

/// Makes the controller from the parameters in a range of the flash, or from the factory's. The bridge must be off.
///
/// Whatever the reset's reason, the controller begins in [`Fault::Restarted`](control::Fault::Restarted) and needs a
/// `ClearFault`: a host repeats the command that it holds, and without that the motor would start by itself. There is no
/// reason for which that is wanted: after a panic, the watchdog or a brown-out it would start into what caused them, and
/// to these chips a loose battery or somebody's finger on the reset button is a power-up like the first.
///
/// Without a controller the control loop cannot start: run the other tasks, and the LED says so. A build script that
/// calls [`Settings::check`] leaves no way for that to happen.
pub async fn boot<F: NorFlash>(
    flash: &mut F,
    range: Range<u32>,
    settings: &Settings,
    reset: Reset,
) -> (About, Result<Controller, ParameterError>) {
    let (parameters, source) = store::load(flash, range, &settings.parameters).await;
    let about = About { name: settings.name.clone(), reset, parameters: source };
    (about, Controller::restarted(&parameters))
}
