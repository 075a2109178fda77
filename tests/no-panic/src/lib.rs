//! `control` alone, without std, behind C functions. A panic that can be reached needs `a_panic_is_reachable`, which
//! exists nowhere: the linker names it and stops. A library on the host, a program on the chips' target.
//!
//! The texts of errors (`Display`) are left out: they are for the host, and firmware reports numbers.
#![no_std]

use control::gait::Name;
use control::parameters::{SetError, table};
use control::protocol::frame::{Deframer, FrameError, LONGEST, encode};
use control::protocol::lockstep::{AnswerFrame, Cost, Meter, QuestionFrame, Server, Target};
use control::protocol::secure::{
    Accepted, Caller, HELLO, Key, Nonce, Opened, Opener, Rejected, Sealer, SessionReceiver, notice,
};
use control::protocol::{dongle, pairing, radio};
use control::{Actuation, Command, Controller, Gait, ParameterError, Parameters, Refusal, Sample, Telemetry};

// `c` is here for memcpy and memset, which the compiler calls; on the chips' target its own library has them.
#[cfg_attr(not(target_os = "none"), link(name = "c"))]
unsafe extern "C" {
    safe fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    a_panic_is_reachable()
}

/// The host's compiled `core` names it; nothing unwinds here.
#[cfg(not(target_os = "none"))]
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}

/// Parameters are checked and a controller is made.
#[unsafe(no_mangle)]
pub extern "C" fn make(parameters: &Parameters, made: &mut Result<Controller, ParameterError>) {
    *made = Controller::new(parameters);
}

/// Any name of a parameter, and any value at any index.
#[unsafe(no_mangle)]
pub extern "C" fn set_parameter(
    parameters: &Parameters,
    name: &&str,
    index: u16,
    value: f32,
    changed: &mut Result<Parameters, SetError>,
) -> f32 {
    *changed = parameters.with(table::find(name).unwrap_or(index), value);
    table::get(parameters, index).unwrap_or_default()
}

/// Any command at any time.
#[unsafe(no_mangle)]
pub extern "C" fn command(
    controller: &mut Controller,
    command: &Command,
    time_us: u64,
    answer: &mut Result<(), Refusal>,
) {
    *answer = controller.command(*command, time_us);
}

/// Any gait, kept. What is played of it is a tick's business.
#[unsafe(no_mangle)]
pub extern "C" fn keep_gait(controller: &mut Controller, gait: &Gait, answer: &mut Result<(), Refusal>) {
    *answer = controller.keep_gait(gait);
}

/// A gait from any texts and numbers.
#[unsafe(no_mangle)]
pub extern "C" fn make_gait(
    name: &&str,
    speeds: &&[f32],
    oscillations: &&[[f32; 2]],
    steps: &&[u8],
    interval_ms: u16,
    made: &mut Option<Result<Gait, Refusal>>,
) -> u32 {
    *made = Name::new(name).map(|name| Gait::new(name, speeds, oscillations, steps, interval_ms, true));
    let sound = made.as_ref().and_then(|made| made.as_ref().ok());
    sound.map_or(0, |gait| gait.steps().fold(gait.id(), |sum, step| sum.wrapping_add(step.into())))
}

/// `Controller::tick` on an arbitrary sample.
#[unsafe(no_mangle)]
pub extern "C" fn tick(
    controller: &mut Controller,
    sample: &Sample,
    actuation: &mut Actuation,
    telemetry: &mut Telemetry,
) {
    *actuation = controller.tick(sample);
    *telemetry = controller.telemetry();
    #[cfg(feature = "planted")]
    {
        let table = [1.0, 2.0, 3.0];
        actuation.duty = table[sample.angle.0 as usize];
    }
}

/// Measures nothing.
pub struct Unmeasured;

impl Meter for Unmeasured {
    const TARGET: Target = Target::Host;

    fn measure<R>(&mut self, tick: impl FnOnce() -> R) -> (R, Cost) {
        (tick(), Cost::default())
    }
}

/// Any byte of the host with the plant, and the reply.
#[unsafe(no_mangle)]
pub extern "C" fn lockstep(
    server: &mut Server<Unmeasured>,
    deframer: &mut Deframer,
    byte: u8,
    reply: &mut [u8; LONGEST + 1],
) -> usize {
    match deframer.push::<QuestionFrame>(byte) {
        Some(Ok(request)) => encode(&server.serve(&request, deframer.bad()), reply).map_or(0, <[u8]>::len),
        _ => 0,
    }
}

/// The host's side of it.
#[unsafe(no_mangle)]
pub extern "C" fn lockstep_reply(
    deframer: &mut Deframer,
    byte: u8,
    reply: &mut Option<Result<AnswerFrame, FrameError>>,
) {
    *reply = deframer.push(byte);
}

