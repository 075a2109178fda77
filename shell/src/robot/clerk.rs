//! What orders do to the controller, and what is answered: once each, in time, and only what may be done now.

use control::parameters::table;
use control::protocol::radio::{Answer, Do, ToRobot, Value, What};
use control::{Command, Controller, Parameters, Refusal, Unready};
use embassy_time::Instant;

use super::Shared;
use super::shared::{Answered, Order, Work};

/// Longer than any limit on the age of a command: older heartbeats would change nothing, and count as too late.
const OLDEST_HEARTBEAT_MS: u32 = 10_000;

/// Serves the orders of one console.
#[derive(Default)]
pub(super) struct Clerk {
    /// The latest order that is answered, by its number, the control period in which it was done, and its answer: `None` while
    /// the flash works on it.
    last: Option<(u16, u32, Option<Answer>)>,
    /// Number of the control period.
    period: u32,
    /// The flash shall go back to the factory's set; so does the controller, once that is done.
    to_factory: bool,
}

impl Clerk {
    /// Serves everything that has come since the last tick, before the decision of a control period.
    pub fn serve(&mut self, period: u32, controller: &mut Controller, factory: &Parameters, shared: &Shared) {
        self.period = period;
        self.finish_saving(controller, factory, shared);
        if shared.take_lost_stop() {
            // It was older than all that is in the queue.
            let _ = controller.command(Command::Idle, Instant::now().as_micros());
        }
        while let Ok(order) = shared.orders.try_receive() {
            self.obey(&order, controller, factory, shared);
        }
    }

    fn obey(&mut self, order: &Order, controller: &mut Controller, factory: &Parameters, shared: &Shared) {
        if order.begins {
            // Whoever drove before has gone, and the new one has not said anything yet.
            let _ = controller.command(Command::Idle, order.received_us);
            // Another console may give the same numbers: what was answered to the one before is not for this one.
            while shared.answers.try_receive().is_ok() {}
            self.last = None;
        }
        match order.order {
            ToRobot::Heartbeat { heard_ms } => beat(heard_ms, controller, shared),
            // Refused only in `Fault`, where the bridge is off.
            ToRobot::Stop => drop(controller.command(Command::Idle, order.received_us)),
            ToRobot::Do(wanted) => self.answer(&wanted, order.received_us, controller, factory, shared),
        }
    }

    /// Answers an order that may have been answered before: it is repeated until the console has heard.
    fn answer(
        &mut self,
        wanted: &Do,
        received_us: u64,
        controller: &mut Controller,
        factory: &Parameters,
        shared: &Shared,
    ) {
        let mut tick = self.period;
        let answer = match self.last {
            Some((number, done_in, answer)) if number == wanted.number => {
                tick = done_in;
                answer
            }
            _ if is_past(wanted.deadline_ms) => {
                shared.count(|c| c.too_late = c.too_late.wrapping_add(1));
                Some(Answer::TooLate)
            }
            _ if shared.is_working() => Some(Answer::Refused(Refusal::Saving)),
            _ => {
                self.to_factory = wanted.what == What::Factory;
                let answer = execute(wanted.what, received_us, controller, factory, shared);
                if answer == Some(Answer::Refused(Refusal::NotReady(Unready::Checking))) {
                    // In a moment the robot knows, and the order comes again: it is repeated until it is answered.
                    return;
                }
                self.last = Some((wanted.number, tick, answer));
                answer
            }
        };
        if let Some(answer) = answer {
            shared.answer(Answered { number: wanted.number, tick, answer });
        }
    }

    fn finish_saving(&mut self, controller: &mut Controller, factory: &Parameters, shared: &Shared) {
        let Some(kept) = shared.saved.try_take() else { return };
        if kept && core::mem::take(&mut self.to_factory) {
            // The factory's set was checked before the controller was made.
            let _ = controller.retune(factory, factory);
        }
        if let Some((number, tick, answer @ None)) = &mut self.last {
            *tick = self.period;
            let done = if kept { Answer::Done(None) } else { Answer::Refused(Refusal::NotKept) };
            *answer = Some(done);
            shared.answer(Answered { number: *number, tick: *tick, answer: done });
        }
    }
}

