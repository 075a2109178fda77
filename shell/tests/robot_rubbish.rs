//! Whatever bytes come over the air: what is no command changes nothing but counters.

#[expect(dead_code, reason = "the robot's other tests use the rest")]
mod common;

use common::bench::{Bench, Run};
use common::radio::{Arrival, console, numbered};
use control::protocol::radio::{FromRobot, LONGEST, Misread, decode, encode};
use control::{Command, Stroke};
use proptest::prelude::*;
use shell::board::Payload;

const SECONDS: f64 = 0.4;

fn commands() -> impl Strategy<Value = Command> {
    let number = prop_oneof![any::<f32>(), -100.0_f32..100.0];
    prop_oneof![
        Just(Command::Idle),
        Just(Command::ClearFault),
        number.clone().prop_map(|omega| Command::Speed { omega }),
        number.clone().prop_map(|angle| Command::Position { angle }),
        (number.clone(), number).prop_map(|(from, to)| Command::Oscillate { from, to, style: Stroke::Proportional }),
    ]
}

/// A message of this version with something done to it.
fn damaged() -> impl Strategy<Value = Vec<u8>> {
    let message = (any::<u16>(), commands())
        .prop_map(|(sequence, command)| encode(sequence, &command, &mut [0; LONGEST]).expect("short").to_vec());
    (message, any::<prop::sample::Index>(), any::<u8>(), 0..3_u8).prop_map(|(mut bytes, index, byte, how)| {
        let index = index.index(bytes.len());
        match how {
            0 => bytes.truncate(index),
            1 => bytes[index] ^= byte,
            _ => bytes.insert(index, byte),
        }
        bytes
    })
}

/// Bytes that are no command of this version.
fn rubbish() -> impl Strategy<Value = Vec<u8>> {
    let any_bytes = prop::collection::vec(any::<u8>(), 0..=LONGEST);
    prop_oneof![any_bytes, damaged()].prop_filter("no command", |bytes| decode::<Command>(bytes).is_err())
}

/// The robot drives, and this comes in besides, each from a stranger or from the host.
fn run(rubbish: &[(u64, bool, Vec<u8>)]) -> Run {
    let mut arrivals = numbered(console(&[(0.1, Some(Command::Speed { omega: 44.0 }))], SECONDS, 0.0, 1));
    arrivals.extend(rubbish.iter().map(|(at_us, stranger, bytes)| Arrival {
        at_us: *at_us,
        number: 1_000_000,
        from: if *stranger { [6; 6] } else { common::radio::HOST },
        payload: Payload::from_slice(bytes).expect("short enough"),
    }));
    Bench::new(1, arrivals).run(SECONDS)
}

/// Everything that left the robot, and its counters, but for the two that count rubbish.
fn said_and_done(run: &Run) -> impl PartialEq + std::fmt::Debug + use<> {
    let forget = |counters: &mut control::protocol::radio::Counters| {
        counters.misunderstood = 0;
        counters.other_version = 0;
    };
    let mut sent = run.sent();
    for (_, _, message, _) in &mut sent {
        if let FromRobot::Status(status) = message {
            forget(&mut status.counters);
        }
    }
    let mut counters = run.counters;
    forget(&mut counters);
    (run.actuations(), sent, counters)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rubbish_changes_nothing_but_its_counters(
        rubbish in prop::collection::vec((0_u64..390_000, any::<bool>(), rubbish()), 0..9)
    ) {
        let with = run(&rubbish);
        let others = rubbish.iter().filter(|(_, _, bytes)| matches!(decode::<Command>(bytes), Err(Misread::OtherVersion(_))));
        let others = others.count();
        prop_assert_eq!(with.counters.other_version as usize, others);
        prop_assert_eq!(with.counters.misunderstood as usize, rubbish.len() - others);
        prop_assert!(said_and_done(&with) == said_and_done(&run(&[])));
    }

    #[test]
    fn any_command_at_all_is_obeyed_or_refused_and_the_loop_goes_on(
        commands in prop::collection::vec((0_u64..390_000, commands()), 0..9)
    ) {
        let script = commands.iter().map(|(at_us, command)| (*at_us, *command, false)).collect();
        let run = Bench::new(1, numbered(script)).run(SECONDS);
        prop_assert_eq!(run.counters.ticks, 400);
        prop_assert_eq!(run.counters.received as usize, commands.len());
        prop_assert_eq!(run.counters.misunderstood + run.counters.lost + run.counters.commands_dropped, 0);
        prop_assert!(run.actuations().iter().all(|(_, told)| (-1.0..=1.0).contains(&told.duty)));
    }
}
