//! Whatever bytes come over the air: what the paired console did not sign changes nothing but counters.

use crate::common::{DRIVE, Frame, Run, Trial, give, ready};
use control::gait::Name;
use control::protocol::radio::{Counters, LONGEST, Report, Request};
use control::protocol::secure::{Caller, Nonce, Rejected, kind};
use control::protocol::{VERSION, secure};
use control::{Command, Gait, Stroke};
use proptest::prelude::*;
use testbed::setup::{DONGLE, address, pairing};

const SECONDS: f64 = 0.6;

/// What somebody sends who has heard everything.
#[derive(Clone, Debug)]
enum Forged {
    /// Any bytes.
    Bytes(Vec<u8>),
    /// The beginning is right, the tag is not.
    Unsigned(u8, Vec<u8>),
    /// What the console said some messages ago, with something done to it.
    Heard { index: prop::sample::Index, how: u8, at: prop::sample::Index, byte: u8 },
    /// A call by the console of another robot.
    OtherKey(u8),
}

fn forged() -> impl Strategy<Value = Forged> {
    let tail = || prop::collection::vec(any::<u8>(), 0..=LONGEST - 5);
    prop_oneof![
        prop::collection::vec(any::<u8>(), 0..=LONGEST).prop_map(Forged::Bytes),
        (0_u8..7, tail()).prop_map(|(kind, tail)| Forged::Unsigned(kind, tail)),
        (any::<prop::sample::Index>(), 0_u8..4, any::<prop::sample::Index>(), 1_u8..)
            .prop_map(|(index, how, at, byte)| Forged::Heard { index, how, at, byte }),
        any::<u8>().prop_map(Forged::OtherKey),
    ]
}

impl Forged {
    fn bytes(&self, heard: &[Vec<u8>]) -> Vec<u8> {
        match self {
            Self::Bytes(bytes) => bytes.clone(),
            Self::Unsigned(kind, tail) => [&VERSION.to_le_bytes(), &[*kind][..], tail].concat(),
            Self::Heard { index, how, at, byte } => {
                let mut frame = heard[index.index(heard.len())].clone();
                let at = at.index(frame.len());
                match how {
                    0 => {}
                    1 => frame.truncate(at),
                    2 => frame[at] ^= byte,
                    _ => frame.insert(at, *byte),
                }
                frame.truncate(LONGEST);
                frame
            }
            Self::OtherKey(nonce) => Caller::new(pairing(DONGLE, 1, 1).key, Nonce([*nonce; 8])).hello().to_vec(),
        }
    }
}

/// The robot drives, and this comes in besides, each in the console's name or in a stranger's.
fn run(forged: &[(u64, bool, Forged)]) -> Run {
    let mut trial = Trial::new(1);
    trial.setup.robots[0].position_m = 1.0;
    let mut forged = forged.to_vec();
    forged.sort_by_key(|(at_us, ..)| *at_us);
    trial.run_besides(
        SECONDS,
        |console| async move {
            ready(&console).await;
            give(&console, DRIVE).await;
        },
        |console, ether| async move {
            for (at_us, stranger, forged) in forged {
                testbed::time::until(at_us).await;
                let heard: Vec<Vec<u8>> = console.said().iter().map(|said| said.frame.clone()).collect();
                let bytes = forged.bytes(&heard);
                ether.inject(if stranger { [6; 6] } else { DONGLE }, address(0), &bytes);
            }
        },
    )
}

/// Everything that left the robot but the notices, and what its bridge was told.
fn said_and_done(run: &Run) -> impl PartialEq + std::fmt::Debug + use<> {
    let told = run.told.iter().map(|told| {
        let mut uplink = told.uplink.clone();
        if let Report::Status(status) = &mut uplink.report {
            status.counters = forget(status.counters);
        }
        uplink
    });
    let told: Vec<_> = told.collect();
    (run.actuations(), told, forget(run.counters))
}

