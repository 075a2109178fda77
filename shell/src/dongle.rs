//! The dongle: a radio on the host's USB serial line, as [`control::protocol::dongle`] has it.
//!
//! ```text
//! USB ──listen──▶ sends ──send──▶ radio
//!                        └──▶ answers ──┐
//! USB ◀───────────────tell◀─────────────┤
//! radio ──hear──▶ receptions ───────────┘
//! ```
//!
//! Only `tell` waits for the host, and only `send` for the radio. What does not fit into a queue meanwhile is dropped and
//! counted, so a host that does not read stops nothing but what is for it. Every `Send` is answered by one `Sent`, unless
//! [`Counters::answers_dropped`] counts it.
//!
//! A radio that sends nothing any more ([`crate::bounded`]) ends with the processor's reset, of which the host hears by a `Hello`. So
//! does anything that keeps one of the four tasks from coming round, for `guard` feeds the hardware watchdog only when each of them
//! has done so since the last time.

use core::cell::{Cell, RefCell};
use core::pin::pin;

use control::protocol::VERSION;
use control::protocol::dongle::{Counters, FromDongle, ToDongle};
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::radio::Reset;
use embassy_futures::join::join5;
use embassy_futures::select::{Either4, select4};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::{Channel, TrySendError};
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_io_async::{Read, Write};

use crate::board::{
    Address, Encryption, Gauge, Payload, RadioKey, Readings, Received, Receiver, Restart, Sender, Sent, Watchdog,
    WatchdogTimeout,
};
use crate::bounded::Bounded;

/// Commands that wait for the radio: it takes some milliseconds for each.
pub const SENDS: usize = 8;
/// Radio messages that wait for the host: 0.3 s of telemetry.
pub const RECEPTIONS: usize = 32;
/// Answers that wait for the host.
pub const ANSWERS: usize = 128;

/// A frame that takes longer has waited for the host: perhaps another program reads now, and needs a `Hello`. The longest
/// frame takes 30 ms at 115 200 baud.
const STALL: Duration = Duration::from_millis(500);
/// After a failed write: the host is not there.
const RETRY: Duration = Duration::from_millis(100);
/// After a failed read: short, because a UART that has lost bytes fails, too, and more are coming.
const READ_AGAIN: Duration = Duration::from_millis(1);
/// A task that waits comes round as often as that: several times in the watchdog's patience.
const ROUND: Duration = Duration::from_millis(200);

/// For the sending half of the radio, in the host's order.
#[expect(clippy::large_enum_variant, reason = "there is no heap, and few exist at a time")]
enum Job {
    Send { number: u16, to: Address, payload: Payload },
    Primary(RadioKey),
    Meet { address: Address, local: RadioKey },
}

#[derive(Clone, Copy)]
struct Answer {
    number: u16,
    acknowledged: bool,
}

type Queue<T, const N: usize> = Channel<CriticalSectionRawMutex, T, N>;

/// Queues and counters of the dongle's tasks. For a `static`.
pub struct Shared {
    jobs: Queue<Job, SENDS>,
    receptions: Queue<Received, RECEPTIONS>,
    answers: Queue<Answer, ANSWERS>,
    /// The host asked. One answer is enough where it asks again before that.
    hello: Signal<CriticalSectionRawMutex, ()>,
    count: Signal<CriticalSectionRawMutex, ()>,
    /// Every task has come round.
    alive: Signal<CriticalSectionRawMutex, ()>,
    rounds: Mutex<CriticalSectionRawMutex, Cell<u8>>,
    counters: Mutex<CriticalSectionRawMutex, RefCell<Counters>>,
}

impl Default for Shared {
    fn default() -> Self {
        Self::new()
    }
}

impl Shared {
    /// Nothing counted, nothing queued.
    #[must_use]
    pub const fn new() -> Self {
        let counters = Counters {
            received: 0,
            received_dropped: 0,
            sent: 0,
            send_failed: 0,
            send_dropped: 0,
            answers_dropped: 0,
            bad_frames: 0,
            not_met: 0,
            send_refused: 0,
            too_long: 0,
            overrun: 0,
            heap_least_free: 0,
        };
        Self {
            jobs: Channel::new(),
            receptions: Channel::new(),
            answers: Channel::new(),
            hello: Signal::new(),
            count: Signal::new(),
            alive: Signal::new(),
            rounds: Mutex::new(Cell::new(0)),
            counters: Mutex::new(RefCell::new(counters)),
        }
    }

