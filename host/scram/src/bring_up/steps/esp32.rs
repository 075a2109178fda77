//! The ESP32 alone.

use std::time::Duration;

use super::converter::beside_radio;
use super::time::endures;
use super::{BARE, ask, is};
use crate::bring_up::Chip;
use crate::bring_up::operator::Signal;
use crate::bring_up::step::{Step, Wiring};

const ESP32: Step = Step { chip: Some(Chip::Esp32), ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 50,
        title: "It links",
        needs: "Espressif's toolchain",
        about: "`cargo images --chip esp32`.",
        run: |rig| ask(rig, &[is("links", "all three programs link, and hold their budgets", Signal::Other)]),
        ..ESP32
    },
    Step {
        number: 51,
        title: "Floating point in the control loop's interrupt",
        about: "Ten minutes of traffic: no exception, no fault.",
        wiring: Wiring::Constant,
        run: |rig| endures(rig, Duration::from_secs(600)),
        ..ESP32
    },
    Step {
        number: 63,
        title: "Traffic at constant voltage",
        needs: "a battery of 1.65 V, or a quiet supply",
        about: "An hour of traffic at a constant voltage: no jumps, no loss of range.",
        wiring: Wiring::Constant,
        run: |rig| beside_radio(rig, Duration::from_secs(3600)),
        ..ESP32
    },
    Step {
        number: 64,
        title: "Stack depth",
        needs: "an image that paints the stacks",
        about: "Ten minutes of traffic, swinging, `get`, `set`, `save` and a flood.",
        run: |rig| ask(rig, &[is("room", "each stack has 512 bytes left", Signal::Other)]),
        ..ESP32
    },
    Step {
        number: 65,
        title: "Brown-out on revision 0",
        needs: "a chip of revision v0.0, a laboratory supply, an oscilloscope on EN",
        about: "The supply falls to 1 V and comes back while the robot drives.",
        run: |rig| {
            ask(
                rig,
                &[
                    is("en-low", "EN low throughout", Signal::Other),
                    is("starts", "the chip starts again", Signal::Other),
                ],
            )
        },
        ..ESP32
    },
];
