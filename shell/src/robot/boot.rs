//! From what is in flash to a controller and its console.

use control::protocol::radio::{NAME, Reset, Source};
use control::{Controller, ParameterError};
use embedded_storage_async::nor_flash::NorFlash;
use heapless::String;

use super::Settings;
use crate::store::pairing::{Pairing, Unpaired};
use crate::store::{self, Partitions};

/// What a status says that does not change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct About {
    /// Name from the robot file, at most 32 bytes.
    pub name: String<NAME>,
    /// Why the processor started.
    pub reset: Reset,
    /// Where the parameters came from.
    pub parameters: Source,
}

/// What a robot starts with.
#[derive(Clone, Debug)]
pub struct Booted {
    /// What the robot reports in its status.
    pub about: About,
    /// What decides. Without one the control loop cannot start: run the other tasks, and the LED says so. A build script
    /// that calls [`Settings::check`] leaves no way for that to happen.
    pub controller: Result<Controller, ParameterError>,
    /// Whom it obeys. Paired with nobody, it has no use for the radio's tasks.
    pub pairing: Result<Pairing, Unpaired>,
}

/// Makes the controller from the parameters in flash, or from the factory's, with the gait in flash if it can play it, and looks
/// for the pairing. The bridge must be off.
///
/// Whatever the reset's reason, the controller begins in [`Fault::Restarted`](control::Fault::Restarted) and needs a
/// `ClearFault`: the console may not have noticed, and the person who drove before did not ask for it to go on. There is no
/// reason for which that is wanted: after a panic, the watchdog or a brown-out the motor would start into what caused them,
/// and to these chips a loose battery or somebody's finger on the reset button is a power-up like the first.
pub async fn boot<F: NorFlash>(flash: &mut F, partitions: &Partitions, settings: &Settings, reset: Reset) -> Booted {
    let (parameters, source) =
        store::parameters::load(flash, partitions.parameters.clone(), &settings.parameters).await;
    let mut controller = Controller::restarted(&parameters, &settings.parameters);
    let gait = store::gait::load(flash, partitions.gait.clone()).await;
    if let (Ok(controller), Some(gait)) = (&mut controller, gait) {
        // Refused with the parameters that count now, it is as good as none.
        let _ = controller.keep_gait(&gait);
    }
    Booted {
        about: About { name: settings.name.clone(), reset, parameters: source },
        controller,
        pairing: store::pairing::load(flash, partitions.pairing.clone()).await,
    }
}
