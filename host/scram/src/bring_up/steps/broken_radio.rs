//! Floods, and a radio that is broken.

use std::time::Duration;

use control::Command;
use control::protocol::radio::{InjectedFault, Reset};

use super::{BARE, EN_FALLS, Signal, ask, from_to, is};
use crate::bring_up::operator::Observation;
use crate::bring_up::rig::{Back, GENTLE, Halt, Rig};
use crate::bring_up::step::{Step, Wiring};

const SCOPE: &str = "an oscilloscope on EN and on the LED's pin, trigger on the LED's falling edge";
/// Longer than it takes a console to see a robot as gone, ms.
const GONE_MS: u16 = 1500;
/// Longer than the limit of a send, and than a driver may refuse everything, ms.
const BROKEN_MS: u16 = 6000;
/// What was on its way, and what a heartbeat has as its age, s.
const UNDERWAY_S: f64 = 0.35;
/// The hang of a loop at rest, ms: longer than a driven motor's watchdog waits.
const HANG_MS: u16 = 300;
/// The watchdog of a driven motor with its oscillator's error, ms.
const WATCHDOG: Observation = from_to("en-falls", EN_FALLS, Signal::EnableAfterMark, 0.0, 55.0, "ms");

pub const STEPS: &[Step] = &[
    Step {
        number: 56,
        title: "A flood of 1470 bytes",
        needs: "a third board with ESP-NOW's second version",
        about: "The third board floods the channel in every way while the robot drives.",
        run: |rig| {
            ask(
                rig,
                &[
                    is("no-reset", "neither robot nor dongle resets, `too_long` counts", Signal::Other),
                    is("heap", "`heap_least_free` stays above its budget", Signal::Other),
                    from_to("longest-period", "`longest_period_us`", Signal::Other, 900.0, 1100.0, "µs"),
                    is("silence", "where the console is not heard, EN is low within 0.55 s", Signal::Other),
                ],
            )
        },
        ..BARE
    },
    Step {
        number: 57,
        title: "Other frames",
        needs: "a laptop with packet injection",
        about: "The same with management and data frames of 1500 bytes.",
        run: |rig| ask(rig, &[is("no-reset", "neither robot nor dongle resets", Signal::Other)]),
        ..BARE
    },
    Step {
        number: 58,
        title: "A radio that stops acknowledging",
        needs: SCOPE,
        about: "The robot drives gently, and its radio sends nothing for 1.5 s.",
        run: unheard,
        ..BARE
    },
    Step {
        number: 59,
        title: "A send that never ends",
        needs: SCOPE,
        about: "The radio is not done with a message any more: while the robot drives gently, and at rest.",
        run: |rig| {
            breaks(rig, InjectedFault::SendsNeverEnd, true)?;
            breaks(rig, InjectedFault::SendsNeverEnd, false)
        },
        ..BARE
    },
    Step {
        number: 60,
        title: "The driver without buffers",
        needs: SCOPE,
        about: "The radio's driver takes no message any more: while the robot drives gently, and at rest.",
        run: |rig| {
            breaks(rig, InjectedFault::SendsRefused, true)?;
            breaks(rig, InjectedFault::SendsRefused, false)
        },
        ..BARE
    },
    Step {
        number: 61,
        title: "The dongle's watchdog",
        needs: "a dongle with `loop {}` in `shell::dongle::take` on a frame of its own",
        about: "The dongle hangs; another one lies idle.",
        run: |rig| {
            ask(
                rig,
                &[
                    from_to("boots", "from the frame to the dongle's boot", Signal::Other, 0.0, 1.1, "s"),
                    is("idle", "idle, unread or off its host for an hour it does not boot", Signal::Other),
                ],
            )
        },
        ..BARE
    },
    Step {
        number: 62,
        title: "The watchdog's patience changes",
        needs: SCOPE,
        about: "The loop hangs for 300 ms at rest and while the motor turns; then the motor starts and stops for long.",
        run: patience,
        wiring: Wiring::Motor,
        ..BARE
    },
];

