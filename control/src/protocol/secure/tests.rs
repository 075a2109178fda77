use std::vec::Vec;

use super::*;

const KEY: Key = Key([7; 32]);

fn receiver() -> SessionReceiver {
    SessionReceiver::new(KEY)
}

fn nonce(number: u8) -> Nonce {
    Nonce([number; NONCE])
}

/// A session of a console's nonce and a robot's.
fn session(receiver: &mut SessionReceiver, console: u8, robot: u8) -> (Sealer, Opener) {
    let caller = Caller::new(KEY, nonce(console));
    let Ok(Accepted::<u32>::Hello(welcome)) = receiver.accept(&caller.hello(), || nonce(robot)) else {
        panic!("welcome")
    };
    caller.welcomed(&welcome).expect("the answer to this call")
}

fn seal(sealer: &mut Sealer, body: u32) -> Vec<u8> {
    sealer.seal(&body, &mut [0; LONGEST]).expect("short").0.to_vec()
}

fn hear(receiver: &mut SessionReceiver, frame: &[u8]) -> Result<(u32, u32, bool), Rejected> {
    match receiver.accept::<u32>(frame, || panic!("no new nonce"))? {
        Accepted::Downlink { downlink, began } => Ok((downlink.body, downlink.missing, began.is_some())),
        Accepted::Hello(_) => panic!("an order"),
    }
}

/// Against the `hmac` module of Python's standard library.
#[test]
fn a_tag_is_hmac_sha_256_cut_short() {
    let expected = [0xdb, 0x46, 0x91, 0x25, 0x9c, 0xa0, 0x71, 0x40, 0x59, 0xcf, 0x91, 0x7f, 0xff, 0xab, 0x03, 0xd1];
    assert_eq!(tag(&KEY, b"Hi There"), expected);
}

#[test]
fn both_ends_understand_each_other_and_nobody_else_does() {
    let mut receiver = receiver();
    let (mut sealer, mut opener) = session(&mut receiver, 1, 2);
    assert_eq!(hear(&mut receiver, &seal(&mut sealer, 70_000)), Ok((70_000, 0, true)));
    assert_eq!(hear(&mut receiver, &seal(&mut sealer, 5)), Ok((5, 0, false)));
    let mut robot = Sealer::robot(session_key(&KEY, nonce(1), nonce(2)));
    let told = seal(&mut robot, 9);
    assert_eq!(opener.open::<u32>(&told).map(|opened| opened.body), Ok(9));
    assert_eq!(hear(&mut receiver, &told), Err(Rejected::Misdirected));
    let mut other = SessionReceiver::new(Key([8; 32]));
    session_of_other(&mut other);
    assert_eq!(hear(&mut other, &seal(&mut sealer, 5)), Err(Rejected::Forged));
}

fn session_of_other(receiver: &mut SessionReceiver) {
    let caller = Caller::new(Key([8; 32]), nonce(1));
    assert!(matches!(receiver.accept::<u32>(&caller.hello(), || nonce(2)), Ok(Accepted::Hello(_))));
}

#[test]
fn every_wrong_bit_and_every_cut_is_rejected() {
    let mut receiver = receiver();
    let (mut sealer, _) = session(&mut receiver, 1, 2);
    let good = seal(&mut sealer, 1_000_000);
    for index in 0..good.len() {
        for bit in 0..8 {
            let mut bad = good.clone();
            bad[index] ^= 1 << bit;
            assert!(hear(&mut receiver, &bad).is_err(), "byte {index} bit {bit}");
        }
        assert!(hear(&mut receiver, &good[..index]).is_err(), "{index} bytes");
    }
    let mut longer = good.clone();
    longer.push(0);
    assert_eq!(hear(&mut receiver, &longer), Err(Rejected::Forged));
    assert_eq!(hear(&mut receiver, &good), Ok((1_000_000, 0, true)));
}

#[test]
fn a_frame_counts_once_and_a_late_one_not_at_all() {
    let mut receiver = receiver();
    let (mut sealer, _) = session(&mut receiver, 1, 2);
    let frames: Vec<_> = (0..5).map(|body| seal(&mut sealer, body)).collect();
    assert_eq!(hear(&mut receiver, &frames[0]), Ok((0, 0, true)));
    assert_eq!(hear(&mut receiver, &frames[0]), Err(Rejected::Outdated));
    assert_eq!(hear(&mut receiver, &frames[3]), Ok((3, 2, false)));
    for late in &frames[..4] {
        assert_eq!(hear(&mut receiver, late), Err(Rejected::Outdated));
    }
    assert_eq!(hear(&mut receiver, &frames[4]), Ok((4, 0, false)));
}

