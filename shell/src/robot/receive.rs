//! The receiving task: waits for nothing but the radio, and believes only the console that the robot is paired with.

use control::protocol::radio::{Counters, Downlink};
use control::protocol::secure::{Accepted, Opened, Rejected, SessionReceiver};
use embassy_time::{Duration, Instant};

use super::Shared;
use super::shared::ReceivedDownlink;
use crate::board::{Address, Entropy, Received, Receiver};

/// A console of another version is told so at most this often.
const NOTICE: Duration = Duration::from_secs(1);

/// Hands downlinks to the control loop. What nobody has signed, or what was there before, changes nothing but counters.
pub async fn receive(
    mut receiver: impl Receiver,
    mut session: SessionReceiver,
    console: Address,
    mut entropy: impl Entropy,
    shared: &Shared,
) -> ! {
    let mut noticed: Option<Instant> = None;
    loop {
        let Received { from, payload, .. } = receiver.receive().await;
        let now = Instant::now();
        match session.accept(&payload, || entropy.nonce()) {
            Ok(Accepted::Hello(welcome)) => {
                shared.count(|c| add(&mut c.calls, 1));
                shared.welcome.signal(welcome);
            }
            Ok(Accepted::Downlink { downlink, began }) => {
                let begins = began.is_some();
                if let Some(key) = began {
                    shared.began.signal(key);
                }
                take(&downlink, begins, now, shared);
            }
            Err(rejected) => {
                shared.count(|c| add(counter(c, rejected), 1));
                let due = noticed.is_none_or(|at| now.saturating_duration_since(at) >= NOTICE);
                if matches!(rejected, Rejected::OtherVersion(_)) && from == console && due {
                    noticed = Some(now);
                    shared.notice.signal(());
                }
            }
        }
    }
}

fn take(downlink: &Opened<Downlink>, begins: bool, now: Instant, shared: &Shared) {
    shared.count(|c| {
        add(&mut c.received, 1);
        add(&mut c.lost, downlink.missing);
    });
    shared.heard(downlink.counter, now);
    shared.downlink(ReceivedDownlink { downlink: downlink.body, begins, received_us: now.as_micros() });
}

fn counter(counters: &mut Counters, rejected: Rejected) -> &mut u32 {
    match rejected {
        Rejected::OtherVersion(_) => &mut counters.other_version,
        Rejected::Forged => &mut counters.forged,
        Rejected::Outdated => &mut counters.outdated,
        Rejected::Misdirected | Rejected::Unreadable => &mut counters.misunderstood,
    }
}

fn add(counter: &mut u32, more: u32) {
    *counter = counter.wrapping_add(more);
}
