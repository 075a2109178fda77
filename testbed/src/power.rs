//! A processor that runs, stands still, falls, or starts again.

use std::cell::{Cell, RefCell};
use std::future::{Future, poll_fn};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::pin::Pin;
use std::rc::Rc;
use std::task::Poll;

use control::protocol::radio::Reset;
use shell::board::Restart;

use crate::time::now_us;

/// How a task ends that restarts its processor: [`Restart::restart`] returns to nobody.
struct Reboot;

struct State {
    running: Cell<bool>,
    /// What a task asked for, and when, µs.
    reset: Cell<Option<(u64, Reset)>>,
    /// Opens the bridge.
    fallen: RefCell<Box<dyn FnMut()>>,
}

/// The supply and the reset line of a processor. Clones are the same one.
#[derive(Clone)]
pub struct Power(Rc<State>);

impl Power {
    /// Off. `fallen` is called whenever the processor falls.
    pub fn new(fallen: impl FnMut() + 'static) -> Self {
        let fallen = RefCell::new(Box::new(fallen) as Box<dyn FnMut()>);
        Self(Rc::new(State { running: Cell::new(false), reset: Cell::new(None), fallen }))
    }

    /// Whether its tasks run.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.0.running.get()
    }

    /// Nothing runs any more.
    pub fn fall(&self) {
        if self.0.running.replace(false) {
            (self.0.fallen.borrow_mut())();
        }
    }

    /// From a task of this processor: nothing of it runs any more, until somebody asks [`Power::wanted`] and boots it.
    pub fn reset(&self, reset: Reset) -> ! {
        self.0.reset.set(Some((now_us(), reset)));
        self.fall();
        // No panic: the hook that prints one is not called.
        resume_unwind(Box::new(Reboot))
    }

    /// The reset that a task asked for, once. A task that blocked before that was ahead of the clock.
    #[must_use]
    pub fn wanted(&self) -> Option<Reset> {
        let (_, reset) = self.0.reset.get().filter(|(at_us, _)| *at_us <= now_us())?;
        self.0.reset.set(None);
        Some(reset)
    }

    /// Lets its tasks run.
    pub fn rise(&self) {
        self.0.reset.set(None);
        self.0.running.set(true);
    }

    /// Runs a task as long as the processor does.
    pub fn run(&self, task: impl Future + 'static) -> impl Future + 'static {
        let power = self.clone();
        let mut task: Pin<Box<dyn Future<Output = ()>>> = Box::pin(async move {
            task.await;
        });
        poll_fn(move |context| {
            if !power.is_running() {
                return Poll::Pending;
            }
            match catch_unwind(AssertUnwindSafe(|| task.as_mut().poll(context))) {
                Ok(polled) => polled,
                Err(payload) if payload.is::<Reboot>() => {
                    // Its parts are dropped here, as those of the other tasks are when the processor boots.
                    task = Box::pin(std::future::pending());
                    Poll::Pending
                }
                Err(payload) => resume_unwind(payload),
            }
        })
    }
}

impl Restart for Power {
    fn restart(&mut self, why: Reset) -> ! {
        self.reset(why)
    }
}
