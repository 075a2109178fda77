//! The air against closed forms and against what was measured of ESP-NOW.

use crate::common::default_robot;
use hal_sim::radio::airtime::Rate;
use hal_sim::radio::loss::{Bursts, Loss};
use hal_sim::radio::{Address, Air, BROADCAST, LONGEST, LONGEST_HEARD, Sent, Trouble};
use hal_sim::random::{Source, Stream};
use robot_file::robot::Radio;

const ROBOT: Address = [2, 0, 0, 0, 0, 1];
const DONGLE: Address = [2, 0, 0, 0, 0, 2];
const STRANGER: Address = [2, 0, 0, 0, 0, 3];

fn file() -> Radio {
    default_robot().radio.expect("robot.toml has [radio]")
}

/// The robot file's radio without anything that goes wrong.
fn clean() -> Radio {
    let mut radio = file();
    for share in [
        &mut radio.tail_share,
        &mut radio.late_callback_share,
        &mut radio.loss_share,
        &mut radio.quiet_loss_share,
        &mut radio.duplicate_share,
        &mut radio.reorder_share,
        &mut radio.corruption_share,
        &mut radio.fading_db,
    ] {
        share.value = 0.0;
    }
    radio
}

/// The air with a robot and a dongle.
fn air(radio: &Radio, seed: u64) -> Air {
    let mut air = Air::new(radio, seed);
    air.join(ROBOT);
    air.join(DONGLE);
    air
}

/// Everything that a station can receive by a time.
fn receive_all(air: &mut Air, now_us: u64, station: &Address) -> Vec<hal_sim::radio::Delivery> {
    std::iter::from_fn(|| air.receive(now_us, station)).collect()
}

/// Sends frames of four bytes with their number, one a period, and takes them out as they arrive: callbacks, arrivals.
fn train(air: &mut Air, count: u32, period_us: u64, to: Address) -> (Vec<Sent>, Vec<Option<u64>>) {
    let mut arrivals = vec![None; count as usize];
    let mut note = |air: &mut Air, now_us| {
        for delivery in receive_all(air, now_us, &ROBOT) {
            let number = u32::from_le_bytes(delivery.payload.try_into().unwrap());
            arrivals[number as usize] = Some(delivery.arrived_us);
        }
    };
    let sent = (0..count)
        .map(|number| {
            let now_us = u64::from(number) * period_us;
            note(air, now_us);
            air.send(now_us, DONGLE, to, &number.to_le_bytes())
        })
        .collect();
    note(air, u64::MAX);
    (sent, arrivals)
}

/// Value at a share of the sorted list.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

#[test]
fn airtimes_are_the_standards() {
    let (slow, fast) = (Rate::new(1e6), Rate::new(6e6));
    // 192 µs of preamble and 250 + 43 + 16 bytes.
    assert_eq!(slow.frame_us(250, true), 192.0 + 8.0 * 309.0);
    assert_eq!(slow.frame_us(0, false), 192.0 + 8.0 * 43.0);
    assert_eq!(slow.acknowledgement_us(), 10.0 + 192.0 + 112.0);
    assert_eq!(slow.spacing_us(), 50.0);
    // 22 + 2472 bits are 103.9 symbols of 24 bits: 104.
    assert_eq!(fast.frame_us(250, true), 20.0 + 416.0 + 6.0);
    assert_eq!(fast.acknowledgement_us(), 10.0 + 20.0 + 24.0 + 6.0);
    assert_eq!(fast.spacing_us(), 28.0);
    assert_eq!((slow.window(0), slow.window(1), slow.window(5), slow.window(20)), (32, 64, 1024, 1024));
    assert_eq!((fast.window(0), fast.window(6), fast.window(31)), (16, 1024, 1024));
}

