//! The attacker: what it forges differs from what it heard, and arrives.

use std::collections::HashMap;

use crate::common::default_robot;
use hal_sim::radio::{Address, Adversary, Air, Attack, BROADCAST, Forgery, LONGEST, OLD_US, Overheard, Trouble};

const DONGLE: Address = [2, 0, 0, 0, 0, 9];
const ROBOTS: [Address; 3] = [[2, 0, 0, 0, 0, 1], [2, 0, 0, 0, 0, 2], [2, 0, 0, 0, 0, 3]];

fn quiet_air(seed: u64) -> Air {
    let mut air = Air::new(&default_robot().radio.expect("robot.toml has [radio]"), seed);
    air.join(DONGLE);
    ROBOTS.iter().for_each(|&robot| air.join(robot));
    air
}

/// Talks with three robots in turn, the attacker acting after each frame; what was sent and forged, with its time.
fn conversation(seed: u64, frames: u64) -> (Vec<Overheard>, Vec<(u64, Forgery)>, Air) {
    let (mut air, mut attacker) = (quiet_air(seed), Adversary::new(seed));
    let (mut sent, mut forged) = (Vec::new(), Vec::new());
    for n in 0..frames {
        let (now_us, robot) = (n * 20_000, ROBOTS[(n % 3) as usize]);
        let (from, to) = match n % 5 {
            0 | 1 => (DONGLE, robot),
            4 => (DONGLE, BROADCAST),
            _ => (robot, DONGLE),
        };
        // Numbered, so that no two are equal.
        let mut payload = vec![0x5a; 8 + (n as usize * 7) % (LONGEST - 7)];
        payload[..8].copy_from_slice(&n.to_le_bytes());
        air.send(now_us, from, to, &payload);
        sent.push(Overheard { sent_us: now_us, from, to, payload });
        forged.extend(attacker.act(now_us + 5000, &mut air).map(|forgery| (now_us + 5000, forgery)));
        for station in ROBOTS.iter().chain([&DONGLE]) {
            while air.receive(now_us + 10_000, station).is_some() {}
        }
    }
    (sent, forged, air)
}

#[test]
fn every_attack_happens_and_is_what_its_name_says() {
    let (sent, forged, air) = conversation(1, 5000);
    assert!(forged.len() > 4990);
    assert_eq!(air.counts().injected, forged.len() as u64);
    let by_payload: HashMap<&[u8], &Overheard> = sent.iter().map(|frame| (frame.payload.as_slice(), frame)).collect();
    let mut seen: HashMap<Attack, u32> = HashMap::new();
    for (at_us, Forgery { attack, from, to, payload }) in &forged {
        *seen.entry(*attack).or_default() += 1;
        assert!(payload.len() <= LONGEST && from != to);
        let original = by_payload.get(payload.as_slice());
        match (attack, original) {
            (Attack::Replay, Some(original)) => {
                assert_eq!((original.from, original.to), (*from, *to));
                assert!(original.sent_us + OLD_US <= *at_us);
            }
            (Attack::Reflect, Some(original)) => {
                assert!(original.from == *to && (original.to == *from || original.to == BROADCAST));
            }
            (Attack::Misdirect, Some(original)) => assert!(original.from == *from && original.to != *to),
            (attack, original) => {
                assert_eq!(original, None, "{attack:?} changed nothing");
                assert!(!matches!(attack, Attack::Replay | Attack::Reflect | Attack::Misdirect));
            }
        }
    }
    for attack in Attack::ALL {
        assert!(seen.get(&attack).is_some_and(|&count| count > 300), "{attack:?}: {seen:?}");
    }
}

