//! The bridge is cut, whatever happens to the program.

use std::time::Duration;

use control::protocol::radio::{Crash, CrashPlace, InjectedFault, Reset};
use control::{Command, Fault};

use super::{BARE, EN_FALLS, from_to};
use crate::bring_up::operator::{Act, Expected, Observation, Signal};
use crate::bring_up::rig::{Back, GENTLE, Halt, Rig};
use crate::bring_up::step::Step;

const SCOPE: &str = "an oscilloscope on EN and on the LED's pin, trigger on the LED's falling edge";
/// A crash cuts the bridge at once, ms.
const AT_ONCE: Observation = from_to("en-falls", EN_FALLS, Signal::EnableAfterMark, 0.0, 1.0, "ms");
/// The watchdog with its oscillator's error, ms.
const WATCHDOG: Observation = from_to("en-falls", EN_FALLS, Signal::EnableAfterMark, 0.0, 55.0, "ms");
/// A hang that every watchdog ends, ms.
const HANG_MS: u16 = 2000;
/// Drives so long before it falls silent.
const BEFORE: Duration = Duration::from_secs(1);

pub const STEPS: &[Step] = &[
    Step {
        number: 6,
        title: "Panic",
        needs: SCOPE,
        about: "The robot drives gently, and its sending task panics.",
        run: |rig| crash(rig, Crash::Panic, CrashPlace::Task),
        ..BARE
    },
    Step {
        number: 7,
        title: "Stack overflow",
        needs: SCOPE,
        about: "The robot drives gently, and its sending task calls itself without end.",
        run: |rig| crash(rig, Crash::StackOverflow, CrashPlace::Task),
        ..BARE
    },
    Step {
        number: 8,
        title: "Exception in the control loop's interrupt",
        needs: SCOPE,
        about: "The robot drives gently, and the loop reads address 0; then the same with a recursion without end.",
        run: |rig| {
            crash(rig, Crash::Exception, CrashPlace::Loop)?;
            crash(rig, Crash::StackOverflow, CrashPlace::Loop)
        },
        ..BARE
    },
    Step {
        number: 9,
        title: "Watchdog",
        needs: SCOPE,
        about: "The robot drives gently, and the control loop hangs for 2 s in a conversion.",
        run: hang,
        ..BARE
    },
    Step {
        number: 10,
        title: "Watchdog against a stopped processor",
        chip: Some(crate::bring_up::Chip::Esp32c3),
        needs: "JTAG (openocd)",
        about: "The robot drives gently, and its processor is halted from outside.",
        run: halt,
        ..BARE
    },
    Step {
        number: 11,
        title: "Brown-out",
        needs: "a laboratory supply for the 3.3 V, a voltmeter",
        about: "The robot drives gently while its supply falls, and starts again as it rises.",
        run: brown_out,
        ..BARE
    },
    Step {
        number: 12,
        title: "Pins float during reset",
        needs: "an oscilloscope on EN",
        about: "The robot drives gently while the reset button is held for a second.",
        run: held_reset,
        ..BARE
    },
    Step {
        number: 13,
        title: "Lost radio",
        needs: "an oscilloscope on EN",
        about: "The robot drives gently for a second, then this program says nothing any more.",
        run: lost_radio,
        ..BARE
    },
];

/// Drives, the instruments armed.
fn drive(rig: &mut Rig) -> Result<Duration, Halt> {
    rig.arm();
    rig.drive(Command::Duty { duty: GENTLE })?;
    Ok(rig.session.now())
}

fn crash(rig: &mut Rig, how: Crash, place: CrashPlace) -> Result<(), Halt> {
    let since = drive(rig)?;
    rig.inject(InjectedFault::Crash { how, place }, 1000)?;
    let back = rig.back(since, Duration::from_secs(2))?;
    rig.must_boot(back, Reset::Panic, "it did not crash: it went on");
    rig.observe(&AT_ONCE).map(drop)
}

fn hang(rig: &mut Rig) -> Result<(), Halt> {
    let since = drive(rig)?;
    rig.inject(InjectedFault::HangLoop, HANG_MS)?;
    let back = rig.back(since, Duration::from_millis(u64::from(HANG_MS) + 2000))?;
    rig.must_boot(back, Reset::Watchdog, "the watchdog did not bite: the loop hung for 2 s, and the robot went on");
    rig.observe(&WATCHDOG).map(drop)
}

fn halt(rig: &mut Rig) -> Result<(), Halt> {
    let since = drive(rig)?;
    rig.act(Act::Halt)?;
    let back = rig.back(since, Duration::from_secs(4))?;
    rig.must_boot(back, Reset::Watchdog, "the watchdog did not bite: the processor stood still, and the robot went on");
    Ok(())
}

fn brown_out(rig: &mut Rig) -> Result<(), Halt> {
    let since = drive(rig)?;
    rig.act(Act::BrownOut)?;
    let back = rig.back(since, Duration::from_secs(2))?;
    rig.must_boot(back, Reset::BrownOut, "it did not reset");
    let expected = Expected::Number("V");
    let text = "supply at which it reset";
    rig.observe(&Observation { key: "reset-at", text, signal: Signal::Other, expected }).map(drop)
}

fn held_reset(rig: &mut Rig) -> Result<(), Halt> {
    let since = drive(rig)?;
    rig.arm();
    rig.act(Act::HoldReset)?;
    let back = rig.back(since, Duration::from_secs(2))?;
    rig.must_boot(back, Reset::PowerOn, "it did not reset");
    let text = "EN low from the button's press on";
    rig.observe(&super::is("en-low", text, Signal::EnableLow)).map(drop)
}

fn lost_radio(rig: &mut Rig) -> Result<(), Halt> {
    let bound_s = rig.bound("controller.supervisor.command_bound_s")?;
    let since = drive(rig)?;
    let driven = rig.session.now();
    rig.listen(BEFORE, |_| true)?;
    let before_s = rig.session.now().saturating_sub(driven).as_secs_f64();
    rig.silence(Duration::from_secs_f64(bound_s + 1.0));
    // It keeps what stopped it until that is cleared.
    let back = rig.back(since, Duration::ZERO)?;
    let found = match back {
        Back::WentOn => format!("{:?}", rig.fault()),
        other => format!("{other:?}"),
    };
    let good = back == Back::WentOn && rig.fault() == Some(Fault::CommandTooOld);
    rig.check("the robot's fault when it is heard again", found, "Some(CommandTooOld)", good);
    // To the first telemetry that says so, and what a heartbeat has as its age.
    let longest_s = before_s + bound_s + 0.2;
    let text = "longest time that EN was high; at most the drive before the silence and command_bound_s";
    let expected = Expected::Between(0.0, (longest_s * 1e3).round() / 1e3, "s");
    rig.observe(&Observation { key: "en-high", text, signal: Signal::EnablePulse, expected }).map(drop)
}
