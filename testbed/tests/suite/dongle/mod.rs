//! The dongle's tasks on the host, under virtual time: a host that stops reading, talks rubbish or unplugs, and a radio
//! that is slow or deaf.

use std::cell::RefCell;
use std::rc::Rc;

use self::rig::{Done, DongleRig, HELLO, MET, READINGS, ROBOT, decode, frame, number, payload};
use control::protocol::dongle::{Counters, FromDongle, ToDongle};
use control::protocol::frame::Deframer;
use embassy_time::Timer;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use shell::board::{Readings, Sent};
use shell::dongle::{ANSWERS, RECEPTIONS, SENDS};
use testbed::serial::Cable;

mod liveness;
mod rig;

fn received(messages: &[FromDongle]) -> Vec<u32> {
    let number = |message: &FromDongle| match message {
        FromDongle::Received { from, rssi, payload } => {
            let number = number(payload);
            assert_eq!((*from, i32::from(*rssi)), (ROBOT, -40 - (number % 50) as i32));
            Some(number)
        }
        _ => None,
    };
    messages.iter().filter_map(number).collect()
}

fn sent(messages: &[FromDongle]) -> Vec<(u16, bool)> {
    let sent = |message: &FromDongle| match message {
        FromDongle::Sent { number, acknowledged } => Some((*number, *acknowledged)),
        _ => None,
    };
    messages.iter().filter_map(sent).collect()
}

/// Takes 1.5 ms, and every hundredth message is not acknowledged.
fn usual(number: u32) -> (u64, Sent) {
    (1500, if number % 100 == 99 { Sent::Unheard } else { Sent::Acknowledged })
}

/// What the host is told of the counters: the driver's are among them.
fn told(counters: Counters) -> FromDongle {
    let Readings { too_long, overrun, heap_least_free } = READINGS;
    FromDongle::Counted(Counters { too_long, overrun, heap_least_free, ..counters })
}

#[test]
fn ten_thousand_messages_both_ways_arrive_intact_and_in_order() {
    const MESSAGES: u32 = 10_000;
    let rig = DongleRig::new();
    let console = rig.clone();
    let host = async move {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        for number in 0..MESSAGES {
            console.send(number);
            Timer::after_micros(random.random_range(1000..3000)).await;
        }
        Timer::after_millis(100).await;
        console.say(&ToDongle::Count);
    };
    rig.run(40_000_000, usual, vec![Box::pin(host), rig.robot_talks(1900, 0..MESSAGES)]);
    let (messages, bad) = rig.heard();
    let counters = Counters { received: MESSAGES, sent: 9900, send_failed: 100, ..Counters::default() };
    assert_eq!((bad, &messages[0], messages.last()), (0, &HELLO, Some(&told(counters))));
    assert_eq!(received(&messages), (0..MESSAGES).collect::<Vec<_>>());
    assert_eq!(
        sent(&messages),
        (0..MESSAGES).map(|n| (n as u16, usual(n).1 == Sent::Acknowledged)).collect::<Vec<_>>()
    );
    let on_air: Vec<u32> = rig.radio.sent().iter().map(|(_, payload)| number(payload)).collect();
    assert_eq!(on_air, (0..MESSAGES).collect::<Vec<_>>());
}

#[test]
fn a_host_that_stops_reading_stops_nothing_else() {
    let rig = DongleRig::new();
    let console = rig.clone();
    let host = async move {
        for number in 0..1000 {
            match number {
                100 => console.usb.plug(Cable::Idle),
                900 => console.usb.plug(Cable::Reading),
                _ => {}
            }
            console.send(number);
            Timer::after_millis(5).await;
        }
    };
    rig.run(6_000_000, usual, vec![Box::pin(host), rig.robot_talks(10_000, 0..500)]);
    for (index, (at_us, payload)) in rig.radio.sent().iter().enumerate() {
        assert_eq!(number(payload) as usize, index);
        assert!(at_us.abs_diff(index as u64 * 5000) < 100, "message {index} went out at {at_us} us");
    }
    let ((messages, bad), counters) = (rig.heard(), rig.counters());
    assert_eq!((bad, messages.iter().filter(|message| **message == HELLO).count()), (0, 2));
    let (received, sent) = (received(&messages), sent(&messages));
    assert!(received.is_sorted() && sent.is_sorted());
    assert_eq!((counters.received, counters.sent, counters.send_failed), (500, 990, 10));
    assert_eq!(received.len() as u32 + counters.received_dropped, 500);
    assert_eq!(sent.len() as u32 + counters.answers_dropped, 1000);
    // Besides what waits in the queues, one frame is under way and one may be in the buffer; and while all that is told,
    // before it what became of the messages, some more comes in.
    assert!(counters.received_dropped.abs_diff(400 - RECEPTIONS as u32) <= 2, "{counters:?}");
    assert!(counters.answers_dropped.abs_diff(800 - ANSWERS as u32) <= 2, "{counters:?}");
    // The newest are there.
    assert!((452 - RECEPTIONS as u32..500).all(|number| received.contains(&number)), "{received:?}");
    assert!((902 - ANSWERS as u16..1000).all(|number| sent.iter().any(|(sent, _)| *sent == number)), "{sent:?}");
}

