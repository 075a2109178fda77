//! What the robot's tasks share: bounded queues, counters, who is spoken to. For a `static`.

use core::cell::RefCell;

use control::gait::GaitLabel;
use control::protocol::pairing::Pairing;
use control::protocol::radio::{Answer, Batch, Counters, Downlink, Echo, InjectedFault, Injection};
use control::protocol::secure::{Key, WELCOME};
use control::{Gait, Parameters, Refusal};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant};

use super::Shown;

/// Downlink that was accepted, with the time of its arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReceivedDownlink {
    pub downlink: Downlink,
    /// It is the first of a session.
    pub begins: bool,
    /// When it came, µs since boot.
    pub received_us: u64,
}

/// Answer to a [`RequestFrame`](control::protocol::radio::RequestFrame), with its number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Answered {
    pub number: u16,
    /// Control period in which it was done.
    pub tick: u32,
    pub answer: Answer,
}

/// Work for the flash. One at a time.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Work {
    /// Keep the parameters that [`Shared::save`] took.
    Save,
    /// Keep none: the factory's count.
    Factory,
    /// Keep this gait.
    KeepGait(Gait),
    /// Keep this pairing, or none.
    Pair(Option<Pairing>),
}

/// All that the radio holds (10) may come in at once.
const DOWNLINKS: usize = 12;
/// One answer for each downlink.
const ANSWERS: usize = DOWNLINKS;
/// 80 ms of telemetry: longer than the radio's usual delays of 10 to 50 ms.
const BATCHES: usize = 8;

type Queue<T, const N: usize> = Channel<CriticalSectionRawMutex, T, N>;

/// Queues and counters of the robot's tasks. Critical sections guard them, so that a task in an interrupt may use them.
pub struct Shared {
    pub(super) downlinks: Queue<ReceivedDownlink, DOWNLINKS>,
    pub(super) answers: Queue<Answered, ANSWERS>,
    pub(super) batches: Queue<Batch, BATCHES>,
    /// The answer to the console's latest call.
    pub(super) welcome: Signal<CriticalSectionRawMutex, [u8; WELCOME]>,
    /// The console speaks another version.
    pub(super) notice: Signal<CriticalSectionRawMutex, ()>,
    /// The key of a session that begins.
    pub(super) began: Signal<CriticalSectionRawMutex, Key>,
    /// Filled by [`Shared::hand_over`] alone.
    pub(super) work: Queue<Work, 1>,
    /// Whether the flash kept what the control loop commanded.
    pub(super) saved: Signal<CriticalSectionRawMutex, bool>,
    /// Whether it kept a pairing.
    pub(super) paired: Signal<CriticalSectionRawMutex, bool>,
    state: Mutex<CriticalSectionRawMutex, RefCell<State>>,
}

struct State {
    counters: Counters,
    /// Counter of the last downlink that counted, and when it came.
    heard: Option<(u32, Instant)>,
    shown: Shown,
    /// See [`Shared::take_lost_stop`].
    lost_stop: bool,
    /// The flash has work, from its being handed over until it is done; or the processor is about to be reset.
    working: bool,
    /// What [`Work::Save`] is about.
    set: Option<Parameters>,
    /// What the controller can play.
    gait: Option<GaitLabel>,
    injection: Injecting,
}

/// State of the fault injection.
#[derive(Clone, Copy, Debug)]
enum Injecting {
    /// This image makes none.
    NotBuiltIn,
    /// Nothing was asked for.
    Nothing,
    /// From one time to another.
    Ordered { fault: InjectedFault, from: Instant, until: Instant },
}

/// Silence after which the console has gone and no telemetry is sent.
const GONE: Duration = Duration::from_secs(2);

