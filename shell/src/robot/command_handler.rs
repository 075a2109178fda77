//! Handles the console's requests in the control loop: each once, before its deadline, and only what the state allows.

use control::parameters::table;
use control::protocol::radio::{Answer, Downlink, Request, RequestFrame, Value};
use control::{Command, Controller, Gait, Parameters, Refusal, Unready};
use embassy_time::Instant;

use super::Shared;
use super::shared::{Answered, ReceivedDownlink, Work};

/// Longer than any limit on the age of a command: older heartbeats would change nothing, and count as too late.
const OLDEST_HEARTBEAT_MS: u32 = 10_000;

/// Handles the downlinks of one console.
#[derive(Default)]
pub(super) struct CommandHandler {
    /// The latest request that is answered, by its number, the control period in which it was done, and its answer: `None` while
    /// the flash works on it.
    last: Option<(u16, u32, Option<Answer>)>,
    /// Number of the control period.
    period: u32,
    next: Next,
}

/// What the controller goes on with once the flash has it.
#[derive(Default)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to put the gait on, and one of these exists")]
enum Next {
    /// What it has.
    #[default]
    Same,
    /// The factory's set.
    Factory,
    /// This gait.
    Gait(Gait),
}

impl CommandHandler {
    /// Serves everything that has come since the last tick, before the decision of a control period.
    pub fn serve(&mut self, period: u32, controller: &mut Controller, factory: &Parameters, shared: &Shared) {
        self.period = period;
        self.finish_saving(controller, factory, shared);
        if shared.take_lost_stop() {
            // It was older than all that is in the queue.
            let _ = controller.command(Command::Idle, Instant::now().as_micros());
        }
        while let Ok(downlink) = shared.downlinks.try_receive() {
            self.handle(&downlink, controller, factory, shared);
        }
    }

    fn handle(
        &mut self,
        downlink: &ReceivedDownlink,
        controller: &mut Controller,
        factory: &Parameters,
        shared: &Shared,
    ) {
        if downlink.begins {
            // Whoever drove before has gone, and the new one has not said anything yet.
            let _ = controller.command(Command::Idle, downlink.received_us);
            // Another console may give the same numbers: what was answered to the one before is not for this one.
            while shared.answers.try_receive().is_ok() {}
            self.last = None;
        }
        match downlink.downlink {
            Downlink::Heartbeat { heard_ms } => beat(heard_ms, controller, shared),
            // Refused only in `Fault`, where the bridge is off.
            Downlink::Stop => drop(controller.command(Command::Idle, downlink.received_us)),
            Downlink::Request(frame) => self.answer(&frame, downlink.received_us, controller, factory, shared),
        }
    }

    /// Answers a request that may have been answered before: it is repeated until the console has heard.
    fn answer(
        &mut self,
        frame: &RequestFrame,
        received_us: u64,
        controller: &mut Controller,
        factory: &Parameters,
        shared: &Shared,
    ) {
        let mut tick = self.period;
        let answer = match self.last {
            Some((number, done_in, answer)) if number == frame.number => {
                tick = done_in;
                answer
            }
            _ if is_past(frame.deadline_ms) => {
                shared.count(|c| c.too_late = c.too_late.wrapping_add(1));
                Some(Answer::TooLate)
            }
            _ if shared.is_working() => Some(Answer::Refused(Refusal::Saving)),
            _ => {
                self.next = match frame.request {
                    Request::Factory => Next::Factory,
                    Request::KeepGait(gait) => Next::Gait(gait),
                    _ => Next::Same,
                };
                let answer = execute(frame.request, received_us, controller, factory, shared);
                if answer == Some(Answer::Refused(Refusal::NotReady(Unready::Checking))) {
                    // In a moment the robot knows, and the request comes again: it is repeated until it is answered.
                    return;
                }
                self.last = Some((frame.number, tick, answer));
                answer
            }
        };
        if let Some(answer) = answer {
            shared.answer(Answered { number: frame.number, tick, answer });
        }
    }

