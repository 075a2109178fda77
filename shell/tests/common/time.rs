//! Virtual time and the executor that runs in it.
//!
//! Every thread has a clock of its own, at 0 when a [`World`] is made, so that tests run side by side. Nothing waits: when
//! no task can go on, the clock jumps to the next alarm. The tasks of a world are polled in a fixed order, the first that
//! was woken first, as by interrupt priority; a running task is never interrupted. A run is therefore the same each time.
//!
//! ```ignore
//! let mut world = World::new();
//! world.spawn(control_loop(...)); // highest priority
//! world.spawn(receive(...));
//! world.run_until(60_000_000);
//! ```
//!
//! Code that blocks (a converter, a flash) tells how long by [`pass`]: alarms that come due meanwhile are late, like
//! on a chip.

use std::cell::RefCell;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use embassy_time_driver::Driver;
use embassy_time_queue_utils::queue_generic::Queue;

struct Clock {
    now_us: u64,
    alarms: Queue,
}

thread_local! {
    static CLOCK: RefCell<Clock> = const { RefCell::new(Clock { now_us: 0, alarms: Queue::new() }) };
}

struct VirtualTime;

embassy_time_driver::time_driver_impl!(static DRIVER: VirtualTime = VirtualTime);

impl Driver for VirtualTime {
    fn now(&self) -> u64 {
        now_us()
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        CLOCK.with_borrow_mut(|clock| {
            clock.alarms.schedule_wake(at, waker);
            clock.alarms.next_expiration(clock.now_us);
        });
    }
}

/// The time of this thread's clock, µs.
pub fn now_us() -> u64 {
    CLOCK.with_borrow(|clock| clock.now_us)
}

/// Time passes while the running task blocks.
pub fn pass(us: u64) {
    CLOCK.with_borrow_mut(|clock| {
        clock.now_us += us;
        clock.alarms.next_expiration(clock.now_us);
    });
}

/// Remembers that its task was woken.
struct Flag(AtomicBool);

impl Wake for Flag {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

struct Task<'a> {
    future: Pin<Box<dyn Future<Output = ()> + 'a>>,
    woken: Arc<Flag>,
    done: bool,
}

/// The tasks of a test; dropped with it, in the order of their spawning.
pub struct World<'a> {
    tasks: Vec<Task<'a>>,
}

/// Polls without time passing after which tasks are taken to wake each other for ever.
const MOST_POLLS_AT_ONCE: usize = 10_000;

impl<'a> World<'a> {
    /// No tasks, and this thread's clock at 0.
    pub fn new() -> Self {
        CLOCK.set(Clock { now_us: 0, alarms: Queue::new() });
        Self { tasks: Vec::new() }
    }

    /// Adds a task below those before it.
    pub fn spawn(&mut self, task: impl Future + 'a) {
        let future = Box::pin(async move {
            task.await;
        });
        self.tasks.push(Task { future, woken: Arc::new(Flag(AtomicBool::new(true))), done: false });
    }

    /// Runs until nothing is left to do before `end_us`; the clock then stands at `end_us`, or later where a task
    /// blocked beyond it. What is due at `end_us` itself is still done.
    pub fn run_until(&mut self, end_us: u64) {
        let (mut polls, mut at_us) = (0, now_us());
        loop {
            if now_us() > end_us {
                return;
            }
            if self.poll_first_woken() {
                polls = if now_us() == at_us { polls + 1 } else { 0 };
                at_us = now_us();
                assert!(polls < MOST_POLLS_AT_ONCE, "the tasks wake each other for ever at {at_us} us");
                continue;
            }
            let next = CLOCK.with_borrow_mut(|clock| {
                let next = clock.alarms.next_expiration(clock.now_us);
                clock.now_us = next.min(end_us).max(clock.now_us);
                clock.alarms.next_expiration(clock.now_us);
                next
            });
            if next > end_us {
                return;
            }
        }
    }

    /// Whether a task was there to be polled.
    fn poll_first_woken(&mut self) -> bool {
        for task in &mut self.tasks {
            if !task.done && task.woken.0.swap(false, Ordering::Relaxed) {
                let waker = Waker::from(task.woken.clone());
                task.done = task.future.as_mut().poll(&mut Context::from_waker(&waker)) == Poll::Ready(());
                return true;
            }
        }
        false
    }
}
