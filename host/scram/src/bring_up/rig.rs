//! What a step works with: the robot through the dongle, whoever stands at the board, and a list of what was found.

use std::time::Duration;

use control::parameters::table;
use control::protocol::radio::{Batch, InjectedFault, Injection, Request, Reset, Status};
use control::{Command, Fault, Refusal, State, Unready};

use super::operator::{Act, Observation, Operator, Seen};
use super::step::{Check, Step, StepResult, Wiring};
use super::traffic::Traffic;
use super::{Options, Place};
use link::{Event, Line, LinkError, Outcome, RobotId, Session};

/// A session over any line.
pub type AnySession = Session<Box<dyn Line>>;

/// After a reset the robot is heard within seconds.
const BOOTS: Duration = Duration::from_secs(15);
/// A fault shows in telemetry within this time after it has begun, whatever its bound.
const FAULT: Duration = Duration::from_secs(5);
/// What is commanded shows in telemetry within this time.
const SHOWS: Duration = Duration::from_millis(200);
/// A robot that has just started, written its flash, or was starved is ready to drive within this time.
const READY: Duration = Duration::from_secs(5);
/// A duty at which no current flows, so that a motor that does not turn is not taken for blocked.
pub const GENTLE: f32 = 0.2;
/// A voltage in the place of the wiper's, in the middle of the converter's range, V.
pub const CONSTANT_V: f64 = 1.65;

/// Why a step ends before its end.
#[derive(Debug)]
pub enum Halt {
    /// What was missing is noted.
    Noted,
    /// The link broke.
    Link(LinkError),
}

impl From<LinkError> for Halt {
    fn from(error: LinkError) -> Self {
        Self::Link(error)
    }
}

/// How a robot came back after something that may have reset it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Back {
    /// It has booted, and says why.
    Booted(Reset),
    /// It went on without a reset.
    WentOn,
    /// It is not heard.
    Silent,
}

/// What a step works with.
pub struct Rig<'r> {
    /// The session.
    pub session: AnySession,
    /// The robot.
    pub robot: RobotId,
    operator: &'r mut dyn Operator,
    /// How long and how often.
    pub options: &'r Options,
    checks: Vec<Check>,
    motor: bool,
    constant: bool,
    number: u16,
    /// Measured once for all the steps that look at it.
    pub(super) traffic: Option<Traffic>,
}

impl<'r> Rig<'r> {
    /// With a robot that was found. The motor is unplugged, the wiper on its pin.
    pub fn new(session: AnySession, robot: RobotId, operator: &'r mut dyn Operator, options: &'r Options) -> Self {
        let checks = Vec::new();
        let (motor, constant, number, traffic) = (options.place == Place::Simulated, false, 0, None);
        Self { session, robot, operator, options, checks, motor, constant, number, traffic }
    }

    /// Does a step: what it found, and an error where the line itself is gone.
    pub fn walk(&mut self, step: &Step) -> (Vec<Check>, Option<LinkError>) {
        self.number = step.number;
        let done = self.prepare(step).and_then(|()| (step.run)(self));
        let mut broken = None;
        match done.and_then(|()| self.rest()) {
            Ok(()) | Err(Halt::Noted) => {}
            Err(Halt::Link(error @ LinkError::Line(_))) => broken = Some(error),
            Err(Halt::Link(error)) => self.check("the link", error.to_string(), "holds", false),
        }
        // A step that was halted leaves nothing running.
        if broken.is_none() && self.session.robot(self.robot).is_present() {
            self.session.stop_and_wait(self.robot, SHOWS, |_| {});
        }
        (std::mem::take(&mut self.checks), broken)
    }

    /// Tells whoever stands there that a step has ended.
    pub fn ended(&mut self, checked: &super::step::Checked) {
        self.operator.ended(checked);
    }

    fn prepare(&mut self, step: &Step) -> Result<(), Halt> {
        if step.chip.is_some_and(|chip| chip != self.options.chip) {
            return Err(self.skip("the whole step", &format!("this is an {}", self.options.chip.name())));
        }
        let Self { operator, session, .. } = self;
        if !operator.begin(step, &mut || session.poll().map(drop))? {
            return Err(self.skip("the whole step", "skipped"));
        }
        self.wire(step.wiring)?;
        self.here()
    }