/// Somebody may have held a heartbeat back to let it go when the console has long been silent: it is as old as what the
/// console had heard when it sent it.
fn beat(heard_ms: Option<u32>, controller: &mut Controller, shared: &Shared) {
    let Some(heard_ms) = heard_ms else { return };
    let age_ms = uptime_ms().wrapping_sub(heard_ms);
    if age_ms < OLDEST_HEARTBEAT_MS {
        controller.heartbeat(Instant::now().as_micros().saturating_sub(u64::from(age_ms) * 1000));
    } else {
        shared.count(|c| c.too_late = c.too_late.wrapping_add(1));
    }
}

/// The answer, or nothing yet. A function of its own, so that a tick without an order does not pay for its stack.
#[inline(never)]
fn execute(
    what: What,
    received_us: u64,
    controller: &mut Controller,
    factory: &Parameters,
    shared: &Shared,
) -> Option<Answer> {
    let done = match what {
        What::Command(command) => controller.command(command, received_us).map(|()| None),
        What::Inject(injection) => shared.inject(injection).map(|()| None),
        What::Get(index) => value(controller, factory, index).map(Some),
        What::Set { index, value: to } => set(controller, factory, index, to).map(Some),
        What::Save => return save(controller, || shared.save(controller.parameters())),
        What::Factory => return save(controller, || shared.hand_over(Work::Factory)),
    };
    Some(done.map_or_else(Answer::Refused, Answer::Done))
}

fn value(controller: &Controller, factory: &Parameters, index: u16) -> Result<Value, Refusal> {
    match (table::get(controller.parameters(), index), table::get(factory, index)) {
        (Some(now), Some(factory)) => Ok(Value { now, factory }),
        _ => Err(Refusal::NoParameter),
    }
}

fn set(controller: &mut Controller, factory: &Parameters, index: u16, to: f32) -> Result<Value, Refusal> {
    value(controller, factory, index)?;
    let changed = controller.parameters().with(index, to).map_err(|_| Refusal::Parameter)?;
    table::keeps_failsafe(index, to, factory)?;
    controller.retune(&changed, factory).map_err(|_| Refusal::Parameter)?;
    value(controller, factory, index)
}

/// Hands work to the flash. The chip stands still while a page is erased: never while the motor is driven.
fn save(controller: &Controller, hand_over: impl FnOnce() -> Result<(), Refusal>) -> Option<Answer> {
    if controller.state().is_driving() {
        return Some(Answer::Refused(Refusal::Driving));
    }
    hand_over().err().map(Answer::Refused)
}

/// Whether a time on the robot's clock, ms, is over. It comes round: past is what is less than half a round ago.
fn is_past(deadline_ms: u32) -> bool {
    let ahead = deadline_ms.wrapping_sub(uptime_ms());
    ahead.cast_signed() < 0
}

/// Since boot, ms; comes round.
#[expect(clippy::cast_possible_truncation, reason = "comes round, as documented")]
pub(super) fn uptime_ms() -> u32 {
    Instant::now().as_millis() as u32
}

#[cfg(test)]
mod tests {
    use super::super::Shown;
    use super::*;
    use control::protocol::pairing::Pairing;
    use control::protocol::secure::Key;
    use std::path::Path;
    use std::vec::Vec;

    /// The clock of these tests: it stands still at 0.
    struct Still;

    embassy_time_driver::time_driver_impl!(static CLOCK: Still = Still);

    impl embassy_time_driver::Driver for Still {
        fn now(&self) -> u64 {
            0
        }

        fn schedule_wake(&self, _: u64, _: &core::task::Waker) {}
    }

    struct Desk {
        clerk: Clerk,
        controller: Controller,
        factory: Parameters,
        shared: Shared,
        number: u16,
    }

    impl Desk {
        fn new() -> Self {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
            let robot = description::Robot::load(&file).expect("robot.toml is sound");
            let factory = description::design::design(&robot).expect("a controller").parameters;
            let controller = Controller::new(&factory).expect("sound parameters");
            Self { clerk: Clerk::default(), controller, factory, shared: Shared::new(), number: 0 }
        }

        fn say(&self, order: ToRobot) {
            self.shared.order(Order { order, begins: false, received_us: 0 });
        }