/// Drives, the instruments armed, and breaks something.
fn driven(rig: &mut Rig, fault: InjectedFault, for_ms: u16) -> Result<Duration, Halt> {
    rig.arm();
    rig.drive(Command::Duty { duty: GENTLE })?;
    let since = rig.session.now();
    rig.inject(fault, for_ms)?;
    Ok(since)
}

/// Nobody sees what the robot does: it must stop.
fn off_in_time(rig: &mut Rig) -> Result<(), Halt> {
    let longest_ms = (rig.bound("controller.supervisor.command_bound_s")? + UNDERWAY_S) * 1e3;
    let text = "from the LED's falling edge to EN's last falling edge; command_bound_s and what was on its way";
    rig.observe(&from_to("en-falls", text, Signal::EnableAfterMark, 0.0, longest_ms, "ms")).map(drop)
}

fn unheard(rig: &mut Rig) -> Result<(), Halt> {
    let before = rig.next_status()?.counters.send_failed;
    let since = driven(rig, InjectedFault::SendsFail, GONE_MS)?;
    let back = rig.back(since, Duration::from_millis(u64::from(GONE_MS) + 1500))?;
    let state = rig.telemetry().map(|batch| batch.state);
    let stopped = back == Back::WentOn && state.is_some_and(|state| !state.is_driving());
    rig.check("the robot when it is heard again", format!("{back:?}, {state:?}"), "no reset, bridge off", stopped);
    let failed = rig.status().map_or(0, |status| status.counters.send_failed.wrapping_sub(before));
    rig.check("sends that failed, by its status", failed.to_string(), "some", failed > 0);
    off_in_time(rig)
}

/// A radio that is broken for good ends with a reset, with the motor off.
fn breaks(rig: &mut Rig, fault: InjectedFault, drives: bool) -> Result<(), Halt> {
    let since = if drives {
        driven(rig, fault, BROKEN_MS)?
    } else {
        let since = rig.session.now();
        rig.inject(fault, BROKEN_MS)?;
        since
    };
    let back = rig.back(since, Duration::from_millis(u64::from(BROKEN_MS) + 1500))?;
    rig.must_boot(back, Reset::Radio, "it was not reset: its radio was broken, and it went on");
    if drives { off_in_time(rig) } else { Ok(()) }
}

fn patience(rig: &mut Rig) -> Result<(), Halt> {
    let since = rig.session.now();
    rig.inject(InjectedFault::HangLoop, HANG_MS)?;
    let back = rig.back(since, Duration::from_secs(2))?;
    rig.check("a hang of 300 ms at rest", format!("{back:?}"), "WentOn", back == Back::WentOn);
    let since = driven(rig, InjectedFault::HangLoop, HANG_MS)?;
    let back = rig.back(since, Duration::from_secs(2))?;
    rig.must_boot(back, Reset::Watchdog, "the watchdog did not bite: the loop hung for 300 ms, and the robot went on");
    rig.observe(&WATCHDOG)?;
    let (begun, mut turns) = (rig.session.now(), 0_u32);
    while rig.session.now().saturating_sub(begun) < rig.options.length {
        rig.drive(Command::Speed { omega: -44.0 })?;
        rig.listen(Duration::from_secs(1), |_| true)?;
        rig.stop()?;
        rig.listen(Duration::from_secs(1), |_| true)?;
        turns += 1;
    }
    let went_on = rig.session.robot(rig.robot).uptime().is_some_and(|up| up > rig.session.now().saturating_sub(begun));
    rig.check(
        &format!("{turns} starts and stops"),
        if went_on { "no reset" } else { "a reset" }.into(),
        "no reset",
        went_on,
    );
    rig.shortened_to(rig.options.length, Duration::from_secs(3600));
    Ok(())
}
