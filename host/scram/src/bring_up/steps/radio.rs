//! The radio.

use std::collections::HashSet;
use std::time::Duration;

use control::Command;
use control::protocol::radio::{Crash, CrashPlace, InjectedFault, Request, Status};

use super::time::endures;
use super::{BARE, ask, is};
use crate::bring_up::operator::{Act, Signal};
use crate::bring_up::rig::{Back, Halt, Rig};
use crate::bring_up::step::{Step, Wiring};

const HOUR: Duration = Duration::from_secs(3600);
/// How long the link is looked at.
const LOOK: Duration = Duration::from_secs(5);
/// Share of commands that may be missing, and of frames that may come without acknowledgement.
const MOST_LOST: f64 = 0.03;
const MOST_UNHEARD: f64 = 0.1;
/// Resets that must have different nonces.
const RESETS: usize = 10;
const SNIFFER: &str = "a sniffer (a second board, or Wireshark in monitor mode)";
const CONSTANT: Step = Step { wiring: Wiring::Constant, ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 28,
        title: "Robot and dongle hear each other",
        about: "Five seconds of traffic both ways, and a command.",
        run: hear_each_other,
        ..BARE
    },
    Step {
        number: 29,
        title: "6 Mb/s",
        needs: SNIFFER,
        about: "The rates of frames, after a new pairing, too.",
        run: |rig| {
            ask(
                rig,
                &[
                    is("unicast", "unicast ESP-NOW frames at 6 Mb/s", Signal::Other),
                    is("broadcast", "broadcasts at 1 Mb/s", Signal::Other),
                ],
            )
        },
        ..BARE
    },
    Step {
        number: 30,
        title: "Every send ends",
        about: "An hour of traffic: `sent` and `send_failed` go on rising.",
        run: |rig| {
            let traffic = rig.traffic(HOUR)?;
            let (still_s, refused) = (traffic.still_s, traffic.counted(|status| status.counters.send_refused));
            rig.check("messages that the driver refused", format!("{refused:?}"), "Some(0)", refused == Some(0));
            rig.check("longest time without a send that ended", format!("{still_s:.1} s"), "below 3 s", still_s < 3.0);
            Ok(())
        },
        ..CONSTANT
    },
    Step {
        number: 31,
        title: "Heap",
        about: "The same hour without an allocation panic.",
        run: |rig| {
            endures(rig, HOUR)?;
            // A simulated radio has no heap.
            if let Some([first, last]) = rig.traffic(HOUR)?.heap().filter(|[_, last]| *last > 0) {
                let what = "least that was free of the heap: after the first minute, at the end";
                rig.check(what, format!("{first}, {last} bytes"), "does not fall any more", last >= first);
            }
            Ok(())
        },
        ..CONSTANT
    },
    Step {
        number: 32,
        title: "An unpaired robot is silent",
        needs: SNIFFER,
        about: "The robot forgets its pairing (`scram pair --forget`) and is switched on.",
        run: |rig| ask(rig, &[is("silent", "no frame of its address for a minute", Signal::Other)]),
        ..BARE
    },
    Step {
        number: 33,
        title: "Encryption between two boards",
        needs: SNIFFER,
        about: "What goes over the air, and what happens with another LMK in the key file.",
        run: |rig| {
            ask(
                rig,
                &[
                    is("protected", "unicast frames carry the protected bit, no payload is readable", Signal::Other),
                    is("other-key", "no frame arrives with one byte of the LMK changed", Signal::Other),
                ],
            )
        },
        ..BARE
    },
    Step {
        number: 34,
        title: "Unencrypted frames of an encrypted peer's address",
        needs: "a third board that sends with the dongle's address",
        about: "The third board sends without a key.",
        run: |rig| {
            ask(rig, &[is("nothing", "`forged` counts them or nothing does; the robot does nothing", Signal::Other)])
        },
        ..BARE
    },
    Step {
        number: 35,
        title: "A broadcast stop is heard",
        needs: "a console that was given another LMK",
        about: "The robot drives, and hears the broadcast stop only.",
        run: |rig| ask(rig, &[is("stops", "EN low, `received` goes up", Signal::Other)]),
        ..BARE
    },
    Step {
        number: 36,
        title: "17 robots",
        needs: "a key file with 18 robots",
        about: "The dongle meets 17 addresses and refuses the 18th.",
        run: |rig| ask(rig, &[is("one-refused", "the dongle's counter `not_met` is 1", Signal::Other)]),
        ..BARE
    },
    Step {
        number: 37,
        title: "New keys without a reset",
        needs: "the robot's USB cable (`scram pair`)",
        about: "The robot is paired anew while the dongle keeps its supply.",
        run: |rig| ask(rig, &[is("frames-arrive", "frames arrive with the new keys", Signal::Other)]),
        ..BARE
    },
    Step {
        number: 38,
        title: "Nonces differ",
        needs: "hands for ten resets, unless the image makes faults",
        about: "Ten resets, ten sessions.",
        run: nonces,
        ..BARE
    },
];

fn hear_each_other(rig: &mut Rig) -> Result<(), Halt> {
    rig.must(Request::Command(Command::ClearFault))?;
    let before = rig.next_status()?;
    let counts = rig.session.counts();
    rig.listen(LOOK, |_| true)?;
    let (after, counted) = (rig.next_status()?, rig.session.counts());
    let more = |counter: fn(&Status) -> u32| f64::from(counter(&after).wrapping_sub(counter(&before)));
    let acknowledged = f64::from(counted.acknowledged - counts.acknowledged);
    let unacknowledged = f64::from(counted.unacknowledged - counts.unacknowledged);
    let lost = more(|status| status.counters.lost);
    let shares = [
        ("orders that the robot missed", lost, lost + more(|status| status.counters.received), MOST_LOST),
        ("frames of the dongle without acknowledgement", unacknowledged, acknowledged + unacknowledged, MOST_UNHEARD),
        (
            "frames of the robot without acknowledgement",
            more(|status| status.counters.send_failed),
            more(|status| status.counters.sent) + more(|status| status.counters.send_failed),
            MOST_UNHEARD,
        ),
    ];
    for (what, bad, all, most) in shares {
        let share = bad / all.max(1.0);
        let expected = format!("below {:.0} %", 100.0 * most);
        rig.check(what, format!("{:.1} % of {all}", 100.0 * share), &expected, all > 0.0 && share < most);
    }
    Ok(())
}

/// A nonce that comes again makes an old session's frames count again.
fn nonces(rig: &mut Rig) -> Result<(), Halt> {
    let mut seen = HashSet::new();
    for _ in 0..RESETS {
        let since = rig.session.now();
        if rig.status().is_some_and(|status| status.injectable) {
            rig.inject(InjectedFault::Crash { how: Crash::Panic, place: CrashPlace::Task }, 1000)?;
        } else {
            rig.act(Act::ResetButton)?;
        }
        let back = rig.back(since, Duration::from_secs(2))?;
        if !matches!(back, Back::Booted(_)) {
            rig.check("the robot after the reset", format!("{back:?}"), "booted", false);
            return Err(Halt::Noted);
        }
        seen.extend(rig.session.robot(rig.robot).nonce().map(|nonce| nonce.0));
    }
    let found = format!("{} of {RESETS}", seen.len());
    rig.check("different nonces of the robot", found, "all of them", seen.len() == RESETS);
    Ok(())
}