/// Without what counts forgeries, and the notice that one of them is answered with.
fn forget(counters: Counters) -> Counters {
    Counters { outdated: 0, forged: 0, misunderstood: 0, other_version: 0, sent: 0, ..counters }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn forgeries_change_nothing_but_their_counters(
        forged in prop::collection::vec((200_000_u64..590_000, any::<bool>(), forged()), 0..9)
    ) {
        let with = run(&forged);
        let others = with.events.iter().filter(|(_, event)| {
            matches!(event, testbed::event_log::Event::Heard { payload, .. }
                if matches!(kind(payload), Err(Rejected::OtherVersion(_))))
        });
        let counters = with.counters;
        prop_assert_eq!(counters.other_version as usize, others.count());
        let all = counters.other_version + counters.forged + counters.outdated + counters.misunderstood;
        prop_assert_eq!(all as usize, forged.len());
        // One notice at most: it is not the attacker's to fill the air.
        prop_assert!(with.sent().iter().filter(|(_, frame, _)| *frame == Frame::Notice).count() <= 1);
        prop_assert_eq!(with.last_on_us().map(|at_us| at_us > 599_000), Some(true));
        if with.notices == 0 {
            prop_assert!(said_and_done(&with) == said_and_done(&run(&[])));
        }
    }

    #[test]
    fn any_order_at_all_is_answered_and_the_loop_goes_on(
        orders in prop::collection::vec(orders(), 0..6)
    ) {
        let run = Trial::new(1).run(1.0, move |console| async move {
            ready(&console).await;
            for request in orders {
                assert!(console.order(request).await.is_some(), "{request:?}");
            }
        });
        prop_assert_eq!(run.counters.ticks + run.counters.missed_deadlines, 1000);
        prop_assert_eq!(run.counters.received as usize, run.said.len());
        prop_assert_eq!(run.counters.misunderstood + run.counters.lost + run.counters.commands_dropped, 0);
        prop_assert!(run.actuations().iter().all(|(_, told)| (-1.0..=1.0).contains(&told.duty)));
    }
}

fn orders() -> impl Strategy<Value = Request> {
    let number = || prop_oneof![any::<f32>(), -100.0_f32..100.0];
    let commands = prop_oneof![
        Just(Command::Idle),
        Just(Command::ClearFault),
        any::<u32>().prop_map(|id| Command::Gait { id }),
        number().prop_map(|omega| Command::Speed { omega }),
        number().prop_map(|angle| Command::Position { angle }),
        number().prop_map(|duty| Command::Duty { duty }),
        (number(), number()).prop_map(|(from, to)| Command::Oscillate { from, to, style: Stroke::Proportional }),
    ];
    prop_oneof![
        6 => commands.prop_map(Request::Command),
        1 => any::<u16>().prop_map(Request::Get),
        2 => (0_u16..150, number()).prop_map(|(index, value)| Request::Set { index, value }),
        1 => Just(Request::Save),
        1 => Just(Request::Factory),
        2 => gaits().prop_map(Request::KeepGait),
    ]
}

/// Good ones, and any that bytes on the air can make.
fn gaits() -> impl Strategy<Value = Gait> {
    let good = Gait::new(Name::new("any").expect("a name"), &[44.0, -44.0], &[], &[0, 1, 0], 20, true).expect("sound");
    let bytes = postcard::to_slice(&good, &mut [0; 300]).expect("it fits").to_vec();
    prop::collection::vec((0..bytes.len(), any::<u8>()), 0..4).prop_filter_map("a message", move |changes| {
        let mut bytes = bytes.clone();
        changes.into_iter().for_each(|(at, byte)| bytes[at] = byte);
        postcard::from_bytes(&bytes).ok()
    })
}

#[test]
fn the_head_of_a_frame_is_as_the_attacker_believes() {
    assert_eq!(secure::notice()[..4], VERSION.to_le_bytes());
}
