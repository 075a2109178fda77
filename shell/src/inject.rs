//! Faults on request, for bring-up: what a person cannot do to a board by hand.
//!
//! An image with fault injection puts [`Converter`] and [`Sender`] around the board's own and starts with
//! [`Shared::injectable`]. What they do is asked for over the signed link ([`Request::Inject`]), like everything else; an ordinary
//! image has none of this and refuses.
//!
//! [`Request::Inject`]: control::protocol::radio::Request::Inject

use control::AdcCode;
use control::protocol::radio::{Crash, CrashPlace, InjectedFault};
use embassy_time::{Instant, Timer};

use crate::board::{self, Address, Sent};
use crate::robot::Shared;

/// What a board does to itself on request.
pub trait FaultInjector {
    /// A fault begins: a sign that an oscilloscope can be triggered on.
    fn mark(&mut self);
    /// Keeps the processor busy for `for_us`, µs.
    fn block(&mut self, for_us: u64);
    /// The program crashes.
    fn crash(&mut self, how: Crash) -> !;
}

/// Marks the beginning of a fault once.
struct Trigger {
    current: Option<(InjectedFault, Instant)>,
}

impl Trigger {
    /// Whether it has just begun.
    fn begins(&mut self, fault: Option<(InjectedFault, Instant)>) -> bool {
        core::mem::replace(&mut self.current, fault) != fault && fault.is_some()
    }
}

/// A converter that can be made to fail, and with it the control loop that waits for it.
pub struct Converter<'s, C, S> {
    inner: C,
    injector: S,
    shared: &'s Shared,
    trigger: Trigger,
    /// Ticks since the fault began.
    ticks: u32,
    /// The code that it is stuck at.
    stuck: Option<AdcCode>,
}

impl<'s, C: board::Converter, S: FaultInjector> Converter<'s, C, S> {
    /// Does what `inner` does until `shared` is asked for a fault.
    pub fn new(inner: C, injector: S, shared: &'s Shared) -> Self {
        Self { inner, injector, shared, trigger: Trigger { current: None }, ticks: 0, stuck: None }
    }

    /// Which fault there is; its beginning is marked.
    fn fault(&mut self) -> InjectedFault {
        let fault = self.shared.injected().filter(|(fault, _)| in_loop(*fault));
        if self.trigger.begins(fault) {
            (self.ticks, self.stuck) = (0, None);
            self.injector.mark();
        }
        fault.map_or(InjectedFault::None, |(fault, _)| fault)
    }

    /// What happens once a tick.
    fn hang_or_crash(&mut self) {
        match self.fault() {
            InjectedFault::Crash { how, .. } => self.injector.crash(how),
            InjectedFault::HangLoop => {
                let until = self.trigger.current.map(|(_, until)| until);
                let left = until.map(|until| until.saturating_duration_since(Instant::now()));
                self.injector.block(left.map_or(0, |left| left.as_micros()));
            }
            InjectedFault::StarveLoop { hang_ms, run_ticks } if in_turn(self.ticks, run_ticks, 1) => {
                self.injector.block(u64::from(hang_ms) * 1000);
            }
            _ => {}
        }
        self.ticks = self.ticks.wrapping_add(1);
    }
}

impl<C: board::Converter, S: FaultInjector> board::Converter for Converter<'_, C, S> {
    fn angle(&mut self) -> AdcCode {
        let code = self.inner.angle();
        match self.fault() {
            InjectedFault::ConverterStuck => *self.stuck.get_or_insert(code),
            InjectedFault::ConverterSlow { by_us } => {
                self.injector.block(by_us.into());
                code
            }
            InjectedFault::ConverterIntermittent { good_ticks, bad_ticks }
                if in_turn(self.ticks, good_ticks, bad_ticks) =>
            {
                AdcCode(0)
            }
            _ => code,
        }
    }

    fn battery(&mut self) -> AdcCode {
        self.hang_or_crash();
        self.inner.battery()
    }
}

/// Whether it is the second one's turn: `first` ticks, `second` ticks, and so on.
fn in_turn(ticks: u32, first: u16, second: u16) -> bool {
    let (first, second) = (u32::from(first), u32::from(second));
    // Both zero: never.
    ticks.checked_rem(first + second).is_some_and(|phase| phase >= first)
}

fn in_loop(fault: InjectedFault) -> bool {
    match fault {
        InjectedFault::Crash { place, .. } => place == CrashPlace::Loop,
        InjectedFault::HangLoop
        | InjectedFault::StarveLoop { .. }
        | InjectedFault::ConverterStuck
        | InjectedFault::ConverterSlow { .. }
        | InjectedFault::ConverterIntermittent { .. } => true,
        InjectedFault::None | InjectedFault::SendsFail | InjectedFault::SendsNeverEnd | InjectedFault::SendsRefused => {
            false
        }
    }
}

/// The radio's sending half, which can be made to fail.
pub struct Sender<'s, T, S> {
    inner: T,
    injector: S,
    shared: &'s Shared,
    trigger: Trigger,
}

impl<'s, T: board::Sender, S: FaultInjector> Sender<'s, T, S> {
    /// Does what `inner` does until `shared` is asked for a fault.
    pub fn new(inner: T, injector: S, shared: &'s Shared) -> Self {
        Self { inner, injector, shared, trigger: Trigger { current: None } }
    }
}

impl<T: board::Sender, S: FaultInjector> board::Sender for Sender<'_, T, S> {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> Sent {
        let fault = self.shared.injected().filter(|(fault, _)| !in_loop(*fault));
        if self.trigger.begins(fault) {
            self.injector.mark();
        }
        match fault {
            Some((InjectedFault::Crash { how, .. }, _)) => self.injector.crash(how),
            Some((InjectedFault::SendsFail, _)) => Sent::Unheard,
            Some((InjectedFault::SendsRefused, _)) => Sent::Refused,
            Some((InjectedFault::SendsNeverEnd, until)) => {
                Timer::at(until).await;
                Sent::Unheard
            }
            _ => self.inner.send(to, payload).await,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_taken() {
        let drawn = |first, second| {
            (0..10).map(|tick| if in_turn(tick, first, second) { '#' } else { '.' }).collect::<std::string::String>()
        };
        assert_eq!(drawn(3, 2), "...##...##");
        assert_eq!(drawn(1, 1), ".#.#.#.#.#");
        assert_eq!(drawn(0, 1), "##########");
        assert_eq!(drawn(1, 0), "..........");
        assert_eq!(drawn(0, 0), "..........");
    }
}
