//! `control` alone, without std, behind three C functions. A panic that can be reached needs `a_panic_is_reachable`,
//! which exists nowhere: the linker names it and stops.
//!
//! The texts of errors (`Display`) are left out: they are for the host, and firmware reports numbers.
#![no_std]

use control::{Actuation, Command, Controller, ParameterError, Parameters, Refusal, Sample, Telemetry};

// `c` is here for memcpy and memset, which the compiler calls.
#[link(name = "c")]
unsafe extern "C" {
    safe fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    a_panic_is_reachable()
}

/// Parameters are checked and a controller is made.
#[unsafe(no_mangle)]
pub extern "C" fn make(parameters: &Parameters, made: &mut Result<Controller, ParameterError>) {
    *made = Controller::new(parameters);
}

/// Any command at any time.
#[unsafe(no_mangle)]
pub extern "C" fn command(controller: &mut Controller, command: &Command, time_us: u64, answer: &mut Result<(), Refusal>) {
    *answer = controller.command(*command, time_us);
}

/// Any sample.
#[unsafe(no_mangle)]
pub extern "C" fn tick(controller: &mut Controller, sample: &Sample, actuation: &mut Actuation, telemetry: &mut Telemetry) {
    *actuation = controller.tick(sample);
    *telemetry = controller.telemetry();
    #[cfg(feature = "planted")]
    {
        let table = [1.0, 2.0, 3.0];
        actuation.duty = table[sample.angle.0 as usize];
    }
}
