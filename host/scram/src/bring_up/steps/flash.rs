//! The flash.

use std::time::Duration;

use control::Command;
use control::parameters::table;
use control::protocol::radio::{Request, Reset, Source};

use super::{BARE, EN_LOW, is};
use crate::bring_up::operator::{Act, Signal};
use crate::bring_up::rig::{Back, GENTLE, Halt, Rig};
use crate::bring_up::step::Step;
use link::Outcome;

/// A parameter that no failsafe depends on, and two values that it may have.
const PARAMETER: &str = "controller.limits.frequency_hz";
const VALUES: [f32; 2] = [10.0, 11.0];
/// The cuts come at moments of this time after `save`, evenly.
const SAVING: Duration = Duration::from_millis(200);

pub const STEPS: &[Step] = &[
    Step {
        number: 43,
        title: "Saving parameters at rest",
        needs: "hands at the supply's switch",
        about: "A parameter is set and saved, and the supply cut at some moment after it, again and again.",
        run: cuts,
        ..BARE
    },
    Step {
        number: 44,
        title: "The chip stands still while it saves",
        about: "Parameters are saved, and the session goes on.",
        run: stands_still,
        ..BARE
    },
    Step {
        number: 45,
        title: "A write while driving is refused",
        needs: "an oscilloscope on EN",
        about: "`save` while the robot drives gently, then at rest.",
        run: refused,
        ..BARE
    },
];

fn index() -> u16 {
    table::find(PARAMETER).unwrap_or_default()
}

fn save(rig: &mut Rig, value: f32) -> Result<(), Halt> {
    rig.must(Request::Set { index: index(), value })?;
    rig.must(Request::Save)
}

fn cuts(rig: &mut Rig) -> Result<(), Halt> {
    save(rig, VALUES[0])?;
    let (mut before, times) = (VALUES[0], rig.options.repeats);
    let mut wrong = Vec::new();
    for turn in 0..times {
        let value = VALUES[usize::from(before == VALUES[0])];
        rig.must(Request::Set { index: index(), value })?;
        rig.session.request(rig.robot, Request::Save);
        let since = rig.session.now();
        rig.listen(SAVING * turn / times.max(1), |_| true)?;
        rig.act(Act::PowerCycle)?;
        let back = rig.back(since, Duration::from_secs(2))?;
        let source = rig.status().map(|status| status.parameters);
        let kept = rig.parameter(PARAMETER)? as f32;
        let one_of_both = [before, value].iter().any(|whole| (kept - whole).abs() < 1e-3);
        if back != Back::Booted(Reset::PowerOn) || source != Some(Source::Stored) || !one_of_both {
            wrong.push(format!("{turn}: {back:?}, {source:?}, {kept}"));
        }
        before = kept;
    }
    let found = if wrong.is_empty() { format!("{times} of {times}") } else { wrong.join("; ") };
    rig.check("boots that say Stored, with the old value or the new one", found, "all of them", wrong.is_empty());
    if times < 50 {
        rig.check("cuts, reduced with --repeats", format!("{times} instead of 50"), "as many as were asked for", true);
    }
    rig.must(Request::Factory)
}

fn stands_still(rig: &mut Rig) -> Result<(), Halt> {
    // What is "since the last status" begins anew.
    let before = rig.next_status()?;
    for value in VALUES {
        save(rig, value)?;
    }
    let after = rig.next_status()?;
    let longest_us = after.counters.longest_period_us;
    rig.check("longest period meanwhile", format!("{longest_us} us"), "below 400000 us", longest_us < 400_000);
    let booted = after.counters.ticks < before.counters.ticks;
    rig.check("the session", if booted { "the robot booted" } else { "goes on" }.into(), "goes on", !booted);
    rig.must(Request::Factory)
}

fn refused(rig: &mut Rig) -> Result<(), Halt> {
    rig.drive(Command::Duty { duty: GENTLE })?;
    let outcome = rig.ask(Request::Save)?;
    let refused = outcome == Outcome::Refused(control::Refusal::Driving);
    rig.check("`save` while it drives", link::outcome(outcome), "refused", refused);
    rig.stop()?;
    rig.arm();
    let before = rig.next_status()?;
    save(rig, VALUES[0])?;
    let after = rig.next_status()?;
    let booted = after.counters.ticks < before.counters.ticks;
    rig.check("after `save` at rest", if booted { "a boot" } else { "no boot" }.into(), "no boot", !booted);
    rig.observe(&is("en-low", EN_LOW, Signal::EnableLow))?;
    rig.must(Request::Factory)
}
