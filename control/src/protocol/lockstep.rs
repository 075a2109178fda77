//! A host with a simulated plant and a chip with the controller, in lockstep over a serial line.
//!
//! The host sends a [`QuestionFrame`] and waits for the [`AnswerFrame`] of the same number. Without one it asks again: the chip
//! answers a number that it has already served with the same reply and does nothing twice, so that lost and corrupt
//! bytes change no decision.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::{Actuation, Command, Controller, Gait, Parameters, Refusal, Sample, Telemetry};

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct QuestionFrame {
    /// One more than the last, from 0 after [`Question::Hello`].
    pub number: u32,
    /// The question itself.
    pub question: Question,
}

/// What a host can ask of the controller on a chip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to put the parameters on, and one at a time exists")]
pub enum Question {
    /// Who is there? Always served, whatever its number: numbers count on from it.
    Hello,
    /// Run a new controller on these parameters.
    Start(Parameters),
    /// Give it a command at a time, µs.
    Command(Command, u64),
    /// Let it keep a gait.
    KeepGait(Gait),
    /// Runs one control period on this sample.
    Tick(Sample),
}

/// What the chip answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct AnswerFrame {
    /// Number of the question that this answers.
    pub number: u32,
    /// Frames that the chip could not read since it started.
    pub bad_frames: u32,
    /// The answer.
    pub answer: Answer,
}

/// The answers, in the order of the questions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Answer {
    /// To `Hello`.
    Hello(Hello),
    /// To `Start`: whether the controller takes the parameters.
    Started(bool),
    /// To `Command` and `KeepGait`.
    Commanded(Result<(), Refusal>),
    /// To `Tick`.
    Ticked(Ticked),
    /// The question came out of order: no controller was started, or a number was skipped.
    OutOfOrder,
}

/// Who answers. The layout up to `version` stays for ever: it is how ends of different versions find that out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello {
    /// [`super::VERSION`] of the chip.
    pub version: u32,
    /// Processor that runs the controller.
    pub target: Target,
    /// RAM that a controller takes, bytes.
    pub controller_bytes: u32,
}

/// Where the controller runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Target {
    /// RV32IMC under QEMU; costs are instructions.
    Rv32,
    /// ESP32-C3; costs are processor cycles.
    Esp32c3,
    /// ESP32; costs are processor cycles.
    Esp32,
    /// The host itself, in tests; costs mean nothing.
    Host,
}

/// One tick of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Ticked {
    /// Ticks since `Start`.
    pub count: u32,
    /// What [`Controller::tick`] alone cost, in the unit of the [`Target`].
    pub cost: u32,
    /// Deepest stack of any tick since `Start`, bytes; 0 where it is not measured.
    pub stack: u32,
    /// What the bridge is told.
    pub actuation: Actuation,
    /// What the controller believes.
    pub telemetry: Telemetry,
}

/// What a tick took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// In the unit of the [`Target`], wrapping.
    pub time: u32,
    /// Stack, bytes; 0 where it is not measured.
    pub stack: u32,
}

/// What the chip measures around a tick.
pub trait Meter {
    /// Processor that runs the controller.
    const TARGET: Target;
    /// Runs `tick`; its result and what it took.
    fn measure<R>(&mut self, tick: impl FnOnce() -> R) -> (R, Cost);
}

/// Chip's end of the lockstep: answers every question once.
pub struct Server<M> {
    meter: M,
    controller: Option<Controller>,
    count: u32,
    /// Deepest stack since the start, bytes.
    stack: u32,
    last: Option<AnswerFrame>,
}

impl<M: Meter> Server<M> {
    /// Creates a server without a controller: `Start` makes it.
    pub fn new(meter: M) -> Self {
        Self { meter, controller: None, count: 0, stack: 0, last: None }
    }

    /// Serves a request; `bad_frames` of the deframer goes into the reply.
    pub fn serve(&mut self, request: &QuestionFrame, bad_frames: u32) -> AnswerFrame {
        if let Some(last) = &mut self.last
            && last.number == request.number
            && request.question != Question::Hello
        {
            last.bad_frames = bad_frames;
            return *last;
        }
        let expected = self.last.map(|last| last.number.wrapping_add(1));
        let answer = match request.question {
            Question::Hello => Answer::Hello(self.hello()),
            _ if expected != Some(request.number) => {
                return AnswerFrame { number: request.number, bad_frames, answer: Answer::OutOfOrder };
            }
            question => self.answer(question),
        };
        let reply = AnswerFrame { number: request.number, bad_frames, answer };
        self.last = Some(reply);
        reply
    }

    fn hello(&self) -> Hello {
        Hello {
            version: super::VERSION,
            target: M::TARGET,
            controller_bytes: u32::try_from(size_of::<Controller>()).unwrap_or(u32::MAX),
        }
    }

    fn answer(&mut self, question: Question) -> Answer {
        match (question, &mut self.controller) {
            (Question::Hello, _) => Answer::Hello(self.hello()),
            (Question::Start(parameters), controller) => {
                *controller = Controller::new(&parameters).ok();
                self.count = 0;
                self.stack = 0;
                Answer::Started(self.controller.is_some())
            }
            (_, None) => Answer::OutOfOrder,
            (Question::Command(command, time_us), Some(controller)) => {
                Answer::Commanded(controller.command(command, time_us))
            }
            (Question::KeepGait(gait), Some(controller)) => Answer::Commanded(controller.keep_gait(&gait)),
            (Question::Tick(sample), Some(controller)) => {
                let (actuation, cost) = self.meter.measure(|| controller.tick(&sample));
                self.count = self.count.wrapping_add(1);
                self.stack = self.stack.max(cost.stack);
                Answer::Ticked(Ticked {
                    count: self.count,
                    cost: cost.time,
                    stack: self.stack,
                    actuation,
                    telemetry: controller.telemetry(),
                })
            }
        }
    }
}