#[test]
fn long_frames_go_round_as_measured() {
    // Measured at ESP-NOW's default of 1 Mb/s: 5.4–7.5 ms for 250 bytes.
    let mut radio = file();
    radio.unicast_bit_per_s.value = 1e6;
    let mut air = air(&radio, 1);
    let mut trips = Vec::new();
    for n in 0..4000_u64 {
        let begin_us = n * 200_000;
        air.send(begin_us, DONGLE, ROBOT, &[1; LONGEST]);
        let Some(there_us) = air.next_arrival_us(&ROBOT) else { continue };
        receive_all(&mut air, there_us, &ROBOT);
        air.send(there_us, ROBOT, DONGLE, &[2; LONGEST]);
        let Some(back_us) = air.next_arrival_us(&DONGLE) else { continue };
        receive_all(&mut air, back_us, &DONGLE);
        trips.push((back_us - begin_us) as f64 * 1e-3);
    }
    assert!(trips.len() > 3900, "{} of 4000 came back", trips.len());
    let [low, median, high] = [0.05, 0.5, 0.9].map(|share| quantile(&mut trips, share));
    assert!((5.4..6.3).contains(&low), "5 % within {low} ms");
    assert!((6.2..6.9).contains(&median), "median {median} ms");
    assert!(high < 7.5, "90 % within {high} ms");
    // Two frames, each in the tail once in a hundred: 5 to 20 ms more. Retries in a burst take as long about as often.
    let tail = trips.iter().filter(|&&ms| ms > 11.5).count() as f64 / trips.len() as f64;
    assert!((0.015..0.045).contains(&tail), "{tail} of the trips in the tail");
}

#[test]
fn short_broadcasts_are_as_fast_as_measured_with_their_tail() {
    let mut air = air(&file(), 2);
    let (sent, arrivals) = train(&mut air, 20_000, 100_000, BROADCAST);
    assert!(sent.iter().all(|sent| sent.acknowledged));
    let delays = arrivals.iter().enumerate().filter_map(|(n, &at)| Some((at? - n as u64 * 100_000) as f64 * 1e-3));
    let mut delays: Vec<f64> = delays.collect();
    let median = quantile(&mut delays, 0.5);
    assert!((1.2..1.4).contains(&median), "median {median} ms");
    // The tail, 1 % of all, is uniform from 5 to 20 ms on top of the median.
    let past_ten = delays.iter().filter(|&&ms| ms > 10.0).count() as f64 / delays.len() as f64;
    let expected = 0.01 * (20.0 - (10.0 - 1.3)) / 15.0;
    let error = (expected / delays.len() as f64).sqrt();
    assert!((past_ten - expected).abs() < 4.0 * error, "{past_ten} past 10 ms, expected {expected} ± {error}");
}

#[test]
fn late_callbacks_are_ten_to_fifty_milliseconds_late() {
    let mut radio = clean();
    radio.late_callback_share.value = 0.1;
    let mut air = air(&radio, 3);
    let (sent, arrivals) = train(&mut air, 5000, 100_000, ROBOT);
    let late: Vec<u64> =
        sent.iter().zip(&arrivals).map(|(sent, at)| sent.done_us - at.unwrap()).filter(|&late| late > 1000).collect();
    assert_eq!(late.len() as u64, air.counts().late_callbacks);
    assert!((400..600).contains(&late.len()), "{} of 5000", late.len());
    assert!(late.iter().all(|late| (10_000..50_200).contains(late)), "{late:?}");
    assert!(late.iter().any(|&late| late < 12_000) && late.iter().any(|&late| late > 48_000));
}

#[test]
fn bursts_follow_gilbert_and_elliott() {
    // All is lost in a burst and nothing out of it: the losses are the chain itself.
    let loss = Loss { share: 0.2, quiet_share: 0.0, burst_share: 1.0, burst_us: 30_000.0 };
    assert!((loss.time_in_bursts() - 0.2).abs() < 1e-12);
    let (count, step_us) = (400_000_u64, 1000);
    let mut stream = Stream::new(4, Source::RadioLoss);
    let mut bursts = Bursts::default();
    let lost: Vec<bool> = (0..count).map(|n| bursts.lose(n * step_us, &loss, &mut stream)).collect();
    // The variance of the share grows by the correlation, 1 + 2 Σ ρ^k with ρ = exp(−step / (burst · (1 − share))).
    let share = lost.iter().filter(|&&lost| lost).count() as f64 / count as f64;
    let rho = (-(step_us as f64) / 24_000.0).exp();
    let error = (0.2 * 0.8 / count as f64 * (1.0 + rho) / (1.0 - rho)).sqrt();
    assert!((share - 0.2).abs() < 4.0 * error, "share {share} ± {error}");
    // A sampled run of losses is geometric: it goes on with probability 0.2 + 0.8 ρ.
    let runs = lost.chunk_by(|a, b| a == b).filter(|run| run[0]).map(|run| run.len() as f64);
    let runs: Vec<f64> = runs.collect();
    let mean = runs.iter().sum::<f64>() / runs.len() as f64;
    let expected = 1.0 / (0.8 * (1.0 - rho));
    assert!((mean / expected - 1.0).abs() < 4.0 / (runs.len() as f64).sqrt(), "runs of {mean}, expected {expected}");
    assert!((expected * step_us as f64 / 30_000.0 - 1.0).abs() < 0.05, "which is the mean burst");
}

