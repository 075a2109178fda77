//! Wakes the control loop above the radio.
//!
//! esp-rtos keeps the time of all async tasks in an interrupt of the lowest priority, which is the radio's, too: while the
//! radio's interrupt runs, that one waits, and so would the control loop. Here a second hardware timer of the same period
//! wakes the loop's task at the loop's own priority, [`LAG`] behind its grid. Whichever comes first wakes it; a task that is
//! woken early or twice looks at the time and waits on.

use core::cell::RefCell;
use core::future::poll_fn;
use core::pin::pin;

use critical_section::Mutex;
use embassy_sync::waitqueue::AtomicWaker;
use esp_hal::interrupt::{InterruptHandler, Priority};
use esp_hal::peripherals::TIMG1;
use esp_hal::time::{Duration, Instant};
use esp_hal::timer::PeriodicTimer;
use esp_hal::timer::timg::TimerGroup;
use esp_hal::{Blocking, ram};

/// Of the control loop and of what wakes it. The radio has the lowest, 1.
pub const PRIORITY: Priority = Priority::Priority3;
/// Behind the loop's grid: by what the loop needs to set the grid up, and a little more, so that a tick that the ordinary
/// timer wakes in time is not woken for nothing.
const LAG: Duration = Duration::from_micros(20);

struct Second {
    timer: PeriodicTimer<'static, Blocking>,
    period: Duration,
    /// The period that runs is the shorter first one.
    first: bool,
}

static SECOND: Mutex<RefCell<Option<Second>>> = Mutex::new(RefCell::new(None));
static LOOP: AtomicWaker = AtomicWaker::new();

/// Runs the control loop, which begins its grid at once, and wakes it once in every period.
pub async fn above_the_radio<T>(timer: TIMG1<'static>, period: Duration, work: impl Future<Output = T>) -> T {
    let mut work = pin!(work);
    let mut timer = Some(timer);
    let begun = Instant::now();
    poll_fn(|context| {
        LOOP.register(context.waker());
        let poll = work.as_mut().poll(context);
        if let Some(timer) = timer.take() {
            start(timer, period, begun.elapsed());
        }
        poll
    })
    .await
}

/// `since` the beginning of the grid.
fn start(timer: TIMG1<'static>, period: Duration, since: Duration) {
    let mut timer = PeriodicTimer::new(TimerGroup::new(timer).timer0);
    timer.set_interrupt_handler(InterruptHandler::new(wake, PRIORITY));
    timer.listen();
    let into_period = Duration::from_micros(since.as_micros() % period.as_micros());
    // A timer that refuses leaves the loop with the ordinary one.
    let started = timer.start(period - into_period + LAG).is_ok();
    let second = started.then_some(Second { timer, period, first: true });
    critical_section::with(|cs| SECOND.replace(cs, second));
}

#[ram]
extern "C" fn wake() {
    critical_section::with(|cs| {
        if let Some(second) = SECOND.borrow_ref_mut(cs).as_mut() {
            second.timer.clear_interrupt();
            if second.first {
                second.first = false;
                // It started with another period a moment ago, and does so with this one.
                let _ = second.timer.start(second.period);
            }
        }
    });
    LOOP.wake();
}
