//! The sending task: what begins a session first, then answers, then the status, then telemetry.
//!
//! The status comes once a second and so cannot keep telemetry waiting; the other way round a slow radio would keep the
//! status, and with it the counters that tell of it, from ever being sent.

use control::protocol::radio::{FromRobot, LONGEST, Status, Telling};
use control::protocol::secure::{Key, Sealer, WELCOME, notice};
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_time::{Duration, Instant, Timer};

use super::clerk::uptime_ms;
use super::shared::Answered;
use super::{About, Shared};
use crate::board::{Address, Sender};

const STATUS_PERIOD: Duration = Duration::from_secs(1);

/// Tells the console what the robot does, once there is a session. Every send is awaited to its end.
pub async fn send(mut sender: impl Sender, console: Address, about: &About, shared: &Shared) -> ! {
    let mut session: Option<Session> = None;
    let mut buffer = [0; LONGEST];
    loop {
        match next(session.as_ref(), shared).await {
            Next::Welcome(frame) => tell(&mut sender, &console, &frame, shared).await,
            Next::Notice => tell(&mut sender, &console, &notice(), shared).await,
            Next::Began(key) => session = Some(Session { sealer: Sealer::robot(key), status_due: Instant::now() }),
            Next::Message(message) => {
                let Some(session) = session.as_mut() else { continue };
                let message = message.unwrap_or_else(|| session.status(about, shared));
                let telling = Telling { uptime_ms: uptime_ms(), echo: shared.echo(), message };
                // The longest of them fit (tested in `radio`).
                let Ok((frame, _)) = session.sealer.seal(&telling, &mut buffer) else { continue };
                tell(&mut sender, &console, frame, shared).await;
            }
        }
    }
}

struct Session {
    sealer: Sealer,
    status_due: Instant,
}

enum Next {
    Welcome([u8; WELCOME]),
    Notice,
    Began(Key),
    /// Without a message it is the status's turn.
    Message(Option<FromRobot>),
}

/// Waits for the next thing to do. What is ready and comes first in the list goes first.
async fn next(session: Option<&Session>, shared: &Shared) -> Next {
    let beginnings = select3(shared.began.wait(), shared.welcome.wait(), shared.notice.wait());
    let messages = select3(shared.answers.receive(), until(session.map(|s| s.status_due)), shared.batches.receive());
    match select(beginnings, messages).await {
        Either::First(Either3::First(key)) => Next::Began(key),
        Either::First(Either3::Second(frame)) => Next::Welcome(frame),
        Either::First(Either3::Third(())) => Next::Notice,
        Either::Second(Either3::First(Answered { number, answer })) => {
            Next::Message(Some(FromRobot::Answer { number, answer }))
        }
        Either::Second(Either3::Second(())) => Next::Message(None),
        Either::Second(Either3::Third(batch)) => Next::Message(Some(FromRobot::Telemetry(batch))),
    }
}

/// A [`Timer`] yields once, even if it is late: telemetry would always be first.
async fn until(time: Option<Instant>) {
    match time {
        Some(time) if Instant::now() >= time => {}
        Some(time) => Timer::at(time).await,
        None => core::future::pending().await,
    }
}

async fn tell(sender: &mut impl Sender, console: &Address, frame: &[u8], shared: &Shared) {
    let acknowledged = sender.send(console, frame).await;
    shared.count(|c| {
        let counter = if acknowledged { &mut c.sent } else { &mut c.send_failed };
        *counter = counter.wrapping_add(1);
    });
}

impl Session {
    fn status(&mut self, about: &About, shared: &Shared) -> FromRobot {
        self.status_due = Instant::now() + STATUS_PERIOD;
        FromRobot::Status(Status {
            name: about.name.clone(),
            reset: about.reset,
            parameters: about.parameters,
            injectable: shared.is_injectable(),
            counters: shared.take_counters(),
        })
    }
}