    fn wire(&mut self, wiring: Wiring) -> Result<(), Halt> {
        let (motor, constant) = (wiring == Wiring::Motor, wiring == Wiring::Constant);
        if self.motor != motor {
            self.act(Act::Motor(motor))?;
            self.motor = motor;
        }
        if self.constant != constant {
            self.act(Act::Wiper(constant.then_some(CONSTANT_V)))?;
            self.constant = constant;
        }
        Ok(())
    }

    /// Waits until the robot is heard.
    fn here(&mut self) -> Result<(), Halt> {
        let start = self.session.now();
        while self.session.now().saturating_sub(start) < BOOTS {
            let robot = self.session.robot(self.robot);
            if robot.is_present() && robot.status().is_some() && robot.telemetry().is_some() {
                return Ok(());
            }
            self.session.poll()?;
        }
        self.check("the robot", "is not heard".into(), "answers", false);
        Err(Halt::Noted)
    }

    /// Ends what was injected and what the motor does.
    fn rest(&mut self) -> Result<(), Halt> {
        self.stop()?;
        if self.status().is_some_and(|status| status.injectable) {
            let nothing = Injection { fault: InjectedFault::None, for_ms: 0 };
            self.session.ask(self.robot, Request::Inject(nothing), |_| {})?;
        }
        Ok(())
    }

    /// Notes a part of the step.
    pub fn check(&mut self, what: &str, found: String, expected: &str, good: bool) {
        let verdict = if good { StepResult::Passed } else { StepResult::Failed };
        self.checks.push(Check { what: what.into(), found, expected: expected.into(), verdict });
    }

    /// Notes a part that nobody looked at.
    pub fn unchecked(&mut self, what: &str, why: &str) {
        let (what, found) = (what.to_owned(), why.to_owned());
        self.checks.push(Check { what, found, expected: String::new(), verdict: StepResult::NotChecked });
    }

    /// The same, and the step ends there.
    pub fn skip(&mut self, what: &str, why: &str) -> Halt {
        self.unchecked(what, why);
        Halt::Noted
    }

    /// Has something done at the board. Where nobody does it, the step ends.
    pub fn act(&mut self, act: Act) -> Result<(), Halt> {
        self.have_done(act, false)
    }

    /// Has something done while the motor runs.
    pub fn act_now(&mut self, act: Act) -> Result<(), Halt> {
        self.have_done(act, true)
    }

    fn have_done(&mut self, act: Act, at_once: bool) -> Result<(), Halt> {
        let Self { operator, session, .. } = self;
        if operator.act(act, at_once, &mut || session.poll().map(drop))? {
            return Ok(());
        }
        Err(self.skip(&act.words(), "nobody did it"))
    }

    /// The instruments count from now on.
    pub fn arm(&mut self) {
        self.operator.arm();
    }

    /// Reads an instrument, and notes it.
    pub fn observe(&mut self, observation: &Observation) -> Result<Seen, Halt> {
        let seen = self.see(observation)?;
        self.checks.push(observation.evaluate(&seen));
        Ok(seen)
    }

    /// Reads an instrument.
    pub fn see(&mut self, observation: &Observation) -> Result<Seen, Halt> {
        let Self { operator, session, number, .. } = self;
        Ok(operator.observe(*number, observation, &mut || session.poll().map(drop))?)
    }

    /// Sends nothing to the robot for `time`.
    pub fn silence(&mut self, time: Duration) {
        self.operator.silence(time);
    }

    /// The robot's latest status.
    pub fn status(&self) -> Option<&Status> {
        self.session.robot(self.robot).status()
    }

    /// A status that was sent from now on.
    pub fn next_status(&mut self) -> Result<Status, Halt> {
        let mut next = None;
        self.listen(Duration::from_secs(3), |event| {
            if let Event::Status(status) = event {
                next = Some(status.clone());
            }
            next.is_none()
        })?;
        next.ok_or_else(|| {
            self.check("the robot's status", "none within 3 s".into(), "once a second", false);
            Halt::Noted
        })
    }