#[test]
fn a_replayed_hello_ends_nothing_and_an_old_sessions_orders_are_over() {
    let mut receiver = receiver();
    let old_call = Caller::new(KEY, nonce(1)).hello();
    let (mut old, _) = session(&mut receiver, 1, 2);
    let recorded = seal(&mut old, 1);
    assert_eq!(hear(&mut receiver, &recorded), Ok((1, 0, true)));
    let (mut now, _) = session(&mut receiver, 3, 4);
    // Until the new session speaks, the old one counts.
    assert_eq!(hear(&mut receiver, &seal(&mut old, 2)), Ok((2, 0, false)));
    assert_eq!(hear(&mut receiver, &seal(&mut now, 3)), Ok((3, 0, true)));
    assert_eq!(hear(&mut receiver, &seal(&mut old, 4)), Err(Rejected::Forged));
    // The old call again: another robot nonce, so that the recorded downlinks do not fit.
    assert!(matches!(receiver.accept::<u32>(&old_call, || nonce(5)), Ok(Accepted::Hello(_))));
    assert_eq!(hear(&mut receiver, &recorded), Err(Rejected::Forged));
    assert_eq!(hear(&mut receiver, &seal(&mut now, 6)), Ok((6, 0, false)));
}

#[test]
fn a_call_that_is_repeated_gets_the_same_answer() {
    let mut receiver = receiver();
    let caller = Caller::new(KEY, nonce(1));
    let first = receiver.accept::<u32>(&caller.hello(), || nonce(2));
    assert_eq!(receiver.accept::<u32>(&caller.hello(), || nonce(3)), first);
}

/// Somebody who has recorded hellos plays them all back while a console begins.
#[test]
fn replayed_hellos_keep_no_console_from_beginning() {
    let mut receiver = receiver();
    let recorded: Vec<_> = (100..200).map(|number| Caller::new(KEY, nonce(number)).hello()).collect();
    let drawn = core::cell::Cell::new(0_u64);
    let fresh = || {
        drawn.set(drawn.get() + 1);
        Nonce(drawn.get().to_le_bytes())
    };
    for begun in 0..3 {
        let caller = Caller::new(KEY, nonce(begun));
        let replay = |receiver: &mut SessionReceiver| {
            for hello in &recorded {
                assert!(matches!(receiver.accept::<u32>(hello, fresh), Ok(Accepted::Hello(_))));
            }
        };
        replay(&mut receiver);
        let Ok(Accepted::<u32>::Hello(welcome)) = receiver.accept(&caller.hello(), fresh) else { panic!("welcome") };
        replay(&mut receiver);
        let (mut sealer, _) = caller.welcomed(&welcome).expect("the answer to this call");
        assert_eq!(hear(&mut receiver, &seal(&mut sealer, 1)), Ok((1, 0, true)), "session {begun}");
        replay(&mut receiver);
        assert_eq!(hear(&mut receiver, &seal(&mut sealer, 2)), Ok((2, 0, false)), "session {begun}");
    }
}

/// A console that has begun anew before its first downlink came through: what it said before does not count any more.
#[test]
fn of_two_calls_with_one_answer_only_the_first_that_orders_begins() {
    let mut receiver = receiver();
    let (mut given_up, _) = session(&mut receiver, 1, 2);
    let held_back = seal(&mut given_up, 1);
    let (mut sealer, _) = session(&mut receiver, 3, 4);
    assert_eq!(hear(&mut receiver, &seal(&mut sealer, 2)), Ok((2, 0, true)));
    assert_eq!(hear(&mut receiver, &held_back), Err(Rejected::Forged));
    assert_eq!(hear(&mut receiver, &seal(&mut sealer, 3)), Ok((3, 0, false)));
}