#[test]
fn losses_in_and_out_of_bursts_make_the_long_run() {
    let loss = Loss { share: 0.03, quiet_share: 0.01, burst_share: 0.6, burst_us: 20_000.0 };
    let mut stream = Stream::new(5, Source::RadioLoss);
    let mut bursts = Bursts::default();
    let count = 400_000_u64;
    let lost = (0..count).filter(|n| bursts.lose(n * 5000, &loss, &mut stream)).count() as f64 / count as f64;
    assert!((lost - 0.03).abs() < 0.0015, "{lost}");
    // Right after a loss another is likelier, long after it is not.
    assert!((loss.in_burst_after(true, 0.0) - 1.0).abs() < 1e-12);
    assert!((loss.in_burst_after(false, 1e9) - loss.time_in_bursts()).abs() < 1e-12);
}

#[test]
fn retries_make_a_power_of_an_independent_loss() {
    for (retries, p) in [(0, 0.1), (1, 0.3), (2, 0.5), (5, 0.6)] {
        let mut radio = clean();
        radio.retries.value = f64::from(retries);
        let mut air = air(&radio, 6);
        air.trouble(Trouble { loss_share: Some(p), burst_us: Some(0), ..Trouble::NONE });
        let count = 20_000;
        let (sent, arrivals) = train(&mut air, count, 100_000, ROBOT);
        let within = |found: usize, expected: f64, what: &str| {
            let (share, error) =
                (found as f64 / f64::from(count), (expected * (1.0 - expected) / f64::from(count)).sqrt());
            assert!(
                (share - expected).abs() < 4.0 * error,
                "{what} with {retries} retries: {share}, expected {expected}"
            );
        };
        let missing = arrivals.iter().filter(|at| at.is_none()).count();
        within(missing, p.powi(retries + 1), "lost");
        // The sender needs frame and acknowledgement.
        let unacknowledged = sent.iter().filter(|sent| !sent.acknowledged).count();
        within(unacknowledged, (1.0 - (1.0 - p).powi(2)).powi(retries + 1), "unacknowledged");
        let counts = air.counts();
        assert_eq!(counts.unacknowledged as usize, unacknowledged);
        assert_eq!(counts.delivered, u64::from(count) - missing as u64, "copies do not arrive");
        assert!(retries == 0 || counts.suppressed > 0);
    }
}

#[test]
fn a_burst_outlasts_the_retries() {
    // The same loss hurts more in bursts of 100 ms: the retries, some milliseconds, all fall into one.
    let missing = |burst_us| {
        let mut air = air(&clean(), 7);
        air.trouble(Trouble {
            loss_share: Some(0.2),
            burst_loss_share: Some(1.0),
            burst_us: Some(burst_us),
            ..Trouble::NONE
        });
        train(&mut air, 20_000, 100_000, ROBOT).1.iter().filter(|at| at.is_none()).count()
    };
    assert!(missing(0) < 10);
    assert!((3000..4200).contains(&missing(100_000)), "{}", missing(100_000));
}

#[test]
fn a_unicast_that_nobody_answers_takes_all_tries() {
    let mut radio = clean();
    radio.unicast_bit_per_s.value = 1e6;
    let mut air = Air::new(&radio, 8);
    let sent = air.send(0, DONGLE, ROBOT, &[0; LONGEST]);
    assert!(!sent.acknowledged);
    // Six frames and six waits, and no more than the largest backoffs between them.
    let rate = Rate::new(1e6);
    let least = 6.0 * (rate.spacing_us() + rate.frame_us(LONGEST, true) + rate.acknowledgement_us());
    assert!((least..least + 20.0 * 2016.0 + 700.0).contains(&(sent.done_us as f64)), "{} µs", sent.done_us);
    assert_eq!((air.counts().unheard, air.counts().retried, air.counts().unacknowledged), (6, 5, 1));
    assert_eq!(air.next_arrival_us(&ROBOT), None);
    assert_eq!(air.receive(u64::MAX, &ROBOT), None);
}

