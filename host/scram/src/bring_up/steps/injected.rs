//! What a person cannot do by hand: an image with fault injection does it to itself.

use std::time::Duration;

use control::Command;
use control::protocol::radio::{InjectedFault, Injection};

use super::BARE;
use crate::bring_up::rig::{Halt, Rig};
use crate::bring_up::step::{Step, Wiring};
use link::Event;

/// From a request's acceptance to its fault.
const DELAY: Duration = Duration::from_millis(Injection::DELAY_MS as u64);
/// How long a fault lasts that is to be found, ms.
const FOR_MS: u16 = 3000;
/// How long a starved loop may drive, ms; and until it is told, which takes ticks, s.
const STARVED_MS: f64 = 200.0;
const STARVED_TOLD_S: f64 = 0.4;
/// A speed in the middle of the range, rad/s.
const CRUISE: Command = Command::Speed { omega: 30.0 };
/// Until the speed is reached.
const SETTLE: Duration = Duration::from_secs(2);

const MOTOR: Step = Step { wiring: Wiring::Motor, ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 66,
        title: "A starved control loop is found",
        needs: "an oscilloscope on EN and on the LED's pin, trigger on the LED's falling edge",
        about: "The motor turns, and every tick takes 30 ms.",
        run: starved,
        ..MOTOR
    },
    Step {
        number: 67,
        title: "A converter that is stuck is found",
        about: "The motor turns, and the wiper's conversions repeat one code.",
        run: |rig| {
            let bound_s = rig.bound("controller.supervisor.frozen_bound_s")?;
            found(rig, InjectedFault::ConverterStuck, "a converter that is stuck", bound_s)
        },
        ..MOTOR
    },
    Step {
        number: 68,
        title: "A slow converter is told",
        about: "The motor turns, and every conversion of the wiper takes 0.5 ms longer.",
        run: slow,
        ..MOTOR
    },
    Step {
        number: 69,
        title: "An intermittent converter is found",
        about: "The motor turns, and the wiper reads zero for 0.4 s out of 0.405 s.",
        run: |rig| {
            let bound_s = rig.bound("controller.supervisor.open_bound_s")?;
            let fault = InjectedFault::ConverterIntermittent { good_ticks: 5, bad_ticks: 400 };
            found(rig, fault, "a converter that fails now and then", bound_s)
        },
        ..MOTOR
    },
];

fn starved(rig: &mut Rig) -> Result<(), Halt> {
    rig.arm();
    let fault = InjectedFault::StarveLoop { hang_ms: 30, run_ticks: 0 };
    found(rig, fault, "a loop that hangs for 30 ms in every tick", STARVED_TOLD_S)?;
    let observation =
        super::from_to("en-falls", super::EN_FALLS, super::Signal::EnableAfterMark, 0.0, STARVED_MS, "ms");
    rig.observe(&observation).map(drop)
}

/// A fault that the robot must find while the motor turns.
fn found(rig: &mut Rig, fault: InjectedFault, what: &str, bound_s: f64) -> Result<(), Halt> {
    rig.drive(CRUISE)?;
    rig.listen(SETTLE, |_| true)?;
    if let Some(fault) = rig.fault() {
        rig.check("the drive before it", format!("{fault:?}"), "no fault", false);
        return Err(Halt::Noted);
    }
    rig.inject(fault, FOR_MS)?;
    rig.must_fault(what, DELAY, bound_s)
}

fn slow(rig: &mut Rig) -> Result<(), Halt> {
    rig.drive(CRUISE)?;
    rig.listen(SETTLE, |_| true)?;
    let before = rig.next_status()?.counters;
    rig.inject(InjectedFault::ConverterSlow { by_us: 500 }, FOR_MS)?;
    let (mut longest_us, mut missed) = (0, 0);
    rig.listen(Duration::from_millis(u64::from(FOR_MS) + 1200), |event| {
        if let Event::Status(status) = event {
            longest_us = longest_us.max(status.counters.longest_tick_us);
            missed = status.counters.missed_deadlines.wrapping_sub(before.missed_deadlines);
        }
        true
    })?;
    rig.check("longest tick", format!("{longest_us} us"), "1000 us or more", longest_us >= 1000);
    rig.check("missed deadlines", missed.to_string(), "counted: 100 or more", missed >= 100);
    Ok(())
}