    /// The counters as they are.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters.lock(|counters| *counters.borrow())
    }

    fn add(&self, counter: impl FnOnce(&mut Counters) -> &mut u32) {
        self.counters.lock(|counters| {
            let mut counters = counters.borrow_mut();
            let counter = counter(&mut counters);
            *counter = counter.wrapping_add(1);
        });
    }

    /// A task has come round.
    fn round(&self, task: Task) {
        let all = self.rounds.lock(|rounds| {
            let come = rounds.get() | 1 << task as u8;
            let all = come == Task::ALL;
            rounds.set(if all { 0 } else { come });
            all
        });
        if all {
            self.alive.signal(());
        }
    }

    /// Waits, and comes round meanwhile.
    async fn wait<T>(&self, task: Task, what: impl Future<Output = T>) -> T {
        let mut what = pin!(what);
        loop {
            self.round(task);
            // Only the reference is dropped: a read or a send goes on.
            if let Ok(done) = with_timeout(ROUND, what.as_mut()).await {
                return done;
            }
        }
    }

    /// Queues what the radio shall do, if there is room. A key that finds none is not lost in silence: what is sent without it
    /// is not acknowledged, and the host gives its keys again with the next session.
    fn order(&self, job: Job) {
        let number = if let Job::Send { number, .. } = &job { Some(*number) } else { None };
        if self.jobs.try_send(job).is_err() {
            self.add(|c| &mut c.send_dropped);
            if let Some(number) = number {
                self.answer(Answer { number, acknowledged: false });
            }
        }
    }

    /// Queues what the host shall know; the oldest goes where there is no room.
    fn answer(&self, answer: Answer) {
        while self.answers.try_send(answer).is_err() {
            if self.answers.try_receive().is_ok() {
                self.add(|c| &mut c.answers_dropped);
            }
        }
    }

    /// Queues what came in; the oldest goes where there is no room, because the newest tells how the robot is now.
    fn reception(&self, received: Received) {
        let mut newest = received;
        while let Err(TrySendError::Full(back)) = self.receptions.try_send(newest) {
            newest = back;
            if self.receptions.try_receive().is_ok() {
                self.add(|c| &mut c.received_dropped);
            }
        }
    }
}

/// Who the dongle is.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// ESP-NOW (MAC) address.
    pub address: Address,
    /// The radio's channel.
    pub channel: u8,
}

/// What waits, and must come round.
#[derive(Clone, Copy)]
enum Task {
    Hear,
    Send,
    Listen,
    Tell,
}

impl Task {
    /// A bit of each.
    const ALL: u8 =
        (1 << Self::Hear as u8) | (1 << Self::Send as u8) | (1 << Self::Listen as u8) | (1 << Self::Tell as u8);
}

/// The dongle's parts of the board.
#[derive(Debug)]
pub struct Parts<R, W, X, T, G, D, S> {
    /// The serial line, receiving half.
    pub from_host: R,
    /// The serial line, sending half.
    pub to_host: W,
    /// The radio, receiving half.
    pub receiver: X,
    /// The radio, sending half.
    pub sender: T,
    /// The radio's driver.
    pub gauge: G,
    /// The watchdog, armed.
    pub watchdog: D,
    /// The processor's reset.
    pub restart: S,
}

/// All its tasks in one.
pub async fn run(
    parts: Parts<
        impl Read,
        impl Write,
        impl Receiver,
        impl Sender + Encryption,
        impl Gauge,
        impl Watchdog,
        impl Restart,
    >,
    identity: Identity,
    shared: &Shared,
) -> ! {
    let Parts { from_host, to_host, receiver, sender, gauge, watchdog, restart } = parts;
    let (hear, send) = (hear(receiver, shared), send(sender, restart, shared));
    let (listen, tell) = (listen(from_host, shared), tell(to_host, gauge, identity, shared));
    join5(hear, send, listen, tell, guard(watchdog, shared)).await.0
}

/// Feeds the watchdog whenever every other task has come round.
async fn guard(mut watchdog: impl Watchdog, shared: &Shared) -> ! {
    loop {
        shared.alive.wait().await;
        // It has no bridge.
        watchdog.expect(WatchdogTimeout::Resting);
        watchdog.feed();
    }
}

/// Takes in radio messages. Waits for nothing but the radio.
async fn hear(mut receiver: impl Receiver, shared: &Shared) -> ! {
    loop {
        let received = shared.wait(Task::Hear, receiver.receive()).await;
        shared.add(|c| &mut c.received);
        shared.reception(received);
    }
}

/// Does with the radio what the host commands. Every send is awaited to its end, or to its limit: then the processor is reset.
async fn send(sender: impl Sender + Encryption, mut restart: impl Restart, shared: &Shared) -> ! {
    let mut sender = Bounded::new(sender);
    loop {
        match shared.wait(Task::Send, shared.jobs.receive()).await {
            Job::Send { number, to, payload } => {
                let Ok(sent) = shared.wait(Task::Send, sender.send(&to, &payload)).await else {
                    restart.restart(Reset::Radio);
                };
                let acknowledged = sent == Sent::Acknowledged;
                shared.add(|c| if acknowledged { &mut c.sent } else { &mut c.send_failed });
                if sent == Sent::Refused {
                    shared.add(|c| &mut c.send_refused);
                }
                shared.answer(Answer { number, acknowledged });
            }
            Job::Primary(key) => sender.radio().primary(&key),
            Job::Meet { address, local } => {
                if !sender.radio().meet(&address, &local) {
                    shared.add(|c| &mut c.not_met);
                }
            }
        }
    }
}