    fn finish_saving(&mut self, controller: &mut Controller, factory: &Parameters, shared: &Shared) {
        let Some(kept) = shared.saved.try_take() else { return };
        match core::mem::take(&mut self.next) {
            // The factory's set was checked before the controller was made.
            Next::Factory if kept => drop(controller.retune(factory, factory)),
            // This gait before it was handed over; since then nobody began to drive.
            Next::Gait(gait) if kept => {
                let _ = controller.keep_gait(&gait);
                shared.show_gait(controller.gait());
            }
            _ => {}
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

/// The answer, or nothing yet. A function of its own, so that a tick without a request does not pay for its stack.
#[inline(never)]
fn execute(
    request: Request,
    received_us: u64,
    controller: &mut Controller,
    factory: &Parameters,
    shared: &Shared,
) -> Option<Answer> {
    let done = match request {
        Request::Command(command) => controller.command(command, received_us).map(|()| None),
        Request::Inject(injection) => shared.inject(injection).map(|()| None),
        Request::Get(index) => value(controller, factory, index).map(Some),
        Request::Set { index, value: to } => set(controller, factory, index, to).map(Some),
        Request::Save => return save(controller, || shared.save(controller.parameters())),
        Request::Factory => return save(controller, || shared.hand_over(Work::Factory)),
        Request::KeepGait(gait) => {
            let keep = || controller.check_gait(&gait).and_then(|()| shared.hand_over(Work::KeepGait(gait)));
            return save(controller, keep);
        }
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

    struct Harness {
        command_handler: CommandHandler,
        controller: Controller,
        factory: Parameters,
        shared: Shared,
        number: u16,
    }

    impl Harness {
        fn new() -> Self {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
            let robot = robot_file::Robot::load(&file).expect("robot.toml is sound");
            let factory = robot_file::design::design(&robot).expect("a controller").parameters;
            let controller = Controller::new(&factory).expect("sound parameters");
            Self { command_handler: CommandHandler::default(), controller, factory, shared: Shared::new(), number: 0 }
        }

        fn say(&self, downlink: Downlink) {
            self.shared.downlink(ReceivedDownlink { downlink, begins: false, received_us: 0 });
        }

        fn give(&mut self, request: Request) {
            self.number += 1;
            self.say(Downlink::Request(RequestFrame { number: self.number, deadline_ms: 1000, request }));
        }

        /// A tick's worth.
        fn serve(&mut self) -> Vec<Answer> {
            self.command_handler.serve(0, &mut self.controller, &self.factory, &self.shared);
            core::iter::from_fn(|| self.shared.answers.try_receive().ok()).map(|answered| answered.answer).collect()
        }

        /// The flash does what there is to do.
        fn flash(&self, kept: bool) {
            assert!(self.shared.work.try_receive().is_ok());
            self.shared.finish();
            self.shared.saved.signal(kept);
        }
    }

    const DRIVE: Request = Request::Command(Command::Speed { omega: 44.0 });
    const DONE: Answer = Answer::Done(None);
    const SAVING: Answer = Answer::Refused(Refusal::Saving);

    #[test]
    fn while_the_flash_works_nothing_new_is_obeyed_but_stop() {
        for request in [Request::Save, Request::Factory] {
            let mut harness = Harness::new();
            harness.give(request);
            harness.give(DRIVE);
            assert_eq!(harness.serve(), [SAVING], "in the same tick");
            harness.give(DRIVE);
            harness.give(Request::Save);
            assert_eq!(harness.serve(), [SAVING, SAVING]);
            harness.say(Downlink::Heartbeat { heard_ms: Some(0) });
            harness.say(Downlink::Stop);
            assert_eq!(harness.serve(), []);
            assert!(!harness.controller.state().is_driving());
            harness.flash(true);
            harness.give(DRIVE);
            assert_eq!(harness.serve(), [DONE, DONE]);
            assert!(harness.controller.state().is_driving());
        }
    }

    #[test]
    fn while_the_robot_is_paired_nobody_begins_to_drive() {
        let mut harness = Harness::new();
        let pairing = Pairing { console: [2; 6], primary: [1; 16], local: [1; 16], key: Key([1; 32]) };
        assert_eq!(harness.shared.hand_over(Work::Pair(Some(pairing))), Ok(()));
        harness.give(DRIVE);
        harness.give(Request::Save);
        assert_eq!(harness.serve(), [SAVING, SAVING]);
        assert_eq!(harness.shared.hand_over(Work::Pair(None)), Err(Refusal::Saving));
        assert!(harness.shared.work.try_receive().is_ok());
        harness.shared.finish();
        harness.give(DRIVE);
        assert_eq!(harness.serve(), [DONE]);
    }

    #[test]
    fn an_ordinary_image_makes_no_fault() {
        use control::protocol::radio::{InjectedFault, Injection};
        let inject = Request::Inject(Injection { fault: InjectedFault::HangLoop, for_ms: 1000 });
        let mut harness = Harness::new();
        harness.give(inject);
        assert_eq!(harness.serve(), [Answer::Refused(Refusal::NotBuiltIn)]);
        assert_eq!(harness.shared.injected(), None);
        let mut harness = Harness { shared: Shared::injectable(), ..Harness::new() };
        harness.give(inject);
        assert_eq!(harness.serve(), [DONE]);
        assert_eq!(harness.shared.injected(), None, "not before the answer is heard");
    }

    #[test]
    fn nothing_is_saved_while_the_motor_is_driven() {
        let mut harness = Harness::new();
        harness.give(DRIVE);
        for request in [Request::Save, Request::Factory] {
            harness.give(request);
        }
        assert_eq!(harness.serve(), [DONE, Answer::Refused(Refusal::Driving), Answer::Refused(Refusal::Driving)]);
        // Stopped in this tick: the bridge is still on.
        harness.shared.show(Shown::State(harness.controller.state(), None));
        harness.say(Downlink::Stop);
        harness.give(Request::Save);
        assert_eq!(harness.serve(), [Answer::Refused(Refusal::Driving)]);
        harness.shared.show(Shown::State(harness.controller.state(), None));
        harness.give(Request::Save);
        assert_eq!(harness.serve(), []);
        harness.flash(false);
        assert_eq!(harness.serve(), [Answer::Refused(Refusal::NotKept)]);
    }
}