        fn give(&mut self, what: What) {
            self.number += 1;
            self.say(ToRobot::Do(Do { number: self.number, deadline_ms: 1000, what }));
        }

        /// A tick's worth.
        fn serve(&mut self) -> Vec<Answer> {
            self.clerk.serve(0, &mut self.controller, &self.factory, &self.shared);
            core::iter::from_fn(|| self.shared.answers.try_receive().ok()).map(|answered| answered.answer).collect()
        }

        /// The flash does what there is to do.
        fn flash(&self, kept: bool) {
            assert!(self.shared.work.try_receive().is_ok());
            self.shared.finish();
            self.shared.saved.signal(kept);
        }
    }

    const DRIVE: What = What::Command(Command::Speed { omega: 44.0 });
    const DONE: Answer = Answer::Done(None);
    const SAVING: Answer = Answer::Refused(Refusal::Saving);

    #[test]
    fn while_the_flash_works_nothing_new_is_obeyed_but_stop() {
        for what in [What::Save, What::Factory] {
            let mut desk = Desk::new();
            desk.give(what);
            desk.give(DRIVE);
            assert_eq!(desk.serve(), [SAVING], "in the same tick");
            desk.give(DRIVE);
            desk.give(What::Save);
            assert_eq!(desk.serve(), [SAVING, SAVING]);
            desk.say(ToRobot::Heartbeat { heard_ms: Some(0) });
            desk.say(ToRobot::Stop);
            assert_eq!(desk.serve(), []);
            assert!(!desk.controller.state().is_driving());
            desk.flash(true);
            desk.give(DRIVE);
            assert_eq!(desk.serve(), [DONE, DONE]);
            assert!(desk.controller.state().is_driving());
        }
    }

    #[test]
    fn while_the_robot_is_paired_nobody_begins_to_drive() {
        let mut desk = Desk::new();
        let pairing = Pairing { console: [2; 6], primary: [1; 16], local: [1; 16], key: Key([1; 32]) };
        assert_eq!(desk.shared.hand_over(Work::Pair(Some(pairing))), Ok(()));
        desk.give(DRIVE);
        desk.give(What::Save);
        assert_eq!(desk.serve(), [SAVING, SAVING]);
        assert_eq!(desk.shared.hand_over(Work::Pair(None)), Err(Refusal::Saving));
        assert!(desk.shared.work.try_receive().is_ok());
        desk.shared.finish();
        desk.give(DRIVE);
        assert_eq!(desk.serve(), [DONE]);
    }

    #[test]
    fn an_ordinary_image_makes_no_fault() {
        use control::protocol::radio::{InjectedFault, Injection};
        let inject = What::Inject(Injection { fault: InjectedFault::HangLoop, for_ms: 1000 });
        let mut desk = Desk::new();
        desk.give(inject);
        assert_eq!(desk.serve(), [Answer::Refused(Refusal::NotBuiltIn)]);
        assert_eq!(desk.shared.injected(), None);
        let mut desk = Desk { shared: Shared::injectable(), ..Desk::new() };
        desk.give(inject);
        assert_eq!(desk.serve(), [DONE]);
        assert_eq!(desk.shared.injected(), None, "not before the answer is heard");
    }

    #[test]
    fn nothing_is_saved_while_the_motor_is_driven() {
        let mut desk = Desk::new();
        desk.give(DRIVE);
        for what in [What::Save, What::Factory] {
            desk.give(what);
        }
        assert_eq!(desk.serve(), [DONE, Answer::Refused(Refusal::Driving), Answer::Refused(Refusal::Driving)]);
        // Stopped in this tick: the bridge is still on.
        desk.shared.show(Shown::State(desk.controller.state(), None));
        desk.say(ToRobot::Stop);
        desk.give(What::Save);
        assert_eq!(desk.serve(), [Answer::Refused(Refusal::Driving)]);
        desk.shared.show(Shown::State(desk.controller.state(), None));
        desk.give(What::Save);
        assert_eq!(desk.serve(), []);
        desk.flash(false);
        assert_eq!(desk.serve(), [Answer::Refused(Refusal::NotKept)]);
    }
}
