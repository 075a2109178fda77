//! Virtual time and the executor that runs in it.
//!
//! Every thread has a clock of its own, at 0 when a [`World`] is made, so that tests run side by side; a thread has one
//! world at a time. Nothing waits: when no task can go on, the clock jumps to the next alarm. The tasks of a processor are
//! polled in a fixed order, the first that was woken first, as by interrupt priority; a running task is never interrupted.
//! A run is therefore the same each time.
//!
//! ```
//! use testbed::time::World;
//!
//! let mut world = World::new();
//! let robot = world.processor();
//! world.spawn(robot, async { embassy_time::Timer::after_millis(5).await }); // highest priority
//! world.spawn(robot, async { testbed::time::pass(100) });
//! world.run_until(60_000_000);
//! ```
//!
//! Code that blocks (a converter, a flash) tells how long by [`pass`]: its processor does nothing else meanwhile, and what
//! comes due there is late, like on a chip. Other processors go on.

use std::cell::RefCell;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use embassy_time_driver::Driver;

/// Virtual clock of the thread.
struct Clock {
    /// µs; while a task runs, as late as it has got by blocking.
    now_us: u64,
    /// What the running task's processor adds to that.
    offset_us: i64,
    alarms: Vec<(u64, Waker)>,
    in_use: bool,
}

impl Clock {
    const NEW: Self = Self { now_us: 0, offset_us: 0, alarms: Vec::new(), in_use: false };

    /// One alarm a task: when it is polled, it asks again for those that are later.
    fn schedule(&mut self, at_us: u64, waker: &Waker) {
        match self.alarms.iter_mut().find(|(_, other)| other.will_wake(waker)) {
            Some((earliest_us, _)) => *earliest_us = at_us.min(*earliest_us),
            None => self.alarms.push((at_us, waker.clone())),
        }
    }

    fn fire(&mut self) {
        let now_us = self.now_us;
        self.alarms.retain(|(at_us, waker)| {
            let due = *at_us <= now_us;
            if due {
                waker.wake_by_ref();
            }
            !due
        });
    }

    fn next_alarm_us(&self) -> Option<u64> {
        self.alarms.iter().map(|(at_us, _)| *at_us).min()
    }
}

thread_local! {
    static CLOCK: RefCell<Clock> = const { RefCell::new(Clock::NEW) };
}

struct VirtualTime;

embassy_time_driver::time_driver_impl!(static DRIVER: VirtualTime = VirtualTime);

impl Driver for VirtualTime {
    fn now(&self) -> u64 {
        CLOCK.with_borrow(|clock| clock.now_us.saturating_add_signed(clock.offset_us))
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        CLOCK.with_borrow_mut(|clock| {
            let at_us = at.saturating_add_signed(clock.offset_us.saturating_neg());
            clock.schedule(at_us, waker);
        });
    }
}

/// The time of this thread's clock, µs: what is true, and not what a processor's clock says.
#[must_use]
pub fn now_us() -> u64 {
    CLOCK.with_borrow(|clock| clock.now_us)
}

/// Time passes while the running task blocks.
pub fn pass(us: u64) {
    CLOCK.with_borrow_mut(|clock| clock.now_us += us);
}

/// Outside of the tasks: what was done took no time.
pub(crate) fn turn_back(to_us: u64) {
    CLOCK.with_borrow_mut(|clock| clock.now_us = to_us);
}

/// Waits for a time of this thread's clock, µs.
pub async fn until(at_us: u64) {
    poll_fn(|context| {
        if now_us() >= at_us {
            return Poll::Ready(());
        }
        wake_at(at_us, context.waker());
        Poll::Pending
    })
    .await;
}

/// Wakes a task at a time of this thread's clock, µs.
pub(crate) fn wake_at(at_us: u64, waker: &Waker) {
    CLOCK.with_borrow_mut(|clock| clock.schedule(at_us, waker));
}

/// Remembers that its task was woken.
struct Flag(AtomicBool);

