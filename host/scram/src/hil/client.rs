//! The host's end of the lockstep: one request at a time, asked again until its reply comes.

use std::time::{Duration, Instant};

use control::protocol::VERSION;
use control::protocol::frame::{self, Deframer, FrameError};
use control::protocol::lockstep::{Answer, AnswerFrame, Hello, Question, QuestionFrame, Ticked};
use control::{Command, Gait, Parameters, Refusal, Sample};

use super::{HilError, Transport};

/// Silence after which the question or its answer is lost: a tick takes a board below 10 ms with both ways.
const QUIET: Duration = Duration::from_millis(100);
/// So often a request is sent before the chip counts as gone.
const TRIES: u32 = 100;
/// The same while it starts: opening the port of a board may reset it, and its loader talks first.
const FIRST_TRIES: u32 = 60;
/// More than this without the reply is babble, not an answer on its way.
const BABBLE: usize = 8 * frame::LONGEST;

/// What was noticed of the line since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Requests asked again, because the reply was damaged or did not come.
    pub resent: u32,
    /// Times that reading went on after bytes that were no message, here.
    pub resynchronised: u32,
    /// Frames that could not be read here.
    pub bad_here: u32,
    /// Frames that the chip could not read since this program spoke to it.
    pub bad_there: u32,
    /// Replies that came twice.
    pub stale: u32,
    /// Bytes that came.
    pub bytes: u64,
    /// Bytes that came and were part of no message.
    pub lost_bytes: u64,
}

/// Asks a chip.
pub struct Client<T> {
    transport: T,
    deframer: Deframer,
    hello: Hello,
    number: u32,
    counts: Counts,
    /// Bytes since the last end of a frame.
    pending: u64,
    /// The last frame was bad.
    out_of_sync: bool,
    /// The chip's count when it was first asked.
    bad_there_before: Option<u32>,
    frame: [u8; frame::LONGEST + 1],
}

impl<T: Transport> Client<T> {
    /// Finds the chip at the other end.
    ///
    /// # Errors
    /// Nobody answers, or in another version of the protocol.
    pub fn connect(transport: T) -> Result<Self, HilError> {
        let hello = Hello { version: VERSION, target: control::protocol::lockstep::Target::Host, controller_bytes: 0 };
        let mut client = Self {
            transport,
            deframer: Deframer::default(),
            hello,
            number: 0,
            counts: Counts::default(),
            pending: 0,
            out_of_sync: false,
            bad_there_before: None,
            frame: [0; frame::LONGEST + 1],
        };
        // Ends whatever the chip may hold of an earlier program's request.
        client.transport.send(&[0])?;
        let Answer::Hello(hello) = client.ask_for(Question::Hello, FIRST_TRIES)? else {
            return Err(HilError::Confused);
        };
        if hello.version != VERSION {
            return Err(HilError::Version { theirs: hello.version });
        }
        client.hello = hello;
        Ok(client)
    }

    /// Answer of the chip to `Hello`: processor and version.
    #[must_use]
    pub fn hello(&self) -> Hello {
        self.hello
    }

    /// What was noticed of the line.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Starts a new controller.
    ///
    /// # Errors
    /// The controller refuses the parameters, or the link fails.
    pub fn start(&mut self, parameters: &Parameters) -> Result<(), HilError> {
        match self.ask(Question::Start(*parameters))? {
            Answer::Started(true) => Ok(()),
            Answer::Started(false) => Err(HilError::Parameters),
            _ => Err(HilError::Confused),
        }
    }

    /// Gives a command; the controller's answer.
    ///
    /// # Errors
    /// The link fails.
    pub fn command(&mut self, command: Command, time_us: u64) -> Result<Result<(), Refusal>, HilError> {
        self.commanded(Question::Command(command, time_us))
    }

    /// Lets the controller keep a gait; its answer.
    ///
    /// # Errors
    /// The link fails.
    pub fn keep_gait(&mut self, gait: &Gait) -> Result<Result<(), Refusal>, HilError> {
        self.commanded(Question::KeepGait(*gait))
    }

    fn commanded(&mut self, question: Question) -> Result<Result<(), Refusal>, HilError> {
        match self.ask(question)? {
            Answer::Commanded(outcome) => Ok(outcome),
            _ => Err(HilError::Confused),
        }
    }

    /// Runs one tick.
    ///
    /// # Errors
    /// The link fails.
    pub fn tick(&mut self, sample: &Sample) -> Result<Ticked, HilError> {
        match self.ask(Question::Tick(*sample))? {
            Answer::Ticked(ticked) => Ok(ticked),
            _ => Err(HilError::Confused),
        }
    }

    fn ask(&mut self, question: Question) -> Result<Answer, HilError> {
        self.number = self.number.wrapping_add(1);
        match self.ask_for(question, TRIES)? {
            Answer::OutOfOrder => Err(HilError::Forgot),
            answer => Ok(answer),
        }
    }

    fn ask_for(&mut self, question: Question, tries: u32) -> Result<Answer, HilError> {
        let request = QuestionFrame { number: self.number, question };
        let start = Instant::now();
        for attempt in 0..tries {
            self.counts.resent += u32::from(attempt > 0);
            let frame = frame::encode(&request, &mut self.frame).map_err(|_| HilError::Confused)?;
            self.transport.send(frame)?;
            if let Some(reply) = self.reply()? {
                let before = *self.bad_there_before.get_or_insert(reply.bad_frames);
                self.counts.bad_there = reply.bad_frames.wrapping_sub(before);
                return Ok(reply.answer);
            }
        }
        Err(HilError::NoAnswer { tries, waited: start.elapsed(), counts: self.counts })
    }

    /// The reply to the present request; `None` where it is damaged or does not come.
    fn reply(&mut self) -> Result<Option<AnswerFrame>, HilError> {
        let mut chunk = [0; 512];
        let mut babble = 0;
        while babble < BABBLE {
            let count = self.transport.receive(&mut chunk, QUIET)?;
            if count == 0 {
                return Ok(None);
            }
            babble += count;
            let mut damaged = false;
            let mut found = None;
            // All of the chunk is read: what comes after the reply is one that comes twice.
            for byte in chunk.iter().take(count) {
                match self.push(*byte) {
                    Some(Ok(reply)) if reply.number == self.number && found.is_none() => found = Some(reply),
                    Some(Ok(_)) => self.counts.stale += 1,
                    // Intact, so this is what the chip says.
                    Some(Err(FrameError::Message)) => return Err(HilError::Confused),
                    Some(Err(_)) => damaged = true,
                    None => {}
                }
            }
            if found.is_some() || damaged {
                return Ok(found);
            }
        }
        Ok(None)
    }

    fn push(&mut self, byte: u8) -> Option<Result<AnswerFrame, FrameError>> {
        self.counts.bytes += 1;
        self.pending += 1;
        let result = self.deframer.push::<AnswerFrame>(byte);
        if byte == 0 {
            let bad = matches!(result, Some(Err(_)));
            if bad {
                self.counts.bad_here += 1;
                self.counts.lost_bytes += self.pending;
            } else if self.out_of_sync && result.is_some() {
                self.counts.resynchronised += 1;
            }
            self.out_of_sync = bad || (self.out_of_sync && result.is_none());
            self.pending = 0;
        }
        result
    }
}