#[test]
fn one_frame_waits_for_another_on_the_channel() {
    let mut air = air(&clean(), 9);
    air.join(STRANGER);
    for n in 0..50_u8 {
        air.send(0, if n % 2 == 0 { DONGLE } else { STRANGER }, ROBOT, &[n; LONGEST]);
    }
    let mut last_us = 0;
    for n in 0..50 {
        let at_us = air.next_arrival_us(&ROBOT).unwrap();
        let delivery = air.receive(at_us, &ROBOT).unwrap();
        assert_eq!((delivery.payload[0], delivery.arrived_us), (n, at_us));
        assert!(at_us - last_us >= 442, "a frame of 442 µs came {} µs after another", at_us - last_us);
        last_us = at_us;
    }
}

#[test]
fn the_queue_drops_its_oldest_in_silence() {
    let mut air = air(&clean(), 10);
    for n in 0..25_u8 {
        assert!(air.send(u64::from(n) * 10_000, DONGLE, ROBOT, &[n]).acknowledged);
    }
    let received: Vec<u8> = receive_all(&mut air, 1_000_000, &ROBOT).iter().map(|d| d.payload[0]).collect();
    assert_eq!(received, (15..25).collect::<Vec<u8>>());
    assert_eq!(air.counts().overflowed, 15);
    air.trouble(Trouble { receive_queue: Some(3), ..Trouble::NONE });
    for n in 0..5_u8 {
        air.send(2_000_000 + u64::from(n) * 10_000, DONGLE, ROBOT, &[n]);
    }
    assert_eq!(receive_all(&mut air, 3_000_000, &ROBOT).len(), 3);
    assert_eq!(air.counts().overflowed, 17);
}

#[test]
fn nothing_is_received_before_it_arrives() {
    let mut air = air(&clean(), 11);
    air.send(0, DONGLE, ROBOT, b"one");
    let at_us = air.next_arrival_us(&ROBOT).unwrap();
    assert_eq!(air.receive(at_us - 1, &ROBOT), None);
    let delivery = air.receive(at_us, &ROBOT).unwrap();
    assert_eq!((delivery.from, delivery.payload.as_slice(), delivery.rssi), (DONGLE, b"one".as_slice(), -40));
    assert_eq!(air.receive(u64::MAX, &ROBOT), None);
    assert!(!air.send(50_000, DONGLE, DONGLE, b"me").acknowledged);
    air.send(100_000, DONGLE, BROADCAST, b"all");
    assert_eq!(air.next_arrival_us(&DONGLE), None, "a sender does not hear itself");
}

#[test]
fn everybody_hears_a_broadcast_but_who_is_off() {
    let mut air = air(&clean(), 12);
    air.join(STRANGER);
    air.send(0, DONGLE, BROADCAST, b"all");
    assert!(air.receive(10_000, &ROBOT).is_some() && air.receive(10_000, &STRANGER).is_some());
    assert_eq!(air.receive(10_000, &DONGLE), None);
    air.send(20_000, DONGLE, BROADCAST, b"again");
    air.leave(&ROBOT);
    assert_eq!(air.receive(30_000, &ROBOT), None, "what was on its way is gone");
    assert!(!air.send(30_000, DONGLE, ROBOT, b"you").acknowledged);
    air.join(ROBOT);
    assert!(air.send(60_000, DONGLE, ROBOT, b"you").acknowledged);
}

