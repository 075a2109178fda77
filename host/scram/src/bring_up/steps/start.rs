//! Start and reset.

use control::Fault;
use control::protocol::radio::{Reset, Source};
use control::supervisor::FAULTS;

use super::{BARE, EN_LOW, ask, is};
use crate::bring_up::operator::{Act, Expected, Observation, Signal};
use crate::bring_up::rig::{Halt, Rig};
use crate::bring_up::step::Step;

pub const STEPS: &[Step] = &[
    Step {
        number: 1,
        title: "The image boots",
        needs: "eyes on the LED",
        about: "The supply is switched off and on; the robot says who it is and why it started.",
        run: boots,
        ..BARE
    },
    Step {
        number: 2,
        title: "EN stays low while the chip starts",
        needs: "an oscilloscope on EN (C3 GPIO10, ESP32 GPIO27), trigger on a rising edge",
        about: "The supply is switched off and on, then the reset button is pressed. Nothing drives.",
        run: |rig| starts(rig, &[is("en-stays-low", EN_LOW, Signal::EnableLow)]),
        ..BARE
    },
    Step {
        number: 3,
        title: "IN1, IN2 do nothing while EN is low at start",
        needs: "an oscilloscope on IN1 and IN2 (C3 GPIO4/5, ESP32 GPIO25/26)",
        about: "The supply is switched off and on, then the reset button is pressed. Nothing drives.",
        run: |rig| starts(rig, &[is("inputs-stay-low", "IN1 and IN2 low all the time", Signal::InputsLow)]),
        ..BARE
    },
    Step {
        number: 4,
        title: "The reset's cause is told",
        needs: "hands; C3: the robot on USB",
        about: "The robot is started in every way; its status says which.",
        run: causes,
        ..BARE
    },
    Step {
        number: 5,
        title: "Partitions",
        needs: "the robot's monitor, espflash and another partition table",
        about: "The robot is flashed with a table that has none of its partitions.",
        run: |rig| {
            ask(
                rig,
                &[
                    is("none-missing", "ours: the monitor does not print `no partition`", Signal::Other),
                    is("both-named", "another table: `no partition` for `params`, `pairing` and `gait`", Signal::Other),
                    is("not-kept", "`scram pair` is answered by \"not kept\"", Signal::Other),
                ],
            )
        },
        ..BARE
    },
];

/// Restarts it by an act and says what its status then tells.
fn restarted(rig: &mut Rig, act: Act, cause: Reset) -> Result<(), Halt> {
    let since = rig.session.now();
    rig.act(act)?;
    let back = rig.back(since, std::time::Duration::from_secs(2))?;
    rig.must_boot(back, cause, "it did not start anew");
    Ok(())
}

fn boots(rig: &mut Rig) -> Result<(), Halt> {
    rig.arm();
    restarted(rig, Act::PowerCycle, Reset::PowerOn)?;
    if let Some(status) = rig.status().cloned() {
        let good = matches!(status.parameters, Source::Factory | Source::Stored);
        rig.check("parameters", format!("{:?}", status.parameters), "Factory or Stored", good);
    }
    let fault = rig.fault();
    rig.check("the fault that it starts in", format!("{fault:?}"), "Some(Restarted)", fault == Some(Fault::Restarted));
    let number = FAULTS.iter().position(|fault| *fault == Fault::Restarted).map_or(0.0, |index| index as f64 + 1.0);
    let text = "the LED's flashes before its pause";
    let expected = Expected::Between(number, number, "");
    rig.observe(&Observation { key: "flashes", text, signal: Signal::Flashes, expected }).map(drop)
}

fn starts(rig: &mut Rig, observations: &[Observation]) -> Result<(), Halt> {
    rig.arm();
    for act in [Act::PowerCycle, Act::ResetButton] {
        restarted(rig, act, Reset::PowerOn)?;
    }
    ask(rig, observations)
}

fn causes(rig: &mut Rig) -> Result<(), Halt> {
    restarted(rig, Act::PowerCycle, Reset::PowerOn)?;
    restarted(rig, Act::ResetButton, Reset::PowerOn)?;
    if rig.options.chip == crate::bring_up::Chip::Esp32c3 {
        restarted(rig, Act::UsbReset, Reset::External)?;
    }
    Ok(())
}
