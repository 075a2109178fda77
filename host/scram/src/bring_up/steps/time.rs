//! The control loop's time.

use std::time::Duration;

use control::protocol::radio::{Reset, Status};

use super::{BARE, is};
use crate::bring_up::operator::Signal;
use crate::bring_up::rig::{Halt, Rig};
use crate::bring_up::step::{Step, Wiring};

const TEN_MINUTES: Duration = Duration::from_secs(600);
const CONSTANT: Step = Step { wiring: Wiring::Constant, ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 24,
        title: "1 kHz above the radio",
        about: "Ten minutes of traffic: how even the ticks are.",
        run: even,
        ..CONSTANT
    },
    Step {
        number: 25,
        title: "The second timer works",
        needs: "an image without `LOOP.wake()` in firmware/src/tick.rs",
        about: "The same with the loop's own timer removed.",
        run: |rig| rig.observe(&is("spread-grows", "longest less shortest period grows", Signal::Other)).map(drop),
        ..BARE
    },
    Step {
        number: 26,
        title: "A tick's execution",
        about: "Ten minutes of traffic: the longest tick.",
        run: |rig| {
            let longest_us = rig.traffic(TEN_MINUTES)?.longest_tick_us;
            rig.check("longest tick", format!("{longest_us} us"), "below 500 us", longest_us < 500);
            Ok(())
        },
        ..CONSTANT
    },
    Step {
        number: 27,
        title: "Stacks",
        about: "Ten minutes of traffic, driving, `get` and `set`: no panic.",
        run: |rig| endures(rig, TEN_MINUTES),
        ..CONSTANT
    },
];

fn even(rig: &mut Rig) -> Result<(), Halt> {
    let traffic = rig.traffic(TEN_MINUTES)?;
    let spread_us = traffic.spread_us;
    rig.check("longest less shortest period", format!("{spread_us} us"), "at most 100 us", spread_us <= 100);
    let missed = traffic.counted(|status: &Status| status.counters.missed_deadlines);
    rig.check("missed deadlines", format!("{missed:?}"), "Some(0)", missed == Some(0));
    Ok(())
}

/// Traffic without a boot.
pub fn endures(rig: &mut Rig, length: Duration) -> Result<(), Halt> {
    let traffic = rig.traffic(length)?;
    let boots: Vec<String> = traffic.boots.iter().map(|reset: &Reset| format!("{reset:?}")).collect();
    let found = if boots.is_empty() { "none".to_owned() } else { boots.join(", ") };
    rig.check("resets during the traffic", found, "none", boots.is_empty());
    let faults = if traffic.faults.is_empty() { "none".to_owned() } else { traffic.faults.join(", ") };
    rig.check("faults during the traffic", faults, "none", traffic.faults.is_empty());
    rig.check("orders that were not done", traffic.undone.to_string(), "0", traffic.undone == 0);
    Ok(())
}
