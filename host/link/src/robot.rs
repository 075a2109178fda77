//! One robot as the console has it: its session, what it was asked, what it told.

use std::collections::VecDeque;
use std::time::Duration;

use control::protocol::dongle::{Address, Payload, RadioKey};
use control::protocol::pairing::Pairing;
use control::protocol::radio::{
    Answer, Batch, Downlink, Echo, LONGEST, Report, Request, RequestFrame, Status, Uplink, Value,
};
use control::protocol::secure::{Caller, Kind, Nonce, Opener, Rejected, Sealer, kind, robot_nonce};
use control::{Command, Refusal};

use super::quality::{Meter, Quality};

/// Interval between heartbeats: a fifth of the time after which the robot slows down.
const HEARTBEAT: Duration = Duration::from_millis(50);
/// Silence of a robot after which it gets no heartbeat: whoever drives would not see what it does.
const FRESH: Duration = Duration::from_millis(250);
/// Silence of a robot after which its session is over: it has stopped by itself before.
const GONE: Duration = Duration::from_millis(1000);
/// A call to a robot that was heard lately, and to one that was not: each takes the radio some 20 ms of retries.
const CALL: Duration = Duration::from_millis(100);
const CALL_SELDOM: Duration = Duration::from_millis(500);
/// Interval at which a request is repeated until it is answered.
const REPEAT: Duration = Duration::from_millis(30);
/// Time within which the robot must begin with a request, on its own clock, ms.
const DEADLINE_MS: u32 = 500;
/// Time without an answer after which a request is given up and the robot stopped: then it is known what it does.
const GIVE_UP: Duration = Duration::from_millis(900);
/// The same for what is written to the flash, which may have pages to erase.
const GIVE_UP_SAVING: Duration = Duration::from_secs(5);
/// A robot's clock does not leap; this computer has slept if it seems to.
const SLEPT_MS: f64 = 1000.0;
/// Interval at which `Stop` is repeated until telemetry says that the bridge is off.
const STOP: Duration = Duration::from_millis(10);
/// Rate by which the robot's clock may be slower than this one: 200 µs a second, ten times what its crystal allows.
const DRIFT: f64 = 2e-4;

/// Outcome of a request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Done, with the parameter where one was asked for.
    Done(Option<Value>),
    /// The robot says no.
    Refused(Refusal),
    /// It reached the robot after its deadline and was not done.
    TooLate,
    /// Nothing came back. The robot is told to stop, so that nothing unknown goes on.
    Unanswered,
    /// There is no session with the robot: nothing was sent.
    Absent,
    /// `Stop` came before it was answered.
    Overtaken,
}

impl Outcome {
    /// Whether the robot was told to stop, with this or before, or was not reached at all.
    #[must_use]
    pub fn stops(self) -> bool {
        matches!(self, Self::Unanswered | Self::Absent | Self::Overtaken)
    }
}

/// What a robot said or did, as the session found out.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A session has begun.
    Present,
    /// It has not been heard for a second.
    Lost,
    /// Telemetry of up to ten control periods.
    Telemetry(Batch),
    /// Status, once a second.
    Status(Status),
    /// Outcome of a request.
    Answered {
        /// As [`super::Session::request`] gave it.
        number: u16,
        /// The request.
        request: Request,
        /// The robot's control period in which it was done or refused; `None` where the robot did not answer.
        tick: Option<u32>,
        /// Outcome.
        outcome: Outcome,
    },
    /// After `Stop`: the bridge is off.
    Stopped,
    /// It speaks another version of the protocol.
    OtherVersion(u32),
}

/// Kinds of frames, most urgent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Urgency {
    Stop,
    Request,
    Heartbeat,
    Hello,
}

