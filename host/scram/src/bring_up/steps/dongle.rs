//! The dongle, and a board in the loop.

use std::time::Duration;

use super::{BARE, ask, from_to, is};
use crate::bring_up::Chip;
use crate::bring_up::operator::{Expected, Observation, Signal};
use crate::bring_up::rig::{Halt, Rig};
use crate::bring_up::step::Step;

const LOOP: Step = Step { needs: "a board with `cargo flash-hil`", ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 46,
        title: "C3: a host that stops reading",
        chip: Some(Chip::Esp32c3),
        about: "This program reads nothing for three seconds, and then asks the dongle for its counters.",
        run: stops_reading,
        ..BARE
    },
    Step {
        number: 47,
        title: "ESP32: 921 600 Bd",
        chip: Some(Chip::Esp32),
        about: "`scram hil --port PORT --seconds 60`.",
        run: |rig| ask(rig, &[from_to("bad-frames", "bad frames", Signal::Other, 0.0, 0.0, "")]),
        ..LOOP
    },
    Step {
        number: 48,
        title: "hil",
        about: "`scram hil --port PORT`, 2 s at 7 Hz, beside `scram sim`.",
        run: |rig| ask(rig, &[is("identical", "the recordings are identical", Signal::Other)]),
        ..LOOP
    },
    Step {
        number: 49,
        title: "Cycles per tick",
        about: "`scram hil --port PORT` prints them.",
        run: |rig| {
            let (text, expected) = ("cycles of the worst tick", Expected::Number("cycles"));
            ask(rig, &[Observation { key: "worst", text, signal: Signal::Other, expected }])
        },
        ..LOOP
    },
];

fn stops_reading(rig: &mut Rig) -> Result<(), Halt> {
    rig.silence(Duration::from_secs(3));
    // The robot has not heard anything either: the session begins anew.
    let since = rig.session.now();
    rig.back(since, Duration::from_secs(1))?;
    let counted = rig.session.count(Duration::from_secs(2))?;
    let found = counted.map_or("nothing".to_owned(), |counters| {
        format!("{} messages dropped, {} received", counters.received_dropped, counters.received)
    });
    rig.check("the dongle's counters after it", found, "told", counted.is_some());
    Ok(())
}