#[test]
fn out_of_range_follows_from_the_distance() {
    let radio = clean();
    // −40 dBm at 1 m, 30 dB a decade, −93 dBm at least: 10^(53/30) m.
    let reach_m = 10_f64.powf(53.0 / 30.0);
    let mut air = air(&radio, 13);
    air.place(ROBOT, reach_m - 0.1);
    assert!(air.send(0, DONGLE, ROBOT, b"near").acknowledged);
    assert_eq!(air.receive(50_000, &ROBOT).unwrap().rssi, -93);
    air.place(ROBOT, reach_m + 0.1);
    assert!(!air.send(100_000, DONGLE, ROBOT, b"far").acknowledged);
    assert!(air.send(200_000, DONGLE, BROADCAST, b"far").acknowledged, "nobody acknowledges a broadcast");
    assert_eq!(air.receive(u64::MAX, &ROBOT), None);
    assert_eq!(air.counts().out_of_range, 6 + 1);
    air.place(DONGLE, reach_m);
    assert!(air.send(300_000, DONGLE, ROBOT, b"near again").acknowledged);
    // At the edge fading decides, half of the time.
    let mut fading = radio;
    fading.fading_db.value = 3.0;
    let mut air = self::air(&fading, 14);
    air.place(ROBOT, reach_m);
    let (_, arrivals) = train(&mut air, 4000, 20_000, BROADCAST);
    let share = arrivals.iter().flatten().count() as f64 / 4000.0;
    assert!((share - 0.5).abs() < 0.032, "{share}");
}

#[test]
fn shares_of_trouble_happen_and_are_counted() {
    let count = 20_000;
    let run = |trouble| {
        let mut air = air(&clean(), 15);
        air.trouble(trouble);
        let mut received = Vec::new();
        for n in 0..count {
            air.send(n * 10_000, DONGLE, ROBOT, &n.to_le_bytes());
            received.extend(receive_all(&mut air, n * 10_000, &ROBOT));
        }
        received.extend(receive_all(&mut air, u64::MAX, &ROBOT));
        let numbers: Vec<u64> =
            received.iter().map(|d| u64::from_le_bytes(d.payload.as_slice().try_into().unwrap())).collect();
        (air.counts(), numbers)
    };
    let near = |found: u64, share: f64| {
        let (expected, error) = (share * count as f64, (share * (1.0 - share) * count as f64).sqrt());
        assert!((found as f64 - expected).abs() < 4.0 * error, "{found}, expected {expected} ± {error}");
    };
    let in_order: Vec<u64> = (0..count).collect();
    assert_eq!(run(Trouble::NONE).1, in_order);

    let (counts, numbers) = run(Trouble { duplicate_share: Some(0.1), ..Trouble::NONE });
    near(counts.duplicated, 0.1);
    assert_eq!(numbers.len() as u64, count + counts.duplicated);
    assert_eq!(counts.reordered, 0);

    let (counts, numbers) = run(Trouble { reorder_share: Some(0.05), ..Trouble::NONE });
    near(counts.held_back, 0.05);
    let backwards = numbers.windows(2).filter(|pair| pair[1] < pair[0]).count();
    assert!(backwards > 500 && counts.reordered >= backwards as u64, "{backwards} steps back, {counts:?}");

    let (counts, numbers) = run(Trouble { corruption_share: Some(0.2), ..Trouble::NONE });
    near(counts.corrupted, 0.2);
    let wrong = numbers.iter().zip(&in_order).filter(|(found, sent)| found != sent).count();
    assert_eq!(wrong as u64, counts.corrupted);

    let (counts, numbers) = run(Trouble { silence: true, ..Trouble::NONE });
    assert_eq!((numbers.len(), counts.silenced, counts.unacknowledged), (0, 6 * count, count));
}

