//! The ESP32 alone.

use std::time::Duration;

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
];