/// Unplugs after a number of bytes, for a second. What was read until then, and what afterwards.
fn unplugged(after: usize, cable: Cable) -> (DongleRig, Vec<u8>, Vec<u8>) {
    let rig = DongleRig::new();
    rig.usb.plug_after(after, cable);
    let before = Rc::new(RefCell::new(Vec::new()));
    let (usb, read) = (rig.usb.clone(), Rc::clone(&before));
    let host = async move {
        Timer::after_millis(1500).await;
        read.replace(usb.take());
        usb.plug(Cable::Reading);
    };
    rig.run(4_000_000, usual, vec![Box::pin(host), rig.robot_talks(20_000, 0..100)]);
    let afterwards = rig.usb.take();
    (rig, before.take(), afterwards)
}

#[test]
fn unplugged_at_any_byte_the_next_program_finds_a_hello_and_whole_frames() {
    for after in 1..1000 {
        for cable in [Cable::Broken, Cable::Gone, Cable::Idle] {
            let (rig, before, afterwards) = unplugged(after, cable);
            let what = format!("{cable:?} after {after} bytes");
            let ((earlier, _), (messages, bad)) = (decode(&before), decode(&afterwards));
            // The rest of the frame that was cut is not readable, and nothing else.
            assert!(bad <= 1, "{what}: {bad} bad frames");
            let hello = messages.iter().position(|message| *message == HELLO);
            // Before it, what was under way, and what the driver has kept.
            let kept = if cable == Cable::Idle { 4 } else { 1 };
            assert!(hello.is_some_and(|at| at <= kept), "{what}: Hello comes at {hello:?}");
            let numbers = [received(&earlier), received(&messages)].concat();
            assert!(numbers.is_sorted_by(|a, b| a < b), "{what}: {numbers:?}");
            assert_eq!(numbers.last(), Some(&99), "{what}");
            let (found, counters) = (numbers.len() as u32, rig.counters());
            assert_eq!(counters.received, 100);
            match cable {
                // What the driver reports as failed is counted. To a program that reads on, half a frame does no harm;
                // one that lacks but its last zero is whole.
                Cable::Broken => {
                    assert_eq!(found + counters.received_dropped, 100, "{what}");
                    let (all, _) = decode(&[before, afterwards].concat());
                    assert!(all.starts_with(&earlier) && all.ends_with(&messages), "{what}");
                    assert!(all.len() - earlier.len() - messages.len() <= 1, "{what}");
                }
                // What was torn or in the driver's buffer is lost without a word.
                _ => assert!((98..=100).contains(&(found + counters.received_dropped)), "{what}: {found} {counters:?}"),
            }
        }
    }
}

#[test]
fn a_slow_radio_drops_what_it_cannot_take_and_every_send_is_answered_once() {
    let rig = DongleRig::new();
    let console = rig.clone();
    let host = async move {
        for number in 0..1000 {
            console.send(number);
            Timer::after_millis(2).await;
        }
    };
    rig.run(
        4_000_000,
        |number| (20_000, if number % 3 == 0 { Sent::Unheard } else { Sent::Acknowledged }),
        vec![Box::pin(host)],
    );
    let ((messages, bad), counters) = (rig.heard(), rig.counters());
    let mut answers = sent(&messages);
    let acknowledged = answers.iter().filter(|(_, acknowledged)| *acknowledged).count() as u32;
    answers.sort_unstable();
    assert_eq!(answers.iter().map(|(number, _)| *number).collect::<Vec<_>>(), (0..1000).collect::<Vec<_>>());
    assert_eq!((bad, acknowledged, counters.answers_dropped), (0, counters.sent, 0));
    assert_eq!(counters.sent + counters.send_failed + counters.send_dropped, 1000);
    // Fifty a second for two seconds, and what had been waiting then.
    let on_air = rig.radio.sent().len();
    assert_eq!(on_air as u32, counters.sent + counters.send_failed);
    assert!((100 + SENDS..=101 + SENDS).contains(&on_air), "{on_air}");
}