#[test]
fn an_order_to_all_is_one_robots_and_to_the_others_not_forged() {
    let mut receivers = [receiver(), SessionReceiver::new(Key([8; 32]))];
    let (mut sealer, _) = session(&mut receivers[0], 1, 2);
    let other = Caller::new(Key([8; 32]), nonce(3));
    let Ok(Accepted::<u32>::Hello(welcome)) = receivers[1].accept(&other.hello(), || nonce(4)) else {
        panic!("welcome")
    };
    let (mut others, _) = other.welcomed(&welcome).expect("the answer to this call");
    assert_eq!(hear(&mut receivers[1], &seal(&mut others, 1)), Ok((1, 0, true)));
    let mut buffer = [0; LONGEST];
    let (frame, counter) = sealer.seal_to_all(&7_u32, &mut buffer).expect("short");
    assert_eq!((hear(&mut receivers[0], frame), counter), (Ok((7, 0, true)), 0));
    assert_eq!(hear(&mut receivers[0], frame), Err(Rejected::Outdated));
    assert_eq!(hear(&mut receivers[1], frame), Err(Rejected::Misdirected));
    // As one robot's own it would be forged, and so is one of its own session with a wrong tag.
    assert_eq!(hear(&mut receivers[1], &seal(&mut sealer, 8)), Err(Rejected::Forged));
    let mut broken = frame.to_vec();
    broken[frame.len() - 1] ^= 1;
    assert_eq!(hear(&mut receivers[0], &broken), Err(Rejected::Forged));
}

#[test]
fn a_welcome_to_another_call_is_outdated_and_a_forged_one_is_rejected() {
    let mut receiver = receiver();
    let first = Caller::new(KEY, nonce(1));
    let Ok(Accepted::<u32>::Hello(welcome)) = receiver.accept(&first.hello(), || nonce(2)) else { panic!("welcome") };
    let second = Caller::new(KEY, nonce(3));
    assert_eq!(second.welcomed(&welcome).err(), Some(Rejected::Outdated));
    let stranger = Caller::new(Key([9; 32]), nonce(1));
    assert_eq!(stranger.welcomed(&welcome).err(), Some(Rejected::Forged));
    assert_eq!(receiver.accept::<u32>(&stranger.hello(), || panic!("not for a stranger")), Err(Rejected::Forged));
}

#[test]
fn another_version_is_named_before_anything_else_is_looked_at() {
    let mut frame = Caller::new(KEY, nonce(1)).hello();
    frame[..4].copy_from_slice(&(VERSION ^ 1).to_le_bytes());
    assert_eq!(receiver().accept::<u32>(&frame, || nonce(2)), Err(Rejected::OtherVersion(VERSION ^ 1)));
    assert_eq!(kind(&notice()), Ok(Kind::Notice));
    assert_eq!(kind(&[]), Err(Rejected::Misdirected));
}

#[test]
fn the_longest_body_fits_and_a_longer_one_is_refused() {
    let mut sealer = Sealer::robot(KEY);
    let mut buffer = [0; LONGEST];
    let body = std::vec![1u8; LONGEST_BODY - 2];
    assert_eq!(sealer.seal(&body.as_slice(), &mut buffer).map(|(frame, _)| frame.len()), Ok(LONGEST));
    let body = std::vec![1u8; LONGEST_BODY - 1];
    assert_eq!(sealer.seal(&body.as_slice(), &mut buffer), Err(Unsealed::TooLong));
    let mut sealer = Sealer::console(KEY, nonce(1));
    let body = std::vec![1u8; LONGEST_BODY - NONCE - 2];
    assert_eq!(sealer.seal(&body.as_slice(), &mut buffer).map(|(frame, _)| frame.len()), Ok(LONGEST));
    let body = std::vec![1u8; LONGEST_BODY - NONCE - 1];
    assert_eq!(sealer.seal(&body.as_slice(), &mut buffer), Err(Unsealed::TooLong));
}

#[test]
fn a_counter_at_its_end_seals_no_more() {
    let mut sealer = Sealer { next: u32::MAX, ..Sealer::robot(KEY) };
    assert_eq!(sealer.seal(&1u32, &mut [0; LONGEST]), Err(Unsealed::Exhausted));
}

#[test]
fn a_key_is_not_printed() {
    let printed = std::format!("{:?} {:?} {:?}", KEY, receiver(), Sealer::robot(KEY));
    assert!(!printed.contains('7'), "{printed}");
}