/// What a tick adds to the counters.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TickCounts {
    /// Periods since the last tick that had none.
    pub missed: u32,
    /// Since the last tick's beginning, µs; `None` for the first.
    pub period_us: Option<u32>,
    pub outliers: u32,
    pub execution_us: u32,
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
        Self::with_injection(Injecting::NotBuiltIn)
    }

    /// The same for an image that makes faults on request: the board's parts are those of [`crate::inject`].
    #[must_use]
    pub const fn injectable() -> Self {
        Self::with_injection(Injecting::Nothing)
    }

    const fn with_injection(injection: Injecting) -> Self {
        let counters = Counters {
            ticks: 0,
            missed_deadlines: 0,
            longest_period_us: 0,
            shortest_period_us: 0,
            longest_tick_us: 0,
            adc_outliers: 0,
            received: 0,
            outdated: 0,
            forged: 0,
            misunderstood: 0,
            other_version: 0,
            calls: 0,
            lost: 0,
            too_late: 0,
            commands_dropped: 0,
            answers_dropped: 0,
            sent: 0,
            send_failed: 0,
            rows_dropped: 0,
            send_refused: 0,
            too_long: 0,
            overrun: 0,
            heap_least_free: 0,
        };
        Self {
            downlinks: Channel::new(),
            answers: Channel::new(),
            batches: Channel::new(),
            welcome: Signal::new(),
            notice: Signal::new(),
            began: Signal::new(),
            work: Channel::new(),
            saved: Signal::new(),
            paired: Signal::new(),
            state: Mutex::new(RefCell::new(State {
                counters,
                heard: None,
                shown: Shown::NotStarted,
                lost_stop: false,
                working: false,
                set: None,
                gait: None,
                injection,
            })),
        }
    }

    /// The counters as they are.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.with(|state| state.counters)
    }

    /// Whether a console has spoken lately.
    #[must_use]
    pub fn is_listened_to(&self) -> bool {
        self.with(|state| state.heard.is_some_and(|(_, at)| since(at) < GONE))
    }

    /// The last downlink that counted.
    pub(super) fn echo(&self) -> Echo {
        self.with(|state| {
            state.heard.map_or(Echo::default(), |(counter, at)| Echo {
                counter,
                age_ms: u16::try_from(since(at).as_millis()).unwrap_or(u16::MAX),
            })
        })
    }

    pub(super) fn heard(&self, counter: u32, at: Instant) {
        self.with(|state| state.heard = Some((counter, at)));
    }

    /// What the LED shows.
    #[must_use]
    pub fn shown(&self) -> Shown {
        self.with(|state| state.shown)
    }

    pub(super) fn show(&self, shown: Shown) {
        self.with(|state| state.shown = shown);
    }

    /// Hands work to the flash. The chip stands still while a page is erased: not while the motor is driven, nor before the
    /// work at hand is done. From now on nothing new is obeyed until [`Shared::finish`], so that nobody begins to drive.
    ///
    /// A tick with everything that it does is one piece to the tasks below it. So to them what is shown is how things are.
    pub(super) fn hand_over(&self, work: Work) -> Result<(), Refusal> {
        self.with(|state| self.queue(state, work))
    }

    /// The same with parameters. By reference, for the control loop's stack is that of whatever it interrupts: no copy of a
    /// set goes over it.
    pub(super) fn save(&self, set: &Parameters) -> Result<(), Refusal> {
        self.with(|state| {
            self.queue(state, Work::Save)?;
            state.set = Some(*set);
            Ok(())
        })
    }

    fn queue(&self, state: &mut State, work: Work) -> Result<(), Refusal> {
        match state.shown {
            Shown::State(now, _) if now.is_driving() => Err(Refusal::Driving),
            _ if state.working => Err(Refusal::Saving),
            _ => {
                state.working = true;
                // There is room: the work before is done.
                self.work.try_send(work).map_err(|_| Refusal::Saving)
            }
        }
    }

    /// Whether the processor may be reset now: the motor is not driven, and the flash has nothing to do. If so, nothing new is obeyed
    /// from now on.
    pub(super) fn stand_down(&self) -> bool {
        self.with(|state| {
            let busy = state.working || matches!(state.shown, Shown::State(now, _) if now.is_driving());
            state.working |= !busy;
            !busy
        })
    }

    /// The parameters that are to be kept.
    pub(super) fn set(&self) -> Option<Parameters> {
        self.with(|state| state.set)
    }

    /// The gait that the controller has.
    pub(super) fn gait(&self) -> Option<GaitLabel> {
        self.with(|state| state.gait)
    }

    pub(super) fn show_gait(&self, gait: Option<GaitLabel>) {
        self.with(|state| state.gait = gait);
    }

    /// Whether faults are made on request.
    #[must_use]
    pub fn is_injectable(&self) -> bool {
        self.with(|state| !matches!(state.injection, Injecting::NotBuiltIn))
    }

    /// Takes the request for a fault.
    pub(super) fn inject(&self, injection: Injection) -> Result<(), Refusal> {
        let from = Instant::now() + Duration::from_millis(Injection::DELAY_MS.into());
        let until = from + Duration::from_millis(injection.for_ms.into());
        self.with(|state| match &mut state.injection {
            Injecting::NotBuiltIn => Err(Refusal::NotBuiltIn),
            ordered => {
                *ordered = Injecting::Ordered { fault: injection.fault, from, until };
                Ok(())
            }
        })
    }

    /// The fault to be made now, and until when.
    pub(crate) fn injected(&self) -> Option<(InjectedFault, Instant)> {
        let now = Instant::now();
        self.with(|state| match state.injection {
            Injecting::Ordered { fault, from, until } if (from..until).contains(&now) => Some((fault, until)),
            _ => None,
        })
        .filter(|(fault, _)| *fault != InjectedFault::None)
    }

    /// Whether the flash is at work.
    pub(super) fn is_working(&self) -> bool {
        self.with(|state| state.working)
    }

    /// The work that was handed over is done.
    pub(super) fn finish(&self) {
        self.with(|state| state.working = false);
    }

    pub(super) fn count(&self, count: impl FnOnce(&mut Counters)) {
        self.with(|state| count(&mut state.counters));
    }

    /// The counters; those that are "since the last status" begin anew.
    pub(super) fn take_counters(&self) -> Counters {
        self.with(|state| {
            let taken = state.counters;
            state.counters.longest_period_us = 0;
            state.counters.shortest_period_us = 0;
            state.counters.longest_tick_us = 0;
            taken
        })
    }

    pub(super) fn count_tick(&self, tick: &TickCounts) {
        self.count(|c| {
            c.ticks = c.ticks.wrapping_add(1);
            c.missed_deadlines = c.missed_deadlines.wrapping_add(tick.missed);
            c.adc_outliers = c.adc_outliers.wrapping_add(tick.outliers);
            c.longest_tick_us = c.longest_tick_us.max(tick.execution_us);
            if let Some(period_us) = tick.period_us {
                let first = c.longest_period_us == 0;
                c.shortest_period_us = if first { period_us } else { c.shortest_period_us.min(period_us) };
                c.longest_period_us = c.longest_period_us.max(period_us);
            }
        });
    }

    /// Queues a downlink; the oldest goes where there is no room, because what was said last counts. That the motor shall
    /// stop is kept nevertheless: see [`Shared::take_lost_stop`].
    pub(super) fn downlink(&self, downlink: ReceivedDownlink) {
        while self.downlinks.try_send(downlink).is_err() {
            if let Ok(dropped) = self.downlinks.try_receive() {
                self.with(|state| {
                    state.lost_stop |= dropped.begins || dropped.downlink == Downlink::Stop;
                    state.counters.commands_dropped = state.counters.commands_dropped.wrapping_add(1);
                });
            }
        }
    }

    /// Whether a downlink that stops the motor was dropped: a stop, or the first of a session.
    pub(super) fn take_lost_stop(&self) -> bool {
        self.with(|state| core::mem::take(&mut state.lost_stop))
    }

    /// Queues an answer; whether there was room.
    pub(super) fn answer(&self, answer: Answered) -> bool {
        let queued = self.answers.try_send(answer).is_ok();
        if !queued {
            self.count(|c| c.answers_dropped = c.answers_dropped.wrapping_add(1));
        }
        queued
    }

    fn with<R>(&self, work: impl FnOnce(&mut State) -> R) -> R {
        self.state.lock(|state| work(&mut state.borrow_mut()))
    }
}

/// How long ago; 0 where the clock has gone back, at which [`Instant::elapsed`] would panic.
fn since(at: Instant) -> Duration {
    Instant::now().saturating_duration_since(at)
}