#[test]
fn a_failed_read_spoils_one_frame_at_most() {
    let rig = DongleRig::new();
    let console = rig.clone();
    let host = async move {
        let whole = frame(&ToDongle::Send { number: 1, to: ROBOT, payload: payload(1) });
        console.write(&whole[..10]);
        Timer::after_millis(1).await;
        console.usb.fail_chip_read();
        Timer::after_millis(5).await;
        // Without a zero before it.
        console.write(&whole[1..]);
    };
    rig.run(100_000, usual, vec![Box::pin(host)]);
    assert_eq!(sent(&rig.heard().0), [(1, true)]);
    assert_eq!(rig.counters(), Counters { sent: 1, bad_frames: 1, ..Counters::default() });
}

#[test]
fn keys_reach_the_radio_in_the_host_s_order_and_who_finds_no_room_is_counted() {
    let rig = DongleRig::new();
    let console = rig.clone();
    let local = |number: u8| ToDongle::Meet { address: [number; 6], local: [number; 16] };
    let host = async move {
        console.say(&ToDongle::Primary([9; 16]));
        console.send(5);
        for number in 1..=3 {
            console.say(&local(number));
        }
        Timer::after_millis(10).await;
        console.say(&ToDongle::Count);
    };
    rig.run(100_000, usual, vec![Box::pin(host)]);
    let done = rig.radio.0.borrow().done.clone();
    assert_eq!(done[0], Done::Primary([9; 16]));
    assert!(matches!(&done[1], Done::Sent(_, sent) if *sent == payload(5)));
    assert_eq!(done[2..], [Done::Met([1; 6], [1; 16]), Done::Met([2; 6], [2; 16])]);
    assert_eq!(done.len(), 2 + MET);
    let counters = rig.counters();
    assert_eq!(counters, Counters { sent: 1, not_met: 1, ..Counters::default() });
    assert_eq!(rig.heard().0.last(), Some(&told(counters)));
}

/// What a host says: sense or rubbish.
#[derive(Clone, Debug)]
enum Said {
    Send,
    Hello,
    Bytes(Vec<u8>),
    /// A frame with a byte changed.
    Spoiled(usize, u8),
}

fn said() -> impl Strategy<Value = Said> {
    prop_oneof![
        3 => Just(Said::Send),
        1 => Just(Said::Hello),
        2 => prop::collection::vec(any::<u8>(), 0..200).prop_map(Said::Bytes),
        1 => prop::collection::vec(1..=u8::MAX, 1000..1200).prop_map(Said::Bytes),
        1 => (any::<usize>(), 1..=u8::MAX).prop_map(|(at, change)| Said::Spoiled(at, change)),
    ]
}

proptest! {
    #[test]
    fn rubbish_is_counted_and_the_next_message_is_served(said in prop::collection::vec(said(), 1..40)) {
        let rig = DongleRig::new();
        let mut expected = Vec::new();
        let mut bytes = Vec::new();
        for (index, said) in said.iter().enumerate() {
            let message = ToDongle::Send { number: index as u16, to: ROBOT, payload: payload(index as u32) };
            match said {
                Said::Send => {
                    expected.push((index as u16, true));
                    bytes.push(frame(&message));
                }
                Said::Hello => bytes.push(frame(&ToDongle::Hello)),
                Said::Bytes(rubbish) => bytes.push(rubbish.clone()),
                Said::Spoiled(at, change) => {
                    let mut spoiled = frame(&message);
                    let at = 1 + at % (spoiled.len() - 2);
                    spoiled[at] ^= change;
                    bytes.push(spoiled);
                }
            }
        }
        bytes.push(vec![0]);
        let mut reference = Deframer::default();
        bytes.iter().flatten().for_each(|byte| drop(reference.push::<ToDongle>(*byte)));
        let console = rig.clone();
        let host = async move {
            for bytes in bytes {
                console.write(&bytes);
                Timer::after_millis(2).await;
            }
        };
        rig.run(200_000, |_| (1500, Sent::Acknowledged), vec![Box::pin(host)]);
        let (messages, bad) = rig.heard();
        prop_assert_eq!(bad, 0);
        prop_assert_eq!(sent(&messages), expected);
        prop_assert_eq!(rig.counters().bad_frames, reference.bad());
    }
}
