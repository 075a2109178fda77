//! The sending task: what begins a session first, then answers, then the status, then telemetry.
//!
//! The status comes once a second and so cannot keep telemetry waiting; the other way round a slow radio would keep the
//! status, and with it the counters that tell of it, from ever being sent.
//!
//! A radio that sends nothing any more ([`crate::bounded`]) ends with the processor's reset, with the motor off. While it is
//! driven the console hears nothing either: its heartbeats age, and the supervisor stops the motor first.

use control::protocol::radio::{Counters, LONGEST, Report, Reset, Status, Uplink};
use control::protocol::secure::{Key, Sealer, WELCOME, notice};
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_time::{Duration, Instant, Timer};

use super::command_handler::uptime_ms;
use super::shared::Answered;
use super::{About, Shared};
use crate::board::{Address, Gauge, Readings, Restart, Sender, Sent};
use crate::bounded::{Bounded, Broken};

const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// Interval at which a broken radio looks whether the motor has stopped.
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// Tells the console what the robot does, once there is a session. Every send is awaited to its end, or to its limit: then the
/// processor is reset as soon as the motor is off.
pub async fn send(
    sender: impl Sender,
    gauge: impl Gauge,
    mut restart: impl Restart,
    console: Address,
    about: &About,
    shared: &Shared,
) -> ! {
    let mut sender = Bounded::new(sender);
    let mut session: Option<Session> = None;
    let mut buffer = [0; LONGEST];
    loop {
        let told = match next(session.as_ref(), shared).await {
            Next::Welcome(frame) => tell(&mut sender, &console, &frame, shared).await,
            Next::Notice => tell(&mut sender, &console, &notice(), shared).await,
            Next::Began(key) => {
                session = Some(Session { sealer: Sealer::robot(key), status_due: Instant::now() });
                continue;
            }
            Next::Message(message) => {
                let Some(session) = session.as_mut() else { continue };
                let message = message.unwrap_or_else(|| session.status(about, &gauge, shared));
                let uplink = Uplink { uptime_ms: uptime_ms(), echo: shared.echo(), report: message };
                // The longest of them fit (tested in `radio`).
                let Ok((frame, _)) = session.sealer.seal(&uplink, &mut buffer) else { continue };
                tell(&mut sender, &console, frame, shared).await
            }
        };
        if told.is_err() {
            while !shared.stand_down() {
                Timer::after(LOOK_AGAIN).await;
            }
            restart.restart(Reset::Radio);
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
    Message(Option<Report>),
}

/// Waits for the next thing to do. What is ready and comes first in the list goes first.
async fn next(session: Option<&Session>, shared: &Shared) -> Next {
    let beginnings = select3(shared.began.wait(), shared.welcome.wait(), shared.notice.wait());
    let messages = select3(shared.answers.receive(), until(session.map(|s| s.status_due)), shared.batches.receive());
    match select(beginnings, messages).await {
        Either::First(Either3::First(key)) => Next::Began(key),
        Either::First(Either3::Second(frame)) => Next::Welcome(frame),
        Either::First(Either3::Third(())) => Next::Notice,
        Either::Second(Either3::First(Answered { number, tick, answer })) => {
            Next::Message(Some(Report::Answer { number, tick, answer }))
        }
        Either::Second(Either3::Second(())) => Next::Message(None),
        Either::Second(Either3::Third(batch)) => Next::Message(Some(Report::Telemetry(batch))),
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

/// Sends a frame and counts what became of it.
async fn tell(
    sender: &mut Bounded<impl Sender>,
    console: &Address,
    frame: &[u8],
    shared: &Shared,
) -> Result<(), Broken> {
    let sent = sender.send(console, frame).await?;
    shared.count(|c| {
        let counter = if sent == Sent::Acknowledged { &mut c.sent } else { &mut c.send_failed };
        *counter = counter.wrapping_add(1);
        c.send_refused = c.send_refused.wrapping_add(u32::from(sent == Sent::Refused));
    });
    Ok(())
}

impl Session {
    fn status(&mut self, about: &About, gauge: &impl Gauge, shared: &Shared) -> Report {
        self.status_due = Instant::now() + STATUS_PERIOD;
        let Readings { too_long, overrun, heap_least_free } = gauge.read();
        Report::Status(Status {
            name: about.name.clone(),
            reset: about.reset,
            parameters: about.parameters,
            injectable: shared.is_injectable(),
            gait: shared.gait(),
            counters: Counters { too_long, overrun, heap_least_free, ..shared.take_counters() },
        })
    }
}