/// Any byte of the host to the dongle, and its answer.
#[unsafe(no_mangle)]
pub extern "C" fn dongle_request(
    deframer: &mut Deframer,
    byte: u8,
    request: &mut Option<Result<dongle::ToDongle, FrameError>>,
) {
    *request = deframer.push(byte);
}

/// Any message of the dongle.
#[unsafe(no_mangle)]
pub extern "C" fn dongle_answer(answer: &dongle::FromDongle, frame: &mut [u8; LONGEST + 1]) -> usize {
    encode(answer, frame).map_or(0, <[u8]>::len)
}

/// Any frame on the air to a robot.
#[unsafe(no_mangle)]
pub extern "C" fn ear_hears(
    receiver: &mut SessionReceiver,
    frame: &[u8; radio::LONGEST],
    length: usize,
    nonce: &Nonce,
    heard: &mut Option<Result<Accepted<radio::Downlink>, Rejected>>,
) {
    *heard = frame.get(..length).map(|frame| receiver.accept(frame, || *nonce));
}

/// A robot's ear, and its voice in a session.
#[unsafe(no_mangle)]
pub extern "C" fn session_receiver_and_sealer(key: &Key, receiver: &mut SessionReceiver, voice: &mut Sealer) {
    *receiver = SessionReceiver::new(key.clone());
    *voice = Sealer::robot(key.clone());
}

/// Any message of the robot.
#[unsafe(no_mangle)]
pub extern "C" fn robot_tells(voice: &mut Sealer, told: &radio::Uplink, frame: &mut [u8; radio::LONGEST]) -> usize {
    voice.seal(told, frame).map_or(0, |(frame, _)| frame.len())
}

/// Any order of the console.
#[unsafe(no_mangle)]
pub extern "C" fn console_downlink(
    voice: &mut Sealer,
    order: &radio::Downlink,
    frame: &mut [u8; radio::LONGEST],
) -> usize {
    voice.seal(order, frame).map_or(0, |(frame, _)| frame.len())
}

/// The same to all.
#[unsafe(no_mangle)]
pub extern "C" fn console_orders_all(
    voice: &mut Sealer,
    order: &radio::Downlink,
    frame: &mut [u8; radio::LONGEST],
) -> usize {
    voice.seal_to_all(order, frame).map_or(0, |(frame, _)| frame.len())
}

/// What the robot says to a console of another version.
#[unsafe(no_mangle)]
pub extern "C" fn robot_notices(frame: &mut [u8; radio::LONGEST]) {
    frame.iter_mut().zip(notice()).for_each(|(slot, byte)| *slot = byte);
}

/// A console calls.
#[unsafe(no_mangle)]
pub extern "C" fn console_calls(key: &Key, nonce: &Nonce, caller: &mut Caller, frame: &mut [u8; HELLO]) {
    *caller = Caller::new(key.clone(), *nonce);
    *frame = caller.hello();
}

/// Any frame on the air to a console that calls.
#[unsafe(no_mangle)]
pub extern "C" fn console_is_welcomed(
    caller: &Caller,
    frame: &[u8; radio::LONGEST],
    length: usize,
    session: &mut Option<Result<(Sealer, Opener), Rejected>>,
) {
    *session = frame.get(..length).map(|frame| caller.welcomed(frame));
}

/// Any frame on the air to a console in a session.
#[unsafe(no_mangle)]
pub extern "C" fn console_opens(
    opener: &mut Opener,
    frame: &[u8; radio::LONGEST],
    length: usize,
    opened: &mut Option<Result<Opened<radio::Uplink>, Rejected>>,
) {
    *opened = frame.get(..length).map(|frame| opener.open(frame));
}

/// Any byte of the host that pairs a robot.
#[unsafe(no_mangle)]
pub extern "C" fn pairing_request(
    deframer: &mut Deframer,
    byte: u8,
    request: &mut Option<Result<pairing::PairingRequest, FrameError>>,
) {
    *request = deframer.push(byte);
}

/// Any answer to it.
#[unsafe(no_mangle)]
pub extern "C" fn pairing_answer(answer: &pairing::PairingReply, frame: &mut [u8; LONGEST + 1]) -> usize {
    encode(answer, frame).map_or(0, <[u8]>::len)
}

/// The host's side of it.
#[unsafe(no_mangle)]
pub extern "C" fn pairing_host(
    deframer: &mut Deframer,
    byte: u8,
    request: &pairing::PairingRequest,
    frame: &mut [u8; LONGEST + 1],
    answer: &mut Option<Result<pairing::PairingReply, FrameError>>,
) -> usize {
    *answer = deframer.push(byte);
    encode(request, frame).map_or(0, <[u8]>::len)
}

/// A row of telemetry.
#[unsafe(no_mangle)]
pub extern "C" fn radio_row(code: &control::AdcCode, telemetry: &Telemetry, row: &mut radio::PackedTick) {
    *row = radio::PackedTick::new(*code, telemetry);
}