#[test]
fn delays_of_trouble_come_on_top() {
    let delays = |trouble| {
        let mut air = air(&clean(), 16);
        air.trouble(trouble);
        let (sent, arrivals) = train(&mut air, 4000, 200_000, ROBOT);
        let late = |at_us: u64, n: usize| at_us - n as u64 * 200_000;
        let arrivals: Vec<u64> = arrivals.iter().enumerate().map(|(n, at)| late(at.unwrap(), n)).collect();
        (arrivals, sent.iter().enumerate().map(|(n, sent)| late(sent.done_us, n)).collect::<Vec<u64>>())
    };
    let (plain, done) = delays(Trouble::NONE);
    let (extra, done_late) = delays(Trouble { extra_delay_us: 7000, ..Trouble::NONE });
    assert!(plain.iter().zip(&extra).all(|(a, b)| a + 7000 == *b));
    assert!(done.iter().zip(&done_late).all(|(a, b)| a + 7000 == *b));
    let (tail, _) = delays(Trouble { tail_share: Some(0.3), tail_most_us: Some(50_000), ..Trouble::NONE });
    let late: Vec<u64> = plain.iter().zip(&tail).map(|(a, b)| b - a).filter(|&late| late > 0).collect();
    assert!((1080..1320).contains(&late.len()), "{} of 4000", late.len());
    let mean = late.iter().sum::<u64>() as f64 / late.len() as f64;
    assert!((mean - 27_500.0).abs() < 4.0 * 45_000.0 / (12.0 * late.len() as f64).sqrt(), "mean {mean} µs");
    assert!(late.iter().all(|late| (5000..=50_000).contains(late)));
}

/// A second of traffic both ways with everything wrong; all that was received and counted.
fn everything(mut air: Air) -> (Vec<hal_sim::radio::Delivery>, Vec<Sent>, hal_sim::radio::AirCounts) {
    air.trouble(Trouble {
        loss_share: Some(0.2),
        duplicate_share: Some(0.1),
        reorder_share: Some(0.1),
        corruption_share: Some(0.1),
        tail_share: Some(0.1),
        ..Trouble::NONE
    });
    let (mut received, mut sent) = (Vec::new(), Vec::new());
    for n in 0..200_u64 {
        let now_us = 10_000_000 + n * 5000;
        sent.push(air.send(now_us, DONGLE, ROBOT, &n.to_le_bytes()));
        sent.push(air.send(now_us + 1000, ROBOT, BROADCAST, &[n as u8; 100]));
        received.extend(receive_all(&mut air, now_us + 2000, &ROBOT));
        received.extend(receive_all(&mut air, now_us + 2000, &DONGLE));
    }
    (received, sent, air.counts())
}

#[test]
fn the_same_seed_is_the_same_air_and_a_clone_goes_on_equally() {
    let radio = file();
    assert_eq!(everything(air(&radio, 17)), everything(air(&radio, 17)));
    assert_ne!(everything(air(&radio, 17)), everything(air(&radio, 18)));
    let mut used = air(&radio, 17);
    train(&mut used, 100, 10_000, ROBOT);
    used.send(9_999_000, DONGLE, ROBOT, b"on its way");
    assert_eq!(everything(used.clone()), everything(used));
}

#[test]
fn one_nuisance_leaves_the_others_alone() {
    // Corruption and duplicates change no time and no loss.
    let times = |trouble| {
        let mut air = air(&file(), 19);
        air.trouble(trouble);
        let sent: Vec<Sent> = (0..3000).map(|n| air.send(n * 10_000, DONGLE, ROBOT, &[1; 20])).collect();
        (sent, air.counts().lost)
    };
    let plain = times(Trouble::NONE);
    let noisy = Trouble { corruption_share: Some(0.5), duplicate_share: Some(0.5), ..Trouble::NONE };
    assert_eq!(plain, times(noisy));
    assert!(plain.1 > 0);
}

#[test]
fn too_long_a_frame_is_refused() {
    let mut air = air(&clean(), 20);
    assert_eq!(air.send(5, DONGLE, ROBOT, &[0; LONGEST + 1]), Sent { done_us: 5, acknowledged: false });
    air.inject(5, DONGLE, ROBOT, &[0; LONGEST_HEARD + 1]);
    assert_eq!(air.counts().refused, 2);
    assert_eq!(air.receive(u64::MAX, &ROBOT), None);
}

#[test]
fn a_radio_that_nobody_reads_gathers_no_more_than_its_queue() {
    let mut air = air(&clean(), 21);
    for n in 0..100_000_u64 {
        air.send(n * 10_000, DONGLE, ROBOT, &[0; 10]);
    }
    // Those before the last ten are gone at once, and not when somebody reads.
    assert!(air.next_arrival_us(&ROBOT) >= Some(99_989 * 10_000));
    assert_eq!(receive_all(&mut air, u64::MAX, &ROBOT).len(), 10);
    assert_eq!(air.counts().overflowed, 100_000 - 10);
    assert_eq!(air.overheard().len(), 256);
}