impl Wake for Flag {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

struct Task {
    processor: Processor,
    future: Pin<Box<dyn Future<Output = ()>>>,
    woken: Arc<Flag>,
}

/// One of a world's processors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Processor(usize);

#[derive(Clone, Copy, Default)]
struct State {
    /// Until then one of its tasks blocks, µs.
    busy_until_us: u64,
    /// What its clock is ahead of the world's, µs.
    offset_us: i64,
}

/// Processors and their tasks.
pub struct World {
    processors: Vec<State>,
    tasks: Vec<Task>,
}

/// Polls without time passing after which tasks are taken to wake each other for ever.
const MOST_POLLS_AT_ONCE: usize = 10_000;

impl Default for World {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for World {
    fn drop(&mut self) {
        self.tasks.clear();
        CLOCK.set(Clock::NEW);
    }
}

impl World {
    /// No tasks, and this thread's clock at 0.
    ///
    /// # Panics
    /// The thread has another one.
    #[must_use]
    pub fn new() -> Self {
        assert!(!CLOCK.with_borrow(|clock| clock.in_use), "one world a thread at a time: they would share its clock");
        CLOCK.set(Clock { in_use: true, ..Clock::NEW });
        Self { processors: Vec::new(), tasks: Vec::new() }
    }

    /// Adds a processor, its clock at 0 now.
    pub fn processor(&mut self) -> Processor {
        self.processors.push(State { busy_until_us: 0, offset_us: -signed(now_us()) });
        Processor(self.processors.len() - 1)
    }

    /// A processor starts anew: without tasks, its clock at 0.
    pub fn reset(&mut self, processor: Processor) {
        self.tasks.retain(|task| task.processor != processor);
        self.processors[processor.0] = State { busy_until_us: 0, offset_us: -signed(now_us()) };
    }

    /// A processor's clock leaps, µs.
    pub fn leap(&mut self, processor: Processor, by_us: i64) {
        self.processors[processor.0].offset_us += by_us;
        // Its alarms were set on the old clock: every task looks again.
        for task in self.tasks.iter().filter(|task| task.processor == processor) {
            task.woken.0.store(true, Ordering::Relaxed);
        }
    }

    /// Adds a task below those that its processor has.
    pub fn spawn(&mut self, processor: Processor, task: impl Future + 'static) {
        let future = Box::pin(async move {
            task.await;
        });
        self.tasks.push(Task { processor, future, woken: Arc::new(Flag(AtomicBool::new(true))) });
    }

    /// Runs until nothing is left to do before `end_us`; the clock then stands at `end_us`. What is due at `end_us` itself
    /// is still done. A processor may be blocked beyond.
    ///
    /// # Panics
    /// The tasks wake each other for ever.
    pub fn run_until(&mut self, end_us: u64) {
        let (mut polls, mut at_us) = (0, now_us());
        loop {
            CLOCK.with_borrow_mut(Clock::fire);
            if self.poll_first_woken() {
                polls = if now_us() == at_us { polls + 1 } else { 0 };
                at_us = now_us();
                assert!(polls < MOST_POLLS_AT_ONCE, "the tasks wake each other for ever at {at_us} us");
                continue;
            }
            let next_us = self.next_us().filter(|next_us| *next_us <= end_us);
            CLOCK.with_borrow_mut(|clock| clock.now_us = next_us.unwrap_or(end_us).max(clock.now_us));
            if next_us.is_none() {
                return;
            }
        }
    }

    /// When something is to be done again, µs.
    fn next_us(&self) -> Option<u64> {
        let blocked = self.tasks.iter().filter(|task| task.woken.0.load(Ordering::Relaxed));
        let free_us = blocked.map(|task| self.processors[task.processor.0].busy_until_us).min();
        let alarm_us = CLOCK.with_borrow(Clock::next_alarm_us);
        free_us.into_iter().chain(alarm_us).min()
    }

    /// Whether a task was there to be polled.
    fn poll_first_woken(&mut self) -> bool {
        let now_us = now_us();
        let free = |task: &Task| self.processors[task.processor.0].busy_until_us <= now_us;
        let Some(index) = self.tasks.iter().position(|task| free(task) && task.woken.0.swap(false, Ordering::Relaxed))
        else {
            return false;
        };
        let task = &mut self.tasks[index];
        let state = &mut self.processors[task.processor.0];
        CLOCK.with_borrow_mut(|clock| clock.offset_us = state.offset_us);
        let waker = Waker::from(task.woken.clone());
        let done = task.future.as_mut().poll(&mut Context::from_waker(&waker)).is_ready();
        state.busy_until_us = CLOCK.with_borrow_mut(|clock| {
            clock.offset_us = 0;
            std::mem::replace(&mut clock.now_us, now_us)
        });
        if done {
            self.tasks.remove(index);
        }
        true
    }
}

fn signed(us: u64) -> i64 {
    i64::try_from(us).unwrap_or(i64::MAX)
}
