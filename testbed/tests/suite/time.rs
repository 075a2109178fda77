//! Virtual time: what blocks, what does not, and what a processor's clock says.

use std::cell::RefCell;
use std::rc::Rc;

use embassy_time::{Duration, Instant, Ticker, Timer};
use testbed::time::{World, now_us, pass, until};

type Log = Rc<RefCell<Vec<(u64, &'static str)>>>;

fn note(log: &Log, what: &'static str) {
    log.borrow_mut().push((now_us(), what));
}

#[test]
fn who_blocks_holds_up_its_own_processor_and_no_other() {
    let log = Log::default();
    let mut world = World::new();
    let (one, other) = (world.processor(), world.processor());
    let (a, b, c) = (log.clone(), log.clone(), log.clone());
    world.spawn(one, async move {
        pass(500);
        note(&a, "a");
    });
    world.spawn(one, async move {
        Timer::after_micros(100).await;
        note(&b, "b");
    });
    world.spawn(other, async move {
        until(300).await;
        note(&c, "c");
    });
    world.run_until(1000);
    // The timer of the second task was only set when the first let it run.
    assert_eq!(*log.borrow(), [(500, "a"), (300, "c"), (600, "b")]);
    assert_eq!(now_us(), 1000);
}

#[test]
fn a_processor_s_clock_begins_at_its_reset_and_may_leap() {
    let mut world = World::new();
    let processor = world.processor();
    world.run_until(5_000);
    world.reset(processor);
    let seen = Rc::new(RefCell::new(Vec::new()));
    let clock = Rc::clone(&seen);
    world.spawn(processor, async move {
        let mut ticker = Ticker::every(Duration::from_millis(1));
        loop {
            ticker.next().await;
            clock.borrow_mut().push((now_us(), Instant::now().as_micros()));
        }
    });
    world.run_until(7_500);
    assert_eq!(*seen.borrow(), [(6_000, 1_000), (7_000, 2_000)]);
    world.leap(processor, 10_000);
    world.run_until(8_000);
    // The ticks in between are due at once.
    assert_eq!(seen.borrow()[2], (7_500, 12_500));
}

#[test]
#[should_panic(expected = "wake each other for ever at 0 us")]
fn tasks_that_wake_each_other_for_ever_are_found() {
    let mut world = World::new();
    let processor = world.processor();
    world.spawn(
        processor,
        std::future::poll_fn(|context| {
            context.waker().wake_by_ref();
            std::task::Poll::<()>::Pending
        }),
    );
    world.run_until(1);
}

#[test]
#[should_panic(expected = "one world a thread at a time")]
fn two_worlds_would_share_a_clock() {
    let _one = World::new();
    let _other = World::new();
}
