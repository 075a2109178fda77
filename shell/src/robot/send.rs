//! The sending task: answers first, then the status, then telemetry.
//!
//! The status comes once a second and so cannot keep telemetry waiting; the other way round a slow radio would keep the
//! status, and with it the counters that tell of it, from ever being sent.

use control::protocol::radio::{self, FromRobot, LONGEST, Status};
use embassy_futures::select::{Either3, select3};
use embassy_time::{Duration, Instant, Timer};

use super::shared::Answered;
use super::{About, Shared};
use crate::board::{Address, Sender};

/// Everybody.
pub const BROADCAST: Address = [0xff; 6];

const STATUS_PERIOD: Duration = Duration::from_secs(1);

/// Tells what the robot does. Every send is awaited to its end.
pub async fn send(mut sender: impl Sender, about: &About, shared: &Shared) -> ! {
    let mut status_due = Instant::now();
    let mut buffer = [0; LONGEST];
    let mut sequence = 0_u16;
    loop {
        let (to, message) = next(&mut status_due, about, shared).await;
        // The longest of them fit (tested in `radio`).
        let Ok(bytes) = radio::encode(sequence, &message, &mut buffer) else { continue };
        sequence = sequence.wrapping_add(1);
        let acknowledged = sender.send(&to, bytes).await;
        shared.count(|c| {
            let counter = if acknowledged { &mut c.sent } else { &mut c.send_failed };
            *counter = counter.wrapping_add(1);
        });
    }
}

/// Waits for the next message to send. What is ready and comes first in the list goes first.
async fn next(status_due: &mut Instant, about: &About, shared: &Shared) -> (Address, FromRobot) {
    let next = select3(shared.answers.receive(), until(*status_due), shared.batches.receive()).await;
    let peer = shared.peer().unwrap_or(BROADCAST);
    match next {
        Either3::First(Answered { to, sequence, outcome }) => (to, FromRobot::Answer { sequence, outcome }),
        Either3::Second(()) => (peer, status(status_due, about, shared)),
        Either3::Third(batch) => (peer, FromRobot::Telemetry(batch)),
    }
}

/// A [`Timer`] yields once, even if it is late: telemetry would always be first.
async fn until(time: Instant) {
    if Instant::now() < time {
        Timer::at(time).await;
    }
}

fn status(due: &mut Instant, about: &About, shared: &Shared) -> FromRobot {
    let now = Instant::now();
    *due = now + STATUS_PERIOD;
    FromRobot::Status(Status {
        name: about.name.clone(),
        uptime_ms: u32::try_from(now.as_millis()).unwrap_or(u32::MAX),
        reset: about.reset,
        parameters: about.parameters,
        counters: shared.take_counters(),
    })
}