/// A robot that is paired with this console, present or not.
#[derive(Debug)]
pub struct Robot {
    name: String,
    address: Address,
    pairing: Pairing,
    phase: Phase,
    requests: VecDeque<PendingRequest>,
    stop: Option<Stop>,
    number: u16,
    telemetry: Option<Batch>,
    status: Option<Status>,
    other_version: Option<u32>,
    /// When that was last said.
    version_said: Option<Duration>,
    /// This computer has slept, or the robot's clock has leaped: whatever was going on is over.
    out_of_time: bool,
    uptime: Option<Uptime>,
    /// Its clock in its latest uplink.
    told_ms: Option<u32>,
    rssi: Option<i8>,
    heard: Option<Duration>,
    meter: Meter,
    missing: u64,
    nonce: Option<Nonce>,
    rejected: u64,
}

#[derive(Debug)]
enum Phase {
    Calling { caller: Caller, due: Duration },
    Talking(Box<Talk>),
}

#[derive(Debug)]
struct Talk {
    sealer: Sealer,
    opener: Opener,
    /// Something has come under this session's key.
    confirmed: bool,
    heartbeat_due: Duration,
}

#[derive(Clone, Copy, Debug)]
struct PendingRequest {
    number: u16,
    request: Request,
    /// Set when its turn comes.
    begun: Option<Begun>,
}

#[derive(Clone, Copy, Debug)]
struct Begun {
    at: Duration,
    due: Duration,
    deadline_ms: u32,
}

#[derive(Clone, Copy, Debug)]
struct Stop {
    due: Duration,
    /// Every other one goes to everybody, which takes a fifth of the time but is not repeated by the radio.
    broadcast: bool,
    /// Counter of the first one that was sent.
    first: Option<u32>,
    sent: u32,
}

impl Stop {
    fn is_new(&self) -> bool {
        self.sent < 2
    }
}

/// The robot's clock: `uptime_ms` at `at`, behind by the time that the uplink took.
#[derive(Clone, Copy, Debug)]
struct Uptime {
    ms: f64,
    at: Duration,
}

impl Robot {
    pub(super) fn new(name: String, address: Address, pairing: Pairing, nonce: Nonce, now: Duration) -> Self {
        let [low, high, ..] = nonce.0;
        let caller = Caller::new(pairing.key.clone(), nonce);
        Self {
            name,
            address,
            pairing,
            phase: Phase::Calling { caller, due: now },
            requests: VecDeque::new(),
            stop: None,
            // Another one than an earlier console's: the robot remembers the answer to the last.
            number: u16::from_le_bytes([low, high]),
            telemetry: None,
            status: None,
            other_version: None,
            version_said: None,
            out_of_time: false,
            uptime: None,
            told_ms: None,
            rssi: None,
            heard: None,
            meter: Meter::default(),
            missing: 0,
            nonce: None,
            rejected: 0,
        }
    }

    /// Its name: what it says itself, or what it was paired as.
    #[must_use]
    pub fn name(&self) -> &str {
        self.status.as_ref().map_or(&self.name, |status| status.name.as_str())
    }

    /// ESP-NOW (MAC) address.
    #[must_use]
    pub fn address(&self) -> Address {
        self.address
    }

    /// Whether there is a session with it.
    #[must_use]
    pub fn is_present(&self) -> bool {
        matches!(&self.phase, Phase::Talking(talk) if talk.confirmed)
    }

    /// Its latest telemetry.
    #[must_use]
    pub fn telemetry(&self) -> Option<&Batch> {
        self.telemetry.as_ref()
    }

    /// Its latest status.
    #[must_use]
    pub fn status(&self) -> Option<&Status> {
        self.status.as_ref()
    }

    /// Since its boot, by the latest uplink.
    #[must_use]
    pub fn uptime(&self) -> Option<Duration> {
        self.uptime.map(|uptime| Duration::from_secs_f64(uptime.ms.max(0.0) * 1e-3))
    }

    /// When it was last heard, on the line's clock.
    #[must_use]
    pub fn heard(&self) -> Option<Duration> {
        self.heard
    }

    /// The version of the protocol that it speaks, where it is another than ours.
    #[must_use]
    pub fn other_version(&self) -> Option<u32> {
        self.other_version
    }

    /// How good the way from and to it is.
    #[must_use]
    pub fn quality(&self, now: Duration) -> Quality {
        self.meter.quality(now, self.rssi)
    }

