//! Pairing, over the robot's own cable.

use super::{BARE, ask, is};
use crate::bring_up::Chip;
use crate::bring_up::operator::Signal;
use crate::bring_up::step::Step;

const CABLE: Step = Step { needs: "the robot's USB cable", ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 39,
        title: "Over the serial line",
        about: "`scram pair` twenty times, the monitor closed.",
        run: |rig| {
            ask(
                rig,
                &[
                    is("twenty", "paired each time, the status after it says `Software`", Signal::Other),
                    is("obeys", "the monitor shows `obeys` and the dongle's address", Signal::Other),
                ],
            )
        },
        ..CABLE
    },
    Step {
        number: 40,
        title: "Refused while driving",
        about: "`scram pair` while the motor is driven, then at rest with an oscilloscope on EN.",
        run: |rig| {
            ask(
                rig,
                &[
                    is("refused", "driving: \"not kept\", and the motor goes on", Signal::Other),
                    is("en-low", "at rest: EN low until a command after the boot", Signal::Other),
                ],
            )
        },
        ..CABLE
    },
    Step {
        number: 41,
        title: "A power cut while pairing",
        about: "The supply is cut at random moments of `scram pair`, 50 times.",
        run: |rig| ask(rig, &[is("one-or-the-other", "it obeys the old console or the new one", Signal::Other)]),
        ..CABLE
    },
    Step {
        number: 42,
        title: "C3: a host that goes after it has asked",
        chip: Some(Chip::Esp32c3),
        about: "`scram pair`, and the cable is pulled at once.",
        run: |rig| ask(rig, &[is("boots", "the robot boots all the same, within a second", Signal::Other)]),
        ..CABLE
    },
];