#[test]
fn what_is_changed_is_where_the_name_says() {
    let mut air = quiet_air(2);
    let original: Vec<u8> = (0..100).collect();
    air.send(0, DONGLE, ROBOTS[0], &original);
    let mut attacker = Adversary::new(2);
    attacker.listen(&mut air);
    for n in 0..2000 {
        let now_us = OLD_US + n * 1000;
        for attack in
            [Attack::FlipBits, Attack::Truncate, Attack::Extend, Attack::Beginning, Attack::Number, Attack::End]
        {
            let forged = attacker.attack(now_us, attack, &mut air).unwrap().payload;
            let differing: Vec<usize> = (0..forged.len().min(100)).filter(|&i| forged[i] != original[i]).collect();
            match attack {
                Attack::FlipBits => {
                    let bits: u32 = forged.iter().zip(&original).map(|(a, b)| (a ^ b).count_ones()).sum();
                    assert!((1..=8).contains(&bits) && forged.len() == 100);
                }
                Attack::Truncate => assert!(forged.len() < 100 && differing.is_empty()),
                Attack::Extend => assert!((101..=116).contains(&forged.len()) && differing.is_empty()),
                Attack::Beginning => assert!(differing.len() == 1 && differing[0] < 8),
                Attack::Number => assert!(!differing.is_empty() && differing.iter().all(|&i| i < 19)),
                _ => assert_eq!(differing, (84..100).collect::<Vec<_>>()),
            }
        }
    }
}

#[test]
fn an_injected_frame_arrives_under_the_name_that_it_gives() {
    let mut air = quiet_air(3);
    air.trouble(Trouble { loss_share: Some(1.0), ..Trouble::NONE });
    air.inject(1000, DONGLE, ROBOTS[1], b"obey");
    let delivery = air.receive(5000, &ROBOTS[1]).expect("losses do not hinder an attacker, who tries again");
    assert_eq!((delivery.from, delivery.payload.as_slice()), (DONGLE, b"obey".as_slice()));
    assert_eq!(air.receive(5000, &ROBOTS[0]), None);
    air.inject(6000, DONGLE, BROADCAST, b"all");
    assert!(ROBOTS.iter().all(|robot| air.receive(10_000, robot).is_some()));
    assert_eq!(air.receive(10_000, &DONGLE), None);
    air.trouble(Trouble { silence: true, ..Trouble::NONE });
    air.inject(11_000, DONGLE, ROBOTS[1], b"obey");
    assert_eq!((air.receive(u64::MAX, &ROBOTS[1]), air.counts().silenced), (None, 1));
    assert_eq!(air.overheard(), [], "it does not hear itself");
}

#[test]
fn the_attacker_is_seeded_and_disturbs_no_other_draw() {
    assert_eq!(conversation(4, 300).1, conversation(4, 300).1);
    assert_ne!(conversation(4, 300).1, conversation(5, 300).1);
    let mut alone = quiet_air(4);
    let mut attacked = quiet_air(4);
    let mut attacker = Adversary::new(4);
    for n in 0..500 {
        let send = |air: &mut Air| air.send(n * 20_000, DONGLE, ROBOTS[(n % 3) as usize], &[n as u8; 60]);
        assert_eq!(send(&mut alone), send(&mut attacked));
        attacker.act(n * 20_000 + 1, &mut attacked);
    }
    assert!(attacked.counts().injected > 400);
}

#[test]
fn who_heard_nothing_forges_nothing() {
    let mut air = quiet_air(6);
    let mut attacker = Adversary::new(6);
    assert_eq!(attacker.act(0, &mut air), None);
    air.send(0, DONGLE, ROBOTS[0], &[]);
    attacker.listen(&mut air);
    // An empty payload leaves nothing to change, and a frame just sent is not old.
    for attack in [Attack::Replay, Attack::FlipBits, Attack::Truncate, Attack::Beginning, Attack::Number, Attack::End] {
        assert_eq!(attacker.attack(OLD_US - 1, attack, &mut air), None, "{attack:?}");
    }
    assert!(attacker.attack(OLD_US, Attack::Replay, &mut air).is_some());
    assert_eq!(attacker.attack(OLD_US, Attack::Misdirect, &mut air), None, "two stations are known, none is another");
}