    /// Its frames that are missing between those that came, since the console began.
    #[must_use]
    pub fn missing(&self) -> u64 {
        self.missing
    }

    /// Frames from its address that are not its, or not new.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The robot's own nonce of the session: what keeps frames of an earlier one from counting again.
    #[must_use]
    pub fn nonce(&self) -> Option<Nonce> {
        self.nonce
    }

    /// `Stop` is on its way.
    #[must_use]
    pub fn is_stopping(&self) -> bool {
        self.stop.is_some()
    }

    /// Commands that are not answered yet.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.requests.len()
    }

    pub(super) fn local(&self) -> RadioKey {
        self.pairing.local
    }

    pub(super) fn console(&self) -> Address {
        self.pairing.console
    }

    pub(super) fn request(&mut self, request: Request, events: &mut Vec<Event>) -> u16 {
        self.number = self.number.wrapping_add(1);
        let number = self.number;
        if self.is_present() {
            self.requests.push_back(PendingRequest { number, request, begun: None });
        } else {
            events.push(Event::Answered { number, request, tick: None, outcome: Outcome::Absent });
        }
        number
    }

    pub(super) fn stop(&mut self, now: Duration, events: &mut Vec<Event>) {
        for request in self.requests.drain(..) {
            let (number, request) = (request.number, request.request);
            events.push(Event::Answered { number, request, tick: None, outcome: Outcome::Overtaken });
        }
        // Without a session there is nothing to stop: the next one begins with the bridge off.
        if matches!(self.phase, Phase::Talking(_)) {
            self.stop = Some(Stop { due: now, broadcast: true, first: None, sent: 0 });
        }
    }

    /// What time does: commands that nobody answers, a robot that is silent.
    pub(super) fn age(&mut self, now: Duration, nonce: &mut dyn FnMut() -> Nonce, events: &mut Vec<Event>) {
        let silent = self.heard.map_or(Duration::MAX, |heard| now.saturating_sub(heard));
        let over = silent > GONE || std::mem::take(&mut self.out_of_time);
        if matches!(self.phase, Phase::Talking(_)) && over {
            let was_present = self.is_present();
            let caller = Caller::new(self.pairing.key.clone(), nonce());
            self.phase = Phase::Calling { caller, due: now };
            (self.stop, self.uptime, self.told_ms, self.telemetry) = (None, None, None, None);
            for request in self.requests.drain(..) {
                let (number, request) = (request.number, request.request);
                events.push(Event::Answered { number, request, tick: None, outcome: Outcome::Unanswered });
            }
            if was_present {
                events.push(Event::Lost);
            }
            return;
        }
        let given_up = |request: &PendingRequest| {
            let saves = matches!(request.request, Request::Save | Request::Factory | Request::KeepGait(_));
            let patience = if saves { GIVE_UP_SAVING } else { GIVE_UP };
            request.begun.is_some_and(|begun| now.saturating_sub(begun.at) > patience)
        };
        if self.requests.front().is_some_and(given_up)
            && let Some(request) = self.requests.pop_front()
        {
            let (number, request) = (request.number, request.request);
            events.push(Event::Answered { number, request, tick: None, outcome: Outcome::Unanswered });
            self.stop(now, events);
        }
    }

    /// What is due, if anything is, and since when.
    pub(super) fn urgency(&self, now: Duration) -> Option<(Urgency, Duration)> {
        let at = |urgency, due: Duration| (now >= due).then_some((urgency, due));
        let talk = match &self.phase {
            Phase::Calling { due, .. } => return at(Urgency::Hello, *due),
            Phase::Talking(talk) => talk,
        };
        if let Some(stop) = self.stop {
            // And nothing else until it is known to have arrived: without heartbeats the robot stops by itself, should
            // somebody keep the stops from it.
            return at(Urgency::Stop, stop.due);
        }
        let fresh = self.heard.is_some_and(|heard| now.saturating_sub(heard) < FRESH);
        let request = self
            .requests
            .front()
            .and_then(|request| at(Urgency::Request, request.begun.map_or(Duration::ZERO, |begun| begun.due)));
        request.or_else(|| if fresh { at(Urgency::Heartbeat, talk.heartbeat_due) } else { None })
    }

    /// Its first `Stop` of this press, or the second, is due: nothing may hold it up.
    pub(super) fn stops_first(&self, now: Duration) -> bool {
        matches!(self.phase, Phase::Talking(_)) && self.stop.is_some_and(|stop| now >= stop.due && stop.is_new())
    }

    /// The frame that is due, and to whom.
    pub(super) fn frame(&mut self, urgency: Urgency, now: Duration) -> Option<(Address, Payload)> {
        let often = self.heard.is_some_and(|heard| now.saturating_sub(heard) < 10 * GONE);
        let talk = match &mut self.phase {
            Phase::Calling { caller, due } => {
                *due = now + if often { CALL } else { CALL_SELDOM };
                return Some((self.address, Payload::from_slice(&caller.hello()).ok()?));
            }
            Phase::Talking(talk) => talk,
        };
        let mut to = self.address;
        let request = match urgency {
            Urgency::Stop => {
                let stop = self.stop.as_mut()?;
                if stop.broadcast {
                    to = super::BROADCAST;
                }
                // The first two go at once.
                stop.due = if stop.first.is_none() { now } else { now + STOP };
                stop.sent = stop.sent.saturating_add(1);
                stop.broadcast = !stop.broadcast;
                Downlink::Stop
            }
            Urgency::Request => {
                let uptime = self.uptime?;
                let waiting = self.requests.front_mut()?;
                let begun = waiting.begun.get_or_insert_with(|| Begun {
                    at: now,
                    due: now,
                    deadline_ms: uptime.ms_at(now).wrapping_add(DEADLINE_MS),
                });
                begun.due = now + REPEAT;
                Downlink::Request(RequestFrame {
                    number: waiting.number,
                    deadline_ms: begun.deadline_ms,
                    request: waiting.request,
                })
            }
            Urgency::Heartbeat | Urgency::Hello => {
                talk.heartbeat_due = now + HEARTBEAT;
                Downlink::Heartbeat { heard_ms: self.told_ms }
            }
        };
        let mut buffer = [0; LONGEST];
        // A command has some forty bytes, and a session does not last for years.
        let sealed = if to == super::BROADCAST {
            talk.sealer.seal_to_all(&request, &mut buffer)
        } else {
            talk.sealer.seal(&request, &mut buffer)
        };
        let (frame, counter) = sealed.ok()?;
        if let (Some(stop), Downlink::Stop) = (&mut self.stop, request) {
            stop.first.get_or_insert(counter);
        }
        self.meter.sent(counter, now);
        Some((to, Payload::from_slice(frame).ok()?))
    }

    /// Takes a frame from its address.
    pub(super) fn hear(&mut self, frame: &[u8], rssi: i8, now: Duration, events: &mut Vec<Event>) {
        match kind(frame) {
            // Nobody has signed that: in a session it is not its.
            Err(Rejected::OtherVersion(_)) if self.is_present() => self.rejected += 1,
            Err(Rejected::OtherVersion(version)) => {
                let lately = self.version_said.is_some_and(|at| now.saturating_sub(at) < GONE);
                if self.other_version.replace(version) != Some(version) && !lately {
                    self.version_said = Some(now);
                    events.push(Event::OtherVersion(version));
                }
            }
            Ok(Kind::Welcome) => self.welcomed(frame, now),
            Ok(Kind::Uplink) => self.told(frame, rssi, now, events),
            // Its notice, in our own version: it was meant for another console.
            Ok(Kind::Notice) => {}
            _ => self.rejected += 1,
        }
    }

    fn welcomed(&mut self, frame: &[u8], now: Duration) {
        let Phase::Calling { caller, .. } = &self.phase else { return };
        let Ok((sealer, opener)) = caller.welcomed(frame) else {
            self.rejected += 1;
            return;
        };
        self.nonce = robot_nonce(frame);
        self.phase = Phase::Talking(Box::new(Talk { sealer, opener, confirmed: false, heartbeat_due: now }));
        self.heard = Some(now);
        self.meter.begin();
    }

    fn told(&mut self, frame: &[u8], rssi: i8, now: Duration, events: &mut Vec<Event>) {
        let Phase::Talking(talk) = &mut self.phase else {
            self.rejected += 1;
            return;
        };
        let Ok(opened) = talk.opener.open::<Uplink>(frame) else {
            self.rejected += 1;
            return;
        };
        let Uplink { uptime_ms, echo, report: message } = opened.body;
        if !std::mem::replace(&mut talk.confirmed, true) {
            events.push(Event::Present);
        }
        (self.heard, self.rssi, self.other_version) = (Some(now), Some(rssi), None);
        self.missing += u64::from(opened.missing);
        self.meter.received(now, opened.missing, &echo);
        self.told_ms = Some(uptime_ms);
        self.out_of_time |= self.uptime.is_some_and(|uptime| uptime.leaped(uptime_ms, now));
        self.uptime = Some(Uptime::later(self.uptime, uptime_ms, now));
        match message {
            Report::Answer { number, tick, answer } => self.answered(number, tick, answer, events),
            Report::Telemetry(batch) => {
                self.telemetry = Some(batch.clone());
                let is_driving = batch.state.is_driving();
                events.push(Event::Telemetry(batch));
                self.stopped(is_driving, echo, events);
            }
            Report::Status(status) => {
                self.status = Some(status.clone());
                events.push(Event::Status(status));
            }
        }
    }

    fn answered(&mut self, number: u16, tick: u32, answer: Answer, events: &mut Vec<Event>) {
        if self.requests.front().is_none_or(|request| request.number != number || request.begun.is_none()) {
            // Again: the answer to a repetition.
            return;
        }
        let Some(request) = self.requests.pop_front() else { return };
        let outcome = match answer {
            Answer::Done(value) => Outcome::Done(value),
            Answer::Refused(refusal) => Outcome::Refused(refusal),
            Answer::TooLate => Outcome::TooLate,
        };
        let request = request.request;
        self.follow_gait(request, outcome);
        events.push(Event::Answered { number, request, tick: Some(tick), outcome });
    }

    /// Which gait is stored is known before the next status says so.
    fn follow_gait(&mut self, request: Request, outcome: Outcome) {
        let Some(status) = &mut self.status else { return };
        match (request, outcome) {
            (Request::KeepGait(gait), Outcome::Done(_)) => status.gait = Some(gait.label()),
            (Request::Command(Command::Gait { .. }), Outcome::Refused(Refusal::NoGait)) => status.gait = None,
            _ => {}
        }
    }

    /// `Stop` has come to its end when telemetry from after it says that the bridge is off.
    fn stopped(&mut self, is_driving: bool, echo: Echo, events: &mut Vec<Event>) {
        let Some(Stop { first: Some(first), .. }) = self.stop else { return };
        if echo.counter >= first && !is_driving {
            self.stop = None;
            events.push(Event::Stopped);
        }
    }
}

impl Uptime {
    /// The clock after another uplink: the one that took the shortest time is the best, and ages with the drift.
    fn later(before: Option<Self>, ms: u32, at: Duration) -> Self {
        let heard = Self { ms: f64::from(ms), at };
        let Some(before) = before else { return heard };
        let expected = before.ms + before.ahead(at) * (1.0 - DRIFT);
        // Far from what is expected it has come round, or begun anew.
        if expected > heard.ms && expected - heard.ms < 5e3 { Self { ms: expected, at } } else { heard }
    }

    /// Whether an uplink is from much later than it can be.
    fn leaped(self, ms: u32, at: Duration) -> bool {
        let ahead = f64::from(ms.wrapping_sub(self.ms_at(at)).cast_signed());
        ahead > SLEPT_MS
    }

    fn ahead(self, at: Duration) -> f64 {
        at.saturating_sub(self.at).as_secs_f64() * 1e3
    }

    /// The robot's clock at a time, ms; comes round.
    fn ms_at(self, at: Duration) -> u32 {
        // Whole and below 2³³.
        (self.ms + self.ahead(at)) as u64 as u32
    }
}
