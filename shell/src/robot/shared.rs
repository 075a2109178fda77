//! What the robot's tasks share: bounded queues, counters, who is spoken to. For a `static`.

use core::cell::RefCell;

use control::protocol::radio::{Batch, Counters};
use control::{Command, Refusal};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;

use super::Shown;
use crate::board::Address;

/// A command that came in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Order {
    pub from: Address,
    pub sequence: u16,
    pub command: Command,
    /// When, µs since boot.
    pub received_us: u64,
}

/// What became of an order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Answered {
    pub to: Address,
    pub sequence: u16,
    pub outcome: Result<(), Refusal>,
}

/// All that the radio holds (10) may come in at once.
const ORDERS: usize = 12;
/// One for each order.
const ANSWERS: usize = ORDERS;
/// 80 ms of telemetry: longer than the radio's usual delays of 10 to 50 ms.
const BATCHES: usize = 8;

type Queue<T, const N: usize> = Channel<CriticalSectionRawMutex, T, N>;

/// Queues and counters of the robot's tasks. Critical sections guard them, so that a task in an interrupt may use them.
pub struct Shared {
    pub(super) orders: Queue<Order, ORDERS>,
    pub(super) answers: Queue<Answered, ANSWERS>,
    pub(super) batches: Queue<Batch, BATCHES>,
    state: Mutex<CriticalSectionRawMutex, RefCell<State>>,
}

struct State {
    counters: Counters,
    peer: Option<Address>,
    shown: Shown,
}

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
        let counters = Counters {
            ticks: 0,
            missed_deadlines: 0,
            longest_period_us: 0,
            shortest_period_us: 0,
            longest_tick_us: 0,
            adc_outliers: 0,
            received: 0,
            outdated: 0,
            misunderstood: 0,
            other_version: 0,
            lost: 0,
            commands_dropped: 0,
            answers_dropped: 0,
            sent: 0,
            send_failed: 0,
            rows_dropped: 0,
        };
        Self {
            orders: Channel::new(),
            answers: Channel::new(),
            batches: Channel::new(),
            state: Mutex::new(RefCell::new(State { counters, peer: None, shown: Shown::NotStarted })),
        }
    }

    /// The counters as they are.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.with(|state| state.counters)
    }

    /// Who last gave a command that could be read.
    #[must_use]
    pub fn peer(&self) -> Option<Address> {
        self.with(|state| state.peer)
    }

    /// What the LED shows.
    #[must_use]
    pub fn shown(&self) -> Shown {
        self.with(|state| state.shown)
    }

    pub(super) fn show(&self, shown: Shown) {
        self.with(|state| state.shown = shown);
    }

    pub(super) fn set_peer(&self, peer: Address) {
        self.with(|state| state.peer = Some(peer));
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

    /// Queues an order; the oldest goes where there is no room, because what was said last counts.
    pub(super) fn order(&self, order: Order) {
        while self.orders.try_send(order).is_err() {
            if self.orders.try_receive().is_ok() {
                self.count(|c| c.commands_dropped = c.commands_dropped.wrapping_add(1));
            }
        }
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