    /// Hears the robot for so long, or as long as `more` says so.
    pub fn listen(&mut self, time: Duration, mut more: impl FnMut(&Event) -> bool) -> Result<(), Halt> {
        let end = self.session.now() + time;
        while self.session.now() < end {
            if let Some(heard) = self.session.poll()?
                && heard.robot == self.robot
                && !more(&heard.event)
            {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Hears the robot for so long, or as long as the options allow.
    pub fn run_for(&mut self, time: Duration) -> Result<(), Halt> {
        self.shortened_to(self.options.length, time);
        self.listen(time.min(self.options.length), |_| true)
    }

    /// Notes that something takes less time than it should.
    pub fn shortened_to(&mut self, length: Duration, wanted: Duration) {
        if length < wanted {
            let found = format!("{} s instead of {} s", length.as_secs(), wanted.as_secs());
            self.check("length, shortened with --length", found, "as long as was asked for", true);
        }
    }

    /// Sends a request and waits for its outcome.
    pub fn ask(&mut self, what: Request) -> Result<Outcome, Halt> {
        Ok(self.session.ask(self.robot, what, |_| {})?)
    }

    /// Commands something that must be done.
    pub fn must(&mut self, what: Request) -> Result<(), Halt> {
        let outcome = self.ask(what)?;
        if matches!(outcome, Outcome::Done(_)) {
            return Ok(());
        }
        self.check(&format!("{what:?}"), link::outcome(outcome), "done", false);
        Err(Halt::Noted)
    }

    /// The same with a command of a robot that may still be checking itself, or getting over a pause.
    fn must_once_ready(&mut self, command: Command) -> Result<(), Halt> {
        let end = self.session.now() + READY;
        loop {
            let outcome = self.ask(Request::Command(command))?;
            let waits = matches!(
                outcome,
                Outcome::Refused(
                    Refusal::NotReady(Unready::Checking | Unready::LoopStarved(_))
                        | Refusal::CausePersists(Fault::LoopStarved)
                )
            );
            if waits && self.session.now() < end {
                self.listen(SHOWS, |_| true)?;
                continue;
            }
            if matches!(outcome, Outcome::Done(_)) {
                return Ok(());
            }
            self.check(&format!("{command:?}"), link::outcome(outcome), "done", false);
            return Err(Halt::Noted);
        }
    }

    /// Drives, after a fault was cleared.
    pub fn drive(&mut self, command: Command) -> Result<(), Halt> {
        self.stop()?;
        if self.fault().is_some() {
            self.must_once_ready(Command::ClearFault)?;
        }
        self.must_once_ready(command)?;
        let mut driving = false;
        self.listen(SHOWS, |event| {
            driving |= matches!(event, Event::Telemetry(batch) if batch.state.is_driving());
            !driving
        })?;
        if driving {
            return Ok(());
        }
        let found = self.telemetry().map_or("nothing".into(), |batch| format!("{:?}", batch.state));
        self.check("telemetry after the command", found, "driving", false);
        Err(Halt::Noted)
    }

    /// Stops the motor and waits until telemetry says that the bridge is off.
    pub fn stop(&mut self) -> Result<(), Halt> {
        if self.telemetry().is_some_and(|batch| !batch.state.is_driving())
            || self.session.stop_and_wait(self.robot, SHOWS * 10, |_| {})
        {
            return Ok(());
        }
        self.check("stop", "telemetry does not say that the bridge is off".into(), "bridge off", false);
        Err(Halt::Noted)
    }

    /// The latest telemetry.
    pub fn telemetry(&self) -> Option<&Batch> {
        self.session.robot(self.robot).telemetry()
    }

    /// The fault that the robot is in.
    pub fn fault(&self) -> Option<Fault> {
        self.telemetry().and_then(|batch| batch.fault)
    }

    /// Asks for a fault. Where the image makes none, the step ends.
    pub fn inject(&mut self, fault: InjectedFault, for_ms: u16) -> Result<(), Halt> {
        if !self.status().is_some_and(|status| status.injectable) {
            return Err(self.skip(&format!("{fault:?}"), "the image makes no faults: cargo flash-robot CHIP --inject"));
        }
        self.must(Request::Inject(Injection { fault, for_ms }))
    }

    /// Waits for a robot that something has perhaps reset since `since` on the line's clock.
    pub fn back(&mut self, since: Duration, silent_for: Duration) -> Result<Back, Halt> {
        let end = self.session.now() + silent_for + BOOTS;
        let watched = self.session.now() + silent_for;
        let mut fresh = None;
        while self.session.now() < end {
            let heard = self.session.poll()?.filter(|heard| heard.robot == self.robot);
            if let Some(Event::Status(status)) = heard.map(|heard| heard.event) {
                fresh = Some(status.reset);
            }
            let up = self.session.robot(self.robot).uptime();
            let booted = up.is_some_and(|up| up < self.session.now().saturating_sub(since));
            if self.telemetry().is_none() {
                continue;
            }
            match fresh {
                Some(reset) if booted => return Ok(Back::Booted(reset)),
                Some(_) if self.session.now() > watched && self.session.robot(self.robot).is_present() => {
                    return Ok(Back::WentOn);
                }
                _ => {}
            }
        }
        Ok(Back::Silent)
    }

    /// Notes that the robot came back as expected.
    pub fn must_boot(&mut self, back: Back, expected: Reset, otherwise: &str) {
        let found = match back {
            Back::Booted(reset) => format!("{reset:?}"),
            Back::WentOn => otherwise.to_owned(),
            Back::Silent => format!("the robot is not heard for {} s", BOOTS.as_secs()),
        };
        let wanted = format!("{expected:?}");
        self.check("the reset's cause in the status after it", found, &wanted, back == Back::Booted(expected));
        if let (Back::Booted(_), Some(batch)) = (back, self.telemetry()) {
            let off = !batch.state.is_driving();
            self.check("after the reset", format!("{:?}", batch.state), "bridge off", off);
        }
    }

    /// Waits until the robot has stopped itself: which fault, and how long it took.
    pub fn await_fault(&mut self, patience: Duration) -> Result<Option<(Fault, Duration)>, Halt> {
        let start = self.session.now();
        let mut found = None;
        self.listen(patience, |event| {
            if let Event::Telemetry(Batch { state: State::Fault, fault: Some(fault), .. }) = event {
                found = Some(*fault);
            }
            found.is_none()
        })?;
        Ok(found.map(|fault| (fault, self.session.now().saturating_sub(start))))
    }

    /// Notes that a fault that begins in a while was found within its bound, s.
    pub fn must_fault(&mut self, what: &str, begins: Duration, bound_s: f64) -> Result<(), Halt> {
        let found = self.await_fault(FAULT)?;
        let expected = format!("a fault, bridge off, within {bound_s:.2} s");
        match found {
            None => self.check(what, "the robot drives on".into(), &expected, false),
            Some((fault, after)) => {
                let after_s = after.saturating_sub(begins).as_secs_f64();
                self.check(what, format!("{fault:?} after {after_s:.2} s"), &expected, after_s <= bound_s + TELLING_S);
            }
        }
        Ok(())
    }

    /// A parameter as the robot file has it, in its unit: what the robot itself says of its bounds may be wrong.
    pub fn bound(&mut self, name: &str) -> Result<f64, Halt> {
        let index = table::find(name);
        let bound = index.and_then(|index| table::get(&self.options.parameters, index));
        bound.map(f64::from).ok_or_else(|| self.skip(name, "there is no such parameter"))
    }

    /// A parameter that the robot runs on, in the robot file's unit.
    pub fn parameter(&mut self, name: &str) -> Result<f64, Halt> {
        let index = table::find(name);
        let outcome = match index {
            Some(index) => self.ask(Request::Get(index))?,
            None => Outcome::Absent,
        };
        if let Outcome::Done(Some(value)) = outcome {
            return Ok(f64::from(value.now));
        }
        self.check(name, link::outcome(outcome), "told", false);
        Err(Halt::Noted)
    }
}

/// How long a fault takes to be told: a batch of telemetry, the radio, the line; s.
const TELLING_S: f64 = 0.1;