/// Reads what the host says. Waits for nothing but the host.
async fn listen(mut from_host: impl Read, shared: &Shared) -> ! {
    let mut deframer = Deframer::default();
    let mut bytes = [0; 64];
    loop {
        match shared.wait(Task::Listen, from_host.read(&mut bytes)).await {
            Ok(read @ 1..) => bytes.iter().take(read).for_each(|byte| take(&mut deframer, *byte, shared)),
            // Unplugged, or bytes are lost: what comes next does not belong to what came before.
            Ok(0) | Err(_) => {
                take(&mut deframer, 0, shared);
                Timer::after(READ_AGAIN).await;
            }
        }
    }
}

fn take(deframer: &mut Deframer, byte: u8, shared: &Shared) {
    match deframer.push(byte) {
        None => {}
        Some(Err(_)) => shared.add(|c| &mut c.bad_frames),
        Some(Ok(ToDongle::Send { number, to, payload })) => shared.order(Job::Send { number, to, payload }),
        Some(Ok(ToDongle::Primary(key))) => shared.order(Job::Primary(key)),
        Some(Ok(ToDongle::Meet { address, local })) => shared.order(Job::Meet { address, local }),
        Some(Ok(ToDongle::Hello)) => shared.hello.signal(()),
        Some(Ok(ToDongle::Count)) => shared.count.signal(()),
    }
}

/// Tells the host: what it asked for first, then what became of its messages, then what came in.
async fn tell(to_host: impl Write, gauge: impl Gauge, identity: Identity, shared: &Shared) -> ! {
    let mut line = Line { to_host, buffer: [0; _] };
    let hello = FromDongle::Hello { version: VERSION, address: identity.address, channel: identity.channel };
    let mut greeted = false;
    loop {
        if !greeted {
            match shared.wait(Task::Tell, line.write(&hello)).await {
                Ok(prompt) => greeted = prompt,
                Err(Broken) => Timer::after(RETRY).await,
            }
            continue;
        }
        let (asked, became, came) = (&shared.count, &shared.answers, &shared.receptions);
        let next = select4(shared.hello.wait(), asked.wait(), became.receive(), came.receive());
        let message = match shared.wait(Task::Tell, next).await {
            Either4::First(()) => hello.clone(),
            Either4::Second(()) => FromDongle::Counted(with(gauge.read(), shared.counters())),
            Either4::Third(Answer { number, acknowledged }) => FromDongle::Sent { number, acknowledged },
            Either4::Fourth(Received { from, rssi, payload }) => FromDongle::Received { from, rssi, payload },
        };
        greeted = match shared.wait(Task::Tell, line.write(&message)).await {
            Ok(prompt) => prompt,
            Err(Broken) => {
                match message {
                    FromDongle::Sent { .. } => shared.add(|c| &mut c.answers_dropped),
                    FromDongle::Received { .. } => shared.add(|c| &mut c.received_dropped),
                    FromDongle::Hello { .. } | FromDongle::Counted(_) => {}
                }
                false
            }
        };
    }
}

/// The counters with what the radio's driver counts.
fn with(readings: Readings, counters: Counters) -> Counters {
    let Readings { too_long, overrun, heap_least_free } = readings;
    Counters { too_long, overrun, heap_least_free, ..counters }
}

/// The line failed in the middle of a frame.
struct Broken;

struct Line<W> {
    to_host: W,
    buffer: [u8; LONGEST + 2],
}

impl<W: Write> Line<W> {
    /// Writes a frame; whether the host took it without delay. It begins with a zero, so that the rest of another that was
    /// cut off, here or in some buffer on the way, does not spoil it.
    async fn write(&mut self, message: &FromDongle) -> Result<bool, Broken> {
        let begun = Instant::now();
        let [zero, rest @ ..] = &mut self.buffer;
        *zero = 0;
        // Every message to the host is short enough.
        let length = encode(message, rest).map_or(0, |frame| 1 + frame.len());
        self.to_host.write_all(self.buffer.get(..length).unwrap_or_default()).await.map_err(|_| Broken)?;
        // The driver has the whole frame: if this fails, it is not for us to count as dropped.
        let flushed = self.to_host.flush().await;
        Ok(flushed.is_ok() && Instant::now().saturating_duration_since(begun) < STALL)
    }
}
